#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "scene/frame_geometry.h"
#include "scene/procedure_patch.h"
#include "tilecore/drawable_counts.h"
#include "tilecore/procedural/parameter_maps.h"
#include "tilecore/procedural/procedure_kernel.h"
#include "tilecore/shading/texture_unit.h"
#include "tilecore/tile_state.h"
#include "tilecore/visibility/sample_pattern.h"

namespace tessera::tilecore {

// Sampling controller of one tile core: the render pass (US 2007/0002066, with the deviations that docs/procedures.md
// lists). It gets the cells of a tile's list in its order, omits the steps that cannot reach the tile, runs the
// procedure's stages on the emulated SIMD array and scatters the samples into the tile buffer, which is the tile's
// samples: 4x4 to the pixel at 16 samples per pixel.
//
//   cells of the -> cells that wait, -> steps that may -> batches of (u, v) -> SIMD array -> scatter,    -> tile state
//   tile's list     piece by piece      reach the tile    of one piece       geometry, view  depth test
//
// Invariants (cited by the tests):
//   SC1  The surface at a sample point follows from the frame and the settings alone: not from the tile, its size, the order
//        of cells or of samples. Equal depths go to the lower base patch, then to the lower parameters.
//   SC2  With interval maps no sample point inside the image of a procedure is missed, up to the curvature of one
//        footprint.
//   SC3  Every sample evaluated is counted once as outside the tile, behind, back-facing, not finite, or scattered.
//   SC5  A sample point has one layer of a blending surface for each time that its ray meets the surface, whatever the
//        footprints that cover it there.
//   SC4  A step that is not evaluated would have reached no sample of the tile.
//
// Owns scratch memory; one instance per thread.
class SamplingController {
 public:
  // Lanes of the emulated SIMD array, which issue together [assumed].
  static constexpr std::uint64_t kArrayLanes = 32;

  SamplingController();

  struct Job {
    const scene::FrameGeometry& frame;
    const ParameterMaps& maps;
    const TileSamples& samples;
    TileState& state;
    // For alpha tests, which are counted; nullptr: nothing is fetched.
    TextureUnit* textures = nullptr;
    std::uint64_t* alpha_tests = nullptr;
    // A lens forced on a pinhole has no effect on the image, so procedures are tested without it.
    bool lens() const { return !samples.lens_u.empty() && samples.lens_scale != 0; }
  };
  // Call it before the first cell of a tile.
  void begin_tile(const TileSamples& samples) { find_slots(samples); }
  // Takes a cell of the tile's list, which may touch the tile at some of its times only. Returns true if enough cells
  // wait; the caller then calls draw(), which draws all of them.
  [[nodiscard]] bool take(const ParameterMaps& maps, std::uint32_t cell, TimeRange times);
  void draw(const Job& job);
  // Merges the layers that neighbouring footprints left of one surface. Call it when all of a tile is drawn.
  void merge_layers(const scene::FrameGeometry& frame, TileState& state);

  // Reads of draw() since the last call, call by call: for each piece its numbers, then its cells.
  struct CellRead {
    std::uint32_t cell;
    bool first_of_piece;
  };
  std::vector<CellRead> take_reads() { return std::exchange(reads_, {}); }

  // Also counts samples for their drawables, until the next call; empty: does not.
  void count_drawables(std::span<DrawableCounts> drawables) { drawables_ = drawables; }

  // Counts the cells and objects of a tile's list.
  void count_entries(std::uint64_t cells, std::uint64_t objects) {
    counters_.map_entries += cells;
    counters_.tags += objects;
  }
  const SamplingCounters& counters() const { return counters_; }
  SamplingCounters take_counters() { return std::exchange(counters_, {}); }

  // Sub-pixels along a pixel's side for this many samples: the smallest square that has room for them.
  static int sub_pixels(int samples_per_pixel);

 private:
  struct Waiting {
    std::uint32_t cell;
    TimeRange times;
  };
  // A sample between the array and the tile buffer.
  struct Footprint {
    const ParameterCell* cell;
    TimeRange times;
    float u, v, half_u, half_v;
    float slack() const { return static_cast<float>(cell->slack) * (1.0f / 256); }
  };

  void find_slots(const TileSamples& samples);
  void draw_piece(const Job& job, std::span<const Waiting> cells);
  // Queues the steps of a cell that may reach the tile; returns how many of them this tile evaluates.
  std::uint64_t add_steps(const Job& job, const Waiting& waiting);
  void run_batch(const Job& job);
  // Counts the emulated array's work on `issued` tuples of the current piece, taken together.
  void count_issued(const Job& job, std::uint64_t issued);

  // sampling_scatter.cpp
  static bool faces_away(const scene::PosedDrawable& drawable, float det);
  void scatter_still(const Job& job, std::size_t k);
  void scatter_points(const Job& job, std::size_t k);
  void scatter_moving(const Job& job, std::size_t k);
  void write(const Job& job, const ParameterCell& cell, std::size_t sample, float z, float u, float v,
             std::uint32_t triangle);
  // SurfaceLocation::triangle of a footprint's surface; if the surface blends, a layer's code.
  std::uint32_t surface_name(const Job& job, const Footprint& f, float det) const;
  bool passes_alpha(const Job& job, const scene::PatchPoint& at, std::size_t sample) const;
  void keep_rest(const Job& job, std::size_t k, std::size_t sample);

  // sampling_lines.cpp
  void draw_lines(const Job& job, std::span<const Waiting> cells);
  void draw_cell_lines(const Job& job, const Waiting& waiting, bool along_u);
  void scatter_line(const Job& job, const ParameterCell& cell, std::size_t k, bool along_u, float half_step);
  void scatter_moving_line(const Job& job, const Waiting& waiting, std::size_t k, bool along_u, float half_step);
  void begin_piece(const Job& job, const ParameterCell& first);

  std::vector<Waiting> waiting_;
  std::uint64_t waiting_samples_ = 0;
  std::vector<CellRead> reads_;
  // Samples of a pixel by the sub-pixel that holds them: slot s has slot_sample_[slot_first_[s]] up to slot_first_[s +
  // 1].
  int side_ = 1;
  std::vector<std::uint32_t> slot_first_, slot_sample_;

  // The current batch; all of it belongs to one piece.
  std::unique_ptr<SampleRegisters> registers_;
  std::vector<Footprint> footprints_;
  ArrayProgram program_;
  std::uint32_t drawable_ = 0, piece_ = 0;

  SamplingCounters counters_;
  std::span<DrawableCounts> drawables_;
};

}  // namespace tessera::tilecore
