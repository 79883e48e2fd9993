// Back-face culling before tessellation drops nothing that could be seen.
#include <gtest/gtest.h>

#include <cmath>

#include "frontend/bounds/back_face.h"
#include "frontend/patch_splitter.h"
#include "scene/subpixel.h"
#include "tests/frontend/bound_scenes.h"

namespace tessera::frontend {
namespace {

using test::Random;

// Nine unequal pieces of one bent patch: neighbours have the same normals and texture coordinates on the edges that they
// share, but read heights at levels of detail of their own.
scene::Primitive bent_sheet(int material) {
  std::vector<Vec3> whole;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i) {
      const float x = static_cast<float>(i) / 1.5f - 1, y = static_cast<float>(j) / 1.5f - 1;
      whole.emplace_back(x, y, 0.25f * (x * x + y * y));
    }
  const PatchNet net = make_net(std::span<const Vec3, 16>(whole.data(), 16));
  constexpr float kCuts[] = {0, 0.2f, 0.7f, 1};
  std::vector<Vec3> points;
  std::vector<Vec2> texcoords;
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t i = 0; i < 3; ++i) {
      const PatchNet piece = restrict_net(net, {kCuts[i], kCuts[j], kCuts[i + 1], kCuts[j + 1]});
      for (std::size_t k = 0; k < 16; ++k) {
        points.push_back(Vec3(piece.point(k)));
        const float s = static_cast<float>(k % 4) / 3, t = static_cast<float>(k / 4) / 3;
        texcoords.emplace_back(kCuts[i] * (1 - s) + kCuts[i + 1] * s, kCuts[j] * (1 - t) + kCuts[j + 1] * t);
      }
    }
  scene::Primitive primitive = test::patches(points, material);
  primitive.vertices.texcoords = {texcoords};
  return primitive;
}

struct RoundScene {
  scene::Capture capture;
  scene::Assembly assembly;
  std::unique_ptr<PyramidLibrary> pyramids;
  std::unique_ptr<scene::FrameGeometry> frame;

  struct Options {
    float displacement = 0;  // strength of smooth bumps
    bool moving = false, mirrored = false, deforming = false;
    float aperture = 0;
    double target_pixels = 3;
    bool orthographic = false;
    bool sheet = false;
  };

  RoundScene(const Options& options, Random& random) {
    scene::Material material;
    if (options.displacement != 0) {
      std::vector<float> heights(32 * 32);
      for (std::size_t i = 0; i < heights.size(); ++i)
        heights[i] = std::sin(static_cast<float>(i % 32) * 0.3927f) * std::cos(static_cast<float>(i / 32) * 0.3927f);
      material.displacement = test::displacement(32, 32, heights, options.displacement, 0.01f);
    }
    const int number = test::add_material(capture, material);
    scene::Primitive primitive = options.sheet ? bent_sheet(number) : test::closed_patches(number);
    if (options.deforming) {
      scene::MorphTarget target;
      for (const Vec3& p : primitive.vertices.positions) target.positions.push_back(p * 0.3f + Vec3(0.1f * p.y, 0, 0));
      primitive.vertices.morph_targets.push_back(target);
    }
    const int node = test::add_node(capture, primitive, DVec3(random.in_box(0.5f)));
    scene::Node& placed = capture.nodes[static_cast<std::size_t>(node)];
    placed.transform.rotation = glm::normalize(DQuat(1, DVec3(random.in_box(1))));
    placed.transform.scale = DVec3(options.mirrored ? -1 : 1, static_cast<double>(random.uniform(0.6f, 1.4f)), 1);
    if (options.moving) test::add_motion(capture, node, DVec3(random.in_box(2)));
    if (options.deforming) {
      if (capture.animations.empty()) capture.animations.emplace_back();
      capture.animations[0].channels.push_back(
          {.node = node, .path = scene::AnimatedPath::kWeights, .components = 1, .times = {0, 1}, .values = {0, 1}});
      capture.played_animations = {0};
    }
    scene::Camera camera;
    camera.near = 0.05f;
    if (options.orthographic) {
      camera.type = scene::Camera::Type::kOrthographic;
      camera.x_mag = camera.y_mag = 1.6f;
    }
    camera.lens = {options.aperture, 3.0f};
    test::add_camera(capture, DVec3(0, 0, 4), camera);
    assembly = assemble(capture);
    pyramids = std::make_unique<PyramidLibrary>(assembly);
    scene::FrameRequest request;
    request.width = 320;
    request.height = 240;
    request.open_time = 0.25;
    request.close_time = 0.5;
    request.tessellation.target_edge_pixels = options.target_pixels;
    frame = pose_frame(assembly, choose_camera(capture, 320, 240), request);
  }
};

