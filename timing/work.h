#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "hardware/energy.h"
#include "hardware/machine.h"
#include "hardware/stage.h"
#include "memory/ledger.h"
#include "memory/line_cache.h"
#include "timing/items.h"

namespace tessera::timing {

using hardware::Event;
using hardware::EventCounts;
using hardware::kStageCount;
using hardware::Stage;

// Phases of a tile, in order: its samples are found, shaded, then resolved and stored.
enum class Phase : std::uint8_t { kVisibility, kShading, kStore };
inline constexpr std::size_t kPhaseCount = 3;

// Work of the front end and the binner. Machines that bin or draw triangles add work before the tiles: vertices that
// the tessellators of all cores shade, elements of records that they decode for this (kDecodedElements), instructions
// of other shaders (kShaderClocks), their lookups (kTexels), and triangle setup.
struct GeometryWork {
  EventCounts events;
  std::uint64_t patches = 0;
  std::uint64_t dram_bytes = 0;
  std::uint64_t table_bytes = 0;    // bytes of these that are filled into the L2
  std::uint64_t written_bytes = 0;  // bytes of these that are written
  std::uint64_t queue_bytes = 0;    // bytes of the parameter buffer in use at the end
  std::uint64_t vertex_clocks = 0;  // clocks of lanes for the compiled shaders of vertices
};

// Events of one tile, or of one partial render of it. The rendering thread fills them in; events that depend on
// shared caches are added later in emulated order.
struct TileWork {
  std::uint32_t tile = 0;
  EventCounts events;
  std::uint64_t sub_patches = 0;  // number tested, whether tessellated for the tile or found in the cache
  std::array<std::uint64_t, kPhaseCount> dram_bytes{};
  // Bytes of blended layers, tables of triangles and vertices that its core keeps beside FrameWork::tile_state_bytes.
  std::uint64_t extra_bytes = 0;
};

// A run of the binner and the tiles that follow from it. A pass has one, or several with partial renders.
struct WorkRound {
  static constexpr std::uint32_t kAllBefore = 0xFFFFFFFFu;

  GeometryWork geometry;
  std::vector<TileWork> tiles;                  // in the order of the tile scheduler
  std::vector<TileItems> items;                 // items of each tile, or empty
  std::vector<std::uint32_t> geometry_lines{};  // with items: lines of height tables that the front end asks of the L2
  std::uint32_t pass = 0;                       // index in FrameWork::passes
  // Number of the frame's rounds that must be stored before this round's geometry, and its tiles, may begin. With
  // machine.overlap=none all earlier rounds must be.
  std::uint32_t geometry_after = kAllBefore, tiles_after = kAllBefore;
};

struct FrameWork {
  std::vector<std::string> passes;  // names in the order in which passes begin
  std::vector<WorkRound> rounds;    // pass by pass
  // Lines of images that the frame stores before it reads them; caches drop their copies from the frame before.
  std::vector<memory::LineRange> stored_lines{};
  std::uint64_t tile_state_bytes = 0;     // memory of a core for all samples of a tile, without layers
  std::uint64_t other_bytes = 0;          // bytes of the ledger that belong to no round; moved after all rounds
  std::uint64_t other_written_bytes = 0;  // bytes of these that are written

  std::uint64_t dram_bytes() const;
};

// Number of warps of a sub-patch's vertices when lanes shade them.
inline std::uint64_t domain_warps(const hardware::Machine& gpu, const SubPatchItem& item) {
  const auto lanes = static_cast<std::uint64_t>(gpu.shader.warp_lanes);
  return (item[Event::kVertices] + lanes - 1) / lanes;
}
// Clocks of lanes that the compiled shaders of a tile take. They replace the clocks that constants give for its
// invocations, and for its vertices when lanes shade them.
std::uint64_t compiled_clocks(const hardware::Machine& gpu, const TileItems& items);
// The same for a whole frame, with the vertices that are shaded before its tiles.
std::uint64_t compiled_clocks(const hardware::Machine& gpu, const FrameWork& work);
void take_compiled(const hardware::Machine& gpu, std::uint64_t clocks, EventCounts& counts);

// The events and bytes from which a frame's energy follows.
hardware::EnergyEvents energy_events(const FrameWork& work);

// The ledger's bytes by phase of a tile: lists, patches and reloaded samples belong to visibility, textures to
// shading, the rest (pixels, stored samples, history of the resolve unit) to storing.
std::array<std::uint64_t, kPhaseCount> phase_bytes(const memory::Ledger& ledger);
Phase phase_of(memory::Unit unit, memory::Purpose purpose, bool write);

// Cycles that each unit needs for its work if everything else were infinitely fast. With
// tessellator.domain_shading=lanes vertices are work of the shader in the tile's shading phase: lanes are counted
// once, though visibility needs them earlier. Before tiles, vertices are shaded and triangles set up while the front
// end continues, and operations of the sparse pass are the front end's.
using StageCycles = std::array<double, kStageCount>;
StageCycles stage_cycles(const hardware::Machine& gpu, const GeometryWork& work);
StageCycles stage_cycles(const hardware::Machine& gpu, const TileWork& work);

// The GPU's bytes per clock of the external memory.
inline double memory_rate(const hardware::Machine& gpu) { return gpu.memory_bytes_per_clk(); }

}  // namespace tessera::timing
