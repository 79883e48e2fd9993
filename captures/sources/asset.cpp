#include "captures/sources/asset.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/atomic_file.h"
#include "base/image_codec.h"
#include "captures/sources/jpeg_writer.h"

namespace tessera::captures {
namespace {

using nlohmann::json;

template <class T>
std::span<const std::uint8_t> bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const std::uint8_t*>(values.data()), values.size() * sizeof(T)};
}

constexpr int kUnsignedByte = 5121, kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126;

}  // namespace

json array_of(const Vec3& v) { return {v.x, v.y, v.z}; }
json array_of(const Vec4& v) { return {v.x, v.y, v.z, v.w}; }
json array_of(const glm::quat& q) { return {q.x, q.y, q.z, q.w}; }

json texture_info(int texture, Vec2 repeat) {
  json info = {{"index", texture}};
  if (repeat != Vec2(1.0f)) info["extensions"]["KHR_texture_transform"] = {{"scale", {repeat.x, repeat.y}}};
  return info;
}

json displaced(json material, int heights, Vec2 repeat, float scale, float bias) {
  material["extensions"]["TESSERA_displacement"] = {
      {"texture", texture_info(heights, repeat)}, {"scale", scale}, {"bias", bias}};
  return material;
}

json look_at(Vec3 eye, Vec3 target) {
  const Vec3 back = glm::normalize(eye - target), right = glm::normalize(glm::cross(Vec3(0, 1, 0), back));
  const glm::quat rotation = glm::quat_cast(Mat3(right, glm::cross(back, right), back));
  return {{"translation", array_of(eye)}, {"rotation", array_of(rotation)}};
}

Asset::Asset(std::string name) : name_(std::move(name)) {
  document_ = {{"asset", {{"version", "2.0"}, {"generator", "Tessera captures"}}},
               {"scene", 0},
               {"scenes", json::array({{{"nodes", json::array()}}})},
               {"nodes", json::array()},
               {"accessors", json::array()},
               {"bufferViews", json::array()}};
}

void Asset::use_extension(const std::string& name) {
  json& used = document_["extensionsUsed"];
  if (!used.is_array()) used = json::array();
  if (std::find(used.begin(), used.end(), name) == used.end()) used.push_back(name);
}

int Asset::add_texture(std::string file, std::string bytes) {
  document_["images"].push_back({{"uri", file}});
  document_["textures"].push_back({{"source", document_["images"].size() - 1}});
  files_.push_back({std::move(file), std::move(bytes)});
  return static_cast<int>(document_["textures"].size()) - 1;
}

int Asset::add_color_texture(const Image8& image, const std::string& file) {
  return add_texture(file + ".jpg", encode_jpeg(image, 88));
}
int Asset::add_data_texture(const Image8& image, const std::string& file) {
  return add_texture(file + ".png", encode_png(image));
}
int Asset::add_height_texture(const Image16& image, const std::string& file) {
  return add_texture(file + ".png", encode_png(image));
}

void Asset::set_environment(int width, int height, const std::function<Vec3(Vec3)>& radiance, const std::string& file) {
  constexpr float kCircle = 6.28318531f;
  std::string bytes =
      "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(height) + " +X " + std::to_string(width) + "\n";
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      // +x lies in the middle of the image, +z a quarter of its width further right.
      const float around = ((static_cast<float>(x) + 0.5f) / static_cast<float>(width) - 0.5f) * kCircle,
                  down = (static_cast<float>(y) + 0.5f) / static_cast<float>(height) * 0.5f * kCircle;
      const Vec3 light =
          radiance({std::sin(down) * std::cos(around), std::cos(down), std::sin(down) * std::sin(around)});
      int exponent = 0;
      std::frexp(std::max({light.x, light.y, light.z, 1e-9f}), &exponent);
      for (int k = 0; k < 3; ++k)
        bytes.push_back(static_cast<char>(std::clamp(static_cast<int>(std::ldexp(light[k], 8 - exponent)), 0, 255)));
      bytes.push_back(static_cast<char>(exponent + 128));
    }
  capture_settings()["environment"] = {{"image", file + ".hdr"}};
  files_.push_back({file + ".hdr", std::move(bytes)});
}

