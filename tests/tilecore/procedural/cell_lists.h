#pragma once

#include "binner/binner.h"
#include "tests/support/tests.h"
#include "tilecore/procedural/sampling_controller.h"

namespace tessera::tilecore {

// Tile lists of nothing but a frame's cells, as the binner makes them.
class CellLists {
 public:
  CellLists(const scene::FrameGeometry& frame, const ParameterMaps& maps, const binner::TileGrid& grid,
            const binner::Settings& settings = {})
      : frame_(frame), binner_(spec(settings), grid) {
    binner::Binner::Cursor cursor;
    EXPECT_TRUE(binner_.run(frame, maps.sub_patches(), cursor));
  }

  // Near to far.
  std::vector<binner::ListEntry> of_tile(binner::TileIndex tile) const {
    memory::Ledger ledger;
    std::uint64_t bytes = 0;
    std::vector<binner::ListEntry> entries = binner_.read_tile(frame_, tile, ledger, bytes);
    std::stable_sort(entries.begin(), entries.end(),
                     [](const auto& a, const auto& b) { return a.near_depth < b.near_depth; });
    return entries;
  }

  const binner::BinnerCounters& counters() const { return binner_.buffer().counters(); }

 private:
  static binner::BinnerSpec spec(const binner::Settings& settings) {
    binner::BinnerSpec out;
    out.binner = settings;
    out.parameter_buffer.bytes = std::int64_t{1} << 30;
    return out;
  }

  const scene::FrameGeometry& frame_;
  binner::Binner binner_;
};

// All cells of a tile, none of them hidden.
inline void draw_cells(SamplingController& controller, const SamplingController::Job& job,
                       std::span<const binner::ListEntry> entries) {
  controller.begin_tile(job.samples);
  for (const binner::ListEntry& entry : entries)
    if (controller.take(job.maps, ParameterMaps::cell_of(entry.range), {entry.t0, entry.t1})) controller.draw(job);
  controller.draw(job);
}

}  // namespace tessera::tilecore
