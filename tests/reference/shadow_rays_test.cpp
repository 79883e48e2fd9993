// Shadows of the reference renderer: against formulas, against themselves without the tree, against Embree.
#include "reference/shadow_rays.h"

#include <embree3/rtcore.h>

#include "gpu/view_inputs.h"
#include "reference/reference_renderer.h"
#include "tests/support/shadow_scenes.h"
#include "tests/support/tests.h"

namespace tessera::reference::shadow_rays_test {
namespace {

using scene::Capture;
using shaders::Light;
using test::floor_place;
using test::FloorScene;
using test::kFloorHalf;

constexpr int kSide = 64;
constexpr double kPixel = 2 * kFloorHalf / kSide;

// A capture posed for the reference.
struct Posed {
  explicit Posed(const Capture& capture_in, int side = kSide, int number = 0,
                 scene::ShadowCasters casters = scene::ShadowCasters::kAuto)
      : capture(capture_in), assembly(scene::assemble(capture)) {
    settings.effects.shadows = casters;
    frame = scene::pose_frame(assembly, gpu::frame_camera(capture, settings, side, side),
                              gpu::frame_request(capture, gpu, settings, side, side, number));
  }
  const Capture& capture;
  gpu::RunSettings settings;
  gpu::GpuConfiguration gpu;
  scene::Assembly assembly;
  std::unique_ptr<scene::FrameGeometry> frame;
};

Image image_of(const Capture& capture, const std::optional<scene::ShadowSettings>& shadows, int samples,
               scene::ShadowCasters casters = scene::ShadowCasters::kAuto) {
  const Posed posed(capture, kSide, 0, casters);
  ReferenceRequest request;
  request.lighting = gpu::frame_lighting(capture);
  request.background = gpu::frame_background(capture);
  request.shadows = shadows;
  request.samples = {samples};
  return render_reference(*posed.frame, request).front();
}

// How much of the light that there is without shadows every pixel has.
std::vector<double> lit_shares(const Capture& capture, int samples = 32, const scene::ShadowSettings& settings = {}) {
  const Image with = image_of(capture, settings, samples), without = image_of(capture, std::nullopt, samples);
  std::vector<double> shares;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const double all = static_cast<double>(without.at(x, y)[0]);
      shares.push_back(all > 0 ? static_cast<double>(with.at(x, y)[0]) / all : 0.0);
    }
  return shares;
}

// Signed distance to a square of the floor, negative inside, where the larger of two axes counts.
double to_square(const DVec2& place, const DVec2& middle, double half) {
  const DVec2 off = glm::abs(place - middle) - half;
  return std::max(off.x, off.y);
}

// Wrong pixels among the pixels that the edge of a square shadow does not cross and that do not show the card.
struct Wrong {
  int lit = 0, dark = 0, looked_at = 0;
};
Wrong compare(const std::vector<double>& shares, const DVec2& middle, double half, const DVec2& card,
              double card_half) {
  Wrong wrong;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const DVec2 place = floor_place(x + 0.5, y + 0.5, kSide);
      const double distance = to_square(place, middle, half);
      if (std::abs(distance) <= 0.5 * kPixel || to_square(place, card, card_half) <= 0.5 * kPixel) continue;
      const double share = shares[static_cast<std::size_t>(y * kSide + x)];
      ++wrong.looked_at;
      if (distance < 0 && share != 0.0) ++wrong.lit;
      if (distance > 0 && share != 1.0) ++wrong.dark;
    }
  return wrong;
}

Light lamp(Light::Type type) {
  Light out;
  out.type = type;
  out.color = Vec3(30.0f);
  out.cos_outer = 0.5f, out.cos_inner = 0.51f;
  return out;
}

// ---- Formulas ---------------------------------------------------------------------------------------------------

