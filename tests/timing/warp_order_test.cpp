// Which warps of a tile wait for which, simulated item by item on a machine whose time is known by hand.
#include "tests/support/coarse_machine.h"
#include "tests/support/tests.h"
#include "timing/events/event_model.h"

namespace tessera::timing::warp_order_test {
namespace {

// Places wait for vertices, tests of lights for places, pixels for both; a warp that reads memory shows who waits for it.
TEST(WarpOrder, PixelsWaitForTheLightsOfTheirTile) {
  auto gpu = test::endless_machine();
  gpu.shader.operations = 100, gpu.shader.surface_operations = 40;
  gpu.shader.lanes = 32;
  gpu.set_latency_clk(300);
  constexpr double kLight = hardware::PixelShader::kLightOperations;
  const auto cycles = [&](std::uint32_t reads, std::array<std::uint32_t, 4> kinds) {
    FrameWork work;
    work.rounds.push_back({{}, {TileWork{}}, {TileItems{}}});
    TileItems& items = work.rounds[0].items[0];
    for (const std::uint32_t kind : kinds) items.warps.push_back({.lanes = 32, .kind = kind});
    items.warps[reads].texels = 32, items.warps[reads].texel_lines = 1;
    items.texel_lines = {7};
    return simulate_events(gpu, work).schedule.cycles;
  };
  constexpr auto kVertices = WarpItem::kVertices, kPlaces = WarpItem::kPlaces, kTests = WarpItem::kLightTests,
                 kPixels = WarpItem::kPixels;
  for (const std::uint32_t reads : {0, 1, 2})
    EXPECT_DOUBLE_EQ(cycles(reads, {kVertices, kPlaces, kTests, kPixels}), 40 + 2 * kLight + 100 + 300) << reads;
  // The twin: the first warp in the order waits for no warp that is packed before it.
  EXPECT_DOUBLE_EQ(cycles(0, {kTests, kPlaces, kPlaces, kVertices}), kLight + 300);
}

}  // namespace
}  // namespace tessera::timing::warp_order_test
