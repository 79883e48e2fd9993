// Counters, times and energies of the machine and of all others, on every instruction set that this processor has.
#include "base/simd_targets.h"
#include "baselines/baseline_set.h"
#include "gpu/counter_list.h"
#include "gpu/device.h"
#include "scene/capture_reader.h"
#include "tests/support/shadow_scenes.h"
#include "tests/support/tests.h"

namespace tessera::replay::simd_targets_test {
namespace {

struct Frame {
  std::vector<float> color;
  baselines::BaselineSet set;
  double cycles = 0;
  std::map<std::string_view, std::uint64_t> counters;
};

Frame rendered(const scene::Capture& capture, const std::string& target, int width = 160, int height = 90) {
  force_simd_target(target);
  gpu::Device device(capture, {}, {}, {width, height, {0, 0, width, height}});
  baselines::BaselineObserver schemes;
  device.set_observer(&schemes);
  const gpu::FrameResult result = device.render(capture.settings.first_frame);
  force_simd_target("");
  return {result.targets.color.values, schemes.last(), result.model->timing.cycles,
          gpu::counter_values(result.counters)};
}

class SimdTargets : public testing::TestWithParam<const char*> {};

TEST_P(SimdTargets, GiveTheSameTimesOfAllMachines) {
  scene::Capture capture = scene::read_capture(test::shipped_capture(GetParam()));
  // Leaves must be large on screen, so this capture runs with `--all` alone.
  const int side = GetParam() == std::string_view("garden_lamps") ? 20 : 10;
  for (scene::ShadowRequest& shadow : capture.settings.shadows) shadow.size = side == 20 ? shadow.size : 128;
  const Frame best = rendered(capture, "", 16 * side, 9 * side);
  for (const std::string& target : simd_target_names()) {
    const Frame frame = rendered(capture, target, 16 * side, 9 * side);
    EXPECT_EQ(frame.color, best.color) << target;
    for (const auto& [name, value] : frame.counters) EXPECT_EQ(value, best.counters.at(name)) << name << ' ' << target;
    EXPECT_EQ(frame.cycles, best.cycles) << target;
    for (std::size_t s = 0; s < baselines::kSchemeCount; ++s)
      for (const auto& field : kCounterFields<baselines::BaselineCounters>)
        EXPECT_EQ(frame.set.schemes[s].*field.member, best.set.schemes[s].*field.member)
            << field.name << ' ' << baselines::kSchemes[s].name << ' ' << target;
  }
}

INSTANTIATE_TEST_SUITE_P(Captures, SimdTargets, testing::Values("eggs", "serpent", "corridor", "garden_lamps"),
                         [](const auto& named) { return std::string(named.param); });

// Two squares of one draw that a texture masks, the nearer one first: a leaf holds both, and gives more hits than a block of a
// sink. Whether a hit of the farther square is tested does not depend on the lanes between the blocks.
TEST(AlphaTests, DoNotDependOnTheNumberOfLanes) {
  test::FloorScene scene;
  scene::Material leaf = test::matt_white();
  Image8 texels(2, 1, 4);
  texels.values = {255, 255, 255, 255, 255, 255, 255, 0};
  leaf.alpha_mode = scene::AlphaMode::kMask;
  leaf.base_color_texture.texture =
      std::make_shared<shaders::Texture>(DecodedImage{std::move(texels)}, shaders::ColorSpace::kSrgb);
  constexpr float kHalf = 1.37f;
  std::vector<Vec3> corners;
  for (const float y : {2.0f, 1.0f})
    for (const Vec2& at : {Vec2(-kHalf, kHalf), Vec2(kHalf, kHalf), Vec2(kHalf, -kHalf), Vec2(-kHalf, -kHalf)})
      corners.emplace_back(at.x, y, at.y);
  scene::Primitive squares =
      test::triangles(corners, {0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7}, test::add_material(scene.capture, leaf));
  squares.vertices.texcoords = {std::vector<Vec2>(corners.size(), Vec2(0.25f, 0.5f))};
  test::add_node(scene.capture, squares);
  std::uint64_t covered = 0;
  for (const std::string& target : simd_target_names()) {
    const Frame frame = rendered(scene.capture, target);
    const std::uint64_t tests = frame.counters.at("tilecore.alpha_tests");
    if (covered == 0) covered = tests / 2;
    EXPECT_EQ(tests, 2 * covered) << target;
  }
  // 11.25 pixels a unit, four samples each.
  const double side = 2 * static_cast<double>(kHalf) * 11.25;
  EXPECT_NEAR(static_cast<double>(covered), 4 * side * side, 0.05 * 4 * side * side);
}

}  // namespace
}  // namespace tessera::replay::simd_targets_test
