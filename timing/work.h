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

// What a tile passes through, one after the other: its samples are found, shaded, resolved and stored.
enum class Phase : std::uint8_t { kVisibility, kShading, kStore };
inline constexpr std::size_t kPhaseCount = 3;

// Events of the front end and the binner; of machines that bin or draw triangles also vertices that the tessellators of
// all cores shade before, and elements of records that they decode for that (kDecodedElements), instructions of other shaders that run before (kShaderClocks), their lookups (kTexels), and
// triangles that are set up.
struct GeometryWork {
  EventCounts events;
  std::uint64_t patches = 0;
  std::uint64_t dram_bytes = 0;
  std::uint64_t table_bytes = 0;    // of these, filled into the L2
  std::uint64_t written_bytes = 0;  // of these
  std::uint64_t queue_bytes = 0;    // of the parameter buffer in use at the end
  std::uint64_t vertex_clocks = 0;  // of lanes, for the compiled shaders of its vertices
};

// Events of one tile (or of one partial render of it). Filled where the tile is rendered, whatever thread does; then in
// emulated order what depends on shared caches.
struct TileWork {
  std::uint32_t tile = 0;
  EventCounts events;
  std::uint64_t sub_patches = 0;  // tested, tessellated for it or found in the cache
  std::array<std::uint64_t, kPhaseCount> dram_bytes{};
  // Bytes of blended layers, tables of triangles and vertices that its core keeps beside FrameWork::tile_state_bytes.
  std::uint64_t extra_bytes = 0;
};

// A binner's run and the tiles that it led to; one of each pass but for partial renders.
struct WorkRound {
  static constexpr std::uint32_t kAllBefore = 0xFFFFFFFFu;

  GeometryWork geometry;
  std::vector<TileWork> tiles;   // in the order of the tile scheduler
  std::vector<TileItems> items;  // of each, or none at all
  std::vector<std::uint32_t>
      geometry_lines{};    // with items: those of heights' tables that the front end asks of the L2
  std::uint32_t pass = 0;  // of FrameWork::passes
  // So many rounds of the frame must be stored before its geometry, and its tiles, may begin. With machine.overlap=none
  // all that come before it must.
  std::uint32_t geometry_after = kAllBefore, tiles_after = kAllBefore;
};

struct FrameWork {
  std::vector<std::string> passes;  // their names, in the order in which they begin
  std::vector<WorkRound> rounds;    // pass by pass
  // Lines of images that the frame stores before it reads them: caches lose those that they hold from the frame before.
  std::vector<memory::LineRange> stored_lines{};
  std::uint64_t tile_state_bytes = 0;     // what all samples of a tile see, in its core's memory, without layers
  std::uint64_t other_bytes = 0;          // of the ledger, by what is no part of the rounds; moved after them
  std::uint64_t other_written_bytes = 0;  // of these

  std::uint64_t dram_bytes() const;
};

// Warps of a sub-patch's vertices where lanes shade them.
inline std::uint64_t domain_warps(const hardware::Machine& gpu, const SubPatchItem& item) {
  const auto lanes = static_cast<std::uint64_t>(gpu.shader.warp_lanes);
  return (item[Event::kVertices] + lanes - 1) / lanes;
}
// Clocks of lanes that the compiled shaders of a tile take; they replace what constants make of its invocations, and of
// its vertices where lanes shade them.
std::uint64_t compiled_clocks(const hardware::Machine& gpu, const TileItems& items);
// The same of a whole frame, with the vertices that are shaded before its tiles.
std::uint64_t compiled_clocks(const hardware::Machine& gpu, const FrameWork& work);
void take_compiled(const hardware::Machine& gpu, std::uint64_t clocks, EventCounts& counts);

// What a frame's energy follows from.
hardware::EnergyEvents energy_events(const FrameWork& work);

// How much of the ledger belongs to each phase of a tile: queues, patches and reloaded samples to visibility, textures
// to shading, the rest (pixels, stored samples, what the resolve unit keeps) to storing.
std::array<std::uint64_t, kPhaseCount> phase_bytes(const memory::Ledger& ledger);
Phase phase_of(memory::Unit unit, memory::Purpose purpose, bool write);

// Cycles that each unit needs for an amount of work, all else being infinitely fast. With
// tessellator.domain_shading=lanes vertices are work of the shader, which a tile has in its shading phase: lanes are
// taken once, though the tile would want them before. Before tiles, vertices are shaded and triangles set up while the
// front end goes on, and operations of the sparse pass are the front end's.
using StageCycles = std::array<double, kStageCount>;
StageCycles stage_cycles(const hardware::Machine& gpu, const GeometryWork& work);
StageCycles stage_cycles(const hardware::Machine& gpu, const TileWork& work);

// Bytes per clock that the GPU gets of the external memory.
inline double memory_rate(const hardware::Machine& gpu) { return gpu.memory_bytes_per_clk(); }

}  // namespace tessera::timing
