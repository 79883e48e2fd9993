#include "base/json_text.h"

#include <algorithm>
#include <climits>
#include <cstdint>
#include <istream>
#include <set>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"

namespace tessera {
namespace {

// Checked before parsing: the parser copes with any depth, but code that walks its result recursively may not.
void check_depth(std::string_view text, const std::string& file, int max_depth) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\')
        ++i;
      else if (c == '"')
        in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > max_depth)
        throw InputError(file, fmt::format("byte {}", i), fmt::format("JSON nests deeper than {} levels", max_depth));
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
}

}  // namespace

std::string json_text(const nlohmann::json& value, int indent) {
  return value.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

namespace {

// Recognizes the commonest mistake in manually written JSON, a trailing comma before the place where parsing stopped.
std::string hint(std::string_view text, std::size_t byte) {
  const std::size_t at = std::min(byte > 0 ? byte - 1 : 0, text.size());
  if (at >= text.size() || (text[at] != '}' && text[at] != ']')) return "";
  const std::size_t before = text.find_last_not_of(" \t\r\n", at == 0 ? 0 : at - 1);
  if (before == std::string_view::npos || text[before] != ',') return "";
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(before), '\n');
  return fmt::format("; remove the comma before '{}' in line {}", text[at], line);
}
std::string hint(std::istream&, std::size_t) { return ""; }

// Parses a text or a stream.
template <class Input>
nlohmann::json parse_input(Input& input, const std::string& file, const nlohmann::json::parser_callback_t& visit) {
  try {
    return nlohmann::json::parse(input, visit);
  } catch (const nlohmann::json::parse_error& error) {
    // "[json.exception.parse_error.101] parse error at line 1, column 5: syntax error ..."
    std::string reason = error.what();
    const std::size_t colon = reason.find(": ");
    if (colon != std::string::npos) reason = reason.substr(colon + 2);
    throw InputError(file, fmt::format("byte {}", error.byte), "is not JSON: " + reason + hint(input, error.byte));
  } catch (const nlohmann::json::exception& error) {
    throw InputError(file, "", fmt::format("is not JSON: {}", error.what()));
  }
}

nlohmann::json parse(std::string_view text, const std::string& file, int max_depth,
                     const nlohmann::json::parser_callback_t& visit) {
  check_depth(text, file, max_depth);
  return parse_input(text, file, visit);
}

}  // namespace

nlohmann::json parse_json(std::string_view text, const std::string& file, int max_depth) {
  return parse(text, file, max_depth, nullptr);
}

nlohmann::json parse_json_array(std::istream& stream, const std::string& file, std::string_view array,
                                const std::function<bool(const nlohmann::json&)>& keep, int max_depth) {
  using Event = nlohmann::json::parse_event_t;
  bool inside = false;
  return parse_input(stream, file, [&](int depth, Event event, nlohmann::json& value) {
    if (depth >= max_depth && (event == Event::object_start || event == Event::array_start))
      throw InputError(file, "", fmt::format("JSON nests deeper than {} levels", max_depth));
    if (event == Event::key && depth == 1) inside = value.get_ref<const std::string&>() == array;
    return !(inside && event == Event::object_end && depth == 2) || keep(value);
  });
}

nlohmann::json parse_unique_json(std::string_view text, const std::string& file, int max_depth) {
  using Event = nlohmann::json::parse_event_t;
  struct Object {
    std::set<std::string> keys;
    std::string latest;
  };
  std::vector<Object> open;
  return parse(text, file, max_depth, [&](int, Event event, nlohmann::json& value) {
    if (event == Event::object_start) open.emplace_back();
    if (event == Event::object_end) open.pop_back();
    if (event == Event::key) {
      open.back().latest = value.get<std::string>();
      if (!open.back().keys.insert(open.back().latest).second) {
        std::string pointer;
        for (const Object& object : open) pointer += pointer_step(object.latest);
        throw InputError(file, pointer, "is there twice");
      }
    }
    return true;
  });
}

namespace {

bool fits_int(const nlohmann::json& value) {
  return value.is_number_unsigned() ? value.get<std::uint64_t>() <= INT_MAX
                                    : value.is_number_integer() && value.get<std::int64_t>() >= INT_MIN &&
                                          value.get<std::int64_t>() <= INT_MAX;
}

}  // namespace

std::string value_text(const nlohmann::json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

int whole_number(const nlohmann::json& value) {
  if (!fits_int(value))
    throw nlohmann::json::type_error::create(
        302, fmt::format("type must be a whole number of 32 bits, but is {}", value.type_name()), &value);
  return static_cast<int>(value.get<std::int64_t>());
}

std::string csv_cell(const nlohmann::json& value) {
  if (value.is_null()) return "";
  if (!value.is_string()) return json_text(value);
  const std::string& text = value.get_ref<const std::string&>();
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::string pointer_step(std::string_view key) {
  std::string step = "/";
  for (const char c : key) {
    if (c == '~')
      step += "~0";
    else if (c == '/')
      step += "~1";
    else
      step += c;
  }
  return step;
}

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
  if (!fits_int(*value_)) refuse("is not a whole number of 32 bits");
  return value_->get<int>();
}

void JsonValue::refuse(const std::string& fault) const { throw InputError(file_, pointer_, fault); }

bool JsonValue::is_null() const { return value_->is_null(); }
bool JsonValue::is_count() const { return value_->is_number_unsigned(); }

}  // namespace tessera