// A sun at 45 degrees moves the shadow of a card of height h by h; a lamp at height H throws it larger by H / (H - h).
TEST(ShadowRays, ACardsShadowIsExactToThePixelWhereverItIs) {
  for (const double away : {0.0, 1e6}) {
    const DVec3 shift(away, 0.5 * away, -away);
    {
      FloorScene scene;
      scene.add_card({0.03, 2, 0}, 0.75);
      scene::made::add_light(scene.capture, {}, {0, 0, 0}, {1, -1, 0});
      scene.move(shift);
      const Wrong wrong = compare(lit_shares(scene.capture), {2.03, 0}, 0.75, {0.03, 0}, 0.75);
      EXPECT_EQ(wrong.lit + wrong.dark, 0) << away;
      EXPECT_GT(wrong.looked_at, kSide * kSide * 3 / 4);
    }
    for (const Light::Type type : {Light::Type::kPoint, Light::Type::kSpot}) {
      FloorScene scene;
      scene.add_card({0, 2, 0}, 0.5);
      scene::made::add_light(scene.capture, lamp(type), {1, 6, 0}, {0, -1, 0});
      scene.move(shift);
      const Wrong wrong = compare(lit_shares(scene.capture), {-0.5, 0}, 0.75, {0, 0}, 0.5);
      EXPECT_EQ(wrong.lit + wrong.dark, 0) << static_cast<int>(type) << " " << away;
    }
  }
}

// A sphere's shadow is an ellipse of area pi r^2 / sin e under a sun at elevation e.
TEST(ShadowRays, ASpheresShadowHasTheAreaOfAnEllipse) {
  constexpr int kColumns = 256, kRows = 128, kSamples = 64;
  constexpr double kRadius = 0.7;
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> indices;
  for (int j = 0; j <= kRows; ++j)
    for (int i = 0; i <= kColumns; ++i) {
      const double a = std::numbers::pi * j / kRows, b = 2 * std::numbers::pi * i / kColumns;
      vertices.push_back(Vec3(kRadius * DVec3(std::sin(a) * std::cos(b), std::cos(a), std::sin(a) * std::sin(b))));
      if (i == kColumns || j == kRows) continue;
      const auto at = static_cast<std::uint32_t>(j * (kColumns + 1) + i);
      for (const std::uint32_t v : {at, at + 1, at + kColumns + 1, at + 1, at + kColumns + 2, at + kColumns + 1})
        indices.push_back(v);
    }
  for (const double elevation : {0.6, 0.9}) {
    FloorScene scene;
    // Its shadow falls beside it: in the middle of the image.
    const double height = 3;
    test::add_node(scene.capture, test::triangles(vertices, indices, scene.white),
                   {-height / std::tan(elevation), height, 0});
    scene::made::add_light(scene.capture, {}, {0, 0, 0}, {std::cos(elevation), -std::sin(elevation), 0});
    const std::vector<double> shares = lit_shares(scene.capture, kSamples);
    double area = 0;
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x)
        if (std::abs(floor_place(x, y, kSide).x) < 2)
          area += (1 - shares[static_cast<std::size_t>(y * kSide + x)]) * kPixel * kPixel;
    const double expected = std::numbers::pi * kRadius * kRadius / std::sin(elevation);
    // Pixels on the edge: their number times the variance of a share of n samples, at most 1/4n each.
    const double edge = 2 * std::numbers::pi * kRadius / std::sin(elevation) / kPixel * 1.5,
                 noise = std::sqrt(edge / (4 * kSamples)) * kPixel * kPixel;
    EXPECT_NEAR(area, expected, 4 * noise + 5e-4 * expected) << elevation;
  }
}

// A caster moves while the shutter is open: every place of the floor has the share of the time at which its shadow is
// elsewhere. The twin has the shadow of shutter open.
TEST(ShadowRays, AMovingCastersShadowIsTheMeanOverTheShutter) {
  constexpr int kSamples = 256;
  constexpr double kHalf = 0.75, kFrom = -1, kWay = 2;  // the middle of the shadow at shutter open, and its way
  FloorScene scene;
  const int card = scene.add_card({kFrom - 2, 2, 0}, kHalf);
  scene::made::add_light(scene.capture, {}, {0, 0, 0}, {1, -1, 0});
  test::add_motion(scene.capture, card, DVec3(kWay, 0, 0));
  scene.capture.settings.frame_rate = 1;
  scene.capture.settings.shutter_close = 1;
  const std::vector<double> shares = lit_shares(scene.capture, kSamples);
  double worst_twin = 0;
  for (int x = 0; x < kSide; ++x) {
    // The card hides the floor left of its edge.
    if (floor_place(x, 0, kSide).x < kFrom - 2 + kWay + kHalf) continue;
    double sum = 0, expected = 0, at_open = 0;
    int rows = 0;
    for (int y = 0; y < kSide; ++y) {
      if (std::abs(floor_place(0, y + 0.5, kSide).y) > kHalf - kPixel) continue;
      sum += shares[static_cast<std::size_t>(y * kSide + x)];
      ++rows;
    }
    constexpr int kSteps = 64;
    for (int a = 0; a < kSteps; ++a)
      for (int t = 0; t < kSteps; ++t) {
        const double place = floor_place(x + (a + 0.5) / kSteps, 0, kSide).x;
        const auto lit = [&](double middle) { return std::abs(place - middle) > kHalf ? 1.0 : 0.0; };
        expected += lit(kFrom + kWay * (t + 0.5) / kSteps) / (kSteps * kSteps);
        at_open += lit(kFrom) / (kSteps * kSteps);
      }
    const double tolerance = 5 * std::sqrt(std::max(expected * (1 - expected), 1e-9) / (rows * kSamples)) + 2e-3;
    EXPECT_NEAR(sum / rows, expected, tolerance) << "column " << x;
    worst_twin = std::max(worst_twin, std::abs(sum / rows - at_open) / tolerance);
  }
  EXPECT_GT(worst_twin, 10);
}

