#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "captures/sources/city_patterns.h"
#include "captures/sources/facades.h"
#include "captures/sources/outdoors.h"
#include "captures/sources/patterns.h"
#include "captures/sources/plants.h"
#include "captures/sources/scenes.h"
#include "captures/sources/surfaces.h"

namespace tessera::captures {
namespace {

using nlohmann::json;

constexpr float kQuarterTurn = 1.57079633f;
constexpr float kRoad = 4.2f, kStreet = 7.5f, kKerb = 0.14f;  // half widths of road and street, height of the kerb
constexpr float kNear = 9.0f, kFar = -150.0f;                 // the street along z
constexpr float kCrossNear = -46.0f, kCrossFar = -57.0f;      // the street across
constexpr float kWalkSeconds = 3.0f;

json matt(int colors, Vec2 repeat, float roughness) {
  return {
      {"pbrMetallicRoughness",
       {{"baseColorTexture", texture_info(colors, repeat)}, {"metallicFactor", 0.0}, {"roughnessFactor", roughness}}}};
}

struct CityMaterials {
  std::vector<FacadeMaterials> facades;
  int trim, slabs, asphalt, paint, iron, brick_tower, stone_tower;
};

CityMaterials add_city_materials(Asset& asset) {
  CityMaterials m{};
  const auto colors = [&](const Image8& image, const char* name) { return asset.add_color_texture(image, name); };
  const auto heights = [&](const Image8& image, const char* name) { return asset.add_data_texture(image, name); };
  const auto wall = [&](int color, int height, float scale, float roughness) {
    return asset.add_material(displaced(matt(color, Vec2(1), roughness), height, Vec2(1), scale, -0.5f * scale));
  };
  const int brick_height = heights(brick_heights(), "city_brick_h");
  const int red = wall(colors(brick_colors(false), "city_brick_red"), brick_height, 0.016f, 0.85f),
            yellow = wall(colors(brick_colors(true), "city_brick_yellow"), brick_height, 0.016f, 0.85f),
            stucco =
                wall(colors(stucco_colors(), "city_stucco"), heights(stucco_heights(), "city_stucco_h"), 0.012f, 0.8f),
            ashlar =
                wall(colors(ashlar_colors(), "city_ashlar"), heights(ashlar_heights(), "city_ashlar_h"), 0.03f, 0.75f),
            slate = wall(colors(slate_colors(), "city_slate"), heights(slate_heights(), "city_slate_h"), 0.03f, 0.5f);
  const int stone = colors(stone_colors(), "city_stone");
  m.trim = asset.add_material(matt(stone, Vec2(1), 0.7f));
  const int panes = asset.add_material(displaced(matt(colors(pane_colors(), "city_panes"), Vec2(1), 0.12f),
                                                 heights(pane_heights(), "city_panes_h"), Vec2(1), 0.06f, -0.03f));
  const int awning = asset.add_material(matt(colors(awning_colors(), "city_awning"), Vec2(1), 0.9f));
  m.facades = {{red, red, m.trim, panes, slate, awning},
               {stucco, yellow, m.trim, panes, slate, awning},
               {ashlar, yellow, m.trim, panes, slate, awning},
               {yellow, red, m.trim, panes, slate, awning}};
  m.slabs = asset.add_material(displaced(matt(colors(slab_colors(), "city_slabs"), Vec2(1), 0.8f),
                                         heights(slab_heights(), "city_slabs_h"), Vec2(1), 0.02f, -0.015f));
  m.asphalt = asset.add_material(matt(colors(asphalt_colors(), "city_asphalt"), Vec2(1), 0.75f));
  json paint = matt(stone, Vec2(3), 0.7f);
  m.paint = asset.add_material(paint);
  m.iron = asset.add_material(
      {{"pbrMetallicRoughness",
        {{"baseColorFactor", {0.015, 0.03, 0.025, 1.0}}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.35}}}});
  const int tower_height = heights(tower_heights(), "city_tower_h");
  m.brick_tower = wall(colors(tower_colors(true), "city_tower_brick"), tower_height, 0.28f, 0.75f);
  m.stone_tower = wall(colors(tower_colors(false), "city_tower_stone"), tower_height, 0.28f, 0.75f);
  return m;
}

// Share of the light of sun and sky that reaches a point of the street between the houses.
Vec3 street_light(const Shades& shades, Vec3 at) {
  const float corner = 1.0f - 0.45f * std::exp(-1.4f * std::max(0.0f, kStreet - std::abs(at.x)));
  return mix(Vec3(0.22f, 0.25f, 0.31f), Vec3(1.0f), sunlight(shades, at)) * corner;
}

struct Terrace {
  std::vector<FacadeStyle> styles;
  std::vector<int> meshes;
};

Terrace add_terraces(Asset& asset, const CityMaterials& m, Shadows shadows) {
  Terrace t;
  //           bays floors bay floor ground  window      sill  in     deep  door  shop  mansard seed
  t.styles = {{4, 3, 2.6f, 3.2f, 3.8f, 1.15f, 1.95f, 0.75f, 0.24f, 11.0f, 3, false, false, 1},
              {5, 4, 2.4f, 3.1f, 4.0f, 1.10f, 1.90f, 0.70f, 0.22f, 12.0f, 2, true, true, 2},
              {3, 3, 3.1f, 3.5f, 4.2f, 1.35f, 2.20f, 0.70f, 0.34f, 12.0f, 0, true, false, 3},
              {4, 4, 2.5f, 3.1f, 3.9f, 1.10f, 1.85f, 0.75f, 0.24f, 11.0f, 2, true, true, 4}};
  for (std::size_t k = 0; k < t.styles.size(); ++k)
    t.meshes.push_back(asset.add_mesh(lit(terraced_building(t.styles[k], m.facades[k]), shadows)));
  return t;
}

// Adds both sides of the street, house by house, and returns the objects that shade it.
Shades add_street_sides(Asset& asset, const Terrace& t) {
  Shades shades;
  for (const float side : {-1.0f, 1.0f}) {
    float z = kNear;
    for (std::uint32_t k = 0; z > kFar; ++k) {
      const std::size_t kind = (side < 0 ? k * 3 + 1 : k + 2) % t.styles.size();
      const FacadeStyle& s = t.styles[kind];
      if (z - s.width() < kCrossNear && z > kCrossFar) {
        z = kCrossFar;  // no room before the street across
        continue;
      }
      // A house's x runs away from the camera on the left, towards it on the right.
      const float origin = side < 0 ? z : z - s.width();
      asset.add_node({{"name", "house"},
                      {"mesh", t.meshes[kind]},
                      {"translation", {side * kStreet, 0.0f, origin}},
                      {"rotation", array_of(glm::angleAxis(-side * kQuarterTurn, Vec3(0, 1, 0)))}});
      const float inner = side * kStreet, outer = side * (kStreet + s.depth);
      shades.blocks.push_back({{std::min(inner, outer), 0.0f, z - s.width()}, {std::max(inner, outer), s.height(), z}});
      z -= s.width();
    }
  }
  return shades;
}

// Rows of towers behind, and the end of the street.
void add_towers(Asset& asset, const CityMaterials& m, Shadows shadows) {
  const auto kind_of = [&](int bays_x, int bays_z, int floors, int material) {
    return asset.add_mesh(lit(tower(bays_x, bays_z, floors, 3.0f, 3.2f), shadows), material);
  };
  const std::vector<int> towers = {kind_of(5, 4, 8, m.brick_tower), kind_of(4, 4, 11, m.stone_tower),
                                   kind_of(5, 5, 6, m.stone_tower), kind_of(4, 5, 14, m.brick_tower)};
  const auto place = [&](std::size_t kind, float x, float z) {
    asset.add_node({{"name", "tower"}, {"mesh", towers[kind]}, {"translation", {x, 0.0f, z}}});
  };
  for (int row = 0; row < 4; ++row)
    for (int k = 0; k < 9; ++k)
      for (const int side : {-1, 1}) {
        const std::uint32_t number = hash32(77, static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(k),
                                            static_cast<std::uint32_t>(side + 1));
        const float z = -8.0f - 17.5f * static_cast<float>(k);
        if (std::abs(z - 0.5f * (kCrossNear + kCrossFar)) < 12.0f && row == 0) continue;
        place(number % 4, static_cast<float>(side) * (34.0f + 21.0f * static_cast<float>(row)),
              z - static_cast<float>(number >> 8 & 3u));
      }
  for (int k = -3; k <= 3; ++k) place(static_cast<std::size_t>(k + 5) % 3, 17.0f * static_cast<float>(k), kFar - 20.0f);
  for (int k = -4; k <= 4; ++k)
    place(static_cast<std::size_t>(k + 5) % 4, 18.0f * static_cast<float>(k) + 5.0f, kFar - 42.0f);
}

// A church where the street ends: a tower of ashlar with a spire.
void add_church(Asset& asset, const CityMaterials& m, Shadows shadows) {
  Geometry stone, spire;
  const Vec2 low(-3.2f, -6.4f), high(3.2f, 0.0f);
  for (int k = 0; k < 8; ++k) {
    const float y = 3.6f * static_cast<float>(k);
    add_box(stone, {low.x, y, low.y}, {high.x, y + 3.6f, high.y}, 1u | 2u | 16u | 32u, 0.5f);
    if (k % 3 == 2)
      add_box(stone, {low.x - 0.3f, y + 3.3f, low.y - 0.3f}, {high.x + 0.3f, y + 3.7f, high.y + 0.3f}, kAllFaces, 0.5f);
  }
  const Vec2 around[5] = {{low.x, high.y}, {high.x, high.y}, {high.x, low.y}, {low.x, low.y}, {low.x, high.y}};
  for (int side = 0; side < 4; ++side) {
    const auto corner = [&](Vec2 p, float up) {
      const Vec2 middle = (low + high) * 0.5f, q = p + (middle - p) * (up * 0.985f);
      return Corner{{q.x, 28.8f + 15.0f * up, q.y}, Vec2(glm::dot(p, Vec2(1, 1)) * 0.5f, -7.5f * up), Vec3(1.0f)};
    };
    for (int k = 0; k < 3; ++k) {
      const float a = static_cast<float>(k) / 3.0f, b = static_cast<float>(k + 1) / 3.0f;
      add_patch(spire, {corner(around[side], a), corner(around[side + 1], a), corner(around[side], b),
                        corner(around[side + 1], b)});
    }
  }
  asset.add_node({{"name", "church"},
                  {"mesh", asset.add_mesh(lit({{stone, m.facades[2].wall}, {spire, m.facades[0].slate}}, shadows))},
                  {"translation", {1.5f, 0.0f, kFar + 1.0f}}});
}

// Adds trees along the pavements, and their shade to `shades`.
void add_street_trees(Asset& asset, Shades& shades, Shadows shadows) {
  json leaves = {{"doubleSided", true},
                 {"alphaMode", "MASK"},
                 {"alphaCutoff", 0.4},
                 {"pbrMetallicRoughness",
                  {{"baseColorTexture", texture_info(asset.add_data_texture(
                                            sprig_atlas({0.17f, 0.31f, 0.08f}, {0.50f, 0.64f, 0.22f}), "city_leaves"))},
                   {"metallicFactor", 0.0},
                   {"roughnessFactor", 0.6}}}};
  const int bark = asset.add_material(
      {{"pbrMetallicRoughness",
        {{"baseColorFactor", {0.075, 0.055, 0.04, 1.0}}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.9}}}});
  Geometry wood;
  add_tube(wood, {Vec3(0, -0.1f, 0), {0.03f, 1.0f, 0}, {-0.06f, 2.0f, 0.03f}, {0, 3.2f, 0}}, 0.15f, 0.09f, 3.0f);
  add_tube(wood, {Vec3(0, 2.4f, 0), {0.1f, 2.9f, 0.1f}, {0.4f, 3.5f, 0.2f}, {0.8f, 4.3f, 0.3f}}, 0.07f, 0.02f, 3.0f);
  add_tube(wood, {Vec3(0, 2.7f, 0), {-0.1f, 3.1f, 0}, {-0.5f, 3.6f, 0.1f}, {-0.8f, 4.3f, -0.3f}}, 0.07f, 0.02f, 3.0f);
  const Vec3 radii(1.55f, 1.7f, 1.55f), middle(0, 4.3f, 0);
  Geometry top = crown({700, radii, 0.34f, 1, 330, shadows == Shadows::kBaked});
  for (Vec3& p : top.positions) p += middle;
  const int tree = asset.add_mesh({{top, asset.add_material(leaves)}, {lit(wood, shadows), bark}});
  Asset::Instances places;
  for (const Vec2& p :
       {Vec2(5.6f, -16.5f), Vec2(-5.6f, -13.0f), Vec2(5.6f, -30.5f), Vec2(-5.6f, -27.0f), Vec2(-5.6f, -41.0f),
        Vec2(5.6f, -62.0f), Vec2(-5.6f, -66.0f), Vec2(5.6f, -78.0f), Vec2(-5.6f, -84.0f)}) {
    places.add({p.x, kKerb, p.y}, p.y, 1.0f);
    shades.crowns.push_back({Vec3(p.x, kKerb, p.y) + middle, radii});
  }
  asset.add_instances("tree", tree, places);
}

