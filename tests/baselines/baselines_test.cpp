// The baselines: coverage and culling of moving, defocused triangles, blocks in the parameter buffer, the immediate
// machine's memory.
#include "baselines/post_tessellation.h"
#include "baselines/tile_drawing.h"
#include "frontend/patch_record.h"
#include "gpu/configuration.h"
#include "tests/baselines/baseline_decoders.h"
#include "tests/baselines/patch_scenes.h"
#include "tests/support/tests.h"

namespace tessera::baselines::baselines_test {
namespace {

using test::Binned;
using test::flat_grid;
using test::kHeight;
using test::kWidth;
using test::mixed_scene;
using test::on_grid;
using test::Position;
using test::projection;
using test::scattered;
using test::tiles_of;
using test::Triangle;
using test::triangle_of;
using test::turned;

// ---- Coverage ---------------------------------------------------------------------------------------------------

struct Placed {
  std::array<double, 3> x, y;
  double area() const { return (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]); }
};

// Where a triangle is at a time, seen through a point of the lens: the formulas of raster space.
Placed placed(const TessellatedPatch& patch, const std::array<std::uint32_t, 3>& vertex, double t, double u, double v,
              const scene::Projection& p) {
  Placed out{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t n = vertex[k];
    double x = static_cast<double>(patch.x0[n]), y = static_cast<double>(patch.y0[n]),
           z = static_cast<double>(patch.z0[n]);
    if (patch.moving) {
      const double z1 = static_cast<double>(patch.z1[n]), rate = t * z1 / ((1 - t) * z + t * z1);
      x += rate * (static_cast<double>(patch.x1[n]) - x);
      y += rate * (static_cast<double>(patch.y1[n]) - y);
      z = (1 - t) * z + t * z1;
    }
    const double coc = p.lens_scale == 0 ? 0 : p.lens_scale * (1 / z - p.inverse_focus);
    out.x[k] = x + u * coc;
    out.y[k] = y + v * coc;
  }
  return out;
}

// Counts points of triangles in tiles whose lists lack the triangle, points of culled front sides included. The
// points are placed with the projection `seen_through`.
int missed(const TessellatedPatch& patch, const TriangleSetup& setup, const binner::TileGrid& grid,
           const scene::Projection& seen_through, Random& random) {
  BaselineCounters counters;
  const TriangleList list = setup.run(patch, counters);
  std::map<std::array<std::uint32_t, 3>, std::set<binner::TileIndex>> tiles;
  for (std::size_t t = 0; t < list.triangles.size(); ++t) tiles[list.triangles[t].vertex] = tiles_of(list, t);
  int wrong = 0;
  for (const auto& vertex : patch.triangles)
    for (int n = 0; n < 200; ++n) {
      const double radius = std::sqrt(static_cast<double>(random.uniform(0, 1))),
                   angle = static_cast<double>(random.uniform(0, 6.2831853f));
      const double t = static_cast<double>(random.integer(0, 4)) / 4;
      const Placed at = placed(patch, vertex, t, radius * std::cos(angle), radius * std::sin(angle), seen_through);
      if (at.area() > 0 ? !patch.keep_positive : !patch.keep_negative) continue;
      double b1 = static_cast<double>(random.uniform(0, 1)), b2 = static_cast<double>(random.uniform(0, 1));
      if (b1 + b2 > 1) b1 = 1 - b1, b2 = 1 - b2;
      const double x = at.x[0] + b1 * (at.x[1] - at.x[0]) + b2 * (at.x[2] - at.x[0]),
                   y = at.y[0] + b1 * (at.y[1] - at.y[0]) + b2 * (at.y[2] - at.y[0]);
      if (x < 0 || y < 0 || x >= kWidth || y >= kHeight || std::abs(at.area()) < 1e-3) continue;
      const binner::TileIndex tile =
          grid.index(static_cast<int>(x) / grid.tile_width(), static_cast<int>(y) / grid.tile_height());
      const auto found = tiles.find(vertex);
      if (found == tiles.end() || !found->second.contains(tile)) ++wrong;
    }
  return wrong;
}

TEST(TriangleSetup, TS1TS3EveryPointOfAMovingDefocusedTriangleLiesInATileOfItsList) {
  Random random(1);
  const binner::TileGrid grid(kWidth, kHeight, 16, 16);
  for (const bool moving : {false, true})
    for (const double lens : {0.0, 25.0})
      for (const bool two_sided : {true, false})
        for (const float size : {1.0f, 6.0f, 60.0f}) {
          const scene::Projection p = projection(lens);
          const TriangleSetup setup(grid, p);
          EXPECT_EQ(missed(scattered({40, moving, two_sided, size}, random), setup, grid, p, random), 0)
              << moving << lens << two_sided << size;
        }
}

TEST(TriangleSetupTwin, ForgettingTheLensIsCaught) {
  Random random(2);
  const binner::TileGrid grid(kWidth, kHeight, 16, 16);
  const scene::Projection pinhole = projection(0), lens = projection(25);
  EXPECT_GT(missed(scattered({40, true, true, 6}, random), TriangleSetup(grid, pinhole), grid, lens, random), 0);
}

// Whether a triangle and a closed rectangle meet, by cutting the one with the other (Sutherland and Hodgman 1974).
bool meets(const TessellatedPatch& patch, const std::array<std::uint32_t, 3>& vertex, double x0, double y0, double x1,
           double y1) {
  std::vector<std::array<double, 2>> polygon;
  for (const std::uint32_t v : vertex)
    polygon.push_back({static_cast<double>(patch.x0[v]), static_cast<double>(patch.y0[v])});
  const std::array<std::array<double, 3>, 4> sides = {{{1, 0, -x0}, {-1, 0, x1}, {0, 1, -y0}, {0, -1, y1}}};
  for (const auto& s : sides) {
    std::vector<std::array<double, 2>> cut;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const auto &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
      const double da = s[0] * a[0] + s[1] * a[1] + s[2], db = s[0] * b[0] + s[1] * b[1] + s[2];
      if (da >= 0) cut.push_back(a);
      if ((da > 0 && db < 0) || (da < 0 && db > 0))
        cut.push_back({a[0] + (b[0] - a[0]) * da / (da - db), a[1] + (b[1] - a[1]) * da / (da - db)});
    }
    polygon = cut;
  }
  return !polygon.empty();
}

