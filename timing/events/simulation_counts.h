#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "timing/events/path_time.h"

namespace tessera::timing {

// Memory traffic of the simulation.
struct MemoryCounts {
  std::uint64_t l2_requests = 0, l2_misses = 0;
  std::uint64_t read_bytes = 0, written_bytes = 0;  // of the external memory
  double memory_busy = 0;                           // cycles
  std::uint64_t activates = 0, row_hits = 0;        // with memory.model=banks
};

// Counts of vertices that lanes shaded.
struct DomainCounts {
  std::uint64_t vertices = 0, warps = 0, texels = 0;
  double lanes_busy = 0;  // cycles
};

// Reasons for which the lanes of a shader core are idle.
enum class Stall : std::uint8_t {
  kNoTile,   // no tile was ready to be shaded
  kNoWarp,   // no warp was packed yet, or the tile's last warps were in flight
  kTexture,  // the oldest warp waited for the texture unit
  kMemory    // the oldest warp waited for texels
};
inline constexpr std::size_t kStallCount = 4;
constexpr std::string_view name(Stall stall) {
  constexpr std::array<std::string_view, kStallCount> kNames = {"no_tile", "no_warp", "texture", "memory"};
  return kNames[static_cast<std::size_t>(stall)];
}

// Counts of a frame that only the simulation of events has.
struct SimulationCounts {
  MemoryCounts memory;
  std::uint64_t texture_requests = 0, texture_misses = 0;
  DomainCounts domain;                       // with tessellator.domain_shading=lanes; cycles are means, as in `stalls`
  std::array<double, kStallCount> stalls{};  // idle cycles of the shader lanes, mean over the cores
  std::uint64_t events = 0;                  // number of events of the simulation
  PathTime path;                             // path to the end of the frame

  void accumulate(const SimulationCounts& frame);
};

}  // namespace tessera::timing
