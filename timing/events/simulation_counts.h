#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "timing/events/path_time.h"

namespace tessera::timing {

// Traffic as it happened in time.
struct MemoryCounts {
  std::uint64_t l2_requests = 0, l2_misses = 0;
  std::uint64_t read_bytes = 0, written_bytes = 0;  // of the external memory
  double memory_busy = 0;                           // cycles
  std::uint64_t activates = 0, row_hits = 0;        // of memory.model=banks
};

// Vertices that lanes shaded.
struct DomainCounts {
  std::uint64_t vertices = 0, warps = 0, texels = 0;
  double lanes_busy = 0;  // cycles
};

// Why the lanes of a shader core did nothing.
enum class Stall : std::uint8_t {
  kNoTile,   // no tile was ready to be shaded
  kNoWarp,   // none was packed yet, or the last of the tile were on their way
  kTexture,  // the oldest warp waited for the texture unit
  kMemory    // the oldest warp waited for texels
};
inline constexpr std::size_t kStallCount = 4;
constexpr std::string_view name(Stall stall) {
  constexpr std::array<std::string_view, kStallCount> kNames = {"no_tile", "no_warp", "texture", "memory"};
  return kNames[static_cast<std::size_t>(stall)];
}

// What happened in the time of a frame that phases know nothing of.
struct SimulationCounts {
  MemoryCounts memory;
  std::uint64_t texture_requests = 0, texture_misses = 0;
  DomainCounts domain;                       // of tessellator.domain_shading=lanes; cycles as those of stalls
  std::array<double, kStallCount> stalls{};  // of the shader lanes, cycles, mean over the cores
  std::uint64_t events = 0;                  // of the simulation
  PathTime path;                             // to the end of the frame

  void accumulate(const SimulationCounts& frame);
};

}  // namespace tessera::timing
