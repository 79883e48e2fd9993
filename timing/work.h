#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "hardware/energy.h"
#include "hardware/machine.h"
#include "hardware/stage.h"
#include "memory/ledger.h"
#include "timing/items.h"

namespace tessera::timing {

using hardware::kStageCount;
using hardware::Stage;

// What a tile passes through, one after the other: its samples are found, shaded, resolved and stored.
enum class Phase : std::uint8_t { kVisibility, kShading, kStore };
inline constexpr std::size_t kPhaseCount = 3;

// Events of the front end and the binner.
struct GeometryWork {
  std::uint64_t patches = 0;
  std::uint64_t bounds = 0;
  std::uint64_t depth_blocks = 0;         // of the previous frame, re-projected
  std::uint64_t depth_tests = 0;          // of blocks against bounds
  std::uint64_t sampling_operations = 0;  // of the sampling controller's sparse pass
  std::uint64_t entries = 0;
  std::uint64_t tiles_tested = 0;  // pairs of a sub-patch and a tile
  std::uint64_t hashed_bytes = 0;  // of tiles' inputs
  std::uint64_t dram_bytes = 0;
  std::uint64_t table_bytes = 0;    // of these, filled into the L2
  std::uint64_t written_bytes = 0;  // of these
  std::uint64_t queue_bytes = 0;    // of the parameter buffer in use at the end
};

// Events of one tile (or of one partial render of it). Filled where the tile is rendered, whatever thread does; then in
// emulated order what depends on shared caches.
struct TileWork {
  std::uint32_t tile = 0;
  std::uint64_t entries = 0;
  std::uint64_t sort_steps = 0;
  std::uint64_t sub_patches = 0;    // tested, tessellated for it or found in the cache
  std::uint64_t vertices = 0;       // evaluated for it
  std::uint64_t domain_texels = 0;  // bilinear lookups of heights that shading these on lanes takes
  std::uint64_t transforms = 0;     // of vertices that were there, to both motion keys
  std::uint64_t boxes = 0;          // of cells and leaves; in lists of triangles, set up to be tested
  std::uint64_t box_tests = 0;
  std::uint64_t box_lanes = 0;  // of them, idle ones included
  std::uint64_t stencil_tests = 0;
  std::uint64_t sampling_operations = 0;  // of the SIMD array that evaluates procedures, idle lanes included
  std::uint64_t triangle_tests = 0;       // and tests of footprints
  std::uint64_t triangle_lanes = 0;       // of them, idle ones included
  std::uint64_t hits = 0;
  std::uint64_t alpha_tests = 0;
  std::uint64_t depth_blocks = 0;       // whose farthest depth was found again, and entries compared with some
  std::uint64_t compacted_samples = 0;  // packed into warps, and layers
  std::uint64_t shader_invocations = 0;
  std::uint64_t shader_lanes = 0;         // of their warps, idle ones included
  std::uint64_t surface_evaluations = 0;  // invocations that evaluate their patch again
  std::uint64_t surface_lanes = 0;        // of their warps
  std::uint64_t texels = 0;               // bilinear lookups of shading
  std::uint64_t l2_lines = 0;             // asked of the L2, and filled into it
  std::uint64_t blended_layers = 0;
  std::uint64_t pixels = 0;              // resolved
  std::uint64_t resolve_operations = 0;  // of desampling: stencil taps, velocities, advected pixels
  std::uint64_t hashed_bytes = 0;        // of its colours
  std::array<std::uint64_t, kPhaseCount> dram_bytes{};
};

// What machines that bin triangles do between the front end and the binner; ours does nothing there, and no record holds
// it.
struct TriangleWork {
  std::uint64_t vertices = 0;   // shaded by the tessellators of all cores
  std::uint64_t triangles = 0;  // culled and set up
};

// A binner's run and the tiles that it led to; one a frame but for partial renders and second passes.
struct WorkRound {
  GeometryWork geometry;
  std::vector<TileWork> tiles;   // in the order of the tile scheduler
  std::vector<TileItems> items;  // of each, or none at all
  std::vector<std::uint32_t>
      geometry_lines{};  // with items: those of heights' tables that the front end asks of the L2
  TriangleWork triangles{};
};

struct FrameWork {
  std::vector<WorkRound> rounds;
  std::uint64_t tile_state_bytes = 0;     // what all samples of a tile see, in its core's memory
  std::uint64_t other_bytes = 0;          // of the ledger, by what is no part of the rounds; moved after them
  std::uint64_t other_written_bytes = 0;  // of these

  std::uint64_t dram_bytes() const;
};

// Warps of a sub-patch's vertices where lanes shade them.
inline std::uint64_t domain_warps(const hardware::Machine& gpu, const SubPatchItem& item) {
  const auto lanes = static_cast<std::uint64_t>(gpu.shader.warp_lanes);
  return (item.vertices + lanes - 1) / lanes;
}
// Clocks of lanes that the compiled shaders of a tile take; they replace what constants make of its invocations, and of
// its vertices where lanes shade them.
std::uint64_t compiled_clocks(const hardware::Machine& gpu, const TileItems& items);
void take_compiled(const hardware::Machine& gpu, std::uint64_t clocks, hardware::EnergyEvents& events);

// What a frame's energy follows from.
hardware::EnergyEvents energy_events(const FrameWork& work);

// How much of the ledger belongs to each phase of a tile: queues, patches and reloaded samples to visibility, textures
// to shading, the rest (pixels, stored samples, what the resolve unit keeps) to storing.
std::array<std::uint64_t, kPhaseCount> phase_bytes(const memory::Ledger& ledger);
Phase phase_of(memory::Unit unit, memory::Purpose purpose, bool write);

// Cycles that each unit needs for an amount of work, all else being infinitely fast. With
// tessellator.domain_shading=lanes vertices are work of the shader, which a tile has in its shading phase: lanes are
// taken once, though the tile would want them before.
using StageCycles = std::array<double, kStageCount>;
StageCycles stage_cycles(const hardware::Machine& gpu, const GeometryWork& work);
StageCycles stage_cycles(const hardware::Machine& gpu, const TileWork& work);
// Of a round's geometry. Vertices are shaded and triangles set up while the front end goes on.
StageCycles geometry_cycles(const hardware::Machine& gpu, const WorkRound& round);

// Bytes per clock that the GPU gets of the external memory.
inline double memory_rate(const hardware::Machine& gpu) { return gpu.bytes_per_clk() * gpu.memory.gpu_share; }

}  // namespace tessera::timing
