// Light lists: images keep their bits for any lights and surfaces; making the lists is charged.
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

#include "gpu/counter_list.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "tests/support/lit_room.h"
#include "tests/support/tests.h"
#include "tilecore/shading/light_lists.h"

namespace tessera::gpu::light_lists_test {
namespace {

using scene::Capture;
using shaders::Light;
using test::add_lamp;
using tilecore::LightBound;
using tilecore::PlaceBox;
using Keys = std::vector<std::string>;

constexpr int kWidth = 128, kHeight = 96, kLamps = 40;

Light point(float range, Vec3 color = Vec3(2.0f)) {
  Light light;
  light.type = Light::Type::kPoint;
  light.color = color, light.range = range;
  return light;
}

Light spot(float range, float inner, float outer) {
  Light light = point(range, Vec3(6.0f));
  light.type = Light::Type::kSpot;
  light.cos_inner = std::cos(inner), light.cos_outer = std::cos(outer);
  return light;
}

scene::Material matt(Vec4 color = Vec4(0.8f, 0.7f, 0.6f, 1)) {
  scene::Material m;
  m.base_color = color, m.metallic = 0, m.roughness = 0.4f, m.double_sided = true;
  return m;
}

// A floor that runs away from the camera with boxes of patches on it, and small lamps over it in rows.
struct Hall {
  Capture capture;
  int floor = 0, ball = 0, camera = 0;
  std::vector<int> lamps;

