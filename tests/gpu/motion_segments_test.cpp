// Motion along curves: objects that turn, bend or zoom within the shutter, in pieces of linear motion.
#include "base/image_metrics.h"
#include "gpu/counter_list.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "gpu/view_inputs.h"
#include "scene/limits.h"
#include "tests/support/instances.h"
#include "tests/support/tests.h"

namespace tessera::gpu::motion_segments_test {
namespace {

using scene::Capture;

constexpr int kWidth = 96, kHeight = 64;

// The shutter is open for the second from 0 to 1; behind everything is black.
Capture empty_stage() {
  Capture capture;
  capture.settings.frame_rate = 1;
  capture.settings.shutter_close = 1;
  capture.settings.background = Vec3(0.0f);
  return capture;
}

int unlit(Capture& capture, const Vec4& color, scene::AlphaMode mode = scene::AlphaMode::kOpaque) {
  scene::Material material;
  material.base_color = color;
  material.unlit = material.double_sided = true;
  material.alpha_mode = mode;
  return test::add_material(capture, material);
}

scene::Primitive rectangle(float x0, float y0, float x1, float y1, int material) {
  return test::triangles({{x0, y0, 0}, {x1, y0, 0}, {x1, y1, 0}, {x0, y1, 0}}, {0, 1, 2, 0, 2, 3}, material);
}

// From above, one unit a pixel.
void look_flat(Capture& capture) {
  scene::Camera camera;
  camera.type = scene::Camera::Type::kOrthographic;
  camera.x_mag = kWidth / 2.0f, camera.y_mag = kHeight / 2.0f;
  camera.near = 0.1f, camera.far = 200;
  test::add_camera(capture, {0, 0, 100}, camera);
}

void play(Capture& capture, const scene::AnimationChannel& channel) {
  if (capture.animations.empty()) capture.animations.emplace_back();
  capture.played_animations = {0};
  capture.animations[0].channels.push_back(channel);
}

// Turns around z at the same speed all the time: spherical interpolation between keys far less than half a turn apart.
void add_spin(Capture& capture, int node, double angle) {
  scene::AnimationChannel channel;
  channel.node = node;
  channel.path = scene::AnimatedPath::kRotation;
  channel.components = 4;
  for (int k = 0; k <= 16; ++k) {
    channel.times.push_back(static_cast<float>(k) / 16);
    const double half = 0.5 * angle * k / 16;
    for (const double v : {0.0, 0.0, std::sin(half), std::cos(half)}) channel.values.push_back(static_cast<float>(v));
  }
  play(capture, channel);
}

// A blade around its end.
Capture blade(double angle) {
  Capture capture = empty_stage();
  const int node = test::add_node(capture, rectangle(0, -2, 31, 2, unlit(capture, {1, 1, 1, 1})));
  add_spin(capture, node, angle);
  look_flat(capture);
  return capture;
}
constexpr double kBladeArea = 31 * 4;

FrameResult render(const Capture& capture, const std::vector<std::string>& keys, int frame = 0) {
  RunSettings settings;
  GpuConfiguration gpu;
  for (const std::string& key : keys) apply_setting(key, settings, gpu);
  Device device(capture, gpu, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}, true});
  return device.render(frame);
}

Image image(const Capture& capture, const std::vector<std::string>& keys) {
  Image color(kWidth, kHeight, 3);
  const FrameResult result = render(capture, keys);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (std::size_t c = 0; c < 3; ++c) color.at(x, y)[c] = result.targets.color.at(x, y)[c];
  return color;
}

// Mean of frames with a closed shutter, in the middles of equal parts of it.
Image mean_of_stills(const Capture& moving, const std::vector<std::string>& keys, int count = 64) {
  Image mean(kWidth, kHeight, 3);
  for (int k = 0; k < count; ++k) {
    Capture still = moving;
    still.settings.shutter_open = still.settings.shutter_close = (k + 0.5) / count;
    const Image one = image(still, keys);
    for (std::size_t i = 0; i < mean.values.size(); ++i) mean.values[i] += one.values[i] / static_cast<float>(count);
  }
  return mean;
}

double area(const Image& image) {
  double sum = 0;
  for (std::size_t i = 0; i < image.values.size(); i += 3) sum += static_cast<double>(image.values[i]);
  return sum;
}