// A node looks along one direction, and along another one a second later.
void turn(Capture& capture, int node, const DVec3& from, const DVec3& to) {
  const DQuat first = scene::made::looking(from), last = scene::made::looking(to);
  scene::AnimationChannel channel{
      .node = node, .path = scene::AnimatedPath::kRotation, .components = 4, .times = {0, 1}, .values = {}};
  for (const DQuat& q : {first, last})
    for (const double value : {q.x, q.y, q.z, q.w}) channel.values.push_back(static_cast<float>(value));
  scene::made::play(capture, channel);
}

// A light moves: the shadow is where it throws it at the time of each sample.
TEST(ShadowRays, AMovingLightsShadowFollowsTheTime) {
  constexpr double kHeight = 2, kHalf = 0.5;
  for (const bool sun : {true, false}) {
    FloorScene scene;
    scene.add_card({0, kHeight, 0}, kHalf);
    const DVec3 place(-1, 6, 0.5), way(2.5, 1, -1);
    if (sun)
      turn(scene.capture, scene::made::add_light(scene.capture, {}, {0, 0, 0}, {1, -1, 0}), {1, -1, 0},
           {-0.2, -1, 0.4});
    else
      test::add_motion(scene.capture,
                       scene::made::add_light(scene.capture, lamp(Light::Type::kPoint), place, {0, -1, 0}), way);
    scene.capture.settings.frame_rate = 1;
    scene.capture.settings.shutter_close = 1;
    const Posed posed(scene.capture);
    const ReferenceScene seen(*posed.frame);
    const ShadowScene shadows(seen, {});
    // The directions at both keys, as nodes have them; in between light mixes them.
    std::array<DVec3, 2> direction;
    for (std::size_t key = 0; key < 2; ++key)
      direction[key] = -DVec3(posed.frame->poses[key].world[static_cast<std::size_t>(posed.frame->light_nodes[0])][2]);
    test::Random random(5);
    std::vector<ShadowReceiver> receivers;
    std::vector<bool> expected;
    int dark = 0;
    while (receivers.size() < 4000) {
      const double t = static_cast<double>(random.uniform(0, 1));
      const DVec3 at(static_cast<double>(random.uniform(-4, 4)), 0, static_cast<double>(random.uniform(-4, 4)));
      const DVec3 to_light = sun ? -(direction[0] * (1 - t) + direction[1] * t) : place + way * t - at,
                  through = at + to_light * (kHeight / to_light.y);
      const double distance = to_square({through.x, through.z}, {0, 0}, kHalf);
      if (std::abs(distance) < 1e-6) continue;
      const double scale = posed.frame->projection.scale;
      receivers.push_back({DVec3(at.x * scale, at.z * scale, 10), t, t, 0xFFFFFFFFu, 0xFFFFFFFFu});
      expected.push_back(distance < 0);
      dark += distance < 0 ? 1 : 0;
    }
    ASSERT_GT(dark, 20);
    ShadowTracer tracer;
    tilecore::KnownShadows shares;
    tracer.trace(shadows, receivers, shares);
    int wrong = 0, wrong_twin = 0;
    for (std::size_t k = 0; k < receivers.size(); ++k) wrong += (shares.by_light[0][k] == 0.0f) != expected[k] ? 1 : 0;
    EXPECT_EQ(wrong, 0) << sun;
    // The twin: all at shutter open.
    for (ShadowReceiver& receiver : receivers) receiver.t = 0;
    tracer.trace(shadows, receivers, shares);
    for (std::size_t k = 0; k < receivers.size(); ++k)
      wrong_twin += (shares.by_light[0][k] == 0.0f) != expected[k] ? 1 : 0;
    EXPECT_GT(wrong_twin, 10) << sun;
  }
}

