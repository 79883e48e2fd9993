// Shadows of lights from their maps: closed forms of their places, lookups without a bias, the cost of their passes.
#include "base/error.h"
#include "base/parallel.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "scene/light_views.h"
#include "scene/limits.h"
#include "tests/support/tests.h"

namespace tessera::gpu::shadows_test {
namespace {

using memory::Purpose;
using memory::Unit;
using scene::Capture;
using shaders::Light;

constexpr int kSide = 128;
constexpr double kHalf = 4;  // half the side of the camera's view, scene units

using scene::made::looking;

int add_light(Capture& capture, const Light& light, const DVec3& place, const DVec3& direction) {
  return scene::made::add_light(capture, light, place, direction, {.size = 256});
}

scene::Material white() {
  scene::Material m;
  m.metallic = 0, m.roughness = 1;
  m.double_sided = true;
  return m;
}

// A square of the plane y = 0, and around it.
scene::Primitive square(double half, int material) {
  const auto h = static_cast<float>(half);
  return test::triangles({{-h, 0, h}, {h, 0, h}, {h, 0, -h}, {-h, 0, -h}}, {0, 1, 2, 0, 2, 3}, material);
}

// A floor seen from above, and a card over it.
struct Floor {
  Capture capture;
  int card = 0, camera = 0;

  explicit Floor(const DVec3& card_at = DVec3(0, 2, 0), double card_half = 0.75) {
    const int material = test::add_material(capture, white());
    test::add_node(capture, square(3 * kHalf, material));
    card = test::add_node(capture, square(card_half, material), card_at);
    scene::Camera lens;
    lens.type = scene::Camera::Type::kOrthographic;
    lens.x_mag = lens.y_mag = static_cast<float>(kHalf);
    camera = test::add_camera(capture, {0, 10, 0}, lens);
    capture.nodes[static_cast<std::size_t>(camera)].transform.rotation = looking({0, -1, 0});
    capture.settings.environment = 0.0f;
    capture.settings.background = Vec3(0.0f);
  }
};

void open_shutter(Capture& capture) {
  capture.settings.frame_rate = 1;
  capture.settings.shutter_close = 1;
}

FrameResult frame_of(const Capture& capture, const std::vector<std::string>& keys = {}, int frame = 0) {
  RunSettings settings;
  GpuConfiguration gpu;
  for (const std::string& key : keys) apply_setting(key, settings, gpu);
  return Device(capture, gpu, settings, {kSide, kSide, {0, 0, kSide, kSide}}).render(frame);
}

// How much of the light that there is without shadows every pixel has.
std::vector<double> lit_shares(const Capture& capture, std::vector<std::string> keys = {}) {
  const FrameResult with = frame_of(capture, keys);
  keys.emplace_back("effects.shadows=off");
  const FrameResult without = frame_of(capture, keys);
  std::vector<double> shares;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const double all = static_cast<double>(without.targets.color.at(x, y)[0]);
      shares.push_back(all > 0 ? static_cast<double>(with.targets.color.at(x, y)[0]) / all : 0.0);
    }
  return shares;
}

// The middle of a pixel on the floor: x to the right, z down, as `looking` turns the camera.
DVec2 floor_place(int x, int y) {
  return {(x + 0.5 - kSide / 2) * 2 * kHalf / kSide, (y + 0.5 - kSide / 2) * 2 * kHalf / kSide};
}

// Signed distance to a square of the floor, negative inside, where the larger of two axes counts.
double to_square(const DVec2& place, const DVec2& middle, double half) {
  const DVec2 off = glm::abs(place - middle) - half;
  return std::max(off.x, off.y);
}

// Wrong pixels among the pixels that are farther than `margin` scene units from the shadow's edge and do not show the
// card.
struct Wrong {
  int lit = 0, dark = 0, looked_at = 0;
};
Wrong compare(const std::vector<double>& shares, const DVec2& middle, double half, double margin,
              const DVec2& card = DVec2(0, 0), double card_half = 0.75) {
  Wrong wrong;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const DVec2 place = floor_place(x, y);
      const double distance = to_square(place, middle, half);
      if (std::abs(distance) < margin || to_square(place, card, card_half) < 0.1) continue;
      const double share = shares[static_cast<std::size_t>(y * kSide + x)];
      ++wrong.looked_at;
      if (distance < 0 && share > 1e-6) ++wrong.lit;
      if (distance > 0 && share < 1 - 1e-6) ++wrong.dark;
    }
  return wrong;
}

