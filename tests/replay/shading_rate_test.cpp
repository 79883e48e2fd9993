// Shading through the cache in whole frames of shipped captures: same image on every machine, at a cost that blur
// leaves alone.
#include "base/simd_targets.h"
#include "gpu/device.h"
#include "replay/statistics.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"

namespace tessera::replay::shading_rate_test {
namespace {

struct Machine {
  std::int64_t tile = 32, entries = 1024;
  std::size_t threads = 0;
  bool plainest_simd = false;
  tilecore::ShadingRate rate = tilecore::ShadingRate::kCache;
};

gpu::FrameResult render(const scene::Capture& capture, const Machine& machine, int frame, int width = 240,
                        int height = 135) {
  const ThreadLimit threads(machine.threads);
  force_simd_target(machine.plainest_simd ? simd_target_names().back() : "");
  gpu::GpuConfiguration gpu;
  gpu.tile.width = gpu.tile.height = machine.tile;
  gpu.shading_cache.entries = machine.entries;
  gpu::RunSettings settings;
  settings.shading.rate = machine.rate;
  gpu::Device renderer(capture, gpu, settings, {width, height, {0, 0, width, height}, true});
  gpu::FrameResult result = renderer.render(frame);
  force_simd_target("");
  return result;
}

TEST(ShadingRate, TheImageFromTheCacheIsTheSameOnEveryMachine) {
  for (const auto& [name, frame] : {std::pair{"eggs", 14}, std::pair{"serpent", 12}, std::pair{"flyby", 0}}) {
    const scene::Capture capture = scene::read_capture(test::shipped_capture(name));
    const gpu::FrameResult expected = render(capture, {}, frame);
    for (const Machine& machine : {Machine{.tile = 16, .entries = 1}, Machine{.tile = 16, .entries = 16},
                                   Machine{.tile = 64, .entries = 1000000},
                                   Machine{.threads = 1, .plainest_simd = true}, Machine{.tile = 64, .threads = 3}}) {
      const gpu::FrameResult r = render(capture, machine, frame);
      EXPECT_EQ(r.targets.color.values, expected.targets.color.values)
          << name << ", tiles of " << machine.tile << ", " << machine.entries << " entries";
      EXPECT_EQ(r.targets.normal.values, expected.targets.normal.values) << name;
      EXPECT_EQ(r.counters.shading.samples_visible, expected.counters.shading.samples_visible) << name;
    }
    EXPECT_NE(render(capture, {.rate = tilecore::ShadingRate::kPixel}, frame).targets.color.values,
              expected.targets.color.values);
  }
}

TEST(ShadingRate, CountersOfTheCacheAreTheSameForAnyThreadsAndInstructionSet) {
  const scene::Capture capture = scene::read_capture(test::shipped_capture("eggs"));
  const nlohmann::json expected = counters_json(render(capture, {.entries = 200}, 14).counters);
  for (const Machine& machine : {Machine{.entries = 200, .threads = 1, .plainest_simd = true},
                                 Machine{.entries = 200, .threads = 4}, Machine{.entries = 200, .threads = 2}})
    EXPECT_EQ(counters_json(render(capture, machine, 14).counters), expected) << machine.threads;
}

TEST(ShadingRate, LargeTilesAndRoomSaveRunsOfThePixelShader) {
  const scene::Capture capture = scene::read_capture(test::shipped_capture("eggs"));
  const auto runs = [&](const Machine& machine) {
    return render(capture, machine, 14).counters.shading.pixel_shader_invocations;
  };
  const std::uint64_t apart = runs({});
  EXPECT_LT(runs({.tile = 256, .entries = 1000000}), apart);
  EXPECT_GT(runs({.entries = 16}), apart);
}

TEST(ShadingRate, LongerShuttersCostLittleMoreThroughTheCacheAndMuchMorePerPixel) {
  scene::Capture capture = scene::read_capture(test::shipped_capture("serpent"));
  const auto runs = [&](tilecore::ShadingRate rate, double shutter) {
    capture.settings.shutter_close = shutter;
    return static_cast<double>(render(capture, {.rate = rate}, 12, 640, 360).counters.shading.pixel_shader_invocations);
  };
  EXPECT_LT(runs(tilecore::ShadingRate::kCache, 1) / runs(tilecore::ShadingRate::kCache, 0), 1.15);
  EXPECT_GT(runs(tilecore::ShadingRate::kPixel, 1) / runs(tilecore::ShadingRate::kPixel, 0), 1.3);
}

}  // namespace
}  // namespace tessera::replay::shading_rate_test
