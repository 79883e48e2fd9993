// Transmissive surfaces, in a pass over an image of everything else: closed forms of the view through them, the same
// image for any tiles, and the cost of the passes.
#include "base/error.h"
#include "base/parallel.h"
#include "base/round_up.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "shaders_cpp/layered_material.h"
#include "tests/support/tests.h"

namespace tessera::gpu::transmission_test {
namespace {

using memory::Purpose;
using memory::Unit;
using scene::Capture;
using scene::MaterialEffect;

constexpr int kWidth = 96, kHeight = 64;

scene::Primitive sheet(float half, int material) {
  return test::patches(test::flat_patch({-half, -half, 0}, {2 * half, 0, 0}, {0, 2 * half, 0}), material);
}

scene::Material glass() {
  scene::Material m;
  m.metallic = 0, m.roughness = 0;
  m.transmission.factor = 1;
  m.effects[static_cast<std::size_t>(MaterialEffect::kTransmission)] = true;
  return m;
}

// An unlit checkerboard of soft colours in the middle, a window before its left half, a bright sphere before that, nothing
// lit but by itself: an orthographic camera sees two world units to each side.
struct Window {
  Capture capture;
  int pane = 0;

  explicit Window(const scene::Material& window, bool with_pane = true, float depth = 1.0f) {
    scene::Material board, ball;
    board.unlit = ball.unlit = true;
    Image8 colors(4, 4, 4);
    for (std::size_t i = 0; i < 16; ++i)
      for (std::size_t c = 0; c < 4; ++c)
        colors.values[4 * i + c] = static_cast<std::uint8_t>(c == 3 ? 255 : (i * 37 + c * 91) % 200 + 40);
    board.base_color_texture.texture =
        std::make_shared<shaders::Texture>(DecodedImage{std::move(colors)}, shaders::ColorSpace::kSrgb);
    ball.base_color = {0.9f, 0.5f, 0.1f, 1};
    const int board_number = test::add_material(capture, board);
    scene::Primitive wall =
        test::triangles({{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}}, {0, 1, 2, 0, 2, 3}, board_number);
    wall.vertices.texcoords = {{{0, 1}, {1, 1}, {1, 0}, {0, 0}}};
    test::add_node(capture, wall);
    if (with_pane) pane = test::add_node(capture, sheet(1.5f, test::add_material(capture, window)), {-1.2, 0, depth});
    scene::Primitive sphere = test::closed_patches(test::add_material(capture, ball));
    for (Vec3& p : sphere.vertices.positions) p *= 0.3f;
    test::add_node(capture, sphere, {0.2, 0.3, 2.5});
    scene::Camera camera;
    camera.type = scene::Camera::Type::kOrthographic;
    camera.x_mag = 3, camera.y_mag = 2;
    test::add_camera(capture, {0, 0, 7}, camera);
    capture.settings.environment = 0.0f;
    capture.settings.background = Vec3(0.2f, 0.3f, 0.4f);
  }
};

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

// Pixels of the pane that the sphere does not hide.
bool in_pane(int x, int y) { return x >= 8 && x < 30 && y > 14 && y < 50; }

// A pane seen head-on passes all light that it does not reflect, single and multiple reflections included: the same
// share of everything.
TEST(Transmission, APaneDimsItsBackgroundByItsReflectance) {
  const FrameResult with = frame_of(Window(glass()).capture), without = frame_of(Window(glass(), false).capture);
  const auto shares = shaders::layered_shares(shaders::environment_reflectance(0.0f, 1.0f), 0.04f, 1.0f);
  const float passes = 1 - shares.single - shares.multiple;
  ASSERT_GT(passes, 0.9f);
  // A pixel is shaded near its middle: it shows a little of its neighbours, too.
  Vec3 sum(0.0f), sum_behind(0.0f);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      if (!in_pane(x, y)) continue;
      Vec3 least(1e9f), most(0.0f);
      for (int j = y - 1; j <= y + 1; ++j)
        for (int i = x - 1; i <= x + 1; ++i)
          least = glm::min(least, pixel(without, i, j)), most = glm::max(most, pixel(without, i, j));
      const Vec3 seen = pixel(with, x, y);
      for (int c = 0; c < 3; ++c) {
        ASSERT_GE(seen[c], least[c] * passes - 2e-3f) << x << "," << y;
        ASSERT_LE(seen[c], most[c] * passes + 2e-3f) << x << "," << y;
      }
      sum += seen, sum_behind += pixel(without, x, y);
    }
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(sum[c] / sum_behind[c], passes, 0.005f);
}

// Beer's law: a pane of thickness d leaves colour^(d / distance) of the light that a clear one passes.
TEST(Transmission, AVolumeAbsorbsByBeersLaw) {
  scene::Material clear = glass(), tinted = glass();
  for (scene::Material* m : {&clear, &tinted}) {
    m->effects[static_cast<std::size_t>(MaterialEffect::kVolume)] = true;
    m->volume.thickness = 0.5f;
  }
  tinted.volume.attenuation_distance = 0.25f;
  tinted.volume.attenuation_color = {0.9f, 0.5f, 0.2f};
  const FrameResult a = frame_of(Window(clear).capture), b = frame_of(Window(tinted).capture);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      if (!in_pane(x, y)) continue;
      for (int c = 0; c < 3; ++c) {
        const float left = std::pow(tinted.volume.attenuation_color[c], 2.0f);
        ASSERT_NEAR(pixel(b, x, y)[c], pixel(a, x, y)[c] * left, 2e-3f * left) << x << "," << y;
      }
    }
}