std::size_t segments_of(const Capture& capture, const std::vector<std::string>& keys) {
  RunSettings settings;
  GpuConfiguration gpu;
  for (const std::string& key : keys) apply_setting(key, settings, gpu);
  const scene::Assembly assembly = scene::assemble(capture);
  return scene::pose_frame(assembly, frame_camera(capture, settings, kWidth, kHeight),
                           frame_request(capture, gpu, settings, kWidth, kHeight, 0))
      ->segments.size();
}

TEST(MotionSegments, ABladeThatTurnsCoversItsArea) {
  const Capture capture = blade(2.6);
  const auto share = [&](std::vector<std::string> keys) {
    keys.push_back("sampling.samples_per_pixel=64");
    return area(image(capture, keys)) / kBladeArea;
  };
  EXPECT_NEAR(share({}), 1.0, 0.02);
  EXPECT_NEAR(share({"sampling.motion_segments=16"}), 1.0, 0.02);
  // A chord of the turn: 2/3 + cos(angle) / 3 of it.
  EXPECT_NEAR(share({"sampling.motion_segments=1"}), 2.0 / 3 + std::cos(2.6) / 3, 0.02);
  EXPECT_NEAR(share({"sampling.motion_segments=3"}), 2.0 / 3 + std::cos(2.6 / 3) / 3, 0.02);
}

TEST(MotionSegments, FullTurnsCountAsMotion) {
  const double turn = 2 * 3.14159265358979;
  const Capture capture = blade(turn);
  const std::vector<std::string> keys = {"sampling.samples_per_pixel=64"};
  EXPECT_GE(psnr(image(capture, keys), mean_of_stills(capture, keys, 256)), 38.0);
  EXPECT_NEAR(area(image(capture, keys)) / kBladeArea, 1.0, 0.01);
  // With 16 segments each is the chord of a 16th of the turn.
  EXPECT_NEAR(area(image(capture, {keys[0], "sampling.motion_segments=16"})) / kBladeArea,
              2.0 / 3 + std::cos(turn / 16) / 3, 0.01);
  EXPECT_LT(psnr(image(capture, {keys[0], "sampling.motion_segments=1"}), mean_of_stills(capture, keys, 256)), 30.0);
}

TEST(MotionSegments, AChordsErrorFallsWithTheSquareOfTheSegments) {
  // A quarter of a pixel of error at the tip: r (1 - cos(angle / 2n)).
  for (const double angle : {0.3, 0.6, 1.2, 2.4}) {
    const double sagitta = std::hypot(31, 2) * (1 - std::cos(angle / 2));
    const std::size_t wanted = static_cast<std::size_t>(std::ceil(std::sqrt(sagitta / 0.25)));
    EXPECT_NEAR(static_cast<double>(segments_of(blade(angle), {})), static_cast<double>(wanted), 1) << angle;
  }
  EXPECT_GT(segments_of(blade(1.2), {"sampling.motion_error=0.1"}), segments_of(blade(1.2), {}));
  EXPECT_EQ(segments_of(blade(0.17), {}), 0u) << "less than a quarter of a pixel";
  EXPECT_EQ(segments_of(blade(2.6), {"sampling.motion_segments=1"}), 0u);
  EXPECT_EQ(segments_of(blade(2.6), {"sampling.motion_segments=16"}), 16u);
}

// Nothing more is done for linear motion, whatever is asked for.
TEST(MotionSegments, LinearMotionKeepsOneSegmentItsBitsAndItsCounters) {
  Capture capture = empty_stage();
  const int node = test::add_node(capture, rectangle(-5, -5, 5, 5, unlit(capture, {1, 1, 1, 1})));
  test::add_motion(capture, node, {20, 7, 0});
  look_flat(capture);
  const FrameResult one = render(capture, {"sampling.motion_segments=1"});
  for (const char* keys : {"sampling.motion_segments=16", "sampling.motion_segments=0"}) {
    const FrameResult many = render(capture, {keys});
    EXPECT_EQ(many.targets.color.values, one.targets.color.values);
    EXPECT_EQ(counter_values(many.counters), counter_values(one.counters));
  }
}

