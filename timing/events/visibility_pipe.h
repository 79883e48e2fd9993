#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "hardware/machine.h"
#include "hardware/stage.h"
#include "timing/events/event_queue.h"
#include "timing/events/memory_path.h"
#include "timing/events/texture_path.h"
#include "timing/items.h"
#include "timing/work.h"

namespace tessera::timing {

// Units of a core that find what samples see, sub-patch after sub-patch of one tile:
//
//   list -> records -> sorter -> fetch -> tessellator -> boxes -> box tests -> stencil -> sampling -> triangle tests
//                                  |  records, heights                                                   |
//                                  +--> L2                            coarse depth <- alpha tests <------+
//                                                                                       |  texels -> texture unit
//
// Each unit takes a sub-patch when it has given the one before to the next, which has room for tilecore.queue_items that
// wait; so a slow unit holds up those before it. Sub-patches stay in order.
class VisibilityPipe {
 public:
  VisibilityPipe(const hardware::Machine& gpu, std::uint32_t core, EventQueue& events, MemoryPath& memory,
                 TexturePath& textures, std::optional<hardware::Stage> infinitely_fast);

  // Both must stay until the event kTested. `address`: of the tile's list and what it names.
  void begin(const TileWork& work, const TileItems& items, std::uint64_t address, double now);

  void list_read(double now);
  void fetch(double now);
  void item_read(std::uint32_t item, double now);
  void alpha_start(std::uint32_t item, double now);
  void alpha_read(std::uint32_t item, double now);

 private:
  // Places in units_: the units of a sub-patch after its fetch.
  static constexpr std::size_t kUnits = 8, kAlpha = 6;
  static constexpr double kUnknown = -1;

  double cycles(std::size_t unit, const SubPatchItem& item) const;
  // Takes items through units [first, last) as far as they have arrived; the time at which the item leaves the last.
  double pass(std::uint32_t item, std::size_t first, std::size_t last, double arrival);
  void pass_all();
  // No further than the tessellator's queue reaches, nor than lines may be under way.
  bool may_fetch() const;
  void finish_alpha(std::uint32_t item, double left_tests);
  double& start_of(std::size_t unit, std::uint32_t item) { return starts_[unit][item % ring_]; }

  const hardware::Machine& gpu_;
  std::uint32_t core_;
  EventQueue& events_;
  MemoryPath& memory_;
  TexturePath& textures_;
  std::array<double, kUnits> per_event_{};  // cycles of one event of the unit
  double transform_clk_ = 0, fetch_clk_ = 0, sort_clk_ = 0;
  std::uint32_t ring_;
  std::int64_t max_lines_;

  const TileWork* work_ = nullptr;
  const TileItems* items_ = nullptr;
  std::uint64_t address_ = 0;
  int steps_ = 0;  // of the list: read, then its records
  std::uint32_t count_ = 0, fetched_ = 0, passed_ = 0, tested_ = 0;
  double fetch_free_ = 0;
  bool fetch_asked_ = false;
  std::int64_t lines_waiting_ = 0;
  std::vector<std::uint32_t> first_line_, first_texel_line_;
  std::vector<double> arrived_;                     // of items behind fetch; kUnknown
  std::vector<double> left_;                        // the units before the alpha tests
  std::array<std::vector<double>, kUnits> starts_;  // of the last ring_ items
  std::array<double, kUnits> free_{};               // when the unit is empty
};

}  // namespace tessera::timing
