#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>

#include <nlohmann/json.hpp>

#include "base/parallel.h"
#include "scene/gltf/accessor_layout.h"
#include "scene/gltf/document.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

template <class T>
T load(const std::uint8_t* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

std::int64_t load_integer(const std::uint8_t* bytes, int component_type) {
  switch (component_type) {
    case kByte:
      return load<std::int8_t>(bytes);
    case kUnsignedByte:
      return load<std::uint8_t>(bytes);
    case kShort:
      return load<std::int16_t>(bytes);
    case kUnsignedShort:
      return load<std::uint16_t>(bytes);
    default:
      return load<std::uint32_t>(bytes);
  }
}

// Calls put(element, component, address) for every scalar of `layout.count` elements at `bytes`.
template <class Put>
void for_each_scalar(const AccessorLayout& layout, const std::uint8_t* bytes, std::uint64_t stride, const Put& put) {
  const std::uint64_t scalar = component_bytes(layout.component_type);
  const int rows = layout.components / layout.columns;
  for (std::uint64_t e = 0; e < layout.count; ++e)
    for (int column = 0; column < layout.columns; ++column)
      for (int row = 0; row < rows; ++row)
        put(e, static_cast<std::uint64_t>(column * rows + row),
            bytes + e * stride + static_cast<std::uint64_t>(column) * layout.column_bytes() +
                static_cast<std::uint64_t>(row) * scalar);
}

// Visits the accessor's data, then the elements of its sparse part: put(element, component, address).
template <class Put>
void visit_scalars(Document& document, std::size_t index, const AccessorLayout& layout, const Put& put) {
  const json& accessor = document.json["accessors"][index];
  if (layout.has_view) {
    const Bytes view = document.resources.buffer_view(accessor["bufferView"].get<std::size_t>());
    for_each_scalar(layout, view.data() + layout.byte_offset, layout.stride, put);
  }
  const json* sparse = find(accessor, "sparse");
  if (sparse == nullptr) return;
  const json &indices = (*sparse)["indices"], &values = (*sparse)["values"];
  const int index_type = indices["componentType"].get<int>();
  const std::uint8_t* index_bytes = document.resources.buffer_view(indices["bufferView"].get<std::size_t>()).data() +
                                    indices.value("byteOffset", std::uint64_t{0});
  const std::uint8_t* value_bytes = document.resources.buffer_view(values["bufferView"].get<std::size_t>()).data() +
                                    values.value("byteOffset", std::uint64_t{0});
  AccessorLayout part = layout;
  part.count = (*sparse)["count"].get<std::uint64_t>();
  document.budget.charge(part.count, sizeof(std::uint64_t),
                         [&] { return document.root.at("accessors").at(index).pointer(); });
  std::vector<std::uint64_t> targets(part.count);
  const Place place = document.root.at("accessors").at(index).at("sparse").at("indices");
  for (std::uint64_t i = 0; i < part.count; ++i) {
    targets[i] = static_cast<std::uint64_t>(load_integer(index_bytes + i * component_bytes(index_type), index_type));
    if (targets[i] >= layout.count)
      place.refuse("index {} is {}, the accessor has {} elements", i, targets[i], layout.count);
    if (i > 0 && targets[i] <= targets[i - 1]) place.refuse("index {} does not increase", i);
  }
  for_each_scalar(part, value_bytes, layout.element_bytes,
                  [&](std::uint64_t e, std::uint64_t c, const std::uint8_t* at) { put(targets[e], c, at); });
}

}  // namespace

float dequantize(std::int64_t value, int component_type) {
  const auto v = static_cast<float>(value);
  switch (component_type) {
    case kByte:
      return std::max(v / 127.0f, -1.0f);
    case kUnsignedByte:
      return v / 255.0f;
    case kShort:
      return std::max(v / 32767.0f, -1.0f);
    case kUnsignedShort:
      return v / 65535.0f;
    default:
      return v;
  }
}

