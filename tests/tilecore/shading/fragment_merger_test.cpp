#include "tilecore/shading/fragment_merger.h"
#include "tests/support/tests.h"
#include "tests/tilecore/pixel_scene.h"
#include "tilecore/shading/surface.h"

namespace tessera::tilecore::fragment_merger_test {
namespace {

// Visibility of the samples of a one-tile scene.
TileState seen(const PixelScene& scene, TileSamples& samples) {
  TileCore core;
  TileState state;
  core.render_entries(scene.job, 0, scene.entries(), state);
  samples.fill(scene.pattern, scene.grid->pixels(0), static_cast<float>(scene.frame->projection.lens_scale),
               scene.frame->projection.lens_scale != 0);
  return state;
}

scene::Material lit(bool double_sided = true) {
  scene::Material material;
  material.double_sided = double_sided;
  return material;
}

// A strip of triangles across the tile, each `step` pixels wide, sharing all vertices; with normals where `smooth`.
scene::Primitive strip(int count, float step, bool smooth, int material, float fold = 0) {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  for (int i = 0; i <= count; ++i) {
    // With a fold, the strip turns back under itself half way.
    const float x = i <= count / 2 || fold == 0 ? static_cast<float>(i) * step : static_cast<float>(count - i) * step;
    positions.push_back({x + 2.3f, 4.1f, i > count / 2 ? -fold : 0.0f});
    positions.push_back({x + 2.9f, 28.7f, i > count / 2 ? -fold : 0.0f});
  }
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(count); ++i)
    for (const std::uint32_t k : {0u, 2u, 3u, 0u, 3u, 1u}) indices.push_back(2 * i + k);
  scene::Primitive primitive = test::triangles(positions, indices, material);
  if (smooth) primitive.vertices.normals.assign(positions.size(), Vec3(0, 0, 1));
  return primitive;
}

struct Counted {
  std::size_t pairs = 0;   // of a pixel and a primitive that it sees
  std::size_t groups = 0;  // of pairs that may be shaded together
};

// Counts from the samples' visibility alone: pairs, and by flooding over shared edges the groups of neighbours that
// merge.
Counted count_independently(const PixelScene& scene, const TileState& state, bool smooth) {
  Counted out;
  const auto spp = static_cast<std::size_t>(scene.pattern.samples_per_pixel());
  for (std::size_t first = 0; first < state.z.size(); first += spp) {
    std::set<std::tuple<std::uint32_t, std::uint32_t, bool>> fragments;
    for (std::size_t s = first; s < first + spp; ++s)
      if (state.patch[s] != TileState::kNoPatch)
        fragments.emplace(state.patch[s], state.triangle[s], state.positive[s] != 0);
    out.pairs += fragments.size();
    std::vector<std::tuple<std::uint32_t, std::uint32_t, bool>> rest(fragments.begin(), fragments.end());
    while (!rest.empty()) {
      ++out.groups;
      std::vector group{rest.back()};
      rest.pop_back();
      for (std::size_t g = 0; g < group.size(); ++g)
        for (std::size_t k = 0; k < rest.size();) {
          const auto [patch, triangle, positive] = group[g];
          const auto [other_patch, other, other_positive] = rest[k];
          std::size_t shared = 0;
          if (smooth && patch == other_patch && positive == other_positive) {
            const auto a = triangle_vertices(*scene.frame, patch, triangle),
                       b = triangle_vertices(*scene.frame, patch, other);
            const std::set left(a.begin(), a.end()), right(b.begin(), b.end());
            for (const std::uint64_t v : left) shared += right.count(v);
          }
          if (shared >= 2) {
            group.push_back(rest[k]);
            rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(k));
          } else {
            ++k;
          }
        }
    }
  }
  return out;
}

