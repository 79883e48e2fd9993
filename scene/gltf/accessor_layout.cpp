#include "scene/gltf/accessor_layout.h"

#include <nlohmann/json.hpp>

namespace tessera::scene::gltf {

std::uint64_t component_bytes(int component_type) {
  switch (component_type) {
    case kByte:
    case kUnsignedByte:
      return 1;
    case kShort:
    case kUnsignedShort:
      return 2;
    default:
      return 4;
  }
}

std::uint64_t AccessorLayout::column_bytes() const {
  const std::uint64_t bytes = component_bytes(component_type) * static_cast<std::uint64_t>(components / columns);
  return columns > 1 ? (bytes + 3) / 4 * 4 : bytes;
}

AccessorLayout accessor_layout(const nlohmann::json& document, std::size_t accessor) {
  const nlohmann::json& json = document["accessors"][accessor];
  const auto& type = json["type"].get_ref<const std::string&>();
  AccessorLayout layout;
  layout.component_type = json["componentType"].get<int>();
  if (type == "SCALAR") {
    layout.components = 1;
  } else if (type.starts_with("VEC")) {
    layout.components = type.back() - '0';
  } else {
    layout.columns = type.back() - '0';
    layout.components = layout.columns * layout.columns;
  }
  layout.normalized =
      json.value("normalized", false) && layout.component_type != kFloat && layout.component_type != kUnsignedInt;
  layout.count = json["count"].get<std::uint64_t>();
  layout.byte_offset = json.value("byteOffset", std::uint64_t{0});
  layout.element_bytes = layout.column_bytes() * static_cast<std::uint64_t>(layout.columns);
  layout.stride = layout.element_bytes;
  layout.has_view = json.contains("bufferView");
  if (layout.has_view) {
    const nlohmann::json& view = document["bufferViews"][json["bufferView"].get<std::size_t>()];
    layout.stride = view.value("byteStride", layout.element_bytes);
  }
  return layout;
}

}  // namespace tessera::scene::gltf