TEST(TriangleSetup, StillTrianglesAreInExactlyTheTilesThatTheyMeet) {
  Random random(3);
  const binner::TileGrid grid(kWidth, kHeight, 16, 16);
  const scene::Projection p = projection(0);
  const TriangleSetup setup(grid, p);
  for (const float size : {2.0f, 20.0f, 80.0f}) {
    const TessellatedPatch patch = scattered({60, false, true, size}, random);
    BaselineCounters counters;
    const TriangleList list = setup.run(patch, counters);
    std::map<std::array<std::uint32_t, 3>, std::set<binner::TileIndex>> tiles;
    for (std::size_t t = 0; t < list.triangles.size(); ++t) tiles[list.triangles[t].vertex] = tiles_of(list, t);
    for (const auto& vertex : patch.triangles)
      for (int row = 0; row < grid.rows(); ++row)
        for (int column = 0; column < grid.columns(); ++column)
          EXPECT_EQ(tiles[vertex].contains(grid.index(column, row)),
                    meets(patch, vertex, column * 16, row * 16, std::min(column * 16 + 16, kWidth),
                          std::min(row * 16 + 16, kHeight)))
              << "tiles are cut to the frame";
    EXPECT_EQ(counters.primitives + counters.culled_frustum + counters.culled_zero_area, 60u);
  }
}

TEST(TriangleSetup, CountsTheTrianglesThatEachTestDrops) {  // TS2
  const binner::TileGrid grid(64, 64, 32, 32);
  scene::Projection p = projection(0);
  p.far = 5;
  TessellatedPatch patch;
  patch.keep_positive = false;
  const auto add = [&](std::array<float, 6> xy, float z) {
    const auto first = static_cast<std::uint32_t>(patch.x0.size());
    for (std::size_t k = 0; k < 3; ++k)
      patch.x0.push_back(xy[2 * k]), patch.y0.push_back(xy[2 * k + 1]), patch.z0.push_back(z),
          patch.projected.push_back(1);
    patch.triangles.push_back({first, first + 1, first + 2});
  };
  add({1, 1, 1, 9, 9, 1}, 2);     // negative area: front
  add({1, 1, 9, 1, 1, 9}, 2);     // back
  add({1, 1, 5, 5, 9, 9}, 2);     // a line
  add({-9, 1, -9, 9, -1, 1}, 2);  // left of the frame
  add({1, 1, 1, 9, 9, 1}, 6);     // beyond the far plane
  patch.group_ends = {5};
  BaselineCounters counters;
  EXPECT_EQ(TriangleSetup(grid, p).run(patch, counters).triangles.size(), 1u);
  EXPECT_EQ(counters.primitives, 1u);
  EXPECT_EQ(counters.culled_backface, 1u);
  EXPECT_EQ(counters.culled_zero_area, 1u);
  EXPECT_EQ(counters.culled_frustum, 2u);
  EXPECT_EQ(counters.tile_overlaps, 1u);
}

