#pragma once

#include <cstdint>
#include <vector>

#include "tilecore/resolve/motion_field.h"
#include "tilecore/tile_state.h"
#include "tilecore/visibility/sample_pattern.h"

namespace tessera::tilecore {

// What the pixels of a tile see, drawn from their samples before anything is shaded: the input of all decisions of the
// resolve unit. Arrays hold a value per pixel, row by row.
//
//   depth     of the sample nearest to the pixel's middle; infinity where that sees nothing opaque
//   patch     base patch of that sample; TileState::kNoPatch where there is none
//   surface   which surfaces the samples see: 0 when nothing; the drawable's number + 1 when they all see that one and
//             nothing blended is in front; else a hash over the samples, with the top bit set. Equal numbers: the same
//             surfaces through the same samples
//   still     all that the samples see is of kind MotionField::Kind::kStill in `still_in`; 1 as well where they see
//             nothing
//   layered   something blended is in front
//
// Pixels whose `surface` is the same may stand for each other where nothing else speaks against it; a hash rarely
// repeats but along a straight silhouette.
struct PixelSurfaces {
  static constexpr std::uint32_t kMixed = 0x80000000u;

  IntRect pixels;
  std::size_t center_sample = 0;  // of each pixel
  int spp = 0;
  std::vector<float> depth;
  std::vector<std::uint32_t> patch, surface;
  std::vector<std::uint8_t> still, layered;
  const MotionField* still_in = nullptr;
  std::uint64_t samples_with_layers = 0;

  // Drops the state's hidden layers. `motion` null: there is no earlier frame, nothing counts as still.
  void gather(const scene::FrameGeometry& frame, const TileSamples& samples, TileState& state,
              const MotionField* motion);

  std::size_t index(int x, int y) const { return pixels.index(x, y); }

 private:
  void gather_opaque(const scene::FrameGeometry& frame, const TileState& state, const MotionField* motion);
  void gather_layers(const scene::FrameGeometry& frame, const TileState& state, const MotionField* motion);
};

}  // namespace tessera::tilecore
