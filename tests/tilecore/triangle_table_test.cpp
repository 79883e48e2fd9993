// Tables by which the samples of a tile name triangles, and the samples' share of the tile memory.
#include "tilecore/triangle_table.h"
#include "tests/support/tests.h"
#include "tests/tilecore/pixel_scene.h"

namespace tessera::tilecore::triangle_table_test {
namespace {

constexpr std::uint64_t kRecord = TriangleTable::kRecordBytes, kCorner = TriangleTable::kCornerBytes;

// Two leaves: a strip of three cells with eight corners, whose last cell has one triangle; a cell alone.
MicroMesh two_leaves() {
  MicroMesh mesh;
  mesh.resize_vertices(12, false);
  mesh.begin_leaf();
  mesh.add_cell({0, 1, 5, 4}, 0);
  mesh.add_cell({1, 2, 6, 5}, 2);
  mesh.add_cell({2, 3, 7, 7}, 4);
  mesh.begin_leaf();
  mesh.add_cell({8, 9, 10, 11}, 5);
  return mesh;
}

std::uint64_t written(TriangleTable& table, std::initializer_list<std::uint32_t> seen, bool moves) {
  for (const std::uint32_t triangle : seen) table.see(triangle);
  return table.end_sub_patch(two_leaves(), moves);
}

TEST(TriangleTable, HasARecordForEachSeenTriangle) {  // TT1
  TriangleTable table;
  EXPECT_EQ(written(table, {}, true), 0u);
  EXPECT_EQ(written(table, {0, 6, 0}, false), kRecord);
  EXPECT_EQ(table.bytes(), kRecord);
  table.clear();
  EXPECT_EQ(table.bytes(), 0u);
}

TEST(TriangleTable, HasTheCornersOfLeavesThatAreSeenMoving) {  // TT1
  TriangleTable table;
  EXPECT_EQ(written(table, {3}, true), kRecord + 8 * kCorner);
  EXPECT_EQ(written(table, {6}, true), kRecord + 4 * kCorner) << "the first leaf was another sub-patch's";
  EXPECT_EQ(written(table, {4, 5}, true), kRecord + 12 * kCorner);
  EXPECT_EQ(table.bytes(), 3 * kRecord + 24 * kCorner);
  EXPECT_EQ(written(table, {4}, true), kRecord + 8 * kCorner) << "triangle 5 is of the other leaf";
}

// ---- Tiles ------------------------------------------------------------------------------------------------------

// A tile of a patch, in front of another that it hides; it moves by `way`, or is seen through a lens.
TileState tile(double way, bool bezier = true, scene::AlphaMode mode = scene::AlphaMode::kOpaque) {
  PixelScene scene(16, 16, 4);
  const int node = scene.add_quad(-8, -8, 32, 32, 0, unlit({1, 0, 0, 0.5f}, mode), bezier);
  if (way > 0) test::add_motion(*scene.capture, node, {way, 0, 0});
  scene.add_quad(-8, -8, 32, 32, -5, unlit({0, 1, 0, 1}), bezier);
  scene.look();
  TileState state;
  TileCore core;
  std::vector<binner::ListEntry> entries = scene.entries();
  for (binner::ListEntry& entry : entries) {
    entry.near_depth = entry.base_patch == 0 ? 10 : 15;
    if (way > 0) entry.flags |= binner::ListEntry::Flag::kMoving;
  }
  core.render_entries(scene.job, 0, entries, state);
  EXPECT_EQ(core.take_result().counters.tilecore.triangle_table_bytes, state.triangles.bytes());
  return state;
}

TEST(TriangleTable, ATileKnowsItsVisibleTriangles) {  // TT1
  EXPECT_EQ(tile(0).triangles.bytes(), kRecord) << "the surface behind is not seen";
  EXPECT_EQ(tile(0, true, scene::AlphaMode::kBlend).triangles.bytes(), 2 * kRecord) << "layers name triangles, too";
  EXPECT_EQ(tile(4, false).triangles.bytes(), kRecord + 4 * kCorner) << "two triangles";
  EXPECT_GT(tile(4).triangles.bytes(), kRecord + 4 * kCorner) << "cells of a grid";
}

TEST(SampleLayout, TakesTwelveBytesWhetherThingsMoveOrNot) {
  for (const bool rest : {false, true}) {
    EXPECT_EQ((SampleLayout{16, false, rest}.sample_bytes()), 12u);
    EXPECT_EQ((SampleLayout{16, false, rest}.layer_bytes()), 16u);
    EXPECT_EQ((SampleLayout{32, false, rest}.sample_bytes()), 16u);
    EXPECT_EQ((SampleLayout{9, false, rest}.sample_bytes()), 11u) << "18 bits are three bytes";
  }
  EXPECT_EQ((SampleLayout{16, true, false}.sample_bytes()), 20u) << "parameters of procedures are whole";
  EXPECT_EQ((SampleLayout{16, true, true}.sample_bytes()), 28u);
}

TEST(SampleLayout, AStateThatIsStoredHasItsTable) {
  const TileState still = tile(0), moving = tile(4);
  EXPECT_EQ(still.bytes(8), 16u * 16 * 4 * 12 + kRecord);
  EXPECT_EQ(moving.bytes(8), 16u * 16 * 4 * 12 + moving.triangles.bytes());
}

TEST(Weights, AreRoundedToStepsAndHoldTheTriangle) {
  Random random(3);
  for (int k = 0; k < 100'000; ++k) {
    const int bits = random.integer(8, 23);
    const float steps = weight_steps(bits), w1 = random.uniform(0, 1), w2 = (1.0f - w1) * random.uniform(0, 1);
    float b1 = w1, b2 = w2;
    round_weights(steps, b1, b2);
    EXPECT_NEAR(b1, w1, 0.5001f / steps + 1e-7f);
    EXPECT_NEAR(b2, w2, 1.0001f / steps + 1e-7f) << "where both were rounded up";
    EXPECT_GE((1.0f - b1) - b2, 0.0f);
  }
  float b1 = 1, b2 = 0;
  round_weights(weight_steps(16), b1, b2);
  EXPECT_EQ(b1, 1.0f) << "a corner stays where it is";
  b1 = 0.3f, b2 = 0.4f;
  round_weights(weight_steps(24), b1, b2);
  EXPECT_TRUE(b1 == 0.3f && b2 == 0.4f) << "no rounder than single precision";
}

}  // namespace
}  // namespace tessera::tilecore::triangle_table_test
