// Catmull-Clark control meshes as Bezier patches. The oracle for limit surfaces is OpenSubdiv's evaluator (Bfr), which
// shares nothing with the masks under test but the refinement rules.
#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/bfr/surface.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include "scene/subdivision/control_cage.h"

#include "scene/assembly.h"
#include "scene/subdivision/refined_cage.h"
#include "tests/support/cages.h"
#include "tests/support/tests.h"

namespace tessera::scene::subdivision::catmull_clark_test {
namespace {

using test::Cage;
namespace far = OpenSubdiv::Far;
namespace bfr = OpenSubdiv::Bfr;
using DVec2 = glm::dvec2;

Primitive converted(const Cage& cage) {
  MemoryBudget budget(1u << 30);
  return convert(cage.primitive, cage.rules, budget, "test");
}

std::size_t patch_total(const Primitive& patches) { return patches.vertices.count() / 16; }

// The limit surface of a cage of quads.
class LimitSurface {
 public:
  explicit LimitSurface(const Cage& cage) : points_(cage.points) {
    const ControlCage topology = build_cage(cage.primitive, cage.rules);
    far::TopologyDescriptor description;
    description.numVertices = static_cast<int>(topology.point_vertex.size());
    description.numFaces = static_cast<int>(topology.face_sizes.size());
    description.numVertsPerFace = topology.face_sizes.data();
    description.vertIndicesPerFace = topology.face_points.data();
    description.numCreases = static_cast<int>(topology.crease_sharpness.size());
    description.creaseVertexIndexPairs = topology.crease_points.data();
    description.creaseWeights = topology.crease_sharpness.data();
    description.numCorners = static_cast<int>(topology.corner_sharpness.size());
    description.cornerVertexIndices = topology.corner_points.data();
    description.cornerWeights = topology.corner_sharpness.data();
    OpenSubdiv::Sdc::Options options;
    options.SetVtxBoundaryInterpolation(cage.rules.boundary == BoundaryRule::kEdge
                                            ? options.VTX_BOUNDARY_EDGE_ONLY
                                            : options.VTX_BOUNDARY_EDGE_AND_CORNER);
    using Factory = far::TopologyRefinerFactory<far::TopologyDescriptor>;
    refiner_.reset(Factory::Create(description, Factory::Options(OpenSubdiv::Sdc::SCHEME_CATMARK, options)));
    for (const std::uint32_t v : topology.point_vertex)
      for (int c = 0; c < 3; ++c) values_.push_back(static_cast<double>(cage.primitive.vertices.positions[v][c]));
    factory_ = std::make_unique<bfr::RefinerSurfaceFactory<>>(
        *refiner_, bfr::SurfaceFactory::Options().SetApproxLevelSharp(8).SetApproxLevelSmooth(8));
  }

  DVec3 at(int face, double u, double v) const {
    bfr::Surface<double> surface;
    EXPECT_TRUE(factory_->InitVertexSurface(face, &surface));
    std::vector<double> patch(static_cast<std::size_t>(3 * surface.GetNumPatchPoints()));
    surface.PreparePatchPoints(values_.data(), 3, patch.data(), 3);
    const double uv[2] = {u, v};
    DVec3 p;
    surface.Evaluate(uv, patch.data(), 3, &p.x);
    return p;
  }

