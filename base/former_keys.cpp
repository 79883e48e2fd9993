#include "base/former_keys.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace tessera {
namespace {

constexpr auto kFormerKeys = std::to_array<FormerKey>({
    {"energy.leakage_mw", "", "Leakage follows the area (area.*) now: set energy.leakage_mw_per_mm2, at 0.8 V."},
    {"resolve.advect_outlines", "", "Slow blocks in which several surfaces meet always reuse pixels."},
    {"resolve.advect_still_edges", "", "Blocks at rest always reuse pixels, edges included: the copies are exact."},
    {"resolve.block", "", "Decisions are made for blocks of 4x4 pixels: larger blocks save less."},
    {"resolve.border_lines", "", "Where stencils stop at a tile's border, lines of samples always go on to it."},
    {"resolve.depth_tolerance", "", "A reprojected pixel's depth may differ by 0.2 % and the slope of its surface."},
    {"resolve.desampling=fixed_12", "", "Shading 12 of 16 pixels does not pay: set fixed_8."},
    {"resolve.discrepancy=neighbours", "", "Set rendered, which compares like with like."},
    {"resolve.discrepancy_same_frame", "", "Reprojected pixels of a discrepant block are always shaded after all."},
    {"resolve.dither_per_block", "", "All blocks of a frame share the pattern of their rate."},
    {"resolve.edge_evidence", "", "Samples of a block that see several drawables always make an edge."},
    {"resolve.focus_track", "", "Set resolve.focus_node to a node of the capture that moves as the eye does."},
    {"resolve.history_l2", "", "The previous frame is always read through the L2 (l2.bytes)."},
    {"resolve.history_records", "", "Depths and surfaces are always kept in packed records of blocks."},
    {"resolve.k_blur", "", "Blurred blocks with an edge are shaded fully; set shading.rate=cache to share by cell."},
    {"resolve.k_cut", "resolve.cut_speed", ""},
    {"resolve.k_fast0", "", "Shading 12 of 16 pixels does not pay: set resolve.half_rate_speed."},
    {"resolve.k_fast1", "resolve.half_rate_speed", ""},
    {"resolve.k_fast2", "resolve.quarter_rate_speed", ""},
    {"resolve.k_stat", "resolve.reuse_speed", ""},
    {"resolve.keep_blocks", "", "Unchanged blocks are always skipped, with resolve.history_colors=frame_buffer."},
    {"resolve.stencil_clamp", "", "Reconstructed pixels are not clamped to the range of what they are made from."},
    {"resolve.stencil_weights", "", "Stencils have packed weights of 8 bits."},
    {"resolve.supersampled_groups", "", "resolve.supersampling shades all 32 half pixels of a block with an edge."},
    {"texture.basis_target", "",
     "KTX2 textures are ASTC blocks of 4x4 texels in memory; set texture.format to encode all textures otherwise."},
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
