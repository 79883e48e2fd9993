// What the front end expects of splits by cost, against what the machine then did, and against splits by size.
#include "frontend/front_end.h"
#include "gpu/device.h"
#include "gpu/view_observer.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"

namespace tessera::gpu::split_cost_test {
namespace {

// Sums estimates of the sub-patches that the front end sends to the binner.
class Estimates final : public ViewObserver {
 public:
  void view_rendered(const RenderedView& view) override {
    const scene::FrameGeometry& frame = *view.job.frame;
    const frontend::FrontEndSpec spec = view.gpu.front_end_spec();
    const frontend::SplitCost prices(spec.prices);
    for (const frontend::BoundedSubPatch& piece : frontend::run_front_end(frame, view.pyramids, spec).sub_patches) {
      const frontend::CostEstimate one = prices.cost(
          frontend::screen_shape(piece.corners(frame), piece.bounds, frame.request.width, frame.request.height),
          (piece.range.i1 - piece.range.i0) * (piece.range.j1 - piece.range.j0),
          (piece.effects & frontend::kEffectMotion) != 0);
      entries += one.entries;
      boxes += one.boxes;
    }
  }
  double entries = 0, boxes = 0;
};

FrameResult split_as(const char* capture, const std::vector<std::string>& settings, Estimates* estimates = nullptr) {
  const scene::Capture read = scene::read_capture(test::shipped_capture(capture));
  RunSettings run;
  GpuConfiguration gpu;
  for (const std::string& setting : settings) apply_setting(setting, run, gpu);
  Device device(read, gpu, run, {320, 180, {0, 0, 320, 180}});
  device.set_observer(estimates);
  return device.render(5);
}

constexpr const char* kByCost = "frontend.split_criterion=cost";

class SplitEstimates : public testing::TestWithParam<const char*> {};

TEST_P(SplitEstimates, AreNearWhatIsMeasured) {
  Estimates exact, rectangles;
  const FrameCounters c = split_as(GetParam(), {kByCost}, &exact).counters;
  const auto entries = static_cast<double>(c.binner.entries);
  EXPECT_NEAR(exact.entries / entries, 1, 0.12);
  // Hidden entries build nothing; the estimate does not know them.
  const double seen = 1 - static_cast<double>(c.tilecore.culled_occlusion) / entries;
  EXPECT_NEAR(exact.boxes * seen / static_cast<double>(c.tilecore.boxes_built), 1, 0.12);
  // The bounding rectangle is farther off.
  split_as(GetParam(), {kByCost, "binner.coverage=rectangle"}, &rectangles);
  EXPECT_GT(rectangles.entries, exact.entries);
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
