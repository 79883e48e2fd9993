#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/enum_words.h"
#include "base/vec.h"
#include "tilecore/resolve/pattern_dither.h"

namespace tessera::tilecore {

// Fills the pixels of a 4x4 block that were not rendered from rendered ones around them:
//   c = sum of w(dx, dy) * colour / sum of w(dx, dy) over the usable pixels, w(dx, dy) = k(dx) * k(dy),
// with k the cubic of Mitchell and Netravali 1988, "Reconstruction filters in computer graphics", as US 2015/0379692
// uses it for blocks that were rendered at 4 or 8 samples. Formulas: resolve/cubic_weights.h; packed tables:
// resolve/packed_stencil.h.
enum class Reconstruction {
  kCubic,               // 5x5, distances times 2/3, B = C = 1/3: the default
  kCubicInterpolating,  // 7x7, distances times 1/2, B = 0, C = 1/2 (Catmull-Rom at a sample spacing of two pixels)
  kCubicUnscaled,       // 5x5, distances in pixels, B = C = 1/3. k(2) = 0: at 4 and 8 samples it is kBilinear
  kBilinear,            // 3x3, a tent of width 2: the mean of the neighbours on both lattices
  kNearest,             // the nearest usable pixel; the first in raster order among equally near ones
};
inline constexpr std::size_t kReconstructionCount = 5;

inline constexpr int kWindowMargin = 3;
inline constexpr int kWindowSide = 4 + 2 * kWindowMargin;

// The block and three pixels around it. Pixel (x, y) of the window is pixel (x - 3, y - 3) of the block and colour
// first_pixel[y * row_stride + x]. Only pixels whose bit is set are ever read, so others need not exist.
struct BlockWindow {
  const Vec4* first_pixel;    // linear RGB, coverage
  std::ptrdiff_t row_stride;  // in pixels
  // Bit x of row y is set if this pixel holds a rendered colour that may be used. The caller clears pixels outside the
  // frame, outside the tile (tile-local variant), in a block with an edge, or on another patch. Bits 10 to 15, and bits
  // of pixels to be filled, are ignored.
  std::array<std::uint16_t, kWindowSide> usable;
};

struct ReconstructionWork {
  std::uint64_t pixels = 0;         // filled
  std::uint64_t taps = 0;           // multiply-adds of four channels
  std::uint64_t direct_pixels = 0;  // of `pixels`: no table had their weights, so these were computed and divided
  std::uint64_t fallbacks =
      0;  // of `pixels`: no stencil held, nearest usable ones were taken (kNearest itself is none)
  std::uint64_t non_finite_pixels = 0;  // usable pixels left out because they hold NaN or infinity
};

// Fills the pixels of `missing` in out16[4*y + x] and writes no others. Returns the pixels that could not be filled
// because the window has no usable pixel: either 0 or `missing`. The caller shades them.
//
// Invariants (cited by the tests):
//   CS1  A flat colour comes back as itself, to one unit in the last place.
//   CS2  A pixel that is not usable, or not finite, has no influence on the result.
//   CS3  The result is finite wherever it is filled, as long as the usable finite colours are below 2^125 in magnitude.
//   CS4  Pixels whose surroundings are one of the patterns of pattern_dither.h, whole or cut at the block's own borders
//        on any sides (a tile's), take 8-bit weights from tables that were made when the program was built. They sum to
//        one exactly; each is within one unit of its last place of the exact weight. All others evaluate the kernel
//        directly and divide by the sum of weights. If usable pixels lie more on one side than on the other,
//        weights are tilted, so that ramps come back (stencil_tilt.h). At borders tables expect the lines of
//        tile_border.h.
//   CS5  Where the weights' sum falls below half of the sum of their magnitudes (lopsided surroundings let the negative
//        lobes win), or no pixel within the kernel's reach is usable, the mean of the nearest usable pixels of the
//        window stands in.
//   CS6  The same bits on every host; no allocation.
[[nodiscard]] BlockMask reconstruct_block(Reconstruction reconstruction, const BlockWindow& window, BlockMask missing,
                                          Vec4* out16, ReconstructionWork& work);

// Checkerboard rendering as a baseline: checkerboard_mask() gives the shaded half of the pixels; here the others get
// the mean of their usable neighbours above, left, right and below. (Published renderers also move the previous frame's
// pixel along and clamp it to those neighbours, and filter along edges by object id: El Mansouri, "Rendering Rainbow
// Six Siege", GDC 2016; Wihlidal, "4K checkerboard in Battlefield 1 and Mass Effect Andromeda", GDC 2017.)
//
// Fills the pixels of `missing` in out16[4*y + x]; returns the pixels that have no usable neighbour. Usable bits of
// missing pixels are ignored.
[[nodiscard]] BlockMask reconstruct_checkerboard(const BlockWindow& window, BlockMask missing, Vec4* out16,
                                                 ReconstructionWork& work);

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::Reconstruction> =
    std::to_array<std::string_view>({"cubic", "cubic_interpolating", "cubic_unscaled", "bilinear", "nearest"});

}  // namespace tessera