  explicit Hall(const scene::Material& material = matt(), const DVec3& at = DVec3(0.0)) {
    const int number = test::add_material(capture, material);
    floor = test::add_node(capture, test::patches(test::flat_patch({-4, 0, 2}, {8, 0, 0}, {0, 0, -26}), number), at);
    ball = test::add_node(capture, scene::made::closed_patches(number), at + DVec3(1, 1, -6));
    camera = test::add_camera(capture, at + DVec3(0, 1.6, 3));
    test::Random random(7);
    for (int k = 0; k < kLamps; ++k) {
      const auto near = [&](double low, double high) {
        return static_cast<double>(random.uniform(static_cast<float>(low), static_cast<float>(high)));
      };
      lamps.push_back(
          add_lamp(capture, point(random.uniform(0.6f, 1.8f)), at + DVec3(near(-3, 3), near(0.3, 1.2), near(-20, 1))));
    }
    capture.settings.environment = 0.05f;
    capture.settings.frame_rate = 1;
  }
};

FrameResult frame_of(const Capture& capture, const Keys& keys, IntRect region = {0, 0, kWidth, kHeight}) {
  RunSettings settings;
  GpuConfiguration gpu;
  for (const std::string& key : keys) apply_setting(key, settings, gpu);
  return Device(capture, gpu, settings, {kWidth, kHeight, region}).render(0);
}

// Compares bits, so NaN equals the same NaN.
bool same_bits(const FrameResult& a, const FrameResult& b) {
  const std::vector<float>&left = a.targets.color.values, &right = b.targets.color.values;
  return left.size() == right.size() && std::memcmp(left.data(), right.data(), left.size() * sizeof(float)) == 0;
}

Keys with(Keys keys, const char* lists) {
  keys.push_back(std::string("shading.light_lists=") + lists);
  return keys;
}

// ---- Same bits ---------------------------------------------------------------------------------------------------

struct Case {
  const char* name;
  std::function<void(Hall&)> change = {};
  Keys keys = {};
  IntRect region = {0, 0, kWidth, kHeight};
};

void open_shutter(Hall& hall) { hall.capture.settings.shutter_close = 1; }

void make_moving(Hall& hall) {
  open_shutter(hall);
  for (std::size_t k = 0; k < hall.lamps.size(); k += 2)
    test::add_motion(hall.capture, hall.lamps[k], {k % 4 == 0 ? 1.5 : -1.5, 0.2, 0.7});
}

void make_layered(Hall& hall) {
  scene::Material& m = hall.capture.materials[0];
  m.clearcoat.factor = 0.7f, m.clearcoat.roughness = 0.1f;
  m.sheen.color = Vec3(0.4f), m.sheen.roughness = 0.5f;
  for (const auto effect : {scene::MaterialEffect::kClearcoat, scene::MaterialEffect::kSheen})
    m.effects[static_cast<std::size_t>(effect)] = true;
}

void add_panes(Hall& hall) {
  scene::Material glass = matt({0.3f, 0.6f, 0.7f, 0.4f});
  glass.alpha_mode = scene::AlphaMode::kBlend;
  const int number = test::add_material(hall.capture, glass);
  for (const double z : {-2.0, -5.0})
    test::add_node(hall.capture, test::patches(test::flat_patch({-2, 0, 0}, {3, 0, 0}, {0, 2, 0}), number), {0, 0, z});
}

class SameBits : public testing::TestWithParam<Case> {};

TEST_P(SameBits, WithAndWithoutLists) {  // LL1
  const Case& param = GetParam();
  Hall hall;
  if (param.change) param.change(hall);
  const FrameResult all = frame_of(hall.capture, with(param.keys, "off"), param.region),
                    listed = frame_of(hall.capture, with(param.keys, "all"), param.region);
  EXPECT_TRUE(same_bits(listed, all));
  const tilecore::LightListCounters& c = listed.counters.lights;
  EXPECT_GT(c.lists, 0u);
  EXPECT_LT(c.listed, c.tests * 3 / 4) << "lists leave lights out";
  EXPECT_EQ(c.tests, c.lists * hall.capture.lights.size());  // LL4
  EXPECT_EQ(all.counters.lights.lists, 0u);
}

INSTANTIATE_TEST_SUITE_P(
    LightLists, SameBits,
    testing::Values(
        Case{"ranges"}, Case{"region", {}, {}, {32, 32, 96, 64}},
        Case{"infinite_and_no_range",
             [](Hall& hall) {
               add_lamp(hall.capture, point(0), {0, 2, -4});
               add_lamp(hall.capture, point(std::numeric_limits<float>::infinity()), {1, 2, -4});
               add_lamp(hall.capture, point(1e-30f), {0, 0.01, 0});
             }},
        Case{"directional",
             [](Hall& hall) {
               add_lamp(hall.capture, Light(), {0, 0, 0}, {1, -1, -1});
             }},
        Case{"behind_the_camera",
             [](Hall& hall) {
               for (int k = 0; k < 5; ++k) add_lamp(hall.capture, point(2.5f), {0.5 * k, 1, 4});
             }},
        Case{"spots",
             [](Hall& hall) {
               for (int k = 0; k < 12; ++k) {
                 const float outer = 0.05f + 0.25f * static_cast<float>(k);  // up to beyond a hemisphere
                 add_lamp(hall.capture, spot(k % 3 == 0 ? 0 : 4.0f, 0.5f * outer, outer), {-3 + 0.5 * k, 1.5, -1.5 * k},
                          {k % 2 ? 0.6 : -0.6, -1, 0.2});
               }
             }},
        Case{"no_numbers",
             [](Hall& hall) {
               add_lamp(hall.capture, point(0.5f, Vec3(std::numeric_limits<float>::infinity())), {0, 0.5, -30});
               add_lamp(hall.capture, point(0.5f, Vec3(std::numeric_limits<float>::quiet_NaN())), {0, 0.5, -30});
             },
             {"frame_buffer.compression=none"}},
        Case{"lights_move", make_moving}, Case{"lights_and_samples_move", make_moving, {"shading.rate=sample"}},
        Case{"camera_moves",
             [](Hall& hall) {
               open_shutter(hall);
               test::add_motion(hall.capture, hall.camera, {0.3, 0.1, -0.8});
               test::add_turn(hall.capture, hall.camera, {0.1f, 1, 0}, 0.3f);
             }},
        Case{"camera_and_ball_move",
             [](Hall& hall) {
               open_shutter(hall);
               test::add_motion(hall.capture, hall.camera, {0, 0, -2});
               test::add_motion(hall.capture, hall.ball, {-2, 0, -3});
             }},
        Case{"curved_motion",
             [](Hall& hall) {
               make_moving(hall);
               test::add_turn(hall.capture, hall.ball, {0, 0, 1}, 3.0f);
             },
             {"sampling.motion_segments=4"}},
        Case{"lens",
             [](Hall& hall) {
               hall.capture.cameras[0].lens = {0.1f, 5.0f};
             }},
        Case{"orthographic",
             [](Hall& hall) {
               hall.capture.cameras[0].type = scene::Camera::Type::kOrthographic;
               hall.capture.cameras[0].x_mag = 4, hall.capture.cameras[0].y_mag = 3;
             }},
        Case{"layers", make_layered}, Case{"panes", add_panes}, Case{"samples", {}, {"shading.rate=sample"}},
        Case{"cells", {}, {"shading.rate=cache"}}, Case{"quads", {}, {"shading.derivatives=quad"}},
        Case{"evaluated", {}, {"shading.surface=evaluated"}}, Case{"frames", {}, {"shading.surface=frame"}},
        Case{"desampled", {}, {"resolve.desampling=checkerboard"}},
        Case{"partial_renders", {}, {"parameter_buffer.bytes=4096"}},
        Case{"shadows",
             [](Hall& hall) {
               for (int light = 0; light < kLamps; light += 5)
                 hall.capture.settings.shadows.push_back({.light = light, .size = 64});
             }}),
    [](const auto& case_of) { return std::string(case_of.param.name); });

// Far from the world's origin places are coarse.
TEST(LightLists, KeepTheBitsFarFromTheOrigin) {
  for (const double far : {1e3, 1e5, 1e6}) {
    Hall hall(matt(), DVec3(far, -far, far));
    const FrameResult all = frame_of(hall.capture, with({}, "off")), listed = frame_of(hall.capture, with({}, "all"));
    EXPECT_TRUE(same_bits(listed, all)) << far;
  }
}

// ---- Bounds ------------------------------------------------------------------------------------------------------

// A frame whose lights are given directly.
struct LitFrame {
  scene::Assembly assembly;
  scene::FrameGeometry frame;

