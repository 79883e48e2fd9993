#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "base/counter.h"

namespace tessera::baselines {

// Counters of one scheme for one frame. A primitive is the object that the scheme sorts: a sub-patch, a base patch, or a triangle.
struct BaselineCounters {
  std::uint64_t primitives = 0;
  std::uint64_t patches_culled = 0;
  std::uint64_t culled_frustum = 0;
  std::uint64_t culled_backface = 0;
  std::uint64_t culled_zero_area = 0;
  std::uint64_t culled_occlusion = 0;
  std::uint64_t bounding_operations = 0;
  std::uint64_t tile_overlaps = 0;
  std::uint64_t entries = 0;
  std::uint64_t vertices_stored = 0;
  std::uint64_t queue_bytes_written = 0;
  std::uint64_t queue_bytes_read = 0;
  std::uint64_t queue_bytes_peak = 0;
  std::uint64_t buffer_overflows = 0;
  std::uint64_t smallest_buffer_bytes = 0;
  std::uint64_t partial_render_bytes = 0;
  std::uint64_t spill_bytes = 0;
  std::uint64_t position_evaluations = 0;
  std::uint64_t domain_evaluations = 0;
  std::uint64_t domain_evaluations_cached = 0;
  std::uint64_t pixel_shader_invocations = 0;
  std::uint64_t patch_bytes = 0;
  std::uint64_t patch_bytes_cached = 0;
  std::uint64_t frame_bytes_read = 0;
  std::uint64_t frame_bytes_written = 0;
  std::uint64_t dram_bytes = 0;
  std::uint64_t dram_bytes_uncached = 0;
  std::uint64_t texture_bytes = 0;
  std::uint64_t cycles = 0;
  std::uint64_t energy_nj = 0;
};

}  // namespace tessera::baselines

