#include "gpu/relative_value.h"

#include <charconv>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/text.h"

namespace tessera::gpu {

using nlohmann::json;

bool is_relative(const json& value) {
  if (!value.is_string()) return false;
  const std::string& text = value.get_ref<const std::string&>();
  return !text.empty() && (text[0] == 'x' || text[0] == '*');
}

json absolute_value(const KeyInfo& key, const KeyValue& now, const json& value) {
  if (!is_relative(value)) return value;
  const std::string& text = value.get_ref<const std::string&>();
  // A word of the key may look like a factor.
  if (!std::holds_alternative<double>(now) && !std::holds_alternative<std::int64_t>(now)) return value;
  double factor = 0;
  const auto [end, error] = std::from_chars(text.data() + 1, text.data() + text.size(), factor);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(factor) || factor < 0)
    throw UsageError(
        fmt::format("{}: '{}' is no multiple: write xFACTOR, as in x1.3", key.name, escape_control(text, 80)));
  if (now == KeyValue(0.0) || now == KeyValue(std::int64_t{0}))
    throw UsageError(fmt::format("{}: is 0, and so is any multiple of it: give the value itself", key.name));
  if (const double* number = std::get_if<double>(&now)) return *number * factor;
  const std::int64_t whole = std::get<std::int64_t>(now);
  const double product = static_cast<double>(whole) * factor, nearest = std::nearbyint(product);
  if (!(std::abs(product) < 9007199254740992.0)) return product;  // too large to round: out of range in any case
  if (std::abs(product - nearest) > 1e-9 * std::max(1.0, std::abs(product)))
    throw UsageError(fmt::format("{0}: {1} of {2} is {3:.6g}, not a whole number: set {0}={4:.0f} or {0}={5:.0f}",
                                 key.name, escape_control(text, 80), whole, product, std::floor(product),
                                 std::ceil(product)));
  return static_cast<std::int64_t>(nearest);
}

}  // namespace tessera::gpu
