#include <functional>

#include "replay/stability/case_tables.h"
#include "replay/stability/measures.h"

namespace tessera::replay::stability {
namespace {

using scene::AnimatedPath;

// FrameRequest::motion_error, and half the diagonal of a step of the sub-pixel grid.
constexpr double kCurve = 0.25 + 0.003, kLine = 0.01;

// A blade that is 40 pixels long.
scene::Primitive blade(int material) { return quad({0, -4, 0}, {40, -4, 0}, {40, 4, 0}, {0, 4, 0}, material); }

Stage flat_stage(const std::function<void(Stage&, int material)>& fill) {
  Stage stage;
  fill(stage, stage.flat({1, 0.7f, 0.2f, 1}));
  stage.look_flat();
  return stage;
}

// A displaced ball; the highest texel is a spike half as long as the ball's radius.
int spiked(Stage& stage) {
  const int material = stage.displaced(0.5f, 0);
  std::vector<float> heights(64, 0.0f);
  heights[27] = heights[36] = 1;
  stage.capture.materials[static_cast<std::size_t>(material)].displacement->texture =
      std::make_shared<shaders::ScalarTexture>(8, 8, heights);
  return material;
}

// Reduces the motion to two keys.
Stage with_two_keys(Stage stage) {
  stage.keys.emplace_back("sampling.motion_segments=1");
  return stage;
}

// Motion against the curve itself; the twin has two motion keys.
double off_the_curve(const Stage& stage, bool twin) { return vertex_error(twin ? with_two_keys(stage) : stage); }

struct MotionRow {
  std::string_view name, law, hard, kept, tests;
  double bound;
  std::function<Stage()> scene;
};

constexpr std::string_view kSegments =
    "The shutter is cut into straight pieces whose chords a bound of the curve's second derivative keeps within a "
    "quarter of a pixel (de Boor 1978).";
constexpr std::string_view kKeys =
    "Every key of an animation inside the shutter is the end of a piece, where it matters.";

std::vector<MotionRow> node_curves() {
  return {
      {"one turn", "OneTurn", "Both motion keys show the same place, so nothing seems to move.", kSegments,
       "MotionSegments.ABladeThatTurnsCoversItsArea MotionSegments.FullTurnsCountAsMotion", kCurve,
       [] { return flat_stage([](Stage& s, int m) {
              s.turn(s.add(blade(m)), {0, 0, 1}, 1);
            }); }},
      {"five turns", "FiveTurns", "The blade passes every place five times, each time by another phase.",
       "sampling.motion_segments_max allows as many pieces as the bound asks for, up to 2048.",
       "RepeatedMotion.IsBlurredHoweverOftenItRepeats RepeatedMotion.ThePlanKeepsItsPromiseOfTheError", kCurve,
       [] {
         Stage stage = flat_stage([](Stage& s, int m) { s.turn(s.add(blade(m)), {0, 0, 1}, 5); });
         stage.keys = {"sampling.motion_segments_max=2048"};
         return stage;
       }},
      {"there and back three times", "ThereAndBack", "Where it turns round lies between the motion keys.", kKeys,
       "RepeatedMotion.IsBlurredHoweverOftenItRepeats MotionCurves.TimesHoldEveryKeyAndTurnsAreBounded", kLine,
       [] {
         return flat_stage([](Stage& s, int m) {
           s.zigzag(s.add(quad({-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}, m)), AnimatedPath::kTranslation,
                    {-40, 0, 0}, {40, 6, 0}, 3);
         });
       }},
      {"64 times there and back", "SixtyFourCycles", "Samples at regular times see one phase of it.",
       "Pieces by request, and times that are strata of a prime number of parts (scene/motion_segments.h).",
       "RepeatedMotion.OnRequestUpTo2048SegmentsBlurSixtyFourCycles "
       "SamplePattern.ManySegmentsSampleEveryPhaseOfRepeatedMotion",
       kLine,
       [] {
         Stage stage = flat_stage([](Stage& s, int m) {
           s.zigzag(s.add(quad({-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}, m)), AnimatedPath::kTranslation,
                    {-40, 0, 0}, {40, 6, 0}, 64);
         });
         stage.keys = {"sampling.motion_segments_max=2048"};
         return stage;
       }},
      {"turns and grows at once", "TurnsAndGrows", "The curve is no arc and no parabola.", kSegments,
       "RepeatedMotion.ThePlanKeepsItsPromiseOfTheError", kCurve,
       [] {
         return flat_stage([](Stage& s, int m) {
           const int node = s.add(blade(m));
           s.turn(node, {0, 0, 1}, 1.5);
           s.zigzag(node, AnimatedPath::kScale, {0.2f, 1, 1}, {1.5f, 2, 1}, 2);
         });
       }},
  };
}

std::vector<MotionRow> deforming_curves() {
  return {
      {"displaced spikes that turn", "DisplacedSpikes",
       "The tips of a height map lie outside of the control points, and move farther.",
       "The motion of a displaced body is measured on a box of its displaced surface.",
       "MotionCurves.TimesHoldEveryKeyAndTurnsAreBounded", kCurve,
       [] {
         Stage stage;
         stage.turn(stage.add(closed_patches(spiked(stage))), {0.2f, 1, 0.1f}, 0.7);
         stage.look({0, 0, 4.5});
         return stage;
       }},
      {"displaced spikes of a plate that bends", "DisplacedSpikesBend",
       "Control points move along lines, while the normals turn and take the tips along curves.",
       "The motion of displaced patches that deform is measured on their displaced surface, too.",
       "MotionCurves.TimesHoldEveryKeyAndTurnsAreBounded", kCurve,
       [] {
         Stage stage;
         scene::Primitive plate = patches(flat_patch({-1.5f, -1, 0}, {3, 0, 0}, {0, 2, 0}), spiked(stage));
         scene::MorphTarget bent;
         for (const Vec3& p : plate.vertices.positions)
           bent.positions.emplace_back(-0.5f * p.x, 0.0f, 1.4f * p.x * p.x);
         plate.vertices.morph_targets.push_back(bent);
         stage.morph(stage.add(plate));
         stage.look({0, 0, 6});
         return stage;
       }},
      {"displaced spikes on a joint", "DisplacedSpikesOfASkin", "A joint turns, and the tips with it.",
       "The motion of each joint is measured on a box of the vertices that it carries, grown by the "
       "greatest offset.",
       "SkinnedPatches.AreLitAsRigidOnes", kCurve,
       [] {
         Stage stage;
         const int node = stage.add(closed_patches(spiked(stage)));
         stage.turn(stage.skin(node, 2, -1, 1) + 1, {0, 0.3f, 1}, 0.12);
         stage.look({0, 0, 4.5});
         return stage;
       }},
      {"skin between two joints", "BlendedJoints", "Blended places shrink towards the axis of a twist.",
       "Vertices are skinned at the ends of every piece, and pieces are measured on skinned vertices.",
       "SkinnedImages.EqualARigidMesh", kCurve,
       [] {
         Stage stage;
         const int node = stage.add(sheet(24, 6, {-1.8f, -0.5f}, {1.8f, 0.5f}, stage.flat({0.3f, 0.8f, 1, 1})));
         stage.turn(stage.skin(node, 2, -1, 1) + 1, {1, 0, 0.2f}, 0.45);
         stage.look({0, 0, 4});
         return stage;
       }},
      {"morph there and back", "MorphThereAndBack", "Each vertex has a motion of its own, with corners in it.", kKeys,
       "RepeatedMotion.IsBlurredHoweverOftenItRepeats", kLine,
       [] {
         return flat_stage([](Stage& s, int m) {
           scene::Primitive shape = sheet(4, 4, {-30, -12}, {-6, 12}, m);
           scene::MorphTarget target;
           for (std::size_t v = 0; v < shape.vertices.count(); ++v)
             target.positions.emplace_back(44.0f, static_cast<float>(v % 5) * 3 - 6, 0.0f);
           shape.vertices.morph_targets.push_back(target);
           s.zigzag(s.add(shape), AnimatedPath::kWeights, {0}, {1}, 3);
         });
       }},
      {"smooth swing", "SmoothSwing", "A cubic spline has no key where it is fastest.", kSegments,
       "RepeatedMotion.IsBlurredHoweverOftenItRepeats", kCurve,
       [] {
         return flat_stage([](Stage& s, int m) {
           scene::AnimationChannel channel{.node = s.add(patches(flat_patch({-9, -9, 0}, {18, 0, 0}, {0, 18, 0}), m)),
                                           .interpolation = scene::Interpolation::kCubicSpline,
                                           .times = {},
                                           .values = {}};
           for (int k = 0; k <= 4; ++k) {
             channel.times.push_back(0.25f * static_cast<float>(k));
             const float x = k % 2 == 0 ? -45.0f : 45.0f;
             for (const float v : {0.0f, 60.0f, 0.0f, x, 0.0f, 0.0f, 0.0f, 60.0f, 0.0f}) channel.values.push_back(v);
           }
           s.play(channel);
         });
       }},
  };
}

std::vector<MotionRow> scene_curves() {
  return {
      {"instances below a node that turns", "TurningInstances", "Each instance moves along an arc of its own radius.",
       "Every instance is measured by its own transform.", "MotionSegments.InstancesMoveByThemAsNodesDo", kCurve,
       [] {
         return flat_stage([](Stage& s, int m) {
           const int node = s.add(quad({-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}, m));
           s.node(node).instances.resize(4);
           for (std::size_t k = 0; k < 4; ++k)
             s.node(node).instances[k].translation = {10.0f * static_cast<float>(k), 3, 0};
           s.turn(node, {0, 0, 1}, 0.8);
         });
       }},
      {"camera that turns as it passes", "TurningCamera",
       "All of the scene moves along curves, though nothing in it does.",
       "Motion is measured on the screen, the camera's own included.",
       "RepeatedMotion.ThePlanKeepsItsPromiseOfTheError Effects.ACameraThatMovesAloneMovesEverythingThatItSees", kCurve,
       [] {
         Stage stage;
         for (int k = 0; k < 5; ++k)
           stage.add(quad({-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0},
                          stage.flat({0.2f * static_cast<float>(k), 0.8f, 1, 1})),
                     {3.0 * k - 6, 0, -8 - k});
         const int camera = stage.look({0, 0, 0});
         stage.zigzag(camera, AnimatedPath::kTranslation, {-3, 0, 0}, {3, 0.5f, -3}, 1);
         stage.turn(camera, {0, 1, 0}, 0.06);
         return stage;
       }},
      {"zoom", "Zoom", "The projection itself changes while the shutter is open.",
       "A piece has the projection of its own ends.", "MotionSegments.AZoomIsSeen", kCurve,
       [] {
         Stage stage;
         stage.add(sheet(6, 4, {-3, -2}, {3, 2}, stage.flat({1, 0.5f, 0.4f, 1})), {0, 0, -6});
         scene::Camera camera;
         camera.vertical_fov = 1.2f;
         stage.look({0, 0, 0}, camera);
         stage.play({.object = 0,
                     .path = AnimatedPath::kFieldOfView,
                     .components = 1,
                     .times = {0, 1},
                     .values = {1.2f, 0.6f}});
         return stage;
       }},
  };
}

// Against the mean of still frames.
double unlike_stills(const Stage& stage, bool twin) { return rms_of_stills(twin ? with_two_keys(stage) : stage, 64); }

}  // namespace

std::vector<StabilityCase> motion_cases() {
  std::vector<StabilityCase> cases;
  for (const auto& rows : {node_curves(), deforming_curves(), scene_curves()})
    for (const MotionRow& row : rows)
      cases.push_back({kMotion, row.name, row.law, row.hard, row.kept, "two motion keys", row.tests, row.bound, "px",
                       row.scene, off_the_curve});
  cases.push_back(
      {kMotion, "scale that changes its sign", "ScaleChangesItsSign",
       "Halfway the body is flat; then its fronts become backs, and it is culled or shows its "
       "inside.",
       "The shutter is cut where the determinant changes its sign, found by halving, and winding follows the sample's "
       "time.",
       "two motion keys", "SkinnedImages.WindingFollowsTheSamplesTime", 1000, "ppm",
       [] {
         Stage stage;
         scene::Material sided;
         sided.unlit = true;
         sided.base_color = {1, 1, 0, 1};
         const int node =
             stage.add(quad({-20, -25, 0}, {60, -25, 0}, {60, 25, 0}, {-20, 25, 0}, stage.material(sided)));
         stage.play({.node = node, .path = AnimatedPath::kScale, .times = {0, 1}, .values = {1, 1, 1, -0.7f, 1, 1}});
         stage.look_flat();
         stage.keys = {"sampling.samples_per_pixel=16"};
         stage.capture.settings.background = Vec3(0, 0, 1);
         return stage;
       },
       [](const Stage& stage, bool twin) {
         // Seen from both sides nothing depends on the winding.
         Stage both = stage;
         both.capture.materials[0].double_sided = true;
         return wrong_samples(twin ? with_two_keys(stage) : stage, both);
       }});
  cases.push_back({kMotion, "steps inside the shutter", "Steps", "Places jump, and nothing is in between.",
                   "A key of a step cuts the shutter, and the pieces beside it meet nowhere.", "two motion keys",
                   "Effects.ACutBetweenTwoFramesIsNoMotionAndOneInsideTheShutterIs", 12, "rms/255",
                   [] {
                     return flat_stage([](Stage& s, int m) {
                       scene::AnimationChannel channel{
                           .node = s.add(quad({-12, -12, 0}, {12, -12, 0}, {12, 12, 0}, {-12, 12, 0}, m)),
                           .interpolation = scene::Interpolation::kStep,
                           .times = {0, 0.3f, 0.7f},
                           .values = {-50, 0, 0, 0, 10, 0, 50, 0, 0}};
                       s.play(channel);
                       s.keys = {"sampling.samples_per_pixel=64", "shading.rate=sample"};
                     });
                   },
                   unlike_stills});
  cases.push_back(
      {kMotion, "motion of less than a sub-pixel", "LessThanASubPixel",
       "Motion that rounds to nothing in one tile and to a step in the next opens a seam.",
       "A vertex that moves by no more than a sub-pixel rests: one rule per vertex, wherever it is asked for.",
       "motion of two pixels that rests",
       "SubPatchEffects.SE1AndSE2HoldForEverySubPatchThatGoesWithoutMotionOrLens "
       "SubPatchEffects.AnElisionThatLeavesOutTooMuchBreaksSE1AndSE2",
       0.01, "px",
       [] {
         return flat_stage([](Stage& s, int m) {
           s.move(s.add(sheet(8, 5, {-60, -30}, {60, 30}, m)), {0.003, 0.002, 0});
         });
       },
       [](const Stage& stage, bool twin) {
         if (!twin) return vertex_error(stage);
         Stage moving = stage;
         for (float& value : moving.capture.animations[0].channels[0].values) value *= 700;
         moving.keys.emplace_back("effects.motion=off");
         return rms_of_stills(moving, 16);
       }});
  return cases;
}

}  // namespace tessera::replay::stability
