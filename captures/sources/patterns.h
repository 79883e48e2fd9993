#pragma once

#include <functional>
#include <vector>

#include "base/image.h"
#include "base/vec.h"

namespace tessera::captures {

// Images from formulas. Arguments run over [0,1)^2, with (0,0) in the middle of the first texel; all patterns repeat.

Image8 color_image(int width, int height, const std::function<Vec3(float, float)>& srgb);
Image8 grey_image(int width, int height, const std::function<float(float, float)>& value);
Image8 data_image(int width, int height, const std::function<Vec3(float, float)>& value);
Image16 height_image(int width, int height, const std::function<float(float, float)>& value);

// Smooth noise in [0, 1] with `cells` lattice cells along each side, repeating; `octaves` halve size and weight.
float noise(float u, float v, int cells, int octaves, std::uint32_t seed);

// Distance in cells to the nearest and second nearest of jittered points, repeating (Worley), and the nearest's number.
struct Cell {
  float nearest, second;
  std::uint32_t number;
};
Cell cells(float u, float v, int count_u, int count_v, float jitter, std::uint32_t seed);

// Overlapping scales: height in [0, 1], two rows of one scale each per period, offset by half.
float scales(float u, float v);

// Occlusion map of a flat ground [low, high] (x and -z) below objects: a soft blob for each, elongated away from the
// brightest light of the built-in environment.
struct Blob {
  Vec2 at;
  float radius;
};
Image8 contact_shade(const std::vector<Blob>& blobs, Vec2 low, Vec2 high);

float smooth_step(float low, float high, float x);
Vec3 mix(Vec3 a, Vec3 b, float t);

}  // namespace tessera::captures
