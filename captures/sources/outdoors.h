#pragma once

#include <array>
#include <string>
#include <vector>

#include "captures/sources/asset.h"

namespace tessera::captures {

// The light of the captures under the open sky.

// Either shadows are baked into vertex colours, or lights cast them and vertex colours hold none.
enum class Shadows { kBaked, kCast };

inline const Vec3 kToSun{-0.38f, 0.85f, 0.45f};  // towards the sun of a day with baked shadows; not normalised

// Colours of the sky (sRGB). Its lower half repeats the horizon.
struct Sky {
  std::string file = "sky";
  Vec3 zenith{0.27f, 0.47f, 0.78f}, horizon{0.72f, 0.83f, 0.93f}, clouds{1.0f, 1.0f, 1.01f};
  float cover = 0.85f;  // cover of the sky by clouds
};
// Adds an unlit dome with clouds around the scene.
void add_sky(Asset& asset, const Sky& sky = {});

struct Sun {
  float intensity;
  Vec3 to_sun = kToSun;
  std::array<double, 3> color = {1.0, 0.93, 0.82};
};
// Adds a sun and returns the light's number.
int add_sun(Asset& asset, const Sun& sun);

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

// Drops vertex colours if lights cast shadows; for geometry whose colours hold only baked light.
Geometry lit(Geometry geometry, Shadows shadows);
std::vector<Part> lit(std::vector<Part> parts, Shadows shadows);

// Visible share of the sun's disc, which is enlarged, from a point.
float sunlight(const Shades& shades, Vec3 at);

// Adds keys for the path of a camera or another node: `eyes` and `targets` at `times`.
void animate_look(Asset& asset, int node, const std::vector<float>& times, const std::vector<Vec3>& eyes,
                  const std::vector<Vec3>& targets);

}  // namespace tessera::captures
