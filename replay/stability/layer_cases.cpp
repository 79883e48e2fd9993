#include <cmath>
#include <functional>

#include "replay/stability/case_tables.h"
#include "replay/stability/measures.h"

namespace tessera::replay::stability {
namespace {

struct Sheet {
  Vec4 color;
  scene::AlphaMode mode = scene::AlphaMode::kOpaque;
  int kind = 0;  // 0: two triangles, 1: a patch, 2: a fine grid of triangles
  double nearer = 0;
};
constexpr auto kSolid = scene::AlphaMode::kOpaque;
constexpr auto kBlend = scene::AlphaMode::kBlend;

// Sheets in one plane that is askew to the camera, in the scene's order, over all of the frame.
Stage in_one_plane(const std::vector<Sheet>& all, bool moving) {
  Stage stage;
  stage.capture.settings.background = Vec3(0.0f);
  for (const Sheet& one : all) {
    const int material = stage.flat(one.color, one.mode);
    scene::Primitive primitive = one.kind == 0   ? quad({-9, -6, 0}, {9, -6, 0}, {9, 6, 0}, {-9, 6, 0}, material)
                                 : one.kind == 1 ? patches(flat_patch({-9, -6, 0}, {18, 0, 0}, {0, 12, 0}), material)
                                                 : sheet(17, 13, {-9, -6}, {9, 6}, material);
    const int node = stage.add(primitive, {0, 0, one.nearer});
    stage.node(node).transform.rotation = glm::angleAxis(0.5, glm::normalize(DVec3(1, 2, 0)));
    if (moving) stage.move(node, {0.4, 0.1, 0.3});
  }
  stage.look({0, 0, 4});
  if (!moving) stage.still();
  return stage;
}

// One on the other in the scene's order, after the first that is opaque.
Vec3 composed(const std::vector<Sheet>& all) {
  DVec3 color(0.0);
  for (const Sheet& one : all)
    if (one.mode != kBlend) {
      color = DVec3(one.color);
      break;
    }
  for (const Sheet& one : all)
    if (one.mode == kBlend)
      color = color * (1 - static_cast<double>(one.color.w)) + DVec3(one.color) * static_cast<double>(one.color.w);
  return Vec3(color);
}

void bring_nearer(Stage& stage, int node) {
  stage.node(node).transform.translation.z += 0.01;
  for (scene::Animation& animation : stage.capture.animations)
    for (scene::AnimationChannel& channel : animation.channels)
      if (channel.node == node)
        for (std::size_t k = 2; k < channel.values.size(); k += 3) channel.values[k] += 0.01f;
}

constexpr Vec4 kRed(1, 0.25f, 0.125f, 1), kBlue(0.125f, 0.25f, 1, 1), kGreen(0.25f, 1, 0.25f, 0.5f);

StabilityCase layers(std::string_view name, std::string_view law, std::string_view hard, std::string_view kept,
                     std::string_view tests, double bound, const std::vector<Sheet>& all, bool moving) {
  return {kLayers,
          name,
          law,
          hard,
          kept,
          "its last sheet nearer by a hundredth, or gone",
          tests,
          bound,
          "ulp",
          [=] { return in_one_plane(all, moving); },
          [all](const Stage& stage, bool twin) {
            Stage machine = stage;
            // The last one is nearer where it should be hidden, gone where it should be seen.
            if (twin && all.back().mode == kBlend)
              machine.capture.materials.back().base_color.w = 0;
            else if (twin)
              bring_nearer(machine, static_cast<int>(all.size()) - 1);
            return steps_from(render(machine), composed(all), 1);
          }};
}

}  // namespace

std::vector<StabilityCase> layer_cases() {
  std::vector<Sheet> many;
  many.reserve(16);
  for (int k = 0; k < 16; ++k)
    many.push_back(
        {{static_cast<float>(k % 3) * 0.5f, static_cast<float>(k % 5) * 0.25f, 1 - static_cast<float>(k % 2), 0.3f},
         kBlend,
         0});
  constexpr std::string_view kPlane = "CoplanarSurfaces.AreSeenOneOnTheOther";
  std::vector<StabilityCase> cases = {
      layers("two opaque surfaces in one plane", "CoplanarOpaque", "Depths are equal, and the order of arrival shows.",
             "Between equal depths the lower number of the patch wins.",
             "TileCore.CoplanarSurfacesShowTheLowerNumberedPatch "
             "CoplanarPatches.WhereTwoMoveTogetherTheLowerNumberIsSeenWhateverTheOrderAndMethod",
             4, {{kRed}, {kBlue}}, false),
      layers("two opaque surfaces in one plane, in motion", "CoplanarOpaqueMoving",
             "Depths are equal at every time, if they are found alike.",
             "Depth is found by one formula in every kernel.", kPlane, 4, {{kRed}, {kBlue}}, true),
      layers("opaque surfaces 0.001 apart, cut differently", "NearlyCoplanarOpaque",
             "One is two triangles, the other a patch, so their depths round apart: in one plane each would show.",
             "Vertices round to 1/256 pixel: surfaces that are farther apart than depth changes over that keep their "
             "order.",
             "CoplanarSurfaces.AreSeenOneOnTheOther", 4, {{kRed, kSolid, 0}, {kBlue, kSolid, 1, -1e-3}}, false),
      layers("blended surface 0.001 before an opaque one, cut differently", "NearlyCoplanarBlended",
             "The opaque one is a patch, the blended one a grid of triangles.",
             "Vertices round to 1/256 pixel: surfaces that are farther apart than depth changes over that keep their "
             "order.",
             "CoplanarSurfaces.AreSeenOneOnTheOther", 4, {{kRed, kSolid, 1}, {kGreen, kBlend, 2, 1e-3}}, false),
      layers("blended surface in the plane of an opaque one", "CoplanarBlended",
             "It is drawn after the opaque one and is no nearer.",
             "Where depths are equal a blended surface lies on an opaque one.",
             "Blending.ABlendedSurfaceInThePlaneOfAnOpaqueOneIsSeenOnIt CoplanarSurfaces.AreSeenOneOnTheOther", 4,
             {{kRed}, {kGreen, kBlend}}, false),
      layers("blended below opaque in the scene's order, in motion", "CoplanarBlendedFirst",
             "The blended surface comes first, and the plane moves.",
             "Surfaces of equal depth keep the scene's order, not the order of arrival.", kPlane, 4,
             {{kGreen, kBlend}, {kRed}, {kGreen, kBlend}}, true),
      layers("sixteen coincident layers", "CoincidentLayers", "Sixteen blended layers have one depth.",
             "Layers of one depth are kept in the scene's order and merged from the far end.",
             "LayerMerger.TheOrderOfArrivalDoesNotMatter CoplanarSurfaces.AreSeenOneOnTheOther", 64, many, false),
  };
  return cases;
}

// ---- Resolve ----------------------------------------------------------------------------------------------------

namespace {

// A wall of one colour behind bars of another; the camera passes.
Stage passing(double way) {
  Stage stage;
  stage.capture.settings.background = Vec3(0.0f);
  stage.capture.settings.shutter_close = 0;
  stage.capture.settings.frame_rate = 30;
  stage.add(quad({-20, -20, 0}, {20, -20, 0}, {20, 20, 0}, {-20, 20, 0}, stage.flat({0.3f, 0.6f, 0.2f, 1})));
  const int camera = stage.look({0, 0, 4});
  if (way != 0) stage.move(camera, {way, 0, 0});
  stage.keys = {"resolve.desampling=adaptive"};
  stage.frame = 6;
  return stage;
}

// The twin's wall has two colours.
double unlike_its_color(const Stage& stage, bool twin) {
  Stage machine = stage;
  if (twin)
    machine.add(
        quad({0, 0, 0.5f}, {0.4f, 0, 0.5f}, {0.4f, 0.4f, 0.5f}, {0, 0.4f, 0.5f}, machine.flat({0.31f, 0.6f, 0.2f, 1})));
  return steps_from(render(machine), {0.3f, 0.6f, 0.2f}, 1);
}

}  // namespace

std::vector<StabilityCase> resolve_cases() {
  return {
      {kResolve, "one colour, camera at rest", "FlatAtRest", "Seven frames of copies add up their errors.",
       "A velocity of zero copies bits.", "a second colour that differs by a thirtieth",
       "Advection.StandingStillIsACopyBitForBit Desampling.ErrorsOfAdvectionDoNotGrowOver120Frames", 4, "ulp",
       [] { return passing(0); }, unlike_its_color},
      {kResolve, "one colour, camera in motion", "FlatInMotion", "Weights of a stencil add up to almost one.",
       "Weights are quantised so that their sum is a power of two.", "a second colour that differs by a thirtieth",
       "CubicStencil.AFlatColourComesBackToOneUnitInTheLastPlace "
       "CubicStencil.AFlatColourUnderThePatternsIsExactToAUnitAndAPlainQuotientIsNot",
       4, "ulp", [] { return passing(9); }, unlike_its_color},
      {kResolve, "blocks that the frame cuts", "CutBlocks", "Pixels outside of the frame count as black.",
       "Blocks are clipped, and stencils know every pixel that is missing.",
       "a second colour that differs by a thirtieth",
       "Desampling.FramesAndRegionsThatCutBlocksAreWhole "
       "StencilTables.EveryMissingPixelOfEveryPatternAtEveryBorderHasAStencil",
       4, "ulp",
       [] {
         Stage stage = passing(9);
         stage.width = 157, stage.height = 83;
         return stage;
       },
       unlike_its_color},
  };
}

}  // namespace tessera::replay::stability