int Asset::add_accessor(std::span<const std::uint8_t> bytes, int component_type, std::size_t count, const char* type,
                        json more) {
  binary_.resize((binary_.size() + 3) / 4 * 4);
  document_["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}});
  binary_.insert(binary_.end(), bytes.begin(), bytes.end());
  json accessor = {{"bufferView", document_["bufferViews"].size() - 1},
                   {"componentType", component_type},
                   {"count", count},
                   {"type", type}};
  if (more.is_object()) accessor.update(more);
  document_["accessors"].push_back(std::move(accessor));
  return static_cast<int>(document_["accessors"].size()) - 1;
}

int Asset::add_material(json material) {
  const std::string text = material.dump();
  for (const char* extension :
       {"KHR_texture_transform", "KHR_materials_unlit", "KHR_materials_emissive_strength", "TESSERA_displacement"})
    if (text.find(extension) != std::string::npos) use_extension(extension);
  document_["materials"].push_back(std::move(material));
  return static_cast<int>(document_["materials"].size()) - 1;
}

json Asset::primitive(const Geometry& g, int material) {
  Vec3 low = g.positions.front(), high = low;
  for (const Vec3& p : g.positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const std::size_t count = g.positions.size();
  json attributes = {{"POSITION", add_accessor(bytes_of(g.positions), kFloat, count, "VEC3",
                                               {{"min", array_of(low)}, {"max", array_of(high)}})}};
  if (!g.normals.empty()) attributes["NORMAL"] = add_accessor(bytes_of(g.normals), kFloat, count, "VEC3");
  if (!g.texcoords.empty()) attributes["TEXCOORD_0"] = add_accessor(bytes_of(g.texcoords), kFloat, count, "VEC2");
  if (!g.colors.empty())
    attributes["COLOR_0"] = add_accessor(bytes_of(g.colors), kUnsignedByte, count, "VEC4", {{"normalized", true}});
  if (!g.joints.empty()) attributes["JOINTS_0"] = add_accessor(bytes_of(g.joints), kUnsignedShort, count, "VEC4");
  if (!g.weights.empty()) attributes["WEIGHTS_0"] = add_accessor(bytes_of(g.weights), kFloat, count, "VEC4");
  json out = {{"attributes", attributes},
              {"material", material},
              {"indices", add_accessor(bytes_of(g.indices), kUnsignedInt, g.indices.size(), "SCALAR")}};
  for (const std::vector<Vec3>& morph : g.morphs) {
    Vec3 least = morph.front(), most = least;
    for (const Vec3& p : morph) {
      least = glm::min(least, p);
      most = glm::max(most, p);
    }
    out["targets"].push_back({{"POSITION", add_accessor(bytes_of(morph), kFloat, count, "VEC3",
                                                        {{"min", array_of(least)}, {"max", array_of(most)}})}});
  }
  if (g.bezier) {
    out["extensions"]["TESSERA_bezier_patches"] = {{"count", count / 16}};
    use_extension("TESSERA_bezier_patches");
  }
  return out;
}

int Asset::add_mesh(const Geometry& g, int material) { return add_mesh({{g, material}}); }

int Asset::add_mesh(const std::vector<Part>& parts) {
  json primitives = json::array();
  for (const Part& part : parts)
    if (!part.geometry.positions.empty()) primitives.push_back(primitive(part.geometry, part.material));
  document_["meshes"].push_back({{"primitives", primitives}});
  return static_cast<int>(document_["meshes"].size()) - 1;
}

int Asset::add_points(const std::vector<Vec3>& points) {
  return add_accessor(bytes_of(points), kFloat, points.size(), "VEC3");
}

int Asset::add_node(json node) {
  if (node.contains("extensions") && node["extensions"].contains("TESSERA_procedure"))
    use_extension("TESSERA_procedure");
  document_["nodes"].push_back(std::move(node));
  return static_cast<int>(document_["nodes"].size()) - 1;
}

void Asset::Instances::add(Vec3 at, float turn, float size) {
  translations.push_back(at);
  rotations.push_back(glm::angleAxis(turn, Vec3(0, 1, 0)));
  scales.emplace_back(size);
}

int Asset::add_instances(const std::string& name, int mesh, const Instances& instances) {
  use_extension("EXT_mesh_gpu_instancing");
  std::vector<float> turns;
  for (const glm::quat& q : instances.rotations) turns.insert(turns.end(), {q.x, q.y, q.z, q.w});
  const std::size_t count = instances.translations.size();
  const json attributes = {{"TRANSLATION", add_accessor(bytes_of(instances.translations), kFloat, count, "VEC3")},
                           {"ROTATION", add_accessor(bytes_of(turns), kFloat, count, "VEC4")},
                           {"SCALE", add_accessor(bytes_of(instances.scales), kFloat, count, "VEC3")}};
  return add_node(
      {{"name", name}, {"mesh", mesh}, {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", attributes}}}}}});
}

int Asset::add_camera(json camera) {
  if (camera.contains("extensions")) use_extension("TESSERA_lens");
  document_["cameras"].push_back(std::move(camera));
  return static_cast<int>(document_["cameras"].size()) - 1;
}

int Asset::add_light(json light) {
  use_extension("KHR_lights_punctual");
  json& lights = document_["extensions"]["KHR_lights_punctual"]["lights"];
  lights.push_back(std::move(light));
  return static_cast<int>(lights.size()) - 1;
}

int Asset::add_skin(const std::vector<int>& joints, const std::vector<Mat4>& inverse_bind) {
  document_["skins"].push_back(
      {{"joints", joints},
       {"inverseBindMatrices", add_accessor(bytes_of(inverse_bind), kFloat, joints.size(), "MAT4")}});
  return static_cast<int>(document_["skins"].size()) - 1;
}

void Asset::animate_values(int node, const std::string& path, const std::vector<float>& times,
                           std::span<const float> values, const char* type, std::size_t count) {
  json& animations = document_["animations"];
  if (!animations.is_array()) animations = json::array({{{"channels", json::array()}, {"samplers", json::array()}}});
  json& animation = animations[0];
  const int input = add_accessor(bytes_of(times), kFloat, times.size(), "SCALAR",
                                 {{"min", json::array({times.front()})}, {"max", json::array({times.back()})}});
  const std::vector<float> copy(values.begin(), values.end());
  const int output = add_accessor(bytes_of(copy), kFloat, count, type);
  animation["samplers"].push_back({{"input", input}, {"output", output}});
  animation["channels"].push_back(
      {{"sampler", animation["samplers"].size() - 1}, {"target", {{"node", node}, {"path", path}}}});
}

void Asset::animate(int node, const std::string& path, const std::vector<float>& times,
                    const std::vector<Vec3>& values) {
  animate_values(node, path, times, {&values[0].x, 3 * values.size()}, "VEC3", times.size());
}

void Asset::animate(int node, const std::string& path, const std::vector<float>& times,
                    const std::vector<glm::quat>& values) {
  std::vector<float> scalars;
  for (const glm::quat& q : values) scalars.insert(scalars.end(), {q.x, q.y, q.z, q.w});
  animate_values(node, path, times, scalars, "VEC4", times.size());
}

void Asset::animate_weights(int node, const std::vector<float>& times, const std::vector<float>& values) {
  animate_values(node, "weights", times, values, "SCALAR", values.size());
}

void Asset::write(const std::filesystem::path& folder) {
  if (document_.contains("extensions") && document_["extensions"].contains("TESSERA_capture"))
    use_extension("TESSERA_capture");
  // The scene's roots are the nodes that are no other node's child.
  std::vector<bool> claimed(document_["nodes"].size(), false);
  for (const json& node : document_["nodes"])
    if (node.contains("children"))
      for (const json& child : node["children"]) claimed[child.get<std::size_t>()] = true;
  for (std::size_t n = 0; n < claimed.size(); ++n)
    if (!claimed[n]) document_["scenes"][0]["nodes"].push_back(n);
  document_["buffers"] = json::array({{{"uri", name_ + ".bin"}, {"byteLength", binary_.size()}}});
  write_file_atomically(folder / (name_ + ".bin"), {reinterpret_cast<const char*>(binary_.data()), binary_.size()});
  for (const File& file : files_) write_file_atomically(folder / file.name, file.bytes);
  write_file_atomically(folder / (name_ + ".gltf"), document_.dump(1));
}

}  // namespace tessera::captures