// Caster, receiver and camera move alike: nothing changes on screen but the light's place among them.
TEST(ShadowRays, CastersAndReceiversThatMoveTogetherHaveTheShadowOfRest) {
  FloorScene scene;
  const int card = scene.add_card({0, 2, 0}, 0.75);
  scene::made::add_light(scene.capture, {}, {0, 0, 0}, {1, -1, 0});
  for (const int node : {card, scene.floor, scene.camera}) test::add_motion(scene.capture, node, DVec3(3, -1, 2));
  scene.capture.settings.frame_rate = 1;
  scene.capture.settings.shutter_close = 1;
  const Wrong wrong = compare(lit_shares(scene.capture), {2, 0}, 0.75, {0, 0}, 0.75);
  EXPECT_EQ(wrong.lit + wrong.dark, 0);
}

// ---- Casters ----------------------------------------------------------------------------------------------------

// A card whose mask leaves its right half.
TEST(ShadowRays, AMaskCutsTheShadowAsItCutsTheCard) {
  FloorScene scene;
  Image8 mask(2, 1, 4);
  mask.values = {255, 255, 255, 0, 255, 255, 255, 255};
  scene::Material material = test::matt_white();
  material.alpha_mode = scene::AlphaMode::kMask;
  material.alpha_cutoff = 0.5f;
  material.base_color_texture.texture =
      std::make_shared<shaders::Texture>(DecodedImage{mask}, shaders::ColorSpace::kSrgb);
  material.base_color_texture.sampler.magnify_linear = false;
  const int masked = test::add_material(scene.capture, material);
  scene::Primitive card = test::rectangle(DVec2(-0.75), DVec2(0.75), masked);
  card.vertices.texcoords = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  test::add_node(scene.capture, card, {0, 2, 0});
  scene::made::add_light(scene.capture, {}, {0, 0, 0}, {1, -1, 0});
  const std::vector<double> shares = lit_shares(scene.capture);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const DVec2 place = floor_place(x + 0.5, y + 0.5, kSide),
                  off = glm::abs(place - DVec2(2.375, 0)) - DVec2(0.375, 0.75);
      const double distance = std::max(off.x, off.y);
      if (std::abs(distance) <= 0.5 * kPixel || to_square(place, {0, 0}, 0.75) <= 0.5 * kPixel) continue;
      EXPECT_EQ(shares[static_cast<std::size_t>(y * kSide + x)], distance < 0 ? 0.0 : 1.0) << place.x << " " << place.y;
    }
}

double dark_area(const Capture& capture, const scene::ShadowSettings& settings = {}) {
  double area = 0;
  for (const double share : lit_shares(capture, 4, settings)) area += (1 - share) * kPixel * kPixel;
  return area;
}

TEST(ShadowRays, CastersEqualTheMaps) {
  const auto area = [&](const std::function<void(scene::Material&)>& change,
                        const scene::ShadowSettings& settings = {}) {
    FloorScene scene;
    scene::Material material = test::matt_white();
    change(material);
    const int other = test::add_material(scene.capture, material);
    // Outside of the image.
    test::add_node(scene.capture, test::rectangle(DVec2(-1), DVec2(1), other), {-6, 6, 0});
    scene::made::add_light(scene.capture, {}, {0, 0, 0}, {1, -1, 0});
    return dark_area(scene.capture, settings);
  };
  const auto single = [](scene::Material& m) { m.double_sided = false; };
  const auto blended = [](scene::Material& m) { m.alpha_mode = scene::AlphaMode::kBlend; };
  EXPECT_NEAR(area([](scene::Material&) {}), 4.0, 0.1);
  EXPECT_EQ(area([](scene::Material& m) { m.unlit = true; }), 0.0);
  EXPECT_EQ(area(blended), 0.0);
  EXPECT_NEAR(area(blended, {.blended = scene::BlendedCasters::kSolid}), 4.0, 0.1);
  EXPECT_NEAR(area(single), 4.0, 0.1);
  // Its front is up, where the sun is.
  EXPECT_NEAR(area(single, {.faces = scene::CasterFaces::kFront}), 4.0, 0.1);
  EXPECT_EQ(area(single, {.faces = scene::CasterFaces::kBack}), 0.0);
}