TEST(TriangleSetup, TS4ATriangleThroughTheNearPlaneKeepsItsVisiblePart) {
  const binner::TileGrid grid(64, 64, 32, 32);
  const scene::Projection p = projection(0);
  TessellatedPatch patch;  // homogeneous: two corners in front, one behind the camera
  patch.x0 = {10, 20, 10}, patch.y0 = {10, 10, 300}, patch.z0 = {1, 1, -1};
  patch.projected = {1, 1, 0};
  patch.triangles = {{0, 1, 2}};
  patch.group_ends = {1};
  BaselineCounters counters;
  const TriangleList list = TriangleSetup(grid, p).run(patch, counters);
  ASSERT_EQ(list.triangles.size(), 1u);
  EXPECT_TRUE(tiles_of(list, 0).contains(0));
  EXPECT_TRUE(tiles_of(list, 0).contains(2));  // it leaves through the bottom
  patch.z0 = {-1, -2, -1};
  patch.projected = {0, 0, 0};
  EXPECT_TRUE(TriangleSetup(grid, p).run(patch, counters).triangles.empty());
}

// ---- Blocks in the parameter buffer -----------------------------------------------------------------------------

Binned bin(PostTessellationBinner& post, const std::vector<TessellatedPatch>& scene) {
  Binned out = test::bin(post.setup(), scene, [&](const auto& patch, const auto& list) { post.add(patch, list); });
  post.finish();
  return out;
}

struct Decoded {
  std::map<binner::TileIndex, std::multiset<Triangle>> tiles;
  std::uint64_t own_vertices = 0, repeated = 0, unused = 0, grids = 0, sharing = 0;
};

// Vertices of a block and how many are its own, from the description of the formats.
struct BlockVertices {
  std::vector<Position> positions;
  std::uint64_t own = 0;
};

BlockVertices decode_vertices(std::span<const std::uint8_t> memory, std::uint64_t address, VertexStorage storage,
                              std::uint64_t attribute_bytes) {
  const std::span<const std::uint8_t> block = memory.subspan(address);
  const bool moving = (block[7] & 128u) != 0, has_places = (block[7] & 32u) != 0;
  const std::uint64_t position_bytes = moving ? 32 : 16, indices = block[6] + 256u * (block[7] & 31u);
  std::uint64_t first = address + 8 + (indices + 3) / 4 * 4;
  std::vector<std::optional<VertexPlace>> places(block[4]);
  std::size_t taken = 0;
  if (has_places) places = test::decode_place_bits(memory.subspan(first), block[4], address, taken);
  first += (taken + 3) / 4 * 4;
  BlockVertices out;
  for (const auto& place : places) out.own += place ? 0 : 1;
  std::uint64_t next = 0;
  for (const auto& place : places) {
    std::uint64_t at = place ? place->middle - (place->place + std::uint64_t{1}) * position_bytes : 0;
    if (!place) {
      at = storage == VertexStorage::kEachBlock ? first + next * (position_bytes + attribute_bytes)
                                                : first + (out.own - 1 - next) * position_bytes;
      ++next;
    }
    Position& position = out.positions.emplace_back();
    position.fill(0);
    for (std::size_t key = 0; key < (moving ? 2u : 1u); ++key) {
      float w = 0;
      std::memcpy(&position[3 * key], &memory[at + 16 * key], 12);
      std::memcpy(&w, &memory[at + 16 * key + 12], 4);
      EXPECT_EQ(w, position[3 * key + 2]) << "w of a perspective view is the depth";
    }
  }
  return out;
}

