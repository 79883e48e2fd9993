#include <cmath>

#include "captures/sources/asset.h"
#include "captures/sources/scenes.h"

namespace tessera::captures {
namespace {

using nlohmann::json;

json factors(Vec3 color, float metallic, float roughness, bool double_sided = false) {
  json material = {{"pbrMetallicRoughness",
                    {{"baseColorFactor", {color.x, color.y, color.z, 1.0}},
                     {"metallicFactor", metallic},
                     {"roughnessFactor", roughness}}}};
  if (double_sided) material["doubleSided"] = true;
  return material;
}

json plain(Vec3 color) { return {{"pattern", "plain"}, {"color", array_of(color)}}; }
json marble(Vec3 color, Vec3 veins, float frequency, float bend) {
  return {{"pattern", "marble"},
          {"color", array_of(color)},
          {"second", array_of(veins)},
          {"frequency", frequency},
          {"bend", bend}};
}
json wood(Vec3 early, Vec3 late, float rings, float bend) {
  return {
      {"pattern", "wood"}, {"color", array_of(early)}, {"second", array_of(late)}, {"rings", rings}, {"bend", bend}};
}

// A circle of four cubic curves, counter-clockwise (to 2.7e-4 of the radius).
json circle(float radius) {
  constexpr float kArc = 0.5522847498f;
  json points = json::array();
  const float c[5][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 0}};
  for (int k = 0; k < 4; ++k) {
    const float* a = c[k];
    const float* b = c[k + 1];
    points.push_back({radius * a[0], radius * a[1]});
    points.push_back({radius * (a[0] + kArc * b[0]), radius * (a[1] + kArc * b[1])});
    points.push_back({radius * (b[0] + kArc * a[0]), radius * (b[1] + kArc * a[1])});
  }
  points.push_back({radius, 0});
  return points;
}

struct Stand {
  Vec3 at{0.0f};
  glm::quat turn{1, 0, 0, 0};
};

glm::quat about(Vec3 axis, float degrees) { return glm::angleAxis(glm::radians(degrees), glm::normalize(axis)); }

void add(Asset& asset, const char* name, const Stand& place, json procedure) {
  asset.add_node({{"name", name},
                  {"translation", array_of(place.at)},
                  {"rotation", array_of(place.turn)},
                  {"extensions", {{"TESSERA_procedure", std::move(procedure)}}}});
}

// The handle of a jug or cup: a tube swept along a curve in a vertical plane with coordinates (x, y); it starts and ends inside the wall.
void add_handle(Asset& asset, const Stand& place, const json& path, float radius, const json& texture,
                const json& shading, int material) {
  // The shape's path lies in its xz plane: z becomes up.
  add(asset, "handle", {place.at, place.turn * about({1, 0, 0}, -90)},
      {{"shape", "sweptCubic"},
       {"parameters", {{"path", path}, {"profile", circle(radius)}}},
       {"texture", texture},
       {"shading", shading},
       {"material", material}});
}

// A shell as a geometry image: a tube that widens along a spiral, sampled once on a grid of points.
std::vector<Vec3> shell_points(int width, int height) {
  std::vector<Vec3> points;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      const float v = static_cast<float>(j) / static_cast<float>(height - 1),
                  around = 6.2831853f * static_cast<float>(i % (width - 1)) / static_cast<float>(width - 1);
      const float angle = 6.2831853f * 2.6f * v, grow = std::exp(1.9f * (v - 1.0f));
      const float ribs = 1.0f + 0.05f * std::sin(angle * 9.0f), tube = 0.62f * grow * ribs;
      const float radius = 0.75f * grow + tube * std::cos(around);
      points.push_back(
          {radius * std::cos(angle), 1.5f * (1.0f - grow) + tube * std::sin(around), -radius * std::sin(angle)});
    }
  return points;
}

struct Materials {
  int glazed, matt, brass, steel, polished, cloth;
};

Materials add_materials(Asset& asset) {
  Materials m{};
  m.glazed = asset.add_material(factors(Vec3(1.0f), 0.0f, 0.22f, true));
  m.matt = asset.add_material(factors(Vec3(1.0f), 0.0f, 0.75f));
  m.brass = asset.add_material(factors(Vec3(0.95f, 0.72f, 0.35f), 1.0f, 0.24f));
  m.steel = asset.add_material(factors(Vec3(0.75f, 0.77f, 0.80f), 1.0f, 0.22f));
  m.polished = asset.add_material(factors(Vec3(1.0f), 0.0f, 0.3f));
  m.cloth = asset.add_material(factors(Vec3(1.0f), 0.0f, 0.95f, true));
  return m;
}

