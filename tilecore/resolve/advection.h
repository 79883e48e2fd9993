#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "base/enum_words.h"
#include "base/rect.h"
#include "base/vec.h"

namespace tessera::tilecore {

// Temporal reprojection, called advection by its patent (US 2015/0379692): takes a pixel's colour from the previous
// frame along its motion. Positions count pixels; a pixel's own place is its integer coordinate. A velocity is the
// distance that a point moved from the previous frame to this one.

// The previous frame. Pointers are to the pixel (region.x0, region.y0).
struct HistoryView {
  const Vec4* color;  // linear RGB, coverage
  const float* depth;
  const std::uint32_t* patch;
  IntRect region;
  std::ptrdiff_t row_stride;  // in pixels

  std::ptrdiff_t index(int x, int y) const { return (y - region.y0) * row_stride + (x - region.x0); }
};

// The motion of the surface that each pixel of this frame shows. Pointers are to the pixel (region.x0, region.y0).
struct VelocityView {
  const Vec2* velocity;        // pixels per frame
  const std::uint8_t* usable;  // 0: behind the eye in one of the frames, or no surface
  IntRect region;
  std::ptrdiff_t row_stride;

  std::ptrdiff_t index(int x, int y) const { return (y - region.y0) * row_stride + (x - region.x0); }
};

enum class Fetch { kBilinear, kBicubic };

struct AdvectionSettings {
  Fetch fetch = Fetch::kBilinear;
  // Back and forth error compensation: x1 = x - v(x), x2 = x1 + v(x1), e = (x2 - x) / 2, fetch at x1 - e; v(x1) is
  // interpolated bilinearly. It makes the place second-order accurate if v is the velocity at an instant. If v is the
  // exact displacement of the point that x shows, x - v(x) is already exact, and the correction shifts it by half the
  // velocity's change over one step. If v(x1) is not available, e = 0.
  bool bfecc = false;
  // Bicubic only: each channel stays in the range of the four texels around the place.
  bool clamp_to_range = true;
};

// Largest difference in depth between a pixel and a texel of the same surface: a share of the pixel's depth plus
// `slope`, by which the surface's depth changes from pixel to pixel around it.
inline constexpr float kDepthTolerance = 0.002f;  // [assumed]
inline float depth_limit(float depth, float slope) { return kDepthTolerance * std::abs(depth) + slope; }

enum class Advection {
  kTaken,
  kUnusableVelocity,  // marked as unusable, or not finite
  kOutsideFrame,      // a texel that would have a weight is outside of the history's region
  kDisoccluded,       // ... has another depth
  kOtherPatch,        // ... belongs to another patch
  kNonFinite,         // ... holds NaN or infinity
};

struct AdvectedPixel {
  Advection outcome;
  Vec4 color;  // when taken
};

// Motion beyond this leaves every frame, and whole pixels of it still fit an int.
inline constexpr float kLongestMotion = 1 << 20;

// Counts of reads; a texel of the history is a colour, a depth and a patch.
struct AdvectionWork {
  std::uint64_t fetches = 0;             // places read in the history
  std::uint64_t history_texels = 0;      // texels of the history read for them; those with weight 0 are not
  std::uint64_t velocity_texels = 0;     // velocities read, the pixel's own included
  std::uint64_t uncorrected = 0;         // fetches with BFECC for which v(x1) is not available
  std::uint64_t bilinear_fallbacks = 0;  // bicubic fetches whose outer texels did not all agree
};

// Reprojects the colour of pixel (x, y) of velocity.region, which now shows `patch` at `depth` (positive) on a surface
// of `slope` (of depth_limit()).
//
// Invariants (cited by the tests):
//   ADV1  A velocity of zero copies the texel bit for bit, with BFECC and with every fetch: one texel is read, and its
//         neighbours need not agree.
//   ADV2  Texels without weight are not read: whole-pixel motion copies.
//   ADV3  The result depends on the motion and on the texels around its end, not on its place in the frame.
//   ADV4  Every texel of a bilinear fetch must agree in patch and depth and be finite; if the outer twelve of a bicubic
//         fetch do not, the fetch is bilinear.
AdvectedPixel advect_pixel(int x, int y, float depth, std::uint32_t patch, const HistoryView& history,
                           const VelocityView& velocity, const AdvectionSettings& settings, float slope,
                           AdvectionWork& work);

// The same for the plain pixels of a block: pixels whose fetch lies between four texels of the region that all agree
// with them and are finite. A taken colour has the bits of advect_pixel() with a bilinear fetch and without bfecc; the
// caller must use advect_pixel() for the other pixels.
struct BlockOfPixels {
  int x, y;            // its first pixel, of 4 x 4
  const float* depth;  // of that pixel and the next three of its row; positive
  const std::uint32_t* patch;
  const Vec2* velocity;
  const std::uint8_t* usable;
  std::ptrdiff_t row_stride;
};
struct PlainAdvection {
  std::uint16_t taken = 0;  // bit 4*j + i: pixel (x + i, y + j)
  IntRect texels;           // texels read for them
};
PlainAdvection advect_plain_pixels(const BlockOfPixels& block, std::uint16_t wanted, const HistoryView& history,
                                   float slope, Vec4* out, std::ptrdiff_t out_stride, AdvectionWork& work);

// ---- Inside advection.cpp -------------------------------------------------------------------------------------

// Texels `above` and the next one, and the two below them; weights of all but the first, none of them 0.
struct FourTexels {
  std::ptrdiff_t above;
  float w1, w2, w3;
};

// Writes the mean of four texels; returns false, and leaves `out`, unless all have the pixel's patch, differ from its
// depth by at most `limit` (finite), and have finite colours.
bool fetch_agreeing_texels(const HistoryView& history, const FourTexels& texels, std::uint32_t patch, float depth,
                           float limit, Vec4* out);

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::Fetch> = std::to_array<std::string_view>({"bilinear", "bicubic"});

}  // namespace tessera
