// Cells of the history (tilecore/resolve/resolve_memory.cpp): tiles of any thread write theirs into one array, which has
// its room before the first tile.
#include "base/parallel.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "tests/support/tests.h"

namespace tessera::gpu::history_cells_test {
namespace {

constexpr int kWidth = 96, kHeight = 64;

// Cells that the first and the second frame of a new device leave.
std::array<std::vector<std::uint16_t>, 2> cells_of(const std::shared_ptr<const PreparedCapture>& capture,
                                                   std::size_t threads) {
  RunSettings settings;
  GpuConfiguration gpu;
  for (const char* key : {"resolve.desampling=adaptive", "tile.width=16", "tile.height=16"})
    apply_setting(key, settings, gpu);
  const ThreadLimit limit(threads);
  Device device(capture, gpu, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}});
  std::array<std::vector<std::uint16_t>, 2> cells;
  for (int frame = 0; frame < 2; ++frame) {
    device.render(frame);
    cells[static_cast<std::size_t>(frame)] = device.history().cells;
  }
  return cells;
}

TEST(HistoryCells, DoNotDependOnThreads) {
  const scene::Capture walk = scene::read_capture(test::shipped_capture("stroll"));
  const auto capture = std::make_shared<const PreparedCapture>(walk);
  const auto alone = cells_of(capture, 1);
  ASSERT_FALSE(alone[0].empty());
  EXPECT_GT(*std::max_element(alone[0].begin(), alone[0].end()), 0u);
  // The twin: cells of another frame are others.
  EXPECT_NE(alone[0], alone[1]);
  for (int device = 0; device < 20; ++device) ASSERT_EQ(cells_of(capture, 8), alone) << device;
}

}  // namespace
}  // namespace tessera::gpu::history_cells_test