// A small car of two rounded bodies, along z.
std::vector<Part> car(int paint, int tyre) {
  const auto loaf = [](Vec3 middle, Vec3 half, float corner, float taper) {
    return [=](float u, float v) {
      // A superellipsoid's upper part; v runs from its lower rim to the top.
      const float around = u * 4.0f * kQuarterTurn, up = (0.02f + 0.98f * v) * kQuarterTurn;
      const auto power = [&](float x) { return std::copysign(std::pow(std::abs(x), corner), x); };
      const float ring = power(std::cos(up)), high = power(std::sin(up));
      return middle + Vec3(ring * power(std::cos(around)) * half.x * (1.0f - taper * high), high * half.y,
                           -ring * power(std::sin(around)) * half.z * (1.0f - taper * high));
    };
  };
  const Vec3 body(1.0f), dark(0.03f);
  Geometry shell =
      patches_of(loaf({0, 0.46f, 0}, {0.80f, 0.46f, 1.95f}, 0.42f, 0.05f), 12, 4, [&](float, float) { return body; });
  const Geometry skirt = patches_of(
      [&](float u, float v) {
        const Vec3 rim = loaf({0, 0.46f, 0}, {0.80f, 0.46f, 1.95f}, 0.42f, 0.05f)(u, 0.0f);
        return Vec3(rim.x * (0.94f + 0.06f * v), 0.20f + (rim.y - 0.20f) * v, rim.z * (0.98f + 0.02f * v));
      },
      12, 1, [&](float, float) { return Vec3(0.04f); });
  const Geometry cabin = patches_of(loaf({0, 0.82f, 0.15f}, {0.70f, 0.62f, 1.15f}, 0.48f, 0.12f), 12, 4,
                                    [&](float, float v) { return v > 0.5f ? body : dark; });
  append(shell, skirt);
  append(shell, cabin);
  Geometry wheels;
  for (const float z : {-1.2f, 1.2f})
    for (const float side : {-1.0f, 1.0f}) {
      const float x = side * 0.69f;
      const Geometry wheel = patches_of(
          [&](float u, float v) {
            const float around = side * u * 4.0f * kQuarterTurn, r = v < 0.5f ? 0.33f : 0.33f * (2.0f - 2.0f * v);
            return Vec3(x + side * (v < 0.5f ? 0.4f * v - 0.15f : 0.05f), 0.33f + r * std::sin(around),
                        z - r * std::cos(around));
          },
          8, 2, [](float, float v) { return Vec3(v < 0.5f ? 0.02f : 0.25f); });
      append(wheels, wheel);
    }
  // Lamps and bumpers: white in front, red behind.
  for (const float end : {-1.0f, 1.0f}) {
    const float z = 1.90f * end, out = z + 0.07f * end;
    const auto fitting = [&](float x0, float x1, float y0, float y1, Vec3 color) {
      add_box(wheels, {x0, y0, std::min(z, out)}, {x1, y1, std::max(z, out)}, kAllFaces, 1.0f, color);
    };
    for (const float x : {-0.66f, 0.46f})
      fitting(x, x + 0.2f, 0.56f, 0.70f, end < 0 ? Vec3(0.9f) : Vec3(0.6f, 0.02f, 0.02f));
    fitting(-0.74f, 0.74f, 0.36f, 0.44f, Vec3(0.30f));
    fitting(-0.26f, 0.26f, 0.47f, 0.57f, end < 0 ? Vec3(0.8f) : Vec3(0.85f, 0.65f, 0.05f));
  }
  return {{shell, paint}, {wheels, tyre}};
}

