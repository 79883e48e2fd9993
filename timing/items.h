#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hardware/events.h"

namespace tessera::timing {

using hardware::Event;

// One sub-patch that a tile works on, or cells of procedures that follow each other, in the order of its list: what each
// unit of the core does for it.
struct SubPatchItem {
  std::array<std::uint32_t, hardware::kItemEventCount> events{};  // of EventPhase::kVisibility, from the first on
  // Of one vertex for its compiled domain shader (hardware/shader_costs.h): clocks and registers of a lane, and bilinear
  // lookups of heights.
  std::uint32_t domain_clocks = 0, domain_registers = 0, domain_texels = 0;
  std::uint32_t lines = 0;         // TileItems::lines: records, then heights
  std::uint32_t height_lines = 0;  // of these
  std::uint32_t texel_lines = 0;   // TileItems::texel_lines: of alpha tests
  std::uint32_t drawable = 0;      // its number in scene::Assembly, plus one; 0: of none

  std::uint32_t& operator[](hardware::Event event) {
    return events[static_cast<std::size_t>(event) - hardware::kFirstItemEvent];
  }
  std::uint32_t operator[](hardware::Event event) const {
    return events[static_cast<std::size_t>(event) - hardware::kFirstItemEvent];
  }
};

// One warp, in the order in which they are packed: of the pixel shader, of samples that see the environment, of vertices, or
// of what a light list is made from.
struct WarpItem {
  // kEvaluating: invocations that evaluate their patch again. kVertices: vertices that the pixels behind them interpolate,
  // which wait for them. kPlaces, kLightTests: warps that make a tile's light list, which wait for vertices and for each
  // other; pixels wait for them. kImage: texels of a pass over an image. kLight: the light half of pixels whose fill half is
  // among kPixels or kEvaluating, for which it waits.
  static constexpr std::uint32_t kPixels = 0, kEvaluating = 1, kBackground = 2, kVertices = 3, kPlaces = 4,
                                 kLightTests = 5, kImage = 6, kLight = 7;

  std::uint32_t lanes = 0;  // with an invocation, or with such a sample or vertex
  std::uint32_t kind = kPixels;
  std::uint32_t clocks = 0;       // of a lane for its compiled shader (hardware/shader_costs.h)
  std::uint32_t registers = 0;    // of a lane, likewise
  std::uint32_t texels = 0;       // bilinear lookups of all lanes
  std::uint32_t texel_lines = 0;  // TileItems::texel_lines
  std::uint32_t drawable = 0;     // as SubPatchItem::drawable

  bool makes_lights() const { return kind == kPlaces || kind == kLightTests; }
  // Whether the core packs its lanes together from what a tile sees.
  bool is_packed() const { return !makes_lights() && kind != kImage; }
  // Warps wait for those of lower steps that were packed before them.
  static constexpr std::uint32_t kSteps = 5;
  std::uint32_t step() const {
    return kind == kVertices ? 0 : kind == kPlaces ? 1 : kind == kLightTests ? 2 : kind == kLight ? 4 : 3;
  }
};

// The work of one tile, item by item. Each takes the next so many of the lists of lines.
struct TileItems {
  std::vector<SubPatchItem> sub_patches;
  std::vector<WarpItem> warps;
  std::vector<std::uint32_t> lines;        // asked of the L2: those of sub-patches, then those that shading reads
  std::vector<std::uint32_t> texel_lines;  // asked of the texture cache: those of alpha tests, then those of warps
  std::uint32_t shading_lines = 0;         // of `lines`, behind those of sub-patches
  std::uint64_t cache_lines = 0;           // asked of caches that no item names, and filled into them: energy alone
  // Bytes that bypass the L2: the tile list, then records of sub-patches, stored samples, what the resolve unit reads,
  // and all that is written.
  std::uint64_t list_bytes = 0, record_bytes = 0, load_bytes = 0, resolve_bytes = 0, written_bytes = 0;
};

}  // namespace tessera::timing
