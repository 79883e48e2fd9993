#include "tilecore/depth_blocks.h"

#include <algorithm>
#include <array>
#include <limits>

#include "base/check.h"

namespace tessera::tilecore {

void DepthBlocks::start(std::size_t samples, int width, int spp) {
  TESSERA_CHECK(width > 0 && spp > 0 && samples <= (std::size_t{1} << 22), "tiles have at most 256x256 pixels");
  width_ = static_cast<std::size_t>(width), spp_ = static_cast<std::size_t>(spp);
  height_ = samples / spp_ / width_;
  const auto over = [](std::size_t divisor) { return ((std::uint64_t{1} << 32) + divisor - 1) / divisor; };
  per_pixel_ = over(spp_), per_row_ = over(width_);
  columns_ = (width_ + kSide - 1) / kSide;
  const std::size_t blocks = columns_ * ((height_ + kSide - 1) / kSide);
  far_.assign(blocks, std::numeric_limits<float>::infinity());
  touched_.assign(blocks, 0);
  any_touched_ = false;
  farthest_ = std::numeric_limits<float>::infinity();
}

float DepthBlocks::look_at(std::size_t block, std::span<const float> z) const {
  const std::size_t x0 = block % columns_ * kSide, y0 = block / columns_ * kSide, x1 = std::min(x0 + kSide, width_),
                    y1 = std::min(y0 + kSide, height_);
  // Several running maxima, so that the loop is not one chain of dependent steps.
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

float DepthBlocks::farthest(std::span<const float> z) {
  if (!any_touched_) return farthest_;
  any_touched_ = false;
  for (std::size_t block = 0; block < touched_.size(); ++block)
    if (std::exchange(touched_[block], std::uint8_t{0}) != 0) {
      far_[block] = look_at(block, z);
      ++updates_;
    }
  return farthest_ = *std::max_element(far_.begin(), far_.end());
}

}  // namespace tessera::tilecore
