// Instances that are dropped before their mesh is fetched: never one that is seen.
#include "frontend/instance_culling.h"
#include "frontend/front_end.h"
#include "gpu/configuration.h"
#include "tests/frontend/bound_scenes.h"
#include "tests/support/instances.h"
#include "tests/support/tests.h"

namespace tessera::frontend::instance_culling_test {
namespace {

using scene::InstancedNode;
using scene::InstanceGroup;

constexpr int kWidth = 320, kHeight = 200;

FrontEndSpec settings() { return gpu::GpuConfiguration{}.front_end_spec(); }

struct Instanced {
  scene::Capture capture;
  scene::Assembly assembly;
  std::unique_ptr<PyramidLibrary> pyramids;
  std::unique_ptr<scene::FrameGeometry> frame;

  explicit Instanced(scene::Capture capture_in) : capture(std::move(capture_in)), assembly(assemble(capture)) {
    pyramids = std::make_unique<PyramidLibrary>(assembly);
    frame = pose(true);
  }
  std::unique_ptr<scene::FrameGeometry> pose(bool displacement) const {
    scene::FrameRequest request;
    request.width = kWidth, request.height = kHeight;
    request.open_time = 0.25, request.close_time = 0.75;
    request.displacement = displacement;
    return pose_frame(assembly, scene::choose_camera(capture, kWidth, kHeight), request);
  }
  std::vector<MovingBox> boxes() const {
    std::vector<MovingBox> out;
    for (const InstancedNode& node : assembly.instanced_nodes) out.push_back(instanced_box(*frame, node, *pyramids));
    return out;
  }
};

// A random vertex of an instance in raster space at a time of the shutter.
DVec4 random_vertex(const Instanced& scene, const InstancedNode& node, std::uint32_t instance, Random& random) {
  const auto primitive = static_cast<std::uint32_t>(random.integer(0, static_cast<int>(node.primitives) - 1));
  const scene::PosedDrawable& drawable =
      scene.frame->drawables[node.first_drawable + instance * node.primitives + primitive];
  const std::uint32_t patch =
      drawable.drawable->first_patch +
      static_cast<std::uint32_t>(random.integer(0, static_cast<int>(drawable.drawable->patch_count) - 1));
  std::array<DVec4, 2> at;
  const float u = random.uniform(0, 1), v = random.uniform(0, 1);
  const auto vertex = static_cast<std::size_t>(random.integer(0, static_cast<int>(drawable.positions[0].size()) - 1));
  for (std::size_t key = 0; key < 2; ++key) {
    if (!has_grid(*drawable.drawable))
      at[key] = DMat4(drawable.to_raster[key]) * DVec4(DVec3(drawable.positions[key][vertex]), 1);
    else if (drawable.material->displacement)
      at[key] = displaced_point(*scene.frame, patch, u, v, key);
    else
      at[key] = DMat4(drawable.to_raster[key]) * DVec4(DVec3(drawable.positions[key][vertex]), 1);
  }
  return glm::mix(at[0], at[1], static_cast<double>(random.uniform(0, 1)));
}

// How often a vertex appears where its body's bounds do not allow it.
struct Escapes {
  int of_instances = 0, of_groups = 0, drawn = 0;
};
// `damage` changes the bodies on their way.
template <class Damage>
Escapes count_escapes(const Instanced& scene, const std::vector<MovingBox>& boxes, Random& random,
                      const Damage& damage) {
  Escapes escapes;
  const scene::Projection& projection = scene.frame->projection;
  for (std::size_t n = 0; n < boxes.size(); ++n) {
    const InstancedNode& node = scene.assembly.instanced_nodes[n];
    for (const InstanceGroup& group : node.groups) {
      const SubPatchBody of_group = damage(group_body(*scene.frame, node, boxes[n], group));
      const auto group_bounds = screen_bounds(of_group.corners, projection, of_group.margin);
      for (std::uint32_t k = group.first; k < group.first + group.count; ++k) {
        const SubPatchBody body = damage(instance_body(*scene.frame, node, boxes[n], node.order[k]));
        const auto bounds = screen_bounds(body.corners, projection, body.margin);
        for (int trial = 0; trial < 40; ++trial) {
          const DVec4 r = random_vertex(scene, node, node.order[k], random);
          const double angle = 6.283 * static_cast<double>(random.uniform(0, 1));
          const SampledPoint s = see(r, projection, std::cos(angle), std::sin(angle));
          if (!s.drawn) continue;
          ++escapes.drawn;
          escapes.of_instances += bounds && inside(*bounds, s) ? 0 : 1;
          escapes.of_groups += group_bounds && inside(*group_bounds, s) ? 0 : 1;
        }
      }
    }
  }
  return escapes;
}
const auto kAsTheyAre = [](SubPatchBody body) { return body; };

TEST(InstanceCulling, IC1BodiesHoldEveryVertexOfTheirInstances) {
  Random random(1);
  int drawn = 0;
  for (int trial = 0; trial < 30; ++trial) {
    const Instanced scene(test::random_instanced_scene(random, 70, trial % 2 == 0 ? 2.0f : 20.0f));
    const Escapes escapes = count_escapes(scene, scene.boxes(), random, kAsTheyAre);
    EXPECT_EQ(escapes.of_instances, 0) << trial;
    EXPECT_EQ(escapes.of_groups, 0) << trial;
    drawn += escapes.drawn;
  }
  EXPECT_GT(drawn, 30000);
}

TEST(InstanceCulling, IC1FailsForABoxWithoutMotionOrDisplacement) {
  Random random(2);
  Escapes still_mesh, still_node, flat;
  const auto add = [](Escapes& to, const Escapes& more) {
    to.of_instances += more.of_instances;
    to.of_groups += more.of_groups;
  };
  for (int trial = 0; trial < 40; ++trial) {
    const Instanced scene(test::random_instanced_scene(random, 1, 1.0f));
    std::vector<MovingBox> boxes = scene.boxes();
    for (MovingBox& box : boxes) box.low[1] = box.low[0], box.high[1] = box.high[0];
    add(still_mesh, count_escapes(scene, boxes, random, kAsTheyAre));
    add(still_node, count_escapes(scene, scene.boxes(), random, [](SubPatchBody body) {
          std::copy_n(body.corners.begin(), 8, body.corners.begin() + 8);
          return body;
        }));
    std::vector<MovingBox> plain;
    const auto without = scene.pose(false);
    for (const InstancedNode& node : scene.assembly.instanced_nodes)
      plain.push_back(instanced_box(*without, node, *scene.pyramids));
    for (std::size_t n = 0; n < plain.size(); ++n)
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t key = 0; key < 2; ++key) {
          EXPECT_GE(plain[n].low[key][axis], scene.boxes()[n].low[key][axis]);
          EXPECT_LE(plain[n].high[key][axis], scene.boxes()[n].high[key][axis]);
        }
  }
  EXPECT_GT(still_mesh.of_instances, 0);
  EXPECT_GT(still_node.of_instances, 0);
  EXPECT_GT(still_node.of_groups, 0);
  // A flat patch that its displacement alone brings anywhere.
  scene::Capture capture;
  scene::Material material;
  material.displacement = test::displacement(2, 2, {1, 1, 1, 1}, 5.0f, 0.0f);
  const int node = test::add_node(
      capture, test::patches(test::flat_patch({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), test::add_material(capture, material)));
  for (int i = 0; i < 3; ++i)
    capture.nodes[static_cast<std::size_t>(node)].instances.push_back(test::random_instance(random, 0.1f));
  test::add_camera(capture, {0, 0, 20});
  const Instanced scene(std::move(capture));
  add(flat,
      count_escapes(scene, {instanced_box(*scene.pose(false), scene.assembly.instanced_nodes[0], *scene.pyramids)},
                    random, kAsTheyAre));
  EXPECT_GT(flat.of_instances, 0);
  EXPECT_GT(flat.of_groups, 0);
  EXPECT_EQ(count_escapes(scene, scene.boxes(), random, kAsTheyAre).of_instances, 0);
}

// Ends of an instance that is seen only because of its motion, its deformation or its displacement.
TEST(InstanceCulling, IC1KeepsInstancesThatMoveIntoView) {
  scene::Capture capture;
  scene::Primitive triangle = test::triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2});
  scene::MorphTarget target;
  target.positions.assign(3, Vec3(-40, 0, 0));
  triangle.vertices.morph_targets.push_back(target);
  const int node = test::add_node(capture, triangle);
  scene::Node& drawn = capture.nodes[static_cast<std::size_t>(node)];
  for (int i = 0; i < 100; ++i) {
    scene::InstanceTransform t;
    t.translation = {i == 0 ? 20.0f : 2000.0f, static_cast<float>(i % 10), 0};  // one may come into view
    drawn.instances.push_back(t);
  }
  capture.animations.push_back(
      {"",
       {{.node = node, .path = scene::AnimatedPath::kWeights, .components = 1, .times = {0, 1}, .values = {0, 1}}}});
  capture.played_animations = {0};
  test::add_camera(capture, {0, 0, 10});
  const Instanced scene(std::move(capture));
  const InstanceCulling right = cull_instances(*scene.frame, *scene.pyramids, settings());
  EXPECT_EQ(right.read[0], 1);
  EXPECT_EQ(right.counters.instances_culled, 99u);
  std::vector<MovingBox> still = scene.boxes();
  still[0].low[1] = still[0].low[0], still[0].high[1] = still[0].high[0];
  EXPECT_EQ(cull_instances(*scene.frame, still, settings()).read[0], 0);
}

