#include "tests/support/gltf_asset.h"

#include "base/image_codec.h"
#include "replay/pack/draco_encoder.h"

namespace tessera::test {

using nlohmann::json;

int GltfAsset::add(const char* array, json object) {
  document[array].push_back(std::move(object));
  return static_cast<int>(document[array].size()) - 1;
}

int GltfAsset::add_view(std::span<const std::uint8_t> bytes, const json& more) {
  binary.resize((binary.size() + 3) / 4 * 4);
  json view = {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}};
  view.update(more);
  binary.insert(binary.end(), bytes.begin(), bytes.end());
  document["buffers"][0]["byteLength"] = binary.size();
  return add("bufferViews", view);
}

int GltfAsset::add_accessor(const char* type, int component_type, std::size_t scalars, int view, const json& more) {
  const std::string name = type;
  const auto digit = static_cast<std::size_t>(name.back() - '0');
  const std::size_t components = name == "SCALAR" ? 1 : name.starts_with("VEC") ? digit : digit * digit;
  json accessor = {
      {"bufferView", view}, {"componentType", component_type}, {"type", type}, {"count", scalars / components}};
  accessor.update(more);
  return add("accessors", accessor);
}

std::size_t GltfAsset::first_byte_of_view(int view) const {
  return document["bufferViews"][static_cast<std::size_t>(view)].value("byteOffset", std::size_t{0});
}

std::size_t GltfAsset::first_byte(int accessor) const {
  const json& a = document["accessors"][static_cast<std::size_t>(accessor)];
  return first_byte_of_view(a["bufferView"].get<int>()) + a.value("byteOffset", std::size_t{0});
}

std::string little_endian32(std::uint32_t value) {
  std::string out;
  for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<char>((value >> shift) & 0xFF));
  return out;
}

std::string glb_chunk(const char type[4], std::string bytes) {
  bytes.resize((bytes.size() + 3) / 4 * 4, type[0] == 'J' ? ' ' : '\0');
  return little_endian32(static_cast<std::uint32_t>(bytes.size())) + std::string(type, 4) + bytes;
}

std::string make_glb(std::string json_text, std::span<const std::uint8_t> binary) {
  std::string chunks = glb_chunk("JSON", std::move(json_text));
  if (!binary.empty()) chunks += glb_chunk("BIN\0", std::string(binary.begin(), binary.end()));
  return "glTF" + little_endian32(2) + little_endian32(static_cast<std::uint32_t>(12 + chunks.size())) + chunks;
}

std::string base64(std::span<const std::uint8_t> bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = (group << 8) | (i + k < bytes.size() ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : kDigits[(group >> (18 - 6 * k)) & 63];
  }
  return out;
}

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

std::string GltfAsset::glb() const { return make_glb(document.dump(), binary); }

std::string GltfAsset::gltf_with_file(const std::string& uri) const {
  json d = document;
  d["buffers"][0]["uri"] = uri;
  return d.dump();
}

std::string GltfAsset::gltf() const { return gltf_with_file("data:application/octet-stream;base64," + base64(binary)); }

