#include "tilecore/resolve/stored_texels.h"

#include <utility>

#include "base/check.h"
#include "base/crc64.h"
#include "tilecore/resolve/block_codes.h"

namespace tessera::tilecore {

std::uint64_t TexelFormat::texel_bytes() const {
  std::uint64_t bytes = 0;
  for (const BlockShape& plane : planes) bytes += plane.pixel_bytes();
  return bytes * static_cast<std::uint64_t>(samples);
}

std::uint64_t TexelFormat::plane_blocks(const BlockShape& plane, IntRect texels) const {
  return pixel_count(touched_blocks(plane, texels)) * static_cast<std::uint64_t>(samples);
}

std::uint64_t TexelFormat::block_bytes(IntRect texels) const {
  std::uint64_t bytes = 0;
  for (const BlockShape& plane : planes) bytes += plane_blocks(plane, texels) * plane.raw_bytes();
  return bytes;
}

std::uint64_t TexelFormat::block_count(IntRect texels) const {
  std::uint64_t count = 0;
  for (const BlockShape& plane : planes) count += plane_blocks(plane, texels);
  return count;
}

TexelFormat depth_format(std::uint64_t bytes, int samples) {
  return {.planes = {bytes == 4 ? kWordBlock : kShortBlock}, .samples = samples};
}

TexelEncoder::TexelEncoder(const TexelFormat& format, const TexelCoding& how, IntRect texels)
    : format_(format), how_(how), texels_(texels), codes_(pixel_count(texels)) {
  if (how_.compressed) out_.block_bytes.reserve(format.block_count(texels));
  if (how_.signs) out_.signed_bytes = pixel_count(texels) * format.texel_bytes();
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
  add_blocks(sample == 0 ? shape : difference_block(shape));
}

void TexelEncoder::add_blocks(const BlockShape& shape) {
  const IntRect blocks = touched_blocks(shape, texels_);
  for (int row = blocks.y0; row < blocks.y1; ++row)
    for (int column = blocks.x0; column < blocks.x1; ++column) {
      out_.block_bytes.push_back(static_cast<std::uint16_t>(stored_block_bytes(
          shape, column, row, texels_, how_.burst_bytes, [&](std::size_t texel) { return codes_[texel]; })));
      if (compressible(shape, how_.burst_bytes)) out_.pixels_compressed += shape.pixels();
    }
}

void TexelEncoder::add_raw_blocks(const BlockShape& shape) {
  const IntRect blocks = touched_blocks(shape, texels_);
  for (int row = blocks.y0; row < blocks.y1; ++row)
    out_.block_bytes.insert(out_.block_bytes.end(), static_cast<std::size_t>(blocks.width()),
                            static_cast<std::uint16_t>(raw_block_bytes(shape, row, texels_, how_.burst_bytes)));
}

StoredTexels TexelEncoder::take() {
  TESSERA_CHECK(plane_ == format_.known_planes(), "every known plane of a texel has codes");
  if (how_.compressed)
    for (std::size_t plane = plane_; plane < format_.planes.size(); ++plane)
      for (int sample = 0; sample < format_.samples; ++sample) add_raw_blocks(format_.planes[plane]);
  return std::move(out_);
}

}  // namespace tessera::tilecore
