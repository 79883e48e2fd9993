// Surface evaluation, pixel shader, resolve and the tile core as a whole.
#include "scene/patch_displacement.h"
#include "tests/support/tests.h"
#include "tests/tilecore/support.h"
#include "tilecore/resolve/multisample_resolve.h"
#include "tilecore/shading/surface.h"
#include "tilecore/tile_core.h"

namespace tessera::tilecore::shading_test {
namespace {

// ---- Surface ----------------------------------------------------------------------------------------------------

struct SurfaceScene : TestFrame {
  explicit SurfaceScene(bool bezier, bool displaced = false) {
    Random random(1);
    scene::Material material;
    std::vector<float> heights(64);
    for (std::size_t i = 0; i < heights.size(); ++i)
      heights[i] = 0.1f * std::sin(static_cast<float>(i % 8) * 0.785f) * std::cos(static_cast<float>(i / 8) * 0.785f);
    if (displaced) material.displacement = test::displacement(8, 8, heights, 1.0f, 0.0f);
    const int m = test::add_material(*capture, material);
    scene::Primitive primitive;
    if (bezier) {
      auto points = test::flat_patch({-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
      for (Vec3& p : points) p += random.in_box(0.25f);
      primitive = test::patches(points, m);
    } else {
      primitive = test::triangles({{-1, -1, 0}, {1, -1.2f, 0.4f}, {0.2f, 1, -0.3f}}, {0, 1, 2}, m);
      primitive.vertices.texcoords = {{{0, 0}, {1, 0.1f}, {0.3f, 1}}};
    }
    const int node = test::add_node(*capture, primitive);
    test::add_motion(*capture, node, {0.3, -0.2, 0.1});
    test::add_camera(*capture, {0.2, 0.1, 4});
    pose(200, 150);
  }
  // Pixel position of a world point at a time.
  Vec2 screen(const SurfaceLocation& at) const {
    const Surface s = evaluate_surface(*frame, at);
    // Camera is still: the same view at both motion keys.
    const DVec4 r = frame->projection.matrix() * frame->views[0].world_to_camera * DVec4(DVec3(s.position), 1.0);
    return Vec2(r.x / r.w, r.y / r.w);
  }
};

void check_derivatives(const SurfaceScene& scene, const SurfaceLocation& at, float tolerance) {
  const Surface s = evaluate_surface(*scene.frame, at);
  // Moving the weights by h changes texture coordinate and pixel consistently: duv = by_x dx + by_y dy.
  const auto uv = s.texcoord(0, {});
  for (const Vec2& step : {Vec2(0.01f, 0), Vec2(0, 0.01f)}) {
    SurfaceLocation moved = at;
    moved.b1 += step.x;
    moved.b2 += step.y;
    const Vec2 pixels = scene.screen(moved) - scene.screen(at),
               expected = evaluate_surface(*scene.frame, moved).texcoord(0, {}).value - uv.value;
    const Vec2 predicted = uv.by_x * pixels.x + uv.by_y * pixels.y;
    EXPECT_NEAR(predicted.x, expected.x, tolerance * 0.01f);
    EXPECT_NEAR(predicted.y, expected.y, tolerance * 0.01f);
  }
}

TEST(Surface, TextureDerivativesFollowTheProjectedSurface) {
  const SurfaceScene flat(false), curved(true);
  for (const float t : {0.0f, 0.5f}) {
    check_derivatives(flat, {0, 0, 0.3f, 0.4f, t}, 0.02f);
    check_derivatives(curved, {0, 2u * (3u * curved.frame->pattern_of(0).nu + 4u), 0.3f, 0.3f, t}, 0.1f);
  }
}

TEST(Surface, PointsLieWhereTheTessellationPutsThem) {
  const SurfaceScene scene(true, true);
  const auto& pattern = scene.frame->pattern_of(0);
  for (const int i : {1, 3, pattern.nu - 2})
    for (const int j : {1, 5, pattern.nv - 2}) {
      const auto cell = static_cast<std::uint32_t>(j * pattern.nu + i);
      const Surface s = evaluate_surface(*scene.frame, {0, 2 * cell, 0, 0, 0});
      const Vec3 vertex = Tessellator::vertex_position(*scene.frame, 0, i, j, 0);
      EXPECT_LT(glm::length(s.position - vertex), 1e-5f);
    }
}

TEST(Surface, DisplacedNormalsArePerpendicularToTheDisplacedSurface) {
  const SurfaceScene scene(true, true);
  const auto& frame = *scene.frame;
  const auto displaced = [&](float u, float v) {
    // The triangle of the grid that holds (u, v), by its exact parameters.
    const auto& p = frame.pattern_of(0);
    const int i = static_cast<int>(u * static_cast<float>(p.nu)), j = static_cast<int>(v * static_cast<float>(p.nv));
    const float fu = u * static_cast<float>(p.nu) - static_cast<float>(i),
                fv = v * static_cast<float>(p.nv) - static_cast<float>(j);
    const bool first = fv <= fu;
    const auto triangle = 2u * static_cast<std::uint32_t>(j * p.nu + i) + (first ? 0u : 1u);
    return first ? SurfaceLocation{0, triangle, fu - fv, fv, 0} : SurfaceLocation{0, triangle, fu, fv - fu, 0};
  };
  for (const auto& [u, v] : {std::pair{0.4f, 0.45f}, {0.62f, 0.3f}, {0.55f, 0.7f}}) {
    const Surface s = evaluate_surface(frame, displaced(u, v));
    const float h = 2e-3f;
    const Vec3 du =
        evaluate_surface(frame, displaced(u + h, v)).position - evaluate_surface(frame, displaced(u - h, v)).position;
    const Vec3 dv =
        evaluate_surface(frame, displaced(u, v + h)).position - evaluate_surface(frame, displaced(u, v - h)).position;
    EXPECT_GT(glm::dot(s.normal, glm::normalize(glm::cross(du, dv))), 0.98f);
  }
}

TEST(Surface, NormalsOfMirroredNodesStillPointOutwards) {
  TestFrame test;
  scene::Primitive primitive = test::triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2});
  primitive.vertices.normals.assign(3, Vec3(0, 0, 1));
  const int node = test::add_node(*test.capture, primitive);
  test.capture->nodes[static_cast<std::size_t>(node)].transform.scale = {-1, 1, 1};
  test::add_camera(*test.capture, {0, 0, 3});
  test.pose();
  const Surface s = evaluate_surface(*test.frame, {0, 0, 0.3f, 0.3f, 0});
  EXPECT_NEAR(s.geometric_normal.z, 1.0f, 1e-6f);
  EXPECT_NEAR(s.normal.z, 1.0f, 1e-6f);
  EXPECT_TRUE(test.frame->drawables[0].mirrored);
}

// ---- Pixel shader -----------------------------------------------------------------------------------------------

std::shared_ptr<const shaders::Texture> flat_texture(std::array<std::uint8_t, 4> rgba, shaders::ColorSpace space) {
  Image8 image(2, 2, 4);
  for (std::size_t i = 0; i < image.values.size(); ++i) image.values[i] = rgba[i % 4];
  return std::make_shared<shaders::Texture>(DecodedImage{image}, space);
}

ShadedPoint shade_quad(scene::Material material, std::vector<Vec4> colors = {}) {
  TestFrame test;
  scene::Primitive primitive = test::triangles({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, {0, 1, 2, 0, 2, 3},
                                               test::add_material(*test.capture, std::move(material)));
  primitive.vertices.texcoords = {{{0, 1}, {1, 1}, {1, 0}, {0, 0}}};
  primitive.vertices.colors = std::move(colors);
  test::add_node(*test.capture, primitive);
  test::add_camera(*test.capture, {0, 0, 3});
  test.pose();
  return shade_point(*test.frame, Lighting(), {{0, 0, 0.3f, 0.4f, 0}});
}

TEST(PixelShader, UnlitShowsFactorTimesTextureTimesVertexColour) {
  scene::Material material;
  material.unlit = true;
  material.base_color = {0.5f, 1, 1, 1};
  material.base_color_texture.texture = flat_texture({255, 128, 0, 255}, shaders::ColorSpace::kLinear);
  const ShadedPoint point = shade_quad(material, std::vector<Vec4>(4, Vec4(0.5f, 0.5f, 1, 1)));
  EXPECT_NEAR(point.color.x, 0.25f, 1e-5f);
  EXPECT_NEAR(point.color.y, 0.5f * 128 / 255, 1e-5f);
  EXPECT_NEAR(point.color.z, 0.0f, 1e-6f);
  EXPECT_EQ(point.alpha, 1.0f);  // opaque materials have no alpha
}

TEST(PixelShader, OnlyBlendedMaterialsHaveAlpha) {
  scene::Material material;
  material.base_color.w = 0.25f;
  EXPECT_EQ(shade_quad(material).alpha, 1.0f);
  material.alpha_mode = scene::AlphaMode::kBlend;
  EXPECT_NEAR(shade_quad(material).alpha, 0.25f, 1e-6f);
}

TEST(PixelShader, AFlatNormalMapChangesNothingAndATiltedOneTiltsAlongTheTexture) {
  scene::Material material;
  const Vec3 plain = shade_quad(material).normal;
  material.normal_texture.texture = flat_texture({128, 128, 255, 255}, shaders::ColorSpace::kLinear);
  EXPECT_LT(glm::length(shade_quad(material).normal - plain), 0.02f);
  // Texture u grows along +x, v downwards: red tilts to +x, green to +y.
  material.normal_texture.texture = flat_texture({230, 128, 200, 255}, shaders::ColorSpace::kLinear);
  EXPECT_GT(shade_quad(material).normal.x, 0.5f);
  material.normal_texture.texture = flat_texture({128, 230, 200, 255}, shaders::ColorSpace::kLinear);
  EXPECT_GT(shade_quad(material).normal.y, 0.5f);
}

TEST(PixelShader, EmissionAddsAndOcclusionDimsTheEnvironment) {
  scene::Material material;
  const float lit = shade_quad(material).color.x;
  material.emissive = {2, 0, 0};
  EXPECT_NEAR(shade_quad(material).color.x, lit + 2, 1e-4f);
  material.emissive = Vec3(0);
  material.occlusion_texture.texture = flat_texture({0, 0, 0, 255}, shaders::ColorSpace::kLinear);
  EXPECT_NEAR(shade_quad(material).color.x, 0.0f, 1e-5f);
  material.occlusion_strength = 0.5f;
  EXPECT_NEAR(shade_quad(material).color.x, lit * 0.5f, 1e-4f);
}

TEST(PixelShader, BackFacesOfDoubleSidedSurfacesAreLitFromTheViewersSide) {
  TestFrame test;
  scene::Material material;
  material.double_sided = true;
  test::add_node(*test.capture, test::triangles({{-1, -1, 0}, {1, 1, 0}, {1, -1, 0}}, {0, 1, 2},
                                                test::add_material(*test.capture, material)));
  test::add_camera(*test.capture, {0, 0, 3});
  test.pose();
  EXPECT_GT(shade_point(*test.frame, Lighting(), {{0, 0, 0.3f, 0.4f, 0}}).normal.z, 0.9f);
}

// ---- Resolve ----------------------------------------------------------------------------------------------------

TEST(MultisampleResolve, AveragesSamplesAndChargesWholeBurstsPerRow) {
  std::vector<Vec3> color;
  std::vector<float> coverage;
  for (int pixel = 0; pixel < 6; ++pixel)
    for (int s = 0; s < 4; ++s) {
      color.emplace_back(static_cast<float>(pixel), static_cast<float>(s), 1.0f);
      coverage.push_back(s < pixel ? 1.0f : 0.0f);
    }
  Image target(10, 10, 4);
  ResolveCounters counters;
  memory::Ledger ledger;
  resolve_multisample({color, coverage, 4, {7, 2, 10, 4}, {0, 0, 10, 10}, 64}, target, counters, ledger);
  EXPECT_FLOAT_EQ(target.at(8, 3)[0], 4.0f);
  EXPECT_FLOAT_EQ(target.at(8, 3)[1], 1.5f);
  EXPECT_FLOAT_EQ(target.at(9, 2)[3], 0.5f);
  EXPECT_FLOAT_EQ(target.at(6, 2)[2], 0.0f);  // outside the tile
  EXPECT_EQ(counters.pixels_shaded, 6u);
  // Rows of 3 pixels of 8 bytes at byte 216 and 296: each touches two bursts? 216..239 lies in burst 3; 296..319 in 4.
  EXPECT_EQ(ledger.total().written_bytes, 128u);
}

// ---- Tile core --------------------------------------------------------------------------------------------------

// A scene of crossing, masked and blended quads and a displaced patch.
struct TileScene : TestFrame {
  binner::TileGrid grid{64, 64, 64, 64};
  SamplePattern pattern{{4, 0, 0}};
  std::vector<binner::ListEntry> entries;
  TileJob job;

  explicit TileScene(bool moving) {
    Random random(7);
    for (int k = 0; k < 12; ++k) {
      scene::Material material;
      material.double_sided = true;
      material.alpha_mode = k % 4 == 1   ? scene::AlphaMode::kBlend
                            : k % 4 == 2 ? scene::AlphaMode::kMask
                                         : scene::AlphaMode::kOpaque;
      material.base_color = {random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1), 0.6f};
      if (k % 4 == 3) material.displacement = test::displacement(2, 2, {0, 1, 1, 0}, 0.4f, 0);
      const Vec3 origin = random.in_box(1.2f);
      const auto points = test::flat_patch(origin, random.in_box(1.5f), random.in_box(1.5f));
      const int node = test::add_node(*capture, test::patches(points, test::add_material(*capture, material)));
      if (moving && k % 2 == 0) test::add_motion(*capture, node, DVec3(random.in_box(0.6f)));
    }
    test::add_camera(*capture, {0, 0, 4});
    pose(64, 64);
    for (std::uint32_t p = 0; p < assembly->patch_count(); ++p) {
      binner::ListEntry e;
      e.base_patch = p;
      e.range = whole_patch(*frame, p);
      e.near_depth = static_cast<float>(p % 3);
      entries.push_back(e);
    }
    job.frame = frame.get();
    job.grid = &grid;
    job.pattern = &pattern;
  }
};

struct Rendered {
  FrameTargets targets{{0, 0, 64, 64}, true};
  TileCoreCounters counters;
  ShadingCounters shading;
};

// Renders with the entries dealt out in several passes.
Rendered render(const TileScene& scene, std::vector<binner::ListEntry> entries, std::size_t passes) {
  Rendered out;
  TileCore core;
  TileState state;
  for (std::size_t pass = 0; pass < passes; ++pass) {
    std::vector<binner::ListEntry> part;
    for (std::size_t e = pass; e < entries.size(); e += passes) part.push_back(entries[e]);
    core.render_entries(scene.job, 0, part, state);
  }
  core.finish(scene.job, 0, state, out.targets);
  const CoreCounters counted = core.take_result().counters;
  out.counters = counted.tilecore;
  out.shading = counted.shading;
  return out;
}

TEST(TileCore, TheImageDoesNotDependOnTheOrderOrDivisionOfTheEntries) {
  for (const bool moving : {false, true}) {
    const TileScene scene(moving);
    const Rendered expected = render(scene, scene.entries, 1);
    EXPECT_GT(expected.shading.blended_layers, 0u);
    EXPECT_GT(expected.counters.alpha_tests, 0u);
    std::vector<binner::ListEntry> entries = scene.entries;
    for (const std::size_t passes : {1u, 2u, 5u}) {
      std::reverse(entries.begin(), entries.end());
      for (auto& e : entries) e.near_depth = -e.near_depth;  // another order of depth
      const Rendered again = render(scene, entries, passes);
      EXPECT_EQ(again.targets.color.values, expected.targets.color.values);
      EXPECT_EQ(again.targets.patch.values, expected.targets.patch.values);
      EXPECT_EQ(again.shading.samples_visible, expected.shading.samples_visible);
    }
  }
}

TEST(TileCore, SamplesOutsideTheTimesOfAnEntryAreNotTestedAgainstIt) {
  TileScene scene(true);
  scene.job.forced.motion = true;  // a still patch has all times, and a raster path without times
  const Rendered expected = render(scene, scene.entries, 1);
  std::vector<binner::ListEntry> early = scene.entries, both;
  for (auto& e : early) e.t1 = 99;
  both = early;
  for (binner::ListEntry e : scene.entries) {
    e.t0 = 100;
    both.push_back(e);
  }
  // The shutter in two parts sees the same as the whole, with the same tests; one part alone is caught.
  const Rendered parts = render(scene, both, 1), part = render(scene, early, 1);
  EXPECT_EQ(parts.targets.color.values, expected.targets.color.values);
  EXPECT_EQ(parts.shading.samples_visible, expected.shading.samples_visible);
  EXPECT_EQ(parts.counters.triangle_tests, expected.counters.triangle_tests);
  EXPECT_NE(part.targets.color.values, expected.targets.color.values);
  EXPECT_LT(part.counters.triangle_tests, expected.counters.triangle_tests);
}

TEST(TileCore, ShadingPerSampleConvergesToShadingPerPixelOnFlatColour) {
  TileScene scene(false);
  const Rendered per_pixel = render(scene, scene.entries, 1);
  scene.job.shading.rate = ShadingRate::kSample;
  const Rendered per_sample = render(scene, scene.entries, 1);
  EXPECT_EQ(per_sample.shading.samples_visible + per_sample.shading.blended_layers,
            per_sample.shading.pixel_shader_invocations);
  EXPECT_LT(per_pixel.shading.pixel_shader_invocations, per_sample.shading.pixel_shader_invocations / 2);
  double difference = 0;
  for (std::size_t i = 0; i < per_pixel.targets.color.values.size(); ++i)
    difference += std::abs(static_cast<double>(per_pixel.targets.color.values[i]) -
                           static_cast<double>(per_sample.targets.color.values[i]));
  EXPECT_LT(difference / static_cast<double>(per_pixel.targets.color.values.size()), 2e-3);
}

// One quad in front of another; both fill the tile.
struct LayeredScene : TestFrame {
  binner::TileGrid grid{8, 8, 8, 8};
  SamplePattern pattern{{1, 0, 0}};
  TileJob job;
  LayeredScene(scene::AlphaMode front_mode, float alpha, float cutoff) {
    for (int k = 0; k < 2; ++k) {
      scene::Material material;
      material.unlit = true;
      material.base_color = k == 0 ? Vec4(0, 1, 0, 1) : Vec4(1, 0, 0, alpha);
      if (k == 1) material.alpha_mode = front_mode, material.alpha_cutoff = cutoff;
      const float z = k == 0 ? -1.0f : 0.0f;
      test::add_node(*capture, test::triangles({{-9, -9, z}, {9, -9, z}, {9, 9, z}, {-9, 9, z}}, {0, 1, 2, 0, 2, 3},
                                               test::add_material(*capture, material)));
    }
    test::add_camera(*capture, {0, 0, 3});
    pose(8, 8);
    job.frame = frame.get();
    job.grid = &grid;
    job.pattern = &pattern;
  }
  Vec4 colour() const {
    TileCore core;
    TileState state;
    FrameTargets targets({0, 0, 8, 8}, false);
    std::vector<binner::ListEntry> entries(2);
    for (std::uint32_t p = 0; p < 2; ++p) entries[p].base_patch = p, entries[p].range = whole_patch(*frame, p);
    core.render_entries(job, 0, entries, state);
    core.finish(job, 0, state, targets);
    const auto c = targets.color.at(4, 4);
    return {c[0], c[1], c[2], c[3]};
  }
};

TEST(TileCore, BlendedSurfacesAreComposedOverTheirBackground) {
  const Vec4 c = LayeredScene(scene::AlphaMode::kBlend, 0.25f, 0.5f).colour();
  EXPECT_NEAR(c.x, 0.25f, 1e-6f);
  EXPECT_NEAR(c.y, 0.75f, 1e-6f);
  EXPECT_NEAR(c.w, 1.0f, 1e-6f);
}

TEST(TileCore, MasksDecideBeforeTheDepthIsWritten) {
  EXPECT_EQ(LayeredScene(scene::AlphaMode::kMask, 0.49f, 0.5f).colour().y, 1.0f);
  EXPECT_EQ(LayeredScene(scene::AlphaMode::kMask, 0.5f, 0.5f).colour().x, 1.0f);  // at the cutoff it counts
}

TEST(TileCore, CoplanarSurfacesShowTheLowerNumberedPatch) {
  LayeredScene scene(scene::AlphaMode::kOpaque, 1, 0.5f);
  scene.capture->meshes[1] = scene.capture->meshes[0];
  scene.capture->meshes[1].primitives[0].material = 1;
  scene.pose(8, 8);
  scene.job.frame = scene.frame.get();
  EXPECT_EQ(scene.colour().y, 1.0f);
}

TEST(TileCore, ATileWithoutEntriesShowsTheBackground) {
  LayeredScene scene(scene::AlphaMode::kOpaque, 1, 0.5f);
  scene.job.background = {0.1f, 0.2f, 0.3f};
  TileCore core;
  TileState state;
  FrameTargets targets({0, 0, 8, 8}, true);
  core.render_entries(scene.job, 0, {}, state);
  core.finish(scene.job, 0, state, targets);
  EXPECT_FLOAT_EQ(targets.color.at(3, 3)[2], 0.3f);
  EXPECT_EQ(targets.color.at(3, 3)[3], 0.0f);
  EXPECT_EQ(targets.patch.at(3, 3)[0], 0u);
  EXPECT_EQ(targets.depth.at(3, 3)[0], 0.0f);
}

}  // namespace
}  // namespace tessera::tilecore::shading_test
