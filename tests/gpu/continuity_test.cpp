// A small change of camera, time or threshold is a small change of the image. Images are compared step by step
// along a way of small steps: where something pops, one step changes more than the others.
#include "gpu/device.h"
#include "tests/support/tests.h"

namespace tessera::gpu::continuity_test {
namespace {

using scene::Capture;

constexpr int kWidth = 96, kHeight = 64;

// A displaced ball in front of a displaced floor, lit by the environment; something behind it moves.
Capture scene() {
  Capture capture;
  scene::Material material;
  std::vector<float> heights(256);
  for (std::size_t i = 0; i < heights.size(); ++i)
    heights[i] = std::sin(static_cast<float>(i % 16) * 0.3927f) * std::cos(static_cast<float>(i / 16) * 0.3927f);
  material.displacement = test::displacement(16, 16, heights, 0.06f, 0.0f);
  const int m = test::add_material(capture, material);
  test::add_node(capture, test::closed_patches(m), DVec3(0, 0, 0));
  test::add_node(capture, test::patches(test::flat_patch({-4, -1.2f, 3}, {8, 0, 0}, {0, 0.6f, -8}), m));
  const int mover = test::add_node(capture, test::closed_patches(m), DVec3(-2.5, 0.8, -3));
  test::add_motion(capture, mover, DVec3(3, 0, 0));
  capture.settings.frame_rate = 24;
  test::add_camera(capture, DVec3(0.2, 0.3, 4));
  capture.settings.background = Vec3(0.05f, 0.1f, 0.3f);
  return capture;
}

Image render(const Capture& capture, const RunSettings& settings, const gpu::GpuConfiguration& gpu = {},
             int frame = 0) {
  return Device(capture, gpu, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}, false}).render(frame).targets.color;
}

double mean_difference(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) sum += std::abs(static_cast<double>(a.values[i] - b.values[i]));
  return sum / static_cast<double>(a.values.size());
}

// Mean differences of neighbours along a way.
std::vector<double> steps_of(int count, const std::function<Image(double)>& image) {
  std::vector<double> steps;
  Image before = image(0);
  for (int k = 1; k <= count; ++k) {
    Image next = image(static_cast<double>(k) / count);
    steps.push_back(mean_difference(before, next));
    before = std::move(next);
  }
  return steps;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}
double largest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

RunSettings fine() {
  RunSettings settings;
  settings.sampling.samples_per_pixel = 16;
  return settings;
}

// The stated tolerance: no step changes more than kPop times the usual change of a step.
constexpr double kPop = 2.0;

// The camera comes closer, so that factors and splits change on the way; a step moves the outline by about a tenth of a
// pixel.
std::vector<double> approach(const RunSettings& settings, const gpu::GpuConfiguration& gpu = {}) {
  return steps_of(32, [&](double s) {
    Capture capture = scene();
    for (scene::Node& node : capture.nodes)
      if (node.camera != scene::kNone) node.transform.translation.z = 4 - 0.4 * s;
    return render(capture, settings, gpu);
  });
}

TEST(Continuity, NothingPopsAsTheCameraComesCloser) {
  const std::vector<double> steps = approach(fine());
  EXPECT_GT(median(steps), 0.0) << "nothing moves, the case shows nothing";
  EXPECT_LE(largest(steps), kPop * median(steps));
  RecordProperty("largest_over_median", std::to_string(largest(steps) / median(steps)));
}

// The failing twin: with edges of a quarter of the object each factor that changes is seen.
TEST(Continuity, CoarseTessellationThatPopsIsCaught) {
  RunSettings settings = fine();
  settings.tessellation.target_edge_pixels = 24;
  const std::vector<double> steps = approach(settings);
  EXPECT_GT(largest(steps), kPop * median(steps));
}

// Splits decide how work is cut and never change visibility: the image does not change at all.
TEST(Continuity, SplitLevelsDoNotShow) {
  const Capture capture = scene();
  gpu::GpuConfiguration whole;
  whole.frontend.split_depth = 0;
  const Image expected = render(capture, fine(), whole);
  for (const double pixels : {200.0, 64.0, 63.0, 31.9, 16.0, 8.0}) {
    gpu::GpuConfiguration gpu;
    gpu.frontend.split_pixels = pixels;
    EXPECT_EQ(render(capture, fine(), gpu).values, expected.values) << pixels;
  }
}

