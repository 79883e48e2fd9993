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

// Visible surfaces of each pixel of an image, for reports about single pixels. Pixels go row by row from the top left
// of the region, in runs of one value; the lengths of a list of runs add up to the pixels of the region.
class PixelHistory {
 public:
  // Empty where the images have no ids (tilecore::FrameTargets::ids).
  PixelHistory(const tilecore::FrameTargets& images, const scene::Assembly& assembly);

  // A member of tiles_NNNN.json, followed by a comma; an empty text for an empty history.
  //   "pixels": {"region": [x, y, width, height],
  //     "sub_patches": {"row": [...], "patch": [...], "cells": [...]}: in the order in which pixels first show them; `row`
  //       indexes the frame's "drawables", -1 for none of them; `patch` is the base patch's number in its drawable; `cells`
  //       has four numbers each: i0, j0, i1, j1, cells of the base patch's grid; zeros where a procedure draws.
  //     "seen": RUNS of the sub-patch at the first sample of a pixel, plus one; 0: nothing opaque.
  //     "samples": RUNS of the number of samples of the pixel that see the same base patch.
  //     "invocations": RUNS of invocations of the pixel shader.
  //     "layers": RUNS of the number of blended surfaces in front of the first sample.
  //     "nearest_layer": RUNS of the row of the nearest of these surfaces, plus one; 0: none.}
  //   RUNS: {"lengths": [...], "values": [...]}
  std::string member(const FrameCosts& costs) const;

 private:
  struct Runs {
    std::vector<std::uint32_t> values, lengths;
    void add(std::uint32_t value);
  };
  struct SubPatch {
    std::uint32_t drawable,
        patch;  // the drawable's number in the assembly plus one; the patch's number in the drawable
    scene::CellRange range;
  };
  class Numbers;

  IntRect region_;
  std::vector<SubPatch> sub_patches_;
  Runs seen_, samples_, invocations_, layers_, nearest_;  // nearest_: drawables plus one
};

}  // namespace tessera::replay
