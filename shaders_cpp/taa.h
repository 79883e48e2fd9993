#pragma once

#include "base/image.h"
#include "base/vec.h"

namespace tessera::shaders {

// Temporal antialiasing: every frame samples its pixels at other places, and a history accumulates them. The method is
// B. Karis, "High Quality Temporal Supersampling", SIGGRAPH 2014: the history is fetched along the surface's motion, clipped
// to the colours around the pixel in YCoCg, and mixed with weights of 1 / (1 + luma). Deviations: the box is that of all 3x3
// neighbours, and the new colour is not filtered over them. Lookups are Catmull-Rom by five bilinear taps (J. Jimenez,
// "Filmic SMAA", SIGGRAPH 2016).
//
// Invariants (cited by the tests):
//   TAA1  A share of 1 gives the new colour, bit for bit.
//   TAA2  A result lies in the box of the colours around the pixel in YCoCg, up to rounding, before negative light
//         becomes 0.
//   TAA3  A lookup at the middle of a texel is the texel, bit for bit. The weights of a lookup add up to 1.
//   TAA4  A pixel whose place in the previous frame lies outside of the image, or is unknown, has the new colour.

// Lookups of a pixel: the colours around it; the depths around it and the velocity of the nearest one, or the velocities
// around it; the history.
inline constexpr int kTaaNeighbours = 9, kTaaHistoryLookups = 5;

struct TaaImages {
  const Image& color;     // of the new frame: linear light and coverage, 4 channels
  const Image& velocity;  // pixels from the previous frame, 2 channels; not finite where unknown
  const Image* depth;     // 1 channel; nullptr: the longest velocity around a pixel stands for the nearest one
  const Image& history;   // the previous result, 4 channels
};

struct TaaSettings {
  float share = 0.1f;  // [0, 1]: share of the new colour where both are equally bright
  bool clips = true;   // false: the history is taken as it is, and leaves ghosts
};

// YCoCg without scaling: Y = (r + 2g + b) / 4, Co = (r - b) / 2, Cg = (2g - r - b) / 4.
inline Vec3 to_ycocg(const Vec3& c) {
  return {0.25f * (c.x + c.z) + 0.5f * c.y, 0.5f * (c.x - c.z), 0.5f * c.y - 0.25f * (c.x + c.z)};
}
inline Vec3 from_ycocg(const Vec3& c) { return {c.x - c.z + c.y, c.x + c.z, c.x - c.z - c.y}; }

// Moves a colour towards the middle of a box until it is inside; a colour inside keeps its bits. low <= high.
Vec3 clip_to_box(const Vec3& color, const Vec3& low, const Vec3& high);

// The velocity of the nearest depth, or the longest velocity, among a pixel and its neighbours; the first of equals, the
// pixel itself before all others.
Vec2 nearest_velocity(const TaaImages& images, int x, int y);

// Looks up four channels at a place in pixels, of which the first texel's middle is (0.5, 0.5). Beyond the edge the edge
// continues. Negative results and NaN are 0.
Vec4 taa_lookup(const Image& image, Vec2 at);

// The new history at a pixel: linear light and coverage. Colours that are negative or NaN count as 0, and the largest half
// float is the limit.
Vec4 taa_pixel(const TaaImages& images, const TaaSettings& settings, int x, int y);

}  // namespace tessera::shaders