// The sides that a light sees, from whichever direction it comes: the nearer half of a closed box, or the farther one.
TEST(ShadowRays, FrontAndBackFacesAreJudgedFromTheLight) {
  for (const DVec3& direction :
       {DVec3(1, -0.4, 0), DVec3(-1, -0.4, 0), DVec3(0.2, -1, 0.1), DVec3(0, -0.4, 1), DVec3(0.1, -0.4, -1)})
    for (const scene::CasterFaces faces : {scene::CasterFaces::kFront, scene::CasterFaces::kBack}) {
      FloorScene scene;
      scene::Material material = test::matt_white();
      material.double_sided = false;
      const int single = test::add_material(scene.capture, material);
      // A wall across the light whose front is where it comes from.
      const int node = test::add_node(scene.capture, test::rectangle(DVec2(-1), DVec2(1), single));
      scene::Node& wall = scene.capture.nodes[static_cast<std::size_t>(node)];
      const DVec3 back = -glm::normalize(direction);
      // Turns +y towards the light.
      wall.transform.rotation = scene::made::looking(direction) * glm::angleAxis(std::numbers::pi / 2, DVec3(1, 0, 0));
      wall.transform.translation = back * 12.0;
      scene::made::add_light(scene.capture, {}, {0, 0, 0}, direction);
      const double area = dark_area(scene.capture, {.faces = faces});
      if (faces == scene::CasterFaces::kFront)
        EXPECT_GT(area, 3.5) << direction.x;
      else
        EXPECT_EQ(area, 0.0) << direction.x;
    }
}

// ---- Where nothing is in the way --------------------------------------------------------------------------------

std::vector<ShadowReceiver> receivers_of(const ReferenceScene& scene, int count, std::uint32_t seed) {
  test::Random random(seed);
  std::vector<ShadowReceiver> receivers;
  const std::size_t triangles = scene.triangles.size();
  while (static_cast<int>(receivers.size()) < count) {
    const std::size_t number = static_cast<std::size_t>(random.integer(0, static_cast<int>(triangles) - 1));
    const auto leaf = std::upper_bound(scene.leaves.begin(), scene.leaves.end(), number,
                                       [](std::size_t n, const auto& l) { return n < l.first_triangle; }) -
                      1;
    const ReferenceScene::Triangle& triangle = scene.triangles[number];
    double b1 = static_cast<double>(random.uniform(0, 1)), b2 = static_cast<double>(random.uniform(0, 1));
    if (b1 + b2 > 1) b1 = 1 - b1, b2 = 1 - b2;
    const double t = static_cast<double>(random.uniform(0, 1));
    DVec3 at(0.0);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::array<double, 6>& v = scene.vertices[leaf->first_vertex + triangle.corner[k]];
      const double weight = k == 0 ? 1 - b1 - b2 : k == 1 ? b1 : b2;
      at += weight * ((1 - t) * DVec3(v[0], v[1], v[2]) + t * DVec3(v[3], v[4], v[5]));
    }
    receivers.push_back({at, t, t, triangle.patch, triangle.triangle});
  }
  return receivers;
}

int count_dark(const ShadowScene& shadows, std::span<const ShadowReceiver> receivers) {
  ShadowTracer tracer;
  tilecore::KnownShadows shares;
  tracer.trace(shadows, receivers, shares);
  int dark = 0;
  for (const std::vector<float>& light : shares.by_light) dark += static_cast<int>(std::ranges::count(light, 0.0f));
  return dark;
}

