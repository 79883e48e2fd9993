// How good cubic stencils are.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/tilecore/resolve/filled_block.h"
#include "tests/tilecore/resolve/window.h"

namespace tessera::tilecore {
namespace {

using test::fill;
using test::Filled;
using test::Window;

// Root mean square error over the missing pixels, all directions and phases of sinusoids.
double sinusoid_error(Reconstruction kernel, BlockMask pattern, const std::vector<double>& wavelengths) {
  double error = 0;
  int count = 0;
  for (const double wavelength : wavelengths)
    for (int direction = 0; direction < 24; ++direction)
      for (int phase = 0; phase < 16; ++phase) {
        const double angle = direction * M_PI / 24, kx = 2 * M_PI / wavelength * std::cos(angle),
                     ky = 2 * M_PI / wavelength * std::sin(angle);
        Window window;
        window.fill(
            [&](int x, int y) { return Vec4(static_cast<float>(std::sin(kx * x + ky * y + phase * M_PI / 8))); });
        window.usable = test::repeated(pattern);
        const auto missing = static_cast<BlockMask>(~pattern);
        const Filled got = fill(kernel, window.view(), missing);
        for (int p = 0; p < 16; ++p) {
          if (!(missing >> p & 1)) continue;
          const double e = static_cast<double>(got.at(p).x) - static_cast<double>(window.at(p % 4 + 3, p / 4 + 3).x);
          error += e * e, ++count;
        }
      }
  return std::sqrt(error / count);
}

TEST(CubicStencil, TheScaledCubicBeatsBilinearByAQuarterAtHalfRateAndTheInterpolatingOneByMore) {
  for (const BlockMask pattern : kPairOrder)
    for (const double wavelength : {6.0, 7.0, 8.0, 10.0, 12.0, 16.0, 24.0, 32.0}) {
      const double bilinear = sinusoid_error(Reconstruction::kBilinear, pattern, {wavelength});
      const double cubic = sinusoid_error(Reconstruction::kCubic, pattern, {wavelength});
      const double interpolating = sinusoid_error(Reconstruction::kCubicInterpolating, pattern, {wavelength});
      EXPECT_LE(cubic, 0.75 * bilinear) << wavelength;
      EXPECT_LE(interpolating, cubic) << wavelength;
      const std::string at = "_over_bilinear_at_" + std::to_string(static_cast<int>(wavelength));
      RecordProperty("cubic" + at, std::to_string(cubic / bilinear));
      RecordProperty("interpolating" + at, std::to_string(interpolating / bilinear));
    }
}

}  // namespace
}  // namespace tessera::tilecore
