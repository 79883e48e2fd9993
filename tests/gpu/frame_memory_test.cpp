// Reading the capture uses a part of the budget; the rest bounds the memory of a frame.
#include "base/error.h"
#include "gpu/device.h"
#include "scene/assembly.h"
#include "scene/capture_reader.h"
#include "tests/support/instances.h"
#include "tests/support/tests.h"

namespace tessera::gpu::frame_memory_test {
namespace {

constexpr int kWidth = 64, kHeight = 48;

// Many small instances, all in view.
scene::Capture crowd() {
  test::Random random(5);
  return test::random_instanced_scene(random, 6000, 1.0f);
}

FrameResult draw(const scene::Capture& capture, const GpuConfiguration& gpu = {}) {
  Device device(capture, gpu, RunSettings(), {kWidth, kHeight, {0, 0, kWidth, kHeight}});
  return device.render(0);
}

std::uint64_t sub_patch_bytes(const FrameResult& result) {
  return result.counters.frontend.sub_patches * sizeof(frontend::BoundedSubPatch);
}

TEST(FrameMemory, AFrameThatFitsDoesNotDependOnTheRestOfTheBudget) {
  scene::Capture capture = crowd();
  const FrameResult free = draw(capture);
  ASSERT_GT(sub_patch_bytes(free), 4u << 20);
  capture.max_bytes = 2 * sub_patch_bytes(free) + (64u << 20);
  EXPECT_EQ(draw(capture).targets.color.values, free.targets.color.values);
}

TEST(FrameMemory, SubPatchesThatDoNotFitAreRefusedBeforeTheyAreAllMade) {
  scene::Capture capture = crowd();
  const std::uint64_t needed = sub_patch_bytes(draw(capture));
  for (const std::uint64_t share : {2, 8}) {
    capture.max_bytes = needed / share;
    EXPECT_THROW(draw(capture), LimitError) << share;
  }
}

// Tables of heights take six times the bytes of the heights themselves, once for a displacement map, four times where
// slopes cull back faces.
TEST(FrameMemory, TablesOfHeightsAreRefusedBeforeTheyAreMade) {
  scene::Capture capture = scene::read_capture(test::shipped_capture("eggs"));
  const scene::Assembly assembly = scene::assemble(capture);
  std::uint64_t texels = 0;
  for (const scene::Material& material : assembly.materials)
    if (material.displacement) {
      const auto& heights = material.displacement->texture->levels().front();
      texels = std::max(texels, static_cast<std::uint64_t>(heights.width) * static_cast<std::uint64_t>(heights.height));
    }
  ASSERT_GT(texels, 0u);
  capture.max_bytes = capture.charged_bytes + 24 * texels;
  EXPECT_THROW(draw(capture), LimitError);
  capture.max_bytes = capture.charged_bytes + (256u << 20);
  EXPECT_NO_THROW(draw(capture));
}

TEST(FrameMemory, TileListsThatSpillAreRefusedToo) {
  scene::Capture capture = crowd();
  GpuConfiguration gpu;
  gpu.parameter_buffer.bytes = 64 << 10;
  gpu.parameter_buffer.full_policy = binner::FullPolicy::kSpill;
  gpu.binner.queue_levels = 1;
  const FrameResult free = draw(capture, gpu);
  ASSERT_GT(free.counters.binner.spilled_bytes, 0u);
  capture.max_bytes = sub_patch_bytes(free) + free.counters.binner.queue_bytes_peak / 2;
  EXPECT_THROW(draw(capture, gpu), LimitError);
}

}  // namespace
}  // namespace tessera::gpu::frame_memory_test
