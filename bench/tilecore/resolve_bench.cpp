// Measures the units of the resolve stage: filling missing pixels by each kernel and by bilinear interpolation,
// reprojection (advection), frame-buffer compression.
//
// Fill* times a kernel and bilinear interpolation interleaved, so that the ratio `over_bilinear` does not depend on
// other work of the host.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "base/random.h"
#include "bench/support/timing.h"
#include "tilecore/resolve/advection.h"
#include "tilecore/resolve/cubic_stencil.h"
#include "tilecore/resolve/frame_compression.h"

namespace tessera::tilecore {
namespace {

float smooth(int x, int y, int channel) {
  return 0.5f +
         0.5f * std::sin(0.21f * static_cast<float>(x) + 0.13f * static_cast<float>(y) + static_cast<float>(channel));
}

// An image with three pixels around it, all blocks rendered by one pattern.
struct Image {
  int width, height;
  BlockMask pattern;
  std::vector<Vec4> color, out;
  std::array<std::uint16_t, kWindowSide> usable{};

  Image(int w, int h, int rate)
      : width(w),
        height(h),
        pattern(dither_mask(rate, 0, {})),
        color(static_cast<std::size_t>((w + 6) * (h + 6))),
        out(static_cast<std::size_t>(w * h)) {
    for (int y = 0; y < h + 6; ++y)
      for (int x = 0; x < w + 6; ++x)
        color[static_cast<std::size_t>(y * (w + 6) + x)] = {smooth(x, y, 0), smooth(x, y, 1), smooth(x, y, 2), 1};
    for (int y = 0; y < kWindowSide; ++y)
      for (int x = 0; x < kWindowSide; ++x)
        if (pattern >> (4 * ((y + 1) & 3) + ((x + 1) & 3)) & 1)
          usable[static_cast<std::size_t>(y)] |= static_cast<std::uint16_t>(1u << x);
  }
  BlockMask missing() const { return static_cast<BlockMask>(~pattern); }
  template <class Body>
  void each_block(const Body& body) {
    Vec4* block = out.data();
    for (int y = 0; y < height; y += 4)
      for (int x = 0; x < width; x += 4, block += 16)
        body(BlockWindow{&color[static_cast<std::size_t>(y * (width + 6) + x)], width + 6, usable}, block);
  }
  ReconstructionWork fill(Reconstruction kernel) {
    ReconstructionWork work;
    each_block([&](const BlockWindow& window, Vec4* block) {
      benchmark::DoNotOptimize(reconstruct_block(kernel, window, missing(), block, work));
    });
    return work;
  }
  // Largest error of the filled pixels of a smooth image.
  double error() const {
    double worst = 0;
    std::size_t i = 0;
    for (int y = 0; y < height; y += 4)
      for (int x = 0; x < width; x += 4)
        for (int p = 0; p < 16; ++p, ++i)
          if (missing() >> p & 1)
            worst = std::max(worst, static_cast<double>(std::abs(out[i].x - smooth(x + p % 4 + 3, y + p / 4 + 3, 0))));
    return worst;
  }
};

void Fill(benchmark::State& state, Reconstruction kernel, int rate) {
  Image image(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)), rate);
  const ReconstructionWork work = image.fill(kernel);
  if (image.error() > 0.03) state.SkipWithError("the image is not the smooth one");
  if (work.direct_pixels != 0) state.SkipWithError("weights were computed, as no table had them");
  std::vector<double> own, bilinear;
  for (auto _ : state) {
    const double begin = bench::now();
    image.fill(kernel);
    const double middle = bench::now();
    image.fill(Reconstruction::kBilinear);
    const double end = bench::now();
    state.SetIterationTime(middle - begin);
    own.push_back(middle - begin);
    bilinear.push_back(end - middle);
  }
  const auto pixels = static_cast<double>(work.pixels);
  state.counters["ns_per_pixel"] = 1e9 * bench::median(own) / pixels;
  state.counters["bilinear_ns_per_pixel"] = 1e9 * bench::median(bilinear) / pixels;
  state.counters["over_bilinear"] = bench::median(own) / bench::median(bilinear);
  state.counters["taps_per_pixel"] = static_cast<double>(work.taps) / pixels;
}
#define TESSERA_FILL(name, ...) \
  BENCHMARK_CAPTURE(Fill, name, __VA_ARGS__)->UseManualTime()->Args({32, 32})->Args({1280, 720})