namespace tessera {

template <>
inline constexpr auto kCounterFields<baselines::BaselineCounters> = std::to_array<
    CounterField<baselines::BaselineCounters>>({
    {"baseline.primitives", &baselines::BaselineCounters::primitives, Combine::kSum, "primitives",
     "Sub-patches, base patches or triangles, by scheme, that remain after culling and are sorted or drawn.",
     "MaliGeomVisiblePrim"},
    {"baseline.patches_culled", &baselines::BaselineCounters::patches_culled, Combine::kSum, "patches",
     "Base patches that machines which bin triangles drop in the hull stage, before any vertex: outside the view, or "
     "facing away. Their triangles count nowhere else.",
     "Vulkan tessellation control patches less tessellated ones"},
    {"baseline.culled_frustum", &baselines::BaselineCounters::culled_frustum, Combine::kSum, "primitives",
     "Dropped because they lie outside the view or its depth range at all times.",
     "MaliGeomFaceXYPlaneCullPrim, MaliGeomZPlaneCullPrim"},
    {"baseline.culled_backface", &baselines::BaselineCounters::culled_backface, Combine::kSum, "primitives",
     "Dropped because they face away from the whole lens at all times.", "MaliGeomFaceXYPlaneCullPrim"},
    {"baseline.culled_zero_area", &baselines::BaselineCounters::culled_zero_area, Combine::kSum, "primitives",
     "Triangles without area at any time.", "MaliGeomSampleCullPrim"},
    {"baseline.culled_occlusion", &baselines::BaselineCounters::culled_occlusion, Combine::kSum, "entries",
     "Entries that tile cores dropped before tessellation because the tile already sees nearer surfaces; with "
     "immediate, pairs of a triangle and a block of 8x8 pixels that hierarchical depth dropped; hidden meshlets.",
     "PowerVR HSR Efficiency; Adreno LRZ"},
    {"baseline.bounding_operations", &baselines::BaselineCounters::bounding_operations, Combine::kSum, "bounds",
     "Bounding volumes of patches, sub-patches and meshlets computed or tested; triangles are their own bounds.", ""},
    {"baseline.tile_overlaps", &baselines::BaselineCounters::tile_overlaps, Combine::kSum, "tiles",
     "Pairs of a primitive and a tile that it may touch, by exact coverage.",
     "PowerVR Tiles per Triangle (times primitives)"},
    {"baseline.entries", &baselines::BaselineCounters::entries, Combine::kSum, "entries",
     "Entries written to tile lists: blocks or groups of up to 126 triangles (post-tessellation, post-position, "
     "deferred-vertex), runs of triangles (visibility-stream), triangles (control-list), meshlets (mesh shaders).",
     "MaliFragRdPrim"},
    {"baseline.vertices_stored", &baselines::BaselineCounters::vertices_stored, Combine::kSum, "vertices",
     "Vertices written to the parameter buffer: once for each block that uses them (post-tessellation), for each draw "
     "or patch (post-position), for each meshlet (mesh shaders).",
     "PowerVR Parameter Buffer"},
    {"baseline.queue_bytes_written", &baselines::BaselineCounters::queue_bytes_written, Combine::kSum, "bytes",
     "Bytes of lists, links and cursors, sub-patch table, blocks of triangles, domain points and outputs of mesh "
     "shaders "
     "written to the parameter buffer, before rounding to bursts.",
     "MaliTilerWrBt"},
    {"baseline.queue_bytes_read", &baselines::BaselineCounters::queue_bytes_read, Combine::kSum, "bytes",
     "Bytes of the parameter buffer that tile cores and binning read: lists before rounding to bursts; the sub-patch "
     "table and blocks in bursts, as far as their caches miss.",
     "MaliTilerRdBt"},
    {"baseline.queue_bytes_peak", &baselines::BaselineCounters::queue_bytes_peak, Combine::kPeak, "bytes",
     "Most parameter-buffer memory in use at any time.", "PowerVR Parameter Buffer size; Apple tiled vertex buffer"},
    {"baseline.buffer_overflows", &baselines::BaselineCounters::buffer_overflows, Combine::kSum, "buffers",
     "Times that the parameter buffer ran full. Post-tessellation then gets another buffer of the same size and "
     "continues, which is in its favour: no tile is stored and reloaded.",
     "PowerVR SPM; Apple partial render"},
    {"baseline.smallest_buffer_bytes", &baselines::BaselineCounters::smallest_buffer_bytes, Combine::kPeak, "bytes",
     "The smallest parameter buffer that takes a frame's lists with neither a partial render nor a spill.",
     "PowerVR Parameter Buffer size"},
    {"baseline.partial_render_bytes", &baselines::BaselineCounters::partial_render_bytes, Combine::kSum, "bytes",
     "Tile state that partial renders would store and load again with half the room of baseline.smallest_buffer_bytes "
     "behind first chunks and cursors: colour and depth, or the samples that the machine's tiles keep instead, without "
     "their tables of triangles.",
     "PowerVR SPM; Apple partial render"},
    {"baseline.spill_bytes", &baselines::BaselineCounters::spill_bytes, Combine::kSum, "bytes",
     "Bytes of lists that would be written to an overflow area and read from it with half that room.",
     "V3D binner out-of-memory interrupt"},
    {"baseline.position_evaluations", &baselines::BaselineCounters::position_evaluations, Combine::kSum, "vertices",
     "Vertices whose position alone was computed, to bin triangles; their other attributes are computed later or "
     "never. With post-position once for each vertex of a draw.",
     "Arm position shading; V3D coordinate shading"},
    {"baseline.domain_evaluations", &baselines::BaselineCounters::domain_evaluations, Combine::kSum, "vertices",
     "Vertices that the domain shader computed when no tessellated sub-patch and no vertex is kept on chip, without "
     "baseline.position_evaluations.",
     "Vulkan tessellation evaluation invocations"},
    {"baseline.domain_evaluations_cached", &baselines::BaselineCounters::domain_evaluations_cached, Combine::kSum,
     "vertices", "The same with the cache of tessellator.cache_bytes.", "Vulkan tessellation evaluation invocations"},
    {"baseline.pixel_shader_invocations", &baselines::BaselineCounters::pixel_shader_invocations, Combine::kSum,
     "invocations",
     "Pixel-shader invocations: with tiles for visible surfaces only, the same for all schemes; with immediate for "
     "every pixel and triangle that passes its depth test.",
     "MaliFragShadedQd"},
    {"baseline.patch_bytes", &baselines::BaselineCounters::patch_bytes, Combine::kSum, "bytes",
     "Bytes of patch records fetched, in bursts, when no tessellated sub-patch is kept on chip.", ""},
    {"baseline.patch_bytes_cached", &baselines::BaselineCounters::patch_bytes_cached, Combine::kSum, "bytes",
     "The same with the cache of tessellator.cache_bytes: patches whose vertices are on chip are not fetched.", ""},
    {"baseline.frame_bytes_read", &baselines::BaselineCounters::frame_bytes_read, Combine::kSum, "bytes",
     "Colour and depth read from memory: attachments that tiles load, tiles that are reloaded, or through the cache of "
     "baselines.cache_bytes and for the resolve; with mesh shaders the pyramid of depths.",
     "MaliSCBusTileWrBt"},
    {"baseline.frame_bytes_written", &baselines::BaselineCounters::frame_bytes_written, Combine::kSum, "bytes",
     "Colour and depth written to memory, with frame, attachments and shadow maps.", "MaliSCBusTileWrBt"},
    {"baseline.dram_bytes", &baselines::BaselineCounters::dram_bytes, Combine::kSum, "bytes",
     "Bytes read and written over the external memory interface, in bursts, with the caches of all schemes and without "
     "textures.",
     "MaliExtBusRdBy + MaliExtBusWrBy"},
    {"baseline.dram_bytes_uncached", &baselines::BaselineCounters::dram_bytes_uncached, Combine::kSum, "bytes",
     "The same without those caches.", "MaliExtBusRdBy + MaliExtBusWrBy"},
    {"baseline.texture_bytes", &baselines::BaselineCounters::texture_bytes, Combine::kSum, "bytes",
     "Bytes of textures, heights and shadow maps, which baseline.dram_bytes leaves out: the machine's own; with "
     "immediate, per invocation.",
     "MaliExtBusRdBy"},
    {"baseline.cycles", &baselines::BaselineCounters::cycles, Combine::kSum, "cycles",
     "Cycles of the frame, of one eye, from empty caches, by the model of machine.timing (docs/timing_model.md).",
     "MaliGPUActiveCy"},
    {"baseline.energy_nj", &baselines::BaselineCounters::energy_nj, Combine::kSum, "nJ",
     "Energy of the frame at the machine's prices.", ""},
});
TESSERA_COUNTERS_COVER(baselines::BaselineCounters);

}  // namespace tessera

namespace tessera::baselines {

// The work of a core for the list of a tile, or of a bin.
struct ListWork {
  std::uint64_t entries = 0;                   // references read
  std::uint64_t vertices = 0, transforms = 0;  // shaded again; taken from the cache and moved by their transform
  std::uint64_t bytes = 0;  // bytes of the list and of the data that it references, over the external memory interface
  std::uint64_t cache_bytes = 0;  // bytes asked of caches behind that interface, and bytes filled into them
  std::uint64_t decoded = 0;      // elements of records that are decoded again (frontend::decoded_elements())
};

}  // namespace tessera::baselines
