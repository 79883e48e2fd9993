// Random scenes with every feature: the image has the same bits with every visibility method.
#include "gpu/device.h"
#include "gpu/settings.h"
#include "tests/support/tests.h"

namespace tessera::gpu::random_scenes_test {
namespace {

using scene::Capture;

constexpr int kWidth = 24, kHeight = 16;

scene::Primitive random_primitive(Random& random, int material) {
  if (random.integer(0, 2) == 0) return test::closed_patches(material);
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  const int count = random.integer(2, 20);
  for (int k = 0; k < count; ++k) {
    const Vec3 at = random.in_box(1.2f);
    for (int corner = 0; corner < 3; ++corner) {
      positions.push_back(at + random.in_box(0.8f));
      indices.push_back(static_cast<std::uint32_t>(indices.size()));
    }
  }
  scene::Primitive primitive = test::triangles(positions, indices, material);
  // Alpha across the cutoff of masks.
  if (random.coin())
    for (std::size_t v = 0; v < positions.size(); ++v)
      primitive.vertices.colors.push_back({1, 1, 1, random.uniform(0.0f, 1.0f)});
  return primitive;
}

Capture random_scene(Random& random) {
  Capture capture;
  capture.settings.frame_rate = 1;
  capture.settings.shutter_close = random.integer(0, 4) == 0 ? 0.0 : 0.1 * random.integer(1, 10);
  const int nodes = random.integer(1, 3);
  for (int n = 0; n < nodes; ++n) {
    scene::Material material;
    material.unlit = random.coin();
    material.double_sided = random.coin();
    material.base_color = {random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1), random.uniform(0.3f, 1)};
    material.alpha_mode = static_cast<scene::AlphaMode>(random.integer(0, 2));
    const int node = test::add_node(capture, random_primitive(random, test::add_material(capture, material)),
                                    DVec3(random.in_box(0.8f)));
    scene::Transform& transform = capture.nodes[static_cast<std::size_t>(node)].transform;
    if (random.integer(0, 3) == 0) transform.scale.x = -1;
    if (random.integer(0, 2) != 0) test::add_motion(capture, node, DVec3(random.in_box(1.5f)));
    if (random.coin())
      test::add_turn(capture, node, random.in_box(1.0f) + Vec3(0, 0, 1.5f), random.uniform(0.1f, 2.5f));
  }
  scene::Camera camera;
  camera.near = 0.05f;
  if (random.integer(0, 3) == 0) camera.type = scene::Camera::Type::kOrthographic;
  if (random.coin()) camera.lens = {random.uniform(0.01f, 0.2f), random.uniform(0.5f, 4.0f)};
  // From far away, or in the middle of it: then the near plane cuts it.
  test::add_camera(capture, DVec3(random.in_box(0.2f)) + DVec3(0, 0, random.coin() ? 3.5 : 0.7), camera);
  if (random.integer(0, 3) == 0)
    test::add_turn(capture, static_cast<int>(capture.nodes.size()) - 1, {0.3f, 1, 0}, random.uniform(0.1f, 0.8f));
  return capture;
}

FrameResult render(const Capture& capture, const std::vector<std::string>& keys) {
  RunSettings settings;
  GpuConfiguration gpu;
  for (const std::string& key : keys) apply_setting(key, settings, gpu);
  settings.output.machine_model = false;
  return Device(capture, gpu, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}, true}).render(0);
}

// Scenes `first` on, each by every method.
void expect_equal_images(std::uint32_t first, std::uint32_t count) {
  constexpr int kSamples[] = {1, 2, 3, 4, 7, 8, 16, 64};
  const std::vector<std::string> ways = {"tilecore.traversal=class",
                                         "tilecore.traversal=ray",
                                         "tilecore.visibility_method=brute",
                                         "tilecore.visibility_method=segments",
                                         "tilecore.visibility_method=partition",
                                         "tilecore.visibility_method=clusters",
                                         "tilecore.visibility_method=cluster-partition",
                                         "tile.width=8",
                                         "effects.motion=on",
                                         "tilecore.occlusion_culling=false"};
  std::uint64_t covered = 0, cut = 0, hidden = 0;
  for (std::uint32_t trial = first; trial < first + count; ++trial) {
    Random random(trial);
    const Capture capture = random_scene(random);
    const std::vector<std::string> common = {
        "sampling.samples_per_pixel=" + std::to_string(kSamples[trial % std::size(kSamples)]),
        "sampling.seed=" + std::to_string(trial), random.coin() ? "sampling.time_bits=8" : "sampling.time_bits=16",
        "tilecore.blend_layers=32"};
    const FrameResult plain = render(capture, common);
    covered += plain.counters.tilecore.sample_hits > 0 ? 1 : 0;
    hidden += plain.counters.tilecore.culled_blocks > 0 ? 1 : 0;
    cut += plain.effect_reasons.at("motion").find("segments") != std::string::npos ? 1 : 0;
    const auto expect_same = [&](const FrameResult& a, const FrameResult& b, const std::string& name) {
      EXPECT_TRUE(a.targets.color.values == b.targets.color.values &&
                  a.targets.depth.values == b.targets.depth.values && a.targets.patch.values == b.targets.patch.values)
          << "scene " << trial << ", " << name;
    };
    for (const std::string& way : ways) {
      std::vector<std::string> keys = common;
      keys.push_back(way);
      expect_same(render(capture, keys), plain, way);
    }
    // Discrete times are another pattern: the default sees the same with it.
    std::vector<std::string> discrete = common, interleaved = common;
    discrete.push_back("sampling.times=16");
    interleaved.push_back("tilecore.visibility_method=interleaved");
    expect_same(render(capture, interleaved), render(capture, discrete), "interleaved");
  }
  EXPECT_GT(covered, count * 9 / 10);
  EXPECT_GT(cut, count / 5) << "scenes with motion segments";
  EXPECT_GT(hidden, 0u) << "scenes with entries that only some blocks hide";
}

TEST(RandomScenes, AHundredOfThemAreTheSameByEveryMethod) { expect_equal_images(1, 100); }

TEST(RandomScenesAtLength, AThousandOfThemAreTheSameByEveryMethod) { expect_equal_images(101, 1000); }

}  // namespace
}  // namespace tessera::gpu::random_scenes_test
