#include "base/json_value.h"

#include <limits>

#include "base/error.h"
#include "base/json_text.h"

namespace tessera {

std::optional<JsonValue> JsonValue::find(std::string_view name) const {
  if (!value_->is_object()) refuse("is not an object");
  const auto found = value_->find(std::string(name));
  if (found == value_->end()) return std::nullopt;
  return JsonValue(*found, file_, pointer_ + pointer_step(name));
}

JsonValue JsonValue::member(std::string_view name) const {
  if (auto found = find(name)) return *std::move(found);
  throw InputError(file_, pointer_ + pointer_step(name), "is missing");
}

std::vector<std::pair<std::string, JsonValue>> JsonValue::members() const {
  if (!value_->is_object()) refuse("is not an object");
  std::vector<std::pair<std::string, JsonValue>> all;
  all.reserve(value_->size());
  for (const auto& [name, value] : value_->items())
    all.emplace_back(name, JsonValue(value, file_, pointer_ + pointer_step(name)));
  return all;
}

std::vector<JsonValue> JsonValue::elements() const {
  if (!value_->is_array()) refuse("is not an array");
  std::vector<JsonValue> all;
  all.reserve(value_->size());
  for (const nlohmann::json& element : *value_)
    all.push_back(JsonValue(element, file_, pointer_ + "/" + std::to_string(all.size())));
  return all;
}

const std::string& JsonValue::text() const {
  if (!value_->is_string()) refuse("is not a text");
  return value_->get_ref<const std::string&>();
}

bool JsonValue::flag() const {
  if (!value_->is_boolean()) refuse("is not true or false");
  return value_->get<bool>();
}

double JsonValue::number() const {
  if (!value_->is_number()) refuse("is not a number");
  return value_->get<double>();
}

std::optional<double> JsonValue::number_or_null() const {
  if (value_->is_null()) return std::nullopt;
  if (!value_->is_number()) refuse("is not a number or null");
  return value_->get<double>();
}

std::vector<double> JsonValue::numbers() const {
  bool all_numbers = value_->is_array();
  for (std::size_t i = 0; all_numbers && i < value_->size(); ++i) all_numbers = (*value_)[i].is_number();
  if (!all_numbers) refuse("is not an array of numbers");
  return value_->get<std::vector<double>>();
}

std::uint64_t JsonValue::count() const {
  if (!value_->is_number_unsigned()) refuse("is not a whole number of at least 0");
  return value_->get<std::uint64_t>();
}

int JsonValue::whole() const {
  const bool below = value_->is_number_integer() && !value_->is_number_unsigned() &&
                     value_->get<std::int64_t>() >= std::numeric_limits<int>::min();
  const bool above =
      value_->is_number_unsigned() && value_->get<std::uint64_t>() <= std::uint64_t{std::numeric_limits<int>::max()};
  if (!below && !above) refuse("is not a whole number of 32 bits");
  return value_->get<int>();
}

void JsonValue::refuse(const std::string& fault) const { throw InputError(file_, pointer_, fault); }

}  // namespace tessera