// Adds parked cars beside the kerbs. With cast shadows two more drive, one each way.
void add_cars(Asset& asset, Shades& shades, Shadows shadows) {
  const auto enamel = [&](Vec3 color, float roughness) {
    return asset.add_material({{"pbrMetallicRoughness",
                                {{"baseColorFactor", {color.x, color.y, color.z, 1.0}},
                                 {"metallicFactor", 0.0},
                                 {"roughnessFactor", roughness}}}});
  };
  const int tyre = enamel(Vec3(1.0f), 0.6f);
  std::vector<int> cars;
  for (const Vec3& color : {Vec3(0.50f, 0.04f, 0.03f), Vec3(0.05f, 0.16f, 0.30f), Vec3(0.62f, 0.58f, 0.46f)})
    cars.push_back(asset.add_mesh(car(enamel(color, 0.22f), tyre)));
  const Vec3 places[] = {{3.1f, 0, -9.0f},   {3.1f, 0, -21.5f},  {-3.1f, 0, -17.5f}, {3.1f, 0, -36.0f},
                         {-3.1f, 0, -33.0f}, {-3.1f, 0, -38.5f}, {3.1f, 0, -66.0f},  {-3.1f, 0, -72.0f}};
  std::size_t kind = 0;
  const auto add_car = [&](Vec3 at) {
    return asset.add_node(
        {{"name", "car"},
         {"mesh", cars[kind++ % cars.size()]},
         {"translation", array_of(at)},
         {"rotation", array_of(glm::angleAxis(at.x < 0 ? 0.0f : 2.0f * kQuarterTurn, Vec3(0, 1, 0)))}});
  };
  for (const Vec3& at : places) {
    shades.blocks.push_back({at + Vec3(-0.75f, 0.22f, -1.85f), at + Vec3(0.75f, 1.2f, 1.85f)});
    add_car(at);
  }
  if (shadows == Shadows::kBaked) return;
  for (const auto& [from, to] : {std::pair(Vec3(-1.2f, 0, -4.0f), Vec3(-1.2f, 0, -30.0f)),
                                 std::pair(Vec3(1.2f, 0, -38.0f), Vec3(1.2f, 0, -11.0f))})
    asset.animate(add_car(from), "translation", {0.0f, kWalkSeconds}, std::vector<Vec3>{from, to});
}

