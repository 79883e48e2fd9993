#include "scene/gltf/meshopt_reader.h"

#include <string>

#include <nlohmann/json.hpp>

#include "scene/gltf/json_reader.h"
#include "scene/gltf/meshopt_codec.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

constexpr const char* kNames[] = {"KHR_meshopt_compression", "EXT_meshopt_compression"};

MeshoptLayout layout_of(const json& extension) {
  const std::string mode = extension["mode"], filter = extension.value("filter", std::string("NONE"));
  MeshoptLayout layout;
  layout.count = extension["count"].get<std::uint64_t>();
  layout.stride = extension["byteStride"].get<std::uint64_t>();
  layout.mode = mode == "TRIANGLES" ? MeshoptMode::kTriangles
                : mode == "INDICES" ? MeshoptMode::kIndices
                                    : MeshoptMode::kAttributes;
  layout.filter = filter == "OCTAHEDRAL"    ? MeshoptFilter::kOctahedral
                  : filter == "QUATERNION"  ? MeshoptFilter::kQuaternion
                  : filter == "EXPONENTIAL" ? MeshoptFilter::kExponential
                  : filter == "COLOR"       ? MeshoptFilter::kColor
                                            : MeshoptFilter::kNone;
  return layout;
}

// Strides that a mode and a filter allow.
void check_layout(const MeshoptLayout& layout, const Place& place) {
  const std::uint64_t stride = layout.stride;
  if (layout.mode != MeshoptMode::kAttributes) {
    if (stride != 2 && stride != 4) place.at("byteStride").refuse("is {}, indices have 2 or 4 bytes", stride);
    if (layout.filter != MeshoptFilter::kNone) place.at("filter").refuse("is for attributes only");
    if (layout.mode == MeshoptMode::kTriangles && layout.count % 3 != 0)
      place.at("count").refuse("is {}, triangles have three indices each", layout.count);
    return;
  }
  if (stride % 4 != 0) place.at("byteStride").refuse("is {}, attributes need a multiple of 4", stride);
  const bool fits = layout.filter == MeshoptFilter::kNone || layout.filter == MeshoptFilter::kExponential ||
                    stride == 8 || (stride == 4 && layout.filter != MeshoptFilter::kQuaternion);
  if (!fits) place.at("byteStride").refuse("is {}, which its filter does not allow", stride);
}

void check_view(const json& document, const json& view, const Place& place) {
  const char* name = nullptr;
  const json* extension = find_meshopt(view, &name);
  if (extension == nullptr) return;
  if (find_extension(view, kNames[0]) != nullptr && find_extension(view, kNames[1]) != nullptr)
    place.at("extensions").refuse("compresses the view twice, as {} and as {}", kNames[0], kNames[1]);
  const Place inner = place.at("extensions").at(name);
  const MeshoptLayout layout = layout_of(*extension);
  check_layout(layout, inner);
  const auto length = view["byteLength"].get<std::uint64_t>();
  if (layout.bytes() != length)
    inner.refuse("holds {} elements of {} bytes, the view has {} bytes", layout.count, layout.stride, length);
  // Only the older extension asks for this.
  if (name == kNames[1] && view.contains("byteStride") && view["byteStride"].get<std::uint64_t>() != layout.stride)
    inner.at("byteStride").refuse("is {}, the view says {}", layout.stride, view["byteStride"].get<std::uint64_t>());
  const json& buffer = document["buffers"][(*extension)["buffer"].get<std::size_t>()];
  const auto offset = extension->value("byteOffset", std::uint64_t{0}),
             compressed = (*extension)["byteLength"].get<std::uint64_t>(),
             size = buffer["byteLength"].get<std::uint64_t>();
  if (offset > size || compressed > size - offset)
    inner.refuse("bytes {} to {} lie outside its buffer of {} bytes", offset, offset + compressed, size);
}

bool is_fallback(const json& buffer) {
  for (const char* name : kNames)
    if (const json* extension = find_extension(buffer, name);
        extension != nullptr && extension->value("fallback", false))
      return true;
  return false;
}

}  // namespace

const json* find_meshopt(const json& view, const char** name) {
  for (const char* candidate : kNames)
    if (const json* extension = find_extension(view, candidate)) {
      if (name != nullptr) *name = candidate;
      return extension;
    }
  return nullptr;
}

void check_meshopt(const json& document, const Place& root) {
  const json &views = list_of(document, "bufferViews"), &buffers = list_of(document, "buffers");
  for (std::size_t i = 0; i < views.size(); ++i) {
    const json& view = views[i];
    const Place place = root.at("bufferViews").at(i);
    check_view(document, view, place);
    const char* name = nullptr;
    const json* extension = find_meshopt(view, &name);
    if (extension == nullptr && is_fallback(buffers[view["buffer"].get<std::size_t>()]))
      place.at("buffer").refuse("is a fallback without data, and the view is not compressed");
    if (extension != nullptr && is_fallback(buffers[(*extension)["buffer"].get<std::size_t>()]))
      place.at("extensions").at(name).at("buffer").refuse("is a fallback, which holds no compressed data");
  }
}

std::vector<std::uint8_t> read_meshopt(const json& extension, Bytes compressed, MemoryBudget& budget,
                                       const Place& place) {
  const MeshoptLayout layout = layout_of(extension);
  if (compressed.size() < min_meshopt_bytes(layout))
    place.refuse("is a stream that has {} bytes, too few for its {} elements", compressed.size(), layout.count);
  budget.charge(layout.count, layout.stride, place);
  std::vector<std::uint8_t> out(layout.bytes());
  std::string fault;
  if (!decode_meshopt(compressed, layout, out, fault)) place.refuse("is a stream that {}", fault);
  return out;
}

}  // namespace tessera::scene::gltf
