#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/image_codec.h"
#include "base/ktx2/ktx2.h"
#include "scene/gltf/accessor_layout.h"
#include "scene/gltf/accessor_uses.h"
#include "scene/gltf/audit.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

double scalar_at(const std::uint8_t* at, int component_type) {
  const auto load = [at]<class T>(T) {
    T value;
    std::memcpy(&value, at, sizeof value);
    return static_cast<double>(value);
  };
  switch (component_type) {
    case kByte:
      return load(std::int8_t{});
    case kUnsignedByte:
      return load(std::uint8_t{});
    case kShort:
      return load(std::int16_t{});
    case kUnsignedShort:
      return load(std::uint16_t{});
    case kUnsignedInt:
      return load(std::uint32_t{});
    default:
      return load(0.0f);
  }
}

// The elements of an accessor as stored, in sequence, sparse ones in their places. Keeps nothing in memory.
class Elements {
 public:
  Elements(Document& document, std::size_t index) : layout_(document.layouts[index]) {
    const json& accessor = document.json["accessors"][index];
    const auto bytes_of = [&](const json& part) {
      return document.resources.buffer_view(part["bufferView"].get<std::size_t>()).data() +
             part.value("byteOffset", std::uint64_t{0});
    };
    if (layout_.has_view) data_ = bytes_of(accessor);
    const json* sparse = find(accessor, "sparse");
    if (sparse == nullptr) return;
    sparse_count_ = (*sparse)["count"].get<std::uint64_t>();
    if (sparse_count_ == 0) return;
    index_type_ = (*sparse)["indices"]["componentType"].get<int>();
    indices_ = bytes_of((*sparse)["indices"]);
    values_ = bytes_of((*sparse)["values"]);
  }

  std::uint64_t count() const { return layout_.count; }
  std::size_t components() const { return static_cast<std::size_t>(layout_.components); }

  // The components of element `e`, which follows the element of the previous call; normalised integers as fractions.
  const std::array<double, 16>& next(std::uint64_t e, bool fractions) {
    const std::uint8_t* at = data_ == nullptr ? nullptr : data_ + e * layout_.stride;
    while (sparse_at_ < sparse_count_ && sparse_index() < e) ++sparse_at_;
    if (sparse_at_ < sparse_count_ && sparse_index() == e) at = values_ + sparse_at_ * layout_.element_bytes;
    const auto rows = static_cast<std::size_t>(layout_.components / layout_.columns);
    for (std::size_t c = 0; c < components(); ++c) {
      const std::uint8_t* scalar =
          at == nullptr ? nullptr
                        : at + c / rows * layout_.column_bytes() + c % rows * component_bytes(layout_.component_type);
      double value = scalar == nullptr ? 0 : scalar_at(scalar, layout_.component_type);
      if (fractions && layout_.normalized)
        value = static_cast<double>(dequantize(static_cast<std::int64_t>(value), layout_.component_type));
      element_[c] = value;
    }
    return element_;
  }

 private:
  std::uint64_t sparse_index() const {
    return static_cast<std::uint64_t>(scalar_at(indices_ + sparse_at_ * component_bytes(index_type_), index_type_));
  }

  const AccessorLayout& layout_;
  const std::uint8_t *data_ = nullptr, *indices_ = nullptr, *values_ = nullptr;
  std::uint64_t sparse_count_ = 0, sparse_at_ = 0;
  int index_type_ = kUnsignedByte;
  std::array<double, 16> element_{};
};

// ---- Accessors by themselves ------------------------------------------------------------------------------------

void audit_bounds(Document& d, std::size_t index, const Place& place) {
  const json& accessor = d.json["accessors"][index];
  const AccessorLayout& layout = d.layouts[index];
  if (!layout.has_view && !accessor.contains("sparse")) return;  // an extension says what its values are
  std::array<double, 16> low, high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  Elements elements(d, index);
  for (std::uint64_t e = 0; e < elements.count(); ++e) {
    const std::array<double, 16>& element = elements.next(e, false);
    for (std::size_t c = 0; c < elements.components(); ++c) {
      if (!std::isfinite(element[c]))
        return forbid(d.notes, place, "ACCESSOR_INVALID_FLOAT", "element {} is not a finite number", e);
      low[c] = std::min(low[c], element[c]);
      high[c] = std::max(high[c], element[c]);
    }
  }
  const auto check = [&](const char* name, const std::array<double, 16>& actual, const char* code) {
    const json* declared = find(accessor, name);
    if (declared == nullptr || !declared->is_array() || declared->size() != elements.components()) return;
    for (std::size_t c = 0; c < declared->size(); ++c) {
      if (!(*declared)[c].is_number()) return;
      const double value = layout.component_type == kFloat ? static_cast<double>((*declared)[c].get<float>())
                                                           : (*declared)[c].get<double>();
      if (value != actual[c])
        return forbid(d.notes, place.at(name).at(c), code, "is {:g}, the values say {:g}", value, actual[c]);
    }
  };
  if (elements.count() == 0) return;
  check("min", low, "ACCESSOR_MIN_MISMATCH");
  check("max", high, "ACCESSOR_MAX_MISMATCH");
}