// A strip of the street along z: patches get longer with distance. `scale`: texture coordinates per metre.
void add_strip(Geometry& g, float x0, float x1, int columns, float y, float scale, const Shades& shades) {
  const auto corner = [&](float x, float z) {
    return Corner{{x, y, z}, Vec2(x, z) * scale, street_light(shades, {x, y + 0.02f, z})};
  };
  float z = kNear;
  while (z > kFar - 10.0f) {
    const float length = z > -15.0f ? 1.0f : z > -60.0f ? 2.0f : 5.0f;
    for (int c = 0; c < columns; ++c) {
      const auto at = [&](int i) { return x0 + (x1 - x0) * static_cast<float>(i) / static_cast<float>(columns); };
      add_patch(g, {corner(at(c), z), corner(at(c + 1), z), corner(at(c), z - length), corner(at(c + 1), z - length)});
    }
    z -= length;
  }
}

void add_ground_of_city(Asset& asset, const CityMaterials& m, const Shades& shades, Shadows shadows) {
  Geometry road, pavement, kerbs, paint;
  add_strip(road, -kRoad, kRoad, 20, 0.0f, 1.0f / 3.0f, shades);
  for (const float side : {-1.0f, 1.0f}) {
    const float inner = side * kRoad, outer = side * (kStreet + 0.3f);
    add_strip(pavement, std::min(inner, outer), std::max(inner, outer), 5, kKerb, 1.0f / 2.4f, shades);
    // The kerb: its top and the side towards the road.
    for (float z = kNear; z > kFar; z -= 2.0f) {
      const float edge = side * (kRoad - 0.15f), back = side * (kRoad + 0.05f);
      const Vec3 light = street_light(shades, {edge, kKerb, z - 1.0f});
      add_box(kerbs, {std::min(edge, back), -0.02f, z - 1.99f}, {std::max(edge, back), kKerb + 0.01f, z},
              8u | (side < 0 ? 2u : 1u), 0.4f, light);
    }
  }
  for (float z = kNear - 1.0f; z > kFar; z -= 5.0f) {
    const auto corner = [&](float x, float at) {
      return Corner{{x, 0.012f, at}, {x, at}, street_light(shades, {x, 0.05f, at})};
    };
    add_patch(paint, {corner(-0.07f, z), corner(0.07f, z), corner(-0.07f, z - 2.4f), corner(0.07f, z - 2.4f)});
  }
  asset.add_node(
      {{"name", "street"},
       {"mesh",
        asset.add_mesh(lit({{road, m.asphalt}, {pavement, m.slabs}, {kerbs, m.trim}, {paint, m.paint}}, shadows))}});
  // Ground beyond the street: yards and the other streets.
  Geometry beyond;
  for (int j = 0; j < 12; ++j)
    for (int i = -8; i < 8; ++i) {
      const auto corner = [](int a, int b) {
        const Vec3 p(16.0f * static_cast<float>(a), -0.03f, 16.0f - 18.0f * static_cast<float>(b));
        return Corner{p, Vec2(p.x, p.z) / 3.0f, Vec3(0.5f)};
      };
      add_patch(beyond, {corner(i, j), corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1)});
    }
  asset.add_node({{"name", "yards"}, {"mesh", asset.add_mesh(beyond, m.asphalt)}});
}

