#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "replay/stability/case_tables.h"
#include "replay/stability/measures.h"

namespace tessera::replay::stability {
namespace {

using Keys = std::vector<std::string>;

Stage with(Stage stage, const Keys& keys) {
  stage.keys.insert(stage.keys.end(), keys.begin(), keys.end());
  return stage;
}

// The scene rendered with other settings must have the same bits. The twin lacks the first drawable.
std::function<double(const Stage&, bool)> same_with(const Keys& keys) {
  return [keys](const Stage& stage, bool twin) {
    Stage other = with(stage, keys);
    if (twin) other.node(other.capture.roots.front()).mesh = scene::kNone;
    return different_pixels(render(stage), render(other));
  };
}

// One of seven colours: 0 or 1 in each channel.
Vec4 bright(int k) {
  const int bits = k % 7 + 1;
  return {static_cast<float>(bits & 1), static_cast<float>((bits >> 1) & 1), static_cast<float>((bits >> 2) & 1), 1};
}

// Quads whose sides lie on borders of tiles and in the corners of four.
Stage on_the_borders() {
  Stage stage;
  stage.width = 160, stage.height = 96;
  int k = 0;
  for (int j = 0; j < 6; ++j)
    for (int i = 0; i < 10; i += 2) {
      const float x = 16.0f * static_cast<float>(i + j % 2) - 80, y = 16.0f * static_cast<float>(j) - 48;
      stage.add(quad({x, y, 0}, {x + 16, y, 0}, {x + 16, y + 16, 0}, {x, y + 16, 0}, stage.flat(bright(k++))));
    }
  stage.look_flat();
  stage.still();
  return stage;
}

// A body that turns through the frame, displaced and out of focus.
Stage busy() {
  Stage stage;
  const int body = stage.add(closed_patches(stage.displaced(0.2f, 0)), {-0.5, 0, 0});
  stage.turn(body, {0.1f, 1, 0.2f}, 0.15);
  stage.move(stage.add(sheet(12, 8, {0, -1}, {2, 1}, stage.flat(bright(1)))), {-0.5, 0.2, 0.3});
  scene::Camera camera;
  camera.lens = {0.05f, 4.0f};
  stage.look({0.3, 0.2, 4}, camera);
  return stage;
}

}  // namespace

std::vector<StabilityCase> binning_cases() {
  constexpr std::string_view kNoList = "lists without one drawable";
  const Keys small_tiles = {"tile.width=16", "tile.height=16"};
  return {
      {kBinning, "sides that lie on borders of tiles", "SidesOnBorders",
       "The sample on the border belongs to the neighbour.", "Bounds and tiles are closed on both sides.", kNoList,
       "TileGrid.BoundsThatEndOnATilesEdgeBelongToBothTiles "
       "ExactCoverage.ATileTouchedInItsCornerOnlyIsCoveredAndOneAHairAwayIsNot",
       0, "pixels", on_the_borders, same_with(small_tiles)},
      {kBinning, "off screen on any side", "OffScreen", "Negative numbers of tiles wrap round.",
       "Bounds are clamped to the frame in double precision before they become numbers.", "one that is in the frame",
       "HardCases.OffScreenOnAnySideGivesNoEntryAtAnyLevel "
       "TileGrid.BoundsOutsideOnAnySideCoverNothingAndHugeOnesEverything",
       0, "pixels",
       [] {
         Stage stage;
         stage.add(closed_patches(stage.flat(bright(2))));
         stage.look({0, 0, 4});
         stage.still();
         return stage;
       },
       [](const Stage& stage, bool twin) {
         Stage other = stage;
         for (const double far : {3.0, 40.0, 1e4, 1e7, 1e12})
           for (const auto& [x, y] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}})
             other.add(closed_patches(other.flat(bright(0))), DVec3(x, y, 0) * (far + 3));
         if (twin) other.add(closed_patches(other.flat(bright(0))), DVec3(1.2, 0, 0));
         return different_pixels(render(stage), render(other));
       }},
      {kBinning, "frame of no multiple of a tile", "OddFrame", "Pixels of the last tiles lie outside of the frame.",
       "Tiles are clipped by the frame.", kNoList,
       "HardCases.FramesOfOnePixelAndOfNoMultipleOfATile OddFrames.OnePixelAndSizesThatNoTileDividesWork", 0, "pixels",
       [] {
         Stage stage = busy();
         stage.width = 157, stage.height = 83;
         return stage;
       },
       same_with(small_tiles)},
      {kBinning, "any size of tile", "TileSizes", "A surface that is binned twice may be drawn twice, or differently.",
       "Binning decides which work is done, never its result.", kNoList,
       "Captures/ShippedCapture.TilesQueuesAndBuffersNeverChangeTheImage", 0, "pixels", busy,
       same_with({"tile.width=64", "tile.height=64"})},
      {kBinning, "buffer full within the frame", "BufferFull", "Entries are lost, or layers change their order.",
       "A full buffer refuses entries, and its contents are rendered first: a partial render, whose "
       "tiles go on later.",
       kNoList, "PartialRender.IsCountedAndLosesNothing ParameterBuffer.PB1FullItRefusesAndKeepsAcceptedEntries", 0,
       "pixels", busy, same_with({"parameter_buffer.bytes=4096"})},
      {kBinning, "sub-patches of few cells", "DeepSplits", "Cuts move vertices, and neighbours crack.",
       "A sub-patch is a range of the base patch's grid, so that cutting moves no vertex.", kNoList,
       "Continuity.SplitLevelsDoNotShow Tessellator.CuttingAPatchNeverMovesAVertex", 0, "pixels", busy,
       same_with({"frontend.split_depth=4", "frontend.split_pixels=4"})},
      {kBinning, "lists of several levels", "ListLevels", "A patch is in a list of a level and of the one below.",
       "Each tile gets its sub-patches once, level by level.", kNoList,
       "HardCases.LevelsOfQueuesAndPartialRendersGiveEveryTileItsSubPatchesOnce", 0, "pixels", busy,
       same_with({"binner.queue_levels=3"})},
      {kBinning, "motion that touches a tile for a moment", "TouchesForAMoment",
       "The time at which a side is reached is rounded, and a sample at that time is lost.",
       "Distances shrink by their own error before times are solved for.", kNoList,
       "TouchingTimes.NeverMissATimeAtWhichTheBoxTouchesHoweverSlowTheMotion TouchingTimes.ANaiveSolveIsCaught", 0,
       "pixels",
       [] {
         Stage stage;
         for (int k = 0; k < 12; ++k) {
           const float x = 12.0f * static_cast<float>(k) - 70;
           const int node =
               stage.add(quad({x, -30, 0}, {x + 6, -30, 0}, {x + 6, 30, 0}, {x, 30, 0}, stage.flat(bright(k))));
           stage.move(node, {std::ldexp(1.0, k) * 0.06, -0.7 * k, 0});
         }
         stage.look_flat();
         return stage;
       },
       same_with({"tile.width=16", "tile.height=16", "tilecore.visibility_method=brute"})},
  };
}

