#include "base/former_keys.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace tessera {
namespace {

constexpr auto kFormerKeys = std::to_array<FormerKey>({
    {"energy.leakage_mw", "", "Leakage follows the area (area.*) now: set energy.leakage_mw_per_mm2, at 0.8 V."},
    {"resolve.k_cut", "resolve.cut_speed", ""},
    {"resolve.k_fast1", "resolve.half_rate_speed", ""},
    {"resolve.k_fast2", "resolve.quarter_rate_speed", ""},
    {"resolve.k_stat", "resolve.reuse_speed", ""},
});
static_assert(std::ranges::is_sorted(kFormerKeys, {}, &FormerKey::name));

}  // namespace

std::span<const FormerKey> former_keys() { return kFormerKeys; }

const FormerKey* find_former_key(std::string_view name) {
  const auto found = std::ranges::lower_bound(kFormerKeys, name, {}, &FormerKey::name);
  return found != kFormerKeys.end() && found->name == name ? &*found : nullptr;
}

std::string current_key(const std::string& name) {
  const FormerKey* former = find_former_key(name);
  return former != nullptr && !former->now.empty() ? std::string(former->now) : name;
}

std::string former_key_note(const FormerKey& key) { return fmt::format("{} is called {} now", key.name, key.now); }

}  // namespace tessera