void add_lamps(Asset& asset, const CityMaterials& m) {
  const Geometry post = revolve(smooth_profile({{0.17f, 0.0f},
                                                {0.15f, 0.35f},
                                                {0.075f, 0.55f},
                                                {0.065f, 2.2f},
                                                {0.09f, 2.3f},
                                                {0.05f, 2.4f},
                                                {0.045f, 3.9f},
                                                {0.16f, 4.0f}},
                                               false, false)),
                 lantern = revolve(smooth_profile({{0.10f, 4.0f}, {0.22f, 4.38f}, {0.24f, 4.42f}}, false, false)),
                 cap = revolve(
                     smooth_profile({{0.27f, 4.42f}, {0.20f, 4.58f}, {0.05f, 4.66f}, {0.0f, 4.85f}}, false, true)),
                 bollard = revolve(smooth_profile(
                     {{0.10f, 0.0f}, {0.07f, 0.12f}, {0.065f, 0.75f}, {0.10f, 0.8f}, {0.0f, 0.95f}}, false, true));
  const int milk = asset.add_material(
      {{"emissiveFactor", {0.25, 0.24, 0.21}},
       {"pbrMetallicRoughness",
        {{"baseColorFactor", {0.8, 0.79, 0.75, 1.0}}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.2}}}});
  const int lamp = asset.add_mesh({{post, m.iron}, {cap, m.iron}, {lantern, milk}}),
            low = asset.add_mesh(bollard, m.iron);
  for (int k = 0; k < 12; ++k)
    for (const float side : {-1.0f, 1.0f})
      asset.add_node(
          {{"name", "lamp"},
           {"mesh", lamp},
           {"translation", {side * (kRoad + 0.45f), kKerb, -9.0f - 14.0f * static_cast<float>(k) - 6.0f * side}}});
  for (int k = 0; k < 40; ++k)
    for (const float side : {-1.0f, 1.0f}) {
      const float z = -3.0f - 2.1f * static_cast<float>(k);
      if (z < kCrossNear + 2 && z > kCrossFar - 2) continue;
      asset.add_node({{"name", "bollard"}, {"mesh", low}, {"translation", {side * (kRoad + 0.3f), kKerb, z}}});
    }
}