class Filters : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, Filters, testing::Values("nearest", "2x2", "3x3"));

// A sun at 45 degrees moves the shadow of a card of height h by h.
TEST_P(Filters, ASunsShadowOfACardIsACardBesideIt) {
  Floor floor;
  add_light(floor.capture, {}, {0, 0, 0}, {1, -1, 0});
  const std::vector<double> shares = lit_shares(floor.capture, {"shadows.filter=" + GetParam()});
  // A map of 256 texels over the sphere around the view.
  const Wrong wrong = compare(shares, {2, 0}, 0.75, 0.3);
  EXPECT_EQ(wrong.lit, 0);
  EXPECT_EQ(wrong.dark, 0);
  EXPECT_GT(wrong.looked_at, kSide * kSide / 2);
}

// A lamp at height H over the middle throws the shadow of a card at height h larger by H / (H - h).
TEST_P(Filters, ALampsShadowOfACardIsLarger) {
  for (const Light::Type type : {Light::Type::kPoint, Light::Type::kSpot}) {
    Floor floor({0, 2, 0}, 0.5);
    Light lamp;
    lamp.type = type;
    lamp.color = Vec3(30.0f);
    lamp.cos_outer = 0.5f, lamp.cos_inner = 0.51f;
    add_light(floor.capture, lamp, {1, 6, 0}, {0, -1, 0});
    const std::vector<double> shares = lit_shares(floor.capture, {"shadows.filter=" + GetParam()});
    const Wrong wrong = compare(shares, {-0.5, 0}, 0.75, 0.2, {0, 0}, 0.5);
    EXPECT_EQ(wrong.lit, 0) << static_cast<int>(type);
    EXPECT_EQ(wrong.dark, 0) << static_cast<int>(type);
  }
}

// Known answer: without a bias the nearest depth lies before half of a tilted plane and behind the other half.
TEST(Shadows, WithoutABiasHalfOfAPlaneShadowsItself) {
  Floor floor({0, -1, 0});
  add_light(floor.capture, {}, {0, 0, 0}, {1, -1.3, 0.45});
  const auto dark_share = [&](const std::vector<std::string>& keys) {
    const std::vector<double> shares = lit_shares(floor.capture, keys);
    return static_cast<double>(std::ranges::count_if(shares, [](double s) { return s < 0.5; })) / (kSide * kSide);
  };
  EXPECT_NEAR(dark_share({"shadows.filter=nearest", "shadows.bias=0"}), 0.5, 0.05);
  for (const char* filter : {"shadows.filter=nearest", "shadows.filter=2x2", "shadows.filter=3x3"}) {
    EXPECT_EQ(dark_share({filter}), 0) << filter;
    EXPECT_EQ(dark_share({filter, "shadows.format=d16"}), 0) << filter;
  }
}

// Grazing light, too, and far from the world's origin.
TEST(Shadows, APlaneUnderAGrazingSunIsLitWhereverItIs) {
  for (const double away : {0.0, 1e6}) {
    Floor floor({0, -1, 0});
    add_light(floor.capture, {}, {0, 0, 0}, {1, -0.04, 0.3});
    for (std::size_t n = 0; n < floor.capture.nodes.size(); ++n)
      floor.capture.nodes[n].transform.translation += DVec3(away, 0.5 * away, -away);
    for (const char* filter : {"shadows.filter=nearest", "shadows.filter=2x2", "shadows.filter=3x3"})
      EXPECT_EQ(std::ranges::count_if(lit_shares(floor.capture, {filter}), [](double s) { return s < 1 - 1e-6; }), 0)
          << filter << " " << away;
  }
}