 private:
  std::vector<Vec3> points_;
  std::vector<double> values_;
  std::unique_ptr<far::TopologyRefiner> refiner_;
  std::unique_ptr<bfr::RefinerSurfaceFactory<>> factory_;
};

// Distance of a patch's point at (u,v) from the limit surface where the patch's texture coordinates say it lies.
double error_at(const LimitSurface& limit, const Primitive& patches, std::size_t patch, double u, double v) {
  const std::vector<Vec2>& uv = patches.vertices.texcoords[0];
  const auto mix = [&](std::size_t a, std::size_t b, double t) {
    return DVec2(uv[16 * patch + a]) * (1 - t) + DVec2(uv[16 * patch + b]) * t;
  };
  const DVec2 at = mix(0, 3, u) * (1 - v) + mix(12, 15, u) * v;
  const int face = static_cast<int>(patches.vertices.texcoords[1][16 * patch].x);
  return glm::length(test::bezier_point(&patches.vertices.positions[16 * patch], u, v) - limit.at(face, at.x, at.y));
}

double largest_error(const Cage& cage, const Primitive& patches, bool corners_only = false) {
  const LimitSurface limit(cage);
  Random random(5);
  double worst = 0;
  for (std::size_t p = 0; p < patch_total(patches); ++p)
    for (int k = 0; k < 8; ++k) {
      const double u = corners_only || k < 4 ? k & 1 : static_cast<double>(random.uniform(0, 1)),
                   v = corners_only || k < 4 ? (k >> 1) & 1 : static_cast<double>(random.uniform(0, 1));
      worst = std::max(worst, error_at(limit, patches, p, u, v));
    }
  return worst;
}

constexpr double kRounding = 1e-6;  // coordinates of a few units in single precision

struct Shared {
  std::size_t matched = 0, unmatched = 0;  // edges of patches that another patch has, or none
  double widest_angle = 0;                 // between the normals of two patches along a shared edge, radians
};

DVec3 unit_normal(const Vec3* points, double u, double v) {
  const auto t = test::bezier_tangents(points, u, v);
  return glm::normalize(glm::cross(t[0], t[1]));
}

DVec2 on_side(std::uint8_t edge, double t) {
  switch (edge) {
    case 0:
      return {t, 0};
    case 1:
      return {t, 1};
    case 2:
      return {0, t};
    default:
      return {1, t};
  }
}

Shared shared_edges(const Primitive& patches) {
  const std::vector<PatchNeighbours> neighbours = find_neighbours(patches.vertices);
  std::map<std::pair<std::uint32_t, int>, int> users;
  for (const auto& patch : neighbours)
    for (const auto& edge : patch.edges) ++users[{edge.patch, edge.edge}];
  Shared out;
  for (const auto& [owner, count] : users)
    (count == 2 ? out.matched : out.unmatched) += static_cast<std::size_t>(count);
  const auto& points = patches.vertices.positions;
  for (std::size_t p = 0; p < neighbours.size(); ++p)
    for (std::uint8_t e = 0; e < 4; ++e) {
      const auto& owner = neighbours[p].edges[e];
      if (owner.patch == p && owner.edge == e) continue;
      for (double t = 0.0; t <= 1.0; t += 0.125) {
        const DVec2 here = on_side(e, t), there = on_side(owner.edge, owner.reversed ? 1 - t : t);
        const double cosine = glm::dot(unit_normal(&points[16 * p], here.x, here.y),
                                       unit_normal(&points[16 * owner.patch], there.x, there.y));
        out.widest_angle = std::max(out.widest_angle, std::acos(std::min(1.0, cosine)));
      }
    }
  return out;
}

// ---- Exactness (LM2, LM3) -----------------------------------------------------------------------------------------

TEST(CatmullClark, RegularFacesAreTheBicubicBSplinePatch) {
  Cage cage = test::grid_cage(5, 4, 0.8f, 1);
  cage.rules.levels = 0;
  const Primitive patches = converted(cage);
  // The inner face (2, 1) to (3, 2) from its 4 x 4 points, by the formula: basis conversion along u, then along v.
  constexpr double kConvert[4][4] = {{1 / 6.0, 4 / 6.0, 1 / 6.0, 0},
                                     {0, 4 / 6.0, 2 / 6.0, 0},
                                     {0, 2 / 6.0, 4 / 6.0, 0},
                                     {0, 1 / 6.0, 4 / 6.0, 1 / 6.0}};
  const std::size_t patch = 1 * 5 + 2;
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 4; ++i) {
      DVec3 expected(0.0);
      for (std::size_t y = 0; y < 4; ++y)
        for (std::size_t x = 0; x < 4; ++x)
          expected += DVec3(cage.points[(0 + y) * 6 + 1 + x]) * (kConvert[i][x] * kConvert[j][y]);
      EXPECT_LT(glm::length(DVec3(patches.vertices.positions[16 * patch + 4 * j + i]) - expected), kRounding)
          << i << ' ' << j;
    }
}

TEST(CatmullClark, AGridIsTheLimitSurfaceUpToItsBoundaryAndCorners) {
  for (const int levels : {0, 1, 2}) {
    Cage cage = test::grid_cage(4, 3, 0.8f, 2);
    cage.rules.levels = levels;
    const Primitive patches = converted(cage);
    EXPECT_EQ(patch_total(patches), 12u << (2 * levels));
    EXPECT_LT(largest_error(cage, patches), kRounding) << levels;
  }
}

TEST(CatmullClark, PatchCornersLieOnTheLimitSurfaceOfAnyCage) {
  for (const int levels : {0, 1, 2, 3}) {
    Cage cage = test::bracket_cage();
    cage.rules.levels = levels;
    EXPECT_LT(largest_error(cage, converted(cage), true), kRounding) << levels;
  }
}

TEST(CatmullClark, TheApproximationAtExtraordinaryPointsShrinksWithEveryLevel) {
  Cage cage = test::bracket_cage(0.1f);
  double previous = 0.06;  // of a cube's side
  for (const int levels : {0, 1, 2, 3}) {
    cage.rules.levels = levels;
    const double error = largest_error(cage, converted(cage));
    EXPECT_LT(error, previous) << levels;
    previous = error;
  }
  EXPECT_LT(previous, 0.005);
}

TEST(CatmullClark, CornersOfACubeAreWhereTheFormulaPutsThem) {
  // Limit of a point of valence 3: (9 v + 4 sum e + sum f) / 24; for the unit cube's origin (4 + 2) / 24 along each
  // axis.
  Cage cage = test::cube_cage();
  cage.rules.levels = 0;
  const Primitive patches = converted(cage);
  for (std::size_t p = 0; p < 6; ++p)
    for (const std::size_t c : {0, 3, 12, 15})
      for (int axis = 0; axis < 3; ++axis) {
        const double x = static_cast<double>(patches.vertices.positions[16 * p + c][axis]);
        EXPECT_NEAR(std::min(x, 1 - x), 6.0 / 24.0, kRounding);
      }
}

// ---- Sharpness (LM3) ---------------------------------------------------------------------------------------------

TEST(CatmullClark, ACubeOfInfinitelySharpEdgesStaysACube) {
  for (const int levels : {0, 2}) {
    Cage cage = test::cube_cage();
    cage.rules.levels = levels;
    for (const auto& face : cage.faces) test::add_crease(cage, {face[0], face[1], face[2], face[3], face[0]});
    const Primitive patches = converted(cage);
    for (std::size_t p = 0; p < patch_total(patches); ++p) {
      // Every patch is flat, in the plane of its face.
      int flat = 0;
      for (int axis = 0; axis < 3; ++axis) {
        float low = 9, high = -9;
        for (std::size_t k = 0; k < 16; ++k)
          low = std::min(low, patches.vertices.positions[16 * p + k][axis]),
          high = std::max(high, patches.vertices.positions[16 * p + k][axis]);
        flat += high - low < 1e-6f && (std::abs(low) < 1e-6f || std::abs(low - 1) < 1e-6f) ? 1 : 0;
      }
      EXPECT_EQ(flat, 1) << p;
    }
    EXPECT_LT(largest_error(cage, patches), kRounding);
  }
}

TEST(CatmullClark, ACreaseIsTheLimitCurveOfItsPoints) {
  // A sharp line across a grid: regular on both sides, so everything is exact.
  Cage cage = test::grid_cage(4, 4, 0.8f, 3);
  cage.rules.levels = 1;
  test::add_crease(cage, {10, 11, 12, 13, 14});
  const Primitive patches = converted(cage);
  EXPECT_LT(largest_error(cage, patches), kRounding);
  const Cage smooth = [&] {
    Cage c = cage;
    c.rules.creases.clear();
    return c;
  }();
  EXPECT_GT(largest_error(smooth, patches), 0.01);  // and it matters
}

TEST(CatmullClark, SemiSharpCreasesAreExactOnceTheirSharpnessIsUsedUp) {
  for (const float sharpness : {0.5f, 1.0f, 1.7f}) {
    Cage cage = test::grid_cage(4, 4, 0.8f, 4);
    test::add_crease(cage, {10, 11, 12, 13, 14}, sharpness);
    cage.rules.levels = static_cast<int>(std::ceil(sharpness));
    EXPECT_LT(largest_error(cage, converted(cage), true), kRounding) << sharpness;
    cage.rules.levels = 3;
    EXPECT_LT(largest_error(cage, converted(cage)), kRounding) << sharpness;
  }
}

TEST(CatmullClark, SharpCornersStayWhereTheyAre) {
  Cage cage = test::bracket_cage();
  cage.rules.corners.push_back({{test::vertex_of(cage, 0)}, kInfinitelySharp});
  const Primitive patches = converted(cage);
  EXPECT_THAT(patches.vertices.positions, testing::Contains(cage.points[0]));
  EXPECT_LT(largest_error(cage, patches, true), kRounding);
}

TEST(CatmullClark, TheBoundaryRuleDecidesWhetherCornersAreRound) {
  for (const BoundaryRule rule : {BoundaryRule::kEdge, BoundaryRule::kEdgeAndCorner}) {
    Cage cage = test::grid_cage(3, 3, 0.0f, 1);
    cage.rules.boundary = rule;
    const Primitive patches = converted(cage);
    const float corner = glm::length(patches.vertices.positions[0]);
    // The smooth curve passes (0 + 4 * 0 + 1) / 6 along each axis from the corner.
    EXPECT_NEAR(corner, rule == BoundaryRule::kEdge ? std::sqrt(2.0f) / 6.0f : 0.0f, 1e-6f);
    EXPECT_LT(largest_error(cage, patches, true), kRounding);
  }
}

// ---- Watertight (LM1) --------------------------------------------------------------------------------------------

std::vector<Cage> closed_cages() {
  std::vector<Cage> cages = {test::cube_cage(), test::bracket_cage(), test::mixed_cage(),
                             test::voxel_cage({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {2, 0, 0}}, 0.3f, 7)};
  Cage creased = test::bracket_cage(0.2f, 3);
  test::add_crease(creased, {creased.faces[0][0], creased.faces[0][1], creased.faces[0][2]}, 2.5f);
  test::add_crease(creased, {creased.faces[4][0], creased.faces[4][1]});
  creased.rules.corners.push_back({{test::vertex_of(creased, creased.faces[6][2])}, 1.5f});
  cages.push_back(creased);
  return cages;
}

TEST(CatmullClark, EveryPatchEdgeOfAClosedCageIsSharedByTwoPatchesBitByBit) {  // CAGE1, LM1
  // Every face of these cages has texture coordinates, and so glTF vertices, of its own.
  for (const Cage& original : closed_cages())
    for (const int levels : {1, 2}) {
      Cage cage = original;
      cage.rules.levels = levels;
      const Shared shared = shared_edges(converted(cage));
      EXPECT_EQ(shared.unmatched, 0u);
      EXPECT_GT(shared.matched, 0u);
    }
}

TEST(CatmullClark, OnlyTheBoundaryOfAnOpenCageIsUnshared) {
  Cage cage = test::grid_cage(4, 3, 0.5f, 9);
  for (const int levels : {0, 1, 2}) {
    cage.rules.levels = levels;
    EXPECT_EQ(shared_edges(converted(cage)).unmatched, 14u << levels);
  }
}

TEST(CatmullClark, APointOfOneUlpElsewhereOpensTheSurface) {
  Primitive patches = converted(test::bracket_cage());
  float& x = patches.vertices.positions[16 * 5 + 1].x;
  x = std::nextafter(x, 9.0f);
  EXPECT_EQ(shared_edges(patches).unmatched, 2u);
}

TEST(CatmullClark, NormalsOfNeighboursNearlyAgree) {
  for (const auto& [levels, degrees] : std::map<int, double>{{1, 1.0}, {2, 0.5}, {3, 0.3}}) {
    Cage cage = test::bracket_cage(0.1f);
    cage.rules.levels = levels;
    EXPECT_LT(shared_edges(converted(cage)).widest_angle * 57.3, degrees) << levels;
  }
}

TEST(CatmullClark, FansThatTouchInAPointAreSplitAndStillMeetThere) {  // CAGE2
  // Two cubes that share an edge only: four faces meet there.
  const Cage cage = test::voxel_cage({{0, 0, 0}, {1, 1, 0}});
  EXPECT_EQ(build_cage(cage.primitive, cage.rules).split_points, 4u);
  const Primitive patches = converted(cage);
  EXPECT_EQ(shared_edges(patches).unmatched, 0u);
  EXPECT_EQ(std::count(patches.vertices.positions.begin(), patches.vertices.positions.end(), Vec3(1, 1, 0)), 6);
}

// ---- Data that follow the cage -----------------------------------------------------------------------------------

TEST(CatmullClark, MorphTargetsConvertLikeThePositionsThatTheyAreAddedTo) {
  Cage cage = test::bracket_cage();
  Random random(6);
  std::map<int, Vec3> difference;
  MorphTarget target, empty;
  Cage moved = cage;
  for (std::size_t f = 0; f < cage.faces.size(); ++f)
    for (std::size_t k = 0; k < 4; ++k) {
      const Vec3 d = difference.emplace(cage.faces[f][k], random.in_box(0.5f)).first->second;
      target.positions.push_back(d);
      moved.primitive.vertices.positions[test::vertex_at(cage, f, k)] += d;
    }
  cage.primitive.vertices.morph_targets = {empty, target};
  const Primitive morphing = converted(cage), there = converted(moved);
  ASSERT_EQ(morphing.vertices.morph_targets.size(), 2u);
  EXPECT_TRUE(morphing.vertices.morph_targets[0].positions.empty());
  for (std::size_t v = 0; v < morphing.vertices.count(); ++v)
    EXPECT_LT(glm::length(morphing.vertices.positions[v] + morphing.vertices.morph_targets[1].positions[v] -
                          there.vertices.positions[v]),
              2e-6f);
  EXPECT_EQ(shared_edges(morphing).unmatched, 0u);
}

TEST(CatmullClark, WeightsOfEveryControlPointSumToOne) {  // LM4
  for (Cage cage : closed_cages()) {
    // An equal motion of every point of the cage moves every control point equally.
    MorphTarget target;
    target.positions.assign(cage.primitive.vertices.count(), Vec3(1, 2, -4));
    cage.primitive.vertices.morph_targets = {target};
    const Primitive patches = converted(cage);
    for (const Vec3& p : patches.vertices.morph_targets[0].positions) EXPECT_EQ(p, Vec3(1, 2, -4));
  }
}

TEST(CatmullClark, InfluencesAreBlendedTruncatedToEightAndShared) {
  // Every point has a joint of its own: around a point there are more than eight.
  Cage cage = test::bracket_cage();
  for (const auto& face : cage.faces)
    for (const int point : face) {
      SkinInfluence influence;
      influence.joints[0] = static_cast<std::uint16_t>(point);
      influence.weights[0] = 1.0f;
      cage.primitive.vertices.influences.push_back(influence);
    }
  const Primitive patches = converted(cage);
  ASSERT_EQ(patches.vertices.influences.size(), patches.vertices.count());
  for (const SkinInfluence& influence : patches.vertices.influences) {
    float sum = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      sum += influence.weights[k];
      EXPECT_GE(influence.weights[k], 0.0f);
      EXPECT_LE(influence.weights[k], influence.weights[k == 0 ? 0 : k - 1]);
    }
    EXPECT_NEAR(sum, 1.0f, 1e-6f);
  }
  EXPECT_EQ(shared_edges(patches).unmatched, 0u);
  // A patch corner follows its own point most: by n / (n + 5), 3/8 at a point of three edges.
  cage.rules.levels = 0;
  EXPECT_GT(converted(cage).vertices.influences[0].weights[0], 0.37f);
}