TEST(FragmentMerger, ARedAndABlueTriangleOfOneMeshMixAlongTheirEdge) {
  for (const ShadingRate rate : {ShadingRate::kPixel, ShadingRate::kPrimitive, ShadingRate::kSample}) {
    PixelScene scene(64, 64, 16);
    const int material = test::add_material(*scene.capture, unlit({1, 1, 1, 1}));
    // One mesh, one cluster: the two triangles share places but no vertices. The edge crosses 50 pixels.
    scene::Primitive mesh =
        test::triangles({{10.3f, 7, 0}, {32.3f, 7, 0}, {32.6f, 57, 0}, {32.3f, 7, 0}, {54.3f, 57, 0}, {32.6f, 57, 0}},
                        {0, 1, 2, 3, 4, 5}, material);
    mesh.vertices.colors = {{1, 0, 0, 1}, {1, 0, 0, 1}, {1, 0, 0, 1}, {0, 0, 1, 1}, {0, 0, 1, 1}, {0, 0, 1, 1}};
    test::add_node(*scene.capture, mesh);
    scene.look();
    ASSERT_EQ(scene.assembly->patch_count(), 1u);
    scene.job.shading.rate = rate;
    const Rendering r = render(scene);
    int mixed = 0;
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x) {
        const auto color = r.targets.color.at(x, y);
        mixed += color[0] > 0.01f && color[2] > 0.01f ? 1 : 0;
      }
    EXPECT_EQ(mixed, 50) << static_cast<int>(rate);
  }
}

TEST(FragmentMerger, FM1FM2InvocationsEqualAnIndependentCount) {
  test::Random random(4);
  std::size_t merged = 0, separate = 0;
  for (int trial = 0; trial < 24; ++trial) {
    const bool smooth = trial % 3 != 0, folded = trial % 2 == 1;
    PixelScene scene(40, 32, 1 << random.integer(0, 4));
    const int material = test::add_material(*scene.capture, lit());
    test::add_node(*scene.capture, strip(random.integer(4, 40), random.uniform(0.3f, 3), smooth, material,
                                         folded ? random.uniform(0.1f, 1) : 0.0f));
    scene.look();
    TileSamples samples;
    const Counted expected = count_independently(scene, seen(scene, samples), smooth);
    const auto invocations = [&](ShadingRate rate) {
      scene.job.shading.rate = rate;
      const ShadingCounters c = render(scene).counters;
      EXPECT_EQ(c.fragments_merged, rate == ShadingRate::kPixel ? expected.pairs - expected.groups : 0);
      return c.pixel_shader_invocations;
    };
    EXPECT_EQ(invocations(ShadingRate::kPrimitive), expected.pairs) << trial;
    EXPECT_EQ(invocations(ShadingRate::kPixel), expected.groups) << trial;
    (smooth ? merged : separate) += expected.pairs - expected.groups;
  }
  EXPECT_GT(merged, 500u);
  EXPECT_EQ(separate, 0u) << "flat triangles are lit each by its own normal";
}

TEST(FragmentMerger, FM2AFoldedSheetIsNotMergedAcrossItsFold) {
  // Two triangles that share an edge, the second one folded back under the first and wider: it shows beside it, facing
  // the other way.
  PixelScene scene(40, 32, 16);
  const int material = test::add_material(*scene.capture, lit());
  scene::Primitive sheet =
      test::triangles({{5.2f, 4, 0}, {30.3f, 8, 0}, {28.4f, 26, 0}, {3.3f, 1.2f, -0.5f}}, {0, 1, 2, 0, 2, 3}, material);
  sheet.vertices.positions[3] = {29.1f, 4.4f, -0.5f};
  sheet.vertices.normals.assign(4, Vec3(0, 0, 1));
  test::add_node(*scene.capture, sheet);
  scene.look();
  TileSamples samples;
  const TileState state = seen(scene, samples);
  std::size_t both_ways = 0;
  FragmentMerger merger;
  for (std::size_t pixel = 0; pixel < state.z.size() / 16; ++pixel) {
    const bool split = false;
    merger.group(scene.job, samples, state, std::span(&pixel, 1), std::span(&split, 1));
    std::vector<std::set<bool>> facing(merger.runs().size());
    for (std::size_t k = 0; k < 16; ++k)
      if (merger.run_of(0, k) != FragmentMerger::kNoRun)
        facing[merger.run_of(0, k)].insert(state.positive[pixel * 16 + k] != 0);
    for (const auto& f : facing) EXPECT_EQ(f.size(), 1u);
    std::set<bool> seen_ways;
    for (std::size_t k = 0; k < 16; ++k)
      if (state.patch[pixel * 16 + k] != TileState::kNoPatch) seen_ways.insert(state.positive[pixel * 16 + k] != 0);
    both_ways += seen_ways.size() == 2 ? 1 : 0;
  }
  EXPECT_GT(both_ways, 5u);
}

