// Patterns and seams: cases in which the previous frame's image or a tile's border decides desampling.
#include "tests/replay/pattern_scenes.h"
#include "tests/support/tests.h"

namespace tessera::replay::resolve_patterns_test {
namespace {

using scene::Capture;

// Without a look at contrast every fast block is coarse, whatever it shows.
const std::vector<std::string> kBySpeedAlone = {"resolve.pattern_error=0"};

// ---- Patterns ---------------------------------------------------------------------------------------------------

// Boards that slide by 12 pixels a frame, in and between the pixels' directions. Of checkers the insides of cells stay
// coarse; a grain of four pixels is shaded at half rate.
TEST(ResolvePatterns, FastPatternsAreShadedAsFineAsTheyShow) {  // BC1, BC3
  for (const Pattern pattern : {Pattern::kChecker, Pattern::kNoise, Pattern::kStripes})
    for (const DVec3& way : {DVec3(6, 0, 0), DVec3(6.13, 1.7, 0)}) {
      const Capture capture = sliding_board(pattern, 0.25f, way);
      const DesampledComparison c(capture, 3, 7);
      EXPECT_GE(c.worst_psnr(0), 40) << static_cast<int>(pattern);
      EXPECT_GE(c.saved(1), 0.30) << static_cast<int>(pattern);
      if (pattern == Pattern::kStripes) continue;
      EXPECT_LT(DesampledComparison(capture, 3, 6, kBySpeedAlone).worst_psnr(0), 40);  // the failing twin
    }
}

// A grain of a pixel cannot be made from its neighbours.
TEST(ResolvePatterns, AGrainOfAPixelIsShadedFully) {
  const Capture capture = sliding_board(Pattern::kNoise, 1, {6.13, 1.7, 0});
  const DesampledComparison c(capture, 3, 7);
  EXPECT_GE(c.worst_psnr(0), 40);
  EXPECT_EQ(c.back().counters.pixels_reconstructed, 0u);
  EXPECT_LT(DesampledComparison(capture, 3, 6, kBySpeedAlone).worst_psnr(0), 25);  // the failing twin
}

// Bytes and operations of the look are charged, and none without it.
TEST(ResolvePatterns, TheLookCosts) {
  const Capture capture = sliding_board(Pattern::kNoise, 0.25f, {6, 0, 0});
  const auto frame = [&](const std::vector<std::string>& sets) {
    gpu::RunSettings settings;
    gpu::GpuConfiguration gpu;
    settings.resolve.desampling = tilecore::Desampling::kAdaptive;
    for (const std::string& text : sets) gpu::apply_setting(text, settings, gpu);
    gpu::Device device(capture, gpu, settings, {320, 180, {0, 0, 320, 180}});
    device.render(3), device.render(4);
    return device.render(5);
  };
  const auto bytes = [](const gpu::FrameResult& r) {
    return r.counters.ledger.traffic(memory::Unit::kResolve, memory::Purpose::kHistory);
  };
  const std::vector<std::string> none = {"resolve.advection=false", "resolve.hysteresis=0",
                                         "resolve.half_rate_speed=0.1", "resolve.reuse_speed=0"};
  std::vector<std::string> by_speed = none;
  by_speed.insert(by_speed.end(), kBySpeedAlone.begin(), kBySpeedAlone.end());
  const gpu::FrameResult with = frame(none), without = frame(by_speed);
  EXPECT_EQ(without.counters.desampling.contrast_operations, 0u);
  EXPECT_EQ(bytes(without).written_bytes, 0u);
  constexpr std::uint64_t kBlocks = 80 * 45;
  EXPECT_GE(bytes(with).written_bytes, kBlocks);
  EXPECT_GE(bytes(with).read_bytes, kBlocks);
  EXPECT_LT(bytes(with).read_bytes, bytes(without).read_bytes + 8 * kBlocks);  // a tile reads the needed bytes once
  EXPECT_GT(with.counters.desampling.contrast_operations, 10 * kBlocks);
}

// ---- Seams ------------------------------------------------------------------------------------------------------

// Pixels at most two away from a tile's border are as right as those inside, for any tile.
TEST(ResolveSeams, TilesDoNotShow) {  // TLB1, TLB2
  for (const int tile : {8, 16, 32, 64}) {
    const std::vector<std::string> size = {"tile.width=" + std::to_string(tile), "tile.height=" + std::to_string(tile)};
    std::vector<std::string> sets = size;
    sets.push_back("resolve.desampling=fixed_4");
    const DesampledComparison noise(sliding_board(Pattern::kNoise, 0.25f, {6, 0, 0}), 3, 5, sets);
    EXPECT_LE(noise.seams(0, tile).ratio(), 1.05) << tile;
    for (const auto& [name, frame] : {std::pair{"stroll", 36}, {"serpent", 20}}) {
      const Capture capture = scene::read_capture(test::shipped_capture(name));
      EXPECT_LE(DesampledComparison(capture, frame, frame + 2, sets).seams(0, tile).ratio(), 1.05)
          << name << " " << tile;
    }
  }
}

}  // namespace
}  // namespace tessera::replay::resolve_patterns_test
