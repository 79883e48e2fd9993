#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace tessera {

// Parses JSON from an untrusted file. Throws InputError with the byte offset for text that is not JSON, for values
// nested deeper than `max_depth` and for numbers that overflow a double.
nlohmann::json parse_json(std::string_view text, const std::string& file, int max_depth = 64);

// The same for hand-written files: also refuses an object that has a key twice, with its JSON pointer.
nlohmann::json parse_unique_json(std::string_view text, const std::string& file, int max_depth = 64);

// The same from a stream, for files that are too large for the memory: calls keep(element) for each element of the array
// `array` of the outermost object, and leaves out those for which it returns false. Elements must be objects.
nlohmann::json parse_json_array(std::istream& stream, const std::string& file, std::string_view array,
                                const std::function<bool(const nlohmann::json&)>& keep, int max_depth = 64);

// JSON text. Bytes of a file's name that are no UTF-8, which JSON cannot hold, become U+FFFD. `indent` < 0: one line.
std::string json_text(const nlohmann::json& value, int indent = -1);

// A value as people write it: texts without their quotes.
std::string value_text(const nlohmann::json& value);

// A whole number that an int holds. Throws nlohmann::json::exception for anything else: get<int>() would convert 1e20
// or true somehow.
int whole_number(const nlohmann::json& value);

// One value of a comma-separated file: null is empty, numbers as JSON has them, texts quoted where they must be.
std::string csv_cell(const nlohmann::json& value);

// One step of a JSON pointer (RFC 6901): "/" and the key, its own '~' and '/' escaped.
std::string pointer_step(std::string_view key);

// A value of a JSON file with its place in the file. A value of another type than the wanted one is refused with an
// InputError that names the file and the JSON pointer. Refers to the document, which must outlive it.
class JsonValue {
 public:
  JsonValue(const nlohmann::json& document, std::string file) : JsonValue(document, std::move(file), "") {}

  // Members of an object. member() refuses a missing member, find() does not; both refuse a value that is no object.
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
  bool is_null() const;
  bool is_count() const;

  [[noreturn]] void refuse(const std::string& fault) const;

 private:
  JsonValue(const nlohmann::json& value, std::string file, std::string pointer)
      : value_(&value), file_(std::move(file)), pointer_(std::move(pointer)) {}

  const nlohmann::json* value_;
  std::string file_, pointer_;
};

}  // namespace tessera
