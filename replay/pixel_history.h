#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/rect.h"
#include "replay/frame_costs.h"
#include "scene/assembly.h"
#include "scene/tessellation_pattern.h"
#include "tilecore/frame_targets.h"

namespace tessera::replay {

// What each pixel of an image shows, for reports that are asked for one. Pixels go row by row from the top left of the
// region, in runs of one value; the lengths of a list of runs add up to the pixels of the region.
class PixelHistory {
 public:
  // Empty where the images have no ids (tilecore::FrameTargets::ids).
  PixelHistory(const tilecore::FrameTargets& images, const scene::Assembly& assembly);

  // A member of tiles_NNNN.json, with a comma behind it; no text of an empty history.
  //   "pixels": {"region": [x, y, width, height],
  //     "sub_patches": {"row": [...], "patch": [...], "cells": [...]}: in the order in which pixels show them first; `row`
  //       is that of the frame's "drawables", -1 of none of them; `patch` the base patch's number in its drawable; `cells`
  //       four numbers each: i0, j0, i1, j1, cells of the base patch's grid; zeros where a procedure draws.
  //     "seen": RUNS of sub-patches that the first sample of a pixel sees, plus one; 0: nothing opaque.
  //     "samples": RUNS of how many samples of the pixel see the same base patch.
  //     "invocations": RUNS of invocations of the pixel shader.
  //     "layers": RUNS of blended surfaces in front of the first sample.
  //     "nearest_layer": RUNS of the row of the nearest of them, plus one; 0: none.}
  //   RUNS: {"lengths": [...], "values": [...]}
  std::string member(const FrameCosts& costs) const;

 private:
  struct Runs {
    std::vector<std::uint32_t> values, lengths;
    void add(std::uint32_t value);
  };
  struct SubPatch {
    std::uint32_t drawable, patch;  // its number in the assembly plus one; the patch's in the drawable
    scene::CellRange range;
  };
  class Numbers;

  IntRect region_;
  std::vector<SubPatch> sub_patches_;
  Runs seen_, samples_, invocations_, layers_, nearest_;  // nearest_: drawables plus one
};

}  // namespace tessera::replay