TEST(CatmullClark, TextureCoordinatesAreBilinearWithinEachFaceOfTheCage) {
  Cage cage = test::mixed_cage();
  cage.rules.levels = 2;
  const Primitive patches = converted(cage);
  std::map<int, double> area;  // in texture space, per face
  for (std::size_t p = 0; p < patch_total(patches); ++p) {
    const Vec2* uv = &patches.vertices.texcoords[0][16 * p];
    const Vec2 a = uv[15] - uv[0], b = uv[12] - uv[3];
    area[static_cast<int>(patches.vertices.texcoords[1][16 * p].x)] += 0.5 * static_cast<double>(a.x * b.y - a.y * b.x);
  }
  ASSERT_EQ(area.size(), cage.faces.size());
  for (const auto& [face, covered] : area)
    EXPECT_NEAR(covered, cage.faces[static_cast<std::size_t>(face)][3] >= 0 ? 1.0 : 0.5, 1e-5) << face;
}

TEST(CatmullClark, ColoursComeFromTheFacesCorners) {
  Cage cage = test::cube_cage();
  for (std::size_t v = 0; v < 24; ++v) cage.primitive.vertices.colors.emplace_back(static_cast<float>(v / 4), 0, 0, 1);
  const Primitive patches = converted(cage);
  for (std::size_t p = 0; p < patch_total(patches); ++p)
    EXPECT_NEAR(patches.vertices.colors[16 * p].x, patches.vertices.texcoords[1][16 * p].x, 1e-5f);
}

