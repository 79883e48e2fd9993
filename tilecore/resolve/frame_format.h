#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "base/enum_words.h"
#include "base/vec.h"

namespace tessera::tilecore {

// Format of finished pixels in memory.
//   rgba8    displayed colours: light times exposure through the tone map (shaders_cpp/tone_map.h), as sRGB codes of 8
//            bits; coverage in 8 bits
//   rgb10a2  the same in 10 bits; coverage in 2
//   rgba16f  linear light and coverage as half floats
// The emulator's images keep the linear light from before the store: EXR files and comparisons get colours as shaded.
// Memory, signatures, compression and the resolve unit's reads between pixels of the previous frame have the codes.
enum class FrameFormat : std::uint8_t { kRgba8, kRgb10a2, kRgba16f };

// Bytes per pixel of the finished frame in memory.
constexpr std::uint64_t frame_pixel_bytes(FrameFormat format) { return format == FrameFormat::kRgba16f ? 8 : 4; }
// The bytes of a pixel of the default format.
inline constexpr std::uint64_t kFramePixelBytes = frame_pixel_bytes(FrameFormat::kRgba8);

// A pixel in memory: red, green, blue, coverage, each in its channel's lowest bits.
using PixelCode = std::array<std::uint16_t, 4>;
using ChannelBits = std::array<std::uint8_t, 4>;
constexpr ChannelBits channel_bits(FrameFormat format) {
  switch (format) {
    case FrameFormat::kRgba8:
      return {8, 8, 8, 8};
    case FrameFormat::kRgb10a2:
      return {10, 10, 10, 2};
    case FrameFormat::kRgba16f:
      break;
  }
  return {16, 16, 16, 16};
}

// Conversion between colours (linear RGB and coverage) and pixels in memory.
//
// Invariants (cited by the tests):
//   FF1  code(stored(c)) == code(c) where light times exposure is at most 0.75. Above, where the tone map compresses, no
//        channel differs by more than a tenth of its codes: a step of the largest channel then stands for much light, and for
//        much of the white that the others have.
//   FF2  A code is the nearest to its channel's value; NaN and negative values become 0, too bright ones the largest code.
class PixelCoder {
 public:
  explicit PixelCoder(FrameFormat format = FrameFormat::kRgba8, float exposure = 1.0f)
      : format_(format), exposure_(exposure > 0.0f ? exposure : 1.0f) {}

  FrameFormat format() const { return format_; }
  std::uint64_t pixel_bytes() const { return frame_pixel_bytes(format_); }
  // Whether the store tone-maps.
  bool tone_maps() const { return format_ != FrameFormat::kRgba16f; }

  PixelCode code(const Vec4& color) const;
  // The colours of stored pixels, in linear light.
  void stored(std::span<const Vec4> colors, Vec4* out) const;
  Vec4 stored(const Vec4& color) const {
    Vec4 out;
    stored({&color, 1}, &out);
    return out;
  }

 private:
  Vec4 color_of(const PixelCode& code) const;

  FrameFormat format_;
  float exposure_;
};

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::FrameFormat> = std::to_array<std::string_view>({"rgba8", "rgb10a2",
                                                                                           "rgba16f"});

}  // namespace tessera
