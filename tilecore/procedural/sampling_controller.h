#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "binner/tile_grid.h"
#include "memory/ledger.h"
#include "scene/frame_geometry.h"
#include "tilecore/drawable_counts.h"
#include "tilecore/procedural/parameter_maps.h"
#include "tilecore/procedural/procedure_kernel.h"
#include "tilecore/tile_state.h"
#include "tilecore/visibility/sample_pattern.h"

namespace tessera::tilecore {

// Sampling controller of one tile core: the render pass (US 2007/0002066, with the deviations that docs/procedural.md
// lists). Walks the cells that the parameter map lists for a tile, steps through each at its rate, runs the procedure's
// stages on the emulated SIMD array and scatters the samples into the tile buffer, which is the tile's samples: 4x4 to
// the pixel at 16 samples per pixel.
//
//   parameter map -> objects near to far -> batches of (u, v) -> SIMD array -> scatter,    -> tile state
//   of the tile      cull what is hidden    at each cell's rate  geometry, view  depth test
//
// Invariants (cited by the tests):
//   SC1  What a sample point sees follows from the frame and the settings alone: not from the tile, its size, the order
//        of cells or of samples. Equal depths go to the lower base patch, then to the lower parameters.
//   SC2  With interval maps no sample point inside the image of a procedure is left out, but for what one footprint
//        bends.
//   SC3  Every sample evaluated is counted once as outside the tile, behind, back-facing, not finite, or scattered.
//
// Keeps its scratch memory; one instance per thread.
class SamplingController {
 public:
  SamplingController();

  // What the tile's samples see of procedures; joins what `state` holds already.
  void render(const scene::FrameGeometry& frame, const ParameterMaps& maps, binner::TileIndex tile,
              const TileSamples& samples, std::uint64_t burst_bytes, TileState& state);

  // Until the next call, samples are also counted for the drawable they are taken of; empty: they are not.
  void count_drawables(std::span<DrawableCounts> drawables) { drawables_ = drawables; }

  const SamplingCounters& counters() const { return counters_; }
  SamplingCounters take_counters() { return std::exchange(counters_, {}); }
  memory::Ledger take_ledger() { return std::exchange(ledger_, {}); }
  // Until take_ledger(), every transfer also goes to `log`.
  void record_accesses(memory::AccessLog* log) { ledger_.record_into(log); }

  // Sub-pixels along a pixel's side for so many samples: the smallest square that has room for them.
  static int sub_pixels(int samples_per_pixel);

 private:
  // Cells of one piece, in the tile at hand.
  struct Group {
    std::uint32_t first, count;  // of order_
    float near_z;
  };
  struct Job {
    const scene::FrameGeometry& frame;
    const ParameterMaps& maps;
    const TileSamples& samples;
    TileState& state;
    // A lens that is forced on a pinhole sees what the pinhole does: procedures are tested without it.
    bool lens() const { return !samples.lens_u.empty() && samples.lens_scale != 0; }
  };
  // A sample on its way from the array to the tile buffer.
  struct Footprint {
    const ParameterCell* cell;
    float u, v, half_u, half_v;
    float slack() const { return static_cast<float>(cell->slack) * (1.0f / 256); }
  };

  void find_slots(const TileSamples& samples);
  void group_cells(std::span<const std::uint32_t> cells, const ParameterMaps& maps, const IntRect& pixels);
  std::uint64_t image_bytes_of(const Group& group, const ParameterMaps& maps, const shaders::GeometryImage& image,
                               std::uint64_t burst_bytes) const;
  void run_group(const Job& job, const Group& group);
  void run_batch(const Job& job);
  // The emulated array's work on tuples of the piece under way that it takes together.
  void count_issued(const Job& job, std::uint64_t issued);

  // sampling_scatter.cpp
  void scatter_still(const Job& job, std::size_t k);
  void scatter_points(const Job& job, std::size_t k);
  void scatter_moving(const Job& job, std::size_t k);
  void write(const Job& job, const ParameterCell& cell, std::size_t sample, float z, float u, float v,
             std::uint32_t triangle);
  void keep_rest(const Job& job, std::size_t k, std::size_t sample);

  // sampling_refill.cpp
  void refill_holes(const Job& job);
  void refill_once(const Job& job);
  bool refill(const Job& job, std::size_t hole, std::size_t before, std::size_t after);

  // sampling_lines.cpp
  void draw_lines(const Job& job, std::span<const std::uint32_t> cells);
  void draw_cell_lines(const Job& job, const ParameterCell& cell, bool along_u);
  void scatter_line(const Job& job, const ParameterCell& cell, std::size_t k, bool along_u, float half_step,
                    float max_light);
  void begin_piece(const Job& job, const ParameterCell& first);

  std::vector<std::uint32_t> order_;
  std::vector<Group> groups_;
  // Samples of a pixel by the sub-pixel they lie in: slot s has slot_sample_[slot_first_[s]] up to slot_first_[s + 1].
  int side_ = 1;
  std::vector<std::uint32_t> slot_first_, slot_sample_;

  // The batch under way: all of one piece.
  std::unique_ptr<SampleRegisters> registers_;
  std::vector<Footprint> footprints_;
  ArrayProgram program_;
  std::uint32_t drawable_ = 0, piece_ = 0;

  SamplingCounters counters_;
  std::span<DrawableCounts> drawables_;
  memory::Ledger ledger_;
};

}  // namespace tessera::tilecore
