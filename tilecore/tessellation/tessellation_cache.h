#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>

#include "base/counter.h"
#include "memory/ledger.h"
#include "memory/lru_cache.h"
#include "scene/tessellation_pattern.h"

namespace tessera::tilecore {

// A sub-patch that a tile asked the tessellator for.
struct TessellationRequest {
  std::uint32_t patch = 0;
  std::uint8_t segment = 0;  // of motion
  scene::CellRange range;
  std::uint32_t vertices = 0, triangles = 0;
  std::uint64_t patch_bytes = 0;  // bursts fetched to tessellate it
  bool moving = false;
  // Effects that the kernels of this sub-patch were compiled for.
  bool displaced = false, defocused = false, alpha_tested = false, blended = false;
};

struct TessellationCounters {
  std::uint64_t requests = 0;
  std::uint64_t cache_hits = 0;
  std::uint64_t sub_patches = 0;
  std::uint64_t domain_evaluations = 0;
  std::uint64_t triangles = 0;
};

// The on-chip memory that keeps the vertices of tessellated sub-patches for the tiles that follow, in front of the
// tessellator; all tile cores share it. Least recently used sub-patches leave first. Configured by
// tessellator.cache_bytes.
//
//   request -> in the cache: nothing to do
//           -> not: fetch the patch, shade its vertices, make triangles, keep the vertices
//
// Requests come in emulated order, tile by tile, whatever order the host works in.
class TessellationCache {
 public:
  static constexpr std::uint64_t kPositionBytes = 12;  // of a vertex on chip, per key

  explicit TessellationCache(std::uint64_t capacity_bytes) : cache_(capacity_bytes) {}

  void use(std::span<const TessellationRequest> requests);

  const TessellationCounters& counters() const { return counters_; }
  const memory::Ledger& ledger() const { return ledger_; }

 private:
  struct Place {
    std::uint32_t patch, range, segment;
    bool operator==(const Place&) const = default;
  };
  struct PlaceHash {
    std::size_t operator()(const Place& place) const;
  };

  memory::LruCache cache_;
  std::unordered_map<Place, std::uint32_t, PlaceHash> numbers_;
  TessellationCounters counters_;
  memory::Ledger ledger_;
};

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kCounterFields<tilecore::TessellationCounters> =
    std::to_array<CounterField<tilecore::TessellationCounters>>({
        {"tilecore.tessellation_requests", &tilecore::TessellationCounters::requests, Combine::kSum, "sub-patches",
         "Sub-patches that tiles asked for. One that several tiles need counts once for each.", ""},
        {"tilecore.tessellation_cache_hits", &tilecore::TessellationCounters::cache_hits, Combine::kSum, "sub-patches",
         "Of these, found tessellated in the on-chip cache (tessellator.cache_bytes).",
         "Apple and Adreno: parameter or vertex cache hits (of triangles, there)"},
        {"tilecore.tessellated_sub_patches", &tilecore::TessellationCounters::sub_patches, Combine::kSum, "sub-patches",
         "Sub-patches tessellated; again for each time they had left the cache.", ""},
        {"tilecore.domain_evaluations", &tilecore::TessellationCounters::domain_evaluations, Combine::kSum, "vertices",
         "Vertices computed by the domain shader, repeated ones included; both motion keys of the shutter count once.",
         "Vulkan tessellation evaluation invocations; Apple postTessellationVertex"},
        {"tilecore.triangles", &tilecore::TessellationCounters::triangles, Combine::kSum, "triangles",
         "Triangles made by the tessellator, degenerate ones left out.", "MaliGeomVisiblePrim"},
    });
TESSERA_COUNTERS_COVER(tilecore::TessellationCounters);

}  // namespace tessera