// Its failing twin: who cuts off the slope below the plane's gets stripes.
TEST(Shadows, ASlopeThatIsCutOffBelowThePlanesIsNotLit) {
  Floor floor({0, -1, 0});
  add_light(floor.capture, {}, {0, 0, 0}, {1, -0.04, 0.3});
  EXPECT_GT(std::ranges::count_if(lit_shares(floor.capture, {"shadows.max_slope=8"}), [](double s) { return s < 0.5; }),
            kSide * kSide / 20);
}

// ---- Motion and grids -------------------------------------------------------------------------------------------

int darker_than(const std::vector<double>& shares, double limit) {
  return static_cast<int>(std::ranges::count_if(shares, [&](double share) { return share > 0 && share < limit; }));
}

// Receivers that move are looked up where they are at the time of the map.
TEST(Shadows, AReceiverThatMovesDoesNotShadeItself) {
  for (const char* times : {"shadows.times=1", "shadows.times=3"}) {
    Floor scene({0, 2, 0}, 0.75);
    test::add_motion(scene.capture, 0, {0, -3, 0});
    test::add_motion(scene.capture, scene.card, {0.5, -3, 0});
    add_light(scene.capture, {}, {0, 0, 0}, {1, -0.3, 0});
    open_shutter(scene.capture);
    scene.capture.nodes[static_cast<std::size_t>(scene.card)].transform.translation.x = -40;
    EXPECT_EQ(darker_than(lit_shares(scene.capture, {times}), 0.999), 0) << times;
    EXPECT_GT(darker_than(lit_shares(scene.capture, {times, "shadows.bias=0", "shadows.filter=nearest"}), 0.999), 300);
  }
}

// A ball of patches, which is convex, turns under a sun.
TEST(Shadows, ABallDoesNotShadeItselfWhereGridsAreTheCameras) {
  for (const bool turns : {false, true}) {
    Floor scene({-40, 2, 0}, 0.75);
    scene::Material material = white();
    material.double_sided = false;
    const int ball =
        test::add_node(scene.capture, test::closed_patches(test::add_material(scene.capture, material)), {0, 3, 0});
    if (turns) test::add_turn(scene.capture, ball, {0.3f, 1, 0.2f}, 1.5f);
    scene.capture.nodes[static_cast<std::size_t>(ball)].transform.scale = DVec3(3.0);
    add_light(scene.capture, {}, {0, 0, 0}, {1, -1, 0});
    open_shutter(scene.capture);
    // On the half of the image where the ball's sides face the sun.
    const auto wrong = [&](const std::vector<std::string>& keys) {
      const std::vector<double> shares = lit_shares(scene.capture, keys);
      int count = 0;
      for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide / 2; ++x)
          if (std::hypot(x - kSide / 2 + 10, y - kSide / 2) < 20 &&
              shares[static_cast<std::size_t>(y * kSide + x)] < 0.999)
            ++count;
      return count;
    };
    // Cells are far larger in the image than in the map.
    const std::string coarse = "tessellation.target_edge_pixels=12", fine = "shadows.size=1024";
    EXPECT_EQ(wrong({coarse, fine}), 0) << turns;
    EXPECT_GT(wrong({coarse, fine, "shadows.grids=light"}), 10) << turns;
  }
}

