#include "tilecore/resolve/block_contrast.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tessera::tilecore {
namespace {

constexpr float kDiagonal = 0.7f;  // [measured] between 0.5 of a smooth image and 1 of noise
constexpr float kCodes = 254.0f;

float displayed(float v) { return std::sqrt(v > 0.0f ? (v < 1.0f ? v : 1.0f) : 0.0f); }

float squares(const Vec3& v) { return v.x * v.x + v.y * v.y + v.z * v.z; }

// Half the second difference.
float bend(const Vec3& a, const Vec3& b, const Vec3& c) { return squares(b - 0.5f * (a + c)); }

}  // namespace

std::uint8_t contrast_code(float contrast) {
  if (!std::isfinite(contrast)) return kUnknownContrast;
  return static_cast<std::uint8_t>(1.0f + std::ceil(kCodes * std::sqrt(std::min(contrast, 1.0f))));
}

float contrast_of(std::uint8_t code) {
  if (code == kUnknownContrast) return std::numeric_limits<float>::infinity();
  const float root = static_cast<float>(code - 1) / kCodes;
  return root * root;
}

MeasuredContrast measure_contrast(const Vec4* colors, std::ptrdiff_t stride, BlockMask known,
                                  std::uint64_t& operations) {
  std::array<Vec3, 16> v{};
  for (int p = 0; p < 16; ++p) {
    if ((known >> p & 1) == 0) continue;
    const Vec4& c = colors[(p >> 2) * stride + (p & 3)];
    v[static_cast<std::size_t>(p)] = {displayed(c.x), displayed(c.y), displayed(c.z)};
    ++operations;
  }
  float sum = 0.0f;
  int count = 0;
  const auto add = [&](int a, int b, int c) {
    if ((known >> a & known >> b & known >> c & 1) == 0) return;
    sum += bend(v[static_cast<std::size_t>(a)], v[static_cast<std::size_t>(b)], v[static_cast<std::size_t>(c)]);
    ++count;
  };
  const bool full = known == kFullBlock;
  if (full) {
    for (int i = 0; i < 4; ++i)
      for (int j = 1; j < 3; ++j) {
        add(4 * i + j - 1, 4 * i + j, 4 * i + j + 1);
        add(4 * (j - 1) + i, 4 * j + i, 4 * (j + 1) + i);
      }
  } else {
    for (const int p : {5, 6, 9, 10}) add(p - 5, p, p + 5), add(p - 3, p, p + 3);
  }
  operations += static_cast<std::uint64_t>(3 * count);
  if (count > 0) {
    const float rms = std::sqrt(sum / static_cast<float>(3 * count));
    return {full ? rms : kDiagonal * rms, true};
  }
  // A square of four: how far it is from a plane, seen from each.
  for (int corner = 0; corner < 4; ++corner) {
    const int a = (corner & 1) + 4 * (corner >> 1);
    if ((known >> a & known >> (a + 2) & known >> (a + 8) & known >> (a + 10) & 1) == 0) continue;
    const auto at = [&](int p) { return v[static_cast<std::size_t>(p)]; };
    operations += 4;
    return {std::sqrt(squares(0.5f * (at(a) - at(a + 2) - at(a + 8) + at(a + 10))) / 3.0f), false};
  }
  return {0.0f, false};
}

float predicted_error(int samples, float contrast) {
  constexpr float kHalf = 0.3f, kQuarter = 1.4f;
  return samples >= 16 ? 0.0f : contrast * (samples >= 8 ? kHalf : kQuarter);
}

}  // namespace tessera::tilecore