// Decodes the parameter buffer with the decoders of the test.
Decoded decode(const PostTessellationBinner& post, binner::TileIndex tile_count,
               VertexStorage storage = VertexStorage::kEachBlock, std::uint64_t attribute_bytes = 20) {
  Decoded out;
  const auto memory = post.buffer().memory();
  std::set<std::uint64_t> seen;
  for (binner::TileIndex tile = 0; tile < tile_count; ++tile) {
    memory::Ledger ledger;
    std::uint64_t ignored = 0;
    const std::vector<std::uint8_t> list = post.buffer().read_list(tile, ledger, ignored);
    std::uint64_t before = 0;
    for (std::size_t at = 0; at < list.size();) {
      const auto reference = test::decode_reference_with(
          std::span(list).subspan(at), before, [&](std::uint64_t address) { return std::size_t{memory[address + 5]}; });
      at += reference.bytes;
      before = reference.address;
      const std::span<const std::uint8_t> block = memory.subspan(before);
      const std::size_t indices = block[6] + 256u * (block[7] & 31u);
      const bool grids = (block[7] & 64u) != 0;
      const auto triangles = grids ? test::decode_grid_bytes(block.subspan(8, indices), block[5])
                                   : test::decode_strip_bits(block.subspan(8, indices), block[5]);
      const BlockVertices vertices = decode_vertices(memory, before, storage, attribute_bytes);
      std::set<std::uint8_t> used;
      for (std::size_t t = 0; t < triangles.size(); ++t) {
        used.insert(triangles[t].begin(), triangles[t].end());
        if (reference.triangles[t])
          out.tiles[tile].insert(turned({vertices.positions[triangles[t][0]], vertices.positions[triangles[t][1]],
                                         vertices.positions[triangles[t][2]]}));
      }
      if (!seen.insert(before).second) continue;
      out.grids += grids ? 1u : 0u;
      out.sharing += (block[7] & 32u) != 0 ? 1u : 0u;
      out.own_vertices += vertices.own;
      out.unused += vertices.positions.size() - used.size();
      out.repeated +=
          vertices.positions.size() - std::set<Position>(vertices.positions.begin(), vertices.positions.end()).size();
    }
  }
  return out;
}

TEST(PostTessellation, PT1PT2EveryTileDecodesToItsTrianglesAndBlocksHoldEachVertexOnce) {
  for (const double lens : {0.0, 12.0}) {
    const binner::TileGrid grid(kWidth, kHeight, 32, 32);
    const scene::Projection p = projection(lens);
    PostTessellationBinner post({}, grid, p);
    const Binned binned = bin(post, mixed_scene(1));
    const Decoded decoded = decode(post, grid.tile_count());
    EXPECT_EQ(decoded.tiles, binned.expected);
    EXPECT_EQ(decoded.unused, 0u);
    EXPECT_EQ(decoded.repeated, 0u);
    EXPECT_EQ(decoded.own_vertices, post.counters().vertices_stored);
    EXPECT_GT(decoded.grids, 3u);
    EXPECT_EQ(decoded.sharing, 0u);
  }
}

// Tessellated patches, and two draws of indexed meshes, one of which moves.
std::vector<TessellatedPatch> indexed_scene() {
  std::vector<TessellatedPatch> scene = mixed_scene(3);
  for (const TessellatedPatch& cluster : test::indexed_mesh(20, 12, 8, 110, 7, false)) scene.push_back(cluster);
  for (const TessellatedPatch& cluster : test::indexed_mesh(17, 60, 30, 90, 8, true)) scene.push_back(cluster);
  return scene;
}