TEST(ShadowRays, APlaneUnderAGrazingSunIsLitWhereverItIs) {  // SHR2
  for (const double away : {0.0, 1e6})
    for (const double sine : {0.5, 0.04, 1e-4}) {
      FloorScene scene;
      // The floor in many triangles, which are each other's neighbours in one plane.
      scene.capture.nodes[static_cast<std::size_t>(scene.floor)].transform.scale = DVec3(1e-3);
      test::Random random(3);
      std::vector<Vec3> vertices;
      std::vector<std::uint32_t> indices;
      constexpr int kCells = 40;
      for (int j = 0; j <= kCells; ++j)
        for (int i = 0; i <= kCells; ++i) {
          vertices.push_back(Vec3(i + random.uniform(-0.3f, 0.3f), 0, j + random.uniform(-0.3f, 0.3f)) * 0.3f -
                             Vec3(6, 0, 6));
          if (i == kCells || j == kCells) continue;
          const auto at = static_cast<std::uint32_t>(j * (kCells + 1) + i);
          for (const std::uint32_t v : {at, at + 1, at + kCells + 1, at + 1, at + kCells + 2, at + kCells + 1})
            indices.push_back(v);
        }
      test::add_node(scene.capture, test::triangles(vertices, indices, scene.white));
      scene::made::add_light(scene.capture, {}, {0, 0, 0}, {1, -sine, 0.3});
      scene::made::add_light(scene.capture, lamp(Light::Type::kPoint), {20, 20 * sine, 1}, {0, -1, 0});
      scene.move({away, 0.5 * away, -away});
      const Posed posed(scene.capture);
      const ReferenceScene seen(*posed.frame);
      const ShadowScene shadows(seen, {});
      std::vector<ShadowReceiver> receivers = receivers_of(seen, 20000, 7);
      EXPECT_EQ(count_dark(shadows, receivers), 0) << away << " " << sine;
    }
}

// The twin: rays that may meet the triangle that they start on, from a little behind it.
TEST(ShadowRays, WhoStartsBehindItsTriangleIsDark) {
  FloorScene scene;
  scene::made::add_light(scene.capture, {}, {0, 0, 0}, {1, -0.5, 0.3});
  const Posed posed(scene.capture);
  const ReferenceScene seen(*posed.frame);
  const ShadowScene shadows(seen, {});
  std::vector<ShadowReceiver> receivers = receivers_of(seen, 1000, 7);
  for (ShadowReceiver& receiver : receivers) receiver.at.z += 1e-6, receiver.patch = 0xFFFFFFFFu;
  EXPECT_GT(count_dark(shadows, receivers), 900);
}

// The distance up to which a capture has maps is no property of the light.
TEST(ShadowRays, KnowNoDistance) {
  FloorScene scene;
  scene.add_card({0, 2, 0}, 0.75);
  scene::made::add_light(scene.capture, {}, {0, 0, 0}, {1, -1, 0});
  const double area = dark_area(scene.capture);
  EXPECT_GT(area, 1.5);
  scene.capture.settings.shadows.back().distance = 9.9;
  EXPECT_EQ(dark_area(scene.capture), area);
}

TEST(ShadowRays, UnnamedLightsCastOnRequest) {
  FloorScene scene;
  scene.add_card({0, 2, 0}, 0.75);
  scene::made::add_light(scene.capture, {}, {0, 0, 0}, {1, -1, 0});
  scene.capture.settings.shadows.clear();
  const Image lit = image_of(scene.capture, std::nullopt, 4);
  EXPECT_EQ(image_of(scene.capture, scene::ShadowSettings(), 4).values, lit.values);
  EXPECT_NE(image_of(scene.capture, scene::ShadowSettings(), 4, scene::ShadowCasters::kAll).values, lit.values);
  scene.capture.settings.shadows = {{.light = 0}};
  EXPECT_NE(image_of(scene.capture, scene::ShadowSettings(), 4).values, lit.values);
  EXPECT_EQ(image_of(scene.capture, scene::ShadowSettings(), 4, scene::ShadowCasters::kOff).values, lit.values);
}

// ---- The tree and Embree ----------------------------------------------------------------------------------------

