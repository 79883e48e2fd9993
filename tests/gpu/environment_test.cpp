// Environments in whole frames: the background, furnaces, and the cost of lookups in an environment's image.
#include "base/parallel.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "gpu/view_inputs.h"
#include "shaders_cpp/environment_image.h"
#include "tests/support/environments.h"
#include "tests/support/image_bytes.h"
#include "tests/support/tests.h"

namespace tessera::gpu::environment_test {
namespace {

using memory::Purpose;
using memory::Unit;
using scene::Capture;
using scene::MaterialEffect;
using Kind = shaders::Surroundings::Kind;

constexpr int kWidth = 96, kHeight = 64;
constexpr std::uint64_t kSamples = 4ull * kWidth * kHeight;

scene::Material metal(float roughness) {
  scene::Material m;
  m.metallic = 1, m.roughness = roughness;
  return m;
}

// A ball of Bezier patches in the middle, seen by a perspective camera.
Capture ball(const scene::Material& material) {
  Capture capture;
  test::add_node(capture, test::closed_patches(test::add_material(capture, material)));
  test::add_camera(capture, {0, 0, 4}, {});
  return capture;
}

void set_image(Capture& capture, std::shared_ptr<const shaders::EnvironmentImage> image, float intensity = 1.0f) {
  capture.settings.environment_kind = Kind::kImage;
  capture.settings.environment = intensity;
  capture.environment_image = std::move(image);
}

std::shared_ptr<const shaders::EnvironmentImage> gradient() {
  return std::make_shared<const shaders::EnvironmentImage>(
      test::sky_image(64, [](const DVec3& d) { return DVec3(2.0 + d.x, 2.0 + d.y, 2.0 + d.z); }), 0.0);
}

FrameResult frame_of(const Capture& capture, const std::vector<std::string>& keys = {}, int frame = 0) {
  RunSettings settings;
  GpuConfiguration gpu;
  for (const std::string& key : keys) apply_setting(key, settings, gpu);
  return Device(capture, gpu, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}}).render(frame);
}

Vec3 pixel(const FrameResult& frame, int x, int y) {
  const auto& color = frame.targets.color;
  return {color.at(x, y)[0], color.at(x, y)[1], color.at(x, y)[2]};
}

std::uint64_t texture_bytes(const FrameResult& frame) {
  return frame.counters.ledger.traffic(Unit::kTilecore, Purpose::kTexture).read_bytes;
}

TEST(Environments, TheBackgroundIsTheImage) {
  Capture capture = ball(metal(0.5f));
  set_image(capture, gradient(), 0.5f);
  const FrameResult frame = frame_of(capture);
  const double scale = kHeight / 2.0 / std::tan(0.4);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      if (std::hypot(x - kWidth / 2, y - kHeight / 2) < 40) continue;
      const DVec3 d = glm::normalize(DVec3((x + 0.5 - kWidth / 2.0) / scale, -(y + 0.5 - kHeight / 2.0) / scale, -1.0));
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(pixel(frame, x, y)[c], 0.5 * (2.0 + d[c]), 0.01) << x << "," << y;
    }
}

// The furnace: the ball cannot be told from its background.
TEST(Environments, WhiteSurfacesVanishInUniformLight) {
  const auto white = std::make_shared<const shaders::EnvironmentImage>(
      test::sky_image(8, [](const DVec3&) { return DVec3(1.0); }), 0.0);
  for (const float metallic : {0.0f, 1.0f})
    for (const float roughness : {0.0f, 0.3f, 0.7f, 1.0f})
      for (const bool image : {false, true}) {
        scene::Material material = metal(roughness);
        material.metallic = metallic;
        Capture capture = ball(material);
        if (image)
          set_image(capture, white);
        else
          capture.settings.environment_kind = Kind::kUniform, capture.settings.environment = 1.0f;
        const FrameResult frame = frame_of(capture);
        for (int y = 0; y < kHeight; ++y)
          for (int x = 0; x < kWidth; ++x) ASSERT_NEAR(pixel(frame, x, y).x, 1.0f, 0.02f) << metallic << roughness;
        EXPECT_EQ(pixel(frame, 0, 0), Vec3(1.0f));
      }
}

