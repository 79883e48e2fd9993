#pragma once

#include <nlohmann/json_fwd.hpp>

#include "base/key_table.h"

namespace tessera::gpu {

// Whether `value` is a text that means a multiple of a key's present value: "x1.3" or "*1.3".
bool is_relative(const nlohmann::json& value);

// Returns `value`, or, if it is relative, that multiple of `now`. Throws UsageError for a text that is no factor, for
// multiples of 0, and for a factor that does not keep a whole number whole, naming the nearest whole numbers.
nlohmann::json absolute_value(const KeyInfo& key, const KeyValue& now, const nlohmann::json& value);

}  // namespace tessera::gpu
