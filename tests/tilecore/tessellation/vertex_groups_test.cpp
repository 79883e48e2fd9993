#include "tilecore/tessellation/vertex_groups.h"
#include "tests/support/tests.h"
#include "tests/tilecore/support.h"
#include "tilecore/visibility/tile_frustum.h"

namespace tessera::tilecore::vertex_groups_test {
namespace {

// A closed surface of patches and a mesh, moving across the frame.
TestFrame moving_scene(double speed) {
  TestFrame test;
  const int material = test::add_material(*test.capture, {});
  test::add_motion(*test.capture, test::add_node(*test.capture, test::closed_patches(material)), {speed, 0.3, -0.4});
  scene::Primitive quad =
      test::triangles({{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}}, {0, 1, 2, 0, 2, 3}, material);
  test::add_motion(*test.capture, test::add_node(*test.capture, quad), {-speed, 0.1, 0.2});
  test::add_camera(*test.capture, {0.3, 0.4, 4.0});
  test.pose(400, 300);
  return test;
}

// Numbers of leaves that touch a tile which some group of theirs does not overlap.
std::size_t forgotten(const scene::FrameGeometry& frame, std::uint32_t patch, const scene::CellRange& range,
                      const MicroMesh& mesh, const std::vector<VertexGroup>& groups) {
  std::size_t count = 0;
  const bool grid = scene::has_grid(*frame.drawable_of(patch).drawable);
  const int columns = range.i1 - range.i0 + 1, patch_columns = grid ? frame.pattern_of(patch).nu / 8 + 1 : 0;
  for (std::size_t l = 0; l < mesh.leaves.size(); ++l)
    for (int y = 0; y < 300; y += 16)
      for (int x = 0; x < 400; x += 16) {
        const IntRect pixels{x, y, x + 16, y + 16};
        if (touching_times(mesh.leaves[l], pixels, true, 0).empty()) continue;
        bool missed = false;
        for (std::uint32_t cells = mesh.leaves[l].cells; cells != 0; cells &= cells - 1) {
          const std::size_t slot = l * kLeafCells + static_cast<std::size_t>(std::countr_zero(cells));
          for (const auto& corner : mesh.corner) {
            const int i = grid ? range.i0 + corner[slot] % columns : 0,
                      j = grid ? range.j0 + corner[slot] / columns : 0;
            const auto number = static_cast<std::uint16_t>(j / 8 * patch_columns + i / 8);
            const int bit = grid ? j % 8 * 8 + i % 8 : corner[slot];
            bool held = false;
            for (const VertexGroup& g : groups)
              held =
                  held || (g.number == number && (g.vertices >> bit & 1) != 0 && !g.pixels.intersect(pixels).empty());
            missed = missed || !held;
          }
        }
        count += missed ? 1 : 0;
      }
  return count;
}

TEST(VertexGroups, VG1TC4ATileThatALeafTouchesOverlapsTheGroupsOfItsVertices) {
  std::size_t twin = 0;
  for (const double speed : {0.0, 0.7, 3.0}) {
    const TestFrame test = moving_scene(speed);
    Tessellator tessellator;
    MicroMesh mesh;
    for (std::uint32_t patch = 0; patch < test.assembly->patch_count(); ++patch) {
      const scene::CellRange whole = whole_patch(*test.frame, patch);
      const auto half = static_cast<std::uint8_t>(whole.i1 / 2);
      const bool grid = scene::has_grid(*test.frame->drawable_of(patch).drawable);
      std::vector<scene::CellRange> ranges = {whole};
      if (grid && half > 0) ranges = {{0, 0, half, whole.j1}, {half, 0, whole.i1, whole.j1}};
      for (const scene::CellRange& range : ranges) {
        tessellator.tessellate(*test.frame, patch, range, {true, false}, mesh);
        std::vector<VertexGroup> groups = vertex_groups(*test.frame, patch, range, mesh, 0);
        EXPECT_EQ(forgotten(*test.frame, patch, range, mesh, groups), 0u);
        // The twin: one column of pixels less.
        for (VertexGroup& g : groups) g.pixels.x0 += 16;
        twin += forgotten(*test.frame, patch, range, mesh, groups);
      }
    }
  }
  EXPECT_GT(twin, 0u);
}

TEST(VertexGroups, EveryVertexOfASubPatchIsInOneGroup) {
  const TestFrame test = moving_scene(0.7);
  Tessellator tessellator;
  MicroMesh mesh;
  for (std::uint32_t patch = 0; patch < test.assembly->patch_count(); ++patch) {
    const scene::CellRange range = whole_patch(*test.frame, patch);
    const Tessellator::Work work = tessellator.tessellate(*test.frame, patch, range, {true, false}, mesh);
    std::uint64_t vertices = 0, room = 0;
    for (const VertexGroup& g : vertex_groups(*test.frame, patch, range, mesh, 0)) {
      vertices += static_cast<std::uint64_t>(std::popcount(g.vertices));
      room += g.room;
      EXPECT_LE(g.room, VertexGroup::kVertices);
    }
    EXPECT_EQ(vertices, work.domain_evaluations);
    EXPECT_EQ(room, vertices);  // of a whole patch
  }
}

}  // namespace
}  // namespace tessera::tilecore::vertex_groups_test
