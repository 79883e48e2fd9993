#pragma once

#include "base/vec.h"
#include "tests/support/tests.h"

namespace tessera::test {

inline constexpr int kByteType = 5120, kUnsignedByteType = 5121, kUnsignedShortType = 5123, kUnsignedIntType = 5125,
                     kFloatType = 5126;

// A glTF asset under construction: one buffer, one view per accessor.
class GltfSource {
 public:
  nlohmann::json document = {
      {"asset", {{"version", "2.0"}}}, {"scene", 0}, {"scenes", {{{"nodes", {0}}}}}, {"nodes", {{{"mesh", 0}}}}};

  // `values` hold the accessor's scalars; elements lie `stride` bytes apart (0: tightly packed, the view has no
  // stride).
  template <class T>
  int accessor(const std::vector<T>& values, int component_type, const char* type, nlohmann::json more = {},
               std::size_t stride = 0) {
    const std::size_t components = type[0] == 'S' ? 1 : type[0] == 'M' ? 16 : static_cast<std::size_t>(type[3] - '0');
    const std::size_t size = components * sizeof(T), count = values.size() / components;
    const int view = this->view(bytes_of(values, size, stride == 0 ? size : stride), stride);
    nlohmann::json accessor = {
        {"bufferView", view}, {"componentType", component_type}, {"count", count}, {"type", type}};
    if (more.is_object()) accessor.update(more);
    document["accessors"].push_back(accessor);
    return static_cast<int>(document["accessors"].size()) - 1;
  }

  int view(const std::string& data, std::size_t stride = 0) {
    bytes.resize((bytes.size() + 3) / 4 * 4);
    document["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", data.size()}});
    if (stride != 0) document["bufferViews"].back()["byteStride"] = stride;
    bytes += data;
    return static_cast<int>(document["bufferViews"].size()) - 1;
  }

  int positions(const std::vector<Vec3>& points, std::size_t stride = 0) {
    std::vector<float> scalars;
    Vec3 low = points[0], high = points[0];
    for (const Vec3& p : points) {
      scalars.insert(scalars.end(), {p.x, p.y, p.z});
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
    return accessor(scalars, kFloatType, "VEC3", {{"min", {low.x, low.y, low.z}}, {"max", {high.x, high.y, high.z}}},
                    stride);
  }

  // NAME.gltf with NAME.bin beside it; returns the path.
  std::filesystem::path write(const std::filesystem::path& folder, const std::string& name = "source") const {
    nlohmann::json d = document;
    d["buffers"] = {{{"byteLength", bytes.size()}, {"uri", name + ".bin"}}};
    write_text(folder / (name + ".bin"), bytes);
    write_text(folder / (name + ".gltf"), d.dump());
    return folder / (name + ".gltf");
  }

  std::string bytes;

 private:
  template <class T>
  static std::string bytes_of(const std::vector<T>& values, std::size_t size, std::size_t stride) {
    const std::size_t count = values.size() * sizeof(T) / size;
    std::string out((count - 1) * stride + size, '\x5A');  // gaps hold bytes that no reader should read
    for (std::size_t i = 0; i < count; ++i)
      std::memcpy(&out[i * stride], reinterpret_cast<const char*>(values.data()) + i * size, size);
    return out;
  }
};

// The JSON and the binary chunk of a .glb.
struct GlbParts {
  nlohmann::json document;
  std::string binary;
};

inline GlbParts glb_parts(const std::string& bytes) {
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return std::size_t{value};
  };
  const std::size_t json_bytes = word(12);
  GlbParts parts{nlohmann::json::parse(bytes.substr(20, json_bytes)), ""};
  if (bytes.size() > 20 + json_bytes) parts.binary = bytes.substr(28 + json_bytes, word(20 + json_bytes));
  return parts;
}

}  // namespace tessera::test
