// A mesh that a skin carries is the image of one that a node carries: wherever, however scaled and mirrored, moving or
// not. And surfaces in one plane are drawn one on the other, in the order of the scene.
#include "base/image_metrics.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "tests/support/tests.h"

namespace tessera::gpu::skinned_images_test {
namespace {

using scene::Capture;

constexpr int kWidth = 96, kHeight = 64;

Image render(const Capture& capture, const std::vector<std::string>& keys = {}) {
  RunSettings settings;
  GpuConfiguration gpu;
  for (const std::string& key : keys) apply_setting(key, settings, gpu);
  Device device(capture, gpu, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}});
  return device.render(0).targets.color;
}

int pixels_apart(const Image& a, const Image& b, float tolerance) {
  int count = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      bool apart = false;
      for (std::size_t c = 0; c < 3; ++c) apart = apart || !(std::abs(a.at(x, y)[c] - b.at(x, y)[c]) <= tolerance);
      count += apart ? 1 : 0;
    }
  return count;
}

double brightness(const Image& image) {
  double sum = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) sum += static_cast<double>(image.at(x, y)[0]);
  return sum / (kWidth * kHeight);
}

enum class Carried { kByNode, kBySkin };

// Placement of the mesh, and its sides.
struct Case {
  const char* name;
  DVec3 scale{1.0};
  DVec3 away{0.0};
  double turn = 0;  // of the whole scene about y
  bool double_sided = false;
};
const std::vector<Case>& cases() {
  static const std::vector<Case> all = {{"plain"},
                                        {"long", {1, 1, 4}},
                                        {"flat", {1, 0.2, 1}},
                                        {"mirrored", {-1, 1, 1}},
                                        {"mirrored twice", {-1, -1, 1}},
                                        {"mirrored and long, both sides", {-1, 2, 1}, DVec3(0), 0, true},
                                        {"1000 km away", {1, 1, 1}, {1e6, -2e5, 3e5}},
                                        {"on the globe", {1, 1.5, 1}, {4200000.5, 4700000.2, 300000.1}, 0.52},
                                        {"on the globe, mirrored", {-1, 1, 1}, {4200000.5, 4700000.2, 300000.1}, 0.52}};
  return all;
}

// A round mesh of triangles or patches with normals, lit, below a root that takes the whole scene away.
Capture stage(const Case& of, Carried carried, scene::Primitive primitive, bool moving) {
  Capture capture;
  scene::Material material;
  material.double_sided = of.double_sided;
  primitive.material = test::add_material(capture, material);
  auto& v = primitive.vertices;
  if (primitive.kind == scene::Primitive::Kind::kTriangles)
    for (const Vec3& p : v.positions) v.normals.push_back(glm::normalize(p + Vec3(0, 0, 0.3f)));
  const int mesh = test::add_node(capture, primitive);
  capture.roots.clear();
  scene::Node root, joint;
  const int joint_number = static_cast<int>(capture.nodes.size());
  joint.transform.scale = of.scale;
  if (carried == Carried::kBySkin) {
    scene::Skin skin;
    skin.joints = {joint_number};
    skin.inverse_bind = {DMat4(1.0)};
    capture.skins.push_back(skin);
    auto& own = capture.meshes[0].primitives[0].vertices;
    own.influences.resize(own.count());
    for (auto& influence : own.influences) influence.weights[0] = 1;
    capture.nodes[static_cast<std::size_t>(mesh)].skin = 0;
    // Its own node counts for the winding alone.
    if (of.scale.x * of.scale.y * of.scale.z < 0)
      capture.nodes[static_cast<std::size_t>(mesh)].transform.scale = DVec3(1, 1, -7);
  } else {
    capture.nodes[static_cast<std::size_t>(mesh)].transform.scale = of.scale;
  }
  capture.nodes.push_back(joint);
  test::add_camera(capture, DVec3(0.4, 0.3, 4));
  capture.roots.clear();
  root.transform.translation = of.away;
  root.transform.rotation = glm::angleAxis(of.turn, DVec3(0, 1, 0));
  const int root_number = static_cast<int>(capture.nodes.size());
  for (int n = 0; n < root_number; ++n) {
    root.children.push_back(n);
    capture.nodes[static_cast<std::size_t>(n)].parent = root_number;
  }
  capture.nodes.push_back(root);
  capture.roots = {root_number};
  if (moving) {
    capture.settings.frame_rate = capture.settings.shutter_close = 1;
    test::add_motion(capture, carried == Carried::kBySkin ? joint_number : mesh, {0.5, 0.2, 0.1});
  }
  capture.settings.background = Vec3(0.0f);
  return capture;
}

