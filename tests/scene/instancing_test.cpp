// Instances of a node's mesh: their numbers, shared data and places.
#include <tessera/error.h>

#include "scene/frame_geometry.h"
#include "scene/pose.h"
#include "tests/support/instances.h"
#include "tests/support/tests.h"

namespace tessera::scene::instancing_test {
namespace {

TEST(Instances, AS1AreNumberedAndPosedAsNodesInTheirPlaceWouldBe) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    const Capture capture = test::random_instanced_scene(random, 9, 2.0f),
                  nodes = test::with_node_per_instance(capture);
    const Assembly a = assemble(capture), b = assemble(nodes);
    EXPECT_EQ(a.patch_drawable, b.patch_drawable);
    EXPECT_EQ(a.grid_patches, b.grid_patches);
    FrameRequest request;
    request.open_time = 0.25, request.close_time = 0.75;
    const auto x = pose_frame(a, choose_camera(capture, 320, 200), request),
               y = pose_frame(b, choose_camera(nodes, 320, 200), request);
    ASSERT_EQ(x->drawables.size(), y->drawables.size());
    for (std::size_t d = 0; d < x->drawables.size(); ++d) {
      const PosedDrawable &p = x->drawables[d], &q = y->drawables[d];
      EXPECT_EQ(p.to_raster, q.to_raster) << seed << " " << d;
      EXPECT_EQ(p.normal_to_world, q.normal_to_world);
      EXPECT_EQ(p.mirrored, q.mirrored);
      EXPECT_EQ(p.moving, q.moving);
      EXPECT_EQ(p.drawable->instanced, p.drawable->node == 0 || p.drawable->node == 2);
      EXPECT_TRUE(std::ranges::equal(p.positions[1], q.positions[1]));
    }
    EXPECT_EQ(x->displacement_lod, y->displacement_lod);
  }
}

TEST(Instances, AS2ShareAllButTransformAndNumbers) {
  Random random(3);
  Capture capture = test::random_instanced_scene(random, 50, 2.0f);
  const Assembly many = assemble(capture);
  for (Node& node : capture.nodes)
    if (!node.instances.empty()) node.instances.resize(1);
  const Assembly one = assemble(capture);
  EXPECT_EQ(many.clusters.size(), one.clusters.size());
  EXPECT_EQ(many.neighbours.size(), one.neighbours.size());
  EXPECT_EQ(many.record_count, one.record_count);
  EXPECT_EQ(one.record_count, one.patch_count());
  EXPECT_EQ(many.drawn.size(), one.drawn.size());
  const auto frame = pose_frame(many, choose_camera(capture, 320, 200), {});
  std::set<std::uint32_t> drawables;
  for (std::uint32_t n = 0; n < many.drawn.size(); ++n)
    for (std::uint32_t i = 0; i < many.drawn[n].count; ++i) {
      const std::uint32_t d = many.drawn[n].drawable(i);
      EXPECT_TRUE(drawables.insert(d).second);
      const Drawable &drawable = many.drawables[d], &first = many.drawables[many.drawn[n].first_drawable];
      EXPECT_EQ(drawable.drawn, n);
      EXPECT_EQ(drawable.instance, i);
      EXPECT_EQ(drawable.geometry, first.geometry);
      for (std::uint32_t p = 0; p < drawable.patch_count; ++p)
        EXPECT_EQ(many.record_of(drawable.first_patch + p), many.record_of(first.first_patch + p));
      // The vertices, deformed or not, lie in one place.
      EXPECT_EQ(frame->drawables[d].positions[0].data(),
                frame->drawables[many.drawn[n].first_drawable].positions[0].data());
    }
  EXPECT_EQ(drawables.size(), many.drawables.size());
}

TEST(Instances, AS3AreEachInOneGroupWhoseRangesHoldThem) {
  Random random(4);
  for (const int count : {1, 63, 64, 65, 1000}) {
    std::vector<InstanceTransform> instances;
    for (int i = 0; i < count; ++i) instances.push_back(test::random_instance(random, 100.0f));
    const InstancedNode node = group_instances(instances);
    EXPECT_EQ(node.groups.size(), (instances.size() + kInstancesPerGroup - 1) / kInstancesPerGroup);
    std::set<std::uint32_t> seen;
    double volume = 0;
    for (const InstanceGroup& group : node.groups) {
      double side = 1;
      for (std::uint32_t k = group.first; k < group.first + group.count; ++k) {
        EXPECT_TRUE(seen.insert(node.order[k]).second);
        const DMat4 m = instance_to_node(instances[node.order[k]]);
        for (std::size_t row = 0; row < 3; ++row)
          for (std::size_t column = 0; column < 4; ++column) {
            const double value = m[static_cast<int>(column)][static_cast<int>(row)];
            const float low = column == 3 ? group.origin_low[row] : group.linear_low[row][column],
                        high = column == 3 ? group.origin_high[row] : group.linear_high[row][column];
            EXPECT_LE(static_cast<double>(low), value);
            EXPECT_GE(static_cast<double>(high), value);
          }
      }
      for (std::size_t axis = 0; axis < 3; ++axis)
        side *= static_cast<double>(group.origin_high[axis]) - static_cast<double>(group.origin_low[axis]);
      volume += side;
    }
    EXPECT_EQ(seen.size(), instances.size());
    // Neighbours are together: the groups fill the box about once, not each all of it.
    if (count == 1000) {
      EXPECT_LT(volume, 3 * 200.0 * 200.0 * 200.0);
    }
  }
}

TEST(Instances, BeyondTheRangeOfNumbersAreRefused) {
  Capture capture;
  std::vector<Vec3> points;
  for (int p = 0; p < 4300; ++p)
    for (const Vec3& point : test::flat_patch({static_cast<float>(p), 0, 0}, {1, 0, 0}, {0, 1, 0}))
      points.push_back(point);
  const int node = test::add_node(capture, test::patches(points));
  capture.nodes[static_cast<std::size_t>(node)].instances.resize(1'000'000);
  EXPECT_THROW(assemble(capture), LimitError);
}

TEST(Instances, AreFramedByTheAutomaticCameraAsNodesWouldBe) {
  Random random(8);
  for (int trial = 0; trial < 20; ++trial) {
    Capture capture = test::random_instanced_scene(random, 100, 5.0f);
    for (Node& node : capture.nodes) node.camera = kNone;
    const CameraChoice a = choose_camera(capture, 320, 200),
                       b = choose_camera(test::with_node_per_instance(capture), 320, 200);
    EXPECT_EQ(a.fixed_world, b.fixed_world);
    EXPECT_EQ(a.camera.near, b.camera.near);
  }
}

}  // namespace
}  // namespace tessera::scene::instancing_test