// Every sample that sees nothing looks the image up once; a lit invocation once through a lobe of a level, twice between
// two, and its coat once more.
TEST(Environments, LookupsAreTexelsOfTheTextureUnit) {
  scene::Material unlit = metal(0.6f), coated = metal(0.6f);
  unlit.unlit = true;
  coated.effects[static_cast<std::size_t>(MaterialEffect::kClearcoat)] = true;
  coated.clearcoat.factor = 1, coated.clearcoat.roughness = 0;
  const auto image = gradient();
  for (const auto& [material, lookups] :
       {std::pair{metal(0), 1u}, {metal(0.6f), 2u}, {metal(0.5f), 1u}, {coated, 3u}, {unlit, 0u}}) {
    Capture capture = ball(material);
    const FrameResult studio = frame_of(capture);
    EXPECT_EQ(studio.counters.texture.texels, 0u);
    EXPECT_EQ(texture_bytes(studio), 0u);
    EXPECT_FALSE(studio.effects.contains("environment_image"));
    set_image(capture, image);
    const FrameResult frame = frame_of(capture);
    const auto& shading = frame.counters.shading;
    ASSERT_GT(shading.samples_visible, 100u);
    EXPECT_EQ(shading.pixel_shader_invocations, studio.counters.shading.pixel_shader_invocations);
    EXPECT_EQ(shading.warps, studio.counters.shading.warps);
    EXPECT_EQ(frame.counters.texture.texels,
              kSamples - shading.samples_visible + lookups * shading.pixel_shader_invocations);
    EXPECT_GT(frame.counters.texture.cache_misses, 0u);
    EXPECT_GT(texture_bytes(frame), 0u);
    EXPECT_TRUE(frame.effects.at("environment_image"));
    EXPECT_EQ(frame.effect_reasons.at("environment_image"), "TESSERA_capture.environment is an image 128 pixels wide");
  }
}

TEST(Environments, ACapturesBackgroundColourIsNotLookedUp) {
  Capture capture = ball(metal(0));
  set_image(capture, gradient());
  capture.settings.background = Vec3(0.25f);
  const FrameResult frame = frame_of(capture);
  EXPECT_EQ(frame.counters.texture.texels, frame.counters.shading.pixel_shader_invocations);
  EXPECT_EQ(pixel(frame, 0, 0), Vec3(0.25f));
}

TEST(Environments, ImagesAndTexelsDoNotDependOnTilesAndThreads) {
  Capture capture = ball(metal(0.4f));
  set_image(capture, gradient());
  const FrameResult expected = frame_of(capture);
  for (const std::vector<std::string>& keys :
       {std::vector<std::string>{"tile.width=16", "tile.height=8"}, {"tile.width=64", "tile.height=64"}}) {
    const FrameResult other = frame_of(capture, keys);
    EXPECT_EQ(test::image_bytes(other.targets), test::image_bytes(expected.targets)) << keys[0];
  }
  with_threads(1, [&] {
    const FrameResult alone = frame_of(capture);
    EXPECT_EQ(test::image_bytes(alone.targets), test::image_bytes(expected.targets));
    EXPECT_EQ(alone.counters.texture.texels, expected.counters.texture.texels);
    EXPECT_EQ(alone.counters.texture.cache_misses, expected.counters.texture.cache_misses);
  });
}

// Lookups behind everything have no invocation; the simulation in time makes them all the same.
TEST(Environments, LookupsTakeTheirTimeInBothTimingModels) {
  Capture capture = ball(metal(0.6f));
  for (const std::vector<std::string>& keys :
       {std::vector<std::string>{}, {"machine.timing=phases"}, {"shader.costs=constant"}}) {
    capture.environment_image.reset();
    capture.settings.environment_kind = Kind::kStudio;
    const FrameResult studio = frame_of(capture, keys);
    set_image(capture, gradient());
    const FrameResult frame = frame_of(capture, keys);
    ASSERT_TRUE(frame.model && studio.model);
    const auto busy = [](const FrameResult& of) {
      return of.model->timing.busy[static_cast<std::size_t>(hardware::Stage::kTexture)];
    };
    EXPECT_EQ(busy(studio), 0.0);
    EXPECT_GT(busy(frame), 0.0);
    EXPECT_GT(frame.model->timing.cycles, 0.0);
  }
}

}  // namespace
}  // namespace tessera::gpu::environment_test
