// What the front end expects of splits by cost, against what the machine then did, and against splits by size.
#include "gpu/device.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"

namespace tessera::gpu::split_cost_test {
namespace {

FrameResult split_as(const char* capture, const std::vector<std::string>& settings) {
  const scene::Capture read = scene::read_capture(test::shipped_capture(capture));
  RunSettings run;
  GpuConfiguration gpu;
  for (const std::string& setting : settings) apply_setting(setting, run, gpu);
  Device device(read, gpu, run, {320, 180, {0, 0, 320, 180}});
  return device.render(5);
}

double ratio(std::uint64_t estimate, double measured) { return static_cast<double>(estimate) / measured; }

constexpr const char* kByCost = "frontend.split_criterion=cost";

class SplitEstimates : public testing::TestWithParam<const char*> {};

TEST_P(SplitEstimates, AreNearWhatIsMeasured) {
  const FrameCounters c = split_as(GetParam(), {kByCost}).counters;
  const auto entries = static_cast<double>(c.binner.entries);
  EXPECT_NEAR(ratio(c.frontend.estimated_entries, entries), 1, 0.12);
  // Hidden entries build nothing; the estimate does not know them.
  const double seen = 1 - static_cast<double>(c.tilecore.culled_occlusion) / entries;
  EXPECT_NEAR(ratio(c.frontend.estimated_boxes, static_cast<double>(c.tilecore.boxes_built) / seen), 1, 0.12);
  // The bounding rectangle is farther off.
  const FrameCounters rectangles = split_as(GetParam(), {kByCost, "binner.coverage=rectangle"}).counters;
  EXPECT_GT(rectangles.frontend.estimated_entries, c.frontend.estimated_entries);
}
INSTANTIATE_TEST_SUITE_P(Captures, SplitEstimates, testing::Values("eggs", "vases", "serpent", "flyby"));

TEST(SplitByCost, TakesNoMoreCyclesThanAnySizeOverTheCaptures) {
  const auto cycles = [](const std::vector<std::string>& settings) {
    double sum = 0;
    for (const char* capture : {"eggs", "vases", "flyby"}) sum += split_as(capture, settings).model->timing.cycles;
    return sum;
  };
  // Coarse tessellation leaves splits to the criterion.
  const std::string coarse = "tessellation.target_edge_pixels=6";
  const double by_cost = cycles({coarse, kByCost});
  for (const char* pixels : {"16", "32", "64", "128", "256"})
    EXPECT_LE(by_cost, 1.005 * cycles({coarse, std::string("frontend.split_pixels=") + pixels})) << pixels;
  EXPECT_LE(by_cost, 1.005 * cycles({coarse, "frontend.split_depth=0"}));
}

}  // namespace
}  // namespace tessera::gpu::split_cost_test
