#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "replay/stability/case_tables.h"
#include "replay/stability/measures.h"

namespace tessera::replay::stability {
namespace {

using shaders::Light;

constexpr double kPixel = 0.1;  // scene units of a pixel of the floor

int white(Stage& stage) {
  scene::Material material;
  material.metallic = 0, material.roughness = 1;
  material.double_sided = true;
  return stage.material(material);
}

scene::Primitive level(double half, int material) {
  const auto h = static_cast<float>(half);
  return quad({-h, 0, h}, {h, 0, h}, {h, 0, -h}, {-h, 0, -h}, material);
}

// A floor seen from above, and a card over it, or none.
Stage over_floor(const DVec3& card, double half, const std::function<void(scene::Capture&)>& light) {
  Stage stage;
  stage.still();
  stage.capture.settings.background = Vec3(0.0f);
  stage.capture.settings.environment = 0.0f;
  stage.add(level(60, white(stage)));
  if (half > 0) stage.add(level(half, white(stage)), card);
  scene::Camera lens;
  lens.type = scene::Camera::Type::kOrthographic;
  lens.x_mag = 8, lens.y_mag = 4.5f;
  stage.node(stage.look({0, 10, 0}, lens)).transform.rotation = scene::made::looking({0, -1, 0});
  light(stage.capture);
  return stage;
}

std::function<void(scene::Capture&)> sun(const DVec3& direction, int size = 512) {
  return [=](scene::Capture& capture) { scene::made::add_light(capture, {}, DVec3(0.0), direction, {.size = size}); };
}

std::function<void(scene::Capture&)> lamp(Light::Type type, const DVec3& place, double cone = 60, double range = 0) {
  return [=](scene::Capture& capture) {
    Light light;
    light.type = type;
    light.color = Vec3(60.0f);
    light.range = static_cast<float>(range);
    light.cos_outer = light.cos_inner = static_cast<float>(std::cos(glm::radians(cone)));
    scene::made::add_light(capture, light, place, {0, -1, 0}, {.size = 512});
  };
}

// How far a place of the floor is from a shadow's edge; negative: in the shadow.
using Edge = std::function<double(const DVec2&)>;
Edge nowhere() {
  return [](const DVec2&) { return std::numeric_limits<double>::infinity(); };
}
Edge square(const DVec2& middle, double half) {
  return [=](const DVec2& place) {
    const DVec2 off = glm::abs(place - middle) - half;
    return std::max(off.x, off.y);
  };
}

// Number of pixels with full light inside the shadow, or without full light outside of it, except near its edge and
// where the card is visible.
double wrong_pixels(const Stage& stage, const Edge& shadow, const Edge& card, double margin) {
  Stage bright = stage;
  bright.keys.emplace_back("effects.shadows=off");
  const Image with = render(stage), without = render(bright);
  int wrong = 0;
  for (int y = 0; y < stage.height; ++y)
    for (int x = 0; x < stage.width; ++x) {
      const DVec2 place = DVec2(x + 0.5 - stage.width / 2.0, y + 0.5 - stage.height / 2.0) * kPixel;
      const double distance = shadow(place);
      if (std::abs(distance) < margin || card(place) < kPixel) continue;
      const auto lit = static_cast<double>(with.at(x, y)[0]), all = static_cast<double>(without.at(x, y)[0]);
      wrong += distance < 0 ? !(lit <= 1e-6 * all) : !(lit >= (1 - 1e-6) * all);
    }
  return wrong;
}

struct ShadowCase {
  std::string_view name, law, hard, kept, twin;
  std::function<Stage()> scene;
  Edge shadow, card;
  std::function<void(Stage&)> broken;
  double margin = 0.2;
};

StabilityCase shadow_case(const ShadowCase& of) {
  return {kShadows,
          of.name,
          of.law,
          of.hard,
          of.kept,
          of.twin,
          "Shadows.APlaneUnderAGrazingSunIsLitWhereverItIs All/Filters.ASunsShadowOfACardIsACardBesideIt/0",
          0,
          "pixels",
          of.scene,
          [of](const Stage& stage, bool twin) {
            Stage machine = stage;
            if (twin) of.broken(machine);
            return wrong_pixels(machine, of.shadow, of.card, of.margin);
          }};
}

void set(Stage& stage, const char* key) { stage.keys.emplace_back(key); }
// The card, which is the second node, casts nothing.
void let_light_through(Stage& stage) {
  const int mesh = stage.node(1).mesh,
            material = stage.capture.meshes[static_cast<std::size_t>(mesh)].primitives[0].material;
  stage.capture.materials[static_cast<std::size_t>(material)].unlit = true;
}

// Opens the shutter again, for one second.
Stage& in_motion(Stage& stage) {
  stage.capture.settings.frame_rate = 1;
  stage.capture.settings.shutter_close = 1;
  return stage;
}

// A floor into the distance, in four cascades.
Stage cascades() {
  Stage stage = over_floor({}, 0, [](scene::Capture& capture) {
    scene::made::add_light(capture, {}, DVec3(0.0), {1, -0.4, 0.3}, {.size = 256, .cascades = 4});
  });
  stage.capture.cameras[0] = {};
  stage.capture.cameras[0].near = 0.1f;
  scene::Node& camera = stage.node(1);
  camera.transform = {.translation = {0, 2, 30}, .rotation = scene::made::looking({0, -0.2, -1})};
  set(stage, "shadows.filter=3x3");
  return stage;
}

// A camera over the floor moves by whole pixels: images, moved back, are compared.
Stage walking() {
  Stage stage = over_floor({0, 2, 0}, 0.7, sun({1, -1, 0.3}, 128));
  stage.move(2, {32 * kPixel, 0, 0});
  stage.frame = 0;
  stage.capture.settings.shutter_close = 0;
  stage.capture.settings.frame_rate = 32;
  return stage;
}
double crawling_pixels(const Stage& stage) {
  Stage later = stage;
  later.frame = 5;
  const Image first = render(stage), then = render(later);
  int wrong = 0;
  for (int y = 0; y < stage.height; ++y)
    for (int x = 5; x < stage.width; ++x) wrong += std::abs(first.at(x, y)[0] - then.at(x - 5, y)[0]) > 1.0f / 256;
  return wrong;
}

void no_bias(Stage& stage) { set(stage, "shadows.bias=0"); }

std::vector<ShadowCase> maps_and_their_edges() {
  constexpr std::string_view kSlope =
      "The bias is half a texel of the receiver's own slope, and filters compare on its plane.";
  return {
      {"a floor under a grazing sun", "GrazingSun", "A texel of the map is many units long on the floor.", kSlope,
       "no bias",
       [] {
         return over_floor({}, 0, sun({1, -0.05, 0.3}));
       },
       nowhere(), nowhere(), no_bias},
      {"16 bits of depth over a high tower", "CoarseDepths", "A step of the depths is as long as a card is high.",
       "Half a step of the format is part of the bias.", "no bias",
       [] {
         Stage stage = over_floor({500, 400, 0}, 0.1, sun({0.3, -1, 0.2}));
         set(stage, "shadows.format=d16");
         return stage;
       },
       nowhere(), nowhere(), no_bias},
      {"a floor a million units from the origin", "FarFloor", "World places are coarser than a texel there.",
       "A receiver goes from the camera's raster to the light's by one matrix, made in double precision.", "no bias",
       [] {
         Stage stage = over_floor({}, 0, sun({1, -0.4, 0.3}));
         stage.below({.translation = {1e6, -5e5, 1e6}});
         return stage;
       },
       nowhere(), nowhere(), no_bias},
      {"a card far above the view", "HighCaster", "It lies between the sun and all that the camera sees.",
       "The near plane of a map lies before all that casts into it.", "its card lets light through",
       [] {
         return over_floor({-2000, 2000, 0}, 1, sun({1, -1, 0}));
       },
       square({0, 0}, 1), nowhere(), let_light_through},
      {"a wall that stands on the floor", "WallsFoot", "Its foot has no distance from the shaded floor.",
       "The bias is no larger than the slope of the floor asks for.", "half a unit more of bias",
       [] {
         Stage stage = over_floor({}, 0, sun({1, -1, 0}, 2048));
         stage.add(quad({0, 0, 1}, {0, 0, -1}, {0, 2, -1}, {0, 2, 1}, white(stage)));
         return stage;
       },
       square({1, 0}, 1), nowhere(), [](Stage& stage) { set(stage, "shadows.offset=0.5"); }, 0.1},
      {"a lamp a hair above its card", "LampInItsShade", "The card lies before any near plane that is not a hair's.",
       "The near plane is at the nearest that casts.", "its card lets light through",
       [] {
         return over_floor({0, 2.9, 0}, 0.5, lamp(Light::Type::kSpot, {0, 3, 0}));
       },
       square({0, 0}, 100), square({0, 0}, 0.5), let_light_through},
      {"a lamp over the edges of its faces", "FaceEdges", "Lookups of filters reach over the edges of a cube's faces.",
       "Faces have a border of two texels.", "no bias",
       [] {
         Stage stage = over_floor({}, 0, lamp(Light::Type::kPoint, {0, 2, 0}));
         set(stage, "shadows.filter=3x3");
         return stage;
       },
       nowhere(), nowhere(), no_bias},
      {"a spot light of 170 degrees", "WideCone", "One map would see almost all directions.",
       "Cones that are wider than 120 degrees have the faces of a cube.", "its card lets light through",
       [] {
         return over_floor({1, 1, 0}, 0.25, lamp(Light::Type::kSpot, {0, 2, 0}, 85));
       },
       square({2, 0}, 0.5), square({1, 0}, 0.25), let_light_through},
      {"a map of one texel", "OneTexel", "No texel has neighbours.",
       "Lookups outside of a map read the texels of its edge.", "no bias",
       [] {
         return over_floor({}, 0, sun({1, -0.5, 0.3}, 1));
       },
       nowhere(), nowhere(),
       [](Stage& stage) {
         stage.keys = {"shadows.bias=0", "shadows.size=64"};
       }},
      {"a light whose range is nothing", "NoRange", "Nothing lies between its near and its far plane.",
       "Where no light arrives no shadow is looked up.", "no bias",
       [] {
         return over_floor({}, 0, [](scene::Capture& capture) {
           lamp(Light::Type::kSpot, {0, 2, 0}, 60, 1e-3)(capture);
           sun({1, -0.4, 0.3})(capture);
         });
       },
       nowhere(), nowhere(), no_bias},
  };
}

std::vector<ShadowCase> cascades_and_motion() {
  return {
      {"seams between cascades", "CascadeSeams", "Filters of one map reach to where the next one begins.",
       "A map is taken where it has all texels of a lookup.", "no bias", cascades, nowhere(), nowhere(), no_bias},
      {"a light whose node is mirrored", "MirroredLight", "Its axes are left-handed.",
       "A map's view has axes of its own along the light's direction.", "its card lets light through",
       [] {
         Stage stage = over_floor({1, 1, 0}, 0.25, lamp(Light::Type::kSpot, {0, 2, 0}));
         stage.node(3).transform.scale = {-1, 1, 1};
         return stage;
       },
       square({2, 0}, 0.5), square({1, 0}, 0.25), let_light_through},
      {"a floor that rises in the shutter", "RisingFloor", "The map shows it at another place.",
       "Receivers that move are looked up where they are at the time of the map.", "no bias",
       [] {
         Stage stage = over_floor({}, 0, sun({1, -0.4, 0.3}));
         in_motion(stage).move(0, {0, 3, 0});
         return stage;
       },
       nowhere(), nowhere(),
       [](Stage& stage) {
         stage.keys = {"shadows.bias=0", "shadows.filter=nearest"};
       }},
      {"a lamp that moves with all that it lights", "MovingAlike", "Nothing rests, and no shadow moves.",
       "Maps and receivers belong to one time.", "its card lets light through",
       [] {
         Stage stage = over_floor({0, 2, 0}, 0.7, lamp(Light::Type::kSpot, {0, 4, 0}));
         in_motion(stage);
         for (int node = 0; node < 4; ++node) stage.move(node, {3, 1, -2});
         return stage;
       },
       square({0, 0}, 1.4), square({0, 0}, 0.7), let_light_through},
      {"a lamp that passes through the floor", "LampInPlane", "The floor is on edge to it, and divides by nothing.",
       "A surface that the light sees edge-on gets the steepest slope.", "no bias",
       [] {
         Stage stage = over_floor({}, 0, [](scene::Capture& capture) {
           lamp(Light::Type::kPoint, {0.03, -1, 0.02})(capture);
           sun({1, -0.4, 0.3})(capture);
         });
         in_motion(stage).move(2, {0, 2, 0});
         return stage;
       },
       nowhere(), nowhere(), no_bias},
  };
}

}  // namespace

std::vector<StabilityCase> shadow_cases() {
  std::vector<StabilityCase> all;
  for (const ShadowCase& one : maps_and_their_edges()) all.push_back(shadow_case(one));
  for (const ShadowCase& one : cascades_and_motion()) all.push_back(shadow_case(one));
  all.push_back({kShadows, "a camera that walks", "Crawl", "Maps of its view move with it, and texels with the maps.",
                 "Maps lie over a sphere around the view and move by whole texels.", "maps that fit the view's own box",
                 "Shadows.AMapStoresItsTexelsAndClearedTilesAreAFlag", 0, "pixels", walking,
                 [](const Stage& stage, bool twin) {
                   Stage machine = stage;
                   if (twin) machine.keys.emplace_back("shadows.fit=frustum");
                   return crawling_pixels(machine);
                 }});
  return all;
}

}  // namespace tessera::replay::stability
