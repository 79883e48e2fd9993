#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hardware/machine.h"
#include "timing/events/event_counts.h"
#include "timing/events/event_queue.h"
#include "timing/events/memory_path.h"
#include "timing/events/texture_path.h"
#include "timing/items.h"

namespace tessera::timing {

// The lanes of a core: warps of one tile after the other, as many in flight as registers and shader.max_warps allow, the
// oldest that is ready first.
//
//   compaction -> in flight: ready -> lanes: coordinates -> texture unit -> texels wait -> ready -> lanes: the rest
//
// A warp with lookups computes where they are in a first part, kBeforeLookups of its operations.
class ShaderCore {
 public:
  static constexpr double kBeforeLookups = 0.25;

  struct Rates {
    double operations, surface_operations, lanes;  // of an invocation; lanes of the core
    double warp_lanes;
    double texels_per_clk;
    double compaction_clk;  // of a warp
    std::size_t max_warps;
    double register_bytes, registers;  // of the core; of an invocation
    double compiled_clk;               // of one clock of compiled code; 0: it takes no time
    bool compiled;                     // operations and registers are those of each warp's own shader
  };
  static Rates rates_of(const hardware::Machine& gpu, std::uint64_t warp_lanes);

  ShaderCore(std::uint32_t core, const Rates& rates, EventQueue& events, TexturePath& textures);

  // `items` must stay until the event kShaded. Records that shading reads are there.
  void begin(const TileItems& items, double now);

  void warp_packed(double now) { launch(now); }
  void lanes_free(double now);
  void texels_read(std::uint32_t warp, double now);

  double busy() const { return busy_; }
  const std::array<double, kStallCount>& stalls() const { return stalls_; }
  void end(double now) { count_idle(now); }

 private:
  enum class State : std::uint8_t { kWaiting, kFirst, kLookUp, kReading, kLast, kDone };
  struct Warp {
    State state = State::kWaiting;
    std::uint32_t first_line = 0;
  };

  double cycles(std::uint32_t warp, bool first_part) const;
  double register_bytes(std::uint32_t warp) const;
  void launch(double now);
  void issue(double now);
  void finish(std::uint32_t warp, double now);
  void count_idle(double now);
  void make_ready(std::uint32_t warp);

  std::uint32_t core_;
  Rates rates_;
  EventQueue& events_;
  TexturePath& textures_;
  const TileItems* items_ = nullptr;
  std::vector<Warp> warps_;
  std::vector<std::uint32_t> ready_;  // heap, the oldest on top
  std::uint32_t next_ = 0, oldest_ = 0, in_flight_ = 0, done_ = 0, on_lanes_ = 0;
  bool issuing_ = false, packing_ = false;
  double registers_taken_ = 0;  // bytes
  double began_ = 0, idle_since_ = 0, busy_ = 0;
  Stall reason_ = Stall::kNoTile;
  std::array<double, kStallCount> stalls_{};
};

}  // namespace tessera::timing