// Animations that keep lamp, camera and objects in place cost nothing.
TEST(MotionSegments, AnimatedObjectsThatStandStillCostNothing) {
  const auto stage = [](bool animated) {
    Capture capture;
    capture.settings.frame_rate = 1;
    capture.settings.shutter_close = 1;
    const int ball = test::add_node(capture, test::closed_patches(test::add_material(capture)), DVec3(0, 0, -4));
    capture.lights.emplace_back();
    capture.lights.back().type = shaders::Light::Type::kPoint;
    capture.light_parameters.emplace_back();
    scene::Node lamp;
    lamp.light = 0;
    capture.nodes.push_back(lamp);
    capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
    test::add_camera(capture, DVec3(0));
    if (animated)
      for (int node = ball; node < static_cast<int>(capture.nodes.size()); ++node)
        test::add_motion(capture, node, DVec3(0));
    return capture;
  };
  const FrameResult still = render(stage(false), {}), animated = render(stage(true), {});
  EXPECT_EQ(animated.targets.color.values, still.targets.color.values);
  EXPECT_EQ(counter_values(animated.counters), counter_values(still.counters));
  EXPECT_EQ(animated.model->timing.cycles, still.model->timing.cycles);
}

struct Curve {
  const char* name;
  std::function<Capture()> scene;
  double one_segment;  // dB that it does not reach
};

scene::Primitive bending_strip(int material) {
  // A strip of 16 cells that two joints carry: the upper one turns.
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  scene::Primitive strip;
  for (std::uint32_t k = 0; k <= 16; ++k) {
    const float y = -28.0f + 3.0f * static_cast<float>(k);
    positions.push_back({-4, y, 0});
    positions.push_back({4, y, 0});
    if (k < 16)
      for (const std::uint32_t corner : {0u, 1u, 3u, 0u, 3u, 2u}) indices.push_back(2 * k + corner);
  }
  strip = test::triangles(positions, indices, material);
  scene::Vertices& v = strip.vertices;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const float upper = std::clamp((positions[i].y + 20.0f) / 20.0f, 0.0f, 1.0f);
    v.influences.push_back({{0, 1}, {1.0f - upper, upper}});
  }
  return strip;
}

Capture skinned() {
  Capture capture = empty_stage();
  const int material = unlit(capture, {1, 1, 1, 1});
  const int node = test::add_node(capture, bending_strip(material));
  scene::Skin skin;
  for (int k = 0; k < 2; ++k) {
    scene::Node joint;
    joint.transform.translation = {0, -20, 0};
    capture.nodes.push_back(joint);
    capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
    skin.joints.push_back(capture.roots.back());
    DMat4 inverse(1.0);
    inverse[3] = DVec4(0, 20, 0, 1);
    skin.inverse_bind.push_back(inverse);
  }
  capture.skins.push_back(skin);
  capture.nodes[static_cast<std::size_t>(node)].skin = 0;
  add_spin(capture, capture.roots.back(), 1.6);
  look_flat(capture);
  return capture;
}

Capture morphing() {
  Capture capture = empty_stage();
  scene::Primitive square = rectangle(-20, -10, -10, 10, unlit(capture, {1, 1, 1, 1}));
  scene::MorphTarget target;
  target.positions.assign(4, Vec3(30, 0, 0));
  square.vertices.morph_targets.push_back(target);
  const int node = test::add_node(capture, square);
  scene::AnimationChannel channel;
  channel.node = node;
  channel.path = scene::AnimatedPath::kWeights;
  channel.components = 1;
  // There, and half the way back.
  channel.times = {0, 0.5f, 1};
  channel.values = {0, 1, 0.5f};
  play(capture, channel);
  look_flat(capture);
  return capture;
}

// A wall of bars before a camera that pans.
Capture panned(bool masked, bool lens) {
  Capture capture = empty_stage();
  capture.settings.background.reset();
  for (int k = 0; k < 9; ++k) {
    const auto x = static_cast<float>(k - 4);
    const int material = unlit(capture, {k % 2 == 0 ? 0.9f : 0.2f, 0.5f, 0.4f, masked && k % 3 == 0 ? 0.4f : 1.0f},
                               masked && k % 3 == 0 ? scene::AlphaMode::kBlend : scene::AlphaMode::kOpaque);
    test::add_node(capture, rectangle(x - 0.3f, -2, x + 0.3f, 2, material), {0, 0, -4.0 - 0.2 * k});
  }
  scene::Camera camera;
  camera.vertical_fov = 0.9f;
  if (lens) camera.lens = {0.05f, 4.5f};
  test::add_camera(capture, {0, 0, 0}, camera);
  test::add_turn(capture, static_cast<int>(capture.nodes.size()) - 1, {0, 1, 0}, 0.9f);
  return capture;
}