// A tilted slab shifts its background by thickness times the refracted direction's share across the view.
TEST(Transmission, ARefractedRayEndsWhereSnellsLawSays) {
  scene::Material m = glass();
  m.effects[static_cast<std::size_t>(MaterialEffect::kVolume)] = true;
  m.volume.thickness = 0.8f;
  Window window(m);
  constexpr double kTilt = 0.6;
  window.capture.nodes[static_cast<std::size_t>(window.pane)].transform.rotation =
      glm::angleAxis(kTilt, DVec3(0, 1, 0));
  const FrameResult with = frame_of(window.capture), without = frame_of(Window(m, false).capture);
  // Refraction of the ray along -z below a surface whose normal is (sin, 0, cos) of the tilt.
  const double inside = std::asin(std::sin(kTilt) / 1.5), across = -0.8 * std::sin(kTilt - inside);
  const double shift = across * kHeight / 4;  // the camera sees four units over its height
  // Correlates rows with shifted ones: the best shift is Snell's.
  double best = 0, least = 1e9;
  for (int step = -120; step <= 120; ++step) {
    const double at = step * 0.05;
    double difference = 0;
    for (int y = 16; y < 48; ++y)
      for (int x = 14; x < 26; ++x) {
        const double from = x + at, whole = std::floor(from), part = from - whole;
        const Vec3 seen = pixel(with, x, y), left = pixel(without, static_cast<int>(whole), y),
                   right = pixel(without, static_cast<int>(whole) + 1, y);
        const Vec3 there = glm::mix(left, right, static_cast<float>(part));
        for (int c = 0; c < 3; ++c) difference += static_cast<double>(std::abs(seen[c] / 0.95f - there[c]));
      }
    if (difference < least) least = difference, best = at;
  }
  EXPECT_NEAR(best, shift, 0.2);
  EXPECT_GT(std::abs(shift), 1.5);
}

// A rough pane shows the mean of a neighbourhood: the rougher, the less contrast, of the same mean.
TEST(Transmission, RoughPanesBlur) {
  double before = 1e9, mean_before = 0;
  for (const float roughness : {0.0f, 0.25f, 0.5f, 1.0f}) {
    scene::Material m = glass();
    m.roughness = roughness;
    const FrameResult frame = frame_of(Window(m).capture);
    double sum = 0, squares = 0, count = 0;
    for (int y = 16; y < 48; ++y)
      for (int x = 10; x < 28; ++x) {
        const auto value = static_cast<double>(pixel(frame, x, y).y);
        sum += value, squares += value * value, ++count;
      }
    const double mean = sum / count, spread = squares / count - mean * mean;
    EXPECT_LT(spread, before * 0.97) << roughness;
    if (mean_before > 0) {
      EXPECT_NEAR(mean, mean_before, 0.25 * mean_before) << roughness;
    }
    before = spread, mean_before = mean;
  }
}

