#pragma once

#include <cstdint>
#include <vector>

#include "base/image.h"
#include "base/rect.h"

namespace tessera::tilecore {

// Pictures that a frame is made of; tiles write disjoint pixels. Coordinates are those of the region.
struct FrameTargets {
  Image color;           // linear RGB and coverage
  bool auxiliary = false;
  Image depth;           // of the nearest sample; 0 where nothing is seen
  Image normal;          // world, mean of the pixel's shaded points
  Image invocations;     // runs of the pixel shader
  ImageOf<std::uint32_t> patch;  // base patch + 1 of the first sample; 0 where nothing is seen
  std::vector<float> tile_farthest;  // per tile: depth of its farthest sample; infinity where one sees
                                     // nothing opaque; kept where it has room
  IntRect region;

  FrameTargets(IntRect region_in, bool auxiliary_in);
};

}  // namespace tessera::tilecore
