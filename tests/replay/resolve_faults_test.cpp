// Scenes that desampling once got wrong, against full shading as a display shows it.
#include "replay/statistics.h"
#include "scene/capture_reader.h"
#include "tests/replay/desampled_comparison.h"
#include "tests/support/fault_scenes.h"
#include "tests/support/tests.h"

namespace tessera::replay::resolve_faults_test {
namespace {

using scene::Capture;

constexpr int kWidth = DesampledComparison::kWidth, kHeight = DesampledComparison::kHeight;

// ---- Blocks at rest ----------------------------------------------------------------------------------------------

TEST(ResolveFaults, NormalsThatMorphAreShadedAnew) {  // MF3
  const DesampledComparison c(test::turning_normals(), 3, 8);
  EXPECT_GE(c.worst_psnr(0), 50);
  EXPECT_EQ(c.back().counters.pixels_advected, 0u);
}

// One of two walls changes its colour: the other goes on as it was.
TEST(ResolveFaults, MaterialsThatChangeAreShadedAnewAndTheirNeighboursAreNot) {  // MF3
  const Capture capture = test::changing_colour();
  const DesampledComparison c(capture, 3, 8);
  EXPECT_GE(c.worst_psnr(0), 50);
  const double share = static_cast<double>(c.back().counters.pixels_advected) / (kWidth * kHeight);
  EXPECT_GT(share, 0.35);  // 12 of 16 pixels of half of the frame
  EXPECT_LT(share, 0.4);
}

// ---- Cuts and stops ---------------------------------------------------------------------------------------------

TEST(ResolveFaults, ACutAndTheFrameAfterItAreShadedFully) {  // RU7
  const Capture capture = test::walk_with_a_cut();
  const DesampledComparison c(capture, 27, 33);
  EXPECT_GE(c.worst_psnr(0), 50);
  // The failing twin: a fast block may be coarse although it was not followed and its contrast is unknown.
  EXPECT_LT(DesampledComparison(capture, 27, 33, {"resolve.cut_speed=0", "resolve.pattern_error=0"}).worst_psnr(0), 40);
}

// A textured board crosses the frame at 12 pixels a frame, and stands still from one frame to the next.
TEST(ResolveFaults, AStoppedSurfaceDoesNotKeepReconstructedColors) {  // RU7
  const Capture capture = test::board_that_stops();
  const std::vector<std::string> coarse = {"resolve.pattern_error=0.02"};
  for (const std::vector<std::string>& sets : {std::vector<std::string>{}, coarse}) {
    const DesampledComparison c(capture, 6, 15, sets);
    EXPECT_GT(c.frames[3].counters.blocks_rate_4, sets.empty() ? 200u : 500u);
    EXPECT_GE(c.worst_psnr(5), 50);
    EXPECT_GT(c.back().saved, 0.4);
  }
}

// Two rockets of `flyby` come across half of the frame and are sharp in the next one: a sharp surface shows its
// pattern, however far it came.
TEST(ResolveFaults, SharpSurfacesAreNotCoarseHoweverFarTheyCame) {
  const DesampledComparison c(scene::read_capture(test::shipped_capture("flyby")), 0, 6);
  EXPECT_GE(c.worst_psnr(0), 50);
  EXPECT_GE(c.saved(1), 0.30);
}

// ---- One surface before itself, and creases ---------------------------------------------------------------------

// A bowl of brass whose lip hides its inside, slowly turned.
TEST(ResolveFaults, UncoveredPartsOfASurfaceDoNotTakeItsNearColors) {  // ADV4
  const Capture capture = test::bowl_of_brass();
  const DesampledComparison c(capture, 3, 12);
  EXPECT_GT(c.saved(1), 0.25);
  double worst = 0;
  for (const DesampledComparison::Frame& frame : c.frames)
    worst = std::max(worst, max_difference(frame.shown, frame.expected));
  EXPECT_LE(worst, 0.05);
}

// A box whose faces a light tells apart, crossing the frame at rates that reconstruct.
TEST(ResolveFaults, CreasesAreEdges) {
  const Capture capture = test::box_with_creases();
  const IntRect crop{208, 88, 432, 272};
  const DesampledComparison c(capture, 3, 8, {}, crop);
  EXPECT_GE(c.worst_psnr(0), 53);
  EXPECT_GT(c.back().counters.blocks_edge, 50u);
  EXPECT_GT(c.saved(1), 0.2);
  EXPECT_LT(DesampledComparison(capture, 3, 8, {"resolve.edge_angle=0", "resolve.pattern_error=0"}, crop).worst_psnr(0),
            53);  // the failing twin
}

// ---- Lights -----------------------------------------------------------------------------------------------------

TEST(ResolveFaults, ALightThatMovesIsShadedWhereItReaches) {  // LR1
  const Capture capture = test::moving_torch();
  const DesampledComparison c(capture, 3, 9);
  EXPECT_GE(c.saved(1), 0.40);
  EXPECT_GE(c.worst_psnr(1), 42);
  EXPECT_EQ(c.back().advection, "blocks slower than resolve.reuse_speed, out of reach of the lights that changed");
  EXPECT_GT(c.back().counters.light_tests, 0u);
}

}  // namespace
}  // namespace tessera::replay::resolve_faults_test