// ---- Accessors by their use -------------------------------------------------------------------------------------

// Tolerance for a unit length: the rounding of three and of four bytes.
constexpr double kUnit3 = 0.00674, kUnit4 = 0.00769;

double length_of(const std::array<double, 16>& v, std::size_t n) {
  double sum = 0;
  for (std::size_t c = 0; c < n; ++c) sum += v[c] * v[c];
  return std::sqrt(sum);
}

void audit_unit(Document& d, const AccessorUsed& use, std::size_t components, const char* code, const Place& place) {
  Elements elements(d, use.accessor);
  for (std::uint64_t e = 0; e < elements.count(); ++e) {
    const std::array<double, 16>& v = elements.next(e, true);
    if (const double length = length_of(v, components); !(std::abs(length - 1) <= (components == 3 ? kUnit3 : kUnit4)))
      return forbid(d.notes, place, code, "element {} has the length {:g}, not 1", e, length);
    if (use.name == "TANGENT" && std::abs(v[3]) != 1)
      return forbid(d.notes, place, "ACCESSOR_INVALID_SIGN", "element {} has the handedness {:g}, not 1 or -1", e,
                    v[3]);
  }
}

void audit_rotation_keys(Document& d, const AccessorUsed& use, bool cubic, const Place& place) {
  Elements elements(d, use.accessor);
  if (elements.components() != 4) return;
  for (std::uint64_t e = 0; e < elements.count(); ++e) {
    const double length = length_of(elements.next(e, true), 4);
    if ((!cubic || e % 3 == 1) && !(std::abs(length - 1) <= kUnit4))
      return forbid(d.notes, place, "ACCESSOR_ANIMATION_SAMPLER_OUTPUT_NON_NORMALIZED_QUATERNION",
                    "element {} has the length {:g}, not 1", e, length);
  }
}

void audit_colors(Document& d, const AccessorUsed& use, const Place& place) {
  if (d.layouts[use.accessor].component_type != kFloat) return;
  Elements elements(d, use.accessor);
  for (std::uint64_t e = 0; e < elements.count(); ++e) {
    const std::array<double, 16>& v = elements.next(e, true);
    for (std::size_t c = 0; c < elements.components(); ++c)
      if (v[c] < 0 || v[c] > 1)
        return forbid(d.notes, place, "ACCESSOR_NON_CLAMPED", "element {} is {:g}, outside [0, 1]", e, v[c]);
  }
}

void audit_inverse_bind(Document& d, const AccessorUsed& use, const Place& place) {
  Elements elements(d, use.accessor);
  for (std::uint64_t e = 0; e < elements.count(); ++e) {
    const std::array<double, 16>& m = elements.next(e, true);
    if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
      return forbid(d.notes, place, "ACCESSOR_INVALID_IBM", "matrix {} has a last row that is not 0 0 0 1", e);
  }
}

void audit_indices(Document& d, const AccessorUsed& use, const Place& place) {
  Elements elements(d, use.accessor);
  for (std::uint64_t e = 0; e < elements.count(); ++e)
    if (elements.next(e, false)[0] >= static_cast<double>(use.vertices))
      return forbid(d.notes, place, "ACCESSOR_INDEX_OOB", "index {} is beyond the vertices, {}", e, use.vertices);
}

