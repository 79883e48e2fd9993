#include "tests/fuzz/seeds.h"

#include <cstring>
#include <fstream>
#include <iterator>

#include "shaders_cpp/procedures/program.h"
#include "tests/fuzz/document_mutator.h"
#include "tests/support/captures.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/pass_assets.h"
#include "tests/support/programs.h"

namespace tessera::fuzz {
namespace {

using nlohmann::json;

// Removes references to textures. Without buffers and textures a shipped capture is small and still has its nodes,
// lights, lens, animation-free materials and procedures.
void drop_textures(json& value) {
  if (value.is_array())
    for (json& v : value) drop_textures(v);
  if (!value.is_object()) return;
  for (auto at = value.begin(); at != value.end();) {
    const bool texture = at.key().ends_with("Texture") || at.key() == "TESSERA_displacement";
    if (!texture) drop_textures(at.value());
    at = texture ? value.erase(at) : std::next(at);
  }
}

std::string without_buffers(const std::string& glb) {
  std::uint32_t length = 0;
  std::memcpy(&length, glb.data() + 12, 4);
  json document = json::parse(glb.substr(20, length));
  for (const char* part :
       {"accessors", "bufferViews", "buffers", "images", "textures", "samplers", "meshes", "skins", "animations"})
    document.erase(part);
  if (document.contains("nodes"))
    for (json& node : document["nodes"]) node.erase("mesh"), node.erase("skin"), node.erase("weights");
  drop_textures(document);
  return document.dump();
}

std::string procedure_capture(const json& procedure) {
  return json{{"asset", {{"version", "2.0"}}},
              {"extensionsUsed", {"TESSERA_procedure"}},
              {"scenes", {{{"nodes", {0}}}}},
              {"nodes", {{{"extensions", {{"TESSERA_procedure", procedure}}}}}}}
      .dump();
}

// A cube of six quads as a control cage, with creases.
std::string cage_capture() {
  test::GltfAsset asset;
  std::vector<float> points;
  for (int p = 0; p < 8; ++p)
    for (int axis = 0; axis < 3; ++axis) points.push_back(static_cast<float>((p >> axis) & 1));
  std::vector<std::uint16_t> indices;
  for (const auto& quad : {std::array{0, 2, 3, 1}, std::array{4, 5, 7, 6}, std::array{0, 1, 5, 4},
                           std::array{2, 6, 7, 3}, std::array{0, 4, 6, 2}, std::array{1, 3, 7, 5}})
    for (const std::size_t k : {0u, 1u, 2u, 0u, 2u, 3u}) indices.push_back(static_cast<std::uint16_t>(quad[k]));
  const int positions = asset.add_accessor("VEC3", points), list = asset.add_accessor("SCALAR", indices);
  asset.add("meshes", {{"primitives",
                        {{{"attributes", {{"POSITION", positions}}},
                          {"indices", list},
                          {"extensions", {{"TESSERA_subdivision", {{"levels", 1}, {"quads", 6}}}}}}}}});
  asset.add("nodes", {{"mesh", 0}});
  asset.document["extensionsUsed"] = {"TESSERA_subdivision"};
  return asset.glb();
}

// A moving, displaced patch in front of a lens: everything_asset(), small enough to render.
std::string moving_capture() {
  test::GltfAsset asset = test::everything_asset();
  asset.document["extensions"]["TESSERA_capture"]["shutter"] = {0, 20};
  asset.document["animations"][0]["channels"].push_back(
      {{"sampler", 0}, {"target", {{"node", 5}, {"path", "translation"}}}});
  return asset.glb();
}

// A capture with many mistakes of exporters, each of which has one possible meaning.
std::string erring_capture() {
  test::GltfAsset asset = test::everything_asset();
  json& d = asset.document;
  d["scenes"][0]["nodes"] = {0, 3, 3};
  json& attributes = d["meshes"][0]["primitives"][0]["attributes"];
  attributes["COLOUR"] = test::kPositions;
  attributes["TEXCOORD_2"] = attributes["TEXCOORD_0"];
  attributes.erase("TEXCOORD_0");
  d["meshes"][0]["primitives"][0]["targets"][0]["TANGENT"] = test::kMorph;
  d["meshes"][0]["weights"] = {0.5, 1, 2};
  d["accessors"][test::kIndices]["normalized"] = true;
  d["nodes"][3]["skin"] = 0;
  d["nodes"][7]["scale"] = {1, 1, 1};
  d["textures"][0] = {{"extensions", {{"MADE_up", {{"source", 0}}}}}};
  d["bufferViews"].push_back({{"buffer", 0}, {"byteLength", 0}, {"target", 1}});
  return asset.glb();
}

// Channels that move materials, cameras, lights and visibility.
std::string pointing_capture() {
  test::GltfAsset asset = test::everything_asset();
  json& d = asset.document;
  d["nodes"][2]["extensions"]["KHR_node_visibility"] = {{"visible", true}};
  d["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"]["KHR_texture_transform"] = {
      {"rotation", 1}};
  const int times = asset.add_accessor<float>("SCALAR", {0, 1}), one = asset.add_accessor<float>("SCALAR", {0.5f, 1}),
            two = asset.add_accessor<float>("VEC2", {0, 0, 1, 1}),
            flags = asset.add_accessor<std::uint8_t>("SCALAR", {1, 0});
  json channels = json::array();
  const auto add = [&](const char* pointer, int sampler) {
    channels.push_back(
        {{"sampler", sampler},
         {"target", {{"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", {{"pointer", pointer}}}}}}}});
  };
  add("/materials/0/pbrMetallicRoughness/roughnessFactor", 0);
  add("/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/offset", 1);
  add("/cameras/0/perspective/yfov", 0);
  add("/extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle", 0);
  add("/nodes/2/extensions/KHR_node_visibility/visible", 2);
  const std::size_t coil = d["nodes"].size();
  d["nodes"].push_back({{"extensions",
                         {{"TESSERA_procedure",
                           {{"shape", "revolution"},
                            {"parameters", {{"profile", {{0, 0}, {1, 0}, {1, 1}, {0, 1}}}}},
                            {"texture", {{"pattern", "checker"}}},
                            {"tessellation", {{"min", 2}, {"max", 8}}}}}}}});
  d["scenes"][0]["nodes"].push_back(coil);
  const std::string procedure = "/nodes/" + std::to_string(coil) + "/extensions/TESSERA_procedure/";
  add((procedure + "parameters/profile").c_str(), 3);
  add((procedure + "texture/repeat").c_str(), 1);
  const int curve = asset.add_accessor<float>("VEC2", {0, 0, 1, 0, 1, 1, 0, 1, 0, 0, 2, 0, 2, 1, 0, 1});
  d["animations"].push_back({{"channels", channels},
                             {"samplers",
                              {{{"input", times}, {"output", one}},
                               {{"input", times}, {"output", two}},
                               {{"input", times}, {"output", flags}, {"interpolation", "STEP"}},
                               {{"input", times}, {"output", curve}}}}});
  return asset.glb();
}