void add_walk(Asset& asset) {
  const auto eye_at = [](float t) {
    return Vec3(-1.7f + 0.10f * t + 0.02f * std::sin(6.0f * t), 1.68f + 0.025f * std::sin(12.0f * t), 5.0f - 1.7f * t);
  };
  std::vector<float> times;
  std::vector<Vec3> eyes, targets;
  for (int k = 0; k <= 24 * static_cast<int>(kWalkSeconds); ++k) {
    const float t = static_cast<float>(k) / 24.0f;
    times.push_back(t);
    eyes.push_back(eye_at(t));
    targets.push_back(eyes.back() + Vec3(0.16f + 0.10f * t, 0.155f, -1.0f));
  }
  json view = look_at(eyes.front(), targets.front());
  view["camera"] =
      asset.add_camera({{"type", "perspective"}, {"perspective", {{"yfov", 0.84}, {"znear", 0.2}, {"zfar", 900.0}}}});
  view["name"] = "camera";
  animate_look(asset, asset.add_node(view), times, eyes, targets);
  asset.capture_settings() = {{"resolution", {1280, 720}}, {"frameRate", 24},
                              {"shutter", {0.0, 0.5}},     {"frames", {{"first", 5}, {"count", 1}}},
                              {"environment", 0.55},       {"exposure", 1.05}};
}

