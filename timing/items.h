#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hardware/events.h"

namespace tessera::timing {

using hardware::Event;

// The work of a core's units for one sub-patch, or for cells of procedures that follow each other, in the order of the tile's list.
struct SubPatchItem {
  std::array<std::uint32_t, hardware::kItemEventCount> events{};  // of EventPhase::kVisibility, in order
  // Cost of one vertex in its compiled domain shader (hardware/shader_costs.h): clocks and registers of a lane, and
  // bilinear lookups of heights.
  std::uint32_t domain_clocks = 0, domain_registers = 0, domain_texels = 0;
  std::uint32_t lines = 0;         // TileItems::lines: records, then heights
  std::uint32_t height_lines = 0;  // lines of heights among these
  std::uint32_t texel_lines = 0;   // TileItems::texel_lines, for alpha tests
  std::uint32_t drawable = 0;      // number in scene::Assembly plus one; 0 for none

  std::uint32_t& operator[](hardware::Event event) {
    return events[static_cast<std::size_t>(event) - hardware::kFirstItemEvent];
  }
  std::uint32_t operator[](hardware::Event event) const {
    return events[static_cast<std::size_t>(event) - hardware::kFirstItemEvent];
  }
};

// One warp, in the order in which warps are packed: invocations of the pixel shader, samples that see the
// environment, vertices, or the places and lights of a light list.
struct WarpItem {
  // kEvaluating: invocations that evaluate their patch again. kVertices: vertices that later pixels interpolate;
  // these pixels wait for them. kPlaces, kLightTests: warps that make a tile's light list. They wait for vertices and
  // for each other, and pixels wait for them. kImage: texels of a pass over an image. kLight: the light half of pixels, which
  // waits for their fill half among kPixels or kEvaluating.
  static constexpr std::uint32_t kPixels = 0, kEvaluating = 1, kBackground = 2, kVertices = 3, kPlaces = 4,
                                 kLightTests = 5, kImage = 6, kLight = 7;

  std::uint32_t lanes = 0;  // lanes with an invocation, sample or vertex
  std::uint32_t kind = kPixels;
  std::uint32_t clocks = 0;       // clocks of a lane for its compiled shader (hardware/shader_costs.h)
  std::uint32_t registers = 0;    // registers of a lane for that shader
  std::uint32_t texels = 0;       // bilinear lookups, summed over lanes
  std::uint32_t texel_lines = 0;  // TileItems::texel_lines
  std::uint32_t drawable = 0;     // as SubPatchItem::drawable

  bool makes_lights() const { return kind == kPlaces || kind == kLightTests; }
  // Whether the core packs its lanes together from a tile's samples.
  bool is_packed() const { return !makes_lights() && kind != kImage; }
  // A warp waits for all warps of lower steps that were packed before it.
  static constexpr std::uint32_t kSteps = 5;
  std::uint32_t step() const {
    return kind == kVertices ? 0 : kind == kPlaces ? 1 : kind == kLightTests ? 2 : kind == kLight ? 4 : 3;
  }
};

// The work of one tile, item by item. Each item takes its number of lines from the lists, in order.
struct TileItems {
  std::vector<SubPatchItem> sub_patches;
  std::vector<WarpItem> warps;
  std::vector<std::uint32_t> lines;        // lines asked of the L2: sub-patches first, then shading
  std::vector<std::uint32_t> texel_lines;  // lines asked of the texture cache: alpha tests first, then warps
  std::uint32_t shading_lines = 0;         // lines of shading, at the end of `lines`
  std::uint64_t cache_lines = 0;           // lines filled into caches without an item that names them: for energy only
  // Bytes that bypass the L2: the tile list, records of sub-patches, stored samples, reads of the resolve unit, and all writes.
  std::uint64_t list_bytes = 0, record_bytes = 0, load_bytes = 0, resolve_bytes = 0, written_bytes = 0;
};

}  // namespace tessera::timing
