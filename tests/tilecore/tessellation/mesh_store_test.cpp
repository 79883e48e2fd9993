// Meshes that the host keeps between tiles, and their memory from frame to frame.
#include "tilecore/tessellation/mesh_store.h"
#include "tests/support/tests.h"
#include "tests/tilecore/support.h"

namespace tessera::tilecore::mesh_store_test {
namespace {

// Two patches near the camera and one far away; each frame is another pose.
struct Frames : TestFrame {
  Frames() {
    for (const float z : {-3.0f, -4.0f, -40.0f})
      test::add_node(*capture, test::patches(test::flat_patch({-1, -1, z}, {2, 0, 0}, {0, 2, 0}), -1));
    test::add_camera(*capture, {0, 0, 0}, {});
  }
  void ask_for_all(MeshStore& store) {
    for (std::uint32_t patch = 0; patch < assembly->patch_count(); ++patch)
      for (int again = 0; again < 2; ++again) {
        const scene::CellRange all = whole_patch(*frame, patch);
        const MeshStore::Item& item = store.get(*frame, patch, all, {false, false});
        EXPECT_FALSE(item.mesh.leaves.empty());
        EXPECT_GT(item.work.triangles, 0u);
      }
  }
};

TEST(MeshStore, MemoryOfAnEarlierFrameServesTheNext) {
  Frames frames;
  MeshStore store;
  frames.pose();
  frames.ask_for_all(store);
  const std::size_t first = store.memory_bytes();
  EXPECT_GT(first, 0u);
  for (int frame = 0; frame < 20; ++frame) {
    frames.pose();
    frames.ask_for_all(store);
    // Arrays that were made for a larger mesh may hold a smaller one.
    EXPECT_LE(store.memory_bytes(), 3 * first) << frame;
  }
}

TEST(MeshStore, ALimitHoldsFromFrameToFrame) {
  Frames frames;
  MeshStore store(1);  // room for one mesh
  for (int frame = 0; frame < 3; ++frame) {
    frames.pose(96 << frame, 64 << frame);
    frames.ask_for_all(store);
    const std::uint32_t last = static_cast<std::uint32_t>(frames.assembly->patch_count()) - 1;
    const MeshStore::Item& item = store.get(*frames.frame, last, whole_patch(*frames.frame, last), {false, false});
    EXPECT_EQ(store.memory_bytes(), item.mesh.memory_bytes());
  }
}

}  // namespace
}  // namespace tessera::tilecore::mesh_store_test