namespace {

// Elements that one thread converts at a time.
constexpr std::uint64_t kChunk = 1 << 16;

// Calls convert(first, last) for ranges of `count` elements on all threads; whether all of them said true.
template <class Convert>
bool convert_in_chunks(std::uint64_t count, const Convert& convert) {
  const std::uint64_t chunks = (count + kChunk - 1) / kChunk;
  if (chunks < 2) return convert(std::uint64_t{0}, count);
  std::atomic<bool> all = true;
  parallel_for(chunks, [&](std::size_t c) {
    if (!convert(c * kChunk, std::min(count, (c + 1) * kChunk))) all = false;
  });
  return all;
}

// Stores convert(scalar of type T) of every scalar of elements without padding inside them. False: one was refused by
// `is_sound`.
template <class T, class Out, class Convert, class IsSound>
bool convert_scalars(const AccessorLayout& layout, const std::uint8_t* bytes, Out* out, const Convert& convert,
                     const IsSound& is_sound) {
  const auto components = static_cast<std::uint64_t>(layout.components);
  return convert_in_chunks(layout.count, [&](std::uint64_t first, std::uint64_t last) {
    bool sound = true;
    for (std::uint64_t e = first; e < last; ++e)
      for (std::uint64_t c = 0; c < components; ++c) {
        const T scalar = load<T>(bytes + e * layout.stride + c * sizeof(T));
        sound &= is_sound(scalar);
        out[e * components + c] = convert(scalar);
      }
    return sound;
  });
}

template <class T>
bool convert_integers(const AccessorLayout& layout, const std::uint8_t* bytes, float* out) {
  const auto any = [](T) { return true; };
  const int type = layout.component_type;
  if (layout.normalized)
    return convert_scalars<T>(
        layout, bytes, out, [type](T v) { return dequantize(v, type); }, any);
  return convert_scalars<T>(
      layout, bytes, out, [](T v) { return static_cast<float>(v); }, any);
}

// Address of an accessor's elements if they are just a view's, without sparse parts and matrices; else null.
const std::uint8_t* plain_elements(Document& document, std::size_t index) {
  const AccessorLayout& layout = document.layouts[index];
  const json& accessor = document.json["accessors"][index];
  if (!layout.has_view || layout.columns != 1 || accessor.contains("sparse")) return nullptr;
  return document.resources.buffer_view(accessor["bufferView"].get<std::size_t>()).data() + layout.byte_offset;
}

// False: there is more to an element than its conversion.
bool read_plain_floats(Document& document, std::size_t index, float* out) {
  const std::uint8_t* bytes = plain_elements(document, index);
  if (bytes == nullptr) return false;
  const AccessorLayout& layout = document.layouts[index];
  constexpr std::uint32_t kExponent = 0x7F800000;
  switch (layout.component_type) {
    case kFloat:
      return convert_scalars<std::uint32_t>(
          layout, bytes, out, [](std::uint32_t v) { return std::bit_cast<float>(v); },
          [](std::uint32_t v) { return (v & kExponent) != kExponent; });
    case kByte:
      return convert_integers<std::int8_t>(layout, bytes, out);
    case kUnsignedByte:
      return convert_integers<std::uint8_t>(layout, bytes, out);
    case kShort:
      return convert_integers<std::int16_t>(layout, bytes, out);
    case kUnsignedShort:
      return convert_integers<std::uint16_t>(layout, bytes, out);
    default:
      return convert_integers<std::uint32_t>(layout, bytes, out);
  }
}

// One by one, with the places of faults. `values` are zeros.
void read_floats_one_by_one(Document& document, std::size_t index, const std::function<bool(std::uint64_t)>& is_used,
                            float* values) {
  const AccessorLayout& layout = document.layouts[index];
  const auto components = static_cast<std::uint64_t>(layout.components);
  const Place place = document.root.at("accessors").at(index);
  visit_scalars(document, index, layout, [&](std::uint64_t e, std::uint64_t c, const std::uint8_t* at) {
    float value;
    if (layout.component_type == kFloat) {
      value = load<float>(at);
      if (!std::isfinite(value)) {
        if (!is_used || is_used(e)) place.refuse("element {} is not a finite number", e);
        document.notes.violation(place, "taken for zero where no index names its vertex",
                                 "element {} is not a finite number", e);
        value = 0;
      }
    } else {
      const std::int64_t integer = load_integer(at, layout.component_type);
      value = layout.normalized ? dequantize(integer, layout.component_type) : static_cast<float>(integer);
    }
    values[e * components + c] = value;
  });
}

// `Element` is made of floats alone, as many as the accessor's elements have or one.
template <class Element>
std::vector<Element> read_elements(Document& document, std::size_t index,
                                   const std::function<bool(std::uint64_t)>& is_used) {
  const AccessorLayout& layout = document.layouts[index];
  const std::uint64_t scalars = layout.count * static_cast<std::uint64_t>(layout.components);
  document.budget.charge(scalars, sizeof(float), [&] { return document.root.at("accessors").at(index).pointer(); });
  std::vector<Element> values(scalars * sizeof(float) / sizeof(Element), Element(0.0f));
  float* const out = reinterpret_cast<float*>(values.data());
  if (!read_plain_floats(document, index, out)) read_floats_one_by_one(document, index, is_used, out);
  return values;
}

}  // namespace

std::vector<float> read_floats(Document& document, std::size_t index,
                               const std::function<bool(std::uint64_t)>& is_used) {
  return read_elements<float>(document, index, is_used);
}
std::vector<Vec2> read_vec2(Document& document, std::size_t index, const std::function<bool(std::uint64_t)>& is_used) {
  return read_elements<Vec2>(document, index, is_used);
}
std::vector<Vec3> read_vec3(Document& document, std::size_t index, const std::function<bool(std::uint64_t)>& is_used) {
  return read_elements<Vec3>(document, index, is_used);
}

std::vector<std::uint32_t> read_unsigned(Document& document, std::size_t index) {
  const AccessorLayout& layout = document.layouts[index];
  const auto components = static_cast<std::uint64_t>(layout.components);
  document.budget.charge(layout.count * components, sizeof(std::uint32_t),
                         [&] { return document.root.at("accessors").at(index).pointer(); });
  std::vector<std::uint32_t> values(layout.count * components, 0);
  const auto same = [](auto v) { return static_cast<std::uint32_t>(v); };
  const auto any = [](auto) { return true; };
  if (const std::uint8_t* bytes = plain_elements(document, index)) {
    if (layout.component_type == kUnsignedByte)
      convert_scalars<std::uint8_t>(layout, bytes, values.data(), same, any);
    else if (layout.component_type == kUnsignedShort)
      convert_scalars<std::uint16_t>(layout, bytes, values.data(), same, any);
    else
      convert_scalars<std::uint32_t>(layout, bytes, values.data(), same, any);
    return values;
  }
  visit_scalars(document, index, layout, [&](std::uint64_t e, std::uint64_t c, const std::uint8_t* at) {
    values[e * components + c] = static_cast<std::uint32_t>(load_integer(at, layout.component_type));
  });
  return values;
}

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

std::uint64_t AccessorLayout::last_bytes() const {
  const auto rows = static_cast<std::uint64_t>(components / columns);
  return static_cast<std::uint64_t>(columns - 1) * column_bytes() + rows * component_bytes(component_type);
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
