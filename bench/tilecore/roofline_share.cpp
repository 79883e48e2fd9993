// Measures the share of the roofline (bench/support/roofline.h) that the ray path reaches in a whole frame.
//
//   tessera_roofline_share OUT_FOLDER [ROUNDS]  writes roofline_share.csv
//   tessera_roofline_share --check              a small image: checks that the clock changes nothing and that the shares are
//                                               above their lower limits
//
// Scene: bench/support/posed_scene.h at 1280x720, pinhole, triangles of 1 pixel^2, 32 pixels of blur; one thread.
// Every round renders the frame with the normal kernels and with the same source compiled with a clock, and measures
// the roofline. The cost of reading the clock is the difference of the two frames over the number of readings; it is
// subtracted from each stage. Figures are medians over the rounds.
//
// Boxes: survivors of a leaf's box against the boxes of its cells, the list of pairs included. Triangles: from the list
// to the decision, fetching corners and samples included. Hits: attributes, and the way to the visibility buffer.
#include <algorithm>
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/parallel.h"
#include "base/simd_targets.h"
#include "bench/support/posed_scene.h"
#include "bench/support/program.h"
#include "bench/support/roofline.h"
#include "bench/support/stage_clock.h"
#include "bench/support/timing.h"
#include "tilecore/visibility/sample_tests.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/tilecore/roofline_share.cpp"
#include <hwy/foreach_target.h>

#include "tilecore/visibility/ray-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

VisibilityKernels ClockedMotionKernels() { return kernels_with<true, false, bench::StageClock>(); }

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {
namespace {

HWY_EXPORT(ClockedMotionKernels);

VisibilityKernels clocked_motion_kernels() { return HWY_DYNAMIC_DISPATCH(ClockedMotionKernels)(); }

}  // namespace
}  // namespace tessera::tilecore

namespace tessera::bench {
namespace {

using tilecore::RayStage;

constexpr std::array<const char*, tilecore::kRayStages> kStageNames = {"classes", "boxes", "triangles", "hits", "rest"};

struct StageFigures {
  std::uint64_t tests = 0;
  std::vector<double> seconds;
  double rate() const { return static_cast<double>(tests) / median(seconds); }
};

struct Shares {
  std::array<StageFigures, tilecore::kRayStages> stages;
  std::vector<double> boxes, linear, perspective;  // rates of the roofline
  std::vector<double> tiles;                       // seconds of the tile cores without the clock
  bool same = true;                                // both frames have equal counts

