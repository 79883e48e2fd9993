#pragma once

#include <cstdint>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace tessera::scene::gltf {

// glTF component types by their OpenGL numbers.
inline constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123, kUnsignedInt = 5125,
                     kFloat = 5126;

std::uint64_t component_bytes(int component_type);

// Memory layout of an accessor's elements, from its JSON and the JSON of its buffer view.
struct AccessorLayout {
  int component_type = kFloat;
  int components = 1;             // scalars per element: 1 to 4, 4, 9, 16
  int columns = 1;                // matrices: columns start at multiples of 4 bytes
  bool normalized = false;        // never set for types that cannot be normalized
  std::uint64_t count = 0;        // elements
  std::uint64_t byte_offset = 0;  // within the buffer view
  std::uint64_t stride = 0;       // bytes from element to element
  std::uint64_t element_bytes = 0;
  bool has_view = false;

  std::uint64_t column_bytes() const;
  std::uint64_t last_bytes() const;  // bytes of the last element; its last column needs no padding
};

// `document` must have passed check_schema.
AccessorLayout accessor_layout(const nlohmann::json& document, std::size_t accessor);

}  // namespace tessera::scene::gltf