// ---- Visibility -------------------------------------------------------------------------------------------------

namespace {

// Against double precision with the machine's samples; the twin's scene is broken by `fault`.
std::function<double(const Stage&, bool)> seen_wrongly(const std::function<void(Stage&)>& fault) {
  return [fault](const Stage& stage, bool twin) {
    Stage machine = stage;
    if (twin) fault(machine);
    return wrong_samples(machine, stage);
  };
}

void move_the_camera(Stage& stage) { stage.node(stage.capture.roots.back()).transform.translation.x += 0.01; }

// One of the middle of a sheet of 52 rows.
void lose_a_triangle(Stage& stage) {
  auto& indices = stage.capture.meshes.front().primitives.front().indices;
  const std::size_t cells = indices.size() / 6, columns = cells / 52;
  const auto lost = indices.begin() + static_cast<std::ptrdiff_t>(6 * (cells / 2 + columns / 2));
  indices.erase(lost, lost + 3);
}

std::function<double(const Stage&, bool)> covers_once(float value) {
  return [value](const Stage& stage, bool twin) {
    Stage machine = stage;
    if (twin) lose_a_triangle(machine);
    return samples_unlike(machine, value);
  };
}

// A sheet of cells of 2 x 2 pixels over the whole frame, with its vertices in the middle of pixels, as the samples are.
// A moving sheet travels 512 pixels, that is an odd number of pixels at the time of every sample.
Stage sheet_of_ties(bool moving) {
  constexpr int kWay = 512;
  Stage stage;
  stage.capture.settings.background = Vec3(0.0f);
  const int columns = moving ? 92 + kWay / 2 : 92;
  const float left = moving ? -92.5f - kWay : -92.5f;
  const int node = stage.add(
      sheet(columns, 52, {left, -52.5f}, {91.5f, 51.5f}, stage.flat({1, 1, 1, 0.5f}, scene::AlphaMode::kBlend)));
  if (moving) stage.move(node, {kWay, 0, 0});
  stage.look_flat();
  if (!moving) stage.still();
  stage.keys = {"sampling.samples_per_pixel=1"};
  return stage;
}

// Inside of a displaced ball that moves and turns, out of focus.
Stage inside_a_ball() {
  Stage stage;
  stage.capture.settings.background = Vec3(0.0f);
  const int material = stage.displaced(0.3f, -0.1f);
  auto& look = stage.capture.materials[static_cast<std::size_t>(material)];
  look.unlit = true;
  look.base_color = Vec4(1.0f);
  const int body = stage.add(closed_patches(material));
  stage.turn(body, {0.2f, 0.3f, 1}, 0.1);
  stage.move(body, {0.1, 0.05, -0.1});
  scene::Camera camera;
  camera.vertical_fov = 1.6f;
  camera.near = 0.03f;
  camera.lens = {0.03f, 1.0f};
  stage.look({0.1, 0.15, 0.1}, camera);
  return stage;
}

Stage crowd(int count, float size, bool moving) {
  Stage stage;
  FixedRandom random(7);
  for (int k = 0; k < count; ++k) {
    const Vec3 middle = random.in_box(1.4f);
    const Vec3 a = middle + random.in_box(size), b = middle + random.in_box(size), c = middle + random.in_box(size);
    const int node = stage.add(triangles({a, b, c}, {0, 1, 2}, stage.flat(bright(k))));
    if (moving) stage.move(node, DVec3(random.in_box(0.4f)));
  }
  stage.look({0, 0, 4});
  if (!moving) stage.still();
  stage.capture.settings.background = Vec3(0.0f);
  return stage;
}

constexpr std::string_view kOther = "a camera that is off by a hundredth of a unit";
constexpr double kShare = 400;  // ppm: samples beside edges, which lie on a grid of 1/256 pixel

std::vector<StabilityCase> edge_cases() {
  const auto off_by_a_hundredth = seen_wrongly(move_the_camera);
  return {
      {kVisibility, "samples on shared edges and vertices", "TiesAtRest",
       "A sample on an edge hits both triangles, or none.",
       "Edge functions have exact signs, and ties are broken symbolically (Edelsbrunner and Mücke 1990).",
       "a sheet without one triangle",
       "HardCases.SamplesOnSharedEdgesAndVerticesAreHitOnceAtEveryTime "
       "TriangleTest.ANaiveClosedTestCountsSharedEdgesTwiceAndIsCaught",
       0, "samples", [] { return sheet_of_ties(false); }, covers_once(0.5f)},
      {kVisibility, "shared edges in motion", "TiesInMotion", "Edges pass over samples at the samples' own times.",
       "The inside test is exact at the time of each sample.", "a sheet without one triangle",
       "HardCases.SamplesOnSharedEdgesAndVerticesAreHitOnceAtShutterOpenAndAtTheLastTime "
       "HardCases.ASheetWithoutOneCellIsCaughtByTheCount",
       0, "samples", [] { return sheet_of_ties(true); }, covers_once(0.5f)},
      {kVisibility, "closed surface from inside", "ClosedSurface",
       "Displaced, moving and out of focus, any crack shows the background.",
       "Each patch has one grid; a shared edge has one owner, which evaluates its vertices.",
       "a surface without one patch",
       "ClosedSurface.MovingAndDefocusedItNeverShowsTheBackgroundWhateverTheMethod "
       "Tessellator.WithoutOwnersDisplacedEdgesWouldCrack",
       0, "samples", inside_a_ball,
       [](const Stage& stage, bool twin) {
         Stage machine = stage;
         auto& vertices = machine.capture.meshes[0].primitives[0].vertices;
         if (twin)  // the patch that the camera looks at
           vertices.positions.erase(vertices.positions.begin() + 64, vertices.positions.begin() + 80),
               vertices.texcoords[0].erase(vertices.texcoords[0].begin() + 64, vertices.texcoords[0].begin() + 80);
         return samples_unlike(machine, 1);
       }},
      {kVisibility, "triangle that is degenerate at one time", "DegenerateOnce",
       "Its area is zero then, and hits divide by it.", "Signs are tested first: no area holds no sample.", kOther,
       "HardCases.ATriangleThatIsDegenerateAtOneTimeOnlyHoldsNothingThenAndIsExactBeforeAndAfter", kShare, "ppm",
       [] {
         Stage stage;
         scene::Primitive one =
             triangles({{-1, -0.8f, 0}, {1.2f, -0.6f, 0.2f}, {0.1f, 1, 0}}, {0, 1, 2}, stage.flat(bright(0)));
         scene::MorphTarget target;
         target.positions = {Vec3(0), Vec3(0), Vec3(0, -3.4f, 0.3f)};
         one.vertices.morph_targets.push_back(target);
         stage.morph(stage.add(one));
         stage.look({0, 0, 4});
         stage.capture.settings.background = Vec3(0.0f);
         stage.keys = {"sampling.samples_per_pixel=16"};
         return stage;
       },
       off_by_a_hundredth},
      {kVisibility, "random triangles in motion", "Crowd", "Everything intersects everything at other times.",
       "Depth is found at the sample's time from an exact inside test.", kOther,
       "HardCases.HitsEqualDoublePrecisionUnderAllEffects RandomScenes.AHundredOfThemAreTheSameByEveryMethod", 1500,
       "ppm", [] { return crowd(60, 0.6f, true); }, off_by_a_hundredth},
      {kVisibility, "needles thinner than a sub-pixel", "Needles", "A corner that rounds turns a needle inside out.",
       "Corners are rounded once, to the grid; a triangle without area there holds no sample.", kOther,
       "TriangleTest.DegenerateTrianglesHoldNothing "
       "VisibilityMethods.AgreeOnTrianglesThatDegenerateOrFlipWithinTheShutter",
       kShare, "ppm",
       [] {
         Stage stage;
         FixedRandom random(9);
         for (int k = 0; k < 60; ++k) {
           const Vec3 a = random.in_box(1.4f), b = random.in_box(1.4f);
           stage.add(triangles({a, b, b + random.in_box(1e-3f)}, {0, 1, 2}, stage.flat(bright(k))));
         }
         stage.look({0, 0, 4});
         stage.still();
         stage.capture.settings.background = Vec3(0.0f);
         stage.keys = {"sampling.samples_per_pixel=16"};
         return stage;
       },
       off_by_a_hundredth},
  };
}

std::vector<StabilityCase> depth_cases() {
  const auto off_by_a_hundredth = seen_wrongly(move_the_camera);
  return {
      {kVisibility, "wall that passes through the camera", "ThroughTheCamera", "Points with w <= 0 are projected.",
       "Cells with a vertex behind the near plane are tested in homogeneous coordinates (Olano and Greer 1997).",
       kOther,
       "CameraPlane.AWallThatPassesThroughItIsSeenExactlyUntilItReachesTheNearPlane "
       "ClippedCells.AFloorThatPassesUnderTheCameraHasNoHole",
       kShare, "ppm",
       [] {
         Stage stage;
         for (int k = 0; k < 4; ++k) {
           const float x = static_cast<float>(k) - 2;
           const int node =
               stage.add(quad({x, -1, -3}, {x + 1, -1, -3}, {x + 1, 1, 1}, {x, 1, 1}, stage.flat(bright(k))));
           stage.move(node, {0.2, 0.1, 3.5});
         }
         stage.look({0, 0, 0.5});
         stage.capture.settings.background = Vec3(0.0f);
         return stage;
       },
       off_by_a_hundredth},
      {kVisibility, "motion of whole screens", "WholeScreens", "Fixed-point positions overflow.",
       "Positions are floats in a guard band of 16384 pixels, edge functions exact in double precision.",
       "motion that is a hundredth faster", "HardCases.MotionOfWholeScreensIsExact", kShare, "ppm",
       [] {
         Stage stage;
         for (int k = 0; k < 6; ++k) {
           const float y = 14.0f * static_cast<float>(k) - 40;
           const int node = stage.add(
               quad({-4000, y, 0}, {-2600, y, 0}, {-2600, y + 10, 0}, {-4000, y + 10, 0}, stage.flat(bright(k))));
           stage.move(node, {6000.0 + 300 * k, 20, 0});
         }
         stage.look_flat();
         stage.capture.settings.background = Vec3(0.0f);
         return stage;
       },
       seen_wrongly([](Stage& stage) {
         for (auto& channel : stage.capture.animations[0].channels) channel.values[3] *= 1.01f;
       })},
      {kVisibility, "lens of radius 0", "LensOfRadius0",
       "It takes other kernels, with other roundings, than a pinhole.",
       "A lens point of zero leaves every number as it is.", "a lens of a thousandth",
       "VisibilityMethods.ALensOfRadius0IsAPinholeBitByBit "
       "RayPath.WithoutMotionAndWithALensOfRadiusZeroItEqualsTheRasterPathBitByBit",
       0, "pixels", [] { return crowd(40, 0.6f, true); },
       [](const Stage& stage, bool twin) {
         Stage lens = stage;
         lens.capture.cameras[0].lens = {twin ? 1e-3f : 0.0f, 3.0f};
         lens.keys.emplace_back("effects.defocus=on");
         return different_pixels(render(stage), render(lens));
       }},
      {kVisibility, "focus at infinity", "FocusAtInfinity", "1 / infinity, and infinity times zero.",
       "The inverse of the distance is stored.", "focus at 100 units", "HardCases.FocusAtInfinityIsExact", 1500, "ppm",
       [] {
         Stage stage = crowd(40, 0.6f, false);
         stage.capture.cameras[0].lens = {0.05f, std::numeric_limits<float>::infinity()};
         return stage;
       },
       seen_wrongly([](Stage& stage) { stage.capture.cameras[0].lens.focus_distance = 100; })},
      {kVisibility, "surfaces that near and far plane cut", "CutByPlanes", "Hits at a plane are in or out by chance.",
       "Hits on both planes are drawn.", "a far plane a hundredth nearer",
       "HardCases.HitsAtTheNearAndTheFarPlaneAreExact", 1500, "ppm",
       [] {
         Stage stage = crowd(60, 0.9f, true);
         stage.capture.cameras[0].near = 3.7f;
         stage.capture.cameras[0].far = 4.3f;
         return stage;
       },
       seen_wrongly([](Stage& stage) { stage.capture.cameras[0].far = 4.29f; })},
      {kVisibility, "floor towards the horizon", "Horizon", "Depth runs to the end of its range in a few pixels.",
       "Depth stays linear in the scene and is not divided by w, and there need be no far plane.", kOther,
       "ClippedCells.AFloorThatPassesUnderTheCameraHasNoHole", kShare, "ppm",
       [] {
         Stage stage;
         for (int k = 0; k < 10; ++k) {
           const float z = -std::ldexp(1.0f, 2 * k) + 1, far = -std::ldexp(1.0f, 2 * k + 2) + 1;
           stage.add(quad({far, -1, z}, {-far, -1, z}, {-far, -1, far}, {far, -1, far}, stage.flat(bright(k))));
         }
         stage.look({0, 0, 1});
         stage.still();
         stage.capture.settings.background = Vec3(0.0f);
         return stage;
       },
       seen_wrongly([](Stage& stage) { stage.node(stage.capture.roots.back()).transform.translation.y += 0.01; })},
  };
}

}  // namespace

std::vector<StabilityCase> visibility_cases() {
  std::vector<StabilityCase> cases = edge_cases();
  for (StabilityCase& of : depth_cases()) cases.push_back(std::move(of));
  return cases;
}

}  // namespace tessera::replay::stability