// Known answer: the share of the shutter in which a card that moves is in the way.
TEST(Shadows, AMovingCastersShadowIsTheMeanOverTheShutter) {
  const auto worst = [](const char* times) {
    Floor scene({-3, 2, 0}, 0.75);
    test::add_motion(scene.capture, scene.card, {2, 0, 0});
    add_light(scene.capture, {}, {0, 0, 0}, {1, -1, 0});
    open_shutter(scene.capture);
    const std::vector<double> shares = lit_shares(scene.capture, {times});
    double off = 0;
    for (int x = 0; x < kSide; ++x) {
      const double place = (x + 0.5 - kSide / 2) * 2 * kHalf / kSide,
                   from = std::clamp((place - 0.75 + 1) / 2, 0.0, 1.0),
                   to = std::clamp((place + 0.75 + 1) / 2, 0.0, 1.0);
      // The card itself is seen left of its shadow.
      if (place > -0.2)
        off = std::max(off, std::abs(shares[static_cast<std::size_t>(kSide / 2 * kSide + x)] - (1 - (to - from))));
    }
    return off;
  };
  EXPECT_LT(worst("shadows.times=16"), 0.07);
  EXPECT_GT(worst("shadows.times=1"), 0.3);
}

TEST(Shadows, EveryTimeHasItsPasses) {
  Floor scene;
  add_light(scene.capture, {}, {0, 0, 0}, {1, -1, 0});
  open_shutter(scene.capture);
  const auto passes = [&] { return frame_of(scene.capture, {"shadows.times=4"}).passes.size(); };
  EXPECT_EQ(passes(), 2u) << "nothing moves: one map shows all times";
  test::add_motion(scene.capture, scene.camera, {0.5, 0, 0});
  EXPECT_EQ(passes(), 2u) << "the camera alone moves";
  test::add_motion(scene.capture, scene.card, {0.5, 0, 0});
  EXPECT_EQ(passes(), 5u);
}

TEST(Shadows, AMapStoresItsTexelsAndClearedTilesAreAFlag) {
  Floor floor;
  add_light(floor.capture, {}, {0, 0, 0}, {0, -1, 0.001});
  const FrameResult frame = frame_of(floor.capture);
  ASSERT_EQ(frame.passes.size(), 2u);
  EXPECT_EQ(frame.passes[0].name, "shadow 0.0");
  const FrameCounters& pass = frame.passes[0].counters;
  const memory::Traffic stored = pass.ledger.traffic(Unit::kResolve, Purpose::kShadowMap);
  const GpuConfiguration gpu;
  const std::uint64_t tiles = 256 * 256 / static_cast<std::uint64_t>(gpu.tile.width * gpu.tile.height);
  EXPECT_EQ(pass.shadows.texels_stored + pass.shadows.tiles_cleared * 256 * 256 / tiles, 256u * 256u);
  EXPECT_EQ(stored.written_bytes, 4 * pass.shadows.texels_stored + (tiles / 8 + 63) / 64 * 64);
  EXPECT_EQ(pass.shading.pixel_shader_invocations, 0u);
  EXPECT_GT(frame.passes[1].counters.ledger.traffic(Unit::kTilecore, Purpose::kShadowMap).read_bytes, 0u);
}

// An L2 that holds the frame fetches every line once.
TEST(Shadows, LinesThatAreLookedUpCountOnce) {
  Floor floor;
  add_light(floor.capture, {}, {0, 0, 0}, {0, -1, 0.001});
  for (const char* bytes : {"l2.bytes=8388608", "l2.bytes=4096"}) {
    const FrameResult frame = frame_of(floor.capture, {bytes});
    const FrameCounters& counters = frame.counters;
    const std::uint64_t fetched = counters.ledger.traffic(Unit::kTilecore, Purpose::kShadowMap).read_bytes / 64;
    EXPECT_GT(counters.shadows.lines_read, 0u);
    EXPECT_LE(counters.shadows.lines_read, 256u * 256u * 4u / 64u + 8u);
    if (std::string_view(bytes).ends_with("8388608"))
      EXPECT_EQ(counters.shadows.lines_read, fetched);
    else
      EXPECT_LT(counters.shadows.lines_read, fetched);
  }
}