// A vertex as the machine projects it: single precision, snapped, at both motion keys.
struct RasterVertex {
  std::array<glm::dvec2, 2> at;
  std::array<double, 2> depth;
};
RasterVertex project(const scene::FrameGeometry& frame, std::uint32_t patch, int i, int j) {
  const scene::PosedDrawable& drawable = frame.drawable_of(patch);
  const scene::TessellationPattern& pattern = frame.pattern_of(patch);
  scene::OwnedVertex vertex{patch, pattern.u(i, j), pattern.v(i, j)};
  if (i == 0 || j == 0 || i == pattern.nu || j == pattern.nv)
    vertex = boundary_vertex(pattern, frame.assembly->neighbours[0][patch], i, j);
  RasterVertex out;
  for (std::size_t key = 0; key < 2; ++key) {
    const Vec4 r =
        drawable.to_raster[key] * Vec4(domain_point(frame, drawable, vertex.patch, vertex.u, vertex.v, key), 1.0f);
    const float w = frame.projection.orthographic ? 1.0f : r.w;
    const auto snap = [](float x) {
      return static_cast<double>(std::nearbyint(x * scene::kSubpixels) / scene::kSubpixels);
    };
    out.at[key] = {snap(r.x / w), snap(r.y / w)};
    out.depth[key] = static_cast<double>(r.z);
  }
  return out;
}

// Where it is seen at time t through a lens point: screen positions move at the rate of perspective.
glm::dvec2 seen_at(const RasterVertex& v, const scene::Projection& p, double t, glm::dvec2 lens) {
  const double depth = v.depth[0] * (1 - t) + v.depth[1] * t;
  const double rate = p.orthographic ? t : t * v.depth[1] / depth;
  const double coc = p.orthographic ? 1 - depth * p.inverse_focus : 1 / depth - p.inverse_focus;
  return v.at[0] + (v.at[1] - v.at[0]) * rate - lens * (p.lens_scale * coc);
}

// How often one of a cell's two triangles is seen to face the camera, at four times and lens points.
std::uint64_t front_facing(const scene::FrameGeometry& frame, std::uint32_t patch, int x, int y, Random& random) {
  std::uint64_t count = 0;
  const RasterVertex corner[4] = {project(frame, patch, x, y), project(frame, patch, x + 1, y),
                                  project(frame, patch, x + 1, y + 1), project(frame, patch, x, y + 1)};
  for (int s = 0; s < 4; ++s) {
    const double t = s < 2 ? s : static_cast<double>(random.uniform(0, 1)),
                 angle = static_cast<double>(random.uniform(0, 6.2831f));
    const glm::dvec2 lens(std::cos(angle), std::sin(angle));
    for (const auto& [k, l] : {std::pair{1, 2}, {2, 3}}) {
      const glm::dvec2 a = seen_at(corner[0], frame.projection, t, lens),
                       b = seen_at(corner[k], frame.projection, t, lens),
                       c = seen_at(corner[l], frame.projection, t, lens);
      double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
      if (frame.drawable_of(patch).mirrored) area = -area;
      if (area < -1e-9) ++count;  // counter-clockwise with y down
    }
  }
  return count;
}

struct Outcome {
  std::uint64_t cells = 0, culled = 0, front_facing = 0;
};

// Tests pieces of every patch; looks at all triangles of those that are culled. The twin believes the patch's middle.
Outcome check(const RoundScene& scene, Random& random, bool believe_the_middle) {
  Outcome out;
  const scene::FrameGeometry& frame = *scene.frame;
  SubPatchBounder bounder(frame, *scene.pyramids, BoundMethod::kNpatch);
  BackFaceTest test(frame);
  for (std::uint32_t patch = 0; patch < frame.assembly->patch_count(); ++patch) {
    bounder.begin(patch);
    test.begin(patch);
    const scene::TessellationPattern& pattern = frame.pattern_of(patch);
    constexpr int kSide = 6;
    for (int j = 0; j < pattern.nv; j += kSide)
      for (int i = 0; i < pattern.nu; i += kSide) {
        const scene::CellRange cells{static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(j),
                                     static_cast<std::uint8_t>(std::min<int>(i + kSide, pattern.nu)),
                                     static_cast<std::uint8_t>(std::min<int>(j + kSide, pattern.nv))};
        const SubPatchBody body = bounder.body(cells);
        const std::uint64_t count = static_cast<std::uint64_t>((cells.i1 - cells.i0) * (cells.j1 - cells.j0));
        out.cells += count;
        bool culled = test.culls(bounder, *scene.pyramids, cells, body.corners);
        if (believe_the_middle) {
          const RasterVertex a = project(frame, patch, cells.i0, cells.j0),
                             b = project(frame, patch, cells.i1, cells.j0),
                             c = project(frame, patch, cells.i1, cells.j1);
          const glm::dvec2 e = b.at[0] - a.at[0], f = c.at[0] - a.at[0];
          culled = e.x * f.y - e.y * f.x > 0;
        }
        if (!culled) continue;
        out.culled += count;
        for (int y = cells.j0; y < cells.j1; ++y)
          for (int x = cells.i0; x < cells.i1; ++x) out.front_facing += front_facing(frame, patch, x, y, random);
      }
  }
  return out;
}

