#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/rect.h"
#include "base/vec.h"
#include "base/vector3.h"
#include "shaders_cpp/texture.h"

namespace tessera::shaders {

// Radiance in the form that lookups read: plain arrays, with numbers by level.
struct RadianceView {
  const float* texels = nullptr;                                             // R, G, B, row by row
  const std::int32_t *width = nullptr, *height = nullptr, *first = nullptr;  // `first`: number of a level's first texel
  int levels = 0;                                                            // 0 without an image

  bool operator==(const RadianceView&) const = default;
};

namespace scalar {
#include "shaders_cpp/radiance_image.inc"
}  // namespace scalar
using namespace scalar;

// Radiance in linear light, in levels of any size. The emulated memory holds it as RGBA in half precision, so every
// number is a half float. Lookups clamp to the edges.
//
// Invariant (cited by the tests):
//   RI1  A level that reduce() makes has the mean of the level above it, up to rounding to half precision, and no texel
//        beyond the range of the texels that it covers.
class RadianceImage {
 public:
  static constexpr TexelBlocks kBlocks{1, 8};
  static constexpr float kLargest = 65504.0f;  // the largest half float

  struct Size {
    int width, height;  // at least 1
  };
  RadianceImage() = default;
  // A black image with at least one level.
  explicit RadianceImage(std::span<const Size> levels);
  // Sizes of a chain that halves, rounding down, to one texel.
  static std::vector<Size> mip_chain(Size largest);

  int width(int level = 0) const { return width_[static_cast<std::size_t>(level)]; }
  int height(int level = 0) const { return height_[static_cast<std::size_t>(level)]; }
  int level_count() const { return static_cast<int>(width_.size()); }

  // Sets a texel. Negative numbers and NaN become 0, and kLargest is the limit. Several threads may set texels.
  void set(int level, int x, int y, const Vec3& radiance);
  Vec3 texel(int level, int x, int y) const;
  // Computes texels of any level except the first: each is the area-weighted mean of the texels that it covers in the
  // level above, summed row by row in single precision.
  void reduce(int level, IntRect texels);

  RadianceView view() const { return {texels_.data(), width_.data(), height_.data(), first_.data(), level_count()}; }

 private:
  std::size_t place(int level, int x, int y) const {
    return 3 * static_cast<std::size_t>(first_[static_cast<std::size_t>(level)] + y * width(level) + x);
  }

  std::vector<float> texels_;
  std::vector<std::int32_t> width_, height_, first_;
};

}  // namespace tessera::shaders