TEST(PostPosition, PT1PT2PT4PT5EveryTileDecodesToItsTrianglesAndADrawStoresEachVertexOnce) {
  for (const double lens : {0.0, 12.0}) {
    const binner::TileGrid grid(kWidth, kHeight, 32, 32);
    const scene::Projection p = projection(lens);
    const std::vector<TessellatedPatch> scene = indexed_scene();
    PostTessellationBinner position({}, grid, p, VertexStorage::kEachDraw), post({}, grid, p);
    const Binned binned = bin(position, scene);
    bin(post, scene);
    const Decoded decoded = decode(position, grid.tile_count(), VertexStorage::kEachDraw);
    EXPECT_EQ(decoded.tiles, binned.expected);
    EXPECT_EQ(decoded.unused, 0u);
    EXPECT_EQ(decoded.repeated, 0u);
    EXPECT_GT(decoded.grids, 3u);
    EXPECT_GT(decoded.sharing, 5u);
    EXPECT_EQ(position.counters().vertices_stored, binned.draw_vertices.size());
    EXPECT_EQ(decoded.own_vertices, binned.draw_vertices.size());
    EXPECT_EQ(position.counters().domain_evaluations, binned.draw_vertices.size());
    EXPECT_LT(position.counters().vertices_stored, post.counters().vertices_stored);
    EXPECT_LT(position.counters().queue_bytes_written, post.counters().queue_bytes_written);
    // Positions of a draw are shaded once: 21 x 21 and 18 x 18 of the meshes, all of the tessellated patches.
    std::uint64_t shaded = 21 * 21 + 18 * 18;
    for (const TessellatedPatch& patch : scene) shaded += patch.draw_numbers.empty() ? patch.x0.size() : 0;
    EXPECT_EQ(position.counters().position_evaluations, shaded);
  }
}

// Without an index buffer vertices on shared edges are other vertices, so each cluster stores its own.
TEST(PostPositionTwin, RepeatedVerticesAreCounted) {
  const binner::TileGrid grid(kWidth, kHeight, 32, 32);
  const scene::Projection p = projection(0);
  std::vector<TessellatedPatch> scene = test::indexed_mesh(20, 12, 8, 110, 7, false);
  PostTessellationBinner once({}, grid, p, VertexStorage::kEachDraw);
  const std::size_t distinct = bin(once, scene).draw_vertices.size();
  EXPECT_EQ(once.counters().vertices_stored, distinct);
  for (TessellatedPatch& cluster : scene) cluster.draw_numbers.clear();
  PostTessellationBinner repeated({}, grid, p, VertexStorage::kEachDraw);
  bin(repeated, scene);
  EXPECT_EQ(repeated.counters().vertices_stored, 24u * 24) << "4 x 4 clusters of 7 or 3 vertices a side";
  EXPECT_GT(repeated.counters().vertices_stored, distinct);
}

TEST(PostPositionTwin, AVertexFoundAgainAtTheWrongPlaceIsCaught) {
  const binner::TileGrid grid(kWidth, kHeight, 32, 32);
  const scene::Projection p = projection(0);
  std::vector<TessellatedPatch> scene = test::indexed_mesh(20, 12, 8, 110, 7, false);
  std::swap(scene[1].draw_numbers[0], scene[1].draw_numbers[7]);  // two on the edge that the first cluster stored
  PostTessellationBinner position({}, grid, p, VertexStorage::kEachDraw);
  const Binned binned = bin(position, scene);
  EXPECT_NE(decode(position, grid.tile_count(), VertexStorage::kEachDraw).tiles, binned.expected);
}

TEST(DrawVertices, DR1AVertexIsShadedOnceAndKeptUntilTheNextDraw) {
  DrawVertices draw;
  EXPECT_TRUE(draw.shade(5));
  EXPECT_FALSE(draw.shade(5));
  EXPECT_TRUE(draw.shade(2));
  EXPECT_EQ(draw.place(5), std::nullopt);
  const VertexPlace far{std::uint64_t{1} << 40, 63}, near{12, 0};
  draw.store(5, far), draw.store(2, near);
  EXPECT_EQ(draw.place(5), far);
  EXPECT_EQ(draw.place(2), near);
  draw.begin();
  EXPECT_TRUE(draw.shade(5));
  EXPECT_EQ(draw.place(5), std::nullopt);
}

TEST(PostPositionTwin, OneBitOfOnePositionIsCaught) {
  const binner::TileGrid grid(kWidth, kHeight, 32, 32);
  const scene::Projection p = projection(0);
  std::vector<TessellatedPatch> scene = {flat_grid(7, 5, 5, 100)};
  PostTessellationBinner position({}, grid, p, VertexStorage::kEachDraw);
  scene[0].z0[9] = std::nextafter(scene[0].z0[9], 3.0f);
  bin(position, scene);
  scene[0].z0[9] = 2;
  PostTessellationBinner as_it_was({}, grid, p, VertexStorage::kEachDraw);
  EXPECT_NE(decode(position, grid.tile_count(), VertexStorage::kEachDraw).tiles, bin(as_it_was, scene).expected);
}

