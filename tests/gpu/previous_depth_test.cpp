// Two-pass occlusion culling by the previous frame's depths: images, savings and charges.
#include "base/parallel.h"
#include "gpu/counter_list.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "gpu/view_observer.h"
#include "tests/support/instances.h"
#include "tests/support/tests.h"

namespace tessera::gpu::previous_depth_test {
namespace {

using memory::Purpose;
using memory::Unit;

constexpr int kWidth = 160, kHeight = 96;
constexpr std::uint32_t kPoints = 320;  // along a side of the mesh: many groups of clusters

scene::Primitive sheet(float half, std::uint32_t points) {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  for (std::uint32_t j = 0; j < points; ++j)
    for (std::uint32_t i = 0; i < points; ++i) {
      const auto at = [&](std::uint32_t k) {
        return (2 * static_cast<float>(k) / static_cast<float>(points - 1) - 1) * half;
      };
      positions.emplace_back(at(i), at(j), 0.0f);
      const std::uint32_t a = j * points + i;
      if (i + 1 < points && j + 1 < points)
        indices.insert(indices.end(), {a, a + 1, a + points + 1, a, a + points + 1, a + points});
    }
  return test::triangles(positions, indices, scene::kNone);
}

// A wall before a fine sheet that fills the view; it moves on by `way` each second, which is eight frames.
scene::Capture wall_before_sheet(const DVec3& way) {
  scene::Capture capture;
  test::add_node(capture, sheet(4.0f, kPoints), {0, 0, -2});
  const int wall = test::add_node(capture, sheet(3.0f, 2), {-2.8, 0, 0});
  test::add_motion(capture, wall, way);
  test::add_camera(capture, {0, 0, 3});
  capture.settings.frame_rate = 8;
  return capture;
}

std::vector<FrameResult> frames(const scene::Capture& capture, const std::vector<std::string>& keys, int count = 2,
                                bool auxiliary = false) {
  RunSettings settings;
  GpuConfiguration gpu;
  for (const std::string& key : keys) apply_setting(key, settings, gpu);
  RenderRequest request{kWidth, kHeight, {0, 0, kWidth, kHeight}};
  request.auxiliary = auxiliary;
  Device device(capture, gpu, settings, request);
  std::vector<FrameResult> all;
  for (int frame = 0; frame < count; ++frame) all.push_back(device.render(frame));
  return all;
}

const std::string kOn = "frontend.previous_depth_culling=true";

std::uint64_t records_read(const FrameResult& frame) {
  return frame.counters.ledger.traffic(Unit::kFrontend, Purpose::kPatchData).read_bytes;
}

TEST(PreviousDepth, GeometryBehindAWallIsNotRead) {
  const scene::Capture capture = wall_before_sheet(DVec3(0.0));
  const auto plain = frames(capture, {}), culling = frames(capture, {kOn});
  for (std::size_t f = 0; f < 2; ++f) EXPECT_EQ(culling[f].targets.color.values, plain[f].targets.color.values);
  const frontend::PreviousDepthCounters &first = culling[0].counters.previous_depth,
                                        &second = culling[1].counters.previous_depth;
  EXPECT_EQ(first.groups_culled, 0u) << "there is no frame before";
  EXPECT_GT(second.groups_culled, 0u);
  EXPECT_GE(second.patches_culled, 8 * second.groups_culled);
  EXPECT_EQ(second.tiles_again, 0u) << "nothing moves";
  EXPECT_EQ(records_read(culling[0]), records_read(plain[0]));
  EXPECT_LT(records_read(culling[1]), records_read(plain[1]));
  EXPECT_LT(culling[1].counters.binner.entries, plain[1].counters.binner.entries);
}

TEST(PreviousDepth, InstancesAreHiddenAsAWhole) {
  test::Random random(5);
  std::uint64_t hidden = 0;
  for (int trial = 0; trial < 4; ++trial) {
    scene::Capture capture = test::random_instanced_scene(random, 40, 1.5f);
    test::add_node(capture, sheet(1.2f, 2), {0, 0, 1.6});
    const auto plain = frames(capture, {}), culling = frames(capture, {kOn});
    EXPECT_EQ(culling[1].targets.color.values, plain[1].targets.color.values) << trial;
    hidden += culling[1].counters.previous_depth.groups_culled;
  }
  EXPECT_GT(hidden, 0u);
}

// Renders each frame of a device again with the guess of the frame before, which is verified or not.
class Guesses final : public ViewObserver {
 public:
  void view_rendered(const RenderedView& view) override {
    if (depth_) {
      const frontend::CoarseDepth guess =
          frontend::reproject(*depth_, view.job.frame->projection, view.job.frame->views[0]);
      verified = color(view, {true, &guess});
      unverified = color(view, {false, &guess});
    }
    FrameResult result = render(view, {true, nullptr});
    depth_ = std::move(result.targets.coarse_depth);
  }
  std::vector<float> verified, unverified;

