#include "tilecore/shading/gbuffer_texels.h"

#include <algorithm>
#include <array>
#include <limits>

#include "tilecore/shading/deferred_shader.h"
#include "tilecore/shading/gbuffer.h"
#include "tilecore/shading/gbuffer_packing.h"

namespace tessera::tilecore {
namespace {

using Values = std::array<float, GbufferPlanes::kMaterial>;

constexpr std::size_t kRecordWords = 4, kExactWords = kRecordWords + GbufferPlanes::kMaterial;
constexpr ChannelBits kBytes{8, 8, 8, 8}, kNormals{16, 16, 0, 0}, kSharedExponent{9, 9, 9, 5};
constexpr std::array<ChannelBits, 4> kPackedFields{kBytes, kNormals, kBytes, kSharedExponent};

PixelCode fields_of(std::uint32_t word, const ChannelBits& bits) {
  PixelCode code{};
  int from = 0;
  for (std::size_t c = 0; c < code.size() && bits[c] > 0; from += bits[c], ++c)
    code[c] = static_cast<std::uint16_t>(packing::bits_of(word, from, bits[c]));
  return code;
}

}  // namespace

TexelFormat gbuffer_format(const ShadingSettings& settings, int samples) {
  TexelFormat format{.planes = {}, .samples = samples};
  if (settings.layout == GbufferLayout::kExact) {
    format.planes.assign(kExactWords, kWordBlock);
    return format;
  }
  const std::size_t words = static_cast<std::size_t>(settings.gbuffer_bits) / 32,
                    known = std::min(words, kPackedFields.size());
  for (std::size_t word = 0; word < known; ++word)
    format.planes.push_back({.width = 8, .height = 8, .bits = kPackedFields[word], .halves = false});
  format.unknown_planes = words - known;
  format.planes.resize(words, kWordBlock);
  return format;
}

void DeferredShader::encode_gbuffer(const TileJob& job, const TileSamples& samples, const TileState& state,
                                    TexelEncoder& encoder) const {
  const auto spp = static_cast<std::size_t>(samples.spp);
  const auto values_of = [&](std::uint32_t point) {
    Values values{};
    const std::size_t i = point - kept_;
    if (pixel_shader_.filled()[i] != 0)
      for (std::size_t p = 0; p < values.size(); ++p) values[p] = pixel_shader_.filled_value(p, i);
    else
      for (int c = 0; c < 3; ++c) values[static_cast<std::size_t>(6 + c)] = points_[point].color[c];
    return values;
  };
  if (job.shading.layout == GbufferLayout::kExact) {
    const auto record_word = [&](std::size_t s, std::size_t word) -> std::uint32_t {
      if (sample_point_[s] == kNone) return 0;
      if (word == 0) return depth_bits(state.z[s]);
      if (word == 1) return state.triangle[s] | static_cast<std::uint32_t>(state.positive[s]) << 31;
      return ordered_bits(word == 2 ? state.b1[s] : state.b2[s]);
    };
    for (std::size_t word = 0; word < kRecordWords; ++word)
      encoder.add_plane([&](int sample, std::size_t texel) {
        return word_code(record_word(texel * spp + static_cast<std::size_t>(sample), word));
      });
    for (std::size_t p = 0; p < GbufferPlanes::kMaterial; ++p)
      encoder.add_plane([&](int sample, std::size_t texel) {
        const std::uint32_t point = sample_point_[texel * spp + static_cast<std::size_t>(sample)];
        return word_code(point == kNone ? 0 : ordered_bits(values_of(point)[p]));
      });
    return;
  }
  std::vector<PackedGbuffer> packed;  // by invocation
  for (std::size_t i = 0; i < pixel_shader_.filled().size(); ++i)
    packed.push_back(pack_gbuffer(values_of(static_cast<std::uint32_t>(kept_ + i)), 0));
  // The first sample of the pixel that takes the same invocation.
  const auto leader = [&](std::size_t first, std::size_t sample) {
    std::size_t at = 0;
    while (sample_point_[first + at] != sample_point_[first + sample]) ++at;
    return static_cast<std::uint32_t>(at);
  };
  const std::size_t words = std::min(static_cast<std::size_t>(job.shading.gbuffer_bits) / 32, kPackedFields.size());
  for (std::size_t word = 0; word < words; ++word)
    encoder.add_plane([&](int sample, std::size_t texel) -> PixelCode {
      const std::size_t first = texel * spp, at = static_cast<std::size_t>(sample);
      const std::uint32_t point = sample_point_[first + at];
      if (point == kNone) return {};
      std::uint32_t value = packed[point - kept_][word];
      if (word == 2) value |= leader(first, at) << 16;
      return fields_of(value, kPackedFields[word]);
    });
}

}  // namespace tessera::tilecore