// The sun stands 8 degrees high behind the camera, a little to its left, and shines along the street. Lamps and trees cast
// their shadows on the right pavement and its houses; the houses at the left cast theirs on the road.
void add_evening(Asset& asset) {
  constexpr float kHigh = 8.0f / 180.0f * kPi, kAside = -11.0f / 180.0f * kPi;
  const Vec3 to_sun(std::sin(kAside) * std::cos(kHigh), std::sin(kHigh), std::cos(kAside) * std::cos(kHigh));
  add_sky(asset, {"sky_evening", {0.20f, 0.27f, 0.47f}, {0.74f, 0.60f, 0.58f}, {0.98f, 0.72f, 0.58f}, 0.75f});
  const int sun = add_sun(asset, {15.0f, to_sun, {1.0, 0.62, 0.33}});
  json& settings = asset.capture_settings();
  settings["frames"] = {{"first", 0}, {"count", 60}};
  settings["exposure"] = 1.15;
  settings["shadows"] = {{{"light", sun}, {"size", 1024}, {"cascades", 4}, {"distance", 160.0}}};
  // Blue from above, a warm rim around the sun, little from the ground.
  asset.set_environment(
      32, 16,
      [&](Vec3 way) {
        if (way.y < 0) return Vec3(0.05f, 0.045f, 0.04f);
        const float low = std::pow(1.0f - way.y, 4.0f), near = std::max(0.0f, glm::dot(way, to_sun));
        return mix(Vec3(0.13f, 0.19f, 0.33f), Vec3(0.30f, 0.26f, 0.27f), low) +
               Vec3(0.8f, 0.42f, 0.18f) * (low * std::pow(near, 4.0f));
      },
      "evening");
}

void write_city(const std::string& name, Shadows shadows, const std::filesystem::path& folder) {
  Asset asset(name);
  const CityMaterials materials = add_city_materials(asset);
  const Terrace terrace = add_terraces(asset, materials, shadows);
  Shades shades = add_street_sides(asset, terrace);
  add_towers(asset, materials, shadows);
  add_church(asset, materials, shadows);
  add_street_trees(asset, shades, shadows);
  add_cars(asset, shades, shadows);
  add_ground_of_city(asset, materials, shades, shadows);
  add_lamps(asset, materials);
  if (shadows == Shadows::kBaked) {
    add_sky(asset);
    add_sun(asset, {5.4f});
  }
  add_walk(asset);
  if (shadows == Shadows::kCast) add_evening(asset);
  asset.write(folder);
}

}  // namespace

void make_city(const std::filesystem::path& folder) { write_city("city", Shadows::kBaked, folder); }
void make_city_evening(const std::filesystem::path& folder) { write_city("city_evening", Shadows::kCast, folder); }

}  // namespace tessera::captures
