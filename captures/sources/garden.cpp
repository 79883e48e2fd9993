#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "captures/sources/lanterns.h"
#include "captures/sources/outdoors.h"
#include "captures/sources/patterns.h"
#include "captures/sources/plants.h"
#include "captures/sources/scenes.h"
#include "captures/sources/surfaces.h"

namespace tessera::captures {
namespace {

using nlohmann::json;

constexpr float kTurn = 6.2831853f;
constexpr float kGardenNear = 7.0f, kGardenFar = -17.0f;  // along z
constexpr float kPath = 0.75f, kBed = 1.95f;              // half widths of the path and of the beds beside it

float random_unit(std::uint32_t a, std::uint32_t b) { return static_cast<float>(hash32(211, a, b) >> 8) * 0x1p-24f; }

// The path winds.
float path_middle(float z) { return 0.75f * std::sin(0.34f * (z - 3.0f)) + 0.02f * z; }

struct GardenMaterials {
  int lawn, gravel, soil, stone, bark, plain, hedge, tree_leaves, hedge_leaves, shrub_leaves;
};

json rough(json pbr, float roughness) {
  pbr["metallicFactor"] = 0.0;
  pbr["roughnessFactor"] = roughness;
  return {{"pbrMetallicRoughness", pbr}};
}

Image8 mottled(Vec3 dark, Vec3 light, int cells, std::uint32_t seed) {
  return color_image(128, 128, [=](float u, float v) {
    return mix(dark, light, smooth_step(0.2f, 0.8f, noise(u, v, cells, 4, seed))) *
           (0.85f + 0.3f * noise(u, v, 48, 1, seed + 9));
  });
}

Image8 gravel_colors() {
  return color_image(256, 256, [](float u, float v) {
    const Cell c = cells(u, v, 30, 30, 0.8f, 311);
    const float tone = static_cast<float>(c.number * 7u % 13u) / 13.0f;
    return mix(Vec3(0.56f, 0.49f, 0.39f), Vec3(0.80f, 0.74f, 0.63f), tone) *
           (0.45f + 0.55f * smooth_step(0.02f, 0.22f, c.second - c.nearest));
  });
}
Image8 gravel_heights() {
  return grey_image(256, 256, [](float u, float v) {
    const Cell c = cells(u, v, 30, 30, 0.8f, 311);
    return smooth_step(0.0f, 0.45f, c.second - c.nearest) * (0.6f + 0.4f * static_cast<float>(c.number % 7u) / 7.0f);
  });
}
Image8 clods(int cells, std::uint32_t seed) {
  return grey_image(128, 128, [=](float u, float v) {
    return 0.55f * noise(u, v, cells, 2, seed) + 0.45f * noise(u, v, 4 * cells, 2, seed + 1);
  });
}

int add_leaf_material(Asset& asset, const char* name, Vec3 dark, Vec3 light) {
  json m = rough({{"baseColorTexture", texture_info(asset.add_data_texture(sprig_atlas(dark, light), name))}}, 0.55f);
  m["name"] = name;
  m["doubleSided"] = true;
  m["alphaMode"] = "MASK";
  m["alphaCutoff"] = 0.4;
  return asset.add_material(m);
}

GardenMaterials add_garden_materials(Asset& asset) {
  GardenMaterials m{};
  const auto textured = [&](const Image8& colors, const Image8& heights, const std::string& name, float roughness,
                            float scale) {
    const int color = asset.add_color_texture(colors, "garden_" + name),
              height = asset.add_data_texture(heights, "garden_" + name + "_h");
    return asset.add_material(displaced(rough({{"baseColorTexture", texture_info(color)}}, roughness), height, Vec2(1),
                                        scale, -0.5f * scale));
  };
  m.lawn =
      textured(mottled({0.17f, 0.31f, 0.07f}, {0.42f, 0.55f, 0.19f}, 20, 401), clods(24, 402), "lawn", 0.9f, 0.07f);
  m.gravel = textured(gravel_colors(), gravel_heights(), "gravel", 0.85f, 0.035f);
  m.soil =
      textured(mottled({0.17f, 0.12f, 0.08f}, {0.33f, 0.24f, 0.16f}, 12, 411), clods(12, 412), "soil", 0.95f, 0.10f);
  m.bark =
      textured(mottled({0.20f, 0.15f, 0.11f}, {0.42f, 0.34f, 0.26f}, 16, 421), clods(12, 422), "bark", 0.9f, 0.05f);
  m.hedge =
      textured(mottled({0.05f, 0.10f, 0.04f}, {0.18f, 0.28f, 0.09f}, 16, 431), clods(14, 432), "hedge", 0.9f, 0.12f);
  m.stone =
      textured(mottled({0.55f, 0.52f, 0.46f}, {0.74f, 0.70f, 0.62f}, 8, 441), clods(8, 442), "stone", 0.8f, 0.02f);
  json plain = rough({{"baseColorFactor", {1.0, 1.0, 1.0, 1.0}}}, 0.6f);
  plain["doubleSided"] = true;
  m.plain = asset.add_material(plain);
  m.tree_leaves = add_leaf_material(asset, "garden_tree_leaves", {0.17f, 0.31f, 0.08f}, {0.50f, 0.64f, 0.22f});
  m.hedge_leaves = add_leaf_material(asset, "garden_hedge_leaves", {0.10f, 0.23f, 0.08f}, {0.31f, 0.48f, 0.17f});
  m.shrub_leaves = add_leaf_material(asset, "garden_shrub_leaves", {0.20f, 0.33f, 0.18f}, {0.52f, 0.62f, 0.36f});
  return m;
}

Vec3 garden_light(const Shades& shades, Vec3 at) {
  return mix(Vec3(0.34f, 0.38f, 0.42f), Vec3(1.0f), sunlight(shades, at));
}

void add_garden_ground(Asset& asset, const GardenMaterials& m, const Shades& shades, Shadows shadows) {
  const bool cast = shadows == Shadows::kCast;
  Geometry lawn, gravel, soil;
  // Lines across at offsets from the path's middle.
  const std::vector<float> lines = {-16.0f, -11.0f, -8.0f, -6.0f, -4.8f, -3.6f, -2.7f, -kBed, -1.35f, -kPath, -0.25f,
                                    0.25f,  kPath,  1.35f, kBed,  2.7f,  3.6f,  4.8f,  6.0f,  8.0f,   11.0f,  16.0f};
  const auto corner = [&](float offset, float z, float scale, float tone) {
    const Vec3 p(path_middle(z) + offset, 0.0f, z);
    return Corner{p, Vec2(p.x, p.z) * scale, (cast ? Vec3(1.0f) : garden_light(shades, p + Vec3(0, 0.04f, 0))) * tone};
  };
  int row = 0;
  for (float z = kGardenNear; z > kGardenFar; z -= 0.75f, ++row)
    for (std::size_t c = 0; c + 1 < lines.size(); ++c) {
      const float middle = std::abs(lines[c] + lines[c + 1]) / 2;
      Geometry& g = middle < kPath ? gravel : middle < kBed ? soil : lawn;
      const float scale = middle < kPath ? 0.8f : 0.7f;
      const float tone = middle > kBed && (row & 1) ? 0.72f : 1.0f;  // the lawn is mown in stripes
      add_patch(g, {corner(lines[c], z, scale, tone), corner(lines[c + 1], z, scale, tone),
                    corner(lines[c], z - 0.75f, scale, tone), corner(lines[c + 1], z - 0.75f, scale, tone)});
    }
  // Stones along the path hide the gaps between displaced surfaces.
  Geometry stone;
  add_box(stone, {-0.07f, -0.05f, -0.17f}, {0.07f, 0.09f, 0.17f}, kNoBottom, 1.5f, Vec3(0.8f));
  Asset::Instances edging;
  for (float z = kGardenNear; z > kGardenFar; z -= 0.36f)
    for (const float offset : {-kPath, kPath, -kBed, kBed}) {
      const float slope = path_middle(z + 0.2f) - path_middle(z - 0.2f);
      edging.add({path_middle(z) + offset, 0.0f, z},
                 std::atan2(slope, 0.4f) +
                     0.1f * (random_unit(1, static_cast<std::uint32_t>(edging.translations.size())) - 0.5f),
                 1.0f);
    }
  asset.add_instances("edging", asset.add_mesh(lit(stone, shadows), m.stone), edging);
  asset.add_node(
      {{"name", "ground"},
       {"mesh", asset.add_mesh({{lawn, m.lawn}, {lit(gravel, shadows), m.gravel}, {lit(soil, shadows), m.soil}})}});
}

// A clipped hedge two metres long: a rough body and sprigs all over it.
std::vector<Part> hedge(const GardenMaterials& m) {
  Geometry body, sprigs;
  constexpr float kHalf = 1.02f, kThick = 0.30f, kTall = 0.66f;
  add_box(body, {-kHalf, -0.1f, -kThick + 0.06f}, {kHalf, kTall - 0.06f, kThick - 0.06f}, kNoBottom, 0.9f, Vec3(0.85f));
  for (std::uint32_t k = 0; k < 400; ++k) {
    const float along = (2.0f * random_unit(k, 21) - 1.0f) * (kHalf + 0.02f), pick = random_unit(k, 22),
                up = random_unit(k, 23);
    const bool top = pick < 0.36f;
    const float side = pick < 0.75f ? 1.0f : -1.0f;
    const Vec3 at = top ? Vec3(along, kTall - 0.08f, (2.0f * up - 1.0f) * kThick)
                        : Vec3(along, kTall * (up - 0.02f), side * (kThick - 0.07f));
    const Vec3 out = top ? Vec3(0, 1, 0) : Vec3(0, 0.25f, side);
    const Vec3 stray(random_unit(k, 24) - 0.5f, random_unit(k, 25) - 0.3f, random_unit(k, 26) - 0.5f);
    const Vec3 way = glm::normalize(out + stray * 1.7f);
    const float size = 0.11f + 0.06f * random_unit(k, 27), light = top ? 1.0f : 0.60f + 0.4f * up;
    add_sprig(sprigs, {at, way, glm::normalize(glm::cross(way, Vec3(stray.z, 0.3f, stray.x))), size, size * 0.9f, 0.2f,
                       k % 3 == 0 ? 1 : 2, Vec3(light)});
  }
  return {{body, m.hedge}, {sprigs, m.hedge_leaves}};
}

void add_hedges(Asset& asset, const GardenMaterials& m, Shades& shades, Shadows shadows) {
  const int mesh = asset.add_mesh(lit(hedge(m), shadows));
  Asset::Instances low, tall;
  for (float z = 4.0f; z > -12.0f; z -= 1.9f)
    for (const float side : {-1.0f, 1.0f}) {
      if (side > 0 && z > -5.0f && z < -2.0f) continue;  // a way through to the lawn
      const Vec3 at(path_middle(z) + side * (kBed + 0.42f), 0.0f, z);
      const float slope = path_middle(z + 0.5f) - path_middle(z - 0.5f);
      low.add(at, 0.25f * kTurn + std::atan(slope), 1.0f);
      shades.blocks.push_back({at - Vec3(0.3f, 0.0f, 1.0f), at + Vec3(0.3f, 0.8f, 1.0f)});
    }
  for (int k = -4; k <= 4; ++k) {
    const Vec3 at(5.6f * static_cast<float>(k), 0.0f, kGardenFar + 0.6f);
    tall.add(at, 0.5f * kTurn * static_cast<float>(k & 1), 2.9f);
  }
  asset.add_instances("hedge", mesh, low);
  asset.add_instances("tall hedge", mesh, tall);
}

// Times in seconds of the keys for all motion in the wind: at each of 24 frames, or at every second one of 62.
std::vector<float> wind_times(Shadows shadows) {
  const bool cast = shadows == Shadows::kCast;
  std::vector<float> times;
  for (int k = 0; k <= (cast ? 31 : 24); ++k) times.push_back(static_cast<float>(k) / (cast ? 12.0f : 24.0f));
  return times;
}

// Parts of a tree or shrub, and the skin by which the wind moves it.
struct Plant {
  int crown;
  Vec3 middle;  // of the crown, relative to the root
  int joints;
  float speed, swing;
};

void add_plant(Asset& asset, const Plant& plant, Vec3 at, float turn, float size, std::uint32_t seed, Shadows shadows) {
  const glm::quat turned = glm::angleAxis(turn, Vec3(0, 1, 0));
  const std::vector<float> times = wind_times(shadows);
  std::vector<int> joints;
  for (int j = 0; j < plant.joints; ++j) {
    const auto n = static_cast<std::uint32_t>(j);
    json node = {{"name", "twigs"}};
    if (j == 0) {
      node["translation"] = array_of(at + plant.middle * size);
      node["scale"] = {size, size, size};
    }
    joints.push_back(asset.add_node(node));
    const float phase = kTurn * random_unit(seed, 61 + n),
                speed = plant.speed * (0.7f + 0.6f * random_unit(seed, 81 + n)),
                swing = (j == 0 ? 0.35f : 1.0f) * plant.swing;
    const Vec3 axis = glm::normalize(Vec3(random_unit(seed, 101 + n) - 0.5f, 0.6f * random_unit(seed, 121 + n) - 0.3f,
                                          random_unit(seed, 141 + n) - 0.5f));
    std::vector<glm::quat> swings;
    for (const float t : times) {
      const glm::quat bend = glm::angleAxis(
          swing * (std::sin(kTurn * speed * t + phase) + 0.4f * std::sin(kTurn * 2.3f * speed * t)), axis);
      swings.push_back(j == 0 ? turned * bend : bend);
    }
    asset.animate(joints.back(), "rotation", times, swings);
  }
  asset.node(joints[0])["children"] = std::vector<int>(joints.begin() + 1, joints.end());
  const int skin = asset.add_skin(joints, std::vector<Mat4>(joints.size(), Mat4(1.0f)));
  asset.add_node({{"name", "crown"}, {"mesh", plant.crown}, {"skin", skin}});
}

void add_trees(Asset& asset, const GardenMaterials& m, Shades& shades, Shadows shadows) {
  const bool shaded = shadows == Shadows::kBaked;
  Geometry wood;
  const auto branch = [&](Vec3 a, Vec3 b, Vec3 c, Vec3 d, float thick, float thin) {
    add_tube(wood, {a, b, c, d}, thick, thin, 3.0f);
  };
  branch({0, -0.1f, 0}, {0.03f, 0.6f, 0}, {-0.08f, 1.2f, 0.04f}, {0.0f, 1.9f, 0.0f}, 0.17f, 0.10f);
  branch({0, 1.4f, 0}, {0.1f, 1.8f, 0.1f}, {0.4f, 2.2f, 0.2f}, {0.75f, 2.9f, 0.3f}, 0.08f, 0.025f);
  branch({0, 1.6f, 0}, {-0.1f, 2.0f, 0.0f}, {-0.5f, 2.3f, 0.1f}, {-0.8f, 2.8f, -0.2f}, 0.08f, 0.025f);
  branch({0, 1.8f, 0}, {0.05f, 2.2f, -0.1f}, {-0.1f, 2.6f, -0.2f}, {0.1f, 3.2f, -0.3f}, 0.09f, 0.02f);
  const int trunk = asset.add_mesh(lit(wood, shadows), m.bark);
  const Plant tree{asset.add_mesh(crown({920, {1.45f, 1.15f, 1.45f}, 0.25f, 9, 500, shaded}), m.tree_leaves),
                   {0, 2.75f, 0},
                   9,
                   1.1f,
                   0.055f};
  const struct {
    Vec3 at;
    float size;
  } places[] = {
      {{-3.9f, 0, -2.2f}, 1.4f}, {{5.0f, 0, -6.5f}, 1.3f}, {{-6.4f, 0, -10.0f}, 1.25f}, {{3.9f, 0, -13.0f}, 1.1f}};
  std::uint32_t seed = 1;
  for (const auto& p : places) {
    add_plant(asset, tree, p.at, 1.7f * static_cast<float>(seed), p.size, seed, shadows);
    asset.add_node(
        {{"name", "trunk"}, {"mesh", trunk}, {"translation", array_of(p.at)}, {"scale", {p.size, p.size, p.size}}});
    shades.crowns.push_back({p.at + tree.middle * p.size, Vec3(1.45f, 1.15f, 1.45f) * p.size});
    ++seed;
  }
  // Woods behind the hedge do not move: they are far away.
  Asset::Instances woods;
  for (std::uint32_t k = 0; k < 30; ++k)
    woods.add({-23.0f + 3.2f * static_cast<float>(k % 15) + 2.0f * random_unit(k, 31), 2.6f + 2.2f * random_unit(k, 32),
               kGardenFar - 4.0f - 2.5f * static_cast<float>(k / 15) - 2.0f * random_unit(k, 33)},
              kTurn * random_unit(k, 34), 2.2f + 0.9f * random_unit(k, 35));
  asset.add_instances("woods", asset.add_mesh(crown({520, {1.3f, 1.35f, 1.3f}, 0.26f, 1, 520, shaded}), m.hedge_leaves),
                      woods);

  const Plant shrub{asset.add_mesh(crown({190, {0.62f, 0.55f, 0.62f}, 0.24f, 6, 540, shaded}), m.shrub_leaves),
                    {0, 0.45f, 0},
                    6,
                    1.5f,
                    0.09f};
  const Vec3 shrubs[] = {{-3.5f, 0, 1.7f}, {3.7f, 0, -0.5f}, {3.4f, 0, -8.6f}, {-3.4f, 0, -7.5f}, {6.0f, 0, -2.2f}};
  for (const Vec3& at : shrubs) {
    add_plant(asset, shrub, at, 2.1f * static_cast<float>(seed), 0.9f + 0.3f * random_unit(seed, 36), seed, shadows);
    shades.crowns.push_back({at + shrub.middle, Vec3(0.6f, 0.5f, 0.6f)});
    ++seed;
  }
}

// Adds instances of one mesh that sway together.
void add_swaying(Asset& asset, const std::string& name, int mesh, const Asset::Instances& places, std::uint32_t seed,
                 Shadows shadows) {
  const int node = asset.add_instances(name, mesh, places);
  const std::vector<float> times = wind_times(shadows);
  const float phase = kTurn * random_unit(seed, 41), other = kTurn * random_unit(seed, 42),
              speed = 1.0f + 0.6f * random_unit(seed, 43);
  std::vector<float> weights;
  for (const float t : times) {
    weights.push_back(0.35f + 0.65f * std::sin(kTurn * speed * t + phase));
    weights.push_back(std::sin(kTurn * 1.7f * speed * t + other));
  }
  asset.animate_weights(node, times, weights);
}

void add_flowers(Asset& asset, const GardenMaterials& m, Shadows shadows) {
  const Species species[] = {
      {{0.72f, 0.03f, 0.02f}, {0.02f, 0.02f, 0.02f}, 5, 0.052f, 0.50f, 0.55f, 601},   // poppies
      {{0.85f, 0.83f, 0.78f}, {0.75f, 0.48f, 0.03f}, 11, 0.046f, 0.38f, 0.10f, 602},  // daisies
      {{0.10f, 0.13f, 0.45f}, {0.05f, 0.03f, 0.20f}, 9, 0.042f, 0.46f, 0.45f, 603},   // cornflowers
      {{0.86f, 0.50f, 0.03f}, {0.45f, 0.14f, 0.02f}, 8, 0.050f, 0.34f, 0.25f, 604},   // marigolds
      {{0.70f, 0.16f, 0.42f}, {0.80f, 0.60f, 0.12f}, 6, 0.050f, 0.56f, 0.60f, 605}};  // cosmos
  constexpr std::uint32_t kSpecies = 5, kBreaths = 3;
  std::vector<int> meshes;
  for (const Species& s : species) meshes.push_back(asset.add_mesh(flowers(s, 8), m.plain));
  std::vector<Asset::Instances> clumps(kSpecies * kBreaths);
  std::uint32_t n = 0;
  for (float z = 4.6f; z > -12.0f; z -= 0.33f)
    for (const float side : {-1.0f, 1.0f})
      for (const float row : {0.95f, 1.25f, 1.55f, 1.82f}) {
        const std::uint32_t number = hash32(700, n++);
        // Drifts of one kind, with strays.
        const auto drift =
            static_cast<std::uint32_t>(std::floor((z + 40.0f) / 1.7f + (row > 1.4f ? 0.5f : 0.0f))) * 3u +
            (side > 0 ? 2u : 0u) + (row > 1.4f ? 1u : 0u);
        const std::uint32_t kind = number % 9u == 0 ? number / 9u % kSpecies : drift % kSpecies;
        if (random_unit(number, 51) < 0.22f) continue;
        const Vec3 at(path_middle(z) + side * (row + 0.16f * (random_unit(number, 52) - 0.5f)), -0.01f,
                      z + 0.2f * (random_unit(number, 53) - 0.5f));
        clumps[kind * kBreaths + number / 64u % kBreaths].add(
            at, kTurn * random_unit(number, 54), 0.75f + 0.4f * random_unit(number, 55) + (row > 1.4f ? 0.15f : 0.0f));
      }
  for (std::uint32_t k = 0; k < clumps.size(); ++k)
    add_swaying(asset, "flowers", meshes[k / kBreaths], clumps[k], 800 + k, shadows);
}

void add_grass(Asset& asset, const GardenMaterials& m, Shadows shadows) {
  constexpr std::uint32_t kBreaths = 6;
  std::vector<Asset::Instances> tufts(kBreaths);
  std::uint32_t n = 0;
  const auto add = [&](Vec3 at, float size) {
    tufts[hash32(901, n) % kBreaths].add(at, kTurn * random_unit(n, 56), size);
    ++n;
  };
  // Leaves between the flowers, and tufts on the lawn.
  for (float z = 4.8f; z > -12.0f; z -= 0.30f)
    for (const float side : {-1.0f, 1.0f})
      for (const float row : {1.05f, 1.65f})
        add({path_middle(z) + side * (row + 0.2f * (random_unit(n, 57) - 0.5f)), -0.02f, z}, 1.3f);
  for (std::uint32_t k = 0; k < 150; ++k) {
    const float z = 3.0f - 15.0f * random_unit(k, 58), side = k & 1 ? 1.0f : -1.0f;
    add({path_middle(z) + side * (kBed + 0.85f + 4.0f * random_unit(k, 59)), -0.01f, z},
        0.55f + 0.4f * random_unit(k, 60));
  }
  const int mesh = asset.add_mesh(grass(22, 0.2f, 0.24f, 910), m.plain);
  for (std::uint32_t k = 0; k < kBreaths; ++k) add_swaying(asset, "grass", mesh, tufts[k], 920 + k, shadows);
}

// A stone basin where the path ends.
void add_basin(Asset& asset, Shades& shades) {
  const Geometry basin = revolve(smooth_profile({{0.42f, -0.05f},
                                                 {0.40f, 0.10f},
                                                 {0.20f, 0.18f},
                                                 {0.15f, 0.45f},
                                                 {0.16f, 0.72f},
                                                 {0.30f, 0.82f},
                                                 {0.60f, 0.98f},
                                                 {0.66f, 1.06f},
                                                 {0.60f, 1.08f},
                                                 {0.45f, 0.99f},
                                                 {0.0f, 0.92f}},
                                                false, true));
  const int stone = asset.add_material(rough({{"baseColorFactor", {0.55, 0.52, 0.45, 1.0}}}, 0.7f));
  const int water = asset.add_material(rough({{"baseColorFactor", {0.02, 0.05, 0.06, 1.0}}}, 0.06f));
  const Vec3 at(path_middle(-13.2f), 0.0f, -13.2f);
  Geometry surface;
  add_box(surface, {-0.42f, 1.0f, -0.42f}, {0.42f, 1.035f, 0.42f}, 8u, 1.0f);
  asset.add_node({{"name", "basin"},
                  {"mesh", asset.add_mesh({{basin, stone}, {surface, water}})},
                  {"translation", array_of(at)},
                  {"scale", {1.35, 1.35, 1.35}}});
  shades.blocks.push_back({at - Vec3(0.4f, 0, 0.4f), at + Vec3(0.4f, 1.3f, 0.4f)});
}

void add_garden_view(Asset& asset, const std::vector<float>& times) {
  std::vector<Vec3> eyes, targets;
  for (const float t : times) {
    eyes.emplace_back(path_middle(6.6f) + 0.10f + 0.12f * t, 1.42f, 6.6f - 0.25f * t);
    targets.emplace_back(-0.10f, 0.85f, -1.5f);
  }
  json view = look_at(eyes.front(), targets.front());
  view["camera"] =
      asset.add_camera({{"type", "perspective"}, {"perspective", {{"yfov", 0.72}, {"znear", 0.1}, {"zfar", 900.0}}}});
  animate_look(asset, asset.add_node(view), times, eyes, targets);
  asset.capture_settings() = {{"resolution", {1280, 720}}, {"frameRate", 24},
                              {"shutter", {0.0, 0.5}},     {"frames", {{"first", 5}, {"count", 1}}},
                              {"environment", 0.6},        {"exposure", 1.05}};
}

// Adds a dim blue night and eight spot lights, which all cast: four on posts beside the path, two that hang in trees
// and swing, one below a tree, one towards the basin. All are narrow enough for a single map.
void add_lamps_and_night(Asset& asset) {
  add_sky(asset, {"sky_night", {0.07f, 0.10f, 0.20f}, {0.16f, 0.20f, 0.32f}, {0.24f, 0.27f, 0.36f}, 0.7f});
  Lanterns lanterns(asset);
  json& cast = asset.capture_settings()["shadows"];
  const auto casts = [&](int light, int size) { cast.push_back({{"light", light}, {"size", size}}); };
  const auto beside = [](float z, float side) { return Vec3(path_middle(z) + side, 0.0f, z); };
  const struct { float z, side; } posts[] = {{3.2f, 1.98f}, {0.2f, -1.98f}, {-3.9f, 1.98f}, {-7.6f, -1.98f}};
  for (const auto& [z, side] : posts)
    casts(lanterns.add_on_post(beside(z, side), 1.75f, beside(z - 0.5f, 0.0f), {22.0f, 38.0f, 56.0f}), 1024);
  const std::vector<float> times = wind_times(Shadows::kCast);
  casts(lanterns.add_on_cord({-2.7f, 3.9f, -1.2f}, 1.7f, {40.0f, 40.0f, 58.0f}, times, 0.4f), 1024);
  casts(lanterns.add_on_cord({3.9f, 4.1f, -5.7f}, 1.3f, {90.0f, 40.0f, 58.0f}, times, 2.1f), 1024);
  casts(lanterns.add_from_below({-5.1f, 0.15f, -8.6f}, {-6.4f, 3.4f, -10.0f}, {110.0f, 30.0f, 45.0f}), 512);
  const Vec3 basin(path_middle(-13.2f), 1.0f, -13.2f);
  casts(lanterns.add_on_post(basin + Vec3(-1.5f, -1.0f, 2.0f), 2.3f, basin, {40.0f, 22.0f, 34.0f}), 512);
  // The moon is too weak to show shadows, so it casts none.
  add_sun(asset, {0.6f, Vec3(0.5f, 0.7f, 0.2f), {0.55, 0.70, 1.0}});
  json& settings = asset.capture_settings();
  settings["exposure"] = 1.3;
  asset.set_environment(
      16, 8,
      [](Vec3 way) {
        return way.y < 0 ? Vec3(0.045f, 0.055f, 0.06f)
                         : mix(Vec3(0.15f, 0.20f, 0.36f), Vec3(0.09f, 0.12f, 0.23f), way.y);
      },
      "night");
}

void write_garden(const std::string& name, Shadows shadows, const std::filesystem::path& folder) {
  Asset asset(name);
  const GardenMaterials materials = add_garden_materials(asset);
  Shades shades;
  add_hedges(asset, materials, shades, shadows);
  add_trees(asset, materials, shades, shadows);
  add_basin(asset, shades);
  add_garden_ground(asset, materials, shades, shadows);
  add_flowers(asset, materials, shadows);
  add_grass(asset, materials, shadows);
  if (shadows == Shadows::kBaked) {
    add_sky(asset);
    add_sun(asset, {4.8f});
  }
  add_garden_view(asset, wind_times(shadows));
  if (shadows == Shadows::kCast) add_lamps_and_night(asset);
  asset.write(folder);
}

}  // namespace

void make_garden(const std::filesystem::path& folder) { write_garden("garden", Shadows::kBaked, folder); }
void make_garden_lamps(const std::filesystem::path& folder) { write_garden("garden_lamps", Shadows::kCast, folder); }

}  // namespace tessera::captures
