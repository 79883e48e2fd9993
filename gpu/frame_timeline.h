#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "gpu/machine_model.h"

namespace tessera::gpu {

// Activity of a tile in its core: a stage of the pipeline, or the reason why it waits.
enum class Activity : std::uint8_t {
  kFetch,
  kTessellate,
  kBvh,
  kSample,
  kShade,
  kResolve,
  kStore,
  kWaitForUnit,  // the units of its next phase work on another tile of the core
  kWaitForData   // the first data of a phase are in flight
};
inline constexpr std::size_t kActivityCount = 9;
constexpr std::string_view name(Activity activity) {
  constexpr std::array<std::string_view, kActivityCount> kNames = {
      "fetch", "tessellate", "BVH", "sample", "shade", "resolve", "store", "wait for unit", "wait for data"};
  return kNames[static_cast<std::size_t>(activity)];
}

// One tile in one slot of its core's memory.
struct TileTrack {
  struct Span {
    Activity activity{};
    double begin = 0, end = 0;
  };
  std::uint32_t round = 0, index = 0;  // FrameWork::rounds[round].tiles[index]
  std::uint32_t tile = 0, core = 0, slot = 0;
  double begin = 0, end = 0;
  std::vector<Span> spans;
  // Cycles of waiting for units of the core, for the first data of its phases, and for the rate of the memory.
  double unit_wait = 0, data_wait = 0, rate_wait = 0;
};

// Origins of traffic: the geometry in front of tiles, the phases of tiles, and traffic outside of rounds.
enum class Source : std::uint8_t { kGeometry, kVisibility, kShading, kStore, kOther };
inline constexpr std::size_t kSourceCount = 5;
constexpr std::string_view name(Source source) {
  constexpr std::array<std::string_view, kSourceCount> kNames = {"geometry", "visibility", "shading", "store", "other"};
  return kNames[static_cast<std::size_t>(source)];
}

// The schedule of one view, for traces and for the page. Cycles from the start of the frame.
//
// Invariants (cited by the tests):
//   FT1  Tiles of a slot are disjoint, spans of a tile are disjoint and inside it.
//   FT2  Windows hold the frame's bytes and each unit's busy cycles.
//   FT3  No window holds more bytes than the memory moves in it at its peak, and no unit is busy for longer than the window.
struct FrameTimeline {
  static constexpr std::size_t kWindows = 256;  // of the frame
  struct Geometry {
    std::uint32_t pass = 0;  // FrameWork::passes
    double bound_begin = 0, bound_end = 0, bin_begin = 0, bin_end = 0;
    std::uint64_t bounds = 0, entries = 0;
  };
  double cycles = 0, window = 0;  // its cycles
  std::vector<Geometry> geometry;
  std::vector<TileTrack> tiles;                               // as Schedule::tiles
  std::uint32_t slots = 0;                                    // most slots that a core used
  std::array<std::vector<double>, kSourceCount> bytes;        // by window
  std::array<std::vector<double>, timing::kStageCount> busy;  // by window: busy share of it, mean over the cores
  std::vector<std::pair<double, double>> list_bytes;          // (cycle, live bytes from that cycle on)
};

FrameTimeline frame_timeline(const GpuConfiguration& gpu, const timing::FrameWork& work,
                             const timing::Schedule& schedule, const timing::FrameTiming& timing);
inline FrameTimeline frame_timeline(const GpuConfiguration& gpu, const MachineModel& model) {
  return frame_timeline(gpu, model.record.work, model.schedule, model.timing);
}

}  // namespace tessera::gpu