// The layout of Khronos's sample 16bit_storage_input_output: three vectors of three, which are 36 bytes of 52 in single
// and 18 of 34 in half precision.
TEST(VertexLayout, HalfPrecisionSaves18Of52BytesOfAVertex) {
  const binner::TileGrid grid(kWidth, kHeight, 256, 256);
  const scene::Projection p = projection(0);
  for (const VertexStorage storage : {VertexStorage::kEachBlock, VertexStorage::kEachDraw}) {
    std::map<std::uint64_t, BaselineCounters> counters;
    for (const std::uint64_t bytes : {0u, 18u, 36u}) {
      TessellatedPatch patch = flat_grid(7, 5, 5, 100);
      patch.attribute_bytes = bytes;
      PostTessellationBinner binner({}, grid, p, storage);
      bin(binner, {patch});
      counters[bytes] = binner.counters();
    }
    EXPECT_EQ(counters[36].vertices_stored, 64u);
    EXPECT_EQ(counters[36].queue_bytes_written - counters[18].queue_bytes_written, 64u * 18);
    EXPECT_EQ(counters[18].queue_bytes_written - counters[0].queue_bytes_written, 64u * 18);
    EXPECT_NEAR(static_cast<double>(counters[36].queue_bytes_read - counters[18].queue_bytes_read), 64 * 18, 63);
    // The rest: bits and cursor of the list (9), reference and end (3), head (8) and indices (1, in 4), positions.
    EXPECT_EQ(counters[0].queue_bytes_written, 9u + 3 + 8 + 4 + 64 * 16);
  }
}

TEST(VertexLayout, AVertexHandsOverItsMaterialsInputs) {
  scene::Primitive primitive;
  scene::Material material;
  EXPECT_EQ(frontend::vertex_components(primitive, material), 6u) << "a point and a normal";
  primitive.vertices.colors.resize(1);
  EXPECT_EQ(frontend::vertex_components(primitive, material), 9u) << "the layout of the sample";
  material.alpha_mode = scene::AlphaMode::kBlend;
  EXPECT_EQ(frontend::vertex_components(primitive, material), 10u);
  material.base_color_texture.texture =
      std::make_shared<const shaders::Texture>(std::vector<shaders::Texture::Level>{{1, 1, {255, 255, 255, 255}}},
                                               shaders::ColorSpace::kLinear, shaders::TexelBlocks{});
  material.normal_texture.texture = material.base_color_texture.texture;
  EXPECT_EQ(frontend::vertex_components(primitive, material), 12u) << "both textures read one set of coordinates";
  material.normal_texture.texcoord = 1;
  EXPECT_EQ(frontend::vertex_components(primitive, material), 14u);
  primitive.vertices.tangents.resize(1);
  EXPECT_EQ(frontend::vertex_components(primitive, material), 18u);
  material.normal_texture.texture = nullptr;
  EXPECT_EQ(frontend::vertex_components(primitive, material), 12u) << "tangents that nothing reads";
  material.unlit = true;
  EXPECT_EQ(frontend::vertex_components(primitive, material), 6u);
}

// Attributes lie behind the positions: bursts that only hidden triangles need are not read.
TEST(PostPosition, AttributesAreReadForVisibleTrianglesAlone) {
  const binner::TileGrid grid(kWidth, kHeight, 200, 200);
  const scene::Projection p = projection(0);
  TessellatedPatch patch = flat_grid(7, 5, 5, 100);
  for (std::size_t t = 0; t < patch.triangles.size(); ++t)
    patch.triangle_numbers.push_back(static_cast<std::uint32_t>(t ^ 1u));
  patch.number = 4;
  const auto read = [&](const VisibleTriangles* visible) {
    PostTessellationBinner position({}, grid, p, VertexStorage::kEachDraw);
    BaselineCounters counters;
    position.add(patch, position.setup().run(patch, counters));
    position.finish(visible);
    return position.counters().queue_bytes_read;
  };
  VisibleTriangles none, one, all;
  for (VisibleTriangles* visible : {&none, &one, &all}) visible->tiles.resize(1);
  one.tiles[0] = {triangle_name(4, 0)};
  for (std::uint32_t t = 0; t < 98; ++t) all.tiles[0].push_back(triangle_name(4, t));
  EXPECT_EQ(read(&all), read(nullptr));
  EXPECT_LT(read(&one), read(&all));
  EXPECT_GE(read(&all) - read(&none), 64u * 20 - 64) << "64 vertices with 20 bytes of attributes each";
  EXPECT_GE(read(&one) - read(&none), 64u) << "the first and the second row of vertices";
}