const std::vector<Curve>& curves() {
  static const std::vector<Curve> all = {
      {"blade", [] { return blade(2.6); }, 30},
      {"skin", skinned, 30},
      {"morph", morphing, 20},
      {"camera", [] { return panned(false, false); }, 34},
      {"layers and a lens", [] { return panned(true, true); }, 34},
  };
  return all;
}

TEST(MotionSegments, AreTheMeanOfStills) {
  const std::vector<std::string> keys = {"sampling.samples_per_pixel=64", "shading.rate=sample",
                                         "sampling.motion_error=0.1"},
                                 one = {"sampling.samples_per_pixel=64", "shading.rate=sample",
                                        "sampling.motion_segments=1"};
  for (const Curve& curve : curves()) {
    const Capture capture = curve.scene();
    const Image truth = mean_of_stills(capture, {"sampling.samples_per_pixel=64", "shading.rate=sample"});
    EXPECT_GE(psnr(image(capture, keys), truth), 38.0) << curve.name;
    EXPECT_LT(psnr(image(capture, one), truth), curve.one_segment) << curve.name << ": two motion keys are caught";
  }
}

TEST(MotionSegments, TheImageIsTheSameForEveryMethodTileAndTraversal) {
  const std::vector<std::vector<std::string>> ways = {{"tilecore.visibility_method=brute"},
                                                      {"tilecore.visibility_method=segments"},
                                                      {"tilecore.visibility_method=partition"},
                                                      {"tilecore.visibility_method=clusters"},
                                                      {"tilecore.visibility_method=cluster-partition"},
                                                      {"tilecore.traversal=class"},
                                                      {"tilecore.traversal=ray"},
                                                      {"tile.width=16", "tile.height=16"},
                                                      {"binner.queue_levels=3"},
                                                      {"tilecore.occlusion_culling=false"},
                                                      {"parameter_buffer.bytes=4096"},
                                                      {"frontend.split_depth=4", "frontend.split_pixels=4"},
                                                      {"effects.motion=on"},
                                                      {"effects.defocus=on"}};
  for (const Curve& curve : curves())
    for (const char* bits : {"sampling.time_bits=8", "sampling.time_bits=16"}) {
      const Capture capture = curve.scene();
      const FrameResult plain = render(capture, {bits});
      ASSERT_GT(segments_of(capture, {}), 1u);
      for (std::vector<std::string> keys : ways) {
        const std::string name = keys[0];
        keys.push_back(bits);
        EXPECT_EQ(render(capture, keys).targets.color.values, plain.targets.color.values) << curve.name << ", " << name;
      }
    }
}

TEST(MotionSegments, EveryRateShadesThem) {
  const Capture capture = panned(true, false);
  const Image truth = mean_of_stills(capture, {"sampling.samples_per_pixel=16", "shading.rate=sample"});
  for (const char* rate : {"pixel", "primitive", "cache", "sample"})
    EXPECT_GE(psnr(image(capture, {"sampling.samples_per_pixel=16", std::string("shading.rate=") + rate}), truth), 33.0)
        << rate;
  EXPECT_GE(psnr(image(capture, {"sampling.samples_per_pixel=16", "shading.derivatives=quad"}), truth), 33.0);
}

