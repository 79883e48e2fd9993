// Motion during the shutter besides geometry: lights, the environment, and the pattern of times itself.
#include "base/image_metrics.h"
#include "base/simd_targets.h"
#include "shaders_cpp/environment.h"
#include "tests/support/environments.h"
#include "tests/support/tests.h"
#include "tests/tilecore/pixel_scene.h"
#include "tilecore/shading/view_rays.h"

namespace tessera::tilecore::moving_light_test {
namespace {

// Renders frames of a perspective scene of one tile.
struct Stage : TestFrame {
  static constexpr int kWidth = 96, kHeight = 64;

  Image image(int spp, double open, double close, ShadingRate rate = ShadingRate::kSample) {
    assembly = std::make_unique<scene::Assembly>(scene::assemble(*capture));
    scene::FrameRequest request;
    request.width = kWidth;
    request.height = kHeight;
    request.open_time = open;
    request.close_time = close;
    frame = scene::pose_frame(*assembly, scene::choose_camera(*capture, kWidth, kHeight), request);
    const SamplePattern pattern({spp, 0, 0});
    const binner::TileGrid grid(kWidth, kHeight, kWidth, kHeight);
    TileJob job;
    job.frame = frame.get();
    job.grid = &grid;
    job.pattern = &pattern;
    job.shading.rate = rate;
    std::vector<binner::ListEntry> entries(assembly->patch_count());
    for (std::uint32_t p = 0; p < entries.size(); ++p)
      entries[p].base_patch = p, entries[p].range = whole_patch(*frame, p);
    FrameTargets targets({0, 0, kWidth, kHeight}, false);
    TileCore core;
    TileState state;
    core.render_entries(job, 0, entries, state);
    core.finish(job, 0, state, targets);
    Image out(kWidth, kHeight, 3);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (std::size_t k = 0; k < 3; ++k) out.at(x, y)[k] = targets.color.at(x, y)[k];
    return out;
  }
  // Mean of frames with a closed shutter, in the middle of equal parts of it.
  Image mean_of_stills(int spp, int count) {
    Image mean(kWidth, kHeight, 3);
    for (int k = 0; k < count; ++k) {
      const double time = (k + 0.5) / count;
      const Image still = image(spp, time, time);
      for (std::size_t i = 0; i < mean.values.size(); ++i)
        mean.values[i] += still.values[i] / static_cast<float>(count);
    }
    return mean;
  }
};

TEST(MovingBackground, ATiltingCameraBlursTheBackground) {
  Stage stage;
  const int material = test::add_material(*stage.capture);
  test::add_node(*stage.capture, test::patches(test::flat_patch({50, 50, 50}, {1, 0, 0}, {0, 1, 0}), material));
  test::add_camera(*stage.capture, {0, 0, 0});
  test::add_turn(*stage.capture, static_cast<int>(stage.capture->nodes.size()) - 1, {1, 0, 0}, 0.6f);
  const Image truth = stage.mean_of_stills(16, 64), blurred = stage.image(64, 0, 1), still = stage.image(64, 0, 0);
  EXPECT_GE(psnr(blurred, truth), 40.0);
  EXPECT_LT(psnr(still, truth), 30.0) << "a background that stands still is caught";
}

TEST(ViewRays, AreWhereFarPointsOfTheSceneAre) {
  TestFrame scene;
  test::add_node(*scene.capture, test::patches(test::flat_patch({0, 0, -5}, {1, 0, 0}, {0, 1, 0})));
  scene::Camera camera;
  camera.lens.aperture_radius = 0.2f;
  camera.lens.focus_distance = 4;
  test::add_camera(*scene.capture, {1, 2, 3}, camera);
  test::add_turn(*scene.capture, static_cast<int>(scene.capture->nodes.size()) - 1, {0.3f, 1, 0.2f}, 0.8f);
  scene.pose();
  const ViewRays rays(*scene.frame);
  const scene::Projection& p = scene.frame->projection;
  test::Random random(5);
  for (int trial = 0; trial < 300; ++trial) {
    const float x = random.uniform(0, 96), y = random.uniform(0, 64), t = random.uniform(0, 1),
                u = random.uniform(-0.7f, 0.7f) * static_cast<float>(p.lens_scale),
                v = random.uniform(-0.7f, 0.7f) * static_cast<float>(p.lens_scale);
    const DVec3 far = DVec3(rays.direction(x, y, t, u, v)) * 1e9;
    // The point moves linearly in raster space, and the lens moves it by its circle of confusion.
    DVec4 r(0.0);
    for (std::size_t k = 0; k < 2; ++k)
      r += p.matrix() * scene.frame->views[k].world_to_camera * DVec4(far, 1) *
           (k == 0 ? 1.0 - static_cast<double>(t) : static_cast<double>(t));
    const double coc = 1 / r.w - p.inverse_focus;
    EXPECT_NEAR(r.x / r.w + static_cast<double>(u) * -coc, static_cast<double>(x), 2e-3);
    EXPECT_NEAR(r.y / r.w + static_cast<double>(v) * -coc, static_cast<double>(y), 2e-3);
  }
}

TEST(ViewRays, EveryInstructionSetSeesTheBackgroundOfSinglePoints) {
  test::Random random(8);
  const auto image = test::noisy_environment(16, 3);
  using Kind = shaders::Surroundings::Kind;
  const std::array<shaders::Surroundings, 3> surroundings = {
      {{Kind::kStudio, 1.7f}, {Kind::kUniform, 0.3f}, {Kind::kImage, 1.7f, image.get()}}};
  for (const bool turns : {false, true})
    for (const bool orthographic : {false, true}) {
      TestFrame scene;
      test::add_node(*scene.capture, test::patches(test::flat_patch({0, 0, -5}, {1, 0, 0}, {0, 1, 0})));
      scene::Camera camera;
      if (orthographic) camera.type = scene::Camera::Type::kOrthographic;
      camera.lens.aperture_radius = 0.2f;
      camera.lens.focus_distance = 4;
      test::add_camera(*scene.capture, {1, 2, 3}, camera);
      if (turns)
        test::add_turn(*scene.capture, static_cast<int>(scene.capture->nodes.size()) - 1, {0.3f, 1, 0.2f}, 0.8f);
      scene.pose();
      const ViewRays rays(*scene.frame);
      constexpr std::size_t kPoints = 64;
      std::array<std::array<float, kPoints>, 5> at;
      for (std::size_t i = 0; i < kPoints; ++i) {
        at[0][i] = random.uniform(-400, 400), at[1][i] = random.uniform(-400, 400), at[2][i] = random.uniform(0, 1);
        at[3][i] = random.uniform(-3, 3), at[4][i] = random.uniform(-3, 3);
      }
      at[1][5] = std::numeric_limits<float>::infinity(), at[0][6] = std::numeric_limits<float>::quiet_NaN();
      for (const std::string& target : simd_target_names()) {
        force_simd_target(target);
        for (const std::size_t count : {std::size_t{1}, std::size_t{17}, kPoints}) {
          for (const shaders::Surroundings& around : surroundings) {
            std::array<Vec3, kPoints> colors;
            rays.background({at[0].data(), at[1].data(), at[2].data(), at[3].data(), at[4].data()}, count, around,
                            LookupArrays(), colors.data());
            for (std::size_t i = 0; i < count; ++i)
              ASSERT_EQ(colors[i], shaders::Environment(around).background(
                                       rays.direction(at[0][i], at[1][i], at[2][i], at[3][i], at[4][i])))
                  << target << ", point " << i;
          }
        }
      }
    }
  force_simd_target("");
}

// A wall lit by a lamp that moves along it.
Stage lit_wall(const DVec3& way) {
  Stage stage;
  scene::Material material;
  material.roughness = 1;
  const int m = test::add_material(*stage.capture, material);
  test::add_node(*stage.capture, test::patches(test::flat_patch({-4, -3, 0}, {8, 0, 0}, {0, 6, 0}), m));
  test::add_camera(*stage.capture, {0, 0, 6});
  shaders::Light lamp;
  lamp.type = shaders::Light::Type::kPoint;
  lamp.color = Vec3(3.0f);
  stage.capture->lights = {lamp};
  stage.capture->light_parameters.resize(1);
  scene::Node node;
  node.light = 0;
  node.transform.translation = {-1.5, 0, 0.8};
  stage.capture->nodes.push_back(node);
  const int number = static_cast<int>(stage.capture->nodes.size()) - 1;
  stage.capture->roots.push_back(number);
  if (way != DVec3(0.0)) test::add_motion(*stage.capture, number, way);
  return stage;
}

TEST(MovingLights, ALampThatMovesLightsTheWallAsTheMeanOfStillFrames) {
  Stage stage = lit_wall({3, 0, 0});
  const Image truth = stage.mean_of_stills(4, 64), still = stage.image(16, 0, 0);
  EXPECT_FALSE(stage.frame->moving_lights) << "with a closed shutter nothing moves";
  EXPECT_GE(psnr(stage.image(64, 0, 1), truth), 40.0);
  EXPECT_TRUE(stage.frame->moving_lights);
  EXPECT_LT(psnr(still, truth), 28.0) << "a lamp that stands still is caught";
  // Samples of a pixel share a run at their mean time: the lamp is where it is at mid-shutter.
  for (const ShadingRate rate : {ShadingRate::kPixel, ShadingRate::kPrimitive})
    EXPECT_GE(psnr(stage.image(16, 0, 1, rate), stage.image(16, 0.5, 0.5, rate)), 45.0);
}

TEST(MovingLights, LightsThatStandStillAreNotMixed) {
  Stage stage = lit_wall(DVec3(0.0));
  stage.image(4, 0, 1);
  EXPECT_FALSE(stage.frame->moving_lights);
  EXPECT_TRUE(stage.frame->lights_at(0.7f).close.empty());
}

TEST(Shutter, TheCentroidOfABlurredSquareIsItsMiddleForAnyNumberOfSamples) {
  for (const int bits : {8, 16})
    for (const int spp : {1, 2, 3, 4, 7, 16, 64}) {
      // Mean over places of the square on the pattern, all of them for few samples: where it starts is noise, not bias.
      double error = 0;
      const int places = spp < 8 ? 256 : 16;
      for (int place = 0; place < places; ++place) {
        // Between pixels as well: with one sample a pixel's corner and its middle are not the same place.
        const auto start = static_cast<float>(place % 8) + static_cast<float>(place * 97 % 256) / 256,
                   down = static_cast<float>((place / 8 + 3 * (place % 8)) % 8) +
                          static_cast<float>(place * 57 % 256) / 256;
        PixelScene scene(208, 40, spp);
        scene.pattern = SamplePattern({spp, 0, 0, 8, bits});
        // Its sides are slanted, so that no sample is on one.
        const int material = test::add_material(*scene.capture, unlit({1, 1, 1, 1}));
        const int node = test::add_node(
            *scene.capture,
            test::patches(test::flat_patch({19 + start, 6 + down, 0}, {16, 3, 0}, {-3, 16, 0}), material));
        test::add_motion(*scene.capture, node, {128, 0, 0});
        scene.look();
        const Rendering r = render(scene);
        double sum = 0, weighted = 0;
        for (int y = 0; y < 40; ++y)
          for (int x = 0; x < 208; ++x) {
            const auto value = static_cast<double>(r.targets.color.at(x, y)[0]);
            sum += value;
            weighted += value * (x + 0.5);
          }
        error += (weighted / sum - (19 + static_cast<double>(start) + 6.5 + 64)) / places;
      }
      EXPECT_NEAR(error, 0, 0.05) << spp << " samples, " << bits << " bits";
    }
}

TEST(Shutter, AFastThingShowsAsOftenAsSamplesHaveTimes) {
  for (const int times : {1, 5, 8, 16}) {
    PixelScene scene(256, 16, 16);
    SamplingSettings settings{16, 0, 0};
    settings.times = times;
    scene.pattern = SamplePattern(settings);
    // Two pixels wide; it moves further than that from time to time.
    const int node = scene.add_quad(2, 2, 2, 12, 0, unlit({1, 1, 1, 1}), true);
    test::add_motion(*scene.capture, node, {240, 0, 0});
    scene.look();
    const Image by_class = render(scene).targets.color;
    int copies = 0;
    for (int x = 1; x < 256; ++x) {
      const auto lit = [&](int column) { return by_class.at(column, 8)[0] > 0; };
      copies += lit(x) && !lit(x - 1) ? 1 : 0;
    }
    EXPECT_EQ(copies, times);
    // Interleaved rasterization sees the same, with as many rectangles of a cell as there are times.
    scene.job.core.visibility.method = VisibilityMethod::kInterleaved;
    EXPECT_EQ(render(scene).targets.color.values, by_class.values);
  }
}

TEST(AlphaMask, IsFilteredOverThePixel) {
  // A checkerboard far finer than pixels: half of it is there. Every pixel sees its mean, on either side of the cutoff.
  Image8 board(256, 256, 4);
  for (std::size_t i = 0; i < 256 * 256; ++i) board.values[4 * i + 3] = (i / 256 + i % 256) % 2 == 0 ? 255 : 0;
  for (const float cutoff : {0.4f, 0.6f})
    for (const bool bezier : {false, true}) {
      PixelScene scene(32, 32, 4);
      scene::Material mask = unlit({1, 1, 1, 1}, scene::AlphaMode::kMask);
      mask.alpha_cutoff = cutoff;
      mask.base_color_texture.texture =
          std::make_shared<shaders::Texture>(DecodedImage{board}, shaders::ColorSpace::kLinear);
      scene.add_quad(8, 8, 16, 16, 0, mask, bezier);
      scene.look();
      EXPECT_EQ(render(scene).counters.samples_visible, cutoff < 0.5f ? 16u * 16u * 4u : 0u) << cutoff << bezier;
    }
}

}  // namespace
}  // namespace tessera::tilecore::moving_light_test