// Weights of all sets of a vertex, and the joints that they belong to.
void audit_influences(Document& d, const json& primitive, std::size_t joint_count, const Place& place) {
  std::vector<Elements> joints, weights;
  bool integers = false;
  for (std::size_t set = 0;; ++set) {
    const json *j = find(primitive["attributes"], "JOINTS_" + std::to_string(set)),
               *w = find(primitive["attributes"], "WEIGHTS_" + std::to_string(set));
    if (j == nullptr || w == nullptr) break;
    joints.emplace_back(d, j->get<std::size_t>());
    weights.emplace_back(d, w->get<std::size_t>());
    integers |= d.layouts[w->get<std::size_t>()].component_type != kFloat;
  }
  for (std::uint64_t v = 0; !joints.empty() && v < joints[0].count(); ++v) {
    double sum = 0;
    int used = 0;
    std::set<double> seen;
    for (std::size_t set = 0; set < joints.size(); ++set) {
      const std::array<double, 16> j = joints[set].next(v, false), w = weights[set].next(v, true);
      for (std::size_t k = 0; k < 4; ++k) {
        if (w[k] < 0) return forbid(d.notes, place, "ACCESSOR_WEIGHTS_NEGATIVE", "vertex {} has a negative weight", v);
        if (j[k] >= static_cast<double>(joint_count))
          return forbid(d.notes, place, "ACCESSOR_JOINTS_INDEX_OOB", "vertex {} names joint {:g}, there are {}", v,
                        j[k], joint_count);
        if (w[k] == 0) continue;
        ++used, sum += w[k];
        if (!seen.insert(j[k]).second)
          return forbid(d.notes, place, "ACCESSOR_JOINTS_INDEX_DUPLICATE", "vertex {} names joint {:g} twice", v, j[k]);
      }
    }
    if (std::abs(sum - 1) > (integers ? 1e-6 : 2e-7 * std::max(used, 1) + 1e-7))
      return forbid(d.notes, place, "ACCESSOR_WEIGHTS_NON_NORMALIZED", "vertex {} has weights of the sum {:g}", v, sum);
  }
}

// Number of joints of a mesh: that many has the smallest skin with which it is drawn.
std::map<std::size_t, std::size_t> joints_of_meshes(const json& d) {
  std::map<std::size_t, std::size_t> joints;
  for (const json& node : list_of(d, "nodes")) {
    const json *mesh = find(node, "mesh"), *skin = find(node, "skin");
    if (mesh == nullptr || skin == nullptr) continue;
    const std::size_t count = d["skins"][skin->get<std::size_t>()]["joints"].size();
    const auto [at, fresh] = joints.try_emplace(mesh->get<std::size_t>(), count);
    if (!fresh) at->second = std::min(at->second, count);
  }
  return joints;
}

void audit_skinned_meshes(Document& d) {
  const std::map<std::size_t, std::size_t> joints = joints_of_meshes(d.json);
  const json& meshes = list_of(d.json, "meshes");
  for (std::size_t m = 0; m < meshes.size(); ++m)
    for (std::size_t p = 0; p < meshes[m]["primitives"].size(); ++p) {
      const json& primitive = meshes[m]["primitives"][p];
      if (find_extension(primitive, "KHR_draco_mesh_compression") != nullptr) continue;
      const auto known = joints.find(m);
      audit_influences(d, primitive, known == joints.end() ? 65536 : known->second,
                       d.root.at("meshes").at(m).at("primitives").at(p).at("attributes"));
    }
}

// Samplers whose values are splines: their outputs.
std::set<std::size_t> spline_outputs(const json& d) {
  std::set<std::size_t> outputs;
  for (const json& animation : list_of(d, "animations"))
    for (const json& sampler : animation["samplers"])
      if (sampler.value("interpolation", std::string()) == "CUBICSPLINE")
        outputs.insert(sampler["output"].get<std::size_t>());
  return outputs;
}

void audit_use(Document& d, const AccessorUsed& use, const std::set<std::size_t>& splines, const Place& place) {
  if (use.in_stream) return;
  const bool vertices = use.role == AccessorRole::kVertices;
  if (vertices && (use.name == "NORMAL" || use.name == "TANGENT"))
    audit_unit(d, use, 3, "ACCESSOR_VECTOR3_NON_UNIT", place);
  if (vertices && use.name.starts_with("COLOR_")) audit_colors(d, use, place);
  if (use.role == AccessorRole::kIndices && use.vertices > 0) audit_indices(d, use, place);
  if (use.role == AccessorRole::kInverseBind) audit_inverse_bind(d, use, place);
  if (use.role == AccessorRole::kKeyValues && use.path == "rotation")
    audit_rotation_keys(d, use, splines.contains(use.accessor), place);
}

// ---- Files ------------------------------------------------------------------------------------------------------

struct NamedBytes {
  std::uint64_t size = 0;
  std::vector<std::uint8_t> head;
};

