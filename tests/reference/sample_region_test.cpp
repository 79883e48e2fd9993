// Parts of a scene that the reference leaves out: nothing that a sample sees (SRG1), and enough to keep to its
// memory.
#include "reference/sample_region.h"
#include "gpu/device.h"
#include "gpu/view_inputs.h"
#include "reference/bezier_extent.h"
#include "reference/reference_renderer.h"
#include "scene/domain_shader.h"
#include "tests/support/instances.h"
#include "tests/support/procedures.h"
#include "tests/support/tests.h"

namespace tessera::reference::sample_region_test {
namespace {

using scene::Capture;

constexpr int kWidth = 40, kHeight = 24;

// Triangles, displaced patches, layers and a procedure in and around the frame, some of them behind the camera; they
// move, bend and are seen through a lens, or not.
Capture random_scene(std::uint32_t seed) {
  Random random(seed);
  Capture capture = test::random_instanced_scene(random, 30, 3.0f);
  const auto shape = static_cast<shaders::ShapeId>(random.integer(0, test::kShapeCount - 1));
  const int node = test::add_procedure(capture, shape, test::random_shape(random, shape), DVec3(random.in_box(2)));
  if (random.coin()) test::add_motion(capture, node, DVec3(random.in_box(1)));
  scene::Camera& camera = capture.cameras.front();
  if (random.coin()) {
    camera.type = scene::Camera::Type::kOrthographic;
    camera.x_mag = 2.0f, camera.y_mag = 1.2f;
  }
  camera.near = random.uniform(0.1f, 2.0f);
  camera.far = random.coin() ? random.uniform(3.0f, 6.0f) : 0.0f;
  camera.lens = {random.coin() ? random.uniform(0.02f, 0.3f) : 0.0f, random.uniform(1.0f, 6.0f)};
  capture.settings.background = Vec3(0.1f, 0.2f, 0.3f);
  return capture;
}

struct Shot {
  explicit Shot(Capture capture_in, double edge = 2)
      : capture(std::move(capture_in)), assembly(scene::assemble(capture)) {
    scene::FrameRequest asked = gpu::frame_request(capture, machine, settings, kWidth, kHeight, 0);
    asked.tessellation.target_edge_pixels = edge;
    asked.motion_segments = 1;
    frame = scene::pose_frame(assembly, gpu::frame_camera(capture, settings, kWidth, kHeight), asked);
    request.lighting = gpu::frame_lighting(capture);
    request.background = gpu::frame_background(capture);
    request.samples = {12};
  }
  ReferenceScene scene(const SampleRegion& region) const { return {*frame, {.region = region}}; }
  Image image(const ReferenceScene& of) const { return render_reference(of, request).front(); }
  SampleRegion everything() const { return SampleRegion::everything(frame->projection, {0, 0, kWidth, kHeight}); }

  Capture capture;
  gpu::RunSettings settings;
  gpu::GpuConfiguration machine;
  scene::Assembly assembly;
  std::unique_ptr<scene::FrameGeometry> frame;
  ReferenceRequest request;
};

TEST(SampleRegion, NoRayHitsLeftOutGeometry) {  // SRG1
  std::size_t kept = 0, all = 0;
  int without_lens = 0, without_margin = 0;
  for (std::uint32_t seed = 1; seed <= 30; ++seed) {
    const Shot shot(random_scene(seed));
    const ReferenceScene whole = shot.scene(shot.everything()), seen(*shot.frame);
    const Image expected = shot.image(whole);
    ASSERT_EQ(shot.image(seen).values, expected.values) << "seed " << seed;
    kept += seen.triangles.size(), all += whole.triangles.size();
    // The twins: a region that forgets the lens, and one whose near plane is too far away.
    scene::Projection projection = shot.frame->projection;
    projection.lens_scale = 0;
    without_lens += shot.image(shot.scene({projection, {0, 0, kWidth, kHeight}})).values != expected.values ? 1 : 0;
    projection = shot.frame->projection;
    projection.near += 1;
    without_margin += shot.image(shot.scene({projection, {0, 0, kWidth, kHeight}})).values != expected.values ? 1 : 0;
  }
  EXPECT_LT(kept, all / 2) << "triangles of all";
  EXPECT_GT(without_lens, 0);
  EXPECT_GT(without_margin, 0);
}

TEST(SampleRegion, PartsOfAnImageAreItsPixels) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    const Shot shot(random_scene(seed));
    const Image whole = shot.image(ReferenceScene(*shot.frame));
    const IntRect pixels{9, 5, 23, 18};
    const Image part = shot.image(shot.scene({shot.frame->projection, pixels}));
    for (int y = pixels.y0; y < pixels.y1; ++y)
      for (int x = pixels.x0; x < pixels.x1; ++x)
        for (std::size_t c = 0; c < 3; ++c) ASSERT_EQ(part.at(x, y)[c], whole.at(x, y)[c]) << seed;
    EXPECT_EQ(part.at(0, 0)[0], 0.0f);
  }
}