 private:
  static FrameResult render(const RenderedView& view, const Pipeline::PreviousDepth& previous) {
    FrameResult result(view.result.frame, tilecore::FrameTargets(view.result.targets.region, false));
    WorkRecorder recorder(view.gpu, view.records, nullptr, false);
    Pipeline(view.gpu, view.pyramids).render({view.gpu, view.job, recorder, result, nullptr}, previous);
    return result;
  }
  static std::vector<float> color(const RenderedView& view, const Pipeline::PreviousDepth& previous) {
    return render(view, previous).targets.color.values;
  }
  std::optional<frontend::CoarseDepth> depth_;
};

// The wall goes and uncovers the sheet. SP1 and CD2, and their failing twin: a machine that believes the guess draws
// a hole.
TEST(PreviousDepth, AnUnverifiedGuessDrawsAWrongImage) {
  const scene::Capture capture = wall_before_sheet(DVec3(-8, 0, 0));
  Guesses guesses;
  Device device(capture, {}, {}, {kWidth, kHeight, {0, 0, kWidth, kHeight}});
  device.set_observer(&guesses);
  device.render(0);
  const FrameResult expected = device.render(1);
  EXPECT_EQ(guesses.verified, expected.targets.color.values);
  EXPECT_NE(guesses.unverified, expected.targets.color.values);
  const auto culling = frames(capture, {kOn});
  EXPECT_EQ(culling[1].targets.color.values, expected.targets.color.values);
  EXPECT_GT(culling[1].counters.previous_depth.tiles_again, 0u);
  EXPECT_LT(culling[1].counters.previous_depth.tiles_again, 15u) << "not the tiles that the wall did not touch";
}

// CD1, by the nearest samples of pixels, whose depths the auxiliary image has: none is farther than its block.
TEST(PreviousDepth, NoPixelSeesAnythingFartherThanItsBlock) {
  const scene::Capture capture = wall_before_sheet(DVec3(-4, 0, 0));
  class Depths final : public ViewObserver {
   public:
    void view_rendered(const RenderedView& view) override {
      FrameResult result(0, tilecore::FrameTargets(view.result.targets.region, true));
      WorkRecorder recorder(view.gpu, view.records, nullptr, false);
      Pipeline(view.gpu, view.pyramids).render({view.gpu, view.job, recorder, result, nullptr}, {true, nullptr});
      const frontend::CoarseDepth& coarse = result.targets.coarse_depth;
      ASSERT_EQ(coarse.farthest.size(), static_cast<std::size_t>(kWidth / 16 * (kHeight / 16)));
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
          EXPECT_LE(result.targets.depth.at(x, y)[0], frontend::depth_of(coarse.at(x / 16, y / 16)));
      for (const frontend::DepthCode code : coarse.farthest) finite += code < frontend::kNothingSeen ? 1 : 0;
    }
    int finite = 0;
  } depths;
  Device device(capture, {}, {}, {kWidth, kHeight, {0, 0, kWidth, kHeight}});
  device.set_observer(&depths);
  device.render(0);
  EXPECT_GT(depths.finite, 25);
}

TEST(PreviousDepth, CountersAndImagesDoNotDependOnTheThreads) {
  const scene::Capture capture = wall_before_sheet(DVec3(-8, 0, 0));
  std::vector<FrameResult> one, four;
  with_threads(1, [&] { one = frames(capture, {kOn}, 3); });
  with_threads(4, [&] { four = frames(capture, {kOn}, 3); });
  for (std::size_t f = 0; f < 3; ++f) {
    EXPECT_EQ(one[f].targets.color.values, four[f].targets.color.values);
    EXPECT_EQ(counter_values(one[f].counters), counter_values(four[f].counters));
    EXPECT_EQ(one[f].model->timing.cycles, four[f].model->timing.cycles);
  }
}

// ---- Charges ----------------------------------------------------------------------------------------------------

std::uint64_t bursts(std::uint64_t bytes) { return (bytes + 63) / 64 * 64; }

// Blocks are as large as the tile's sides allow, up to 16 pixels.
TEST(PreviousDepth, MoreBlocksTakeMoreBytes) {
  const scene::Capture capture = wall_before_sheet(DVec3(0.0));
  for (const std::uint64_t side : {8u, 16u}) {
    const std::string tile = std::to_string(side);
    const auto all = frames(capture, {kOn, "tile.width=" + tile, "tile.height=" + tile});
    const std::uint64_t bytes = bursts(kWidth / side * (kHeight / side) * 2);
    for (const FrameResult& frame : all) {
      const memory::Ledger& ledger = frame.counters.ledger;
      EXPECT_EQ(ledger.traffic(Unit::kTilecore, Purpose::kCoarseDepth).written_bytes, bytes) << side;
      const std::uint64_t deferred = bursts(frame.counters.previous_depth.deferred_bytes);
      EXPECT_EQ(ledger.traffic(Unit::kFrontend, Purpose::kCoarseDepth).read_bytes, bytes + deferred) << side;
      EXPECT_EQ(ledger.traffic(Unit::kFrontend, Purpose::kCoarseDepth).written_bytes, deferred) << side;
    }
    EXPECT_GT(all[1].counters.previous_depth.deferred_bytes, 0u);
    EXPECT_EQ(all[1].counters.previous_depth.blocks_reprojected, kWidth / side * (kHeight / side));
  }
  const memory::Ledger off = frames(capture, {})[1].counters.ledger;
  EXPECT_EQ(off.traffic(Unit::kTilecore, Purpose::kCoarseDepth).written_bytes, 0u);
  EXPECT_EQ(off.traffic(Unit::kFrontend, Purpose::kCoarseDepth).read_bytes, 0u);
}

TEST(PreviousDepth, EveryByteBelongsToTheMachineInTime) {
  const scene::Capture capture = wall_before_sheet(DVec3(-8, 0, 0));
  for (const FrameResult& frame : frames(capture, {kOn})) {
    const memory::Traffic total = frame.counters.ledger.total();
    EXPECT_EQ(frame.model->record.work.dram_bytes(), total.read_bytes + total.written_bytes);
    std::uint64_t reprojected = 0, tested = 0;
    for (const timing::WorkRound& round : frame.model->record.work.rounds) {
      reprojected += round.geometry.events[hardware::Event::kReprojectedBlocks];
      tested += round.geometry.events[hardware::Event::kDepthTests];
    }
    EXPECT_EQ(reprojected, frame.counters.previous_depth.blocks_reprojected);
    EXPECT_EQ(tested, frame.counters.previous_depth.blocks_tested);
  }
}

TEST(PreviousDepth, OperationsTakeTimeAndEnergy) {
  const scene::Capture capture = wall_before_sheet(DVec3(0.0));
  const auto second = [&](const std::string& key) {
    auto all = frames(capture, key.empty() ? std::vector{kOn} : std::vector{kOn, key});
    return std::pair{all[1].model->timing.cycles, all[1].model->energy.by_unit_nj.at("frontend")};
  };
  const auto usual = second("");
  EXPECT_GT(second("frontend.reprojected_blocks_per_clk=0.01").first, usual.first);
  EXPECT_GT(second("frontend.depth_tests_per_clk=0.001").first, usual.first);
  EXPECT_GT(second("energy.reprojected_block_pj=600").second, usual.second);
  EXPECT_GT(second("energy.depth_test_pj=100").second, usual.second);
}

}  // namespace
}  // namespace tessera::gpu::previous_depth_test