TEST(FragmentMerger, AFlatPatchTakesHardlyMoreInvocationsThanPixelsHoweverFineItsGrid) {
  PixelScene scene(64, 64, 4);
  scene.add_quad(-3.4f, -3.3f, 71, 71, 0, lit(), true);
  scene.look();
  EXPECT_GT(scene.frame->pattern_of(0).nu, 8);
  // A pixel whose samples miss the triangle between two others has no edge to merge these across.
  EXPECT_LT(render(scene).counters.pixel_shader_invocations, 64u * 64u * 11 / 10);
  scene.job.shading.rate = ShadingRate::kPrimitive;
  EXPECT_GT(render(scene).counters.pixel_shader_invocations, 64u * 64u * 6 / 4);
}

// ---- Quads ------------------------------------------------------------------------------------------------------

TEST(Quads, AreTheBlocksOfFourPixelsThatAPrimitiveTouches) {
  for (const ShadingRate rate : {ShadingRate::kPixel, ShadingRate::kPrimitive}) {
    PixelScene scene(40, 32, 4);
    const int material = test::add_material(*scene.capture, lit());
    test::add_node(*scene.capture, strip(20, 1.7f, true, material));
    scene.look();
    scene.job.shading.rate = rate;
    scene.job.shading.derivatives = ShadingDerivatives::kQuad;
    TileSamples samples;
    const TileState state = seen(scene, samples);
    std::set<std::tuple<std::size_t, std::uint32_t>> touched;  // block and triangle
    for (std::size_t s = 0; s < state.z.size(); ++s) {
      const std::size_t pixel = s / 4, block = pixel / 40 / 2 * 20 + pixel % 40 / 2;
      // The strip is one surface: with merging there is one quad in each block.
      if (state.patch[s] != TileState::kNoPatch)
        touched.emplace(block, rate == ShadingRate::kPrimitive ? state.triangle[s] : 0);
    }
    const ShadingCounters c = render(scene).counters;
    if (rate == ShadingRate::kPrimitive) {
      EXPECT_EQ(c.quads, touched.size());
    } else {
      // But for blocks whose samples miss the triangle between two others.
      EXPECT_GE(c.quads, touched.size());
      EXPECT_LT(c.quads, touched.size() * 6 / 5);
    }
    EXPECT_EQ(c.helper_invocations + c.pixel_shader_invocations, 4 * c.quads);
    EXPECT_GT(c.helper_invocations, 0u);
    // Analytic derivatives need none.
    scene.job.shading.derivatives = ShadingDerivatives::kAnalytic;
    const ShadingCounters analytic = render(scene).counters;
    EXPECT_EQ(analytic.quads + analytic.helper_invocations, 0u);
    // Within a quad more fragments find an edge to merge across.
    EXPECT_GE(analytic.pixel_shader_invocations, c.pixel_shader_invocations);
  }
}

TEST(Quads, MovingSurfacesTakeAQuadForEachInvocation) {
  PixelScene scene(40, 32, 4);
  const int node = scene.add_quad(5, 5, 20, 20, 0, lit(), true);
  test::add_motion(*scene.capture, node, {9, 3, 0});
  scene.look();
  scene.job.shading.derivatives = ShadingDerivatives::kQuad;
  const ShadingCounters c = render(scene).counters;
  EXPECT_EQ(c.quads, c.pixel_shader_invocations);
  EXPECT_EQ(c.helper_invocations, 3 * c.quads);
}

