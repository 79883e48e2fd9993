// The machine's images against the double-precision reference: the difference at many samples is noise, not bias.
#include "gpu/device.h"
#include "gpu/settings.h"
#include "gpu/view_inputs.h"
#include "reference/reference_renderer.h"
#include "scene/capture_reader.h"
#include "tests/support/environments.h"
#include "tests/support/tests.h"

namespace tessera::reference::bias_test {
namespace {

using scene::Capture;

// Distance of the two means in standard errors of 64 random samples a pixel. The standard error is estimated from 16
// independent references, so the distance has Student's distribution with 15 degrees of freedom.
struct Deviation {
  std::array<double, 3> image{};   // of the whole image's mean, by channel
  double pixels_beyond_three = 0;  // share of the pixels that have any noise
  double worst_without_noise = 0;  // difference where all references are equal
};
constexpr int kSamples = 64, kSeries = 16, kWidth = 96, kHeight = 54;

Deviation compare(const Image& seen, const std::vector<Image>& references) {
  Deviation out;
  std::array<double, 3> difference{}, variance{};
  std::size_t noisy = 0, beyond = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      bool noise = false, far = false;
      for (std::size_t c = 0; c < 3; ++c) {
        double mean = 0, squares = 0;
        for (const Image& one : references) mean += static_cast<double>(one.at(x, y)[c]) / kSeries;
        for (const Image& one : references) {
          const double d = static_cast<double>(one.at(x, y)[c]) - mean;
          squares += d * d / (kSeries - 1);
        }
        const double off = static_cast<double>(seen.at(x, y)[c]) - mean, v = squares * (1 + 1.0 / kSeries);
        difference[c] += off;
        variance[c] += v;
        // A difference by single precision alone has nearly no noise.
        if (std::sqrt(v) > 1e-5 * (1 + mean)) {
          noise = true;
          far = far || std::abs(off) > 3 * std::sqrt(v);
        } else {
          out.worst_without_noise = std::max(out.worst_without_noise, std::abs(off) / (1 + mean));
        }
      }
      noisy += noise ? 1 : 0;
      beyond += far ? 1 : 0;
    }
  for (std::size_t c = 0; c < 3; ++c) out.image[c] = variance[c] > 0 ? difference[c] / std::sqrt(variance[c]) : 0;
  out.pixels_beyond_three = noisy > 0 ? static_cast<double>(beyond) / static_cast<double>(noisy) : 0;
  return out;
}

struct Bias {
  Deviation machine, random;  // random: one more reference, which has noise alone
};

// `of_machine`: keys of the machine's frame alone, for twins.
Bias measure(const Capture& capture, int frame, const std::vector<std::string>& keys,
             const std::vector<std::string>& of_machine = {}) {
  gpu::RunSettings settings;
  gpu::GpuConfiguration machine;
  for (const std::string& key : keys) gpu::apply_setting(key, settings, machine);
  const scene::Assembly assembly = scene::assemble(capture);
  const auto posed = scene::pose_frame(assembly, gpu::frame_camera(capture, settings, kWidth, kHeight),
                                       gpu::frame_request(capture, machine, settings, kWidth, kHeight, frame));
  const auto reference = [&](std::uint64_t seed) {
    ReferenceRequest request;
    request.lighting = gpu::frame_lighting(capture);
    request.background = gpu::frame_background(capture);
    request.samples = {kSamples};
    request.seed = seed;
    return std::move(render_reference(*posed, request).front());
  };
  std::vector<Image> references;
  for (std::uint64_t seed = 1; seed <= kSeries; ++seed) references.push_back(reference(seed));
  for (const std::string& key : of_machine) gpu::apply_setting(key, settings, machine);
  const Image seen = gpu::Device(capture, machine, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}, false})
                         .render(frame)
                         .targets.color;
  return {compare(seen, references), compare(reference(kSeries + 1), references)};
}

std::vector<std::string> exact_keys(std::vector<std::string> more = {}) {
  more.insert(more.end(), {"sampling.samples_per_pixel=64", "shading.rate=sample", "shading.surface=evaluated",
                           "procedures.path=tessellated", "sampling.temporal_pattern=32x32", "sampling.time_bits=16",
                           "tilecore.blend_layers=64"});
  return more;
}

struct Shot {
  const char* name;
  int frame;
};

class EveryCapture : public testing::TestWithParam<Shot> {};

// Surfaces that few samples see, such as a highlight through the lens, are beyond three standard errors more often
// than a normal distribution is: as often as one more random reference is, not more.
TEST_P(EveryCapture, MeanImageIsWithinThreeStandardErrorsOfTheReference) {
  const Capture capture = scene::read_capture(test::shipped_capture(GetParam().name));
  const Bias bias = measure(capture, GetParam().frame, exact_keys());
  for (const double channel : bias.machine.image) EXPECT_LT(std::abs(channel), 3.0);
  EXPECT_LT(bias.machine.pixels_beyond_three, bias.random.pixels_beyond_three + 0.005);
  // One of 64 samples may see a surface that a thousand random samples never saw.
  EXPECT_LT(bias.machine.worst_without_noise, 1.0 / kSamples);
}

INSTANTIATE_TEST_SUITE_P(Bias, EveryCapture,
                         testing::Values(Shot{"eggs", 14}, Shot{"serpent", 12}, Shot{"flyby", 0}, Shot{"vases", 0},
                                         Shot{"stroll", 30}, Shot{"workshop", 0}),
                         [](const auto& shot) { return std::string(shot.param.name); });