struct Case {
  const char* name;
  RoundScene::Options options;
  double least_share;  // of the cells that must be culled for the test to mean something
};

class BackFaceCulling : public testing::TestWithParam<Case> {};

TEST_P(BackFaceCulling, DropsNoTriangleThatCouldFaceTheCamera) {
  Random random(31);
  Outcome total;
  for (int trial = 0; trial < 12; ++trial) {
    const RoundScene scene(GetParam().options, random);
    const Outcome out = check(scene, random, false);
    total.cells += out.cells;
    total.culled += out.culled;
    total.front_facing += out.front_facing;
  }
  EXPECT_EQ(total.front_facing, 0u);
  EXPECT_GE(static_cast<double>(total.culled), GetParam().least_share * static_cast<double>(total.cells));
}

std::string case_name(const testing::TestParamInfo<Case>& instance) { return instance.param.name; }
INSTANTIATE_TEST_SUITE_P(
    Case, BackFaceCulling,
    testing::Values(Case{"Static", {}, 0.3}, Case{"Moving", {.moving = true}, 0.25},
                    Case{"Mirrored", {.mirrored = true}, 0.3},
                    Case{"Deforming", {.moving = true, .deforming = true}, 0.2},
                    Case{"Defocused", {.moving = true, .aperture = 0.1f}, 0.2},
                    Case{"Displaced", {.displacement = 0.03f}, 0.01},
                    Case{"DisplacedMovingDefocused", {.displacement = 0.03f, .moving = true, .aperture = 0.05f}, 0.01},
                    Case{"DisplacedNeighbours", {.displacement = 0.01f, .moving = true, .sheet = true}, 0.02},
                    Case{"SteepDisplacement", {.displacement = 0.5f}, 0.0},
                    Case{"TinyTriangles", {.moving = true, .target_pixels = 0.5}, 0.05},
                    Case{"CoarseTriangles", {.moving = true, .target_pixels = 12}, 0.02},
                    Case{"Orthographic", {.moving = true, .aperture = 0.05f, .orthographic = true}, 0.25}),
    case_name);

TEST(BackFaceCullingTwin, BelievingTheMiddleOfASubPatchIsCaught) {
  Random random(31);
  std::uint64_t front_facing = 0;
  for (int trial = 0; trial < 12; ++trial)
    front_facing += check(RoundScene({.displacement = 0.1f, .moving = true}, random), random, true).front_facing;
  EXPECT_GT(front_facing, 0u);
}

// Vertices of other patches against where a patch's own evaluation puts them; counts those farther off than `share` of
// what the bound says.
struct ForeignOutcome {
  int bounded = 0, vertices = 0, violations = 0;
};
ForeignOutcome check_foreign(const RoundScene& scene, double share) {
  ForeignOutcome out;
  const scene::FrameGeometry& frame = *scene.frame;
  SubPatchBounder bounder(frame, *scene.pyramids, BoundMethod::kNpatch);
  for (std::uint32_t patch = 0; patch < frame.assembly->patch_count(); ++patch) {
    bounder.begin(patch);
    const scene::PosedDrawable& drawable = frame.drawable_of(patch);
    const scene::TessellationPattern& pattern = frame.pattern_of(patch);
    constexpr int kSide = 5;
    for (int j = 0; j < pattern.nv; j += kSide)
      for (int i = 0; i < pattern.nu; i += kSide) {
        const scene::CellRange cells{static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(j),
                                     static_cast<std::uint8_t>(std::min<int>(i + kSide, pattern.nu)),
                                     static_cast<std::uint8_t>(std::min<int>(j + kSide, pattern.nv))};
        (void)bounder.box(cells);
        const CornerFrame corners = corner_frame(bounder.nets());
        std::vector<TangentCones> tangents;
        for (const PatchNet& net : bounder.nets())
          if (const auto cones =
                  tangent_cones(measure_net(net, corners.axes, corners.tangent_u, corners.tangent_v), corners))
            tangents.push_back(*cones);
        if (tangents.size() != bounder.nets().size()) continue;
        const auto error = bounder.foreign_error(cells, tangents);
        if (!error) continue;
        ++out.bounded;
        for (int y = cells.j0; y <= cells.j1; ++y)
          for (int x = cells.i0; x <= cells.i1; ++x) {
            if (x != 0 && y != 0 && x != pattern.nu && y != pattern.nv) continue;
            const scene::OwnedVertex owned = boundary_vertex(pattern, frame.assembly->neighbours[0][patch], x, y);
            for (std::size_t key = 0; key < bounder.nets().size(); ++key) {
              const Vec3 own = domain_point(frame, drawable, patch, pattern.u(x, y), pattern.v(x, y), key),
                         real = domain_point(frame, drawable, owned.patch, owned.u, owned.v, key);
              ++out.vertices;
              if (static_cast<double>(glm::length(own - real)) > share * (error->along_normal + error->besides) + 1e-5)
                ++out.violations;
            }
          }
      }
  }
  return out;
}