  const StageFigures& stage(RayStage s) const { return stages[static_cast<std::size_t>(s)]; }
  double share(RayStage s, const std::vector<double>& ceiling) const { return stage(s).rate() / median(ceiling); }
};

bool same_counts(const tilecore::TileCoreCounters& a, const tilecore::TileCoreCounters& b) {
  return a.box_tests == b.box_tests && a.triangle_tests == b.triangle_tests && a.sample_hits == b.sample_hits;
}

Shares measure(PosedScene& scene, int rounds, double ceiling_seconds) {
  const tilecore::VisibilityKernels clocked = tilecore::clocked_motion_kernels();
  const auto run = [&](const tilecore::VisibilityKernels* kernels) {
    return scene.machine.run(*scene.frame, scene.pyramids, false, true, kernels);
  };
  run(nullptr);  // renders once before, so that both ways find the meshes tessellated
  Shares out;
  for (int round = 0; round < rounds; ++round) {
    const auto plain = run(nullptr);
    StageClock::take();
    const double start = now();
    const std::uint64_t start_ticks = ticks();
    const auto timed = run(&clocked);
    const double seconds_per_tick = (now() - start) / static_cast<double>(ticks() - start_ticks);
    const StageClock::Totals totals = StageClock::take();
    out.same = out.same && same_counts(plain.counters, timed.counters);
    out.tiles.push_back(plain.stages.tile_seconds);
    std::uint64_t enters = 0;
    for (const StageTotals& stage : totals) enters += stage.enters;
    const double look =
        std::max(timed.stages.tile_seconds - plain.stages.tile_seconds, 0.0) / static_cast<double>(enters);
    for (std::size_t s = 0; s < totals.size(); ++s) {
      out.stages[s].tests = totals[s].tests;
      out.stages[s].seconds.push_back(static_cast<double>(totals[s].ticks) * seconds_per_tick -
                                      static_cast<double>(totals[s].enters) * look);
    }
    out.boxes.push_back(roofline(RooflineTest::kBoxes, ceiling_seconds));
    out.linear.push_back(roofline(RooflineTest::kLinearTriangles, ceiling_seconds));
    out.perspective.push_back(roofline(RooflineTest::kPerspectiveTriangles, ceiling_seconds));
  }
  return out;
}

// The two best targets, which current machines have.
std::vector<std::string> wide_targets() {
  std::vector<std::string> targets = simd_target_names();
  targets.resize(std::min<std::size_t>(targets.size(), 2));
  return targets;
}

std::string rows(const std::string& target, const Shares& s) {
  std::string out;
  const auto row = [&](RayStage stage, const std::string& against, const std::vector<double>* ceiling) {
    const StageFigures& f = s.stage(stage);
    out += fmt::format("{},{},{},{:.1f},{:.1f}", target, kStageNames[static_cast<std::size_t>(stage)], against,
                       1e-6 * static_cast<double>(f.tests), 1e3 * median(f.seconds));
    out += f.tests == 0 ? "," : fmt::format(",{:.2f}", 1e-9 * f.rate());
    out += ceiling == nullptr
               ? ",,\n"
               : fmt::format(",{:.2f},{:.1f}\n", 1e-9 * median(*ceiling), 100 * s.share(stage, *ceiling));
  };
  row(RayStage::kClasses, "", nullptr);
  row(RayStage::kBoxes, "moving boxes", &s.boxes);
  row(RayStage::kTriangles, "perspective", &s.perspective);
  row(RayStage::kTriangles, "linear", &s.linear);
  row(RayStage::kHits, "", nullptr);
  out += fmt::format("{},tile cores,,,{:.1f},,,\n", target, 1e3 * median(s.tiles));
  return out;
}

void measure_all(const std::filesystem::path& folder, int rounds) {
  PosedScene scene(1280, 720, {1, 32, false, 4});
  std::string table = "target,stage,ceiling,million_tests,ms,billion_per_second,roofline,percent\n";
  for (const std::string& target : wide_targets()) {
    force_simd_target(target);
    table += rows(target, measure(scene, rounds, 0.05));
  }
  force_simd_target("");
  fmt::print("{}", table);
  write_file_atomically(folder / "roofline_share.csv", table);
}

bool check() {
  Laws laws;
  PosedScene scene(640, 360, {1, 32, false, 4});
  for (const std::string& target : wide_targets()) {
    force_simd_target(target);
    const Shares s = measure(scene, 5, 0.02);
    fmt::print("{}", rows(target, s));
    laws.expect(target + ": the clock changes no count", s.same);
    laws.expect(target + ": boxes and triangles are tested",
                s.stage(RayStage::kBoxes).tests > 0 && s.stage(RayStage::kTriangles).tests > 0);
    // The limits are half of the shares on a machine whose processors did other work as well.
    laws.expect(target + ": boxes reach a tenth of the roofline", s.share(RayStage::kBoxes, s.boxes) > 0.1);
    laws.expect(target + ": triangles reach a twentieth", s.share(RayStage::kTriangles, s.perspective) > 0.05);
  }
  force_simd_target("");
  return laws.all_hold();
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  const tessera::ThreadLimit limit(1);
  return tessera::bench::run_program({"tessera_roofline_share", 5, tessera::bench::measure_all, tessera::bench::check},
                                     argc, argv);
}
#endif