TESSERA_FILL(Cubic8, Reconstruction::kCubic, 8);
TESSERA_FILL(Cubic4, Reconstruction::kCubic, 4);
TESSERA_FILL(Interpolating8, Reconstruction::kCubicInterpolating, 8);
TESSERA_FILL(Interpolating4, Reconstruction::kCubicInterpolating, 4);

void FillCheckerboard(benchmark::State& state) {
  Image image(32, 32, 8);
  ReconstructionWork work;
  const auto fill = [&] {
    image.each_block([&](const BlockWindow& window, Vec4* block) {
      benchmark::DoNotOptimize(reconstruct_checkerboard(window, image.missing(), block, work));
    });
  };
  fill();
  if (image.error() > 0.03) state.SkipWithError("the image is not the smooth one");
  const auto pixels = static_cast<std::int64_t>(work.pixels);
  for (auto _ : state) fill();
  state.SetItemsProcessed(state.iterations() * pixels);
}
BENCHMARK(FillCheckerboard);

void Advect(benchmark::State& state, Fetch fetch, bool bfecc) {
  constexpr int kSide = 64;
  std::vector<Vec4> color(kSide * kSide);
  std::vector<float> depth(kSide * kSide, 1.0f);
  std::vector<std::uint32_t> patch(kSide * kSide, 1u);
  std::vector<Vec2> velocity(kSide * kSide, Vec2(0.3f, -0.7f));
  std::vector<std::uint8_t> usable(kSide * kSide, std::uint8_t{1});
  for (int i = 0; i < kSide * kSide; ++i) color[static_cast<std::size_t>(i)] = Vec4(smooth(i % kSide, i / kSide, 0));
  const IntRect region{0, 0, kSide, kSide};
  const HistoryView history{color.data(), depth.data(), patch.data(), region, kSide};
  const VelocityView field{velocity.data(), usable.data(), region, kSide};
  AdvectionWork work;
  const auto advect = [&](int x, int y) {
    return advect_pixel(x, y, 1.0f, 1, history, field, {fetch, bfecc}, 0.0f, work);
  };
  // Verify: the result is the smooth image, moved.
  const float expected = 0.5f + 0.5f * std::sin(0.21f * (20 - 0.3f) + 0.13f * (30 + 0.7f));
  if (advect(20, 30).outcome != Advection::kTaken || std::abs(advect(20, 30).color.x - expected) > 0.01f)
    state.SkipWithError("not the moved image");
  work = {};
  int next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(advect(16 + next % 32, 16 + next / 32 % 32));
    ++next;
  }
  state.SetItemsProcessed(state.iterations());
  state.counters["texels_per_pixel"] = static_cast<double>(work.history_texels) / static_cast<double>(next);
}
BENCHMARK_CAPTURE(Advect, Bilinear, Fetch::kBilinear, false);
BENCHMARK_CAPTURE(Advect, BilinearBackAndForth, Fetch::kBilinear, true);
BENCHMARK_CAPTURE(Advect, Bicubic, Fetch::kBicubic, false);

// Blocks of a smooth image, and of noise.
void Compress(benchmark::State& state, bool noise) {
  const auto width = static_cast<int>(state.range(0));
  std::vector<std::uint16_t> halves;
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 4; ++c)
        halves.push_back(
            noise ? static_cast<std::uint16_t>(hash32(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                                                      static_cast<std::uint32_t>(c)))
                  : half_bits(c == 3 ? 1.0f : smooth(x, y, c)));
  const CompressedBlock block = compress_block(halves, width, 4, 32);
  std::vector<std::uint16_t> back(halves.size());
  decompress_block(block, width, 4, back);
  if (back != halves) state.SkipWithError("not lossless");
  for (auto _ : state) benchmark::DoNotOptimize(compressed_block_bytes(halves, width, 4, 32));
  state.SetItemsProcessed(state.iterations() * width * 4);
  state.counters["share_of_raw"] = static_cast<double>(block.payload_bytes) / static_cast<double>(2 * halves.size());
}
BENCHMARK_CAPTURE(Compress, Smooth, false)->Arg(4)->Arg(8)->Arg(16);
BENCHMARK_CAPTURE(Compress, Noise, true)->Arg(4)->Arg(16);

}  // namespace
}  // namespace tessera::tilecore
