#include "base/option_numbers.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"

namespace tessera {
namespace {

// strtol and strtod skip leading blanks and take signs; an option's numbers have neither blanks nor a plus.
bool starts_plainly(const std::string& text) {
  return !text.empty() && ((text[0] >= '0' && text[0] <= '9') || text[0] == '.' || text[0] == '-');
}

}  // namespace

void refuse_value(const std::string& option, const std::string& text, const char* form) {
  throw UsageError(fmt::format("{} {}: expected {}", option, escape_control(text, 40), form));
}

std::vector<long> parse_whole_numbers(const std::string& option, const std::string& text, char separator,
                                      std::size_t count, const char* form) {
  std::vector<long> numbers;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) {
    char* end = nullptr;
    const long value = std::strtol(part.c_str(), &end, 10);
    if (!starts_plainly(part) || *end != '\0' || value < 0 || value > 100000000) refuse_value(option, text, form);
    numbers.push_back(value);
  }
  if (numbers.size() != count || text.empty() || text.back() == separator) refuse_value(option, text, form);
  return numbers;
}

ImageSize parse_size(const std::string& option, const std::string& text) {
  constexpr const char* kForm = "WIDTHxHEIGHT, 1 to 16384 each";
  const std::vector<long> size = parse_whole_numbers(option, text, 'x', 2, kForm);
  for (const long side : size)
    if (side < 1 || side > 16384) refuse_value(option, text, kForm);
  return {static_cast<int>(size[0]), static_cast<int>(size[1])};
}

FrameRange parse_frames(const std::string& option, const std::string& text) {
  constexpr const char* kForm = "A:B with A < B";
  const std::vector<long> range = parse_whole_numbers(option, text, ':', 2, kForm);
  if (range[0] >= range[1]) refuse_value(option, text, kForm);
  return {static_cast<int>(range[0]), static_cast<int>(range[1])};
}

NumberPair parse_pair(const std::string& option, const std::string& text, const char* form) {
  const std::size_t at = text.find(':');
  if (at == std::string::npos) refuse_value(option, text, form);
  const auto number = [&](const std::string& part) {
    char* end = nullptr;
    const double value = std::strtod(part.c_str(), &end);
    if (!starts_plainly(part) || *end != '\0' || !std::isfinite(value)) refuse_value(option, text, form);
    return value;
  };
  return {number(text.substr(0, at)), number(text.substr(at + 1))};
}

double check_number(const std::string& option, double value, double low, double high, bool open) {
  if (value >= low && value <= high && !(open && value == low)) return value;
  throw UsageError(fmt::format("{} {}: expected a number in {}{}, {}]", option, value, open ? "(" : "[", low, high));
}

bool sets_key(const std::vector<std::string>& sets, const std::string& key) {
  return std::any_of(sets.begin(), sets.end(), [&](const std::string& set) { return set.starts_with(key + "="); });
}

}  // namespace tessera