// ---- Refused cages -----------------------------------------------------------------------------------------------

std::string fault_of(const Cage& cage) {
  try {
    converted(cage);
  } catch (const CageError& error) {
    return error.what();
  }
  return "";
}

TEST(CatmullClark, RefusesCagesThatAreNoneAndSaysWhere) {
  Cage cage = test::cube_cage();
  cage.rules.quads = 7;
  EXPECT_THAT(fault_of(cage), HasSubstr("has 7 quads, its 12 triangles make up to 6"));
  cage = test::cube_cage();
  std::swap(cage.primitive.indices[3], cage.primitive.indices[4]);
  EXPECT_THAT(fault_of(cage), HasSubstr("quad 0 is no pair (a, b, c), (a, c, d)"));
  cage = test::cube_cage();
  cage.rules.creases.push_back({{0, 99}, 1.0f});
  EXPECT_THAT(fault_of(cage), HasSubstr("a crease names vertex 99, there are 24"));
  cage = test::cube_cage();
  cage.rules.creases.push_back({{0, 2}, 1.0f});
  EXPECT_THAT(fault_of(cage), HasSubstr("between the vertices 0 and 2, which no edge joins"));
  cage = test::cube_cage();
  cage.rules.corners.push_back({{24}, 1.0f});
  EXPECT_THAT(fault_of(cage), HasSubstr("a corner names vertex 24"));
  cage = test::mixed_cage();
  cage.rules.levels = 0;
  EXPECT_THAT(fault_of(cage), HasSubstr("faces that are not quads"));
  cage = test::bracket_cage();
  for (Vec3& p : cage.primitive.vertices.positions) p = (p - Vec3(0.7f)) * 1.5e38f;
  cage.rules.levels = 0;
  EXPECT_EQ(fault_of(cage), "");  // large, and fine
  cage = test::cube_cage();
  for (Vec3& p : cage.primitive.vertices.positions) p = Vec3(1.0f);
  EXPECT_THAT(fault_of(cage), HasSubstr("no face with an area"));
}