// The kind of thing that a URI names, as far as anybody needs to look.
NamedBytes look_at(const std::string& uri, const std::filesystem::path& folder, const Place& place) {
  constexpr std::streamsize kHead = 64;
  NamedBytes out;
  if (is_data_uri(uri)) {
    std::vector<std::uint8_t> bytes = decode_data_uri(uri, place);
    out.size = bytes.size();
    bytes.resize(std::min<std::size_t>(bytes.size(), kHead));
    out.head = std::move(bytes);
    return out;
  }
  const std::filesystem::path target = resolve_uri(uri, folder, place);
  std::error_code error;
  out.size = std::filesystem::file_size(target, error);
  if (error) place.refuse("{}: {}", uri, error.message());
  std::ifstream stream(target, std::ios::binary);
  out.head.resize(kHead);
  stream.read(reinterpret_cast<char*>(out.head.data()), kHead);
  out.head.resize(static_cast<std::size_t>(stream.gcount()));
  return out;
}

// The MIME type of an image by its first bytes; "" for none that is known.
std::string type_of(const std::vector<std::uint8_t>& head) {
  return ktx2::is_ktx2(head) ? "image/ktx2" : mime_type(image_format(head));
}

void audit_images(Document& d, const std::filesystem::path& folder) {
  std::set<std::string> used;
  for (const json& name : list_of(d.json, "extensionsUsed")) used.insert(name.get<std::string>());
  const json& images = list_of(d.json, "images");
  for (std::size_t i = 0; i < images.size(); ++i) {
    const Place place = d.root.at("images").at(i);
    NamedBytes bytes;
    try {
      if (const json* uri = find(images[i], "uri"))
        bytes = look_at(uri->get<std::string>(), folder, place.at("uri"));
      else if (const json* view = find(images[i], "bufferView")) {
        const Bytes all = d.resources.buffer_view(view->get<std::size_t>());
        bytes = {all.size(),
                 {all.begin(), all.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(all.size(), 64))}};
      }
    } catch (const InputError& error) {
      forbid(d.notes, place, "IO_ERROR", "{}", error.fault());
      continue;
    }
    const std::string type = type_of(bytes.head), declared = images[i].value("mimeType", std::string());
    if (type.empty()) {
      forbid(d.notes, place, "IMAGE_DATA_INVALID", "is no image that is known");
      continue;
    }
    if (!declared.empty() && declared != type)
      forbid(d.notes, place.at("mimeType"), "IMAGE_MIME_TYPE_INVALID", "is {}, the image says {}", declared, type);
    if ((type == "image/webp" && !used.contains("EXT_texture_webp")) ||
        (type == "image/ktx2" && !used.contains("KHR_texture_basisu")))
      forbid(d.notes, place, "IMAGE_NON_ENABLED_MIME_TYPE", "is {}, which no declared extension allows", type);
  }
}

void audit_buffers(Document& d, const std::filesystem::path& folder) {
  const json& buffers = list_of(d.json, "buffers");
  for (std::size_t b = 0; b < buffers.size(); ++b) {
    const json* uri = find(buffers[b], "uri");
    if (uri == nullptr) continue;
    const Place place = d.root.at("buffers").at(b);
    const auto length = buffers[b]["byteLength"].get<std::uint64_t>();
    try {
      const std::uint64_t size = look_at(uri->get<std::string>(), folder, place.at("uri")).size;
      if (size < length || (is_data_uri(uri->get_ref<const std::string&>()) && size != length))
        forbid(d.notes, place.at("byteLength"), "BUFFER_BYTE_LENGTH_MISMATCH", "is {}, the data have {}", length, size);
    } catch (const InputError& error) {
      forbid(d.notes, place, "IO_ERROR", "{}", error.fault());
    }
  }
}

}  // namespace

void audit_contents(Document& d, const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  audit_buffers(d, folder);
  audit_images(d, folder);
  std::set<std::size_t> in_streams;
  for_each_accessor_use(d.json, d.root, [&](const AccessorUsed& use, const Place&) {
    if (use.in_stream) in_streams.insert(use.accessor);
  });
  const std::set<std::size_t> splines = spline_outputs(d.json);
  try {
    for (std::size_t a = 0; a < d.layouts.size(); ++a)
      if (!in_streams.contains(a)) audit_bounds(d, a, d.root.at("accessors").at(a));
    for_each_accessor_use(d.json, d.root,
                          [&](const AccessorUsed& use, const Place& place) { audit_use(d, use, splines, place); });
    audit_skinned_meshes(d);
  } catch (const InputError& error) {
    if (d.notes.strict()) throw;  // data of accessors that nothing uses may be missing
    d.notes.add(d.root, "", fmt::format("not looked at whole: {}: {}", error.place(), error.fault()));
  }
}

}  // namespace tessera::scene::gltf
