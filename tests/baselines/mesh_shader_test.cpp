// Mesh-shader machines and the compute tessellator: their meshlets, culling, stores and reads, by the descriptions of
// their formats.
#include "baselines/mesh_shader.h"

#include "baselines/tessellated_in_memory.h"
#include "gpu/configuration.h"
#include "tests/baselines/baseline_decoders.h"
#include "tests/baselines/patch_scenes.h"
#include "tests/support/tests.h"

namespace tessera::baselines::mesh_shader_test {
namespace {

using test::kHeight;
using test::kWidth;
using test::projection;
using test::tiles_of;
using test::Triangle;
using test::triangle_of;

// A flat grid with the numbers of its triangles, as geometry passes give it.
TessellatedPatch numbered_grid(int n, float x0, float y0, float side, std::uint32_t number = 0) {
  TessellatedPatch patch = test::flat_grid(n, x0, y0, side);
  patch.number = number;
  patch.columns = patch.rows = n;
  for (const auto& triangle : patch.triangles) {
    const auto a = triangle[0], row = a / static_cast<std::uint32_t>(n + 1),
               column = a % static_cast<std::uint32_t>(n + 1);
    const std::uint32_t first = 2 * (row * static_cast<std::uint32_t>(n) + column);
    patch.triangle_numbers.push_back(triangle[1] == a + 1 ? first : first + 1);
  }
  return patch;
}

std::vector<TessellatedPatch> mixed() {
  std::vector<TessellatedPatch> scene = {numbered_grid(20, 5, 5, 120, 0), numbered_grid(3, 60, 20, 70, 1),
                                         numbered_grid(9, 150, 60, 80, 2)};
  scene[2].moving = true;
  for (std::size_t v = 0; v < scene[2].x0.size(); ++v)
    scene[2].x1.push_back(scene[2].x0[v] + 7.25f), scene[2].y1.push_back(scene[2].y0[v] - 3.5f),
        scene[2].z1.push_back(2.5f);
  for (TessellatedPatch& cluster : test::indexed_mesh(10, 20, 90, 60, 7, false)) {
    cluster.number = static_cast<std::uint32_t>(scene.size());
    scene.push_back(cluster);
  }
  return scene;
}

// Depths of a frame in which all samples see the same.
DepthPyramid flat_depths(float depth) {
  DepthPyramid out({0, 0, kWidth, kHeight});
  out.add({0, 0, kWidth, kHeight}, std::vector<float>(std::size_t{25} * 19, depth));
  out.finish();
  return out;
}
const float kNothing = std::numeric_limits<float>::infinity();

// ---- Meshlets -----------------------------------------------------------------------------------------------------

TEST(Meshlets, MC1EveryTriangleIsInOneMeshletWithinTheLimits) {
  for (int n = 1; n <= 64; ++n) {
    const TessellatedPatch patch = numbered_grid(n, 1, 1, 100);
    std::multiset<Triangle> all, cut;
    for (const auto& vertex : patch.triangles) all.insert(triangle_of(patch, vertex));
    const std::vector<Meshlet> meshlets = cut_into_meshlets(patch);
    for (const Meshlet& meshlet : meshlets) {
      EXPECT_EQ(meshlet.part, meshlets.size() > 1);
      EXPECT_LE(meshlet.vertices.size(), 64u);
      EXPECT_LE(meshlet.triangles.size(), 124u);
      std::set<float> x, y;
      for (const std::uint32_t v : meshlet.vertices) x.insert(patch.x0[v]), y.insert(patch.y0[v]);
      EXPECT_LE(std::max(x.size(), y.size()), 12u) << "11 segments";
      for (const BlockTriangle& t : meshlet.triangles)
        cut.insert(triangle_of(patch, {meshlet.vertices[t[0]], meshlet.vertices[t[1]], meshlet.vertices[t[2]]}));
    }
    EXPECT_EQ(cut, all) << n;
  }
}

// 16x16 cells: 6x8 take 7 * 9 = 63 vertices; no cut has fewer than 3 * 2 parts.
TEST(Meshlets, APatchIsCutIntoAsFewPartsAsTheLimitsAllow) {
  EXPECT_EQ(cut_into_meshlets(numbered_grid(7, 1, 1, 100)).size(), 1u) << "64 vertices, 98 triangles";
  EXPECT_EQ(cut_into_meshlets(numbered_grid(8, 1, 1, 100)).size(), 2u);
  const std::vector<Meshlet> parts = cut_into_meshlets(numbered_grid(16, 1, 1, 100));
  ASSERT_EQ(parts.size(), 6u);
  std::uint64_t vertices = 0;
  for (const Meshlet& part : parts) vertices += part.vertices.size();
  EXPECT_EQ(vertices, (16u + 3) * (16 + 2)) << "each inner border twice";
}

// ---- Task shaders -------------------------------------------------------------------------------------------------

TEST(DepthPyramid, DP1ARectangleIsHiddenOnlyIfAllItsSamplesSeeNearerThings) {
  Random random(5);
  // A region that does not begin with a block; two tiles with a border inside a block.
  const IntRect region = {3, 5, 96, 77};
  std::vector<float> seen(96 * 77, 0);
  DepthPyramid pyramid(region);
  for (const IntRect& tile : {IntRect{3, 5, 40, 77}, IntRect{40, 5, 96, 77}}) {
    std::vector<float> blocks;
    for (int y = tile.y0; y < tile.y1; y += 8)
      for (int x = tile.x0; x < tile.x1; x += 8) {
        blocks.push_back(0);
        const float base = random.uniform(1, 9);
        for (int j = y; j < std::min(y + 8, tile.y1); ++j)
          for (int i = x; i < std::min(x + 8, tile.x1); ++i) {
            float& depth = seen[static_cast<std::size_t>(j * 96 + i)];
            depth = base + random.uniform(0, 0.1f);
            blocks.back() = std::max(blocks.back(), depth);
          }
      }
    pyramid.add(tile, blocks);
  }
  pyramid.finish();
  // Blocks of 8x8 pixels: 12x9, 6x5, 3x3, 2x2 and 1, of two bytes.
  EXPECT_EQ(pyramid.bytes(), 2u * (108 + 30 + 9 + 4 + 1));
  int hidden = 0, wrong = 0, missed = 0;
  for (int n = 0; n < 2000; ++n) {
    const int x0 = random.integer(3, 94), y0 = random.integer(5, 75), x1 = random.integer(x0, std::min(x0 + 30, 95)),
              y1 = random.integer(y0, std::min(y0 + 30, 76));
    frontend::ScreenBounds rectangle{};
    rectangle.x0 = static_cast<float>(x0), rectangle.y0 = static_cast<float>(y0);
    rectangle.x1 = static_cast<float>(x1) + 0.9f, rectangle.y1 = static_cast<float>(y1) + 0.9f;
    rectangle.near_z = random.uniform(1, 12);
    float farthest = 0;
    for (int y = y0; y <= y1; ++y)
      for (int x = x0; x <= x1; ++x) farthest = std::max(farthest, seen[static_cast<std::size_t>(y * 96 + x)]);
    const bool hides = pyramid.hides(rectangle);
    hidden += hides ? 1 : 0;
    wrong += hides && rectangle.near_z <= farthest ? 1 : 0;
    rectangle.near_z = 20;
    missed += pyramid.hides(rectangle) ? 0 : 1;
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(missed, 0);
  EXPECT_GT(hidden, 100);
}

TEST(TaskShader, DropsMeshletsThatAreHiddenOutsideOrFaceAway) {
  const scene::Projection p = projection(0);
  const binner::TileGrid grid(kWidth, kHeight, 32, 32);
  const TriangleSetup setup(grid, p);
  BaselineCounters counters;
  TessellatedPatch patch = numbered_grid(16, -60, 10, 120);  // depth 2; the left half of its six parts is outside
  const DepthPyramid empty = flat_depths(kNothing), behind = flat_depths(2.1f), front = flat_depths(1.9f);
  const auto kept = [&](const DepthPyramid& depths, TaskShader::Counts* counts = nullptr) {
    TaskShader task(setup, depths);
    const std::size_t count = task.run(patch, setup.run(patch, counters)).size();
    if (counts != nullptr) *counts = task.counts();
    return count;
  };
  // Parts end at columns 6, 12 and 16: at pixels -15, 30 and 60.
  EXPECT_EQ(kept(empty), 4u);
  EXPECT_EQ(kept(behind), 4u);
  TaskShader::Counts counts;
  EXPECT_EQ(kept(front, &counts), 0u);
  EXPECT_EQ(counts.parts, 6u);
  EXPECT_EQ(counts.lookups, 4u);
  EXPECT_EQ(counts.hidden, 4u);
  EXPECT_EQ(counts.instructions(1), 128u + 6 * 1028);
  // Triangles that face away, and triangles that cannot be put on the screen.
  patch.keep_positive = patch.keep_negative = false;
  EXPECT_EQ(kept(empty), 0u);
  patch.keep_positive = patch.keep_negative = true;
  patch.projected.assign(patch.projected.size(), 0);
  EXPECT_GT(kept(front), 0u) << "a meshlet through the near plane is never hidden";
}

// ---- Stored outputs -----------------------------------------------------------------------------------------------

using Tiles = std::map<binner::TileIndex, std::multiset<Triangle>>;

struct Drawn {
  Tiles expected;
  std::uint64_t vertices = 0, meshlets = 0, records = 0;  // bytes of records
};

// Bins a scene of which nothing is hidden. `forget`: a triangle of the first patch that its list loses.
Drawn draw(MeshletBinner& binner, MeshStorage storage, const binner::TileGrid& grid,
           const std::vector<TessellatedPatch>& scene, bool forget = false) {
  const scene::Projection p = projection(0);
  const TriangleSetup setup(grid, p);
  const DepthPyramid empty = flat_depths(kNothing);
  TaskShader task(setup, empty);
  BaselineCounters counters;
  Drawn out;
  for (const TessellatedPatch& patch : scene) {
    TriangleList list = setup.run(patch, counters);
    for (std::size_t t = 0; t < list.triangles.size(); ++t)
      for (const binner::TileIndex tile : tiles_of(list, t))
        out.expected[tile].insert(triangle_of(patch, list.triangles[t].vertex));
    const std::vector<Meshlet> meshlets = task.run(patch, list);
    for (const Meshlet& m : meshlets) {
      ++out.meshlets, out.vertices += m.vertices.size();
      out.records +=
          MeshletBinner::layout(storage, m.vertices.size(), m.triangles.size(), patch.moving, patch.attribute_bytes)
              .bytes;
    }
    if (forget && patch.number == 0) list.fates[list.triangles.front().number] = TriangleFate::kFrustum;
    binner.add(patch, meshlets, list);
  }
  binner.finish();
  return out;
}

// Decodes tiles from memory alone; only the address of a record comes from its meshlet's number.
Tiles decoded(const MeshletBinner& binner, MeshStorage storage, const binner::TileGrid& grid,
              const std::vector<bool>& moving) {
  const std::span<const std::uint8_t> memory = binner.buffer().memory();
  const auto number_at = [&](std::uint64_t at) {
    float value = 0;
    std::memcpy(&value, &memory[at], sizeof value);
    return value;
  };
  Tiles out;
  for (binner::TileIndex tile = 0; tile < grid.tile_count(); ++tile) {
    memory::Ledger ledger;
    std::uint64_t ignored = 0, meshlet = 0;
    const std::vector<std::uint8_t> list = binner.buffer().read_list(tile, ledger, ignored);
    for (std::size_t at = 0; at < list.size();) {
      meshlet += test::decode_number(list, at);
      std::size_t taken = 0;
      const auto set = test::decode_triangle_set(std::span(list).subspan(at), binner.triangle_count(meshlet), taken);
      at += taken;
      const std::uint64_t record = binner.address(meshlet);
      const bool compact = storage == MeshStorage::kCompact, moves = moving[meshlet];
      const std::uint64_t vertices = compact ? memory[record] : 64, keys = moves ? 2 : 1,
                          attributes = compact ? 20 : 32;
      const std::uint64_t positions = record + (compact ? 4 : 0),
                          indices = positions + vertices * (16 * keys + attributes);
      for (std::size_t t = 0; t < binner.triangle_count(meshlet); ++t) {
        if (!set[t]) continue;
        Triangle triangle{};
        for (std::size_t k = 0; k < 3; ++k) {
          const std::uint64_t v = memory[indices + (compact ? 3 * t + k : 16 * t + 4 * k)];
          for (std::size_t key = 0; key < keys; ++key)
            for (std::size_t c = 0; c < 3; ++c)
              triangle[k][3 * key + c] = number_at(positions + v * 16 * keys + 16 * key + 4 * c);
        }
        out[tile].insert(test::turned(triangle));
      }
    }
  }
  return out;
}

// Whether each meshlet of the scene moves, in their order.
std::vector<bool> moving_meshlets(const std::vector<TessellatedPatch>& scene, const binner::TileGrid& grid) {
  const scene::Projection p = projection(0);
  const TriangleSetup setup(grid, p);
  const DepthPyramid empty = flat_depths(kNothing);
  TaskShader task(setup, empty);
  BaselineCounters counters;
  std::vector<bool> out;
  for (const TessellatedPatch& patch : scene)
    out.insert(out.end(), task.run(patch, setup.run(patch, counters)).size(), patch.moving);
  return out;
}

TEST(MeshShader, MESH1MESH2EveryListDecodesToTheTrianglesOfItsTile) {
  const binner::TileGrid grid(kWidth, kHeight, 16, 16);
  const std::vector<TessellatedPatch> scene = mixed();
  for (const MeshStorage storage : {MeshStorage::kRing, MeshStorage::kCompact}) {
    MeshletBinner binner({}, grid, storage), forgetful({}, grid, storage);
    const Drawn drawn = draw(binner, storage, grid, scene);
    const std::vector<bool> moving = moving_meshlets(scene, grid);
    EXPECT_EQ(decoded(binner, storage, grid, moving), drawn.expected);
    EXPECT_EQ(binner.counters().domain_evaluations, drawn.vertices);
    EXPECT_EQ(binner.counters().vertices_stored, drawn.vertices);
    EXPECT_GE(binner.counters().queue_bytes_written, drawn.records);
    // The failing twin.
    draw(forgetful, storage, grid, scene, true);
    EXPECT_NE(decoded(forgetful, storage, grid, moving), drawn.expected);
  }
}

// The published sizes: position and one slot of attributes make 64 * 32 + 124 * 16 bytes; with 4 bytes of attributes 94
// triangles over 64 vertices take 64 * 20 + 94 * 3 bytes and a head, 17 a triangle.
TEST(MeshShader, RecordsAreAsLargeAsPublished) {
  using enum MeshStorage;
  EXPECT_EQ(MeshletBinner::layout(kRing, 3, 1, false, 8).bytes, 4032u);
  EXPECT_EQ(MeshletBinner::layout(kRing, 64, 124, false, 16).bytes, 4032u);
  EXPECT_EQ(MeshletBinner::layout(kRing, 64, 124, true, 36).bytes, 64u * (32 + 48) + 124 * 16);
  EXPECT_EQ(MeshletBinner::layout(kCompact, 64, 94, false, 4).bytes, 4u + 64 * 20 + 94 * 3 + 2);
  EXPECT_EQ(MeshletBinner::layout(kCompact, 64, 94, false, 4).bytes / 94, 16u);
}

// One patch of 49 cells in one tile, bursts of 64 bytes; attributes of 20 bytes.
TEST(MeshShader, BytesOfATinySceneFollowTheFormats) {
  const binner::TileGrid grid(200, 200, 200, 200);
  const TessellatedPatch patch = numbered_grid(7, 4, 4, 100);
  for (const MeshStorage storage : {MeshStorage::kRing, MeshStorage::kCompact}) {
    const bool ring = storage == MeshStorage::kRing;
    MeshletBinner binner({}, grid, storage);
    draw(binner, storage, grid, {patch});
    const BaselineCounters& c = binner.counters();
    // 64 vertices and 98 triangles: with slots of 16 bytes two hold 20; else 4 + 64 * 36 + 98 * 3, filled up.
    const std::uint64_t record = ring ? 64 * 48 + 124 * 16 : 4 + 64 * 36 + 98 * 3 + 2;
    EXPECT_EQ(c.entries, 1u);
    // Reference: meshlet 0, "all"; its end; the list's cursor, a byte of bits.
    EXPECT_EQ(c.queue_bytes_written, record + 2 + 1 + 8 + 1);
    // To bin: 16 bursts of positions, 98 * 16 bytes of indices. In the tile everything but unused room: in the ring
    // 26 triangles (of 98 * 16 bytes the last burst is half full).
    const std::uint64_t bin = ring ? 64 * (16 + 25) : 0, bursts = ring ? 64 * 48 / 64 + 25 : (record + 63) / 64;
    EXPECT_EQ(binner.read_to_bin_bytes(), bin);
    EXPECT_EQ(binner.copy_instructions(), ring ? 64u * 8 : 0u);
    EXPECT_EQ(c.queue_bytes_read, bin + 2 + 1 + 64 * bursts);
    const std::uint64_t written = (record + 63) / 64 + 3;
    EXPECT_EQ(binner.dram_bytes(), bin + 64 * (written + 2 + bursts)) << "bits and list are read, too";
    EXPECT_EQ(binner.dram_bytes_uncached(), binner.dram_bytes());
  }
}

// ---- References ---------------------------------------------------------------------------------------------------

// Tiles that a triangle of each kept meshlet may touch; a tile shades all vertices of those in its list.
TEST(MeshShader, MR1ReferencesLeadEachTileToWholeMeshlets) {
  const binner::TileGrid grid(kWidth, kHeight, 32, 32);
  const scene::Projection p = projection(0);
  const TriangleSetup setup(grid, p);
  const DepthPyramid empty = flat_depths(kNothing);
  const std::vector<TessellatedPatch> scene = mixed();
  gpu::GpuConfiguration none, all;
  none.tessellator.cache_bytes = none.caches.l2_bytes = 0;
  all.tessellator.cache_bytes = 1 << 30;
  std::map<bool, BaselineCounters> counters;
  std::uint64_t entries = 0, bytes = 0, of_tiles = 0;
  std::set<std::array<std::uint64_t, 2>> distinct;
  std::map<std::pair<binner::TileIndex, std::uint32_t>, std::set<std::uint32_t>> vertices;  // by tile and patch
  for (const bool cached : {false, true}) {
    MeshReferenceBinner binner(cached ? all : none, grid);
    TaskShader task(setup, empty);
    BaselineCounters ignored;
    for (const TessellatedPatch& patch : scene) {
      const TriangleList list = setup.run(patch, ignored);
      const std::vector<Meshlet> meshlets = task.run(patch, list);
      binner.add(patch, meshlets, list);
      if (cached) continue;
      for (const Meshlet& meshlet : meshlets) {
        std::set<binner::TileIndex> tiles;
        for (std::size_t t = 0; t < list.triangles.size(); ++t)
          if (std::binary_search(meshlet.numbers.begin(), meshlet.numbers.end(), list.triangles[t].number))
            tiles.merge(tiles_of(list, t));
        entries += tiles.size();
        bytes += tiles.size() * (meshlet.part ? 24 : 8);
        for (const binner::TileIndex tile : tiles)
          vertices[{tile, patch.number}].insert(meshlet.vertices.begin(), meshlet.vertices.end());
        for (const std::uint32_t v : meshlet.vertices) distinct.insert({patch.number, v});
      }
    }
    binner.finish();
    counters[cached] = binner.lists().counters();
  }
  for (const auto& [of, shaded] : vertices) of_tiles += shaded.size();
  EXPECT_EQ(counters[false].entries, entries);
  EXPECT_GT(counters[false].queue_bytes_written, bytes);
  EXPECT_EQ(counters[false].domain_evaluations_cached, of_tiles);
  EXPECT_EQ(counters[true].domain_evaluations, of_tiles);
  EXPECT_EQ(counters[true].domain_evaluations_cached, distinct.size());
}

TEST(MeshShader, AReferenceTakes8BytesAndOneToAPart24) {
  const binner::TileGrid grid(200, 200, 200, 200);
  const scene::Projection p = projection(0);
  const TriangleSetup setup(grid, p);
  for (const int n : {7, 16}) {
    const TessellatedPatch patch = numbered_grid(n, 4, 4, 100);
    BaselineCounters ignored;
    const TriangleList list = setup.run(patch, ignored);
    MeshReferenceBinner binner({}, grid);
    binner.add(patch, cut_into_meshlets(patch), list);
    binner.finish();
    memory::Ledger ledger;
    std::uint64_t bytes = 0;
    EXPECT_EQ(binner.lists().buffer().read_list(0, ledger, bytes).size(), n == 7 ? 8u : 6u * 24);
    EXPECT_EQ(binner.lists().counters().entries, n == 7 ? 1u : 6u);
  }
}

// ---- A compute tessellator ------------------------------------------------------------------------------------------

std::uint32_t word_of(std::span<const std::uint8_t> bytes, std::size_t at) {
  return bytes[at] | static_cast<std::uint32_t>(bytes[at + 1]) << 8 | static_cast<std::uint32_t>(bytes[at + 2]) << 16 |
         static_cast<std::uint32_t>(bytes[at + 3]) << 24;
}

TEST(TessellatedInMemory, CT1PointsAndIndicesEqualThePatchs) {
  const TessellatedPatch patch = numbered_grid(4, 4, 4, 100);
  const std::vector<std::uint8_t> block = encode_tessellation(patch);
  ASSERT_EQ(block.size(), 25u * 8 + 32 * 3 * 4);
  for (std::size_t v = 0; v < 25; ++v) {
    EXPECT_EQ(word_of(block, 8 * v), v % 5 == 4 ? ~0u : static_cast<std::uint32_t>(v % 5) << 30);
    EXPECT_EQ(word_of(block, 8 * v + 4), v / 5 == 4 ? ~0u : static_cast<std::uint32_t>(v / 5) << 30);
  }
  for (std::size_t t = 0; t < 32; ++t)
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(word_of(block, 200 + 12 * t + 4 * k), patch.triangles[t][k]);
}

// One patch of 49 cells in one tile: a block of 64 * 8 + 98 * 12 bytes, 27 bursts, is written, read to bin, and read again
// by the tile. A cluster has no block.
TEST(TessellatedInMemory, ABlockIsWrittenOnceAndReadTwice) {
  const binner::TileGrid grid(200, 200, 200, 200);
  const scene::Projection p = projection(0);
  const TriangleSetup setup(grid, p);
  const TessellatedPatch patch = numbered_grid(7, 4, 4, 100), cluster = test::indexed_mesh(6, 4, 4, 100, 0, false)[0];
  BaselineCounters ignored;
  for (const TessellatedPatch& drawn : {patch, cluster}) {
    DeferredVertexBinner plain({}, grid);
    TessellatedInMemoryBinner binner({}, grid);
    plain.add(drawn, setup.run(drawn, ignored));
    binner.add(drawn, setup.run(drawn, ignored));
    plain.finish();
    binner.finish();
    const std::uint64_t bytes = drawn.columns > 0 ? 64 * 8 + 98 * 12 : 0, bursts = (bytes + 63) / 64 * 64;
    const BaselineCounters &a = plain.lists().counters(), &b = binner.lists().counters();
    EXPECT_EQ(b.queue_bytes_written, a.queue_bytes_written + bytes);
    EXPECT_EQ(b.queue_bytes_read, a.queue_bytes_read + bursts);
    EXPECT_EQ(b.domain_evaluations_cached, a.domain_evaluations_cached);
    EXPECT_EQ(binner.lists().dram_bytes(), plain.lists().dram_bytes() + 2 * bursts);
    EXPECT_EQ(binner.tessellated().read_bytes, bursts);
    EXPECT_EQ(binner.tessellated().instructions, drawn.columns > 0 ? 64u + 64 * 24 + 98 * 18 : 0u);
  }
}

// A tile that holds a part of a patch reads the indices and points of that part; without a cache each tile again.
TEST(TessellatedInMemory, TilesReadTheVerticesThatTheyShade) {
  const binner::TileGrid grid(kWidth, kHeight, 32, 32);
  const scene::Projection p = projection(0);
  const TriangleSetup setup(grid, p);
  const TessellatedPatch patch = numbered_grid(40, 5, 5, 120);
  gpu::GpuConfiguration none, all;
  none.tessellator.cache_bytes = none.baselines.cache_bytes = none.caches.l2_bytes = 0;
  all.tessellator.cache_bytes = all.baselines.cache_bytes = 1 << 30;
  const std::uint64_t block = 41 * 41 * 8 + 3200 * 12;
  std::map<bool, std::uint64_t> read;
  for (const bool cached : {false, true}) {
    BaselineCounters ignored;
    DeferredVertexBinner plain(cached ? all : none, grid);
    TessellatedInMemoryBinner binner(cached ? all : none, grid);
    plain.add(patch, setup.run(patch, ignored));
    binner.add(patch, setup.run(patch, ignored));
    plain.finish();
    binner.finish();
    read[cached] = binner.lists().counters().queue_bytes_read - plain.lists().counters().queue_bytes_read;
  }
  EXPECT_EQ(read[true], (block + 63) / 64 * 64) << "each burst once";
  EXPECT_GT(read[false], read[true]);
  EXPECT_LT(read[false], 3 * block) << "tiles read no more than their part";
}

}  // namespace
}  // namespace tessera::baselines::mesh_shader_test