  void set(const Light& open, const Light& close) {
    frame.lights = {std::vector<Light>{open}, std::vector<Light>{close}};
    frame.moving_lights = !(open == close);
  }
};

// Random lights and boxes of places: how many places get light that their box does not meet, where bounds shrink by a
// factor.
std::uint64_t lit_outside(double factor, std::uint64_t& left_out) {
  test::Random random(91);
  LitFrame lit;
  std::uint64_t wrong = 0;
  const auto vector = [&](float size) {
    return Vec3(random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size));
  };
  for (int trial = 0; trial < 4000; ++trial) {
    Light open = trial % 2 ? point(random.uniform(0.2f, 3.0f)) : spot(random.uniform(0.2f, 6.0f), 0.1f, 0.1f);
    const float outer = random.uniform(0.02f, 3.0f);
    open.cos_inner = std::cos(0.6f * outer), open.cos_outer = std::cos(outer);
    open.position = vector(4), open.direction = glm::normalize(vector(1) + Vec3(1e-3f));
    Light close = open;
    if (trial % 3 == 0) close.position += vector(2), close.range *= random.uniform(0.5f, 2.0f);
    if (trial % 6 == 0) close.direction = glm::normalize(open.direction + vector(0.5f));
    lit.set(open, close);
    PlaceBox box(vector(1) + Vec3(0, 0, 2));
    std::vector<Vec3> places;
    const Vec3 middle = vector(4), size = glm::abs(vector(1.0f));
    for (int k = 0; k < 40; ++k) {
      const Vec3 at = vector(1);
      places.push_back(middle + at * size);
      box.add(places.back());
    }
    LightBound bound = LightBound::of(lit.frame, 0);
    bound.radius *= factor;
    if (box.meets(bound)) continue;
    ++left_out;
    for (const Vec3& place : places)
      for (const float t : {0.0f, 0.3f, 1.0f}) {
        const auto state =
            lit.frame.moving_lights ? shaders::light_state<float>(open, close, t) : shaders::light_state<float>(open);
        const auto in = shaders::incident<float>(open.type, open.range > 0, state, {place.x, place.y, place.z});
        wrong += in.irradiance.x != 0.0f || in.irradiance.y != 0.0f || in.irradiance.z != 0.0f;
      }
  }
  return wrong;
}

TEST(LightLists, NoPlaceInABoxGetsLightFromALightThatIsLeftOut) {  // LL1
  std::uint64_t left_out = 0, more = 0;
  EXPECT_EQ(lit_outside(1.0, left_out), 0u);
  EXPECT_GT(left_out, 1000u);
  EXPECT_GT(lit_outside(0.97, more), 0u) << "bounds that are 3 % too tight are noticed";
  EXPECT_GT(more, left_out);
}

TEST(LightLists, HaveTheOrderOfTheFrame) {  // LL2
  LitFrame lit;
  for (int k = 0; k < 50; ++k) {
    Light light = point(1.5f);
    light.position = Vec3(k % 7, k % 5, k % 3);
    for (std::vector<Light>& lights : lit.frame.lights) lights.push_back(light);
  }
  tilecore::LightList list;
  list.begin(Vec3(0, 0, -1));
  list.add(Vec3(1, 1, 1)), list.add(Vec3(2, 1, 0));
  list.find(lit.frame);
  const auto numbers = list.numbers();
  EXPECT_TRUE(std::is_sorted(numbers.begin(), numbers.end()));
  EXPECT_GT(numbers.size(), 3u);
  EXPECT_LT(numbers.size(), 50u);
}

TEST(LightLists, PlacesThatAreNoNumbersMeetEveryLight) {
  LitFrame lit;
  lit.set(point(0.1f), point(0.1f));
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    PlaceBox box(Vec3(0, 0, 1));
    box.add(Vec3(100));
    EXPECT_FALSE(box.meets(LightBound::of(lit.frame, 0)));
    box.add(Vec3(100, bad, 100));
    EXPECT_TRUE(box.meets(LightBound::of(lit.frame, 0)));
  }
}

