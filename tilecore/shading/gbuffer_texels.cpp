#include "tilecore/shading/gbuffer_texels.h"

#include <algorithm>
#include <array>
#include <vector>

#include "tilecore/shading/deferred_shader.h"
#include "tilecore/shading/gbuffer.h"
#include "tilecore/shading/gbuffer_packing.h"

namespace tessera::tilecore {
namespace {

using Values = std::array<float, GbufferPlanes::kMaterial>;

constexpr std::size_t kExactWords = 4 + GbufferPlanes::kMaterial;
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
  if (job.shading.layout == GbufferLayout::kExact)
    encode_exact(samples, state, encoder);
  else
    encode_packed(job, samples, encoder);
}

void DeferredShader::encode_exact(const TileSamples& samples, const TileState& state, TexelEncoder& encoder) const {
  const auto spp = static_cast<std::size_t>(samples.spp);
  // Adds a plane of words: word(sample of the tile), 0 for samples that see nothing.
  const auto add = [&](const auto& word) {
    encoder.add_plane([&](int sample, std::size_t texel) {
      const std::size_t s = texel * spp + static_cast<std::size_t>(sample);
      return word_code(sample_point_[s] == kNone ? 0 : word(s));
    });
  };
  // In memory a triangle is a sub-patch of the tile's table, here numbered as samples see its patch first, and a number in it.
  std::vector<std::uint32_t> seen;
  const auto number_of = [&](std::uint32_t patch) {
    const auto found = std::find(seen.rbegin(), seen.rend(), patch);
    if (found != seen.rend()) return static_cast<std::uint32_t>(seen.rend() - found - 1);
    seen.push_back(patch);
    return static_cast<std::uint32_t>(seen.size() - 1);
  };
  add([&](std::size_t s) { return depth_bits(state.z[s]); });
  add([&](std::size_t s) {
    const std::uint32_t sign = static_cast<std::uint32_t>(state.positive[s]) << 31;
    return sign | (number_of(state.patch[s]) << 16 ^ state.triangle[s]);
  });
  add([&](std::size_t s) { return ordered_bits(state.b1[s]); });
  add([&](std::size_t s) { return ordered_bits(state.b2[s]); });
  for (std::size_t plane = 0; plane < GbufferPlanes::kMaterial; ++plane)
    add([&](std::size_t s) {
      const std::uint32_t point = sample_point_[s];
      if (pixel_shader_.filled()[point - kept_] != 0)
        return ordered_bits(pixel_shader_.filled_value(plane, point - kept_));
      const std::size_t channel = plane - GbufferPlanes::kEmissive;  // of a surface that was shaded forward
      return channel < 3 ? ordered_bits(points_[point].color[static_cast<int>(channel)]) : 0;
    });
}

void DeferredShader::encode_packed(const TileJob& job, const TileSamples& samples, TexelEncoder& encoder) const {
  const auto spp = static_cast<std::size_t>(samples.spp);
  std::vector<PackedGbuffer> packed(opaque_);  // by invocation
  for (std::size_t i = 0; i < opaque_; ++i) {
    if (pixel_shader_.filled()[i] == 0) {
      const Vec3& color = points_[kept_ + i].color;
      packed[i][0] = half_bits(color.x) | static_cast<std::uint32_t>(half_bits(color.y)) << 16;
      packed[i][1] = half_bits(color.z);
      continue;
    }
    Values values;
    for (std::size_t plane = 0; plane < values.size(); ++plane) values[plane] = pixel_shader_.filled_value(plane, i);
    packed[i] = pack_gbuffer(values, 0);
  }
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