TEST(MotionSegments, AZoomIsSeen) {
  Capture capture = empty_stage();
  test::add_node(capture, rectangle(-1, -1, 1, 1, unlit(capture, {1, 1, 1, 1})), {0, 0, -5});
  scene::Camera camera;
  camera.vertical_fov = 1.2f;
  test::add_camera(capture, {0, 0, 0}, camera);
  scene::AnimationChannel channel;
  channel.path = scene::AnimatedPath::kFieldOfView;
  channel.object = 0;
  channel.components = 1;
  channel.times = {0, 1};
  channel.values = {1.2f, 0.6f};
  play(capture, channel);
  const std::vector<std::string> keys = {"sampling.samples_per_pixel=64"};
  const Image truth = mean_of_stills(capture, keys);
  EXPECT_GE(psnr(image(capture, keys), truth), 38.0);
  EXPECT_LT(psnr(image(capture, {keys[0], "sampling.motion_segments=1"}), truth), 25.0);
}

TEST(MotionSegments, InstancesMoveByThemAsNodesDo) {
  test::Random random(5);
  Capture capture = test::random_instanced_scene(random, 40, 1.5f);
  capture.settings.frame_rate = 1;
  capture.settings.shutter_close = 1;
  for (std::size_t n = 0; n < capture.nodes.size(); ++n)
    if (capture.nodes[n].camera != scene::kNone) {
      capture.nodes[n].transform.rotation = DQuat(1, 0, 0, 0);
      test::add_turn(capture, static_cast<int>(n), {0, 0, 1}, 1.5f);
    }
  const Capture nodes = test::with_node_per_instance(capture);
  const FrameResult a = render(capture, {"sampling.motion_segments=4"}),
                    b = render(nodes, {"sampling.motion_segments=4"});
  EXPECT_EQ(a.targets.color.values, b.targets.color.values);
  EXPECT_EQ(a.targets.depth.values, b.targets.depth.values);
}

// Bytes of the front end are logged as they are counted, also of meshes that deform in some segments only and are where
// they were when the shutter closes.
TEST(MotionSegments, RecordsHaveOneSizeInAllSegments) {
  Capture capture = morphing();
  scene::AnimationChannel& channel = capture.animations[0].channels[0];
  channel.times = {0, 0.25f, 0.5f, 1};
  channel.values = {0, 1, 0, 0};
  capture.nodes[0].instances.resize(3);
  capture.nodes[0].instances[1].translation = {0, 15, 0};
  capture.nodes[0].instances[2].translation = {0, -15, 0};
  RunSettings settings;
  settings.sampling.motion_segments = 8;
  Device device(capture, {}, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}, false, /* record_accesses */ true});
  const FrameResult result = device.render(0);
  std::uint64_t logged = 0;
  for (const memory::Access& access : result.model->record.accesses[0].geometry)
    if (access.unit == memory::Unit::kFrontend) logged += access.bytes;
  EXPECT_EQ(logged, result.counters.ledger.traffic(memory::Unit::kFrontend, memory::Purpose::kPatchData).read_bytes);
  const std::vector<std::string> keys = {"sampling.samples_per_pixel=64", "sampling.motion_segments=8"};
  EXPECT_GE(psnr(image(capture, keys), mean_of_stills(capture, keys)), 38.0);
}

TEST(MotionSegments, PreviousDepthAndDesamplingGoOn) {
  Capture capture = blade(2.6);
  capture.settings.frame_rate = 4;
  capture.settings.shutter_close = 1;
  const auto second_frame = [&](const std::vector<std::string>& keys) {
    RunSettings settings;
    GpuConfiguration gpu;
    for (const std::string& key : keys) apply_setting(key, settings, gpu);
    Device device(capture, gpu, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}, false});
    device.render(0);
    const Image rgba = device.render(1).targets.color;
    Image color(kWidth, kHeight, 3);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (std::size_t c = 0; c < 3; ++c) color.at(x, y)[c] = rgba.at(x, y)[c];
    return color;
  };
  const Image plain = second_frame({});
  EXPECT_EQ(second_frame({"frontend.previous_depth_culling=true"}).values, plain.values);
  EXPECT_GE(psnr(second_frame({"resolve.desampling=adaptive"}), plain), 40.0);
}

TEST(MotionSegments, PosesThatDoNotFitAreRefused) {
  Capture capture = blade(2.6);
  capture.charged_bytes = 1000;
  capture.max_bytes = 2000;
  EXPECT_THROW(segments_of(capture, {}), scene::BudgetError);
  EXPECT_NO_THROW(segments_of(capture, {"sampling.motion_segments=1"}));
}

}  // namespace
}  // namespace tessera::gpu::motion_segments_test