// A point that a ray passes is in the region, whatever the lens does.
TEST(SampleRegion, HoldsEveryPointOfItsRays) {
  Random random(3);
  int outside_pinhole = 0;
  for (int k = 0; k < 20000; ++k) {
    scene::Projection p;
    p.orthographic = random.coin();
    p.center_x = 16, p.center_y = 12, p.near = 0.1;
    p.lens_scale = static_cast<double>(random.uniform(0, 30));
    p.inverse_focus = static_cast<double>(random.uniform(0, 1));
    const IntRect pixels{3, 4, 11, 9};
    const auto unit = [&] { return static_cast<double>(random.uniform(0, 1)); };
    const double angle = 7 * unit(), u = std::cos(angle) * p.lens_scale, v = std::sin(angle) * p.lens_scale,
                 sx = 3 + 8 * unit() - 16, sy = 4 + 5 * unit() - 12, z = 0.1 + 20 * unit(),
                 coc = 1 - z * p.inverse_focus, w = p.orthographic ? 1 : z;
    const std::array<double, 3> point = {sx * w + u * coc, sy * w + v * coc, z};
    const auto missed = [&](const SampleRegion& region) {
      SampleRegion::Extent extent;
      region.add(extent, point.data());
      EXPECT_FALSE(region.misses(extent) && region.holds(extent));
      return region.misses(extent);
    };
    ASSERT_FALSE(missed({p, pixels}));
    p.lens_scale = 0;
    outside_pinhole += missed({p, pixels}) ? 1 : 0;
  }
  EXPECT_GT(outside_pinhole, 1000) << "the twin: a pinhole misses some";
}

// Every vertex of a part of a patch's grid is in the extent of the part.
TEST(BezierExtent, HoldsTheVerticesOfEveryPart) {
  Random random(11);
  scene::Projection projection;
  projection.center_x = 20, projection.center_y = 12;
  const SampleRegion region(projection, {0, 0, 40, 24});
  int without_reach = 0;
  for (int k = 0; k < 300; ++k) {
    std::array<BezierExtent::Points, 2> points;
    std::array<DMat4, 2> to_space;
    for (std::size_t key = 0; key < 2; ++key) {
      const Vec3 at = random.in_box(20);
      for (DVec3& p : points[key]) p = DVec3(at + random.in_box(1));
      for (int c = 0; c < 4; ++c)
        for (int r = 0; r < 4; ++r) to_space[key][c][r] = static_cast<double>(random.uniform(-1, 1));
    }
    const double reach = static_cast<double>(random.uniform(0, 0.5f));
    const BezierExtent patch(region, points, to_space, reach), flat(region, points, to_space, 0);
    scene::TessellationPattern pattern;
    pattern.nu = static_cast<std::uint8_t>(random.integer(1, 40));
    pattern.nv = static_cast<std::uint8_t>(random.integer(1, 40));
    for (std::size_t e = 0; e < 4; ++e)
      pattern.edge[e] = static_cast<std::uint8_t>(random.integer(1, e < 2 ? pattern.nu : pattern.nv));
    const auto range = [&](std::uint8_t n) {
      const int a = random.integer(0, n - 1), b = random.integer(a + 1, n);
      return std::pair(static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b));
    };
    const auto [i0, i1] = range(pattern.nu);
    const auto [j0, j1] = range(pattern.nv);
    const scene::ParameterRange part = scene::parameter_range(pattern, {i0, j0, i1, j1});
    const SampleRegion::Extent extent = patch.over(part), bare = flat.over(part);
    for (int j = j0; j <= j1; ++j)
      for (int i = i0; i <= i1; ++i)
        for (std::size_t key = 0; key < 2; ++key) {
          shaders::ControlPoints<double> c;
          for (std::size_t n = 0; n < 16; ++n) c[n] = {points[key][n].x, points[key][n].y, points[key][n].z};
          const double u = static_cast<double>(pattern.u(i, j)), v = static_cast<double>(pattern.v(i, j));
          const auto at = shaders::bicubic_point<double>(shaders::bicubic_row(c, v), u);
          const Vector3<double> out = at.position + shaders::bicubic_normal(c, u, v, at) * reach;
          const DVec4 placed = to_space[key] * DVec4(out.x, out.y, out.z, 1);
          SampleRegion::Extent vertex;
          region.add(vertex, &placed.x);
          for (std::size_t a = 0; a < SampleRegion::kAxes; ++a) {
            ASSERT_LE(extent.low[a], vertex.high[a]);
            ASSERT_GE(extent.high[a], vertex.low[a]);
            without_reach += bare.low[a] > vertex.high[a] || bare.high[a] < vertex.low[a] ? 1 : 0;
          }
        }
  }
  EXPECT_GT(without_reach, 100) << "the twin: a patch that is not displaced";
}

// ---- Memory -----------------------------------------------------------------------------------------------------

ShutterSlices slices_of(const Shot& shot) {
  scene::FrameRequest request = shot.frame->request;
  return ShutterSlices(shot.assembly, gpu::frame_camera(shot.capture, shot.settings, kWidth, kHeight), request, 1);
}

TEST(ReferenceMemory, AnImageThatDoesNotFitIsMadeOfPartsWithTheSameBits) {
  Shot shot(random_scene(5), 0.3);
  const std::uint64_t charged = shot.assembly.charged_bytes();
  const Image whole = render_reference(slices_of(shot), shot.request).front(),
              whole_frame = render_reference(*shot.frame, shot.request).front();
  const ReferenceScene scene(*shot.frame);
  const std::uint64_t vertices = scene.vertices.size() * sizeof(scene.vertices[0]);
  // Enough for the vertices, but not for the triangles and the tree as well.
  shot.capture.max_bytes = charged + vertices + vertices / 2;
  EXPECT_THROW(ReferenceScene(*shot.frame), scene::BudgetError);
  EXPECT_EQ(render_reference(*shot.frame, shot.request).front().values, whole_frame.values);
  EXPECT_EQ(render_reference(slices_of(shot), shot.request).front().values, whole.values);
  shot.capture.max_bytes = charged + vertices / 50;
  try {
    render_reference(slices_of(shot), shot.request);
    FAIL() << "no memory is enough";
  } catch (const scene::BudgetError& error) {
    EXPECT_THAT(error.what(), HasSubstr("--max-memory"));
    EXPECT_THAT(error.what(), HasSubstr("reference"));
  }
}

}  // namespace
}  // namespace tessera::reference::sample_region_test
