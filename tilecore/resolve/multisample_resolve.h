#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/counter.h"
#include "base/image.h"
#include "base/rect.h"
#include "base/vec.h"
#include "memory/ledger.h"
#include "tilecore/resolve/frame_format.h"

namespace tessera::tilecore {

struct ResolveCounters {
  std::uint64_t pixels_shaded = 0;
};

// Multisample resolve: the colour of a pixel is the mean of its samples in linear light, its coverage the share of
// samples that see a surface. Writes the tile's pixels and, unless a TileStore does, charges the default frame buffer
// for them.
//
// `color` and `coverage` hold spp values per pixel, row by row; `pixels` is the tile, `target` the image of `region`.
struct ResolveInput {
  std::span<const Vec3> color;
  std::span<const float> coverage;
  int spp;
  IntRect pixels, region;
  std::uint64_t burst_bytes;
  bool charge = true;  // the frame buffer's traffic
};
// The same for one pixel: (colour, coverage) of `spp` samples.
inline Vec4 mean_of_samples(const Vec3* color, const float* coverage, int spp) {
  const float share = 1.0f / static_cast<float>(spp);
  Vec3 sum(0.0f);
  float covered = 0.0f;
  for (int k = 0; k < spp; ++k) {
    sum += color[k];
    covered += coverage[k];
  }
  return {sum.x * share, sum.y * share, sum.z * share, covered * share};
}

// The usual four samples without a loop.
template <int Spp>
Vec4 mean_of_samples(const Vec3* color, const float* coverage) {
  return mean_of_samples(color, coverage, Spp);
}

// The usual four samples on SIMD lanes, with the same bits: pixels of a row, or of a block of 4x4 (bit 4*y + x) whose
// rows are `stride` pixels apart.
void means_of_row(const Vec3* color, const float* coverage, std::size_t pixels, float* out);
void means_of_block(const Vec3* color, const float* coverage, std::ptrdiff_t stride, std::uint16_t pixels, Vec4* out);

void resolve_multisample(const ResolveInput& input, Image& target, ResolveCounters& counters, memory::Ledger& ledger);

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kCounterFields<tilecore::ResolveCounters> =
    std::to_array<CounterField<tilecore::ResolveCounters>>({
        {"resolve.pixels_shaded", &tilecore::ResolveCounters::pixels_shaded, Combine::kSum, "pixels",
         "Pixels resolved from samples that were shaded for them.",
         "PowerVR Pixels Out; V3D TLB-quads-written-to-color-buffer (times 4)"},
    });
TESSERA_COUNTERS_COVER(tilecore::ResolveCounters);

}  // namespace tessera
