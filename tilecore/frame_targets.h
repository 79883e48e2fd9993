#pragma once

#include <cstdint>
#include <vector>

#include "base/image.h"
#include "base/rect.h"
#include "frontend/bounds/coarse_depth.h"

namespace tessera::tilecore {

// Images of a frame; tiles write disjoint pixels. Coordinates are relative to the region.
struct FrameTargets {
  Image color;  // linear RGB and coverage
  bool auxiliary = false;
  Image depth;                   // of the nearest sample; 0 if no surface is seen
  Image normal;                  // world, mean of the pixel's shaded points
  Image invocations;             // pixel-shader invocations
  ImageOf<std::uint32_t> patch;  // base patch + 1 of the first sample; 0 if no surface is seen
  // Depths of blocks of pixels, for the next frame; stored if it has room.
  frontend::CoarseDepth coarse_depth;
  IntRect region;

  // PixelId::kChannels for each pixel, for reports of the visible surfaces; empty without `pixel_ids`.
  ImageOf<std::uint32_t> ids;

  // Images of the resolve unit; empty without `resolve_auxiliary`.
  bool resolve_auxiliary = false;
  Image rate;         // samples of the pixel's block chosen for shading, of 16; 0 if the block sees no surface
  Image velocity;     // pixels per frame, x and y; 0 where unknown
  Image edges;        // 1: an edge in the block
  Image discrepancy;  // frames for which the block advects no pixel
  Image origin;       // 0 shaded, 1 advected, 2 reconstructed
  Image error;        // largest difference of a channel to the fully shaded frame, linear light

  explicit FrameTargets(IntRect region_in, bool auxiliary_in, bool resolve_auxiliary_in = false,
                        bool pixel_ids = false);
};

}  // namespace tessera::tilecore
