#pragma once

#include <nlohmann/json_fwd.hpp>

#include "base/key_table.h"

namespace tessera::gpu {

// Whether `value` is a text that is meant as a multiple of what a key is now: "x1.3" or "*1.3".
bool is_relative(const nlohmann::json& value);

// `value` as it is, or, where it is relative, that multiple of `now`. Throws UsageError for what is no factor, for
// multiples of 0, and for a whole number that the factor does not keep whole, naming the whole ones beside it.
nlohmann::json absolute_value(const KeyInfo& key, const KeyValue& now, const nlohmann::json& value);

}  // namespace tessera::gpu
