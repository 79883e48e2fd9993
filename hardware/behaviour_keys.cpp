#include "hardware/behaviour_keys.h"

namespace tessera::hardware {
namespace {

using Gpu = GpuConfiguration;
using Keys = tessera::Keys<Gpu>;

Keys frontend_keys() {
  return {
      {"frontend.bound_method",
       &Gpu::frontend_bound_method,
       {"aabb", "obb", "tpatch", "npatch", "interval"},
       "How sub-patches are boxed: object axes or the patch's own, displaced in every direction (aabb, obb) or along "
       "bounded normals (tpatch, npatch), or "
       "by interval arithmetic.",
       "[spec] Munkberg et al. 2010 for obb, tpatch and npatch"},
      {"frontend.split_criterion",
       &Gpu::frontend_split_criterion,
       {"screen_extent", "frustum", "nearest", "normal_spread", "surface_area"},
       "Which sub-patches are split further, and which first.",
       "[assumed]"},
      {"frontend.split_pixels", &Gpu::frontend_split_pixels, "pixels", 1, 65536,
       "Sub-patches no wider than this on screen, at shutter open and close, are not split further.",
       "[measured] docs/bounding.md: four tiles"},
      {"frontend.split_depth", &Gpu::frontend_split_depth, "splits", 0, 12,
       "Most splits by the criterion between a base patch and a sub-patch; splits for tessellator.sub_patch_cells do "
       "not count.",
       "[assumed]"},
      {"frontend.split_budget", &Gpu::frontend_split_budget, "sub-patches", 1, 4096,
       "Most sub-patches that the criterion may make of one base patch.", "[assumed]"},
      {"frontend.backface_culling", &Gpu::frontend_backface_culling,
       "Whether sub-patches that face away are dropped before binning.",
       "[spec] every GPU culls back faces; before tessellation: Hasselgren et al. 2009"},
      {"frontend.previous_depth_culling", &Gpu::frontend_previous_depth_culling,
       "Whether sub-patches that the previous frame's coarse depth hides are deferred, looked at again when the tiles "
       "are done, and rendered in a second pass "
       "where they were visible after all.",
       "[assumed] two-pass occlusion culling, Haar and Aaltonen 2015"},
  };
}

Keys binner_keys() {
  return {
      {"tile.width", &Gpu::tile_width, "pixels", 8, 256, "Width of the on-chip render area of one tile core.",
       "[spec] 16 on Mali-G31, 32 on classic PowerVR and Mali-G715, 64 on Immortalis-G720"},
      {"tile.height", &Gpu::tile_height, "pixels", 8, 256, "Height of the on-chip render area of one tile core.",
       "[spec] as tile.width"},
      {"parameter_buffer.bytes", &Gpu::parameter_buffer_bytes, "bytes", 256, 4294967296.0,
       "Memory that holds the tile lists: list heads and chunks.",
       "[spec] PowerVR drivers start at 2 MiB, Mali's at 10 MiB (up to 128 MiB)"},
      {"parameter_buffer.chunk_bytes", &Gpu::parameter_buffer_chunk_bytes, "bytes", 32, 2097152,
       "Size of the pieces in which the parameter buffer is handed out to tiles.",
       "[spec] Broadcom V3D: 64-byte first lists, 4 KiB chunks; [assumed] 256"},
      {"parameter_buffer.full_policy",
       &Gpu::parameter_buffer_full_policy,
       {"partial_render", "spill"},
       "What a full parameter buffer leads to: render what is queued and go on, or continue in an overflow area.",
       "[spec] PowerVR, Mali and Apple render partially; V3D takes overflow memory"},
      {"binner.coverage",
       &Gpu::binner_coverage,
       {"rectangle", "exact"},
       "Tiles that get an entry: all of the bounding rectangle, or those that the moving box itself may touch.",
       "[assumed]"},
      {"binner.time_intervals", &Gpu::binner_time_intervals,
       "Store in an entry when its moving box may touch the tile, from the box against the tile's frustum; drop tiles "
       "that it touches at no time.",
       "[assumed]"},
      {"binner.time_segments", &Gpu::binner_time_segments, "segments", 0, 16,
       "Pieces into which the shutter is cut, each with a bounding rectangle of its own; 0: as many as the box's "
       "centre travels its own larger "
       "side (at least a tile) on screen.",
       "[assumed]"},
      {"binner.queue_levels", &Gpu::binner_queue_levels, "levels", 1, 5,
       "Levels of queues: single tiles, then groups of 2x2, 4x4, 8x8 and 16x16 tiles, whose entries all their tiles "
       "read.",
       "[spec] Mali since Midgard: power-of-two multiples of 16x16 pixels; [assumed] flat"},
      {"binner.combining_bursts", &Gpu::binner_combining_bursts, "bursts", 1, 65536,
       "Bursts that the binner keeps open on chip to combine the writes of neighbouring queue entries.", "[assumed]"},
  };
}

// And the caches of the machines that --baselines compares with.
Keys tessellator_keys() {
  return {
      {"tessellator.max_factor", &Gpu::tessellator_max_factor, "cells", 1, 64,
       "Largest number of cells along an edge of a base patch.", "[spec] 64 in Direct3D 11 and Vulkan"},
      {"tessellator.subpixel_bits", &Gpu::tessellator_subpixel_bits, "bits", 4, 8,
       "Fractional bits of a vertex's place on screen: vertices that are projected lie on a grid of 2^-bits pixels. "
       "Samples keep theirs of 1/256.",
       "[spec] 8 in Direct3D 11; 4 in OpenGL ES (GL_SUBPIXEL_BITS)"},
      {"tessellator.sub_patch_cells", &Gpu::tessellator_sub_patch_cells, "cells", 4, 64,
       "Largest side of the sub-patches that the front end sends to the binner.", "[assumed]"},
      {"tessellator.cache_bytes", &Gpu::tessellator_cache_bytes, "bytes", 0, 1073741824.0,
       "On-chip memory that keeps the vertices of tessellated sub-patches for the tiles that follow.",
       "[assumed] half of a middle Mali's L2 ([spec] 32 to 512 KiB on Mali-G51)"},
      {"post_tessellation.cache_bytes", &Gpu::post_tessellation_cache_bytes, "bytes", 0, 1073741824.0,
       "With --baselines: on-chip memory through which the tile cores of a machine that bins triangles read them.",
       "[assumed] as tessellator.cache_bytes"},
      {"immediate.cache_bytes", &Gpu::immediate_cache_bytes, "bytes", 0, 1073741824.0,
       "With --baselines: colour and depth cache of an immediate-mode machine.",
       "[assumed] as tessellator.cache_bytes"},
  };
}

Keys tile_core_keys() {
  return {
      {"tilecore.occlusion_culling", &Gpu::tilecore_occlusion_culling,
       "Whether a tile core drops entries that lie behind all that its samples see, before it tessellates them.",
       "[spec] hierarchical depth of every GPU, applied to sub-patches"},
      {"tilecore.visibility_method",
       &Gpu::tilecore_visibility_method,
       {"patch-bvh", "brute", "segments", "partition", "clusters", "interleaved"},
       "How a tile core finds the samples of a moving or defocused sub-patch: by its motion BVH; by the rectangle of "
       "each cell's whole motion; by a stencil "
       "test on time for segments of the shutter, for parts of the rectangle, for segments of whole leaves; by a "
       "rectangle for each of a few fixed intervals. "
       "The image is the same.",
       "[spec] patch-bvh: US 8791945; segments, partition, clusters: US 9626762; brute and interleaved: what both "
       "compare with"},
      {"tilecore.stencil_segments", &Gpu::tilecore_stencil_segments, "segments", 0, 256,
       "Segments of the shutter of the methods segments and clusters; 0: as many as the primitive moves its own size, "
       "at most 64.",
       "[spec] US 9626762 leaves the number open; [assumed] 0"},
      {"tilecore.interleaved_times", &Gpu::tilecore_interleaved_times, "intervals", 1, 256,
       "Intervals of the shutter of the method interleaved.", "[assumed] 16, a small fixed number as in US 8791945"},
      {"tilecore.traversal",
       &Gpu::tilecore_traversal,
       {"class", "ray"},
       "How patch-bvh finds samples: per class of the sample pattern (samples of one time, on a grid) from the moving "
       "box of a leaf, or each as a ray through "
       "the binary tree of the sub-patch's cells.",
       "[spec] ray: US 8791945; [assumed] class"},
      {"tilecore.branch_node",
       &Gpu::tilecore_branch_node,
       {"root", "both_children", "leaf_mask"},
       "With tilecore.traversal=ray: the node at which the rays of 4x4 pixels start: the root; the first node with "
       "both children inside their frustum; the "
       "lowest one above all leaves inside.",
       "[spec] US 8791945 offers both; [measured] docs/visibility_methods.md: leaf_mask"},
      {"tilecore.ray_segments", &Gpu::tilecore_ray_segments, "segments", 1, 64,
       "With tilecore.traversal=ray: parts of the shutter that have a stencil test, a leaf mask and a branch node of "
       "their own.",
       "[spec] US 8791945: 1; more is what US 9626762 does to a polygon"},
      {"tilecore.box_bits", &Gpu::tilecore_box_bits, "bits", 8, 32,
       "Precision of the boxes of cells: single precision (32), or rounded outwards to so many bits (8 or 16) within "
       "the box of their leaf of 4x4 cells.",
       "[assumed] single precision; 8 bits: Ylitie et al. 2017, quantised wide BVH nodes"},
      {"tilecore.blend_layers", &Gpu::tilecore_blend_layers, "layers", 1, 64,
       "Blended surfaces of one sample that a tile core keeps in order; of more, the two farthest become one.",
       "[assumed] 8; multi-layer alpha blending: Salvi and Vaidyanathan 2014"},
      {"shading_cache.entries", &Gpu::shading_cache_entries, "cells", 1, 1048576,
       "With shading.rate=cache: shaded cells that a tile core keeps on chip, 24 bytes each; the least recently used "
       "goes first.",
       "[assumed] 24 KiB"},
      {"shading_cache.group", &Gpu::shading_cache_group, "tiles", 1, 64,
       "Side of the square group of tiles that a core renders before it empties its shading cache, with "
       "shading.rate=cache.",
       "[assumed] emptied after every tile"},
  };
}

Keys memory_interface_keys() {
  return {
      {"memory.burst_bytes", &Gpu::memory_burst_bytes, "bytes", 16, 256,
       "Smallest amount the external memory interface moves.",
       "[spec] LPDDR4 x16, burst length 16 = 32; two channels = 64"},
      {"frame_buffer.compression",
       &Gpu::frame_buffer_compression,
       {"none", "lossless"},
       "Whether finished pixels are compressed on their way to memory, in blocks of 8x4; saves traffic, not room.",
       "[assumed]"},
  };
}

}  // namespace

tessera::Keys<Gpu> behaviour_keys() {
  Keys all;
  for (const Keys& unit :
       {frontend_keys(), binner_keys(), tessellator_keys(), tile_core_keys(), memory_interface_keys()})
    all.add(unit);
  return all;
}

}  // namespace tessera::hardware
