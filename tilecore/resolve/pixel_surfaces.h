#pragma once

#include <cstdint>
#include <vector>

#include "tilecore/resolve/motion_field.h"
#include "tilecore/tile_state.h"
#include "tilecore/visibility/sample_pattern.h"

namespace tessera::tilecore {

// The surfaces that the pixels of a tile see, derived from their samples before shading: the input of all decisions of
// the resolve unit. Arrays hold a value per pixel, row by row.
//
//   depth     of the sample nearest to the pixel's middle; infinity if it sees no opaque surface
//   patch     base patch of that sample; TileState::kNoPatch where there is none
//   surface   the surfaces that the samples see: 0 if none; the drawable's number + 1 if all see it and
//             no blended surface is in front; else a hash over the samples, with the top bit set. Equal numbers: the same
//             surfaces through the same samples. A drawable that hides a part of itself counts as two surfaces
//   still     properties of all surfaces that the samples see, in `still_in`: kAtRest, of kind
//             MotionField::Kind::kStill; kSameShading, by MotionField::same_shading(). Both if there is no surface
//   layered   a blended surface is in front
//
// Pixels whose `surface` is the same may stand for each other unless other evidence contradicts; a hash rarely repeats
// except along a straight silhouette.
struct PixelSurfaces {
  static constexpr std::uint32_t kMixed = 0x80000000u;
  static constexpr std::uint8_t kAtRest = 1, kSameShading = 2;
  // Samples of one drawable on different patches see different parts of it if their depths differ by more than this
  // share; one part then hides the other.
  static constexpr float kDepthStep = 0.005f;  // [assumed]

  IntRect pixels;
  std::size_t center_sample = 0;  // of each pixel
  int spp = 0;
  std::vector<float> depth;
  std::vector<std::uint32_t> patch, surface;
  std::vector<std::uint8_t> still, layered;
  const MotionField* still_in = nullptr;
  std::uint64_t samples_with_layers = 0;

  // Drops the state's hidden layers. `motion` nullptr: there is no earlier frame, and no surface counts as still.
  void gather(const scene::FrameGeometry& frame, const TileSamples& samples, TileState& state,
              const MotionField* motion);

  std::size_t index(int x, int y) const { return pixels.index(x, y); }

 private:
  void gather_opaque(const scene::FrameGeometry& frame, const TileState& state, const MotionField* motion);
  void gather_layers(const scene::FrameGeometry& frame, const TileState& state, const MotionField* motion);
};

}  // namespace tessera::tilecore