// Something in front of a pane is not seen through it; something that blends, neither.
TEST(Transmission, OnlyOpaqueSurfacesAreSeenThroughGlass) {
  Window window(glass());
  scene::Material veil;
  veil.alpha_mode = scene::AlphaMode::kBlend;
  veil.unlit = true;
  veil.base_color = {1, 0, 0, 0.5f};
  Window veiled(glass());
  test::add_node(veiled.capture, sheet(1.0f, test::add_material(veiled.capture, veil)), {-1.2, 0, 0.5});
  const FrameResult plain = frame_of(window.capture), behind = frame_of(veiled.capture);
  EXPECT_EQ(pixel(plain, 15, 32), pixel(behind, 15, 32));
  // A veil before the pane blends over the pane's colour.
  Window before(glass());
  test::add_node(before.capture, sheet(1.0f, test::add_material(before.capture, veil)), {-1.2, 0, 1.5});
  const Vec3 seen = pixel(frame_of(before.capture), 15, 32), pane = pixel(plain, 15, 32);
  EXPECT_NEAR(seen.x, 0.5f + 0.5f * pane.x, 1e-3f);
  EXPECT_NEAR(seen.y, 0.5f * pane.y, 1e-3f);
}

Capture moving_panes() {
  scene::Material rough = glass(), thick = glass();
  rough.roughness = 0.4f;
  thick.effects[static_cast<std::size_t>(MaterialEffect::kVolume)] = true;
  thick.effects[static_cast<std::size_t>(MaterialEffect::kDispersion)] = true;
  thick.volume.thickness = 0.3f, thick.dispersion.strength = 2;
  Window window(rough);
  const int sphere =
      test::add_node(window.capture, test::closed_patches(test::add_material(window.capture, thick)), {0.9, -0.4, 1.5});
  test::add_motion(window.capture, sphere, {1.5, 1.0, 0});
  window.capture.settings.environment = 1.0f;
  window.capture.settings.background.reset();
  window.capture.settings.frame_rate = 8;
  return std::move(window.capture);
}

// Invariant TR1.
TEST(Transmission, TR1TheFrameIsTheSameForAnyTiles) {
  const Capture capture = moving_panes();
  const FrameResult expected = frame_of(capture);
  EXPECT_GT(expected.counters.transmission.tiles_again, 0u);
  const std::vector<std::vector<std::string>> machines = {
      {"tile.width=16", "tile.height=16"},
      {"tile.width=64", "tile.height=32"},
      {"tilecore.tile_order=rows"},
      {"parameter_buffer.bytes=4608", "tessellator.sub_patch_cells=4", "tile.width=16", "tile.height=16"},
      {"effects.motion=on"}};
  for (const std::vector<std::string>& machine : machines) {
    const FrameResult found = frame_of(capture, machine);
    EXPECT_TRUE(found.targets.color.values == expected.targets.color.values) << machine[0];
  }
  for (const std::size_t count : {1u, 5u})
    with_threads(count, [&] {
      const FrameResult found = frame_of(capture);
      EXPECT_TRUE(found.targets.color.values == expected.targets.color.values) << count << " threads";
      EXPECT_EQ(found.counters.ledger.total().read_bytes, expected.counters.ledger.total().read_bytes);
    });
}

// The check notices a change behind the panes.
TEST(Transmission, TR1NoticesAChangeBehindPanes) {
  Capture capture = moving_panes();
  const FrameResult expected = frame_of(capture);
  for (scene::Material& m : capture.materials)
    if (m.unlit) m.base_color.x *= 0.5f;
  EXPECT_FALSE(frame_of(capture).targets.color.values == expected.targets.color.values);
  EXPECT_NE(pixel(frame_of(capture), 15, 32), pixel(expected, 15, 32));
}

// Invariant TR2.
TEST(Transmission, TR2WithoutAnythingThatTransmitsThereIsOnePass) {
  const FrameResult frame = frame_of(Window(glass(), false).capture);
  EXPECT_EQ(frame.counters.transmission.pixels_kept, 0u);
  EXPECT_EQ(frame.counters.ledger.traffic(Unit::kResolve, Purpose::kSceneColor).written_bytes, 0u);
  ASSERT_TRUE(frame.model);
  EXPECT_EQ(frame.model->record.work.rounds.size(), 1u);
}

