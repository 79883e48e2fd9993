#pragma once

#include <filesystem>
#include <span>

#include <nlohmann/json.hpp>

#include "scene/capture.h"

namespace tessera::replay {

// A glTF asset that is being edited: its document, and the bytes of buffer 0, to which new data is appended.
// Unreferenced data stays until the packer drops it.
class EditedAsset {
 public:
  // `binary` is the chunk of a .glb. An asset without a chunk gets an empty buffer 0, and its other buffers move up.
  EditedAsset(std::filesystem::path source, nlohmann::json document, std::vector<std::uint8_t> binary, bool has_binary);

  nlohmann::json document;
  const std::filesystem::path& source() const { return source_; }
  const std::vector<std::uint8_t>& binary() const { return binary_; }
  bool has_binary() const { return !binary_.empty(); }

  std::size_t add_view(std::span<const std::uint8_t> bytes);

  // Replaces attributes, targets and indices of a primitive; removes the Draco extension and the claim of cluster
  // order.
  void write_primitive(nlohmann::json& json_primitive, const scene::Primitive& primitive,
                       const std::vector<std::uint32_t>& indices);

  void use_extension(const std::string& name);
  // Removes a name from "extensionsUsed" or "extensionsRequired".
  void drop_extension(const char* list, const std::string& name);

 private:
  template <class T>
  std::size_t add_accessor(const std::vector<T>& values, int component_type, const char* type);
  std::size_t add_positions(const std::vector<Vec3>& positions);  // adds their range to the accessor
  nlohmann::json target_json(const scene::MorphTarget& target, std::size_t vertex_count);

  std::filesystem::path source_;
  std::vector<std::uint8_t> binary_;
};

// Triangles of the control cages of Bezier patches, for viewers that do not know patches.
std::vector<std::uint32_t> cage_indices(std::size_t patches);

}  // namespace tessera::replay
