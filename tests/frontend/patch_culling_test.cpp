// Patches that are dropped in groups before their records are read: never one that is seen.
#include "frontend/patch_culling.h"
#include "frontend/bounds/drawable_box.h"
#include "frontend/front_end.h"
#include "gpu/configuration.h"
#include "tests/frontend/bound_scenes.h"
#include "tests/support/tests.h"

namespace tessera::frontend::patch_culling_test {
namespace {

using scene::PatchGroups;

constexpr int kSide = 240;

FrontEndSpec spec_of_machine() { return gpu::GpuConfiguration{}.front_end_spec(); }

// A cloud of triangles in many clusters and a cloud of displaced patches, both turning and moving before a lens.
scene::Capture random_clouds(Random& random, float half) {
  scene::Capture capture;
  scene::Material bumpy;
  std::vector<float> heights(16);
  for (float& h : heights) h = random.uniform(-1, 1);
  bumpy.displacement = test::displacement(4, 4, heights, random.uniform(-2, 2), 0.2f);
  const int plain = test::add_material(capture), displaced = test::add_material(capture, bumpy);
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices(std::size_t{3} * static_cast<std::size_t>(random.integer(3000, 9000)));
  std::iota(indices.begin(), indices.end(), 0u);
  while (positions.size() < indices.size()) {
    const Vec3 at = random.in_box(half);
    for (int c = 0; c < 3; ++c) positions.push_back(at + random.in_box(0.1f));
  }
  std::vector<Vec3> points;
  for (int p = random.integer(20, 700); p > 0; --p) {
    const std::vector<Vec3> patch = test::flat_patch(random.in_box(half), random.in_box(0.3f), random.in_box(0.3f));
    points.insert(points.end(), patch.begin(), patch.end());
  }
  for (const int node : {test::add_node(capture, test::triangles(std::move(positions), std::move(indices), plain)),
                         test::add_node(capture, test::patches(std::move(points), displaced))}) {
    if (random.coin()) test::add_motion(capture, node, DVec3(random.in_box(3)));
    if (random.coin()) test::add_turn(capture, node, random.in_box(1), random.uniform(-1, 1));
  }
  scene::Camera camera;
  camera.near = 0.2f;
  camera.lens = {random.coin() ? 0.03f : 0.0f, 3.0f};
  test::add_camera(capture, {0, 0, 4}, camera);
  return capture;
}

struct Clouds {
  scene::Capture capture;
  scene::Assembly assembly;
  std::unique_ptr<PyramidLibrary> pyramids;
  std::unique_ptr<scene::FrameGeometry> frame;