// Known answer: traffic of storing an image of 4 bytes a pixel at 60 Hz. Arm's sample of render passes on a Mali-G71
// shows 554.8 MiB/s (581.7 MB/s) for it.
TEST(Shadows, StoringAnImageOfArmsSampleMovesTheBytesOfTheClosedForm) {
  Floor floor;
  floor.capture.settings.background = Vec3(0.1f, 0.2f, 0.3f);
  constexpr int kWidth = 2220, kHeight = 1080;
  RunSettings settings;
  GpuConfiguration gpu;
  apply_setting("frame_buffer.compression=none", settings, gpu);
  const FrameResult frame = Device(floor.capture, gpu, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}}).render(0);
  const std::uint64_t bytes = frame.counters.ledger.traffic(Unit::kResolve, Purpose::kFrameBuffer).written_bytes;
  EXPECT_EQ(bytes, 139u * 64 * 1080);  // rows of 2220 pixels begin at bursts: 4 B x 2220 x 1080 is 9590400
  const double megabytes = static_cast<double>(bytes) * 60e-6;
  EXPECT_NEAR(megabytes, 575.4, 0.002 * 575.4);
  EXPECT_NEAR(megabytes / 581.7, 1.0, 0.1);
}

// A still map in the second frame costs nothing, by elimination alone; the tiles that look it up do not change
// either.
TEST(Shadows, AStillMapIsNotRenderedAgain) {
  Floor floor;
  add_light(floor.capture, {}, {0, 0, 0}, {1, -1, 0});
  const auto second = [&](const std::string& elimination) {
    RunSettings settings;
    GpuConfiguration gpu;
    apply_setting("tile.rendering_elimination=" + elimination, settings, gpu);
    Device device(floor.capture, gpu, settings, {kSide, kSide, {0, 0, kSide, kSide}});
    device.render(0);
    return device.render(1);
  };
  const FrameResult eliminated = second("true"), rendered = second("false");
  EXPECT_GT(rendered.passes[0].counters.shadows.texels_stored, 0u);
  EXPECT_EQ(eliminated.passes[0].counters.shadows.texels_stored, 0u);
  EXPECT_EQ(eliminated.passes[0].counters.shadows.tiles_cleared, 0u);
  EXPECT_EQ(eliminated.passes[0].counters.ledger.traffic(Unit::kResolve, Purpose::kShadowMap).written_bytes, 0u);
  EXPECT_EQ(eliminated.passes[1].counters.elimination.tiles_eliminated, eliminated.maps.tiles.size());
  EXPECT_EQ(eliminated.targets.color.values, rendered.targets.color.values);
}

// A card that moves over a floor which rests: tiles that only its shadow reaches are rendered again, and pixels that it
// reaches or leaves are shaded anew.
TEST(Shadows, StillSurfacesAreRenderedAgainWhereAShadowMoves) {
  Floor floor({-1, 2, 0});
  add_light(floor.capture, {}, {0, 0, 0}, {1, -1, 0});
  scene::made::play(
      floor.capture,
      {.node = floor.card, .path = scene::AnimatedPath::kTranslation, .times = {0, 1}, .values = {-1, 2, 0, 2, 2, 0}});
  const auto frames = [&](const std::vector<std::string>& keys) {
    RunSettings settings;
    GpuConfiguration gpu;
    for (const std::string& key : keys) apply_setting(key, settings, gpu);
    Device device(floor.capture, gpu, settings, {kSide, kSide, {0, 0, kSide, kSide}});
    FrameResult last = device.render(0);
    for (int frame = 1; frame < 6; ++frame) last = device.render(frame);
    return last;
  };
  const FrameResult plain = frames({}), eliminated = frames({"tile.rendering_elimination=true"}),
                    advected = frames({"resolve.desampling=adaptive"});
  EXPECT_EQ(eliminated.targets.color.values, plain.targets.color.values);
  // Pixels in the shadow of now and of five frames before.
  double worst = 0;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const DVec2 place = floor_place(x, y);
      for (const DVec2& middle : {DVec2(1.5, 0), DVec2(1.0, 0)})
        if (to_square(place, middle, 0.75) < -0.2 && to_square(place, DVec2(-0.5, 0), 0.85) > 0)
          worst = std::max(worst, std::abs(static_cast<double>(advected.targets.color.at(x, y)[0]) -
                                           static_cast<double>(plain.targets.color.at(x, y)[0])));
    }
  EXPECT_LT(worst, 0.05);
}