// Points, and lines of each mode.
std::string wire_capture() {
  test::GltfAsset asset;
  const int positions = asset.add_accessor<float>("VEC3", {0, 0, 0, 1, 0, 0, 1, 1, 0.5f}),
            normals = asset.add_accessor<float>("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1}),
            list = asset.add_accessor<std::uint8_t>("SCALAR", {0, 1, 2, 0});
  json primitives = json::array();
  for (int mode = 0; mode < 4; ++mode)
    primitives.push_back({{"mode", mode}, {"attributes", {{"POSITION", positions}}}});
  primitives[1]["attributes"]["NORMAL"] = normals;
  primitives[2]["indices"] = list;
  asset.add("meshes", {{"primitives", primitives}});
  asset.add("nodes", {{"mesh", 0}});
  return asset.glb();
}

// Lights that cast shadows, and passes.
std::string casting_capture(bool passes) {
  test::GltfAsset asset = test::everything_asset();
  json& settings = asset.document["extensions"]["TESSERA_capture"];
  asset.document["extensions"]["KHR_lights_punctual"]["lights"].push_back({{"type", "directional"}});
  settings["shadows"] = {{{"light", 1}, {"size", 64}, {"cascades", 2}, {"distance", 50}}, {{"light", 0}}};
  if (passes) settings.update(test::deferred_passes());
  return asset.glb();
}

}  // namespace

std::vector<std::string> small_captures() {
  std::vector<std::string> all = {test::everything_asset().glb(),
                                  test::everything_asset().gltf(),
                                  test::draco_asset(true).glb(),
                                  test::draco_asset(false).glb(),
                                  test::everything_asset().gltf_with_file("beside.bin"),
                                  cage_capture(),
                                  moving_capture(),
                                  erring_capture(),
                                  pointing_capture(),
                                  wire_capture(),
                                  casting_capture(false),
                                  casting_capture(true)};
  for (const char* name : {"city", "city_evening", "corridor", "eggs", "flyby", "garden", "garden_lamps", "serpent",
                           "stroll", "vases", "workshop"})
    all.push_back(without_buffers(test::read_text(test::shipped_capture(name))));
  for (const shaders::StageDeclaration& shape : shaders::shape_declarations())
    all.push_back(procedure_capture({{"shape", shape.name}}));
  const auto& programs = test::builtin_programs();
  const std::string together = programs.at("torus") + programs.at("marble") + programs.at("bounded");
  all.push_back(procedure_capture({{"program", together}, {"parameters", {{"minorRadius", 0.5}}}}));
  const json path = {{0, 0}, {1, 0}, {2, 0}, {3, 0}}, profile = {{1, 0}, {1, 1}, {0, 1}, {-1, 0}};
  all.push_back(procedure_capture({{"shape", "sweptCubic"}, {"parameters", {{"path", path}, {"profile", profile}}}}));
  all.push_back(procedure_capture({{"shape", "torus"},
                                   {"parameters", {{"minorRadius", 0.5}}},
                                   {"texture", {{"pattern", "checker"}, {"repeat", {3, 4}}}},
                                   {"shading", {{"model", "phong"}, {"exponent", 64}}}}));
  return all;
}

}  // namespace tessera::fuzz