TEST(Quads, BlendedFragmentsShareThemAcrossThePixelsOfABlock) {
  PixelScene scene(32, 32, 4);
  scene.add_quad(4, 4, 16, 16, 0, unlit({1, 1, 1, 0.5f}, scene::AlphaMode::kBlend), false);
  scene.look();
  scene.job.shading.rate = ShadingRate::kPrimitive;
  scene.job.shading.derivatives = ShadingDerivatives::kQuad;
  const ShadingCounters c = render(scene).counters;
  // 64 blocks, 8 of them on the diagonal that the two triangles share.
  EXPECT_EQ(c.quads, 72u);
  EXPECT_EQ(c.helper_invocations + c.pixel_shader_invocations, 4 * c.quads);
}

TEST(Quads, DerivativesAreDifferencesBetweenNeighboursOnThePlane) {
  // A plane that tilts away from a perspective camera: its texture coordinates are known in closed form everywhere.
  TestFrame scene;
  const int material = test::add_material(*scene.capture, lit());
  scene::Primitive quad =
      test::triangles({{-2, -1, 0}, {2, -1, 0}, {2, 1, -6}, {-2, 1, -6}}, {0, 1, 2, 0, 2, 3}, material);
  quad.vertices.texcoords = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  test::add_node(*scene.capture, quad);
  test::add_camera(*scene.capture, {0, 0.3, 3});
  scene.pose(96, 64);
  test::Random random(8);
  double analytic_error = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const SurfaceLocation at{0, static_cast<std::uint32_t>(random.integer(0, 1)), random.uniform(0.1f, 0.4f),
                             random.uniform(0.1f, 0.4f), 0};
    Surface s = evaluate_surface(*scene.frame, at);
    const Surface::Texcoord analytic = s.texcoord(0, {});
    const int way_x = random.coin() ? 1 : -1, way_y = random.coin() ? 1 : -1;
    take_quad_differences(s, way_x, way_y, false);
    const Surface::Texcoord uv = s.texcoord(0, {});
    // Texture coordinate of the plane at a pixel: u and v are linear over depth, as 1 / depth is over the image.
    const auto plane = [&](double x, double y) {
      const DMat4 m = scene.frame->projection.matrix() * scene.frame->views[0].world_to_camera;
      // Point (4 u - 2, 2 v - 1, -6 v) of the plane: solve for (u, v).
      const DVec4 p0 = m * DVec4(-2, -1, 0, 1), pu = m * DVec4(4, 0, 0, 0), pv = m * DVec4(0, 2, -6, 0);
      const double a = pu.x - x * pu.w, b = pv.x - x * pv.w, c = pu.y - y * pu.w, d = pv.y - y * pv.w,
                   e = x * p0.w - p0.x, f = y * p0.w - p0.y, det = a * d - b * c;
      return glm::dvec2((e * d - b * f) / det, (a * f - e * c) / det);
    };
    const double x = static_cast<double>(s.raster.x / s.raster.w), y = static_cast<double>(s.raster.y / s.raster.w);
    const glm::dvec2 by_x = (plane(x + way_x, y) - plane(x, y)) * static_cast<double>(way_x),
                     by_y = (plane(x, y + way_y) - plane(x, y)) * static_cast<double>(way_y);
    EXPECT_NEAR(static_cast<double>(uv.by_x.x), by_x.x, 1e-4 * (1e-2 + std::abs(by_x.x)) + 1e-6);
    EXPECT_NEAR(static_cast<double>(uv.by_y.y), by_y.y, 1e-3 * std::abs(by_y.y) + 1e-6);
    analytic_error = std::max(analytic_error, std::abs(static_cast<double>(analytic.by_y.y) / by_y.y - 1));
  }
  EXPECT_GT(analytic_error, 0.01) << "the surface's own derivatives are others";
}

}  // namespace
}  // namespace tessera::tilecore::fragment_merger_test