json by_material() { return {{"model", "material"}}; }
json phong() { return {{"model", "phong"}, {"ambient", 0.4}, {"diffuse", 0.32}, {"specular", 0.25}, {"exponent", 48}}; }

void add_room(Asset& asset, const Materials& m) {
  // Table: local y runs along the boards, the rings' axis lies below the top.
  add(asset, "table", {Vec3(0, -3.0f, 0), about({0, 0, 1}, -90)},
      {{"shape", "bilinearPatch"},
       {"parameters", {{"corners", {-3.0, -9, 5, -3.0, 9, 5, -3.0, -9, -4, -3.0, 9, -4}}}},
       {"texture", wood(Vec3(0.50f, 0.28f, 0.13f), Vec3(0.24f, 0.11f, 0.05f), 2.2f, 0.5f)},
       {"shading", by_material()},
       {"material", m.polished}});
  // Backdrop: cloth in soft folds.
  add(asset, "cloth", {Vec3(0, 3.2f, -3.9f), about({1, 0, 0}, 90)},
      {{"shape", "heightField"},
       {"parameters",
        {{"size", {20, 9}}, {"amplitude", 0.55}, {"frequency", 5}, {"octaves", 3}, {"gain", 0.33}, {"seed", 3}}},
       {"texture", plain(Vec3(0.16f, 0.22f, 0.26f))},
       {"shading", by_material()},
       {"material", m.cloth}});
}

void add_pottery(Asset& asset, const Materials& m) {
  const json blue = marble(Vec3(0.75f, 0.80f, 0.85f), Vec3(0.02f, 0.08f, 0.28f), 1.6f, 2.0f);
  const Stand vase{Vec3(-2.5f, 0.0f, -0.8f)};
  const json profile = {{0.0, 0.02},  {0.25, 0.02}, {0.45, 0.0},  {0.52, 0.05}, {0.75, 0.25},
                        {1.30, 0.75}, {1.05, 1.70}, {0.90, 2.25}, {0.42, 2.35}, {0.40, 2.75},
                        {0.39, 2.95}, {0.50, 3.05}, {0.62, 3.12}};
  add(asset, "vase", vase,
      {{"shape", "revolution"},
       {"parameters", {{"profile", profile}}},
       {"texture", blue},
       {"shading", by_material()},
       {"material", m.glazed}});
  const json ear = {{0.42, 2.70}, {0.85, 2.95}, {1.35, 2.75}, {1.32, 2.15}, {1.30, 1.85}, {1.20, 1.75}, {0.98, 1.68}};
  add_handle(asset, vase, ear, 0.075f, blue, by_material(), m.glazed);
  add_handle(asset, {vase.at, about({0, 1, 0}, 180)}, ear, 0.075f, blue, by_material(), m.glazed);

  const Stand cup{Vec3(2.55f, 0.0f, 0.9f), about({0, 1, 0}, -35)};
  const json clay = plain(Vec3(0.62f, 0.16f, 0.09f));
  const json wall = {{0.0, 0.03},  {0.2, 0.03},  {0.45, 0.0},  {0.55, 0.03}, {0.70, 0.10}, {0.68, 0.80}, {0.70, 1.22},
                     {0.71, 1.29}, {0.62, 1.29}, {0.62, 1.22}, {0.60, 0.70}, {0.62, 0.14}, {0.0, 0.14}};
  add(asset, "cup", cup,
      {{"shape", "revolution"},
       {"parameters", {{"profile", wall}}},
       {"texture", clay},
       {"shading", phong()},
       {"material", m.glazed}});
  add_handle(asset, cup,
             {{0.62, 1.05}, {0.95, 1.15}, {1.25, 0.95}, {1.18, 0.62}, {1.12, 0.38}, {0.95, 0.25}, {0.62, 0.30}}, 0.07f,
             clay, phong(), m.glazed);
}

void add_metal(Asset& asset, const Materials& m) {
  const Stand spring{Vec3(0.75f, 0.10f, -0.9f)};
  add(asset, "spring", spring,
      {{"shape", "spring"},
       {"parameters", {{"radius", 0.62}, {"wireRadius", 0.1}, {"height", 2.3}, {"turns", 7}}},
       {"texture", plain(Vec3(1.0f))},
       {"shading", by_material()},
       {"material", m.steel}});
  for (const float y : {0.0f, 2.3f})  // rounded ends of the wire
    add(asset, "end of the spring", {spring.at + Vec3(0.62f, y, 0)},
        {{"shape", "sphere"},
         {"parameters", {{"radius", 0.1}}},
         {"texture", plain(Vec3(1.0f))},
         {"shading", by_material()},
         {"material", m.steel}});
  add(asset, "ring", {Vec3(0.55f, 0.22f, 1.7f)},
      {{"shape", "torus"},
       {"parameters", {{"majorRadius", 0.75}, {"minorRadius", 0.22}}},
       {"shading", by_material()},
       {"material", m.brass}});
  add(asset, "leaning ring", {Vec3(-0.75f, 0.98f, -1.35f), about({1, 0, 0}, 74) * about({0, 1, 0}, 20)},
      {{"shape", "torus"},
       {"parameters", {{"majorRadius", 0.82}, {"minorRadius", 0.14}}},
       {"shading", by_material()},
       {"material", m.brass}});
}

