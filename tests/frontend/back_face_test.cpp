// Back-face culling before tessellation drops nothing that could be seen.
#include "frontend/bounds/back_face.h"
#include "tests/frontend/round_scenes.h"
#include "tests/support/tests.h"

namespace tessera::frontend::back_face_test {
namespace {

struct Outcome {
  std::uint64_t cells = 0, culled = 0, front_facing = 0;
};

// Tests pieces of every patch and looks at all triangles of the culled pieces. The twin believes the patch's middle.
Outcome check(const RoundScene& scene, Random& random, bool believe_the_middle) {
  Outcome out;
  const scene::FrameGeometry& frame = *scene.frame;
  SubPatchBounder bounder(frame, *scene.pyramids, BoundMethod::kNpatch);
  BackFaceTest test(frame);
  for (std::uint32_t patch = 0; patch < frame.assembly->patch_count(); ++patch) {
    bounder.begin(patch);
    test.begin(patch);
    // A cluster is tested as a whole.
    const bool grid = has_grid(*frame.drawable_of(patch).drawable);
    const scene::CellRange whole = patch_cells(frame, patch);
    const int side = grid ? 6 : 256;
    for (int j = 0; j < whole.j1; j += side)
      for (int i = 0; i < whole.i1; i += side) {
        const scene::CellRange cells{static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(j),
                                     static_cast<std::uint8_t>(std::min<int>(i + side, whole.i1)),
                                     static_cast<std::uint8_t>(std::min<int>(j + side, whole.j1))};
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
    testing::Values(
        Case{"Static", {}, 0.3}, Case{"Moving", {.moving = true}, 0.25}, Case{"Mirrored", {.mirrored = true}, 0.3},
        Case{"Deforming", {.moving = true, .deforming = true}, 0.2},
        Case{"Defocused", {.moving = true, .aperture = 0.1f}, 0.2}, Case{"Displaced", {.displacement = 0.03f}, 0.01},
        Case{"DisplacedMovingDefocused", {.displacement = 0.03f, .moving = true, .aperture = 0.05f}, 0.01},
        Case{"DisplacedNeighbours", {.displacement = 0.01f, .moving = true, .sheet = true}, 0.02},
        Case{"SteepDisplacement", {.displacement = 0.5f}, 0.0},
        Case{"TinyTriangles", {.moving = true, .target_pixels = 0.5}, 0.05},
        Case{"CoarseTriangles", {.moving = true, .target_pixels = 12}, 0.02},
        Case{"Orthographic", {.moving = true, .aperture = 0.05f, .orthographic = true}, 0.25},
        Case{"Clusters", {.mesh = true}, 0.08}, Case{"ClustersMoving", {.moving = true, .mesh = true}, 0.05},
        Case{"ClustersMirrored", {.moving = true, .mirrored = true, .mesh = true}, 0.05},
        Case{"ClustersDefocused", {.moving = true, .aperture = 0.1f, .mesh = true}, 0.05},
        Case{"ClustersDeforming", {.moving = true, .deforming = true, .mesh = true}, 0.0},
        Case{"ClustersOrthographic", {.moving = true, .aperture = 0.05f, .orthographic = true, .mesh = true}, 0.05}),
    case_name);

TEST(BackFaceCullingTwin, BelievingTheMiddleOfASubPatchIsCaught) {
  Random random(31);
  std::uint64_t front_facing = 0;
  for (int trial = 0; trial < 12; ++trial)
    front_facing += check(RoundScene({.displacement = 0.1f, .moving = true}, random), random, true).front_facing;
  EXPECT_GT(front_facing, 0u);
}

// Narrows the cone of each cluster to its axis and sets the least height and edges of its triangles to 1.
void believe_axes(RoundScene& scene) {
  for (std::vector<scene::ClusterBound>& of_primitive : scene.assembly.cluster_bounds)
    for (scene::ClusterBound& bound : of_primitive) bound.cone_cosine = 1, bound.least_height = bound.least_edges = 1;
}
TEST(BackFaceCullingTwin, BelievingTheAxisOfAClustersConeIsCaught) {
  Random random(31);
  std::uint64_t front_facing = 0;
  for (int trial = 0; trial < 12; ++trial) {
    RoundScene scene({.moving = true, .mesh = true}, random);
    believe_axes(scene);
    front_facing += check(scene, random, false).front_facing;
  }
  EXPECT_GT(front_facing, 0u);
}

// Compares vertices of other patches with the patch's own evaluation; counts vertices farther off than `share` of the
// bound.
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

// PatchSplitter drops only sub-patches that face away, where a round object is wholly in view.
TEST(BackFaceCulling, OnlySubPatchesThatFaceAwayAreDropped) {
  Random random(12);
  std::uint64_t dropped = 0;
  for (int trial = 0; trial < 6; ++trial) {
    const RoundScene scene({.displacement = 0.03f, .aperture = 0.05f}, random);
    const scene::FrameGeometry& frame = *scene.frame;
    FrontEndSpec spec;
    spec.split_pixels = 8;
    PatchSplitter splitter(frame, *scene.pyramids, spec);
    for (std::uint32_t patch = 0; patch < frame.assembly->patch_count(); ++patch) {
      std::vector<BoundedSubPatch> kept;
      FrontendCounters counters;
      splitter.split(patch, kept, counters);
      if (counters.culled_frustum != 0) continue;  // geometry out of view may face anywhere
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
      dropped += missing;
    }
  }
  EXPECT_GT(dropped, 100u);
}

TEST(BackFaceCulling, KeepsDoubleSidedMaterialsAndPatchesAcrossTheNearPlane) {
  Random random(4);
  RoundScene scene({}, random);
  scene.assembly.materials[0].double_sided = true;
  EXPECT_EQ(check(scene, random, false).culled, 0u);
  RoundScene inside({}, random);
  inside.frame->projection.near = 6.0;
  EXPECT_EQ(check(inside, random, false).culled, 0u);
}

}  // namespace
}  // namespace tessera::frontend::back_face_test
