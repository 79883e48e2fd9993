// Frames of a scene at rest: the host keeps the results of front end and binner, the emulated machine makes them
// again.
#include "gpu/counter_list.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "tests/support/tests.h"

namespace tessera::gpu::still_frames_test {
namespace {

// Rests but for the second between 2 and 3.
scene::Capture spheres() {
  scene::Capture capture;
  scene::Material bumpy, clear;
  bumpy.displacement = test::displacement(2, 2, {0, 1, 1, 0}, 0.2f, 0);
  clear.alpha_mode = scene::AlphaMode::kBlend;
  clear.base_color = {0.8f, 0.3f, 0.2f, 0.5f};
  const int node = test::add_node(capture, test::closed_patches(test::add_material(capture, bumpy)), {-0.6, 0, 0});
  test::add_node(capture, test::closed_patches(test::add_material(capture, clear)), {0.7, 0.2, 1});
  capture.animations.push_back({"",
                                {{.node = node,
                                  .path = scene::AnimatedPath::kTranslation,
                                  .components = 3,
                                  .times = {2, 3},
                                  .values = {-0.6f, 0, 0, 0.2f, 0.4f, 0}}}});
  capture.played_animations = {0};
  test::add_camera(capture, {0, 0, 6});
  capture.settings.frame_rate = 2;
  return capture;
}

RenderRequest request() { return {96, 80, {0, 0, 96, 80}}; }

void expect_frames_of_a_fresh_device(const GpuConfiguration& gpu, const RunSettings& settings) {
  const scene::Capture capture = spheres();
  Device device(capture, gpu, settings, request());
  for (int frame = 0; frame < 9; ++frame) {
    const FrameResult after_others = device.render(frame),
                      alone = Device(capture, gpu, settings, request()).render(frame);
    EXPECT_EQ(after_others.targets.color.values, alone.targets.color.values) << frame;
    EXPECT_EQ(counter_values(after_others.counters), counter_values(alone.counters)) << frame;
    EXPECT_EQ(after_others.effects, alone.effects) << frame;
    ASSERT_TRUE(after_others.model && alone.model);
    EXPECT_EQ(after_others.model->timing.cycles, alone.model->timing.cycles) << frame;
  }
}

TEST(StillFrames, PL1EqualAFreshDevices) { expect_frames_of_a_fresh_device({}, {}); }

TEST(StillFrames, PL1HoldsWithPartialRenders) {
  GpuConfiguration gpu;
  gpu.tessellator.sub_patch_cells = 4;
  gpu.parameter_buffer.bytes = 640;
  gpu.parameter_buffer.chunk_bytes = 64;
  const scene::Capture capture = spheres();
  ASSERT_GT(Device(capture, gpu, {}, request()).render(0).counters.binner.partial_renders, 0u);
  expect_frames_of_a_fresh_device(gpu, {});
}

TEST(StillFrames, PL1HoldsForEachSeedAndRate) {
  for (const char* setting : {"shading.rate=sample", "resolve.desampling=checkerboard", "binner.queue_levels=3"}) {
    RunSettings settings;
    GpuConfiguration gpu;
    apply_setting(setting, settings, gpu);
    expect_frames_of_a_fresh_device(gpu, settings);
  }
}

// A kept list holds all entries of the frame: it is not filled twice, nor read when the scene has moved on.
TEST(StillFrames, KeepTheirLists) {
  const scene::Capture capture = spheres();
  Device device(capture, {}, {}, request());
  const FrameResult first = device.render(0), second = device.render(1);
  ASSERT_GT(first.counters.binner.entries, 0u);
  EXPECT_EQ(first.counters.binner.entries, second.counters.binner.entries);
  EXPECT_EQ(first.targets.color.values, second.targets.color.values);
  const FrameResult moving = device.render(5);
  EXPECT_NE(moving.targets.color.values, first.targets.color.values);
}

}  // namespace
}  // namespace tessera::gpu::still_frames_test