TEST(PostTessellationTwin, ATriangleForgottenInOneTileIsCaught) {
  const binner::TileGrid grid(kWidth, kHeight, 32, 32);
  const scene::Projection p = projection(0);
  PostTessellationBinner post({}, grid, p);
  const TessellatedPatch patch = flat_grid(20, 5, 5, 120);
  BaselineCounters counters;
  TriangleList list = post.setup().run(patch, counters);
  const std::set<binner::TileIndex> last = tiles_of(list, list.triangles.size() - 1);
  const binner::TileIndex tile = *last.begin();
  const Triangle forgotten = triangle_of(patch, list.triangles.back().vertex);
  list.triangles.pop_back();
  list.group_ends.back() -= 1;
  post.add(patch, list);
  post.finish();
  EXPECT_FALSE(decode(post, grid.tile_count()).tiles[tile].contains(forgotten));
}

// One cell, one tile, bursts of 64 bytes; everything from the description of the formats.
TEST(PostTessellation, BytesOfATinySceneFollowTheFormats) {
  const binner::TileGrid grid(32, 32, 32, 32);
  const scene::Projection p = projection(0);
  for (const bool moving : {false, true}) {
    TessellatedPatch patch = flat_grid(1, 4, 4, 8);
    patch.moving = moving;
    if (moving) patch.x1 = patch.x0, patch.y1 = patch.y0, patch.z1 = patch.z0;
    PostTessellationBinner post({}, grid, p);
    bin(post, {patch});
    const BaselineCounters& c = post.counters();
    // Strip: 2 + 3 bits and 2 + 1 bits: one byte, filled up to 4; a grid would take as much. Head 8, four vertices of 36
    // (52) bytes.
    const std::uint64_t block = 8 + 4 + 4 * (moving ? 52u : 36u), bursts = (block + 63) / 64;
    EXPECT_EQ(c.vertices_stored, 4u);
    EXPECT_EQ(c.entries, 1u);
    // Reference: address, "all"; its end; the list's cursor, a byte of bits.
    EXPECT_EQ(c.queue_bytes_written, block + 2 + 1 + 8 + 1);
    EXPECT_EQ(c.queue_bytes_peak, 3 * 64 + block);                        // bits, cursor, first chunk, block
    EXPECT_EQ(c.queue_bytes_read, 2 + 1 + bursts * 64);                   // reference and end; block in bursts
    EXPECT_EQ(post.dram_bytes(), 64 * (3 + bursts) + 64 * (2 + bursts));  // written; bits, list and block read
    EXPECT_EQ(post.dram_bytes_uncached(), post.dram_bytes());
  }
}

TEST(PostTessellation, PT3UnlimitedCacheReadsABlockOnceAndNoCacheEveryTimeItIsNamed) {
  const binner::TileGrid grid(kWidth, kHeight, 16, 16);
  const scene::Projection p = projection(0);
  std::map<std::int64_t, BaselineCounters> counters;
  std::map<std::int64_t, std::uint64_t> dram, uncached;
  std::uint64_t memory = 0;
  for (const std::int64_t cache : {std::int64_t{0}, std::int64_t{4096}, std::int64_t{1} << 30}) {
    gpu::GpuConfiguration gpu;
    gpu.baselines.cache_bytes = cache;
    PostTessellationBinner post(gpu, grid, p);
    bin(post, mixed_scene(2));
    counters[cache] = post.counters();
    dram[cache] = post.dram_bytes();
    uncached[cache] = post.dram_bytes_uncached();
    memory = post.buffer().bytes_in_use();
  }
  EXPECT_EQ(dram[0], uncached[0]);
  EXPECT_EQ(uncached[0], uncached[4096]);
  EXPECT_LT(dram[4096], dram[0]);
  EXPECT_LE(dram[1 << 30], dram[4096]);
  EXPECT_LE(counters[1 << 30].queue_bytes_read, memory + 64);  // lists and blocks, each burst once
  EXPECT_GT(counters[0].queue_bytes_read, memory);
}