// Target edge: the surface converges, so a step's change is bounded by the distance to the limit, edge^2 / (8 radius)
// pixels.
TEST(Continuity, TheTargetEdgeChangesTheImageGradually) {
  const Capture capture = scene();
  const auto image = [&](double edge) {
    RunSettings settings = fine();
    settings.tessellation.target_edge_pixels = edge;
    return render(capture, settings);
  };
  const Image finest = image(1);
  // The distance to the limit is a share of a pixel: differences grow with the light of the image.
  const double light = mean_difference(finest, Image(kWidth, kHeight, finest.channels));
  double before = 0;
  for (const double edge : {1.5, 2.0, 3.0, 4.5, 6.0}) {
    const double away = mean_difference(image(edge), finest);
    EXPECT_LE(away, (0.0015 * edge * edge + 0.0012) * light) << edge;
    EXPECT_GE(away, 0.3 * before) << edge;  // not by chance
    before = away;
  }
}

TEST(Continuity, ALittleLaterIsALittleDifferent) {
  const std::vector<double> steps = steps_of(24, [&](double s) {
    Capture capture = scene();
    capture.settings.shutter_open = 4 + 2 * s;
    capture.settings.shutter_close = capture.settings.shutter_open;
    return render(capture, fine());
  });
  EXPECT_GT(median(steps), 0.0);
  EXPECT_LE(largest(steps), kPop * median(steps));
}

// The shutter opens: the first moment of motion blur is next to none.
TEST(Continuity, AShutterThatOpensALittleBlursALittle) {
  const auto image = [&](double shutter) {
    Capture capture = scene();
    capture.settings.shutter_open = 4;
    capture.settings.shutter_close = 4 + shutter;
    return render(capture, fine());
  };
  const Image still = image(0);
  EXPECT_LE(mean_difference(image(1e-6), still), 1e-4);
  EXPECT_LE(mean_difference(image(0.02), still), 0.1 * mean_difference(image(2), still));
}

// A lens that opens from nothing, likewise.
TEST(Continuity, ALensThatOpensALittleDefocusesALittle) {
  const auto image = [&](float radius) {
    Capture capture = scene();
    capture.cameras[0].lens = {radius, 4.0f};
    return render(capture, fine());
  };
  const Image pinhole = image(0);
  EXPECT_LE(mean_difference(image(1e-7f), pinhole), 1e-4);
  EXPECT_LE(mean_difference(image(0.001f), pinhole), 0.1 * mean_difference(image(0.1f), pinhole));
}

// A threshold of the resolve unit moves blocks from one regime to the next one by one: no step of it changes the
// image by more than a share of the whole change, and never by more than the regimes differ.
TEST(Continuity, ThresholdsOfTheResolveUnitChangeBlocksOneByOne) {
  Capture capture = scene();
  const auto image = [&](double speed) {
    RunSettings settings;
    settings.resolve.desampling = tilecore::Desampling::kAdaptive;
    settings.resolve.rates.thresholds.reuse = 0;
    settings.resolve.rates.thresholds.half_rate = speed;
    settings.resolve.rates.thresholds.quarter_rate = 1000;
    Device renderer(capture, {}, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}, false});
    renderer.render(3);
    return renderer.render(4).targets.color;
  };
  const Image none = image(1000);
  const double whole = mean_difference(image(0.01), none);
  EXPECT_GT(whole, 0) << "nothing is fast";
  double before = -1;
  for (const double speed : {2.0, 2.02}) {
    const double away = mean_difference(image(speed), none);
    EXPECT_LE(away, 1.05 * whole);
    if (before >= 0) {
      EXPECT_LE(std::abs(away - before), 0.25 * whole);
    }
    before = away;
  }
}

}  // namespace
}  // namespace tessera::gpu::continuity_test
