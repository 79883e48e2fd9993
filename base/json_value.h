#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace tessera {

// A value of a JSON file with its place in it. What is not of the wanted type is refused: InputError with the file and
// the JSON pointer. Refers to the document, which must outlive it.
class JsonValue {
 public:
  JsonValue(const nlohmann::json& document, std::string file) : JsonValue(document, std::move(file), "") {}

  // Members of an object. member() refuses what is missing, find() does not; both refuse what is no object.
  JsonValue member(std::string_view name) const;
  std::optional<JsonValue> find(std::string_view name) const;
  std::vector<std::pair<std::string, JsonValue>> members() const;
  std::vector<JsonValue> elements() const;

  const std::string& text() const;
  bool flag() const;
  double number() const;
  std::optional<double> number_or_null() const;
  std::vector<double> numbers() const;
  std::uint64_t count() const;  // a whole number of 64 bits, not below 0
  int whole() const;            // a whole number that an int holds
  bool is_null() const { return value_->is_null(); }
  bool is_count() const { return value_->is_number_unsigned(); }

  [[noreturn]] void refuse(const std::string& fault) const;

 private:
  JsonValue(const nlohmann::json& value, std::string file, std::string pointer)
      : value_(&value), file_(std::move(file)), pointer_(std::move(pointer)) {}

  const nlohmann::json* value_;
  std::string file_, pointer_;
};

}  // namespace tessera
