#pragma once

#include <vector>

#include "captures/sources/asset.h"

namespace tessera::captures {

// Daylight of the captures under the open sky. The renderer casts no shadows: they are baked into vertex colours.

inline const Vec3 kToSun{-0.38f, 0.85f, 0.45f};  // not normalised

// An unlit dome around everything with clouds, and the sun.
void add_sky(Asset& asset);
void add_sun(Asset& asset, float intensity);

// A box that casts shadows.
struct Block {
  Vec3 low, high;
};
// A crown of leaves, which lets some light through.
struct Foliage {
  Vec3 middle, radii;
};
struct Shades {
  std::vector<Block> blocks;
  std::vector<Foliage> crowns;
};

// Share of the sun's disc, made larger, that a point sees.
float sunlight(const Shades& shades, Vec3 at);

// Keys of the camera's or another node's path: `eye` and `target` at `times`.
void animate_look(Asset& asset, int node, const std::vector<float>& times, const std::vector<Vec3>& eyes,
                  const std::vector<Vec3>& targets);

}  // namespace tessera::captures