TEST(InstanceCulling, IC2EveryTestIsCountedAndReadsOneRecord) {
  Random random(5);
  for (int trial = 0; trial < 4; ++trial) {
    const Instanced scene(test::random_instanced_scene(random, 1500, 80.0f));
    const std::vector<MovingBox> boxes = scene.boxes();
    const FrontEndSpec spec = settings();
    const InstanceCulling culling = cull_instances(*scene.frame, boxes, spec);
    InstanceCounters expected;
    for (std::size_t n = 0; n < boxes.size(); ++n) {
      const InstancedNode& node = scene.assembly.instanced_nodes[n];
      const auto outside = [&](const SubPatchBody& body) {
        const auto bounds = screen_bounds(body.corners, scene.frame->projection, body.margin);
        return !bounds || outside_frame(*bounds, kWidth, kHeight);
      };
      for (const InstanceGroup& group : node.groups) {
        ++expected.groups_tested;
        expected.instances += group.count;
        const bool culled = outside(group_body(*scene.frame, node, boxes[n], group));
        expected.instances_tested += culled ? 0 : group.count;
        for (std::uint32_t k = group.first; k < group.first + group.count; ++k) {
          const bool dropped = culled || outside(instance_body(*scene.frame, node, boxes[n], node.order[k]));
          expected.instances_culled += dropped ? 1 : 0;
          for (std::uint32_t p = 0; p < node.primitives; ++p)
            EXPECT_EQ(culling.read[node.first_drawable + node.order[k] * node.primitives + p], dropped ? 0 : 1);
        }
      }
    }
    for (const auto& field : kCounterFields<InstanceCounters>)
      EXPECT_EQ(culling.counters.*field.member, expected.*field.member) << field.name;
    EXPECT_LT(expected.instances_tested, expected.instances);
    EXPECT_LT(expected.instances_culled, expected.instances);
    EXPECT_EQ(culling.ledger.total().read_bytes,
              expected.groups_tested * memory::burst_bytes(0, kInstanceGroupBytes, spec.burst_bytes) +
                  expected.instances_tested * memory::burst_bytes(0, kInstanceRecordBytes, spec.burst_bytes));
  }
}

