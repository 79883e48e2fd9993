// Passes of a frame: their names, their counters, which add up to the frame's, and machines that overlap them, which
// take no longer.
#include "gpu/counter_list.h"
#include "gpu/device.h"
#include "gpu/frame_counters.h"
#include "gpu/pass_counters.h"
#include "gpu/settings.h"
#include "tests/support/tests.h"

namespace tessera::gpu::passes_test {
namespace {

using Names = std::vector<std::string>;

// A board of many patches, and where `glass` is so many panes before it.
scene::Capture board(bool glass) {
  scene::Capture capture;
  scene::Material plain, pane;
  pane.transmission.factor = 1, pane.metallic = 0, pane.roughness = 0.2f;
  pane.effects[static_cast<std::size_t>(scene::MaterialEffect::kTransmission)] = true;
  const auto sheet = [](float half, int material) {
    return test::patches(test::flat_patch({-half, -half, 0}, {2 * half, 0, 0}, {0, 2 * half, 0}), material);
  };
  const int board_number = test::add_material(capture, plain), pane_number = test::add_material(capture, pane);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 24; ++x) {
      const DVec3 at(0.25 * (x - 11.5), 0.25 * (y - 7.5), 0);
      test::add_node(capture, sheet(0.125f, board_number), at);
      if (glass && x % 3 == 0) test::add_node(capture, sheet(0.1f, pane_number), at + DVec3(0, 0, 1));
    }
  scene::Camera camera;
  camera.type = scene::Camera::Type::kOrthographic;
  camera.x_mag = 3, camera.y_mag = 2;
  test::add_camera(capture, {0, 0, 7}, camera);
  return capture;
}

std::vector<FrameResult> frames_of(const scene::Capture& capture, const Names& keys, int count = 1) {
  RunSettings settings;
  GpuConfiguration gpu;
  for (const std::string& key : keys) apply_setting(key, settings, gpu);
  Device device(capture, gpu, settings, {96, 64, {0, 0, 96, 64}});
  std::vector<FrameResult> frames;
  for (int frame = 0; frame < count; ++frame) frames.push_back(device.render(frame));
  return frames;
}

Names names_of(const std::vector<PassResult>& passes) {
  Names names;
  for (const PassResult& pass : passes) names.push_back(pass.name);
  return names;
}

struct PassCase {
  const char* name;
  bool glass;
  Names keys, passes;
};

class FramePasses : public testing::TestWithParam<PassCase> {};

TEST_P(FramePasses, AddUpToTheFrame) {  // PA1
  const PassCase& param = GetParam();
  const std::vector<FrameResult> frames = frames_of(board(param.glass), param.keys, 2);
  const FrameResult& frame = frames.back();
  EXPECT_EQ(names_of(frame.passes), param.passes);
  ASSERT_TRUE(frame.model);
  EXPECT_EQ(frame.model->record.work.passes, param.passes);
  FrameCounters sum;
  for (const PassResult& pass : frame.passes) sum.accumulate(pass.counters);
  EXPECT_EQ(counter_values(sum), counter_values(frame.counters));
  for (std::size_t u = 0; u < memory::kUnitCount; ++u)
    for (std::size_t p = 0; p < memory::kPurposeCount; ++p) {
      const auto unit = static_cast<memory::Unit>(u);
      const auto purpose = static_cast<memory::Purpose>(p);
      EXPECT_EQ(sum.ledger.traffic(unit, purpose).read_bytes, frame.counters.ledger.traffic(unit, purpose).read_bytes);
      EXPECT_EQ(sum.ledger.traffic(unit, purpose).written_bytes,
                frame.counters.ledger.traffic(unit, purpose).written_bytes);
    }
  // Each did something, which is its own.
  for (const PassResult& pass : frame.passes) EXPECT_GT(pass.counters.ledger.total().read_bytes, 0u) << pass.name;
}

INSTANTIATE_TEST_SUITE_P(
    Frames, FramePasses,
    testing::Values(
        PassCase{"plain", false, {}, {"main"}},
        PassCase{"partial_renders", false, {"parameter_buffer.bytes=4096"}, {"main"}},
        PassCase{"glass", true, {}, {"behind", "reduce", "main"}},
        PassCase{"glass_and_partial_renders", true, {"parameter_buffer.bytes=4096"}, {"behind", "reduce", "main"}},
        PassCase{"previous_depth", false, {"frontend.previous_depth_culling=true"}, {"main", "again"}},
        PassCase{"neighbours",
                 false,
                 {"resolve.desampling=checkerboard", "resolve.stencil_reach=neighbours"},
                 {"main", "stencils"}}),
    [](const auto& case_of) { return std::string(case_of.param.name); });

// since() subtracts the earlier counters; a peak stays.
TEST(FrameCountersSince, SubtractEarlierCountersAndKeepPeaks) {
  FrameCounters before, now;
  before.binner.entries = 3, now.binner.entries = 10;
  before.binner.queue_bytes_peak = 100, now.binner.queue_bytes_peak = 120;
  before.ledger.read(memory::Unit::kBinner, memory::Purpose::kTileQueue, 64);
  now.ledger = before.ledger;
  now.ledger.read(memory::Unit::kBinner, memory::Purpose::kTileQueue, 192);
  const FrameCounters more = now.since(before);
  EXPECT_EQ(more.binner.entries, 7u);
  EXPECT_EQ(more.binner.queue_bytes_peak, 120u);
  EXPECT_EQ(more.ledger.total().read_bytes, 192u);
  EXPECT_EQ(now.since(now).binner.entries, 0u);
}

// A right eye has passes of its own.
TEST(Passes, EachEyeHasItsOwn) {
  const FrameResult frame = frames_of(board(true), {"stereo.eye_separation=0.1"}).front();
  ASSERT_TRUE(frame.right);
  EXPECT_EQ(names_of(frame.passes), (Names{"behind", "reduce", "main"}));
  EXPECT_EQ(names_of(frame.right->passes), names_of(frame.passes));
  FrameCounters sum;
  for (const PassResult& pass : frame.right->passes) sum.accumulate(pass.counters);
  EXPECT_EQ(counter_values(sum), counter_values(frame.right->counters));
}

// The front end bins transmissive geometry while the tiles behind it are rendered. Images and counters do not depend
// on this; a plain frame takes the same time, and lists that a partial render emptied are waited for.
TEST(Passes, TransmissiveGeometryBeginsBeforeTheBackgroundIsStored) {
  const auto run = [](bool glass, Names keys, const char* overlap) {
    keys.push_back(std::string("machine.overlap=") + overlap);
    return std::move(frames_of(board(glass), keys).front());
  };
  const FrameResult apart = run(true, {}, "none"), beside = run(true, {}, "passes");
  EXPECT_EQ(beside.targets.color.values, apart.targets.color.values);
  EXPECT_EQ(counter_values(beside.counters), counter_values(apart.counters));
  EXPECT_LT(beside.model->timing.cycles, apart.model->timing.cycles);
  const auto waits = [](const FrameResult& frame) {
    const timing::Schedule& schedule = frame.model->schedule;
    return schedule.geometry.back().begin >= frame.model->timing.passes.front().end;
  };
  EXPECT_TRUE(waits(apart));
  EXPECT_FALSE(waits(beside));
  EXPECT_TRUE(waits(run(true, {"parameter_buffer.bytes=4096"}, "passes")));
  EXPECT_EQ(run(false, {}, "passes").model->timing.cycles, run(false, {}, "none").model->timing.cycles);
}

}  // namespace
}  // namespace tessera::gpu::passes_test
