#pragma once

#include "captures/sources/asset.h"

namespace tessera::captures {

// An atlas of 2 x 2 sprigs with an alpha mask: stems run up the tiles. `dark` and `light` bound the leaves' sRGB colours.
Image8 sprig_atlas(Vec3 dark, Vec3 light);

// A bent patch that shows a sprig: its stem starts at `at`.
struct Sprig {
  Vec3 at, along, across;  // unit vectors along the stem and across it
  float length, width, bend;
  int tile;
  Vec3 light;
};
void add_sprig(Geometry& g, const Sprig& sprig);

// Sprigs throughout an ellipsoid around the origin. With `shaded` they are darker inside and on the side away from
// kToSun. With `joints` > 1 each hangs on joint 0, and towards its tip increasingly on one of the others.
struct Crown {
  int count;
  Vec3 radii;
  float size;  // of a sprig
  int joints;
  std::uint32_t seed;
  bool shaded = true;
};
Geometry crown(const Crown& crown);

// A bent tube of patches along a cubic curve; its radius goes from `thick` to `thin`.
void add_tube(Geometry& g, const std::array<Vec3, 4>& path, float thick, float thin, float turns);

// Flowers on their stems, around the origin. They sway with two morph targets, each flower in its own way.
struct Species {
  Vec3 petal, middle;  // linear colours
  int petals;
  float radius, height, cup;  // size of a flower; rise of its petals
  std::uint32_t seed;
};
Geometry flowers(const Species& species, int count);

// Blades of grass that sway in the same way.
Geometry grass(int count, float radius, float height, std::uint32_t seed);

}  // namespace tessera::captures