void add_turned_pieces(Asset& asset, const Materials& m) {
  add(asset, "marble ball", {Vec3(-0.85f, 0.62f, 0.75f), about({1, 0, 1}, 40)},
      {{"shape", "sphere"},
       {"parameters", {{"radius", 0.62}}},
       {"texture", marble(Vec3(0.85f, 0.83f, 0.78f), Vec3(0.10f, 0.16f, 0.10f), 2.4f, 1.6f)},
       {"shading", by_material()},
       {"material", m.polished}});
  add(asset, "wooden ball", {Vec3(0.55f, 0.38f, 1.7f), about({1, 0.3f, 0}, 65)},
      {{"shape", "sphere"},
       {"parameters", {{"radius", 0.46}}},
       {"texture", wood(Vec3(0.62f, 0.38f, 0.18f), Vec3(0.30f, 0.13f, 0.05f), 9.0f, 0.6f)},
       {"shading", by_material()},
       {"material", m.polished}});
  add(asset, "checkered ball", {Vec3(4.15f, 0.5f, -0.9f), about({0.3f, 0, 1}, 25)},
      {{"shape", "sphere"},
       {"parameters", {{"radius", 0.5}}},
       {"texture",
        {{"pattern", "checker"}, {"color", {0.85, 0.80, 0.70}}, {"second", {0.05, 0.06, 0.08}}, {"repeat", {12, 8}}}},
       {"shading", phong()},
       {"material", m.polished}});
  add(asset, "pin", {Vec3(2.75f, 0.0f, -1.7f)},
      {{"shape", "cylinder"},
       {"parameters", {{"radius", 0.42}, {"topRadius", 0.12}, {"height", 2.6}}},
       {"texture",
        {{"pattern", "checker"},
         {"color", {0.75, 0.12, 0.08}},
         {"second", {0.85, 0.80, 0.72}},
         {"repeat", {1, 7}},
         {"blur", 0.05}}},
       {"shading", by_material()},
       {"material", m.matt}});
  add(asset, "shell", {Vec3(-2.35f, 0.5f, 1.75f), about({0, 0, 1}, 70) * about({0, 1, 0}, 60)},
      {{"shape", "geometryImage"},
       {"parameters", {{"scale", 0.5}}},
       {"image", {{"positions", asset.add_points(shell_points(65, 257))}, {"width", 65}}},
       {"texture", marble(Vec3(0.88f, 0.70f, 0.55f), Vec3(0.55f, 0.24f, 0.14f), 0.8f, 0.6f)},
       {"shading", by_material()},
       {"material", m.glazed}});
}

void add_workshop_view(Asset& asset) {
  const int camera = asset.add_camera({{"type", "perspective"}, {"perspective", {{"yfov", 0.46}, {"znear", 0.1}}}});
  json eye = look_at(Vec3(0.6f, 3.6f, 10.5f), Vec3(0.05f, 1.05f, 0.0f));
  eye["camera"] = camera;
  const int camera_node = asset.add_node(eye);
  json sun = look_at(Vec3(-4, 6, 6), Vec3(0, 0, 0));
  sun["extensions"]["KHR_lights_punctual"]["light"] =
      asset.add_light({{"type", "directional"}, {"color", {1.0, 0.93, 0.82}}, {"intensity", 2.2}});
  asset.add_node(sun);
  asset.capture_settings() = {{"resolution", {1280, 720}},
                              {"camera", camera_node},
                              {"environment", 0.75},
                              {"frames", {{"first", 0}, {"count", 1}}}};
}

}  // namespace

void make_workshop(const std::filesystem::path& folder) {
  Asset asset("workshop");
  const Materials materials = add_materials(asset);
  add_room(asset, materials);
  add_pottery(asset, materials);
  add_metal(asset, materials);
  add_turned_pieces(asset, materials);
  add_workshop_view(asset);
  asset.write(folder);
}

}  // namespace tessera::captures
