#include "base/key_table.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/former_keys.h"
#include "base/text.h"

namespace tessera {
namespace {

using nlohmann::json;

[[noreturn]] void refuse(const KeyInfo& key, const json& value, const std::string& expected) {
  const std::string found = value.is_string() ? value.get<std::string>() : value.dump();
  throw UsageError(fmt::format("{}: '{}' is not {}", key.name, escape_control(found, 80), expected));
}

std::string range_text(const KeyInfo& key) {
  return fmt::format("from {:.15g} to {:.15g}{}{}", key.min, key.max, key.unit.empty() ? "" : " ", key.unit);
}

// The factors that K, M, G, or KiB, MiB, GiB behind a number of bytes stand for.
std::optional<double> byte_unit(std::string_view text) {
  if (text.ends_with("iB") && text.size() == 3) text.remove_suffix(2);
  if (text == "K" || text == "k") return 0x1p10;
  if (text == "M") return 0x1p20;
  if (text == "G") return 0x1p30;
  return std::nullopt;
}

template <class T>
T parse_number(const KeyInfo& key, const json& value) {
  constexpr bool kWhole = std::integral<T>;
  const std::string expected = (kWhole ? "a whole number " : "a number ") + range_text(key);
  T number = 0;
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    const std::string_view rest(end, text.data() + text.size());
    if (error != std::errc()) refuse(key, value, expected);
    if (key.unit == "bytes" && !rest.empty()) {
      const std::optional<double> unit = byte_unit(rest);
      if (!unit || static_cast<double>(number) * *unit > key.max) refuse(key, value, expected);
      number = static_cast<T>(static_cast<double>(number) * *unit);
    } else if (!rest.empty()) {
      refuse(key, value, expected);
    }
  } else if (kWhole
                 ? value.is_number_integer() && !(value.is_number_unsigned() && value.get<std::uint64_t>() > INT64_MAX)
                 : value.is_number()) {
    number = value.get<T>();
  } else {
    refuse(key, value, expected);
  }
  const auto in_double = static_cast<double>(number);
  if (!(in_double >= key.min && in_double <= key.max)) refuse(key, value, expected);
  return number;
}

bool parse_bool(const KeyInfo& key, const json& value) {
  if (value.is_boolean()) return value.get<bool>();
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    if (text == "true" || text == "on" || text == "1") return true;
    if (text == "false" || text == "off" || text == "0") return false;
  }
  refuse(key, value, "true or false");
}

std::string parse_text(const KeyInfo& key, const json& value) {
  constexpr std::size_t kMaxBytes = 4096;
  if (!value.is_string()) refuse(key, value, "a text");
  if (value.get_ref<const std::string&>().size() > kMaxBytes)
    throw UsageError(fmt::format("{}: a text of more than {} bytes", key.name, kMaxBytes));
  const auto& text = value.get_ref<const std::string&>();
  if (escape_control(text, kMaxBytes) != text) refuse(key, value, "a text in UTF-8 without control characters");
  return text;
}

std::string parse_choice(const KeyInfo& key, const json& value) {
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    for (const std::string_view choice : key.choices)
      if (text == choice) return std::string(choice);
    if (const FormerKey* former = find_former_key(fmt::format("{}={}", key.name, text)))
      throw UsageError(fmt::format("{}: '{}' was removed. {}", key.name, text, former->reason));
  }
  refuse(key, value, fmt::format("one of {}", fmt::join(key.choices, ", ")));
}

}  // namespace

KeyValue parse_key_value(const KeyInfo& key, const KeyValue& like, const json& value) {
  switch (like.index()) {
    case 0:
      return parse_number<std::int64_t>(key, value);
    case 1:
      return parse_number<double>(key, value);
    case 2:
      return parse_bool(key, value);
    default:
      return key.choices.empty() ? parse_text(key, value) : parse_choice(key, value);
  }
}

double shortest_decimal(float value) {
  std::array<char, 64> text;
  const char* end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  double number = 0;
  std::from_chars(text.data(), end, number);
  return number;
}

json key_value_json(const KeyValue& value) {
  return std::visit([](const auto& v) { return json(v); }, value);
}

PlausibleRange key_ends(const KeyInfo& key, double value, double default_value) {
  PlausibleRange ends = {value / 2, value * 2};
  if (key.ends && default_value != 0)
    ends = {value * (key.ends->low / default_value), value * (key.ends->high / default_value)};
  return {std::clamp(ends.low, key.min, key.max), std::clamp(ends.high, key.min, key.max)};
}

json describe_key(const KeyInfo& key, const KeyValue& default_value) {
  static constexpr const char* kTypes[] = {"integer", "number", "boolean", "choice"};
  const bool text = default_value.index() == 3 && key.choices.empty();
  json row = {{"key", key.name},
              {"type", text ? "text" : kTypes[default_value.index()]},
              {"unit", key.unit},
              {"default", key_value_json(default_value)},
              {"meaning", key.meaning}};
  if (default_value.index() < 2) {
    row["min"] = key.min;
    row["max"] = key.max;
    if (key.assumed() || key.ends) {
      const bool whole = default_value.index() == 0;
      const double value =
          whole ? static_cast<double>(std::get<std::int64_t>(default_value)) : std::get<double>(default_value);
      const PlausibleRange ends = key_ends(key, value, value);
      row["low"] = whole ? std::floor(ends.low) : ends.low;
      row["high"] = whole ? std::floor(ends.high) : ends.high;
    }
  }
  if (!key.choices.empty()) row["choices"] = key.choices;
  if (!key.source.empty()) row["source"] = key.source;
  if (key.timing) row["timing"] = true;
  return row;
}

std::string unknown_key_message(std::string_view key, std::span<const std::string> known) {
  if (const FormerKey* former = find_former_key(key); former != nullptr && former->now.empty())
    return fmt::format("key '{}' was removed. {}", key, former->reason);
  const std::string nearest = nearest_name(key, known);
  std::string message = fmt::format("unknown key '{}'", escape_control(key, 80));
  if (!nearest.empty()) message += fmt::format("; did you mean '{}'?", nearest);
  return message;
}

}  // namespace tessera
