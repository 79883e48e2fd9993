#pragma once

#include <cstdint>

#include "base/counter.h"
#include "hardware/events.h"
#include "tilecore/procedural/sampling_controller.h"
#include "tilecore/resolve/multisample_resolve.h"
#include "tilecore/resolve/resolve_unit.h"
#include "tilecore/resolve/tile_store.h"
#include "tilecore/shading/deferred_shader.h"
#include "tilecore/shading/gbuffer.h"
#include "tilecore/shading/light_lists.h"
#include "tilecore/shading/transmission.h"
#include "tilecore/visibility/visibility_method.h"

namespace tessera::tilecore {

struct TileCoreCounters {
  std::uint64_t entries_fetched = 0;
  std::uint64_t sort_steps = 0;
  std::uint64_t culled_occlusion = 0;
  std::uint64_t culled_blocks = 0;
  std::uint64_t depth_tests = 0;
  std::uint64_t depth_blocks_updated = 0;
  std::uint64_t boxes_built = 0;
  std::uint64_t box_tests = 0;
  std::uint64_t triangle_tests = 0;
  std::uint64_t box_lanes = 0, triangle_lanes = 0;
  std::uint64_t sample_hits = 0;
  std::uint64_t alpha_tests = 0;
  std::uint64_t mask_vertices = 0, mask_vertex_bytes = 0;
  std::uint64_t triangle_table_bytes = 0;
};

// Counters of passes that draw the maps of lights.
struct ShadowCounters {
  std::uint64_t texels_stored = 0;
  std::uint64_t tiles_cleared = 0;
  std::uint64_t lines_read = 0;
};

// Counters of the shaders of passes over images.
struct ImagePassCounters {
  std::uint64_t texels = 0;
  std::uint64_t lookups = 0;
  std::uint64_t warps = 0;
};

// The counters of all units of a core.
struct CoreCounters {
  TileCoreCounters tilecore;
  StencilCounters stencil;
  RayCounters rays;
  SamplingCounters sampling;
  ShadingCounters shading;
  LightListCounters lights;
  TextureCounters texture;
  DesamplingCounters desampling;
  HistoryCounters history;
  ResolveCounters resolve;
  StoreCounters store;
  TransmissionCounters transmission;
  ShadowCounters shadows;
  ImagePassCounters post;
  GbufferCounters gbuffer;
};

// Calls visit(a's, b's) for each of its counter structs.
template <class A, class B, class Visit>
void for_each_unit(A& a, B& b, const Visit& visit) {
  visit(a.tilecore, b.tilecore);
  visit(a.stencil, b.stencil);
  visit(a.rays, b.rays);
  visit(a.sampling, b.sampling);
  visit(a.shading, b.shading);
  visit(a.lights, b.lights);
  visit(a.texture, b.texture);
  visit(a.desampling, b.desampling);
  visit(a.history, b.history);
  visit(a.resolve, b.resolve);
  visit(a.store, b.store);
  visit(a.transmission, b.transmission);
  visit(a.shadows, b.shadows);
  visit(a.post, b.post);
  visit(a.gbuffer, b.gbuffer);
}
inline void merge(CoreCounters& into, const CoreCounters& from) {
  for_each_unit(into, from, [](auto& to, const auto& of) { tessera::merge(to, of); });
}

// The events of a tile that its core counts.
inline hardware::EventCounts count_events(const CoreCounters& c, std::uint64_t warp_lanes) {
  hardware::EventCounts counts;
#define TESSERA_TILE_COUNT(id, count) counts[hardware::Event::id] = count;
#include "hardware/each_event.inc"
  return counts;
}

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kCounterFields<tilecore::TileCoreCounters> = std::to_array<
    CounterField<tilecore::TileCoreCounters>>({
    {"tilecore.entries_fetched", &tilecore::TileCoreCounters::entries_fetched, Combine::kSum, "entries",
     "Entries of tile lists read by tile cores.",
     "MaliFragRdPrim (FRAG_PRIMITIVES_OUT); V3D FEP-valid-primitives-rendered-pixels"},
    {"tilecore.sort_steps", &tilecore::TileCoreCounters::sort_steps, Combine::kSum, "steps",
     "Entries that pass through a stage of the merge sorter that orders a tile's list by nearest depth: n entries "
     "take ceil(log2 n) stages.",
     ""},
    {"tilecore.culled_occlusion", &tilecore::TileCoreCounters::culled_occlusion, Combine::kSum, "entries",
     "Entries dropped before tessellation because every sample of the tile that they may touch sees a nearer surface.",
     "MaliFragFPKKillQd; Adreno PERF_LRZ_PRIM_KILLED_BY_LRZ; PowerVR HSR (after rasterisation, there)"},
    {"tilecore.culled_blocks", &tilecore::TileCoreCounters::culled_blocks, Combine::kSum, "entries",
     "Entries of tilecore.culled_occlusion that begin nearer than the tile's farthest depth elsewhere: only the blocks "
     "of 8x8 pixels in their records hide them.",
     "Adreno PERF_LRZ_PRIM_KILLED_BY_LRZ"},
    {"tilecore.depth_tests", &tilecore::TileCoreCounters::depth_tests, Combine::kSum, "tests",
     "Entries compared with the farthest depths of the blocks of 8x8 pixels that they may touch; each takes the "
     "time of one such block.",
     ""},
    {"tilecore.depth_blocks_updated", &tilecore::TileCoreCounters::depth_blocks_updated, Combine::kSum, "blocks",
     "Blocks of 8x8 pixels whose farthest depth was updated because a sub-patch came nearer there.",
     "MaliFragFPKBuffer (another unit); V3D: hierarchical depth updates"},
    {"tilecore.boxes_built", &tilecore::TileCoreCounters::boxes_built, Combine::kSum, "boxes",
     "Boxes of leaves and cells, nodes of motion BVHs and bounding polygons that were built, at both motion keys; a "
     "box that several tiles need counts once for each.",
     ""},
    {"tilecore.box_tests", &tilecore::TileCoreCounters::box_tests, Combine::kSum, "tests",
     "Samples (ray path) or tiles (raster path) tested against boxes of leaves and cells.", "MaliRTUBox"},
    {"tilecore.triangle_tests", &tilecore::TileCoreCounters::triangle_tests, Combine::kSum, "tests",
     "Samples tested against triangles.", "MaliRTUTri"},
    {"tilecore.box_lanes", &tilecore::TileCoreCounters::box_lanes, Combine::kSum, "lanes",
     "Lanes that box tests took, 16 at a time, idle ones and samples tested against a leaf's own box included.", ""},
    {"tilecore.triangle_lanes", &tilecore::TileCoreCounters::triangle_lanes, Combine::kSum, "lanes",
     "Lanes that triangle tests took, 16 at a time, idle ones included.", ""},
    {"tilecore.sample_hits", &tilecore::TileCoreCounters::sample_hits, Combine::kSum, "samples",
     "Triangle tests whose sample is inside, facing and depth range included.",
     "MaliFragRastQd (times the samples of a quad)"},
    {"tilecore.alpha_tests", &tilecore::TileCoreCounters::alpha_tests, Combine::kSum, "tests",
     "Hits whose alpha was looked up because the material masks.", "MaliFragLZSTestTd"},
    {"tilecore.mask_vertices", &tilecore::TileCoreCounters::mask_vertices, Combine::kSum, "vertices",
     "Vertices whose texture coordinate a core computed because alpha tests interpolate it, once for each sub-patch "
     "that a "
     "tile sees.",
     ""},
    {"tilecore.mask_vertex_bytes", &tilecore::TileCoreCounters::mask_vertex_bytes, Combine::kSum, "bytes",
     "Bytes of these coordinates that cores wrote to and read from their tile memory: 8 for each vertex, and three "
     "times "
     "that for each alpha test.",
     ""},
    {"tilecore.triangle_table_bytes", &tilecore::TileCoreCounters::triangle_table_bytes, Combine::kSum, "bytes",
     "Bytes that cores write to and read from the tables by which samples name triangles: a record for each sub-patch "
     "that a tile sees, read for each pixel-shader invocation; and corners of leaves that move or are seen through a "
     "lens, three of them for each of tilecore.places_found.",
     ""},
});
TESSERA_COUNTERS_COVER(tilecore::TileCoreCounters);

template <>
inline constexpr bool kAbsentWhenIdle<tilecore::ShadowCounters> = true;

template <>
inline constexpr auto kCounterFields<tilecore::ShadowCounters> = std::to_array<CounterField<tilecore::ShadowCounters>>({
    {"shadows.texels_stored", &tilecore::ShadowCounters::texels_stored, Combine::kSum, "texels",
     "Depths that passes of lights stored in their maps.", ""},
    {"shadows.tiles_cleared", &tilecore::ShadowCounters::tiles_cleared, Combine::kSum, "tiles",
     "Tiles of shadow maps without any caster: a flag is stored, no texel.", ""},
    {"shadows.lines_read", &tilecore::ShadowCounters::lines_read, Combine::kSum, "lines",
     "Cache lines of shadow maps and their flags that the frame looks up, each counted once.", ""},
});
TESSERA_COUNTERS_COVER(tilecore::ShadowCounters);

template <>
inline constexpr bool kAbsentWhenIdle<tilecore::ImagePassCounters> = true;

template <>
inline constexpr auto kCounterFields<tilecore::ImagePassCounters> = std::to_array<
    CounterField<tilecore::ImagePassCounters>>({
    {"post.texels", &tilecore::ImagePassCounters::texels, Combine::kSum, "texels",
     "Texels that shaders of passes over images made: levels of a bloom, pixels to which it is added, and pixels of "
     "temporal antialiasing.",
     ""},
    {"post.lookups", &tilecore::ImagePassCounters::lookups, Combine::kSum, "texels",
     "Bilinear lookups that they took; also in texture.texels.", ""},
    {"post.warps", &tilecore::ImagePassCounters::warps, Combine::kSum, "warps", "Warps that they took.", ""},
});
TESSERA_COUNTERS_COVER(tilecore::ImagePassCounters);

}  // namespace tessera
