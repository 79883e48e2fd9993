#include <algorithm>
#include <functional>

#include "replay/stability/case_tables.h"
#include "replay/stability/measures.h"

namespace tessera::replay::stability {
namespace {

// The properties that make a pair of patches hard.
struct HardPair {
  std::function<void(std::vector<Vec3>&)> bend = [](std::vector<Vec3>&) {};  // of the 16 control points
  float scale = 1;  // of all lengths: patch, displacement, motion, camera and lens
  float strength = 0.35f, bias = 0.1f;
  double reach = 1.0;   // of the motion
  double distance = 4;  // of the camera
  float focus = 3;
  bool moving = true, opposite = false, zero_scale = false, even = false;
};

// Two patches that share an edge: displaced, deforming, moving, and seen through a lens.
Stage pair_of_patches(const HardPair& hard) {
  FixedRandom random(11);
  Stage stage;
  const int material = stage.displaced(hard.strength * hard.scale, hard.bias * hard.scale);
  if (hard.even) {
    auto& displacement = *stage.capture.materials[static_cast<std::size_t>(material)].displacement;
    displacement.texture = std::make_shared<shaders::ScalarTexture>(1, 1, std::vector<float>{1.0f});
  }
  const auto net = [&](float x) {
    std::vector<Vec3> c = flat_patch({x, -1, 0}, {2, 0, 0}, {0, 2, 0});
    for (Vec3& p : c) p += random.in_box(0.35f);
    hard.bend(c);
    for (Vec3& p : c) p *= hard.scale;
    return c;
  };
  std::vector<Vec3> points = net(-1.6f), second = net(0.2f);
  for (std::size_t j = 0; j < 4; ++j) second[4 * j] = points[4 * j + 3];
  points.insert(points.end(), second.begin(), second.end());
  scene::Primitive primitive = patches(points, material);
  scene::MorphTarget target;
  for (std::size_t k = 0; k < points.size(); ++k) target.positions.push_back(random.in_box(0.15f * hard.scale));
  if (hard.opposite) {
    target.positions[0] = Vec3(1.5f, 0, 0);
    target.positions[15] = Vec3(-1.5f, 0, 0);
  }
  for (std::size_t j = 0; j < 4; ++j) target.positions[16 + 4 * j] = target.positions[4 * j + 3];
  primitive.vertices.morph_targets.push_back(target);
  const int node = stage.add(primitive);
  if (hard.zero_scale) stage.node(node).transform.scale = DVec3(1, 0, 1);
  if (hard.moving) {
    stage.move(node, DVec3(0.6, 0.25, 0.4) * hard.reach * static_cast<double>(hard.scale));
    stage.morph(node);
  } else {
    stage.still();
  }
  scene::Camera camera;
  camera.near = 0.05f * hard.scale;
  camera.lens = {0.03f * hard.scale, hard.focus * hard.scale};
  const DVec3 middle(0.5 * (DVec3(points[5]) + DVec3(points[26])));
  stage.look(middle + DVec3(0.1, 0.2, hard.distance) * static_cast<double>(hard.scale), camera);
  stage.keys = {"sampling.motion_segments=1"};
  return stage;
}

std::function<double(const Stage&, bool)> sticks_out(BoundFault fault) {
  return [fault](const Stage& stage, bool twin) { return overhang(stage, twin ? fault : BoundFault::kNone); };
}

struct BoundRow {
  std::string_view name, law, hard, kept, twin, tests;
  BoundFault fault;
  std::function<Stage()> scene;
};

std::function<Stage()> pair(const HardPair& hard) {
  return [hard] { return pair_of_patches(hard); };
}

#define HELD(kind) "HardCase/SubPatchBounds.HoldEveryPointOfTheDisplacedMovingDefocusedPatch/" kind "_"

std::vector<BoundRow> hard_nets() {
  return {
      {"pole", "Pole", "An edge is one point, so the tangent along it is zero and the normal 0/0.",
       "Such patches get no normal cone, and the domain shader takes the limit of the normal from inside the patch.",
       "bounds half as wide", HELD("Pole") " Bicubic.AtAPoleTheNormalIsTheLimitFromInside", BoundFault::kShrunk,
       pair({.bend = [](auto& c) { std::fill(c.begin() + 12, c.end(), c[12]); }})},
      {"all control points equal", "AllPointsEqual", "The box has no axes and the surface no normal.",
       "The box takes the object's axes, and a fixed finite normal stands in.", "bounds without displacement",
       HELD("AllPointsEqual") " Bicubic.APatchThatIsOnePointHasAFiniteNormal", BoundFault::kNoDisplacement,
       pair({.bend = [](auto& c) { std::fill(c.begin(), c.end(), c[0]); }})},
      {"folded patch", "Folded", "Normals point both ways, so a cone around their mean misses the fold.",
       "A cone is used only where tangent cones and their mirror images stay apart (Munkberg et al. 2010).",
       "bounds without displacement", HELD("Folded") " Npatch.ContainsEveryNormalAndIsNeverLooserThanTpatch",
       BoundFault::kNoDisplacement, pair({.bend = [](auto& c) { std::swap(c[5], c[10]); }})},
      {"tangents nearly parallel", "ParallelTangents",
       "The published cone of normals is too narrow where the tangents' angle leaves 90 degrees.",
       "The magnitude of the cosine is taken, and the cone widened by the rounding of the derivatives.",
       "bounds without displacement", HELD("NearlyParallelTangents") " Tpatch.ThePublishedSignOfTheCosineIsCaught",
       BoundFault::kNoDisplacement,
       pair({.bend =
                 [](auto& c) {
                   for (Vec3& p : c) p = Vec3(p.x + p.y, 1e-4f * p.y, 0.02f * p.z);
                 }})},
      {"huge coordinates, 1e6", "HugeCoordinates", "Rounding grows with the coordinate, to a sixteenth of a unit.",
       "Boxes grow by a bound of all roundings of the domain shader, in relative terms (Higham 2002, section 3.1).",
       "bounds without motion", HELD("HugeCoordinates"), BoundFault::kNoMotion, pair({.scale = 1e6f})},
      {"tiny coordinates, 1e-6", "TinyCoordinates", "An absolute epsilon is larger than the patch.",
       "No epsilon is absolute, and denormal numbers stay on.", "bounds without motion",
       HELD("TinyCoordinates") " Bicubic.NormalsAreRightFromTinyToHugePatches", BoundFault::kNoMotion,
       pair({.scale = 1e-6f})},
      {"small patch far from the origin", "FarFromTheOrigin",
       "Differences of control points cancel, and with them the tangents.",
       "Derivatives carry the error of the differences into the cone.", "bounds without motion",
       HELD("FarFromTheOrigin"), BoundFault::kNoMotion,
       pair({.bend =
                 [](auto& c) {
                   for (Vec3& p : c) p += Vec3(1e4f, -2e4f, 5e3f);
                 },
             .reach = 6})},
  };
}

std::vector<BoundRow> hard_views() {
  return {
      {"displacement larger than the patch, downwards", "BigDisplacement",
       "A negative scale swaps the ends of the interval of heights.",
       "The least and the greatest of all four products of heights and normals are taken (Moore 1966).",
       "bounds without displacement",
       HELD("DisplacementLargerThanThePatch") " SubPatchBoundsTwin.ABoundThatForgetsDisplacementIsCaught",
       BoundFault::kNoDisplacement, pair({.strength = -3, .distance = 8})},
      {"height map of one value", "FlatTexture", "The interval of heights is one number, and its pyramid one level.",
       "The pyramid of least and greatest heights answers for any footprint, rounding included.",
       "bounds without displacement", HELD("FlatTexture") " MinMaxPyramid.OneTexelIsItsOwnRangeEverywhere",
       BoundFault::kNoDisplacement, pair({.even = true})},
      {"patch across the camera plane", "CrossingTheCameraPlane", "Points with w <= 0 project to the wrong side.",
       "The hull is cut at the near plane before it is projected (Blinn and Newell 1978); else it is the whole frame.",
       "bounds that project points behind the camera",
       HELD("CrossingTheCameraPlane") " ScreenBounds.BoxesThatMoveLinearlyOnScreenAreCaught", BoundFault::kNotCut,
       pair({.distance = 0.5})},
      {"camera inside the box", "CameraInside", "No side of the box bounds its image.",
       "A box that holds the eye is cut at the near plane and else covers the whole frame.",
       "bounds that project points behind the camera", HELD("CameraInside"), BoundFault::kNotCut,
       pair({.strength = 0.1f, .bias = 0, .distance = 0.25})},
      {"nothing moves", "NoMotion", "Times of contact are 0/0.",
       "A box at rest touches at all times, and its bounds are the bounds of one key.", "bounds half as wide",
       HELD("NoMotion") " TimeIntervals.StillBoxesHaveAllTimes", BoundFault::kShrunk, pair({.moving = false})},
      {"motion larger than the screen", "MotionLargerThanTheScreen",
       "The patch is off the screen at both motion keys and crosses it in between.",
       "Bounds are the hull over the whole shutter; tiles clip it.", "bounds without motion",
       HELD("MotionLargerThanTheScreen"), BoundFault::kNoMotion, pair({.reach = 40})},
      {"opposite motion at two corners", "OppositeMotion", "A box that moves as one fits neither motion key.",
       "One frame of axes, and extents of their own at each key.", "bounds without motion",
       HELD("OppositeMotionAtTwoCorners"), BoundFault::kNoMotion, pair({.opposite = true})},
      {"scale 0", "ZeroScale", "The matrix has no inverse, so normals cannot be transformed by it.",
       "The displaced surface is made in the object's space, and normals follow from tangents.",
       "bounds without motion", HELD("ZeroScale") " OddFrames.DegenerateTransformsAndPatchesDrawNothingAndBreakNothing",
       BoundFault::kNoMotion, pair({.zero_scale = true})},
      {"focus inside the box", "FocusInside",
       "The circle of confusion is least inside, so neither end bounds it alone.",
       "Bounds grow by the larger circle of both ends of the depth range.", "bounds without the lens",
       "ScreenBounds.AFocusDistanceInsideTheBoxGrowsByItsFartherEnd ScreenBounds.BoundsThatForgetTheLensAreCaught",
       BoundFault::kNoLens, pair({.strength = 0, .bias = 0, .distance = 2, .focus = 2})},
      {"footprint that wraps", "WrappingFootprint",
       "Texture coordinates leave [0, 1] and come back at the other side of the height map.",
       "Footprints are wrapped texel by texel, the filter's texels included.", "bounds without displacement",
       "MinMaxPyramid.HoldsEveryFilteredValueOfAFootprintAtAnyLevelAndWrap "
       "MinMaxPyramid.AQueryThatForgetsTheFiltersFootprintIsCaught",
       BoundFault::kNoDisplacement,
       [] {
         Stage stage = pair_of_patches({});
         for (Vec2& place : stage.capture.meshes[0].primitives[0].vertices.texcoords[0])
           place = place * 1.7f + Vec2(0.8f, -2.4f);
         return stage;
       }},
  };
}

#undef HELD

}  // namespace

std::vector<StabilityCase> bound_cases() {
  std::vector<BoundRow> rows = hard_nets();
  for (BoundRow& row : hard_views()) rows.push_back(std::move(row));
  std::vector<StabilityCase> cases;
  cases.reserve(rows.size());
  for (const BoundRow& row : rows)
    cases.push_back({kBounds, row.name, row.law, row.hard, row.kept, row.twin, row.tests, 0, "px", row.scene,
                     sticks_out(row.fault)});
  return cases;
}

}  // namespace tessera::replay::stability