// Traffic of the passes: each level is written once, 8 bytes a texel in whole bursts; each but the last is read once.
// Tiles that the pane may touch are rendered twice.
TEST(Transmission, ThePassesAreCharged) {
  const FrameResult frame = frame_of(Window(glass()).capture);
  std::uint64_t written = 0, read = 0, reduced = 0;
  const auto chain = shaders::RadianceImage::mip_chain({kWidth, kHeight});
  for (std::size_t level = 0; level < chain.size(); ++level) {
    const auto texels = static_cast<std::uint64_t>(chain[level].width * chain[level].height);
    written += round_up(8 * texels, 64);
    if (level + 1 < chain.size()) read += round_up(8 * texels, 64), reduced += texels;
  }
  const memory::Traffic image = frame.counters.ledger.traffic(Unit::kResolve, Purpose::kSceneColor);
  EXPECT_EQ(image.written_bytes, written);
  EXPECT_EQ(image.read_bytes, read);
  EXPECT_EQ(frame.counters.transmission.pixels_kept, static_cast<std::uint64_t>(kWidth * kHeight));
  EXPECT_EQ(frame.counters.transmission.texels_reduced, reduced);
  EXPECT_GT(frame.counters.transmission.tiles_again, 0u);
  EXPECT_LT(frame.counters.transmission.tiles_again, 6u) << "of 3 x 2 tiles";
  const EffectPlaces& places = frame.effect_places.at("transmission");
  EXPECT_GT(places.sub_patches, 0u);
  EXPECT_GT(places.tiles, 0u);
  EXPECT_LE(places.tiles, frame.counters.transmission.tiles_again) << "lists are exact";
  EXPECT_EQ(frame.counters.ledger.traffic(Unit::kTilecore, Purpose::kTileState).written_bytes, 0u);
  // Panes read the image as a texture; the board's is small.
  EXPECT_GT(frame.counters.texture.texels, frame_of(Window(glass(), false).capture).counters.texture.texels);
  ASSERT_TRUE(frame.model);
  ASSERT_EQ(frame.model->record.work.rounds.size(), 3u) << "background, its levels, transmissive surfaces";
  std::uint64_t pixels = 0, operations = 0;
  for (const timing::WorkRound& round : frame.model->record.work.rounds)
    for (const timing::TileWork& tile : round.tiles)
      pixels += tile.events[hardware::Event::kPixels], operations += tile.events[hardware::Event::kResolveOperations];
  EXPECT_EQ(pixels, static_cast<std::uint64_t>(2 * kWidth * kHeight)) << "kept, and finished";
  EXPECT_EQ(operations, reduced);
}

TEST(Transmission, ARegionIsRefusedAndDesamplingLeftOut) {
  const Window window(glass());
  EXPECT_THROW(Device(window.capture, {}, {}, {kWidth, kHeight, {0, 0, 32, 32}}), UsageError);
  const FrameResult plain = frame_of(window.capture),
                    adaptive = frame_of(window.capture, {"resolve.desampling=adaptive"});
  EXPECT_TRUE(plain.targets.color.values == adaptive.targets.color.values);
  EXPECT_FALSE(adaptive.effects.at("desampling"));
  EXPECT_NE(adaptive.effect_reasons.at("desampling").find("transmit"), std::string::npos);
}

// The scene-color image is stored anew in each frame: cached lines of the previous frame's image are dropped.
TEST(Transmission, AStoreDropsTheLinesThatCachesHold) {
  GpuConfiguration gpu;
  RunSettings settings;
  apply_setting("machine.timing=events", settings, gpu);
  const FrameResult frame = frame_of(Window(glass()).capture, {"machine.timing=events"});
  timing::FrameWork work = frame.model->record.work;
  ASSERT_EQ(work.stored_lines.size(), 1u);
  const auto second_misses = [&] {
    timing::WarmCaches caches;
    timing::simulate_events(gpu, work, &caches);
    return timing::simulate_events(gpu, work, &caches).counts.memory.l2_misses;
  };
  const std::uint64_t dropped = second_misses();
  work.stored_lines.clear();
  EXPECT_GT(dropped, second_misses());
}

}  // namespace
}  // namespace tessera::gpu::transmission_test