TEST(ForeignVertices, AreNoFartherFromAPatchsOwnThanBounded) {
  Random random(77);
  ForeignOutcome total, half;
  for (int trial = 0; trial < 12; ++trial) {
    const RoundScene scene({.displacement = 0.1f, .deforming = trial % 2 != 0, .sheet = true}, random);
    const ForeignOutcome honest = check_foreign(scene, 1.0), twin = check_foreign(scene, 0.0);
    total.bounded += honest.bounded;
    total.vertices += honest.vertices;
    total.violations += honest.violations;
    half.violations += twin.violations;
  }
  EXPECT_EQ(total.violations, 0);
  EXPECT_GT(total.bounded, 100);
  EXPECT_GT(total.vertices, 1000);
  EXPECT_GT(half.violations, 0) << "taking them for the patch's own is caught";
}

// What PatchSplitter leaves out of a round object that is wholly in view faces away; parts of sub-patches that do are
// dropped where that pays.
TEST(BackFaceCulling, PartsThatFaceAwayAreDroppedWhereThatSavesEnough) {
  Random random(12);
  std::uint64_t dropped_whole = 0, dropped_parts = 0;
  for (int trial = 0; trial < 6; ++trial) {
    const RoundScene scene({.displacement = 0.03f, .aperture = 0.05f}, random);
    const scene::FrameGeometry& frame = *scene.frame;
    for (const int worth : {0, 16}) {
      FrontEndSpec spec;
      spec.backface_cells = worth;
      PatchSplitter splitter(frame, *scene.pyramids, spec);
      for (std::uint32_t patch = 0; patch < frame.assembly->patch_count(); ++patch) {
        std::vector<BoundedSubPatch> kept, deferred;
        FrontendCounters counters;
        splitter.split(patch, kept, deferred, counters);
        if (counters.culled_frustum != 0) continue;  // what is out of view may face anywhere
        const scene::TessellationPattern& pattern = frame.pattern_of(patch);
        std::vector<int> covered(static_cast<std::size_t>(pattern.nu) * pattern.nv);
        for (const BoundedSubPatch& piece : kept)
          for (int y = piece.range.j0; y < piece.range.j1; ++y)
            for (int x = piece.range.i0; x < piece.range.i1; ++x)
              ++covered[static_cast<std::size_t>(y) * pattern.nu + static_cast<std::size_t>(x)];
        std::uint64_t missing = 0;
        for (int y = 0; y < pattern.nv; ++y)
          for (int x = 0; x < pattern.nu; ++x) {
            const int times = covered[static_cast<std::size_t>(y) * pattern.nu + static_cast<std::size_t>(x)];
            ASSERT_LE(times, 1);
            if (times == 1) continue;
            ++missing;
            EXPECT_EQ(front_facing(frame, patch, x, y, random), 0u);
          }
        EXPECT_EQ(missing, counters.cells_culled_backface);
        EXPECT_EQ(counters.sub_patches + counters.culled_backface, counters.splits + 1);
        (worth == 0 ? dropped_whole : dropped_parts) += missing;
      }
    }
  }
  EXPECT_GT(dropped_parts, dropped_whole + 100);
}

TEST(BackFaceCulling, KeepsDoubleSidedMaterialsAndWhatCrossesTheNearPlane) {
  Random random(4);
  RoundScene scene({}, random);
  scene.assembly.materials[0].double_sided = true;
  EXPECT_EQ(check(scene, random, false).culled, 0u);
  RoundScene inside({}, random);
  inside.frame->projection.near = 6.0;
  EXPECT_EQ(check(inside, random, false).culled, 0u);
}

}  // namespace
}  // namespace tessera::frontend