// ---- Charges -----------------------------------------------------------------------------------------------------

TEST(LightLists, FramesOfFewRangesAreAsWithoutLists) {  // LL3
  Hall hall;
  for (std::size_t k = tilecore::kFewestRangedLights - 1; k < hall.capture.lights.size(); ++k)
    hall.capture.lights[k].range = 0;
  add_lamp(hall.capture, Light(), {0, 0, 0}, {1, -1, -1});
  const FrameResult off = frame_of(hall.capture, with({}, "off")), by_default = frame_of(hall.capture, {});
  EXPECT_EQ(counter_values(by_default.counters), counter_values(off.counters));
  EXPECT_EQ(by_default.counters.ledger.total().read_bytes, off.counters.ledger.total().read_bytes);
  EXPECT_EQ(by_default.model->timing.cycles, off.model->timing.cycles);
  // One more is enough.
  hall.capture.lights[tilecore::kFewestRangedLights - 1].range = 1;
  EXPECT_GT(frame_of(hall.capture, {}).counters.lights.lists, 0u);
}

TEST(LightLists, AreChargedForPlacesTestsRecordsAndTileMemory) {
  Hall hall;
  const FrameResult off = frame_of(hall.capture, with({}, "off")), on = frame_of(hall.capture, {});
  const tilecore::LightListCounters& c = on.counters.lights;
  const tilecore::ShadingCounters& s = on.counters.shading;
  EXPECT_EQ(c.places, s.pixel_shader_invocations);
  EXPECT_LE(c.lists, on.maps.tiles.size());
  EXPECT_EQ(c.tests, c.lists * kLamps);
  // Every warp of places has one of pixels; a list's tests take two warps of 32 lights.
  EXPECT_EQ(c.warps, s.warps + c.lists * 2);
  // Records of lights come over the interface once, the L2 being cold.
  const auto attributes = [](const FrameResult& frame) {
    return frame.counters.ledger.traffic(memory::Unit::kTilecore, memory::Purpose::kAttributes).read_bytes;
  };
  EXPECT_EQ(attributes(on) - attributes(off), kLamps * tilecore::kLightRecordBytes / 64 * 64);
  // Corners of places, and written records; the rest are reads of the records by warps.
  const std::uint64_t least = 36 * c.places + tilecore::kLightRecordBytes * c.listed;
  EXPECT_GT(c.tile_bytes, least);
  EXPECT_EQ((c.tile_bytes - least) % tilecore::kLightRecordBytes, 0u);
  EXPECT_LT(on.model->timing.cycles, off.model->timing.cycles);
  std::uint64_t lanes = 0, clocks = 0;
  for (const timing::TileItems& items : on.model->record.work.rounds.front().items)
    for (const timing::WarpItem& warp : items.warps)
      if (warp.makes_lights()) lanes += warp.lanes, clocks += std::uint64_t{warp.lanes} * warp.clocks;
  EXPECT_EQ(lanes, c.places + c.tests);
  EXPECT_EQ(clocks, c.places * tilecore::place_warp(false).clocks + c.tests * tilecore::light_test_warp().clocks);
}

TEST(LightLists, TilesThatSeeNothingLitHaveNone) {
  Hall hall;
  hall.capture.materials[0].unlit = true;
  const FrameResult frame = frame_of(hall.capture, with({}, "all"));
  EXPECT_EQ(frame.counters.lights.lists, 0u);
  EXPECT_EQ(frame.counters.lights.tests, 0u);
}

}  // namespace
}  // namespace tessera::gpu::light_lists_test
