// The way that is chosen for a mesh takes about as little time of the described machine as the best one forced.
#include "tilecore/visibility/method_choice.h"
#include "tests/support/machine_visibility.h"
#include "tests/support/tests.h"

namespace tessera::tilecore::method_choice_test {
namespace {

constexpr int kWidth = 320, kHeight = 192;

struct Motion {
  const char* name;
  double way;   // scene units, of about 60 pixels
  float angle;  // radians
  float aperture;
};

scene::Capture blobs(const Motion& motion) {
  scene::Capture capture;
  test::Random random(11);
  for (int k = 0; k < 12; ++k) {
    const int node =
        test::add_node(capture, test::closed_patches(test::add_material(capture)),
                       DVec3(random.uniform(-2.5f, 2.5f), random.uniform(-1.5f, 1.5f), random.uniform(-1, 1)));
    capture.nodes[static_cast<std::size_t>(node)].transform.scale = DVec3(0.4);
    const Vec3 way = random.in_box(1);
    if (motion.way > 0) test::add_motion(capture, node, DVec3(way.x, way.y, 0) * motion.way);
    if (motion.angle != 0) test::add_turn(capture, node, random.in_box(1), motion.angle);
  }
  scene::Camera camera;
  camera.lens = {motion.aperture, 5.0f};
  test::add_camera(capture, {0, 0, 5}, camera);
  return capture;
}

// Clocks of a core by its default rates: 16 tests, or one box built.
double time_of(const Motion& motion, VisibilityMethod method, Traversal traversal) {
  const scene::Capture capture = blobs(motion);
  const scene::Assembly assembly = scene::assemble(capture);
  const frontend::PyramidLibrary pyramids(assembly);
  scene::FrameRequest request;
  request.width = kWidth, request.height = kHeight;
  request.open_time = 0, request.close_time = 1;
  request.tessellation.target_edge_pixels = 2;
  const auto frame = scene::pose_frame(assembly, scene::choose_camera(capture, kWidth, kHeight), request);
  gpu::GpuConfiguration gpu;
  gpu.tilecore.visibility.method = method;
  gpu.tilecore.visibility.traversal = traversal;
  const SamplePattern pattern({4, 1, 0});
  const binner::TileGrid grid(kWidth, kHeight, gpu.tile.width, gpu.tile.height);
  test::MachineVisibility machine(gpu, pattern, grid);
  const TileCoreCounters counters = machine.run(*frame, pyramids, false, true).counters;
  EXPECT_GT(counters.sample_hits, 10'000u);
  return static_cast<double>(counters.boxes_built) +
         static_cast<double>(counters.box_tests + 2 * counters.triangle_tests) / 16;
}

TEST(MethodChoice, TakesAboutAsLittleTimeAsTheBestWay) {
  for (const Motion& motion : {Motion{"short way", 0.3, 0, 0}, Motion{"far way", 3, 0, 0}, Motion{"turn", 0, 1.5f, 0},
                               Motion{"far way and turn", 2, 2.5f, 0}, Motion{"far way, lens", 2, 0, 0.05f},
                               Motion{"turn, lens", 0, 1.5f, 0.2f}}) {
    const double by_class = time_of(motion, VisibilityMethod::kPatchBvh, Traversal::kClass),
                 by_ray = time_of(motion, VisibilityMethod::kPatchBvh, Traversal::kRay),
                 chosen = time_of(motion, VisibilityMethod::kPatchBvh, Traversal::kAuto);
    RecordProperty(motion.name, std::to_string(chosen / std::min(by_class, by_ray)));
    EXPECT_LT(chosen, 1.2 * std::min(by_class, by_ray))
        << motion.name << ": " << by_class << " by class, " << by_ray << " by ray";
  }
}

// A mesh that turns on its place, whose boxes in the rest frame are wide.
TestCosts turning_mesh() {
  TestCosts costs;
  costs.cells = 64, costs.leaves = 4;
  costs.width = costs.height = 60;
  costs.by_class = 400'000, costs.by_ray = 100'000, costs.brute = 1'000'000;
  costs.ray_visits = 20;
  return costs;
}

TEST(MethodChoice, BoxesAreBuiltInEveryTile) {
  const VisibilityMethodSettings open;
  const RayEffects motion{true, false};
  TestCosts costs = turning_mesh();
  EXPECT_EQ(settled(open, costs, motion, {4, 0}).traversal, Traversal::kRay);
  costs.way_x = 200'000;
  EXPECT_EQ(settled(open, costs, motion, {4, 0}).traversal, Traversal::kClass);
  EXPECT_EQ(settled(open, costs, motion, {4000, 0}).traversal, Traversal::kRay) << "more samples";
}

// Under motion the frustum of a few pixels meets nodes that no sample of theirs does.
TEST(MethodChoice, UnderMotionFrustaMeetMoreNodesThanRays) {
  TestCosts costs = turning_mesh();
  costs.bundles = 10'000'000;
  EXPECT_EQ(settled({}, costs, {true, false}, {4, 0}).traversal, Traversal::kClass);
}

TEST(MethodChoice, RaysThroughALensMissMore) {
  const VisibilityMethodSettings open;
  TestCosts costs = turning_mesh();
  EXPECT_EQ(settled(open, costs, {true, true}, {4, 10}).traversal, Traversal::kRay) << "in focus";
  costs.lens_factor = 10;
  EXPECT_EQ(settled(open, costs, {true, true}, {4, 10}).traversal, Traversal::kClass);
}

TEST(MethodChoice, ARequestedTraversalStays) {
  VisibilityMethodSettings rays;
  rays.traversal = Traversal::kRay;
  TestCosts costs = turning_mesh();
  costs.by_class = 0;
  EXPECT_EQ(settled(rays, costs, {true, false}, {4, 0}).traversal, Traversal::kRay);
}

}  // namespace
}  // namespace tessera::tilecore::method_choice_test