// FSH1 and AT1 with tiles of shadow maps beside tiles of the image (gpu/cost_attribution.h), by both timing models.
TEST(Shadows, SharesOfDrawablesAddUpAndTilesBelongToTheImage) {
  Floor floor;
  add_light(floor.capture, {}, {0, 0, 0}, {1, -1, 0});
  for (const char* timing : {"machine.timing=phases", "machine.timing=events"}) {
    RunSettings settings;
    GpuConfiguration gpu;
    apply_setting(timing, settings, gpu);
    RenderRequest request{kSide, kSide, {0, 0, kSide, kSide}};
    request.attribute = true;
    const FrameResult frame = Device(floor.capture, gpu, settings, request).render(0);
    ASSERT_TRUE(frame.shares);
    timing::DrawableShare sum;
    for (const auto& [drawable, share] : frame.shares->drawables) sum += share;
    EXPECT_EQ(sum.dram_bytes, frame.model->record.work.dram_bytes()) << timing;
    EXPECT_NEAR(sum.cycles, frame.model->timing.cycles, 1e-6 * sum.cycles) << timing;
    EXPECT_NEAR(sum.energy_nj, frame.model->energy.total_nj(), 1e-6 * sum.energy_nj) << timing;
    EXPECT_EQ(frame.shares->traffic.size(), frame.maps.tiles.size());
    for (const timing::TileShare& tile : frame.shares->tiles) EXPECT_LT(tile.tile, frame.maps.tiles.size());
    std::set<std::uint32_t> numbers;
    for (const timing::WorkRound& round : frame.model->record.work.rounds)
      for (const timing::TileWork& tile : round.tiles) EXPECT_TRUE(numbers.insert(tile.tile).second) << tile.tile;
  }
}

// The effect is reported where it ran, with its reason (gpu/effect_report.cpp).
TEST(Shadows, AreReportedAsAnEffect) {
  Floor floor;
  EXPECT_FALSE(frame_of(floor.capture).effects.at("shadows"));
  add_light(floor.capture, {}, {0, 0, 0}, {1, -1, 0});
  const FrameResult frame = frame_of(floor.capture);
  EXPECT_TRUE(frame.effects.at("shadows"));
  EXPECT_EQ(frame.effect_reasons.at("shadows"), "1 of 1 lights cast");
  EXPECT_EQ(frame_of(floor.capture, {"effects.shadows=off"}).effect_reasons.at("shadows"), "effects.shadows=off");
}

// Limits before allocation (gpu/shadow_passes.cpp).
TEST(Shadows, TooManyLightsAndTooLargeMapsAreRefused) {
  Floor many;
  for (int k = 0; k < 17; ++k) add_light(many.capture, {}, {0, 0, 0}, {1, -1, 0});
  EXPECT_THROW(frame_of(many.capture), LimitError);
  Floor large;
  add_light(large.capture, {}, {0, 0, 0}, {1, -1, 0});
  large.capture.max_bytes = std::uint64_t{64} << 20;
  EXPECT_THROW(frame_of(large.capture, {"shadows.size=16384"}), scene::BudgetError);
}

TEST(Shadows, FramesAreTheSameOnAnyThreads) {
  Floor floor;
  add_light(floor.capture, {}, {0, 0, 0}, {1, -1, 0});
  const auto render = [&](std::size_t threads) {
    const ThreadLimit limit(threads);
    return frame_of(floor.capture);
  };
  const FrameResult one = render(1), four = render(4);
  EXPECT_EQ(one.targets.color.values, four.targets.color.values);
  EXPECT_EQ(one.counters.texture.cache_misses, four.counters.texture.cache_misses);
  EXPECT_EQ(one.model->timing.cycles, four.model->timing.cycles);
}

}  // namespace
}  // namespace tessera::gpu::shadows_test
