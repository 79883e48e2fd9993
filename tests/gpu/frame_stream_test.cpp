// Several frames at once are the frames one after the other.
#include <atomic>

#include "base/error.h"
#include "gpu/counter_list.h"
#include "gpu/frame_stream.h"
#include "gpu/settings.h"
#include "tests/support/tests.h"

namespace tessera::gpu::frame_stream_test {
namespace {

scene::Capture turning_sphere() {
  scene::Capture capture;
  scene::Material bumpy;
  bumpy.displacement = test::displacement(2, 2, {0, 1, 1, 0}, 0.3f, 0);
  const int node = test::add_node(capture, test::closed_patches(test::add_material(capture, bumpy)));
  test::add_turn(capture, node, {0, 1, 0}, 2);
  test::add_camera(capture, {0, 0, 5});
  capture.settings.frame_rate = 10;
  return capture;
}

struct Devices {
  std::vector<std::unique_ptr<Device>> owned;
  std::vector<Device*> all;
  Devices(const scene::Capture& capture, std::size_t count, const GpuConfiguration& gpu = {}) {
    const auto prepared = std::make_shared<const PreparedCapture>(capture);
    for (std::size_t k = 0; k < count; ++k) {
      owned.push_back(std::make_unique<Device>(prepared, gpu, RunSettings{}, RenderRequest{90, 70, {0, 0, 90, 70}}));
      all.push_back(owned.back().get());
    }
  }
};

void expect_same(const FrameResult& a, const FrameResult& b) {
  EXPECT_EQ(a.frame, b.frame);
  EXPECT_EQ(a.targets.color.values, b.targets.color.values) << a.frame;
  EXPECT_EQ(counter_values(a.counters), counter_values(b.counters)) << a.frame;
}

TEST(FrameStream, FS1FramesEqualOneDevices) {
  const scene::Capture capture = turning_sphere();
  for (const std::size_t devices : {1u, 2u, 3u})
    for (const int count : {1, 2, 7}) {
      Devices one(capture, 1), several(capture, devices);
      FrameStream stream(several.all, 3, 3 + count);
      for (int frame = 3; frame < 3 + count; ++frame) expect_same(stream.next(), one.all[0]->render(frame));
    }
}

// Counts the frames that a device began to hand over.
class Counting final : public ViewObserver {
 public:
  void view_rendered(const RenderedView&) override { ++frames; }
  std::atomic<int> frames = 0;
};

TEST(FrameStream, FS2ADeviceRendersOneFrameAheadAndEndsBeforeTheLast) {
  const scene::Capture capture = turning_sphere();
  for (int taken = 0; taken < 4; ++taken) {
    Devices devices(capture, 2);
    std::array<Counting, 2> counting;
    for (std::size_t k = 0; k < 2; ++k) devices.all[k]->set_observer(&counting[k]);
    {
      FrameStream stream(devices.all, 0, 1000);
      for (int frame = 0; frame < taken; ++frame) EXPECT_EQ(stream.next().frame, frame);
      // Time in which a device that did not wait would render many.
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    EXPECT_LE(counting[0].frames, (taken + 1) / 2 + 1);
    EXPECT_LE(counting[1].frames, taken / 2 + 1);
  }
}

// Finds by bisection a memory limit that is enough for one frame and not for two.
TEST(FrameStream, FS3FramesThatNeedAllOfTheMemoryGetIt) {
  scene::Capture capture = turning_sphere();
  const auto fits = [&](std::uint64_t bytes) {
    capture.max_bytes = bytes;
    Devices devices(capture, 1);
    try {
      for (int frame = 0; frame < 4; ++frame) devices.all[0]->render(frame);
    } catch (const LimitError&) {
      return false;
    }
    return true;
  };
  std::uint64_t low = 0, high = std::uint64_t{1} << 32;
  while (high - low > 1) (fits((low + high) / 2) ? high : low) = (low + high) / 2;
  ASSERT_GT(low, 1000u);
  for (const std::uint64_t bytes : {high, high + high / 2, 2 * high, 3 * high}) {
    capture.max_bytes = bytes;
    Devices one(capture, 1), two(capture, 2);
    FrameStream stream(two.all, 0, 4);
    for (int frame = 0; frame < 4; ++frame) expect_same(stream.next(), one.all[0]->render(frame));
  }
  capture.max_bytes = low;
  Devices two(capture, 2);
  FrameStream stream(two.all, 0, 4);
  EXPECT_THROW(
      {
        for (int frame = 0; frame < 4; ++frame) stream.next();
      },
      LimitError);
}

TEST(FrameStream, FramesThatDependOnEachOtherAreTold) {
  scene::Capture capture;
  RunSettings plain, adaptive;
  adaptive.resolve.desampling = tilecore::Desampling::kAdaptive;
  GpuConfiguration gpu, guessing;
  guessing.frontend.previous_depth_culling = true;
  RenderRequest logged;
  logged.keep_transactions = true;
  EXPECT_TRUE(frames_are_independent(capture, gpu, plain, {}));
  EXPECT_FALSE(frames_are_independent(capture, gpu, adaptive, {}));
  EXPECT_FALSE(frames_are_independent(capture, guessing, plain, {}));
  EXPECT_FALSE(frames_are_independent(capture, gpu, plain, logged));
  GpuConfiguration unwritten, unrendered;
  unwritten.frame_buffer.transaction_elimination = true;
  unrendered.tile.rendering_elimination = true;
  EXPECT_FALSE(frames_are_independent(capture, unwritten, plain, {}));
  EXPECT_FALSE(frames_are_independent(capture, unrendered, plain, {}));
  scene::Pass loads;
  loads.load = {{"frame", scene::LoadAction::kLoad}};
  capture.settings.graph = scene::PassGraph{{}, {loads}};
  EXPECT_FALSE(frames_are_independent(capture, gpu, plain, {}));
}

}  // namespace
}  // namespace tessera::gpu::frame_stream_test
