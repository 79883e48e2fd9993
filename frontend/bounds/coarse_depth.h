#pragma once

#include <cstdint>
#include <vector>

#include "base/rect.h"
#include "frontend/bounds/screen_bounds.h"
#include "scene/view.h"

namespace tessera::frontend {

// A depth in 16 bits: the upper half of the float without its sign, 8 bits of exponent and 8 of mantissa. Codes have
// the order of their depths; a depth that is not positive has code 0.
using DepthCode = std::uint16_t;
inline constexpr DepthCode kNothingSeen = 0xFF00;  // infinity
DepthCode code_not_nearer(float depth);            // NaN: kNothingSeen
DepthCode code_not_farther(float depth);           // NaN: 0
float depth_of(DepthCode code);

// The blocks that a body may touch, [x0, x1) x [y0, y1) of the frame's grid, and its nearest depth.
struct BlockFootprint {
  IntRect blocks;
  DepthCode nearest = 0;
  bool operator==(const BlockFootprint&) const = default;
};

// The farthest depth that any sample of each block of pixels had when its tile was finished; kNothingSeen if a sample
// hit no surface. Row by row over the blocks that touch the region; with the camera of that frame.
//
// Invariants (cited by the tests):
//   CD1  No sample of a block sees anything farther than the depth of its code.
//   CD2  If hides() is true for the depths of a finished frame, no sample of the frame sees any of the footprint.
struct CoarseDepth {
  int block_pixels = 8;  // a block's side
  IntRect blocks;        // columns and rows of the whole frame's grid
  std::vector<DepthCode> farthest;
  scene::Projection projection;
  scene::View view;

  // `region`: pixels that are drawn.
  static IntRect blocks_of(const IntRect& region, int block_pixels);
  DepthCode at(int column, int row) const { return farthest[blocks.index(column, row)]; }

  // The blocks that closed bounds touch; an empty footprint if they touch none.
  BlockFootprint footprint(const ScreenBounds& bounds) const;
  // Whether a footprint lies behind the farthest depth of all its blocks; false for an empty footprint. Adds the number
  // of tested blocks, row by row until the first that does not hide it, to `blocks_tested`.
  bool hides(const BlockFootprint& footprint, std::uint64_t& blocks_tested) const;
};

// Reprojects the previous frame's depths into this frame's view. The result is a guess, as drawables move. Each block
// becomes the rectangle around its four corners at its depth, grown by kSplatPixels; where several rectangles overlap
// the farthest counts, and an uncovered block hides nothing. A caller that culls by it must test again when the frame's
// own depths are known.
inline constexpr double kSplatPixels = 4;
CoarseDepth reproject(const CoarseDepth& previous, const scene::Projection& projection, const scene::View& view);

}  // namespace tessera::frontend
