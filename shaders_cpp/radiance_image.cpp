#include "shaders_cpp/radiance_image.h"

#include <algorithm>

#include "base/check.h"
#include "base/half_float.h"

namespace tessera::shaders {
namespace {

float held(float radiance) {
  return radiance > 0.0f ? round_to_half(std::min(radiance, RadianceImage::kLargest)) : 0.0f;
}

// The texels above that texel `i` of `count` covers along one axis of `above` texels, and the covered parts of the
// first and the last one, all in units of 1 / count of a texel above.
struct Covered {
  int first, last;
  float first_weight, last_weight;
  float weight(int texel) const { return texel == first ? first_weight : texel == last ? last_weight : 1.0f; }
};
Covered covered(int i, int count, int above) {
  const int begin = i * above, end = begin + above;  // times 1 / count
  const int first = begin / count, last = (end - 1) / count;
  const auto share = [&](int from, int to) { return static_cast<float>(to - from) / static_cast<float>(count); };
  if (first == last) return {first, last, share(begin, end), share(begin, end)};
  return {first, last, share(begin, (first + 1) * count), share(last * count, end)};
}

}  // namespace

RadianceImage::RadianceImage(std::span<const Size> levels) {
  TESSERA_CHECK(!levels.empty(), "an image has a level");
  std::int64_t texels = 0;
  for (const Size& size : levels) {
    TESSERA_CHECK(size.width > 0 && size.height > 0, "a level has texels");
    width_.push_back(size.width), height_.push_back(size.height);
    first_.push_back(static_cast<std::int32_t>(texels));
    texels += std::int64_t{size.width} * size.height;
    TESSERA_CHECK(texels < (std::int64_t{1} << 31) / 3, "texels' channels are numbered with 31 bits");
  }
  texels_.resize(3 * static_cast<std::size_t>(texels));
}

std::vector<RadianceImage::Size> RadianceImage::mip_chain(Size largest) {
  std::vector<Size> sizes{largest};
  while (sizes.back().width > 1 || sizes.back().height > 1)
    sizes.push_back({std::max(sizes.back().width / 2, 1), std::max(sizes.back().height / 2, 1)});
  return sizes;
}

void RadianceImage::set(int level, int x, int y, const Vec3& radiance) {
  float* const to = &texels_[place(level, x, y)];
  for (int c = 0; c < 3; ++c) to[c] = held(radiance[c]);
}

Vec3 RadianceImage::texel(int level, int x, int y) const {
  const float* const from = &texels_[place(level, x, y)];
  return {from[0], from[1], from[2]};
}

void RadianceImage::reduce(int level, IntRect texels) {
  const int above = level - 1;
  const float area = static_cast<float>(width(above)) / static_cast<float>(width(level)) *
                     static_cast<float>(height(above)) / static_cast<float>(height(level));
  for (int y = texels.y0; y < texels.y1; ++y) {
    const Covered rows = covered(y, height(level), height(above));
    for (int x = texels.x0; x < texels.x1; ++x) {
      const Covered columns = covered(x, width(level), width(above));
      Vec3 sum(0.0f);
      for (int row = rows.first; row <= rows.last; ++row) {
        Vec3 of_row(0.0f);
        for (int column = columns.first; column <= columns.last; ++column)
          of_row += texel(above, column, row) * columns.weight(column);
        sum += of_row * rows.weight(row);
      }
      set(level, x, y, sum * (1.0f / area));
    }
  }
}

}  // namespace tessera::shaders