// Everything at once: curved motion of the camera and of things, a moving lamp, a lens, masks, layers and the environment
// behind it.
Capture everything() {
  Capture capture;
  capture.settings.frame_rate = 1;
  capture.settings.shutter_close = 1;
  scene::Material plain;
  plain.double_sided = true;
  plain.base_color = {0.8f, 0.6f, 0.3f, 1.0f};
  const int solid = test::add_material(capture, plain);
  plain.alpha_mode = scene::AlphaMode::kBlend;
  plain.base_color = {0.2f, 0.4f, 0.9f, 0.4f};
  const int glass = test::add_material(capture, plain);
  const int ball = test::add_node(capture, test::closed_patches(solid), DVec3(-0.6, 0, -4));
  test::add_turn(capture, ball, {0.2f, 0.3f, 1}, 2.4f);
  const auto pane = [&](float x, float z, int material) {
    return test::add_node(
        capture, test::triangles({{x, -1, z}, {x + 1, -1, z}, {x + 1, 1, z}, {x, 1, z}}, {0, 1, 2, 0, 2, 3}, material));
  };
  test::add_motion(capture, pane(0.2f, -3, glass), DVec3(-0.5, 0.1, 0.2));
  test::add_turn(capture, pane(-0.5f, -5, solid), {0, 0, 1}, 1.0f);
  capture.lights.emplace_back();
  capture.light_parameters.push_back({Vec3(8.0f), 1.0f});
  capture.lights.back().type = shaders::Light::Type::kPoint;
  capture.lights.back().color = Vec3(8.0f);
  scene::Node lamp;
  lamp.light = 0;
  lamp.transform.translation = {2, 2, 0};
  capture.nodes.push_back(lamp);
  capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
  test::add_motion(capture, capture.roots.back(), DVec3(-4, 0, -3));
  scene::Camera camera;
  camera.vertical_fov = 0.9f;
  camera.lens = {0.04f, 4.0f};
  test::add_camera(capture, DVec3(0), camera);
  test::add_turn(capture, static_cast<int>(capture.nodes.size()) - 1, {0.1f, 1, 0}, 0.5f);
  return capture;
}

// An image around it all: the machine and the reference look the same one up.
TEST(Bias, NothingInTheLightOfAnImageIsBiased) {
  Capture capture = everything();
  capture.settings.environment_kind = shaders::Surroundings::Kind::kImage;
  capture.settings.environment = 0.5f;
  capture.environment_image = test::noisy_environment(24, 1);
  const Bias bias = measure(capture, 0, exact_keys());
  for (const double channel : bias.machine.image) EXPECT_LT(std::abs(channel), 3.0);
  EXPECT_LT(bias.machine.pixels_beyond_three, bias.random.pixels_beyond_three + 0.005);
}

TEST(Bias, NothingOfAllEffectsAtOnceIsBiasedAndTwoMotionKeysAreCaught) {
  const Capture capture = everything();
  const Bias bias = measure(capture, 0, exact_keys());
  for (const double channel : bias.machine.image) EXPECT_LT(std::abs(channel), 3.0);
  EXPECT_LT(bias.machine.pixels_beyond_three, bias.random.pixels_beyond_three + 0.005);
  EXPECT_GT(measure(capture, 0, exact_keys(), {"sampling.motion_segments=1"}).machine.pixels_beyond_three, 0.1);
}

// A blade that turns by 2.6 radians covers its own area, whoever renders it.
TEST(Bias, TheReferenceOfABladeThatTurnsCoversItsArea) {
  Capture capture;
  capture.settings.frame_rate = 1;
  capture.settings.shutter_close = 1;
  capture.settings.background = Vec3(0.0f);
  scene::Material white;
  white.unlit = white.double_sided = true;
  const int blade = test::add_node(capture, test::triangles({{0, -2, -5}, {25, -2, -5}, {25, 2, -5}, {0, 2, -5}},
                                                            {0, 1, 2, 0, 2, 3}, test::add_material(capture, white)));
  test::add_turn(capture, blade, {0, 0, 1}, 2.6f);
  scene::Camera camera;
  camera.type = scene::Camera::Type::kOrthographic;
  camera.x_mag = kWidth / 2.0f, camera.y_mag = kHeight / 2.0f;
  test::add_camera(capture, DVec3(0), camera);
  const auto area = [&](int segments) {
    gpu::RunSettings settings;
    settings.sampling.motion_segments = segments;
    const scene::Assembly assembly = scene::assemble(capture);
    const auto posed = scene::pose_frame(assembly, gpu::frame_camera(capture, settings, kWidth, kHeight),
                                         gpu::frame_request(capture, {}, settings, kWidth, kHeight, 0));
    ReferenceRequest request;
    request.background = Vec3(0.0f);
    request.samples = {256};
    double sum = 0;
    const Image image = render_reference(*posed, request).front();
    for (std::size_t i = 0; i < image.values.size(); i += 3) sum += static_cast<double>(image.values[i]);
    return sum / 100;
  };
  EXPECT_NEAR(area(16), 1.0, 0.01);
  EXPECT_NEAR(area(1), 2.0 / 3 + std::cos(2.6) / 3, 0.01);
}

}  // namespace
}  // namespace tessera::reference::bias_test
