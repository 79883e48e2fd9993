#include "tilecore/depth_blocks.h"

#include <algorithm>
#include <array>
#include <limits>

#include "base/check.h"

namespace tessera::tilecore {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();

}  // namespace

void DepthBlocks::start(std::size_t samples, int width, int spp) {
  TESSERA_CHECK(width > 0 && spp > 0 && samples <= (std::size_t{1} << 22), "tiles have at most 256x256 pixels");
  width_ = static_cast<std::size_t>(width), spp_ = static_cast<std::size_t>(spp);
  height_ = samples / spp_ / width_;
  const auto over = [](std::size_t divisor) { return ((std::uint64_t{1} << 32) + divisor - 1) / divisor; };
  per_pixel_ = over(spp_), per_row_ = over(width_);
  columns_ = (width_ + kSide - 1) / kSide;
  blocks_.assign(columns_ * ((height_ + kSide - 1) / kSide), {kNothing, 0, false});
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const std::size_t x = b % columns_ * kSide, y = b / columns_ * kSide;
    blocks_[b].uncovered = static_cast<std::uint32_t>(std::min<std::size_t>(width_ - x, kSide) *
                                                      std::min<std::size_t>(height_ - y, kSide) * spp_);
  }
}

float DepthBlocks::look_at(std::size_t block, std::span<const float> z) const {
  const std::size_t x0 = block % columns_ * kSide, y0 = block / columns_ * kSide, x1 = std::min(x0 + kSide, width_),
                    y1 = std::min(y0 + kSide, height_);
  // Several running maxima, so that the loop is not a single chain of dependent steps.
  std::array<float, 16> most{};
  for (std::size_t y = y0; y < y1; ++y) {
    const std::span<const float> row = z.subspan((y * width_ + x0) * spp_, (x1 - x0) * spp_);
    std::size_t i = 0;
    for (; i + most.size() <= row.size(); i += most.size())
      for (std::size_t k = 0; k < most.size(); ++k) most[k] = row[i + k] > most[k] ? row[i + k] : most[k];
    for (; i < row.size(); ++i) most[0] = std::max(most[0], row[i]);
  }
  return *std::max_element(most.begin(), most.end());
}

float DepthBlocks::farthest(std::span<const float> z, const IntRect& pixels) {
  const auto block_of = [](int pixel) { return static_cast<std::size_t>(pixel) / kSide; };
  const std::size_t x0 = block_of(pixels.x0), x1 = block_of(pixels.x1 - 1), y0 = block_of(pixels.y0),
                    y1 = block_of(pixels.y1 - 1);
  for (std::size_t y = y0; y <= y1; ++y)
    for (std::size_t x = x0; x <= x1; ++x)
      if (blocks_[y * columns_ + x].uncovered > 0) return kNothing;
  float farthest = 0;
  for (std::size_t y = y0; y <= y1; ++y)
    for (std::size_t b = y * columns_ + x0; b <= y * columns_ + x1; ++b) {
      if (std::exchange(blocks_[b].touched, false)) {
        blocks_[b].far = look_at(b, z);
        ++updates_;
      }
      farthest = std::max(farthest, blocks_[b].far);
    }
  return farthest;
}

}  // namespace tessera::tilecore