TEST(SkinnedImages, EqualARigidMesh) {
  for (const bool moving : {false, true})
    for (const bool patches : {false, true})
      for (const Case& of : cases()) {
        SCOPED_TRACE(std::string(of.name) + (moving ? ", moving" : "") + (patches ? ", patches" : ""));
        const auto mesh = [&] { return patches ? test::closed_patches(scene::kNone) : test::wavy_grid(12, 3); };
        const Image rigid = render(stage(of, Carried::kByNode, mesh(), moving)),
                    skinned = render(stage(of, Carried::kBySkin, mesh(), moving));
        EXPECT_GT(brightness(rigid), 0.005);
        // docs/hard_cases.md: at most 0.2 % of the pixels.
        EXPECT_LE(pixels_apart(rigid, skinned, 0.004f), kWidth * kHeight / 500);
      }
}

// A square that a scale takes through zero to its mirror image is seen all the time: the side that looks at the camera
// stays a front. Closed bodies that do the same never show their inside.
Capture turning_inside_out(scene::Primitive primitive, bool double_sided, const DVec3& from, const DVec3& to) {
  Capture capture;
  scene::Material material;
  material.unlit = true;
  material.double_sided = double_sided;
  primitive.material = test::add_material(capture, material);
  const int node = test::add_node(capture, primitive);
  scene::AnimationChannel channel;
  channel.node = node;
  channel.path = scene::AnimatedPath::kScale;
  channel.times = {0, 1};
  for (const DVec3& s : {from, to})
    for (int c = 0; c < 3; ++c) channel.values.push_back(static_cast<float>(s[c]));
  capture.animations.emplace_back().channels = {channel};
  capture.played_animations = {0};
  test::add_camera(capture, DVec3(0, 0, 4));
  capture.settings.frame_rate = capture.settings.shutter_close = 1;
  capture.settings.background = Vec3(0.0f);
  return capture;
}

