#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/image.h"
#include "base/vec.h"

namespace tessera::captures {

// A triangle mesh or a set of Bezier patches before it becomes a glTF primitive.
struct Geometry {
  std::vector<Vec3> positions, normals;
  std::vector<Vec2> texcoords;
  std::vector<std::array<std::uint8_t, 4>> colors;  // factors of the base colour, 255 = 1
  std::vector<std::uint32_t> indices;
  std::vector<std::array<std::uint16_t, 4>> joints;
  std::vector<Vec4> weights;
  std::vector<std::vector<Vec3>> morphs;  // differences of positions, one vector per target
  bool bezier = false;                    // 16 positions per patch; indices are its control cage
};

// One primitive of a mesh.
struct Part {
  Geometry geometry;
  int material = 0;
};

// Collects the objects of a glTF asset and writes it as NAME.gltf with NAME.bin and images beside it. Every add_
// function returns the index of the added object.
class Asset {
 public:
  explicit Asset(std::string name);

  // Add an image file; colour images become JPEG, others PNG.
  int add_color_texture(const Image8& image, const std::string& file);
  int add_data_texture(const Image8& image, const std::string& file);
  int add_height_texture(const Image16& image, const std::string& file);
  // Sets the environment: a Radiance file with 4 bytes for each pixel. `radiance` gives the light from a direction, +y up.
  void set_environment(int width, int height, const std::function<Vec3(Vec3)>& radiance, const std::string& file);

  int add_material(nlohmann::json material);
  int add_mesh(const Geometry& geometry, int material);
  int add_mesh(const std::vector<Part>& parts);     // leaves parts without vertices out
  int add_points(const std::vector<Vec3>& points);  // adds an accessor of its own
  int add_node(nlohmann::json node);  // adds a root of the scene, unless another node has it in `children`
  // Places for a node that draws `mesh` at each of them (EXT_mesh_gpu_instancing).
  struct Instances {
    std::vector<Vec3> translations, scales;
    std::vector<glm::quat> rotations;
    void add(Vec3 at, float turn, float size);  // turned about +y
  };
  int add_instances(const std::string& name, int mesh, const Instances& instances);
  int add_camera(nlohmann::json camera);
  int add_light(nlohmann::json light);
  int add_skin(const std::vector<int>& joints, const std::vector<Mat4>& inverse_bind);

  // Adds linear keys for one path of a node: 3 or 4 numbers each.
  void animate(int node, const std::string& path, const std::vector<float>& times, const std::vector<Vec3>& values);
  void animate(int node, const std::string& path, const std::vector<float>& times,
               const std::vector<glm::quat>& values);
  // Adds keys for the weights of morph targets, as many for each key as the node's mesh has targets.
  void animate_weights(int node, const std::vector<float>& times, const std::vector<float>& values);

  nlohmann::json& node(int index) { return document_["nodes"][static_cast<std::size_t>(index)]; }
  nlohmann::json& capture_settings() { return document_["extensions"]["TESSERA_capture"]; }

  void write(const std::filesystem::path& folder);

 private:
  struct File {
    std::string name, bytes;
  };
  int add_texture(std::string file, std::string bytes);
  int add_accessor(std::span<const std::uint8_t> bytes, int component_type, std::size_t count, const char* type,
                   nlohmann::json more = {});
  nlohmann::json primitive(const Geometry& geometry, int material);
  void animate_values(int node, const std::string& path, const std::vector<float>& times, std::span<const float> values,
                      const char* type, std::size_t count);
  void use_extension(const std::string& name);

  std::string name_;
  nlohmann::json document_;
  std::vector<std::uint8_t> binary_;
  std::vector<File> files_;  // images
};

// {"index": texture} with a texture transform when `repeat` is not 1.
nlohmann::json texture_info(int texture, Vec2 repeat = Vec2(1.0f));

// Returns the material with a displacement of scale * height + bias.
nlohmann::json displaced(nlohmann::json material, int heights, Vec2 repeat, float scale, float bias);

// The members "translation" and "rotation" of a camera or light at `eye` that looks at `target`.
nlohmann::json look_at(Vec3 eye, Vec3 target);

nlohmann::json array_of(const Vec3& v);
nlohmann::json array_of(const Vec4& v);
nlohmann::json array_of(const glm::quat& q);

}  // namespace tessera::captures
