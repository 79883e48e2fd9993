#include "tilecore/resolve/stored_texels.h"

#include <array>
#include <utility>

#include "base/check.h"
#include "base/crc64.h"

namespace tessera::tilecore {
namespace {

IntRect blocks_of(const BlockShape& shape, IntRect texels) {
  if (texels.empty()) return {};
  return {texels.x0 / shape.width, texels.y0 / shape.height, (texels.x1 + shape.width - 1) / shape.width,
          (texels.y1 + shape.height - 1) / shape.height};
}

std::uint64_t count_of(IntRect rect) {
  return static_cast<std::uint64_t>(rect.width()) * static_cast<std::uint64_t>(rect.height());
}

}  // namespace

std::uint64_t TexelFormat::texel_bytes() const {
  std::uint64_t bytes = 0;
  for (const BlockShape& plane : planes) bytes += plane.pixel_bytes();
  return bytes * static_cast<std::uint64_t>(samples);
}

std::uint64_t TexelFormat::block_bytes(IntRect texels) const {
  std::uint64_t bytes = 0;
  for (const BlockShape& plane : planes) bytes += count_of(blocks_of(plane, texels)) * plane.raw_bytes();
  return bytes * static_cast<std::uint64_t>(samples);
}

std::uint64_t TexelFormat::block_count(IntRect texels) const {
  std::uint64_t count = 0;
  for (const BlockShape& plane : planes) count += count_of(blocks_of(plane, texels));
  return count * static_cast<std::uint64_t>(samples);
}

TexelFormat depth_format(std::uint64_t bytes, int samples) {
  return {.planes = {bytes == 4 ? kWordBlock : kShortBlock}, .samples = samples};
}

TexelEncoder::TexelEncoder(const TexelFormat& format, const TexelCoding& how, IntRect texels)
    : format_(format), how_(how), texels_(texels), codes_(count_of(texels)) {
  if (how_.compressed) out_.block_bytes.reserve(format.block_count(texels));
  if (how_.signs) out_.signed_bytes = count_of(texels) * format.texel_bytes();
}

void TexelEncoder::add_samples(int sample) {
  TESSERA_CHECK(plane_ < format_.known_planes(), "a texel has no more planes");
  if (how_.signs) {
    Crc64 crc;
    crc.add_value(out_.signature);
    crc.add(std::as_bytes(std::span<const PixelCode>(codes_)));
    out_.signature = crc.value();
    constexpr std::uint64_t kPrime = 0x100000001b3;  // FNV-1a
    for (const PixelCode& code : codes_)
      for (const std::uint16_t channel : code) out_.check = (out_.check ^ channel) * kPrime;
  }
  if (!how_.compressed) return;
  const BlockShape& shape = format_.planes[plane_];
  if (sample == 0) {
    if (format_.samples > 1) first_ = codes_;
  } else {
    for (std::size_t texel = 0; texel < codes_.size(); ++texel)
      codes_[texel] = difference(codes_[texel], first_[texel], shape.bits);
  }
  add_blocks(shape);
}

void TexelEncoder::add_blocks(const BlockShape& shape) {
  const IntRect blocks = blocks_of(shape, texels_);
  std::array<std::uint16_t, 4 * kLargestBlockPixels> codes;
  for (int row = blocks.y0; row < blocks.y1; ++row)
    for (int column = blocks.x0; column < blocks.x1; ++column) {
      if (shape.raw_bytes() % how_.burst_bytes != 0) {  // a block is smaller than a burst
        out_.block_bytes.push_back(static_cast<std::uint16_t>(shape.raw_bytes()));
        continue;
      }
      auto out = codes.begin();
      for (int y = row * shape.height; y < (row + 1) * shape.height; ++y)
        for (int x = column * shape.width; x < (column + 1) * shape.width; ++x) {
          // Blocks that the piece cuts are filled up with copies of their nearest texels.
          const int near_x = std::clamp(x, texels_.x0, texels_.x1 - 1),
                    near_y = std::clamp(y, texels_.y0, texels_.y1 - 1);
          const PixelCode& code = codes_[texels_.index(near_x, near_y)];
          out = std::copy(code.begin(), code.end(), out);
        }
      out_.block_bytes.push_back(static_cast<std::uint16_t>(
          compressed_block_bytes(std::span(codes).first(4 * shape.pixels()), shape, how_.burst_bytes)));
      out_.pixels_compressed += shape.pixels();
    }
}

StoredTexels TexelEncoder::take() {
  TESSERA_CHECK(plane_ == format_.known_planes(), "every known plane of a texel has codes");
  if (how_.compressed)
    for (std::size_t plane = plane_; plane < format_.planes.size(); ++plane) {
      const BlockShape& shape = format_.planes[plane];
      out_.block_bytes.insert(out_.block_bytes.end(),
                              count_of(blocks_of(shape, texels_)) * static_cast<std::uint64_t>(format_.samples),
                              static_cast<std::uint16_t>(shape.raw_bytes()));
    }
  return std::move(out_);
}

}  // namespace tessera::tilecore