namespace {

void add_quad(GltfAsset& asset) {
  asset.add_accessor<float>("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
  asset.add_accessor<float>("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1});
  asset.add_accessor<float>("VEC2", {0, 0, 1, 0, 0, 1, 1, 1});
  asset.add_accessor<std::uint16_t>("SCALAR", {0, 1, 2, 2, 1, 3});
  asset.add_accessor<std::uint8_t>("VEC4", {0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0});
  asset.add_accessor<float>("VEC4", {1, 0, 0, 0, 0.5f, 0.5f, 0, 0, 0.25f, 0.75f, 0, 0, 0, 1, 0, 0});
  asset.add_accessor<float>("VEC3", {0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  asset.add_accessor<float>(
      "MAT4", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
  asset.add("meshes", {{"name", "quad"},
                       {"weights", {0.5}},
                       {"primitives",
                        {{{"attributes",
                           {{"POSITION", kPositions},
                            {"NORMAL", kNormals},
                            {"TEXCOORD_0", kTexcoords},
                            {"JOINTS_0", kJoints},
                            {"WEIGHTS_0", kWeights}}},
                          {"indices", kIndices},
                          {"material", 0},
                          {"targets", {{{"POSITION", kMorph}}}}}}}});
  asset.add("skins", {{"joints", {2, 3}}, {"inverseBindMatrices", kInverseBind}});
}

void add_animation(GltfAsset& asset) {
  asset.add_accessor<float>("SCALAR", {0, 0.5f, 1});
  asset.add_accessor<float>("VEC3", {0, 0, 0, 1, 0, 0, 0, 0, 0});
  asset.add_accessor<float>("VEC4", {0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0});
  asset.add_accessor<float>("SCALAR", {0, 1});
  asset.add_accessor<float>("VEC3", {0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
  asset.add_accessor<float>("SCALAR", {0, 1, 0});
  const auto channel = [](int sampler, int node, const char* path) {
    return json{{"sampler", sampler}, {"target", {{"node", node}, {"path", path}}}};
  };
  asset.add("animations", {{"channels",
                            {channel(0, 2, "translation"), channel(1, 2, "rotation"), channel(2, 3, "translation"),
                             channel(3, 1, "weights")}},
                           {"samplers",
                            {{{"input", kTimes}, {"output", kTranslations}},
                             {{"input", kTimes}, {"output", kRotations}, {"interpolation", "STEP"}},
                             {{"input", kSplineTimes}, {"output", kSpline}, {"interpolation", "CUBICSPLINE"}},
                             {{"input", kTimes}, {"output", kMorphWeights}}}}});
}

void add_patch(GltfAsset& asset) {
  std::vector<float> points, texcoords;
  std::vector<std::uint16_t> cage;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i) {
      const float u = static_cast<float>(i) / 3.0f, v = static_cast<float>(j) / 3.0f;
      points.insert(points.end(), {u, v, 0.0f});
      texcoords.insert(texcoords.end(), {u, v});
      const auto n = static_cast<std::uint16_t>(4 * j + i);
      const auto at = [&](int offset) { return static_cast<std::uint16_t>(n + offset); };
      if (i < 3 && j < 3) cage.insert(cage.end(), {at(0), at(1), at(4), at(4), at(1), at(5)});
    }
  asset.add_accessor<float>("VEC3", points);
  asset.add_accessor<float>("VEC2", texcoords);
  asset.add_accessor<std::uint16_t>("SCALAR", cage);
  const std::vector<std::uint16_t> moved = {5, 6};
  const std::vector<float> values = {0.3f, 0.3f, 0.5f, 0.6f, 0.3f, 0.5f};
  const int index_view = asset.add_view({reinterpret_cast<const std::uint8_t*>(moved.data()), 4});
  const int value_view = asset.add_view({reinterpret_cast<const std::uint8_t*>(values.data()), 24});
  asset.document["accessors"][kControlPoints]["sparse"] = {
      {"count", 2},
      {"indices", {{"bufferView", index_view}, {"componentType", 5123}}},
      {"values", {{"bufferView", value_view}}}};
  asset.add("meshes", {{"name", "patch"},
                       {"primitives",
                        {{{"attributes", {{"POSITION", kControlPoints}, {"TEXCOORD_0", kPatchTexcoords}}},
                          {"indices", kCageIndices},
                          {"material", 1},
                          {"extensions", {{"TESSERA_bezier_patches", {{"count", 1}}}}}}}}});
}

void add_materials(GltfAsset& asset) {
  Image8 image(4, 4, 3);
  for (std::size_t i = 0; i < image.values.size(); ++i) image.values[i] = static_cast<std::uint8_t>(5 * i);
  const std::string png = encode_png(image);
  asset.add("images", {{"bufferView", asset.add_view(bytes_of(png))}, {"mimeType", "image/png"}});
  asset.add("samplers", {{"magFilter", 9729}, {"wrapS", 33071}});
  asset.add("textures", {{"sampler", 0}, {"source", 0}});
  asset.add("materials", {{"name", "cloth"},
                          {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}, {"metallicFactor", 0.5}}}});
  asset.add("materials", {{"name", "ware"},
                          {"extensions", {{"TESSERA_displacement", {{"texture", {{"index", 0}}}, {"scale", 0.1}}}}}});
}

void add_scene(GltfAsset& asset) {
  asset.add("cameras", {{"type", "perspective"},
                        {"perspective", {{"aspectRatio", 1.5}, {"yfov", 0.8}, {"znear", 0.1}, {"zfar", 100}}},
                        {"extensions", {{"TESSERA_lens", {{"apertureRadius", 0.1}, {"focusDistance", 5}}}}}});
  asset.add("cameras",
            {{"type", "orthographic"}, {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 0.1}, {"zfar", 100}}}});
  asset.add("nodes", {{"children", {1, 2, 4, 5, 6, 7}}});
  asset.add("nodes", {{"mesh", 0}, {"skin", 0}, {"weights", {0.25}}});
  asset.add("nodes", {{"children", {3}}, {"rotation", {0, 0, 0, 1}}});
  asset.add("nodes", {{"translation", {0, 1, 0}}});
  asset.add("nodes", {{"camera", 0}, {"translation", {0, 0, 5}}});
  asset.add("nodes", {{"mesh", 1}, {"scale", {1, 1, 1}}});
  asset.add("nodes", {{"camera", 1}});
  asset.add("nodes", {{"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 2, 0, 1}},
                      {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  asset.add("scenes", {{"nodes", {0}}});
  asset.document["scene"] = 0;
  asset.document["extensions"] = {{"KHR_lights_punctual",
                                   {{"lights",
                                     {{{"type", "spot"},
                                       {"color", {1, 1, 1}},
                                       {"range", 10},
                                       {"spot", {{"innerConeAngle", 0.2}, {"outerConeAngle", 0.6}}}}}}}},
                                  {"TESSERA_capture",
                                   {{"resolution", {64, 32}},
                                    {"frameRate", 24},
                                    {"shutter", {0, 0.5}},
                                    {"frames", {{"first", 0}, {"count", 2}}},
                                    {"camera", 4},
                                    {"exposure", 1},
                                    {"environment", 1},
                                    {"background", {0, 0, 0}}}}};
  asset.document["extensionsUsed"] = {"KHR_lights_punctual", "TESSERA_capture", "TESSERA_lens",
                                      "TESSERA_bezier_patches", "TESSERA_displacement"};
}

}  // namespace

// Writes min and max of positions and key times, as glTF wants them.
void add_ranges(GltfAsset& asset) {
  nlohmann::json& d = asset.document;
  const auto floats_at = [&](std::size_t byte, std::size_t count) {
    std::vector<float> values(count);
    std::memcpy(values.data(), &asset.binary[byte], count * sizeof(float));
    return values;
  };
  const auto add_range = [&](const nlohmann::json& index) {
    nlohmann::json& accessor = d["accessors"][index.get<std::size_t>()];
    const std::size_t n = accessor["type"] == "VEC3" ? 3 : 1;
    std::vector<float> values = floats_at(asset.first_byte(index.get<int>()), n * accessor["count"].get<std::size_t>());
    if (accessor.contains("sparse")) {
      const nlohmann::json& sparse = accessor["sparse"];
      const std::size_t count = sparse["count"].get<std::size_t>();
      const std::vector<float> put =
          floats_at(asset.first_byte_of_view(sparse["values"]["bufferView"].get<int>()), n * count);
      const std::size_t first = asset.first_byte_of_view(sparse["indices"]["bufferView"].get<int>());
      const std::size_t bytes = sparse["indices"]["componentType"] == 5121 ? 1 : 2;
      for (std::size_t k = 0; k < count; ++k) {
        const std::size_t at = asset.binary[first + bytes * k];
        for (std::size_t c = 0; c < n; ++c) values[n * at + c] = put[n * k + c];
      }
    }
    std::vector<float> low(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(n)), high = low;
    for (std::size_t i = 0; i < values.size(); ++i)
      low[i % n] = std::min(low[i % n], values[i]), high[i % n] = std::max(high[i % n], values[i]);
    accessor["min"] = low;
    accessor["max"] = high;
  };
  for (const nlohmann::json& mesh : d["meshes"])
    for (const nlohmann::json& primitive : mesh["primitives"]) {
      add_range(primitive["attributes"]["POSITION"]);
      if (!primitive.contains("targets")) continue;
      for (const nlohmann::json& target : primitive["targets"])
        if (target.contains("POSITION")) add_range(target["POSITION"]);
    }
  for (const nlohmann::json& animation : d["animations"])
    for (const nlohmann::json& sampler : animation["samplers"]) add_range(sampler["input"]);
}

GltfAsset everything_asset() {
  GltfAsset asset;
  add_quad(asset);
  add_animation(asset);
  add_patch(asset);
  add_materials(asset);
  add_scene(asset);
  add_ranges(asset);
  return asset;
}

GltfAsset draco_asset(bool sequential) {
  replay::DracoInput input;
  input.indices = {0, 1, 2, 2, 1, 3};
  input.vertex_count = 4;
  input.attributes.resize(2);
  input.attributes[0] = {"POSITION", 3, 5126, false, {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}};
  input.attributes[1] = {"TEXCOORD_0", 2, 5126, false, {0, 0, 1, 0, 0, 1, 1, 1}};
  const replay::DracoOutput output = replay::encode_draco(input, {}, sequential);

  GltfAsset asset;
  asset.add_view(output.bytes);
  asset.add("accessors", {{"componentType", 5126}, {"type", "VEC3"}, {"count", 4}});
  asset.add("accessors", {{"componentType", 5126}, {"type", "VEC2"}, {"count", 4}});
  asset.add("accessors", {{"componentType", 5123}, {"type", "SCALAR"}, {"count", 6}});
  asset.add("meshes",
            {{"primitives",
              {{{"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}}},
                {"indices", 2},
                {"extensions",
                 {{"KHR_draco_mesh_compression",
                   {{"bufferView", 0},
                    {"attributes", {{"POSITION", output.unique_ids[0]}, {"TEXCOORD_0", output.unique_ids[1]}}}}}}}}}}});
  asset.add("nodes", {{"mesh", 0}});
  asset.add("scenes", {{"nodes", {0}}});
  asset.document["extensionsUsed"] = {"KHR_draco_mesh_compression"};
  asset.document["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  return asset;
}

}  // namespace tessera::test
