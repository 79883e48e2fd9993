#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace tessera::test {

// A glTF asset under construction: the document and the one buffer behind it. Nothing is checked, so that tests can
// build invalid glTF.
class GltfAsset {
 public:
  GltfAsset() : document({{"asset", {{"version", "2.0"}}}}) {}

  // Appends to a top-level array and returns the index.
  int add(const char* array, nlohmann::json object);

  // Appends bytes to the buffer at the next multiple of 4; `more` is merged into the view.
  int add_view(std::span<const std::uint8_t> bytes, const nlohmann::json& more = nlohmann::json::object());

  // A tightly packed accessor with a view of its own. `values` holds the scalars; `more` is merged into the accessor.
  template <class T>
  int add_accessor(const char* type, const std::vector<T>& values,
                   const nlohmann::json& more = nlohmann::json::object()) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(values.data());
    return add_accessor(type, component_type_of(T{}), values.size(), add_view({bytes, values.size() * sizeof(T)}),
                        more);
  }
  int add_accessor(const char* type, int component_type, std::size_t scalars, int view, const nlohmann::json& more);

  // Overwrites a scalar of a tightly packed accessor.
  template <class T>
  void poke(int accessor, std::size_t scalar, T value) {
    std::memcpy(&binary[first_byte(accessor) + scalar * sizeof value], &value, sizeof value);
  }
  // First byte of the accessor's data in the buffer.
  std::size_t first_byte(int accessor) const;
  std::size_t first_byte_of_view(int view) const;

  std::string glb() const;                                   // document and buffer in one file
  std::string gltf() const;                                  // JSON with the buffer as a data URI
  std::string gltf_with_file(const std::string& uri) const;  // JSON that names a file; write `binary` there

  nlohmann::json document;
  std::vector<std::uint8_t> binary;

 private:
  static int component_type_of(std::int8_t) { return 5120; }
  static int component_type_of(std::uint8_t) { return 5121; }
  static int component_type_of(std::int16_t) { return 5122; }
  static int component_type_of(std::uint16_t) { return 5123; }
  static int component_type_of(std::uint32_t) { return 5125; }
  static int component_type_of(float) { return 5126; }
};

// A .glb of these chunks, each padded to a multiple of 4; an empty `binary` gives no binary chunk.
std::string make_glb(std::string json_text, std::span<const std::uint8_t> binary);
std::string glb_chunk(const char type[4], std::string bytes);
std::string little_endian32(std::uint32_t value);
std::string base64(std::span<const std::uint8_t> bytes);
std::span<const std::uint8_t> bytes_of(const std::string& text);

// Indices of accessors in everything_asset().
enum EverythingAccessor : int {
  kPositions,
  kNormals,
  kTexcoords,
  kIndices,
  kJoints,
  kWeights,
  kMorph,
  kInverseBind,
  kTimes,
  kTranslations,
  kRotations,
  kSplineTimes,
  kSpline,
  kMorphWeights,
  kControlPoints,
  kPatchTexcoords,
  kCageIndices,
};

// A valid asset that uses everything that the loader reads. Nodes: 0 root, 1 skinned and morphed quad,
// 2 and 3 joints, 4 perspective camera, 5 Bezier patch with a displacement map, 6 orthographic camera, 7 a matrix and a
// light. Animation 0: channels 0 translation (linear) and 1 rotation (step) of node 2, 2 translation (cubic spline) of
// node 3, 3 morph weights of node 1. kControlPoints has a sparse part of two elements.
GltfAsset everything_asset();

// A quad (4 points, 2 triangles) compressed with Draco: accessors 0 POSITION, 1 TEXCOORD_0, 2 indices; buffer view 0
// is the stream.
GltfAsset draco_asset(bool sequential);

}  // namespace tessera::test
