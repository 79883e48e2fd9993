#pragma once

#include <vector>

#include "base/rect.h"
#include "frontend/bounds/screen_bounds.h"
#include "scene/view.h"

namespace tessera::frontend {

// The farthest depth that any sample of each block of pixels saw when a frame was done; infinity where one saw
// nothing. Row by row over the blocks that touch the region; with the camera that saw it.
struct CoarseDepth {
  int block_width = 0, block_height = 0;
  IntRect blocks;  // columns and rows of the whole frame's grid
  std::vector<float> farthest;
  scene::Projection projection;
  scene::View view;

  float at(int column, int row) const {
    return farthest[static_cast<std::size_t>((row - blocks.y0) * blocks.width() + (column - blocks.x0))];
  }
};

// Guesses from the previous frame what will be hidden: its coarse depth, re-projected into the view at hand. Each block
// becomes the rectangle around its four corners at its depth; where several land, the farthest counts, where none
// does, nothing is hidden.
//
// A guess only: things move. Whoever drops what it hides must look again when the frame's own depth is known
// (hidden_by).
class OcclusionGuess {
 public:
  OcclusionGuess(const CoarseDepth& previous, const scene::Projection& projection, const scene::View& view);

  bool hides(const ScreenBounds& bounds) const { return hidden_by(depth_, bounds); }
  const CoarseDepth& depth() const { return depth_; }

  // Whether bounds lie behind the farthest depth of every block that they touch.
  static bool hidden_by(const CoarseDepth& depth, const ScreenBounds& bounds);

 private:
  void splat(const CoarseDepth& previous, int column, int row);

  CoarseDepth depth_;
};

}  // namespace tessera::frontend
