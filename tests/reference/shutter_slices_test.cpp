// The reference's own way through the shutter, and its order of surfaces in one plane.
#include "base/image_metrics.h"
#include "gpu/device.h"
#include "gpu/view_inputs.h"
#include "reference/reference_renderer.h"
#include "tests/support/tests.h"

namespace tessera::reference::shutter_slices_test {
namespace {

using scene::Capture;

constexpr int kWidth = 48, kHeight = 32;

struct Shot {
  explicit Shot(const Capture& capture_in) : capture(capture_in), assembly(scene::assemble(capture)) {}
  ShutterSlices slices(std::uint64_t seed = 1) const {
    return ShutterSlices(assembly, gpu::frame_camera(capture, settings, kWidth, kHeight),
                         gpu::frame_request(capture, machine, settings, kWidth, kHeight, 0), seed);
  }
  Image reference(int samples) const {
    ReferenceRequest request;
    request.lighting = gpu::frame_lighting(capture);
    request.background = gpu::frame_background(capture);
    request.samples = {samples};
    return render_reference(slices(), request).front();
  }
  // The mean of frames of so many seeds.
  Image machine_image(int samples, int seeds = 1) {
    Image mean = machine_frame(samples, 0);
    for (int seed = 1; seed < seeds; ++seed) {
      const Image next = machine_frame(samples, seed);
      for (std::size_t i = 0; i < mean.values.size(); ++i)
        mean.values[i] += (next.values[i] - mean.values[i]) / static_cast<float>(seed + 1);
    }
    return mean;
  }
  Image machine_frame(int samples, int seed) {
    settings.sampling.samples_per_pixel = samples;
    settings.sampling.seed = seed;
    settings.shading.rate = tilecore::ShadingRate::kSample;
    settings.output.machine_model = false;
    gpu::Device device(capture, {}, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}});
    const Image all = device.render(0).targets.color;
    Image color(kWidth, kHeight, 3);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (std::size_t c = 0; c < 3; ++c) color.at(x, y)[c] = all.at(x, y)[c];
    return color;
  }
  const Capture& capture;
  gpu::RunSettings settings;
  gpu::GpuConfiguration machine;
  scene::Assembly assembly;
};

// A square there and back, so many times while the shutter is open.
Capture zigzag(int cycles) {
  Capture capture;
  capture.settings.frame_rate = 1;
  capture.settings.shutter_close = cycles > 0 ? 1 : 0;
  capture.settings.background = Vec3(0.0f);
  scene::Material white;
  white.unlit = white.double_sided = true;
  const int node = test::add_node(capture, test::triangles({{-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}},
                                                           {0, 1, 2, 0, 2, 3}, test::add_material(capture, white)));
  scene::Camera camera;
  camera.type = scene::Camera::Type::kOrthographic;
  camera.x_mag = kWidth / 2.0f, camera.y_mag = kHeight / 2.0f;
  test::add_camera(capture, {0, 0, 10}, camera);
  scene::AnimationChannel channel;
  channel.node = node;
  channel.path = scene::AnimatedPath::kTranslation;
  for (int k = 0; k <= 2 * cycles; ++k) {
    channel.times.push_back(static_cast<float>(k) / static_cast<float>(std::max(1, 2 * cycles)));
    for (const float v : {k % 2 == 0 ? -12.0f : 12.0f, 0.0f, 0.0f}) channel.values.push_back(v);
  }
  test::play(capture, channel);
  return capture;
}

TEST(ShutterSlices, AreAsManyAsTheMotionBends) {
  EXPECT_EQ(Shot(zigzag(0)).slices().count(), 1u) << "closed";
  Capture straight = zigzag(0);
  straight.settings.shutter_close = 1;
  straight.animations.clear(), straight.played_animations.clear();
  test::add_motion(straight, 0, {9, 0, 0});
  EXPECT_EQ(Shot(straight).slices().count(), 1u);
  for (const int cycles : {1, 2, 4, 8, 16, 64})
    EXPECT_EQ(Shot(zigzag(cycles)).slices().count(), static_cast<std::size_t>(2 * cycles)) << cycles;  // RSL1
  Capture turning = straight;
  turning.animations.clear(), turning.played_animations.clear();
  test::add_turn(turning, 0, {0, 0, 1}, 3.0f);
  const std::size_t slices = Shot(turning).slices().count();
  EXPECT_GT(slices, 6u);
  EXPECT_LT(slices, 64u);
}

