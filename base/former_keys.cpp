#include "base/former_keys.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace tessera {
namespace {

constexpr auto kFormerKeys = std::to_array<FormerKey>({
    {"binner.record_cache_bytes", "", "The cache of the sub-patch table has 16 KiB."},
    {"cache.line_bytes", "", "Lines have 64 bytes, or memory.burst_bytes where a burst is longer."},
    {"energy.binned_entry_pj", "energy.entry_pj", ""},
    {"energy.fetched_entry_pj", "energy.entry_pj", ""},
    {"energy.leakage_mw", "", "Leakage follows the area (area.*) now: set energy.leakage_mw_per_mm2, at 0.8 V."},
    {"frontend.backface_cells", "", "Sub-patches are not cut to drop parts of them that face away."},
    {"frontend.depth_block_pixels", "", "Depths are stored for blocks of 16 pixels, or 8 where tiles need it."},
    {"frontend.split_core_share", "", "Splits by cost count 0.4 of the tile cores' work."},
    {"immediate.cache_bytes", "baselines.cache_bytes", ""},
    {"memory.ranks", "", "Channels have one rank; tessera dram --ranks plays a trace on more."},
    {"output.exr_compression", "", "EXR files are compressed by PIZ, without loss."},
    {"post_tessellation.cache_bytes", "baselines.cache_bytes", ""},
    {"procedures.crossing", "", "Every tile evaluates the samples that may reach it."},
    {"procedures.image_reads", "", "Set procedures.mode=published to read geometry images through the texture cache."},
    {"procedures.lanes", "", "The array that evaluates procedures has 32 lanes; set procedures.operations_per_clk."},
    {"procedures.lists", "", "A tile's list holds the cells that the tile may see."},
    {"procedures.maps", "procedures.mode", ""},
    {"procedures.refill", "", "Footprints leave no holes; set procedures.spacing where samples are too far apart."},
    {"procedures.scatter", "", "Set procedures.mode=published to write samples to their sub-pixels."},
    {"resolve.advect_outlines", "", "Slow blocks in which several surfaces meet always reuse pixels."},
    {"resolve.advect_still_edges", "", "Blocks at rest always reuse pixels, edges included: the copies are exact."},
    {"resolve.block", "", "Decisions are made for blocks of 4x4 pixels: larger blocks save less."},
    {"resolve.border_lines", "", "Where stencils stop at a tile's border, lines of samples always go on to it."},
    {"resolve.depth_tolerance", "", "A reprojected pixel's depth may differ by 0.2 % and the slope of its surface."},
    {"resolve.desampling=fixed_12", "", "Shading 12 of 16 pixels does not pay: set fixed_8."},
    {"resolve.discrepancy=neighbours", "", "Set rendered, which compares equal quantities."},
    {"resolve.discrepancy_same_frame", "", "Reprojected pixels of a discrepant block are always shaded in the end."},
    {"resolve.dither_per_block", "", "All blocks of a frame share the pattern of their rate."},
    {"resolve.edge_evidence", "", "Samples of a block that see several drawables always make an edge."},
    {"resolve.focus_track", "", "Set resolve.focus_node to a node of the capture that moves like the eye."},
    {"resolve.history_l2", "", "The previous frame is always read through the L2 (l2.bytes)."},
    {"resolve.history_records", "", "Depths and surfaces are always kept in packed records of blocks."},
    {"resolve.k_blur", "", "Blurred blocks with an edge are shaded fully; set shading.rate=cache to share by cell."},
    {"resolve.k_cut", "resolve.cut_speed", ""},
    {"resolve.k_fast0", "", "Shading 12 of 16 pixels does not pay: set resolve.half_rate_speed."},
    {"resolve.k_fast1", "resolve.half_rate_speed", ""},
    {"resolve.k_fast2", "resolve.quarter_rate_speed", ""},
    {"resolve.k_stat", "resolve.reuse_speed", ""},
    {"resolve.keep_blocks", "", "Unchanged blocks are always skipped, with resolve.history_colors=frame_buffer."},
    {"resolve.stencil_clamp", "", "Reconstructed pixels are not clamped to the range of their source pixels."},
    {"resolve.stencil_weights", "", "Stencils have packed weights of 8 bits."},
    {"resolve.supersampled_groups", "", "resolve.supersampling shades all 32 half pixels of a block with an edge."},
    {"sampling.lens_points", "", "Every sample of the pattern has a lens point of its own."},
    {"sampling.operations_per_clk", "procedures.operations_per_clk", ""},
    {"shader.domain_operations", "shader.surface_operations", ""},
    {"shading_cache.group", "", "The shading cache is emptied after every tile."},
    {"tessellator.cache_eviction", "",
     "Entries that no tile's list names any more are evicted first, then the entries whose next "
     "tile is last in the order."},
    {"texture.basis_target", "",
     "KTX2 textures are ASTC blocks of 4x4 texels in memory; set texture.format to encode all textures otherwise."},
    {"texture.cache_ways", "", "Texture caches have 4 ways; set texture.cache_bytes."},
    {"tilecore.box_bits", "", "Boxes of cells have single precision."},
    {"tilecore.interleaved_times", "",
     "Set sampling.times; tilecore.visibility_method=interleaved takes 16 without it."},
    {"tilecore.ray_segments", "", "Rays have one leaf mask for the whole shutter."},
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