TEST(SkinnedImages, WindingFollowsTheSamplesTime) {
  const auto square = [] {
    return test::triangles({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, {0, 1, 2, 0, 2, 3});
  };
  for (const double share : {0.5, 1.0, 0.3, 2.7}) {
    const DVec3 to(-share, 1, 1);
    const Image single = render(turning_inside_out(square(), false, DVec3(1), to), {"sampling.samples_per_pixel=64"}),
                both = render(turning_inside_out(square(), true, DVec3(1), to), {"sampling.samples_per_pixel=64"});
    EXPECT_GT(both.at(kWidth / 2, kHeight / 2)[0], 0.9f);
    EXPECT_LE(pixels_apart(single, both, 0.02f), kWidth * kHeight / 500) << share;
    // The twin: one winding for the whole shutter, taken at its middle, loses the shorter part. That part
    // covers the place x from the middle for (min(1, share) - x) / (1 + share) of the time, in halves of the square.
    const Image one = render(turning_inside_out(square(), false, DVec3(1), to),
                             {"sampling.samples_per_pixel=64", "sampling.motion_segments=1"}),
                still = render(turning_inside_out(square(), true, DVec3(1), DVec3(1)));
    const double lost = std::min(1.0, share) - 0.1 * (1 + share);
    EXPECT_GT(pixels_apart(one, both, 0.1f), 0.9 * lost * pixels_apart(still, Image(kWidth, kHeight, 4), 0.5f))
        << share;
  }
  // The inside of a closed body is never seen, whichever way the body is turned: exchanged sides show the far side.
  const Image ball = render(turning_inside_out(test::closed_patches(scene::kNone), false, DVec3(1), DVec3(1, -1, 1)));
  const Image all = render(turning_inside_out(test::closed_patches(scene::kNone), true, DVec3(1), DVec3(1, -1, 1)));
  EXPECT_LE(pixels_apart(ball, all, 0.02f), kWidth * kHeight / 200);
}

// ---- Surfaces in one plane ----------------------------------------------------------------------------------------

struct Sheet {
  Vec4 color;
  scene::AlphaMode mode;
};
constexpr auto kSolid = scene::AlphaMode::kOpaque;
constexpr auto kMask = scene::AlphaMode::kMask;
constexpr auto kBlend = scene::AlphaMode::kBlend;

Capture sheets(const std::vector<Sheet>& all, bool patches, bool moving) {
  Capture capture;
  for (const Sheet& sheet : all) {
    scene::Material material;
    material.unlit = material.double_sided = true;
    material.base_color = sheet.color;
    material.alpha_mode = sheet.mode;
    const int number = test::add_material(capture, material);
    const int node = test::add_node(
        capture, patches
                     ? test::patches(test::flat_patch({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}), number)
                     : test::triangles({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, {0, 1, 2, 0, 2, 3}, number));
    if (moving) test::add_motion(capture, node, {0.2, 0, 0});
  }
  test::add_camera(capture, DVec3(0, 0, 4));
  if (moving) capture.settings.frame_rate = capture.settings.shutter_close = 1;
  capture.settings.background = Vec3(0.0f);
  return capture;
}

// Blended one on the other in the scene's order, after all that is not.
Vec3 composed(const std::vector<Sheet>& all) {
  Vec3 color(0.0f);
  bool first = true;
  for (const Sheet& sheet : all)
    if (sheet.mode != kBlend && first) color = Vec3(sheet.color), first = false;
  for (const Sheet& sheet : all)
    if (sheet.mode == kBlend) color = color * (1 - sheet.color.w) + Vec3(sheet.color) * sheet.color.w;
  return color;
}

TEST(CoplanarSurfaces, AreSeenOneOnTheOther) {
  const Vec4 red(1, 0, 0, 1), green(0, 1, 0, 0.5f), blue(0, 0, 1, 0.25f);
  const std::vector<std::vector<Sheet>> stacks = {
      {{red, kSolid}, {green, kBlend}},  {{green, kBlend}, {red, kSolid}},
      {{red, kMask}, {green, kBlend}},   {{green, kBlend}, {blue, kBlend}},
      {{blue, kBlend}, {green, kBlend}}, {{green, kBlend}, {red, kSolid}, {blue, kBlend}},
  };
  for (const auto& stack : stacks)
    for (const bool patches : {false, true})
      for (const bool moving : {false, true})
        for (const std::vector<std::string>& keys : {std::vector<std::string>{},
                                                     {"tilecore.visibility_method=brute"},
                                                     {"tilecore.traversal=ray"},
                                                     {"tile.width=16", "tile.height=16"},
                                                     {"tilecore.occlusion_culling=false"},
                                                     {"parameter_buffer.bytes=4096"}}) {
          const Image image = render(sheets(stack, patches, moving), keys);
          const Vec3 wanted = composed(stack);
          for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(image.at(kWidth / 2, kHeight / 2)[static_cast<std::size_t>(c)], wanted[c], 1e-3)
                << (patches ? "patches " : "") << (moving ? "moving " : "") << (keys.empty() ? "" : keys[0]);
        }
}

}  // namespace
}  // namespace tessera::gpu::skinned_images_test