TEST(ShutterSlices, IntegrateTheTrueCurve) {
  for (const int cycles : {1, 4, 16}) {
    const Capture capture = zigzag(cycles), once = zigzag(1);
    const Image image = Shot(capture).reference(512), same = Shot(once).reference(512);
    // However often, the square is everywhere for as long.
    EXPECT_GT(psnr(image, same), 36) << cycles;
    Capture still = zigzag(0);
    EXPECT_LT(psnr(image, Shot(still).reference(64)), 25) << "the twin: a still scene";
    // With two motion keys alone the machine sees it stand still; with its segments it agrees. A frame of 16 cycles is
    // as noisy as four times of a cycle are (25.8 dB): other seeds have other times. 256 times are 16 of each of these
    // cycles, 3 pixels apart, so times have 16 bits.
    Shot machine(capture);
    machine.settings.sampling.time_bits = tilecore::TimeBits::k16;
    EXPECT_GT(psnr(machine.machine_image(64, 16), image), 34) << cycles;
    machine.settings.sampling.motion_segments = 1;
    EXPECT_LT(psnr(machine.machine_image(64), image), 25) << cycles;
  }
}

TEST(ShutterSlices, VisibilityAndMaterialsAreTakenAtShutterOpen) {
  Capture capture = zigzag(2);
  scene::AnimationChannel hidden;
  hidden.node = 0;
  hidden.path = scene::AnimatedPath::kVisible;
  hidden.components = 1;
  hidden.interpolation = scene::Interpolation::kStep;
  hidden.times = {0, 0.3f};
  hidden.values = {1, 0};
  test::play(capture, hidden);
  EXPECT_GT(psnr(Shot(capture).reference(256), Shot(zigzag(2)).reference(256)), 34);
  EXPECT_GT(psnr(Shot(capture).machine_image(64), Shot(zigzag(2)).machine_image(64)), 34);
}

TEST(Reference, OrdersSurfacesInOnePlaneAsTheMachineDoes) {
  const auto stage = [](const std::vector<std::pair<Vec4, scene::AlphaMode>>& sheets) {
    Capture capture;
    for (const auto& [color, mode] : sheets) {
      scene::Material material;
      material.unlit = material.double_sided = true;
      material.base_color = color, material.alpha_mode = mode;
      test::add_node(capture, test::triangles({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, {0, 1, 2, 0, 2, 3},
                                              test::add_material(capture, material)));
    }
    test::add_camera(capture, {0, 0, 4});
    capture.settings.background = Vec3(0.0f);
    return capture;
  };
  using scene::AlphaMode;
  const Vec4 red(1, 0, 0, 0.5f), green(0, 1, 0, 0.5f), blue(0, 0, 1, 1);
  for (const auto& sheets :
       std::vector<std::vector<std::pair<Vec4, AlphaMode>>>{{{red, AlphaMode::kBlend}, {green, AlphaMode::kBlend}},
                                                            {{green, AlphaMode::kBlend}, {red, AlphaMode::kBlend}},
                                                            {{red, AlphaMode::kBlend}, {blue, AlphaMode::kOpaque}},
                                                            {{blue, AlphaMode::kOpaque}, {red, AlphaMode::kBlend}},
                                                            {{blue, AlphaMode::kMask}, {red, AlphaMode::kBlend}},
                                                            {{red, AlphaMode::kMask}, {blue, AlphaMode::kMask}},
                                                            {{blue, AlphaMode::kMask}, {green, AlphaMode::kOpaque}}}) {
    const Capture capture = stage(sheets);
    const Image reference = Shot(capture).reference(16), machine = Shot(capture).machine_image(4);
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(reference.at(kWidth / 2, kHeight / 2)[c], machine.at(kWidth / 2, kHeight / 2)[c], 1e-4) << c;
  }
}

}  // namespace
}  // namespace tessera::reference::shutter_slices_test
