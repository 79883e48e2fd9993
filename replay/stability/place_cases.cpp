#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "replay/stability/case_tables.h"
#include "replay/stability/measures.h"

namespace tessera::replay::stability {
namespace {

constexpr double kGrid = 0.01;  // px: the sub-pixel grid, and a little of single precision

// A displaced ball and a sheet of triangles that move a little, seen through a lens; all lengths times `scale`.
Stage small_scene(double scale = 1) {
  Stage stage;
  const int body = stage.add(closed_patches(stage.displaced(0.15f, 0)), {-0.8, 0, 0});
  scene::Material lit;
  lit.base_color = {0.2f, 0.7f, 0.9f, 1};
  lit.metallic = 0;
  const int wall = stage.add(sheet(8, 8, {0.2f, -0.9f}, {2.0f, 0.9f}, stage.material(lit)));
  stage.node(wall).transform.rotation = glm::angleAxis(0.6, DVec3(0, 1, 0));
  stage.move(body, {0.1, 0.05, 0.2});
  scene::Camera camera;
  camera.near = static_cast<float>(0.1 * scale);
  camera.lens = {static_cast<float>(0.02 * scale), static_cast<float>(4 * scale)};
  stage.look({0.3, 0.3, 4.5}, camera);
  if (scale != 1) stage.below({.scale = DVec3(scale)});
  return stage;
}

// All of it carried away.
Stage away(Stage stage, const DVec3& way) {
  stage.below({.translation = way});
  return stage;
}

std::function<double(const Stage&, bool)> off_its_place(VertexFault fault) {
  return [fault](const Stage& stage, bool twin) { return vertex_error(stage, twin ? fault : VertexFault::kNone); };
}

// Pixels that differ from the scene at its own size; the twin's lens keeps its size.
double unlike_its_own_size(const Stage& stage, bool twin) {
  Stage other = stage;
  if (twin) other.capture.cameras[0].lens.aperture_radius *= 1.01f;
  return different_pixels(render(small_scene()), render(other));
}

Stage skinned_far_away() {
  Stage stage;
  const int node = stage.add(closed_patches(stage.displaced(0.1f, 0)));
  const int joint = stage.skin(node, 2, -1, 1);
  stage.turn(joint + 1, {0, 0, 1}, 0.08);
  stage.look({0, 0, 4.5});
  return away(stage, {4200000.5, 4700000.2, 300000.1});
}

// The vertices themselves and the camera are carried away, by a thousand units times `far`.
Stage with_far_vertices(float far) {
  Stage stage = small_scene();
  const Vec3 way = Vec3(1000, -700, 400) * far;
  for (scene::Mesh& mesh : stage.capture.meshes)
    for (Vec3& p : mesh.primitives[0].vertices.positions) p += way;
  for (scene::Node& node : stage.capture.nodes) {
    if (node.camera != scene::kNone) node.transform.translation += DVec3(way);
    node.transform.rotation = DQuat(1, 0, 0, 0);
  }
  return stage;
}

constexpr std::string_view kDouble =
    "Nodes, cameras and their products are double precision; single precision begins at the raster, near the camera.";

std::vector<StabilityCase> far_cases() {
  const auto singles = off_its_place(VertexFault::kSingleMatrices);
  return {
      {kPlacesAndScales, "nodes a million units away", "NodesFarAway", "A float has a step of 1/16 there, four pixels.",
       kDouble, "matrices of single precision",
       "By/MovedScene.LooksTheSameWhenItsNodesAreMoved "
       "VisibilityMethods.AgreeAtTheEndOfTheGuardBandAndAMillionUnitsAway",
       kGrid, "px",
       [] {
         return away(small_scene(), {1e6, -7e5, 4e5});
       },
       singles},
      {kPlacesAndScales, "skin on the globe, 4e6 units away", "SkinOnTheGlobe",
       "Joints carry each vertex to coordinates with a step of half a unit.",
       "Skinned vertices count from an origin beside their joints (scene/pose.h), so they are as precise anywhere.",
       "matrices of single precision", "SkinnedImages.EqualARigidMesh", 0.26, "px", skinned_far_away, singles},
      {kPlacesAndScales, "instances on the globe", "InstancesOnTheGlobe",
       "A transform of single precision is multiplied by one that is far away.",
       "Instances are multiplied in double precision.", "matrices of single precision",
       "InstancedImages.EqualANodeForEachInstance", kGrid, "px",
       [] {
         Stage stage;
         const int node = stage.add(closed_patches(stage.displaced(0.15f, 0)));
         stage.node(node).instances.resize(5);
         for (std::size_t k = 0; k < 5; ++k) {
           stage.node(node).instances[k].translation = {1.3f * static_cast<float>(k) - 2.6f, 0.1f, 0};
           stage.node(node).instances[k].scale = {0.5f, 0.5f + 0.1f * static_cast<float>(k), 0.5f};
         }
         stage.look({0, 0, 5});
         return away(stage, {4200000.5, 4700000.2, 300000.1});
       },
       singles},
      {kPlacesAndScales, "nodes that cancel", "NodesThatCancel",
       "A parent is 1e9 units away, and its child as far back.", kDouble, "nodes of single precision",
       "By/MovedScene.LooksTheSameWhenItsNodesAreMoved", kGrid, "px",
       [] {
         // The camera stays; the rest goes out by 1e9 + 33, back by 1e9 + 31, and by 2: a float has a step of 64 there.
         Stage stage = away(away(away(small_scene(), {-2, 0, 0}), {1e9 + 33, 0, 0}), {-1e9 - 31, 0, 0});
         const auto camera = static_cast<int>(
             std::ranges::find_if(stage.capture.nodes,
                                  [](const scene::Node& node) { return node.camera != scene::kNone; }) -
             stage.capture.nodes.begin());
         std::erase(stage.node(stage.node(camera).parent).children, camera);
         stage.node(camera).parent = scene::kNone;
         stage.capture.roots.push_back(camera);
         return stage;
       },
       [](const Stage& stage, bool twin) {
         if (!twin) return vertex_error(stage);
         Stage rounded = stage;
         for (scene::Node& node : rounded.capture.nodes)
           node.transform.translation = DVec3(Vec3(node.transform.translation));
         return different_pixels(render(stage), render(rounded));
       }},
      {kPlacesAndScales, "vertices a thousand units away", "VerticesFarAway",
       "Vertices are single precision in the file: a step of 1/16384 unit.",
       "The surface is evaluated about as exactly as its control points are known, which is the limit: a million units "
       "away they are not.",
       "vertices a million units away", "MovedVertices.LookTheSameUntilTheyRoundByAVisiblePartOfAPixel", 0.05, "px",
       [] { return with_far_vertices(1); },
       [](const Stage& stage, bool twin) { return vertex_error(twin ? with_far_vertices(1000) : stage); }},
      {kPlacesAndScales, "floor a thousand times as wide as it is far", "WideFloor",
       "The control points are a thousand units away, the visible part is near the camera.",
       "The grid is as fine as the target edge asks for, and single precision leaves a thousandth of a pixel.",
       "matrices of single precision", "HardProcedures.AFloorThatStraddlesTheCameraReachesTheFrontOfTheImage", kGrid,
       "px",
       [] {
         Stage stage;
         stage.add(
             patches(flat_patch({-500, -1, 500}, {1000, 0, 0}, {0, 0, -1000}), stage.flat({0.4f, 0.6f, 0.3f, 1})));
         stage.look({0, 0.5, 0});
         stage.still();
         return away(stage, {1e5, 3e5, -2e5});
       },
       singles},
  };
}

std::vector<StabilityCase> scale_cases() {
  return {
      {kPlacesAndScales, "scale 1e-15", "ScaleDown",
       "Lengths of 1e-15 are below any absolute epsilon, and their squares below 1e-30.",
       "Vectors are brought near 1 by a power of two before products of them are taken, and no epsilon is absolute.",
       "a near plane that keeps its size", "By/ScaledScene.LooksTheSame", kGrid, "px",
       [] { return small_scene(1e-15); },
       [](const Stage& stage, bool twin) {
         Stage other = stage;
         if (twin) other.capture.cameras[0].near = 0.1f;
         return twin ? different_pixels(render(stage), render(other)) : vertex_error(stage);
       }},
      {kPlacesAndScales, "scale 1e12", "ScaleUp",
       "Squares of lengths reach 1e24 and their products the end of single precision.",
       "Vectors are brought near 1 by a power of two before products of them are taken "
       "(tilecore/shading/lane_surface.inc).",
       "a lens that keeps its size", "By/ScaledScene.LooksTheSame", kGrid, "px", [] { return small_scene(1e12); },
       [](const Stage& stage, bool twin) {
         Stage other = stage;
         if (twin) other.capture.cameras[0].lens = {0.02f, 4.0f};
         return twin ? different_pixels(render(stage), render(other)) : vertex_error(stage);
       }},
      {kPlacesAndScales, "scale 2^-50", "PowerOfTwoDown",
       "Multiplying by a power of two rounds nothing, so no bit may tell.",
       "Nothing in the machine knows a length of its own.", "a lens that is 1 % wider",
       "ScaledScene.ByAPowerOfTwoLooksTheSameBitByBit ScaledScene.WithALensOfTheOldSizeIsCaught", 0, "pixels",
       [] { return small_scene(0x1p-50); }, unlike_its_own_size},
      {kPlacesAndScales, "scale 2^40", "PowerOfTwoUp",
       "Multiplying by a power of two rounds nothing, so no bit may tell.",
       "Nothing in the machine knows a length of its own.", "a lens that is 1 % wider",
       "ScaledScene.ByAPowerOfTwoLooksTheSameBitByBit ScaledScene.WithALensOfTheOldSizeIsCaught", 0, "pixels",
       [] { return small_scene(0x1p40); }, unlike_its_own_size},
      {kPlacesAndScales, "control points of 1e-41 below a scale of 1e36", "DenormalControlPoints",
       "The control points are denormal, so they hold four digits, and processors are often told to drop them.",
       "Denormal numbers stay on in all threads and kernels.", "denormal numbers taken for zero",
       "Bicubic.NormalsAreRightFromTinyToHugePatches", 0.05, "px",
       [] {
         Stage stage;
         scene::Primitive plate =
             patches(flat_patch({-900, -500, 0}, {1800, 0, 0}, {0, 1000, 0}), stage.flat({0.9f, 0.5f, 0.3f, 1}));
         FixedRandom random(3);
         for (Vec3& p : plate.vertices.positions) {
           p += random.in_box(150);
           for (int c = 0; c < 3; ++c) p[c] = p[c] * 0x1p-146f;  // 1e-41 and less
         }
         const int node = stage.add(plate);
         stage.node(node).transform.scale = DVec3(1e36);
         scene::Camera camera;
         camera.near = 1e-7f;
         stage.look({0, 0, 3e-5}, camera);
         stage.still();
         return stage;
       },
       off_its_place(VertexFault::kNoDenormals)},
      {kPlacesAndScales, "shear far away", "ShearFarAway", "A nearly singular matrix multiplies the rounding errors.",
       kDouble, "matrices of single precision", "By/MovedScene.LooksTheSameWhenItsNodesAreMoved", kGrid, "px",
       [] {
         Stage stage;
         const int node = stage.add(closed_patches(stage.flat({0.9f, 0.8f, 0.3f, 1})));
         stage.node(node).matrix = DMat4(DVec4(1, 0.9, 0, 0), DVec4(1, 1, 0, 0), DVec4(0, 0, 1, 0), DVec4(0, 0, 0, 1));
         stage.look({0, 0, 5});
         stage.still();
         return away(stage, {1e6, -7e5, 4e5});
       },
       off_its_place(VertexFault::kSingleMatrices)},
  };
}

}  // namespace

std::vector<StabilityCase> place_cases() {
  std::vector<StabilityCase> cases = far_cases();
  for (StabilityCase& of : scale_cases()) cases.push_back(std::move(of));
  return cases;
}

std::vector<StabilityCase> procedure_cases() {
  const auto procedure = [](shaders::ShapeId id, std::vector<float> numbers, const DVec3& at, const DVec3& eye,
                            bool turning) {
    Stage stage;
    scene::Procedure one;
    one.shape = id;
    one.pieces.resize(1);
    std::copy(numbers.begin(), numbers.end(), one.pieces[0].input.p.begin());
    scene::Material look;
    look.base_color = {0.3f, 0.7f, 0.9f, 1};
    look.metallic = 0;
    look.double_sided = true;
    one.material = stage.material(look);
    stage.capture.procedures.push_back(one);
    scene::Node node;
    node.transform.translation = at;
    node.procedure = 0;
    stage.capture.roots.push_back(0);
    stage.capture.nodes.push_back(node);
    if (turning) stage.turn(0, {0.3f, 1, 0.2f}, 0.4);
    stage.keys = {"procedures.path=tessellated"};
    stage.look(eye);
    if (!turning) stage.still();
    return stage;
  };
  using shaders::ShapeId;
  const auto singles = off_its_place(VertexFault::kSingleMatrices);
  return {
      {kProcedures, "sphere with poles, far away", "SpherePoles",
       "At a pole all of a side is one point without a normal.",
       "Stages are written once over a number type; neighbours lend a pole their normals.",
       "matrices of single precision", "Normals.APoleHasNoneOfItsOwnAndBorrowsItsNeighbours", 0.01, "px",
       [=] {
         return away(procedure(ShapeId::kSphere, {1}, {0, 0, 0}, {0, 0, 3.5}, false), {1e6, 2e6, -1e6});
       },
       singles},
      {kProcedures, "torus that turns", "TurningTorus", "The formula is evaluated anew at every time.",
       "A procedure moves by the same pieces as a mesh, measured at points of its formula.", "two motion keys",
       "HardProcedures.ASurfaceOfNoSizeIsAPointOrNothing", 0.26, "px",
       [=] {
         return procedure(ShapeId::kTorus, {1, 0.35f}, {0, 0, 0}, {0, 0, 4.5}, true);
       },
       [](const Stage& stage, bool twin) {
         Stage other = stage;
         if (twin) other.keys.emplace_back("sampling.motion_segments=1");
         return vertex_error(other);
       }},
      {kProcedures, "surface seen edge-on", "EdgeOn", "The footprint of a pixel is as long as the surface.",
       "Tessellation follows the longest line on screen, in single precision beside the camera.",
       "matrices of single precision", "HardProcedures.EdgeOnThereIsHardlyAnythingToSee", 0.01, "px",
       [=] {
         return away(procedure(ShapeId::kHeightField, {3, 3, 0.05f, 2, 3, 0.5f, 4}, {0, -0.15, 0}, {0, 0, 4}, false),
                     {1e6, 2e6, -1e6});
       },
       singles},
      {kProcedures, "surface across the camera", "AcrossTheCamera", "Half of it has w <= 0.",
       "Vertices behind the near plane stay homogeneous.", "matrices of single precision",
       "HardProcedures.AFloorThatStraddlesTheCameraReachesTheFrontOfTheImage", 0.05, "px",
       [=] {
         return away(procedure(ShapeId::kHeightField, {30, 30, 0.3f, 2, 3, 0.5f, 4}, {0, -1.2, 0}, {0, 0, 0}, false),
                     {1e6, 2e6, -1e6});
       },
       singles},
  };
}

}  // namespace tessera::replay::stability
