#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

#include "hardware/machine.h"
#include "timing/events/event_queue.h"
#include "timing/events/memory_path.h"
#include "timing/events/simulation_counts.h"
#include "timing/events/texture_path.h"
#include "timing/items.h"

namespace tessera::timing {

// The lanes of a core. They run warps of one tile after another, as many in flight as registers and shader.max_warps
// allow, the oldest ready warp first.
//
//   compaction -> in flight: ready -> lanes: coordinates -> texture unit -> texels wait -> ready -> lanes: the rest
//   vertices of sub-patches -^
//
// A warp with lookups computes their coordinates in a first part, which takes kBeforeLookups of its operations.
//
// With tessellator.domain_shading=lanes vertices come as warps, too, and go first: the next tile's visibility waits
// for them, a pixel's warp only for its own tile. Waits cannot form a cycle: warps in flight wait for texels alone,
// and pixels belong to a tile whose vertices are shaded. Pixels do not starve: only sub-patches for which the
// tessellator has room send vertices, of no more tiles than the core holds.
class ShaderCore {
 public:
  static constexpr double kBeforeLookups = 0.25;

  struct Rates {
    // Operations of an invocation, surface evaluation, background sample, place or light of a list, or texel of a pass over an image.
    double operations, surface_operations, background_operations, light_operations, image_operations;
    double lanes;  // lanes of the core
    std::uint32_t warp_lanes;
    double texels_per_clk;
    double compaction_clk;  // clocks for one warp
    std::size_t max_warps;
    double register_bytes, registers;  // bytes of the core; registers of an invocation
    double compiled_clk;               // clocks for one clock of compiled code; 0: it takes no time
    bool compiled;                     // each warp's own shader gives operations and registers
  };
  static Rates rates_of(const hardware::Machine& gpu);

  ShaderCore(std::uint32_t core, const Rates& rates, EventQueue& events, TexturePath& textures);

  // Begins a tile when the records that shading reads have arrived. `items` must stay until the event kShaded.
  void begin(const TileItems& items, double now);
  // Shades the vertices of a sub-patch, at least one. `height_lines`, as many as it has, are spread over their warps
  // and asked of the texture unit. Arguments must stay until the event kDomainShaded of `number`.
  void shade_vertices(std::uint32_t number, const SubPatchItem& item, const std::uint32_t* height_lines, double now);

  void warp_packed(double now) { launch(now); }
  void lanes_free(double now);
  void texels_read(std::uint32_t warp, double now);
  void heights_read(std::uint32_t warp, double now);

  double busy() const { return busy_; }
  const DomainCounts& domain() const { return domain_; }
  const std::array<double, kStallCount>& stalls() const { return stalls_; }
  void end(double now) { count_idle(now); }

 private:
  enum class State : std::uint8_t { kWaiting, kFirst, kLookUp, kReading, kLast, kDone };
  struct Warp {
    State state = State::kWaiting;
    std::uint32_t first_line = 0;
  };
  // A sub-patch whose vertices are being shaded.
  struct Vertices {
    std::uint32_t number;
    const SubPatchItem* item;
    const std::uint32_t* height_lines;
    std::uint32_t warps, launched = 0, done = 0;
  };
  struct DomainWarp {
    State state = State::kDone;
    std::uint32_t of = 0, place = 0;  // index in vertices_; number of the warp among its vertices' warps
    std::uint64_t order = 0;
  };
  // Warps that wait for the lanes, the lowest key first: domain warps in the order of their launch, then pixel warps.
  using Ready = std::pair<std::uint64_t, std::uint32_t>;
  static constexpr std::uint64_t kOfPixels = std::uint64_t{1} << 63;

  double cycles(std::uint32_t warp, bool first_part) const;
  double domain_cycles(const DomainWarp& warp) const;
  double register_bytes(double of_lane) const { return of_lane * 4 * rates_.warp_lanes; }
  double pixel_registers(std::uint32_t warp) const;
  double domain_registers(const SubPatchItem& item) const;
  // A warp that needs more registers than the core has runs alone.
  bool fits(double registers) const {
    return in_flight_ < rates_.max_warps && (in_flight_ == 0 || registers_taken_ + registers <= rates_.register_bytes);
  }
  void launch(double now);
  // Returns false when some vertices wait for room.
  bool launch_vertices();
  void launch_pixels(double now);
  void issue(double now);
  void wait_for_what();
  void finish(std::uint32_t warp, double now);
  void finish_domain(std::uint32_t warp, double now);
  void look_heights_up(std::uint32_t warp);
  void count_idle(double now);
  void make_ready(std::uint64_t order, std::uint32_t warp);

  std::uint32_t core_;
  Rates rates_;
  EventQueue& events_;
  TexturePath& textures_;
  const TileItems* items_ = nullptr;
  std::vector<Warp> warps_;
  std::vector<Vertices> vertices_;
  std::vector<std::uint32_t> free_vertices_;
  std::deque<std::uint32_t> to_launch_;  // indices in vertices_
  std::vector<DomainWarp> domain_warps_;
  std::vector<std::uint32_t> free_domain_warps_;
  std::uint64_t domain_order_ = 0;
  std::vector<Ready> ready_;  // heap
  std::uint32_t next_ = 0, oldest_ = 0, done_ = 0;
  std::array<std::uint32_t, WarpItem::kSteps> steps_in_flight_{};  // warps by WarpItem::step()
  std::size_t in_flight_ = 0;                                      // warps of both kinds
  Ready on_lanes_{};
  bool issuing_ = false, packing_ = false;
  double registers_taken_ = 0;  // bytes
  double began_ = 0, idle_since_ = 0, busy_ = 0;
  Stall reason_ = Stall::kNoTile;
  DomainCounts domain_;
  std::array<double, kStallCount> stalls_{};
};

}  // namespace tessera::timing