// A soup of moving triangles, some of them masked, and a light of each kind, one of them moving.
Capture random_capture(std::uint32_t seed, bool masks) {
  test::Random random(seed);
  Capture capture;
  const int white = test::add_material(capture, test::matt_white());
  scene::Material cut = test::matt_white();
  cut.alpha_mode = masks ? scene::AlphaMode::kMask : scene::AlphaMode::kOpaque;
  cut.base_color.w = 0.3f;
  const int masked = test::add_material(capture, cut);
  for (int part = 0; part < 4; ++part) {
    std::vector<Vec3> vertices;
    std::vector<std::uint32_t> indices;
    for (int k = 0; k < 150; ++k) {
      const Vec3 middle = random.in_box(3);
      for (int c = 0; c < 3; ++c) {
        indices.push_back(static_cast<std::uint32_t>(vertices.size()));
        vertices.push_back(middle + random.in_box(0.6f));
      }
    }
    const int node = test::add_node(capture, test::triangles(vertices, indices, part % 2 == 0 ? white : masked));
    if (part >= 2) test::add_motion(capture, node, DVec3(random.in_box(1)));
  }
  test::add_camera(capture, {0, 0, 9}, {});
  scene::made::add_light(capture, {}, {0, 0, 0}, DVec3(random.in_box(1)));
  const int moving = scene::made::add_light(capture, lamp(Light::Type::kPoint), DVec3(random.in_box(2)), {0, -1, 0});
  test::add_motion(capture, moving, DVec3(random.in_box(1)));
  scene::made::add_light(capture, lamp(Light::Type::kSpot), DVec3(random.in_box(5)), {0, -1, 0.1});
  capture.settings.frame_rate = 1;
  capture.settings.shutter_close = 1;
  return capture;
}

TEST(ShadowRays, EqualASearchOfAllTriangles) {  // SHR1
  int different_twin = 0;
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    const Capture capture = random_capture(seed, true);
    const Posed posed(capture);
    const scene::ShadowSettings settings;
    ReferenceScene::Options only_casters;
    only_casters.casters = &settings;
    ReferenceScene casters(*posed.frame, only_casters);
    test::Random random(seed + 100);
    const auto different = [&](int packets) {
      int count = 0;
      for (int k = 0; k < packets; ++k) {
        ShadowPacket packet;
        packet.axis = k % 3, packet.light_above = random.coin();
        const double scale = posed.frame->projection.scale;
        const auto number = [&](double half) { return static_cast<double>(random.uniform(-1, 1)) * half; };
        for (std::size_t r = 0; r < ShadowPacket::kRays; ++r) {
          const DVec3 sizes = DVec3(3 * scale, 3 * scale, 3), from = DVec3(number(1), number(1), number(1)) * sizes,
                      to = DVec3(number(1), number(1), number(1)) * sizes;
          const int a = packet.axis, x = (a + 1) % 3, y = (a + 2) % 3;
          packet.direction_x[r] = (to[x] - from[x]) / (to[a] - from[a]);
          packet.direction_y[r] = (to[y] - from[y]) / (to[a] - from[a]);
          packet.origin_x[r] = from[x] - from[a] * packet.direction_x[r];
          packet.origin_y[r] = from[y] - from[a] * packet.direction_y[r];
          if (a == 2) packet.origin_x[r] -= 9 * packet.direction_x[r], packet.origin_y[r] -= 9 * packet.direction_y[r];
          packet.from[r] = (a == 2 ? 9 : 0) + std::min(from[a], to[a]);
          packet.to[r] =
              random.coin() ? std::numeric_limits<double>::infinity() : (a == 2 ? 9 : 0) + std::max(from[a], to[a]);
          packet.t[r] = static_cast<double>(random.uniform(0, 1));
          packet.patch[r] = packet.triangle[r] = 0xFFFFFFFFu;
        }
        ShadowPacket all = packet;
        trace_shadows(casters, packet);
        trace_shadows_without_tree(casters, all);
        const auto crossings_of = [](const ShadowPacket& p, std::size_t r) {
          std::vector<std::int64_t> numbers;
          for (const RayPacket::Crossing& c : p.crossings)
            if (c.ray == r) numbers.push_back(c.triangle);
          std::ranges::sort(numbers);
          return numbers;
        };
        for (std::size_t r = 0; r < ShadowPacket::kRays; ++r) {
          const bool same = packet.blocked[r] == all.blocked[r] &&
                            (all.blocked[r] != 0 || crossings_of(packet, r) == crossings_of(all, r));
          count += same ? 0 : 1;
        }
      }
      return count;
    };
    EXPECT_EQ(different(300), 0) << seed;
    // The twin: boxes that contain only a part of their children.
    for (ReferenceScene::Node& node : casters.nodes)
      for (ReferenceScene::Box& box : node.box) box.high[0] = 0.5f * (box.low[0] + box.high[0]);
    different_twin += different(100);
  }
  EXPECT_GT(different_twin, 0);
}

