#include "tilecore/tessellation/tessellation_cache.h"

#include "base/random.h"

namespace tessera::tilecore {

std::size_t TessellationCache::PlaceHash::operator()(const Place& place) const {
  return hash32(place.patch, place.range, place.segment);
}

void TessellationCache::use(std::span<const TessellationRequest> requests) {
  for (const TessellationRequest& r : requests) {
    ++counters_.requests;
    const std::uint32_t range = std::uint32_t{r.range.i0} | std::uint32_t{r.range.j0} << 8 |
                                std::uint32_t{r.range.i1} << 16 | std::uint32_t{r.range.j1} << 24;
    const std::uint32_t number =
        numbers_.try_emplace({r.patch, range, r.segment}, static_cast<std::uint32_t>(numbers_.size())).first->second;
    if (cache_.use(number, r.vertices * kPositionBytes * (r.moving ? 2 : 1))) {
      ++counters_.cache_hits;
      continue;
    }
    ++counters_.sub_patches;
    counters_.domain_evaluations += r.vertices;
    counters_.triangles += r.triangles;
    ledger_.read(memory::Unit::kTilecore, memory::Purpose::kPatchData, r.patch_bytes);
  }
}

}  // namespace tessera::tilecore