  explicit Clouds(scene::Capture capture_in) : capture(std::move(capture_in)), assembly(assemble(capture)) {
    pyramids = std::make_unique<PyramidLibrary>(assembly);
    scene::FrameRequest request;
    request.width = request.height = kSide;
    request.open_time = 0.25, request.close_time = 0.75;
    frame = pose_frame(assembly, scene::choose_camera(capture, kSide, kSide), request);
  }
};

// A random vertex of a base patch in raster space at a time of the shutter, as it is displaced.
DVec4 random_vertex(const scene::FrameGeometry& frame, std::uint32_t patch, Random& random) {
  const scene::PosedDrawable& drawable = frame.drawable_of(patch);
  std::array<DVec4, 2> at;
  const float u = random.uniform(0, 1), v = random.uniform(0, 1);
  std::uint32_t vertex = 0;
  if (!has_grid(*drawable.drawable)) {
    const scene::MeshClusters& mesh = frame.assembly->clusters[drawable.drawable->geometry];
    const scene::Cluster& cluster = mesh.clusters[patch - drawable.drawable->first_patch];
    vertex = mesh.vertices[cluster.first_vertex +
                           static_cast<std::uint32_t>(random.integer(0, static_cast<int>(cluster.vertex_count) - 1))];
  }
  for (std::size_t key = 0; key < 2; ++key)
    at[key] = has_grid(*drawable.drawable)
                  ? displaced_point(frame, patch, u, v, key)
                  : DMat4(drawable.to_raster[key]) * DVec4(DVec3(drawable.positions[key][vertex]), 1);
  return glm::mix(at[0], at[1], static_cast<double>(random.uniform(0, 1)));
}

SampledPoint random_sight(const scene::FrameGeometry& frame, std::uint32_t patch, Random& random) {
  const double angle = 6.283 * static_cast<double>(random.uniform(0, 1));
  return see(random_vertex(frame, patch, random), frame.projection, std::cos(angle), std::sin(angle));
}

// How often a vertex appears where the body of a group of its patch does not allow it. `damage` changes boxes.
template <class Damage>
int count_escapes(const Clouds& scene, Random& random, const Damage& damage) {
  int escapes = 0;
  for (const scene::PosedDrawable& drawable : scene.frame->drawables) {
    const PatchGroups* groups = resting_groups(*scene.frame, drawable);
    if (groups == nullptr) continue;
    const double offset = largest_offset(drawable, *scene.pyramids);
    for (std::uint32_t p = 0; p < drawable.drawable->patch_count; ++p) {
      std::size_t box = p;
      for (const std::vector<PatchGroups::Box>& level : groups->levels) {
        box /= scene::kPatchesPerGroup;
        const SubPatchBody body = damage(*scene.frame, drawable, level.at(box), offset);
        const auto bounds = screen_bounds(body.corners, scene.frame->projection, body.margin);
        for (int trial = 0; trial < 3; ++trial) {
          const SampledPoint s = random_sight(*scene.frame, drawable.drawable->first_patch + p, random);
          escapes += s.drawn && !(bounds && inside(*bounds, s)) ? 1 : 0;
        }
      }
    }
  }
  return escapes;
}

// Also PG1: boxes hold the vertices that bodies are made of.
TEST(PatchCulling, PC1BodiesHoldEveryVertexOfTheirPatches) {
  Random random(1);
  for (int trial = 0; trial < 12; ++trial) {
    const Clouds scene(random_clouds(random, trial % 2 == 0 ? 2.0f : 20.0f));
    EXPECT_EQ(count_escapes(scene, random,
                            [](const auto& frame, const auto& drawable, const PatchGroups::Box& box, double offset) {
                              return box_body(frame, drawable, group_box(box, offset));
                            }),
              0)
        << trial;
  }
}

TEST(PatchCulling, PC1FailsWithoutDisplacementOrMotion) {
  Random random(2);
  int flat = 0, still = 0;
  for (int trial = 0; trial < 12; ++trial) {
    const Clouds scene(random_clouds(random, 2));
    flat +=
        count_escapes(scene, random, [](const auto& frame, const auto& drawable, const PatchGroups::Box& box, double) {
          return box_body(frame, drawable, group_box(box, 0));
        });
    still += count_escapes(scene, random,
                           [](const auto& frame, const auto& drawable, const PatchGroups::Box& box, double offset) {
                             SubPatchBody body = box_body(frame, drawable, group_box(box, offset));
                             std::copy_n(body.corners.begin(), 8, body.corners.begin() + 8);
                             return body;
                           });
  }
  EXPECT_GT(flat, 0);
  EXPECT_GT(still, 0);
}

// Patches below a group, and the bytes of reading the groups below.
struct Expected {
  PatchGroupCounters counters;
  std::uint64_t bytes = 0;
  std::vector<bool> read;
};
void expect_group(const Clouds& scene, const scene::PosedDrawable& drawable, const PatchGroups& groups, int level,
                  std::size_t first, std::size_t count, Expected& expected) {
  const std::uint64_t record = 8 + 24 * count, burst = spec_of_machine().burst_bytes;
  expected.bytes += (record + burst - 1) / burst * burst;
  for (std::size_t b = first; b < first + count; ++b) {
    ++expected.counters.groups_tested;
    const double offset = largest_offset(drawable, *scene.pyramids);
    const SubPatchBody body =
        box_body(*scene.frame, drawable, group_box(groups.levels[static_cast<std::size_t>(level)][b], offset));
    const std::size_t span = static_cast<std::size_t>(std::lround(std::pow(16.0, level + 1))), begin = b * span,
                      end = std::min<std::size_t>(begin + span, drawable.drawable->patch_count);
    if (outside_view(body, *scene.frame)) {
      expected.counters.patches_culled += end - begin;
    } else if (level == 0) {
      for (std::size_t p = begin; p < end; ++p) expected.read[drawable.drawable->first_patch + p] = true;
    } else {
      const std::size_t all = groups.levels[static_cast<std::size_t>(level) - 1].size();
      expect_group(scene, drawable, groups, level - 1, 16 * b, std::min<std::size_t>(16, all - 16 * b), expected);
    }
  }
}

TEST(PatchCulling, PC2EveryTestIsCountedAndReadsItsGroup) {
  Random random(3);
  std::uint64_t culled = 0;
  for (int trial = 0; trial < 6; ++trial) {
    const Clouds scene(random_clouds(random, 15));
    const PatchCulling culling = cull_patches(*scene.frame, {0, 1}, *scene.pyramids, spec_of_machine());
    Expected expected;
    expected.read.resize(scene.assembly.patch_count());
    for (const scene::PosedDrawable& drawable : scene.frame->drawables) {
      const PatchGroups* groups = resting_groups(*scene.frame, drawable);
      ASSERT_NE(groups, nullptr);
      ASSERT_LE(groups->levels.back().size(), 16u);
      expect_group(scene, drawable, *groups, static_cast<int>(groups->levels.size()) - 1, 0,
                   groups->levels.back().size(), expected);
    }
    for (const auto& field : kCounterFields<PatchGroupCounters>)
      EXPECT_EQ(culling.counters.*field.member, expected.counters.*field.member) << field.name;
    EXPECT_EQ(culling.ledger.total().read_bytes, expected.bytes);
    std::vector<bool> read(scene.assembly.patch_count());
    for (const PatchRun& run : culling.read) std::fill(read.begin() + run.first, read.begin() + run.end, true);
    EXPECT_EQ(read, expected.read);
    culled += culling.counters.patches_culled;
  }
  EXPECT_GT(culled, 0u);
}

TEST(PatchCulling, PC3SubPatchesAreTheSameWithoutGroups) {
  Random random(4);
  for (int trial = 0; trial < 8; ++trial) {
    Clouds scene(random_clouds(random, trial % 2 == 0 ? 3.0f : 15.0f));
    const FrontEndResult with = run_front_end(*scene.frame, *scene.pyramids, spec_of_machine());
    for (auto* groups : {&scene.assembly.cluster_groups, &scene.assembly.bezier_groups})
      for (PatchGroups& of_primitive : *groups) of_primitive.levels.clear();
    const FrontEndResult without = run_front_end(*scene.frame, *scene.pyramids, spec_of_machine());
    ASSERT_EQ(with.sub_patches.size(), without.sub_patches.size());
    for (std::size_t k = 0; k < with.sub_patches.size(); ++k) {
      EXPECT_EQ(with.sub_patches[k].base_patch, without.sub_patches[k].base_patch);
      EXPECT_EQ(with.sub_patches[k].range, without.sub_patches[k].range);
    }
    EXPECT_EQ(with.counters.base_patches + with.groups.patches_culled, without.counters.base_patches);
    EXPECT_EQ(with.counters.culled_frustum + with.groups.patches_culled, without.counters.culled_frustum);
    EXPECT_EQ(without.groups.groups_tested, 0u);
    EXPECT_GT(with.groups.groups_tested, 0u);
  }
}

// Deforming primitives are tested patch by patch, because boxes of groups hold the shape at rest.
TEST(PatchCulling, DeformingPrimitivesHaveNoGroups) {
  Random random(5);
  scene::Capture capture = random_clouds(random, 3);
  scene::Primitive& primitive = capture.meshes[0].primitives[0];
  scene::MorphTarget target;
  target.positions.assign(primitive.vertices.count(), Vec3(1, 0, 0));
  primitive.vertices.morph_targets.push_back(target);
  capture.nodes[0].weights = {0.5f};
  const Clouds scene(std::move(capture));
  EXPECT_EQ(resting_groups(*scene.frame, scene.frame->drawables[0]), nullptr);
  EXPECT_NE(resting_groups(*scene.frame, scene.frame->drawables[1]), nullptr);
}

}  // namespace
}  // namespace tessera::frontend::patch_culling_test
