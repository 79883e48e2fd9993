// Cast shadows beside shadows by three.js: the same scene, light matrix, map size and weights of texels, share by
// share.
#include "gpu/device.h"
#include "gpu/settings.h"
#include "gpu/view_inputs.h"
#include "scene/capture_reader.h"
#include "scene/light_views.h"
#include "tests/support/browser.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/live_page.h"
#include "tests/support/tests.h"

namespace tessera::replay::three_shadows_test {
namespace {

constexpr int kWidth = 480, kHeight = 320;
constexpr int kSize = 1024;      // of the map, texels
constexpr double kBias = 0.008;  // three's, of the map's depth

// ---- The scene --------------------------------------------------------------------------------------------------

struct Shape {
  std::vector<float> positions;
  std::vector<std::uint32_t> indices;
};

int add_vertex(Shape& shape, const DVec3& at) {
  for (int c = 0; c < 3; ++c) shape.positions.push_back(static_cast<float>(at[c]));
  return static_cast<int>(shape.positions.size() / 3) - 1;
}

// Two triangles, counterclockwise.
void add_quad(Shape& shape, int a, int b, int c, int d) {
  for (const int corner : {a, b, c, a, c, d}) shape.indices.push_back(static_cast<std::uint32_t>(corner));
}

Shape box(const DVec3& low, const DVec3& high) {
  Shape shape;
  for (unsigned k = 0; k < 8; ++k)
    add_vertex(shape, {(k & 1u) != 0 ? high.x : low.x, (k & 2u) != 0 ? high.y : low.y, (k & 4u) != 0 ? high.z : low.z});
  for (const auto& [a, b, c, d] : std::to_array<std::array<int, 4>>(
           {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}))
    add_quad(shape, a, b, c, d);
  return shape;
}

Shape ball(const DVec3& middle, double radius) {
  constexpr int kRound = 48, kDown = 24;
  Shape shape;
  for (int j = 0; j <= kDown; ++j)
    for (int i = 0; i <= kRound; ++i) {
      const double down = std::numbers::pi * j / kDown, round = 2 * std::numbers::pi * (i % kRound) / kRound,
                   across = j == 0 || j == kDown ? 0 : std::sin(down);
      add_vertex(shape, middle + radius * DVec3(across * std::cos(round), std::cos(down), across * std::sin(round)));
    }
  for (int j = 0; j < kDown; ++j)
    for (int i = 0; i < kRound; ++i) {
      const int at = j * (kRound + 1) + i, below = at + kRound + 1;
      add_quad(shape, at, at + 1, below + 1, below);
    }
  return shape;
}

// A rotation that turns -z towards a direction, as glTF writes it.
json turned_to(const DVec3& direction) {
  const DQuat q = scene::made::looking(direction);
  return {q.x, q.y, q.z, q.w};
}

// A white floor with boxes, a ball and a thin post under a light; faces are flat, for there are no normals.
test::GltfAsset things_under(const json& light, const json& light_node) {
  test::GltfAsset asset;
  asset.document["scene"] = 0;
  asset.add("scenes", {{"nodes", json::array()}});
  asset.add("materials", {{"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 1}}}});
  const auto add_node = [&](const json& node) {
    asset.document["scenes"][0]["nodes"].push_back(asset.add("nodes", node));
  };
  for (const Shape& shape :
       {box({-6, -0.5, -6}, {6, 0, 6}), box({-3, 0, -2.5}, {-1.5, 2, -1}), box({1, 0, 0.5}, {2.5, 0.75, 2.5}),
        box({0.5, 1.6, -3}, {2.5, 1.9, -1.5}), ball({-1.2, 0.9, 1.7}, 0.9), box({0.3, 0, -0.6}, {0.42, 2.4, -0.48})}) {
    const json range = [&] {
      std::array<float, 3> low{1e9f, 1e9f, 1e9f}, high{-1e9f, -1e9f, -1e9f};
      for (std::size_t i = 0; i < shape.positions.size(); ++i)
        low[i % 3] = std::min(low[i % 3], shape.positions[i]), high[i % 3] = std::max(high[i % 3], shape.positions[i]);
      return json{{"min", low}, {"max", high}};
    }();
    const int positions = asset.add_accessor("VEC3", shape.positions, range),
              indices = asset.add_accessor("SCALAR", shape.indices);
    add_node({{"mesh",
               asset.add("meshes",
                         {{"primitives",
                           {{{"attributes", {{"POSITION", positions}}}, {"indices", indices}, {"material", 0}}}}})}});
  }
  const json lens = {{"yfov", 0.7}, {"znear", 0.5}, {"zfar", 40}, {"aspectRatio", 1.5}};
  asset.add("cameras", {{"type", "perspective"}, {"perspective", lens}});
  add_node({{"camera", 0}, {"translation", {3.5, 5.5, 8}}, {"rotation", turned_to({-3.4, -5.0, -8})}});
  json lamp = light_node;
  lamp["extensions"] = {{"KHR_lights_punctual", {{"light", 0}}}};
  add_node(lamp);
  asset.document["extensionsUsed"] = {"KHR_lights_punctual", "TESSERA_capture"};
  asset.document["extensions"] = {
      {"KHR_lights_punctual", {{"lights", {light}}}},
      {"TESSERA_capture",
       {{"environment", 0}, {"background", {0, 0, 0}}, {"shadows", {{{"light", 0}, {"size", kSize}}}}}}};
  return asset;
}

test::GltfAsset under_a_sun() {
  return things_under({{"type", "directional"}, {"intensity", 3}}, {{"rotation", turned_to({1, -1.2, -0.9})}});
}
test::GltfAsset under_a_lamp() {
  return things_under(
      {{"type", "spot"}, {"intensity", 300}, {"spot", {{"innerConeAngle", 0.6}, {"outerConeAngle", 0.7}}}},
      {{"translation", {-5, 7, 4}}, {"rotation", turned_to({5, -6.8, -4.2})}});
}

// ---- Both renderers ---------------------------------------------------------------------------------------------

gpu::FrameResult frame_of(const scene::Capture& capture, const std::vector<std::string>& keys) {
  gpu::GpuConfiguration gpu;
  gpu::RunSettings settings;
  settings.output.machine_model = false;
  gpu::apply_setting("sampling.samples_per_pixel=1", settings, gpu);  // in the middle of the pixel
  for (const std::string& key : keys) gpu::apply_setting(key, settings, gpu);
  gpu::RenderRequest request{kWidth, kHeight, {0, 0, kWidth, kHeight}};
  request.auxiliary = true;
  return gpu::Device(capture, gpu, settings, request).render(0);
}

// The map of the scene's light, as the page takes it.
json light_view(const scene::Capture& capture) {
  const gpu::GpuConfiguration gpu;
  const gpu::RunSettings settings;
  const scene::Assembly assembly = scene::assemble(capture);
  const auto frame = scene::pose_frame(assembly, gpu::frame_camera(capture, settings, kWidth, kHeight),
                                       gpu::frame_request(capture, gpu, settings, kWidth, kHeight, 0));
  const auto views = scene::light_views(*frame, scene::shadow_lights(*frame, settings.shadows), settings.shadows);
  const scene::LightView& view = views.at(0).at(0);
  const scene::Camera& camera = view.camera.camera;
  const DMat4 world = scene::view_from_world(view.camera.fixed_world).camera_to_world;
  json columns;
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 4; ++r) columns.push_back(world[c][r]);
  return {{"world", columns},           {"size", view.size},   {"half", camera.x_mag},
          {"fov", camera.vertical_fov}, {"near", camera.near}, {"far", camera.far}};
}

// The page of three_shadows.js, with three.js as npm installs it; closed with the object.
class ThreePage {
 public:
  // Why there is none; "" once npm has installed it, which is done once for a build.
  static std::string missing() {
    if (!test::has_browser()) return "needs Debian's chromium";
    if (fs::exists(folder() / "node_modules/three/build/three.module.js")) return "";
    const ProcessResult made = test::run_process(
        {"/usr/bin/env", "bash", TESSERA_SOURCE_DIR "/tests/support/npm_install.sh", folder().string(), "three@0.170"});
    if (made.status == 77) return made.output;
    if (made.status != 0) throw std::runtime_error("npm_install.sh: " + made.errors);
    return "";
  }
  ThreePage() {
    if (!page_.wait_for("document.body.dataset.ready"))
      throw std::runtime_error("three_shadows.js: " + testing::PrintToString(page_.errors()));
  }
  int subpixel_bits() { return page_.evaluate("subpixelBits()"); }
  json mask(const json& job) { return page_.evaluate("shadowMask(" + job.dump() + ")"); }

 private:
  static fs::path folder() { return fs::path(TESSERA_BINARY_DIR) / "three"; }
  std::string write_page() const {
    const std::string three = "file://" + (folder() / "node_modules/three").string();
    const json imports = {
        {"imports", {{"three", three + "/build/three.module.js"}, {"three/addons/", three + "/examples/jsm/"}}}};
    test::write_text(files_ / "page.html", "<!doctype html><body><script type='importmap'>" + imports.dump() +
                                               "</script><script type='module' src='file://" TESSERA_SOURCE_DIR
                                               "/tests/replay/three_shadows.js'></script></body>");
    return "file://" + (files_ / "page.html").string();
  }

  test::TemporaryFolder files_;
  test::LivePage page_{write_page(), 640, 480, {"--enable-unsafe-swiftshader", "--allow-file-access-from-files"}};
};

// ---- The comparison ---------------------------------------------------------------------------------------------

// Pixels at which both see the same point, which faces the light and whose slope three's constant bias makes up for.
// At other pixels three's surfaces shade themselves: it compares texels with the depth of the point that is looked up,
// we compare them with the depth of the point's plane.
struct Difference {
  int compared = 0, differ = 0;
  int beyond_bias = 0;  // are too steep, and left out
  int elsewhere = 0;    // the two see different surfaces
  int shaded = 0;       // of those compared
  double farthest = 0;  // texels between a pixel that differs and the next change of light
};

// `offset`: whether our bias has three's added; `shift`: texels by which three's map is shifted.
Difference compare(const test::GltfAsset& asset, bool box, bool offset = false, double shift = 0) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "scene.gltf", asset.gltf());
  const scene::Capture capture = scene::read_capture(folder / "scene.gltf");
  ThreePage page;
  // With the browser's rounding of vertices, or texels at edges are filled in one of the maps alone, and 3x3 reads 16.
  const std::string bits = fmt::format("tessellator.subpixel_bits={}", page.subpixel_bits());
  json view = light_view(capture);
  for (std::size_t c = 0; c < 3; ++c)
    view["world"][12 + c] = view["world"][12 + c].get<double>() +
                            shift * 2 * view["half"].get<double>() / kSize * view["world"][c].get<double>();
  const double range = view["far"].get<double>() - view["near"].get<double>();
  const gpu::FrameResult with = frame_of(capture, {bits, fmt::format("shadows.offset={}", offset ? kBias * range : 0.0),
                                                   box ? "shadows.filter=3x3" : "shadows.filter=nearest"}),
                         without = frame_of(capture, {bits, "effects.shadows=off"});
  const json three = page.mask({{"gltf", asset.gltf()},
                                {"width", kWidth},
                                {"height", kHeight},
                                {"soft", box},
                                {"bias", -kBias},
                                {"view", view}});
  const double reach = box ? 2 : 0.5, tolerance = box ? 1.0 / 64 : 1e-4;
  Difference out;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto of_three = [&](int c) {
        return three.at(static_cast<std::size_t>(4 * ((kHeight - 1 - y) * kWidth + x) + c)).get<double>();
      };
      const double all = static_cast<double>(without.targets.color.at(x, y)[0]),
                   lit = static_cast<double>(with.targets.color.at(x, y)[0]),
                   depth = static_cast<double>(without.targets.depth.at(x, y)[0]);
      const double change = of_three(1);
      if (std::abs(of_three(2) - depth) > 1e-3 * depth || (all > 0 && change < 0)) {
        ++out.elsewhere;
      } else if (!(all > 0)) {
        continue;
      } else if (of_three(3) * reach > kBias) {
        ++out.beyond_bias;
      } else {
        ++out.compared;
        out.shaded += lit < 0.5 * all ? 1 : 0;
        if (std::abs(lit / all - of_three(0)) <= tolerance) continue;
        ++out.differ;
        out.farthest = std::max(out.farthest, change);
      }
    }
  return out;
}

std::string figures(const Difference& d) {
  return fmt::format(
      "compared {}, shaded {}; differ {} ({:.3f} %), at most {:.2f} texels from a change of light; "
      "beyond the bias {}; elsewhere {}",
      d.compared, d.shaded, d.differ, 100.0 * d.differ / d.compared, d.farthest, d.beyond_bias, d.elsewhere);
}

class ThreeShadowsOf : public testing::TestWithParam<std::tuple<std::string, std::string>> {};
INSTANTIATE_TEST_SUITE_P(All, ThreeShadowsOf,
                         testing::Combine(testing::Values("sun", "lamp"), testing::Values("nearest", "3x3")),
                         [](const auto& instance) {
                           return std::get<0>(instance.param) + "_" + std::get<1>(instance.param);
                         });

// An oracle: BasicShadowMap looks up the nearest texel, PCFSoftShadowMap weighs 16 texels as 3x3 does. The remaining
// differences lie at the feet of walls that face the light: there texels of the wall shade the floor's plane, which
// goes on below it, and three's larger bias lets them pass.
TEST_P(ThreeShadowsOf, AreEqualFartherThanATexelAndAHalfFromEdges) {
  if (const std::string missing = ThreePage::missing(); !missing.empty()) GTEST_SKIP() << missing;
  const bool box = std::get<1>(GetParam()) == "3x3";
  const Difference got = compare(std::get<0>(GetParam()) == "sun" ? under_a_sun() : under_a_lamp(), box);
  SCOPED_TRACE(figures(got));
  RecordProperty("figures", figures(got));
  EXPECT_LE(got.differ, (box ? 0.005 : 0.0005) * got.compared);
  EXPECT_LT(got.farthest, 1.5);
  EXPECT_LT(got.elsewhere, 50);
  EXPECT_GT(got.compared, 90000);
  EXPECT_GT(got.shaded, 10000);
}

// The same bias on both sides leaves the weights of texels alone.
TEST(ThreeShadows, WithThreesBiasNearlyAllAreEqual) {
  if (const std::string missing = ThreePage::missing(); !missing.empty()) GTEST_SKIP() << missing;
  const Difference got = compare(under_a_sun(), true, true);
  SCOPED_TRACE(figures(got));
  EXPECT_LE(got.differ, 0.001 * got.compared);
  EXPECT_GT(got.compared, 90000);
}

// The twin: a map that is shifted by half a texel is noticed.
TEST(ThreeShadows, AMapThatIsShiftedByHalfATexelIsNoticed) {
  if (const std::string missing = ThreePage::missing(); !missing.empty()) GTEST_SKIP() << missing;
  const Difference got = compare(under_a_sun(), false, false, 0.5);
  SCOPED_TRACE(figures(got));
  EXPECT_GT(got.differ, 0.002 * got.compared);
}

}  // namespace
}  // namespace tessera::replay::three_shadows_test
