#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "base/counter.h"
#include "memory/ledger.h"
#include "memory/line_cache.h"

namespace tessera::memory {

// Counters of the shared L2: lines that texture caches, pixel shaders, tessellators and resolve units requested.
struct L2Counters {
  std::uint64_t requests = 0;
  std::uint64_t misses = 0;
  std::uint64_t attribute_requests = 0;
};

// The cache that all tile cores share, in front of the external memory. Textures, displacement maps, records of base patches
// and reads of the previous frame go through it; all other traffic bypasses the L2. One thread uses it, in emulated order.
class L2 {
 public:
  struct Spec {
    std::int64_t bytes, ways, line_bytes;
  };
  explicit L2(const Spec& spec)
      : cache_(spec.bytes, spec.ways, spec.line_bytes), line_bytes_(static_cast<std::uint64_t>(spec.line_bytes)) {}

  // Reads a line. A miss returns false and charges one line to the ledger as a read of `unit`.
  bool read(std::uint32_t line, Purpose purpose = Purpose::kTexture, Unit unit = Unit::kTilecore) {
    ++account_.counters.requests;
    if (purpose == Purpose::kAttributes) ++account_.counters.attribute_requests;
    if (cache_.use(line)) return true;
    ++account_.counters.misses;
    account_.ledger.read(unit, purpose, line_bytes_);
    return false;
  }

  std::uint64_t line_bytes() const { return line_bytes_; }

  // Counters and traffic since the last call of take_account().
  struct Account {
    L2Counters counters;
    Ledger ledger;
  };
  Account take_account() { return std::exchange(account_, {}); }

 private:
  LineCache cache_;
  std::uint64_t line_bytes_;
  Account account_;
};

}  // namespace tessera::memory

namespace tessera {

template <>
inline constexpr bool kAbsentWhenIdle<memory::L2Counters> = true;

template <>
inline constexpr auto kCounterFields<memory::L2Counters> = std::to_array<CounterField<memory::L2Counters>>({
    {"l2.requests", &memory::L2Counters::requests, Combine::kSum, "lines",
     "Lines that texture caches, pixel shaders (for base patches), tessellators (for displacement maps) and resolve "
     "units (for the previous frame) requested from the L2.",
     "MaliL2CacheRdLookup; V3D L2T-total-cache-hit and -miss together"},
    {"l2.misses", &memory::L2Counters::misses, Combine::kSum, "lines",
     "Requested lines that the L2 fetched from memory.",
     "MaliL2CacheRdMissRate (times lookups); Adreno % Texture L2 miss; V3D L2T-total-cache-miss"},
    {"l2.attribute_requests", &memory::L2Counters::attribute_requests, Combine::kSum, "lines",
     "Requested lines of base patches' records that pixel shaders read.", ""},
});
TESSERA_COUNTERS_COVER(memory::L2Counters);

}  // namespace tessera