TEST(InstanceCulling, IC3SubPatchesAreTheSameWithANodeForEachInstance) {
  Random random(6);
  for (int trial = 0; trial < 20; ++trial) {
    const Instanced scene(test::random_instanced_scene(random, 80, 6.0f)),
        nodes(test::with_node_per_instance(scene.capture));
    const FrontEndResult a = run_front_end(*scene.frame, *scene.pyramids, settings()),
                         b = run_front_end(*nodes.frame, *nodes.pyramids, settings());
    ASSERT_EQ(a.sub_patches.size(), b.sub_patches.size());
    for (std::size_t k = 0; k < a.sub_patches.size(); ++k) {
      EXPECT_EQ(a.sub_patches[k].base_patch, b.sub_patches[k].base_patch);
      EXPECT_EQ(a.sub_patches[k].range, b.sub_patches[k].range);
      EXPECT_EQ(a.sub_patches[k].corners(*scene.frame), b.sub_patches[k].corners(*nodes.frame));
      EXPECT_EQ(a.sub_patches[k].effects, b.sub_patches[k].effects);
    }
    // A patch of a dropped instance would have been read, bounded once and culled.
    const std::uint64_t dropped = scene.assembly.patch_count() - a.counters.base_patches;
    EXPECT_GT(dropped, 0u);
    EXPECT_EQ(b.counters.base_patches, a.counters.base_patches + dropped);
    EXPECT_EQ(b.counters.bounds_computed, a.counters.bounds_computed + dropped);
    EXPECT_EQ(b.counters.culled_frustum, a.counters.culled_frustum + dropped);
    EXPECT_EQ(b.counters.splits, a.counters.splits);
    EXPECT_EQ(b.counters.culled_backface, a.counters.culled_backface);
    EXPECT_EQ(b.instances.instances, 0u);
  }
}

// Each line of a record comes over the interface once while the L2 holds it; without one, as often as it is asked for.
TEST(InstanceCulling, RecordsThatInstancesShareAreReadOnceThroughTheL2) {
  Random random(7);
  std::uint64_t again = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const Instanced scene(test::random_instanced_scene(random, 80, 6.0f));
    FrontEndSpec wide = settings(), none = settings();
    wide.l2_bytes = 1 << 26, none.l2_bytes = 0;
    const FrontEndResult with = run_front_end(*scene.frame, *scene.pyramids, wide),
                         without = run_front_end(*scene.frame, *scene.pyramids, none);
    ASSERT_EQ(with.counters.record_lines, without.counters.record_lines);
    EXPECT_EQ(without.record_misses.size(), without.counters.record_lines);
    std::vector<std::uint32_t> lines = without.record_misses;
    std::sort(lines.begin(), lines.end());
    lines.erase(std::unique(lines.begin(), lines.end()), lines.end());
    EXPECT_EQ(with.record_misses.size(), lines.size());
    again += without.record_misses.size() - lines.size();
    const auto read = [](const FrontEndResult& front_end) {
      return front_end.ledger.traffic(memory::Unit::kFrontend, memory::Purpose::kPatchData).read_bytes;
    };
    EXPECT_EQ(read(without) - read(with), (without.record_misses.size() - lines.size()) * wide.burst_bytes);
    ASSERT_FALSE(lines.empty());
    EXPECT_LT(lines.back(), with.records_end);
  }
  EXPECT_GT(again, 1000u);
}

}  // namespace
}  // namespace tessera::frontend::instance_culling_test
