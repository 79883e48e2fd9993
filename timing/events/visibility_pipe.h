#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hardware/machine.h"
#include "hardware/stage.h"
#include "timing/events/event_queue.h"
#include "timing/events/memory_path.h"
#include "timing/events/shader_core.h"
#include "timing/events/texture_path.h"
#include "timing/items.h"
#include "timing/work.h"

namespace tessera::timing {

// Units of a core that find the visible surfaces of samples, sub-patch after sub-patch of one tile:
//
//   list -> records -> sorter -> fetch -> tessellator -> boxes -> box tests -> stencil -> sampling -> triangle tests
//                                  |  records, heights                                                   |
//                                  +--> L2                            coarse depth <- alpha tests <------+
//                                                                                       |  texels -> texture unit
//
// A unit takes a sub-patch when it has given the one before to the next unit, which has room for tilecore.queue_items
// waiting ones; so a slow unit holds up the units before it. Sub-patches stay in order.
//
// With tessellator.domain_shading=lanes the tessellator keeps its transforms, and the core's lanes shade the
// vertices. It sends them a sub-patch when its records have arrived and its vertices have a place, in the queue to
// the box builder or in the tessellator itself; so lanes work on as many sub-patches at once as that queue holds.
// Lines of heights are then asked of the texture unit by the warps that look them up, not by the fetch unit.
class VisibilityPipe {
 public:
  // Units of the same core, and the shared memory.
  struct Others {
    MemoryPath& memory;
    TexturePath& textures;
    ShaderCore& lanes;
  };
  VisibilityPipe(const hardware::Machine& gpu, std::uint32_t core, EventQueue& events, const Others& others);

  // Begins a tile; `work` and `items` must stay until the event kTested. `address`: place of the tile's list and the
  // records that it names.
  void begin(const TileWork& work, const TileItems& items, std::uint64_t address, double now);

  void list_read(double now);
  void fetch(double now);
  void item_read(std::uint32_t item, double now);
  void domain_start(std::uint32_t item, double now);
  void domain_shaded(std::uint32_t item, double now);
  void alpha_start(std::uint32_t item, double now);
  void alpha_read(std::uint32_t item, double now);

 private:
  // Indices in units_: the units of a sub-patch after its fetch.
  static constexpr std::size_t kUnits = 8, kAlpha = 6;
  static constexpr double kUnknown = -1;

  // A time within the tile. Its path is the path of an event, followed by cycles of units.
  struct Moment {
    double time = kUnknown;
    std::uint32_t event = 0;  // paths_
    std::array<double, kUnits> clk{};
  };

  double cycles(std::size_t unit, const SubPatchItem& item) const;
  // The moment of the current event.
  Moment moment(double now);
  PathTime path_of(const Moment& moment) const;
  void push(const Moment& moment, EventKind kind, std::uint32_t what = 0);
  // Takes an item through units [first, last); returns the moment at which it leaves the last.
  Moment pass(std::uint32_t item, std::size_t first, std::size_t last, const Moment& arrival);
  void pass_all();
  // Whether another item may be fetched: the tessellator's queue and the lines in flight set limits.
  bool may_fetch() const;
  // Lines that the fetch unit asks for.
  std::uint32_t fetched_lines(const SubPatchItem& item) const {
    return item.lines - (on_lanes_ ? item.height_lines : 0);
  }
  // Gives the lanes all sub-patches that have a place.
  void start_domain();
  void finish_alpha(std::uint32_t item, const Moment& left_tests);
  void start_alpha(std::uint32_t item);
  Moment& start_of(std::size_t unit, std::uint32_t item) { return starts_[unit][item % ring_]; }

  const hardware::Machine& gpu_;
  std::uint32_t core_;
  EventQueue& events_;
  MemoryPath& memory_;
  TexturePath& textures_;
  ShaderCore& lanes_;
  bool on_lanes_;
  std::array<double, hardware::kItemEventCount> per_event_{};  // cycles of one event
  std::array<std::size_t, kUnits>
      end_of_unit_{};  // end of each unit's events; they begin at the end of the unit before
  double fetch_clk_ = 0, sort_clk_ = 0;
  std::uint32_t ring_;
  std::int64_t max_lines_;

  const TileWork* work_ = nullptr;
  const TileItems* items_ = nullptr;
  std::uint64_t address_ = 0;
  int steps_ = 0;  // steps of reading the list that are left: the list, then its records
  std::uint32_t count_ = 0, fetched_ = 0, given_ = 0, started_ = 0, passed_ = 0, tested_ = 0;
  double fetch_free_ = 0;
  bool fetch_asked_ = false;
  std::int64_t lines_waiting_ = 0;
  std::vector<std::uint32_t> first_line_, first_texel_line_;
  std::vector<Moment> arrived_;  // arrival of items after fetch, or kUnknown
  // With vertices on lanes: times at which items are shaded, at which boxes are built, and of the last item given to the lanes.
  std::vector<Moment> shaded_, boxed_;
  Moment last_given_;
  std::vector<Moment> left_;                        // times at which items leave the units before the alpha tests
  std::array<std::vector<Moment>, kUnits> starts_;  // starts of the last ring_ items
  std::array<Moment, kUnits> free_{};               // times at which units are empty
  std::vector<PathTime> paths_;                     // paths of this tile's events, where paths are recorded
};

}  // namespace tessera::timing