// The casters in Embree's hands, in scene units.
class EmbreeCasters {
 public:
  EmbreeCasters(const ReferenceScene& casters, double unit)
      : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryTimeStepCount(geometry, 2);
    const std::size_t count = casters.triangles.size();
    for (unsigned key = 0; key < 2; ++key) {
      auto* to = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, key, RTC_FORMAT_FLOAT3,
                                                             3 * sizeof(float), 3 * count));
      for (const ReferenceScene::Leaf& leaf : casters.leaves)
        for (std::size_t k = leaf.first_triangle; k < leaf.first_triangle + std::size_t{leaf.triangle_count}; ++k)
          for (std::size_t c = 0; c < 3; ++c) {
            const auto& v = casters.vertices[leaf.first_vertex + casters.triangles[k].corner[c]];
            for (std::size_t a = 0; a < 3; ++a)
              to[9 * k + 3 * c + a] = static_cast<float>(v[3 * key + a] * (a == 2 ? 1.0 : unit));
          }
    }
    auto* index = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), count));
    std::iota(index, index + 3 * count, 0u);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  EmbreeCasters(const EmbreeCasters&) = delete;
  EmbreeCasters& operator=(const EmbreeCasters&) = delete;
  ~EmbreeCasters() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  bool occluded(const DVec3& from, const DVec3& way, bool endless, double t, double skipped) const {
    RTCRay ray{};
    ray.org_x = static_cast<float>(from.x), ray.org_y = static_cast<float>(from.y),
    ray.org_z = static_cast<float>(from.z);
    ray.dir_x = static_cast<float>(way.x), ray.dir_y = static_cast<float>(way.y), ray.dir_z = static_cast<float>(way.z);
    ray.tnear = static_cast<float>(skipped / glm::length(way));
    ray.tfar = endless ? std::numeric_limits<float>::infinity() : 1.0f;
    ray.time = static_cast<float>(t);
    ray.mask = ~0u;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene_, &context, &ray);
    return ray.tfar < 0;
  }

 private:
  RTCDevice device_;
  RTCScene scene_;
};

TEST(ShadowRays, ReachALightWhereEmbreesDo) {
  int rays = 0, dark = 0, ties = 0, wrong = 0;
  for (std::uint32_t seed = 1; seed <= 6; ++seed) {
    const Capture capture = random_capture(seed, false);
    const Posed posed(capture);
    const ReferenceScene seen(*posed.frame,
                              {.region = SampleRegion::everything(posed.frame->projection, {0, 0, 1, 1})});
    const ShadowScene shadows(seen, {});
    const EmbreeCasters embree(shadows.casters(), shadows.unit());
    const DVec3 units(shadows.unit(), shadows.unit(), 1.0);
    std::vector<ShadowReceiver> receivers = receivers_of(seen, 5000, seed);
    // From a little away from the surface, so that Embree's does not meet it either.
    test::Random random(seed);
    for (ShadowReceiver& receiver : receivers) {
      receiver.at += DVec3(random.in_box(0.01f)) / units;
      receiver.patch = 0xFFFFFFFFu;
    }
    ShadowTracer tracer;
    tilecore::KnownShadows shares;
    tracer.trace(shadows, receivers, shares);
    for (const ShadowScene::Light& light : shadows.lights())
      for (std::size_t k = 0; k < receivers.size(); ++k) {
        const ShadowReceiver& r = receivers[k];
        const DVec3 end = (light.at[0] * (1 - r.t) + light.at[1] * r.t) * units, from = r.at * units;
        const bool blocked = shares.by_light[light.number][k] == 0.0f,
                   theirs = embree.occluded(from, light.directional ? end : end - from, light.directional, r.t, 0);
        ++rays, dark += blocked ? 1 : 0;
        if (blocked == theirs) continue;
        // A tie, if a ray from 1e-6 of the scene's size beside it is as Embree says.
        bool tie = false;
        for (int side = 0; side < 64 && !tie; ++side) {
          ShadowReceiver beside = r;
          beside.at += DVec3(random.in_box(1)) / units * 1e-5;
          tilecore::KnownShadows other;
          tracer.trace(shadows, std::span(&beside, 1), other);
          tie = (other.by_light[light.number][0] == 0.0f) == theirs;
        }
        ++(tie ? ties : wrong);
      }
  }
  EXPECT_EQ(wrong, 0) << ties << " ties of " << rays;
  EXPECT_LT(ties, rays / 1000);
  EXPECT_GT(dark, rays / 10);
  EXPECT_LT(dark, rays * 9 / 10);
}

}  // namespace
}  // namespace tessera::reference::shadow_rays_test