// The record of a bicubic patch is 16 control points of 12 bytes.
TEST(PostTessellation, TrianglesOverPatchRecordsAre4And13And48And181Times) {
  constexpr std::uint64_t kVertexBytes = 32;  // of a vertex that is packed for its input
  const std::map<int, std::uint64_t> expected = {{4, 4}, {8, 13}, {16, 48}, {32, 181}};
  for (const auto& [factor, times] : expected) {
    const TessellatedPatch patch = flat_grid(factor, 1, 1, 128);
    EXPECT_EQ(patch.domain_evaluations * kVertexBytes / 192, times);
    // The buffer holds these vertices and the copies at the borders of blocks: vertices of groups of 7 cells a side;
    // some groups share a block.
    const scene::Projection p = projection(0);
    PostTessellationBinner binner({}, binner::TileGrid(130, 130, 32, 32), p);
    bin(binner, {patch});
    const std::uint64_t groups = static_cast<std::uint64_t>((factor + 6) / 7),
                        line = static_cast<std::uint64_t>(factor) + groups;
    EXPECT_GE(binner.counters().vertices_stored, patch.domain_evaluations);
    EXPECT_LE(binner.counters().vertices_stored, line * line);
  }
}

// ---- The immediate machine's memory -----------------------------------------------------------------------------

TEST(SampleLayout, EverySampleHasALineAndNoLineMoreThanFit) {
  for (const auto& [spp, burst] : {std::pair{1, 64}, {4, 64}, {3, 32}, {16, 64}, {64, 64}, {5, 16}, {20, 32}}) {
    const IntRect region = {3, 5, 40, 36};
    const SampleLayout layout(region, spp, static_cast<std::uint64_t>(burst));
    std::map<std::uint32_t, int> samples;
    for (int y = region.y0; y < region.y1; ++y)
      for (int x = region.x0; x < region.x1; ++x)
        for (int s = 0; s < spp; ++s) ++samples[layout.line(x, y, s)];
    EXPECT_LT(samples.rbegin()->first, layout.line_count());
    for (const auto& [line, count] : samples) EXPECT_LE(count, burst / 4) << spp << " samples, " << burst << " bytes";
  }
  const SampleLayout quads({0, 0, 8, 8}, 4, 64);
  EXPECT_EQ(quads.line_count(), 16u);
  EXPECT_EQ(quads.line(0, 0, 0), quads.line(1, 1, 3));
  EXPECT_NE(quads.line(1, 1, 0), quads.line(2, 1, 0));
}

TEST(ImmediateMemory, WithoutACacheEveryTouchMovesABurst) {
  ImmediateMemory memory(0, 64, 4);
  memory.draw(1, true, false);   // clear: nothing to read; depth and colour written
  memory.draw(1, true, false);   // depth read; both written
  memory.draw(1, false, false);  // depth read
  memory.draw(1, true, true);    // blended: depth and colour read, colour written
  memory.finish(true);           // colour read
  EXPECT_EQ(memory.bytes_read(), 64u * (0 + 1 + 1 + 2 + 1));
  EXPECT_EQ(memory.bytes_written(), 64u * (2 + 2 + 0 + 1));
}

TEST(ImmediateMemory, AnUnlimitedCacheReadsNothingAndWritesEveryLineOnce) {
  ImmediateMemory memory(memory::LruCache::kUnlimited, 64, 100);
  for (int n = 0; n < 1000; ++n) memory.draw(static_cast<std::uint32_t>(n * 7 % 50), true, n % 3 == 0);
  memory.finish(true);
  EXPECT_EQ(memory.bytes_read(), 0u);
  EXPECT_EQ(memory.bytes_written(), 50u * 2 * 64);
}

TEST(ImmediateMemory, ALineThatLeftIsReadAgainBeforeItIsTested) {
  ImmediateMemory memory(2 * 64, 64, 4);  // room for one line's depth and colour
  memory.draw(0, true, false);
  memory.draw(1, true, false);  // line 0 leaves
  memory.draw(0, true, false);  // line 1 leaves; depth of 0 is read, colour is not
  memory.finish(false);
  EXPECT_EQ(memory.bytes_read(), 64u);
  EXPECT_EQ(memory.bytes_written(), 64u * 2 * 3);
}

}  // namespace
}  // namespace tessera::baselines::baselines_test