TEST(CatmullClark, RefusesAFanOfMoreEdgesThanThePermittedValence) {
  std::vector<Vec3> points = {{0, 0, 0}};
  std::vector<std::array<int, 4>> faces;
  const int n = static_cast<int>(kMaxValence) + 1;
  for (int k = 0; k < n; ++k) {
    points.emplace_back(std::cos(6.2831853f * static_cast<float>(k) / static_cast<float>(n)),
                        std::sin(6.2831853f * static_cast<float>(k) / static_cast<float>(n)), 0.0f);
    faces.push_back({0, 1 + k, 1 + (k + 1) % n, -1});
  }
  EXPECT_THAT(fault_of(test::cage_of(points, faces)), HasSubstr("more than 1024 edges"));
}

TEST(CatmullClark, AnySoupOfFacesIsConvertedOrRefused) {
  // Few points and many faces: edges of three and more faces, fans that touch, faces twice over, either way round.
  Random random(11);
  int converted_cages = 0, refused = 0;
  for (int run = 0; run < 3000; ++run) {
    std::vector<Vec3> points;
    for (int k = random.integer(4, 12); k > 0; --k) points.push_back(random.in_box(1.0f));
    const int last = static_cast<int>(points.size()) - 1;
    std::vector<std::array<int, 4>> faces;
    for (int k = random.integer(1, 16); k > 0; --k)
      faces.push_back({random.integer(0, last), random.integer(0, last), random.integer(0, last),
                       random.coin() ? random.integer(0, last) : -1});
    Cage cage = test::cage_of(points, faces);
    cage.rules.levels = random.integer(1, 2);
    cage.rules.boundary = random.coin() ? BoundaryRule::kEdge : BoundaryRule::kEdgeAndCorner;
    const auto any = static_cast<std::size_t>(random.integer(0, static_cast<int>(cage.faces.size()) - 1));
    if (random.coin()) test::add_crease(cage, {cage.faces[any][0], cage.faces[any][1]}, random.uniform(0, 4));
    try {
      const Primitive patches = converted(cage);
      const RefinedCage refined(build_cage(cage.primitive, cage.rules), cage.rules);
      for (int p = 0; p < refined.finest().GetNumVertices(); ++p)
        ASSERT_FALSE(refined.finest().IsVertexNonManifold(p)) << run;
      EXPECT_EQ(patch_total(patches), static_cast<std::size_t>(refined.patch_count()));
      EXPECT_EQ(patches.vertices.texcoords[0].size(), patches.vertices.count());
      ++converted_cages;
    } catch (const CageError&) {
      ++refused;
    }
  }
  EXPECT_GT(converted_cages, 1500);
  EXPECT_GT(refused, 10);
}

TEST(CatmullClark, SidesWithoutLengthAreLeftOut) {  // CAGE3
  // The top of the cube drawn together to a point: four quads become triangles, the top face goes.
  Cage cage = test::cube_cage();
  for (Vec3& p : cage.primitive.vertices.positions)
    if (p.z == 1.0f) p = Vec3(0.5f, 0.5f, 1.0f);
  const ControlCage topology = build_cage(cage.primitive, cage.rules);
  EXPECT_EQ(topology.face_sizes.size(), 5u);
  EXPECT_EQ(topology.face_points.size(), 16u);
  EXPECT_EQ(shared_edges(converted(cage)).unmatched, 0u);
}

TEST(CatmullClark, MemoryIsChargedBeforeItIsTaken) {
  Cage cage = test::grid_cage(64, 64, 0.1f, 1);
  cage.rules.levels = 4;  // a million patches: 4 GB
  MemoryBudget budget(100u << 20);
  EXPECT_THROW(convert(cage.primitive, cage.rules, budget, "test"), LimitError);
  EXPECT_LT(budget.used_bytes(), 5u << 20);
}

}  // namespace
}  // namespace tessera::scene::subdivision::catmull_clark_test
