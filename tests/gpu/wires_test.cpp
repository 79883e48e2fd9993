// Points and lines through the whole machine, against formulas.
#include "gpu/device.h"
#include "tests/support/tests.h"

namespace tessera::gpu::wires_test {
namespace {

using scene::Capture;

constexpr int kWidth = 48, kHeight = 32;

// 16 pixels a unit; the image's middle is the origin. Everything is white on black.
Capture stage(const DVec3& eye = DVec3(0, 0, 1)) {
  Capture capture;
  scene::Camera camera;
  camera.type = scene::Camera::Type::kOrthographic;
  camera.x_mag = 1.5f;
  camera.y_mag = 1;
  test::add_camera(capture, eye, camera);
  capture.settings.background = Vec3(0.0f);
  capture.settings.frame_rate = 1;
  return capture;
}

int white(Capture& capture) {
  scene::Material material;
  material.base_color = Vec4(0, 0, 0, 1);
  material.emissive = Vec3(1.0f);  // unlit, emission counts
  return test::add_material(capture, material);
}

Image render(const Capture& capture, const RunSettings& settings = {}, const GpuConfiguration& gpu = {}) {
  return Device(capture, gpu, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}, false}).render(0).targets.color;
}

// A point of the plane z = 0 at a position in pixels.
Vec3 at(float x, float y) { return {(x - 24) / 16, (16 - y) / 16, 0}; }

RunSettings with_samples(int samples) {
  RunSettings settings;
  settings.sampling.samples_per_pixel = samples;
  return settings;
}

TEST(WiresInTheMachine, AHorizontalLineCoversOneRowOfPixels) {
  Capture capture = stage();
  test::add_node(capture, test::segments({at(10, 7.5f), at(30, 7.5f)}, white(capture)));
  const Image image = render(capture, with_samples(16));
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      EXPECT_EQ(image.at(x, y)[0], y == 7 && x >= 10 && x < 30 ? 1.0f : 0.0f) << x << " " << y;
}

TEST(WiresInTheMachine, APointCoversTheAreaOfAPixel) {
  for (const auto& [px, py] : {std::pair{12.5f, 9.5f}, {20.75f, 14.25f}, {33.0f, 20.0f}}) {
    Capture capture = stage();
    test::add_node(capture, test::points({at(px, py)}, white(capture)));
    const Image image = render(capture, with_samples(256));
    double sum = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const auto overlap = [](double a, double b) { return std::max(0.0, 1 - std::abs(a - b)); };
        const double expected = overlap(x + 0.5, static_cast<double>(px)) * overlap(y + 0.5, static_cast<double>(py));
        EXPECT_NEAR(static_cast<double>(image.at(x, y)[0]), expected, 0.05) << x << " " << y;
        sum += static_cast<double>(image.at(x, y)[0]);
      }
    EXPECT_NEAR(sum, 1, 0.05);
  }
}

TEST(WiresInTheMachine, ASlantedLineCoversItsLengthTimesOnePixel) {
  Capture capture = stage();
  test::add_node(capture, test::segments({at(5, 4), at(40, 25)}, white(capture)));
  const Image image = render(capture, with_samples(1024));
  double sum = 0;
  for (std::size_t i = 0; i < image.values.size(); i += static_cast<std::size_t>(image.channels))
    sum += static_cast<double>(image.values[i]);
  EXPECT_NEAR(sum, std::hypot(35, 21), 0.5);
}

// A crowd of points and lines with colours, some behind the camera, in perspective, which moves.
Capture crowd() {
  Capture capture;
  test::Random random(8);
  std::vector<Vec3> points, ends;
  for (int k = 0; k < 300; ++k) points.push_back(random.in_box(2));
  for (int k = 0; k < 200; ++k) ends.push_back(random.in_box(3));
  scene::Primitive dots = test::points(points), lines = test::segments(ends);
  for (std::size_t v = 0; v < dots.vertices.count(); ++v)
    dots.vertices.colors.emplace_back(random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1), 1.0f);
  lines.vertices.normals.assign(lines.vertices.count(), Vec3(0, 0, 1));
  test::add_node(capture, dots);
  test::add_node(capture, lines);
  test::add_camera(capture, DVec3(0.1, 0.2, 2.5));
  test::add_motion(capture, 2, DVec3(0.3, 0.1, -0.4));
  capture.settings.frame_rate = 1;
  capture.settings.shutter_close = 1;
  return capture;
}

TEST(WiresInTheMachine, TheImageDoesNotDependOnTheTiles) {
  const Capture capture = crowd();
  const Image expected = render(capture, with_samples(8));
  for (const auto& [width, height] : {std::pair{8, 8}, {16, 32}, {64, 64}}) {
    GpuConfiguration gpu;
    gpu.tile.width = width;
    gpu.tile.height = height;
    EXPECT_EQ(render(capture, with_samples(8), gpu).values, expected.values) << width << "x" << height;
  }
}

// A camera that moves sideways by some pixels while the shutter is open smears a point over as many pixels: the
// pixels add up to the point's area, and are equal along the way.
TEST(WiresInTheMachine, AMovingCameraSmearsAPoint) {
  Capture capture = stage(DVec3(0.5, 0, 1));
  test::add_node(capture, test::points({at(24, 10.5f)}, white(capture)));
  test::add_motion(capture, 0, DVec3(-1, 0, 0));  // the point goes from pixel 16 to pixel 32
  capture.settings.shutter_close = 1;
  const Image image = render(capture, with_samples(256));
  double sum = 0;
  for (int x = 0; x < kWidth; ++x) {
    sum += static_cast<double>(image.at(x, 10)[0]);
    if (x >= 18 && x < 30) {
      EXPECT_NEAR(static_cast<double>(image.at(x, 10)[0]), 1.0 / 16, 0.03) << x;
    }
    EXPECT_EQ(image.at(x, 9)[0], 0.0f);
    EXPECT_EQ(image.at(x, 11)[0], 0.0f);
  }
  EXPECT_NEAR(sum, 1, 0.1);
}

TEST(WiresInTheMachine, AHiddenNodeCausesNoWork) {
  Capture capture = stage();
  test::add_node(capture, test::triangles({{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}}, {0, 1, 2}, white(capture)));
  EXPECT_GT(render(capture).at(24, 20)[3], 0.0f);
  capture.nodes[1].visible = false;
  Device device(capture, {}, {}, {kWidth, kHeight, {0, 0, kWidth, kHeight}, false});
  const FrameResult result = device.render(0);
  EXPECT_EQ(result.targets.color.at(24, 20)[3], 0.0f);
  EXPECT_EQ(result.counters.frontend.base_patches, 0u);
}

}  // namespace
}  // namespace tessera::gpu::wires_test
