#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "scene/clusters.h"
#include "scene/gltf/accessor_layout.h"
#include "scene/gltf/builders.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

constexpr int kModePoints = 0, kModeLines = 1, kModeLineLoop = 2, kTriangles = 4,
              kTriangleFan = 6;            // LINE_STRIP, TRIANGLE_STRIP: others
constexpr std::size_t kMaxTexcoords = 64;  // sets that materials may name

// `Vector` is made of floats alone.
template <class Vector>
std::vector<Vector> as_vectors(const std::vector<float>& scalars) {
  std::vector<Vector> out(scalars.size() * sizeof(float) / sizeof(Vector));
  std::memcpy(reinterpret_cast<float*>(out.data()), scalars.data(), out.size() * sizeof(Vector));
  return out;
}

// Vectors of 3 or 4 scalars; a missing fourth is 1.
std::vector<Vec4> as_vec4(const std::vector<float>& scalars, int components) {
  const auto n = static_cast<std::size_t>(components);
  std::vector<Vec4> out(scalars.size() / n);
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = {scalars[n * i], scalars[n * i + 1], scalars[n * i + 2], n == 4 ? scalars[n * i + 3] : 1.0f};
  return out;
}

// Attribute values of one primitive, from its stream (Draco's, or of clusters) where that has them, from accessors otherwise.
class AttributeSource {
 public:
  // `indices` are the indices of all drawn vertices; null: all vertices are drawn.
  AttributeSource(Document& document, const json& primitive, const DecodedMesh* stream,
                  const std::vector<std::uint32_t>* indices, const Place& place)
      : document_(document), primitive_(primitive), stream_(stream), indices_(indices), place_(place) {}

  bool has(const std::string& name) const { return primitive_["attributes"].contains(name); }

  int components(const std::string& name) const {
    const auto& type = document_.json["accessors"][accessor(name)]["type"].get_ref<const std::string&>();
    return type.back() - '0';
  }

  std::vector<float> floats(const std::string& name) {
    if (const std::vector<float>* values = in_stream(name)) return *values;
    return outside_stream(name, read(accessor(name)));
  }

  // An accessor with an element per vertex; vertices that are never drawn need not be finite.
  std::vector<float> read(std::size_t accessor) { return read_floats(document_, accessor, drawn_only()); }
  std::vector<Vec3> read_vectors(std::size_t accessor) {
    std::vector<Vec3> values = read_vec3(document_, accessor, drawn_only());
    charge(3 * values.size(), sizeof(float));
    return values;
  }

  // Charges vectors that are made from the scalars.
  void charge(std::size_t count, std::uint64_t bytes) { document_.budget.charge(count, bytes, place_); }

  std::vector<Vec2> vec2(const std::string& name) {
    const std::vector<float>* values = in_stream(name);
    std::vector<Vec2> out = values != nullptr
                                ? as_vectors<Vec2>(*values)
                                : outside_stream(name, read_vec2(document_, accessor(name), drawn_only()));
    charge(2 * out.size(), sizeof(float));
    return out;
  }
  std::vector<Vec3> vec3(const std::string& name) {
    const std::vector<float>* values = in_stream(name);
    std::vector<Vec3> out = values != nullptr
                                ? as_vectors<Vec3>(*values)
                                : outside_stream(name, read_vec3(document_, accessor(name), drawn_only()));
    charge(3 * out.size(), sizeof(float));
    return out;
  }
  std::vector<Vec4> vec4(const std::string& name) {
    const std::vector<float> scalars = floats(name);
    const int n = components(name);
    charge(scalars.size() / static_cast<std::size_t>(n), sizeof(Vec4));
    return as_vec4(scalars, n);
  }

 private:
  std::size_t accessor(const std::string& name) const { return primitive_["attributes"][name].get<std::size_t>(); }

  // The attribute's scalars in the stream, charged for a copy; null where it is not in one.
  const std::vector<float>* in_stream(const std::string& name) {
    const std::vector<float>* values = stream_ != nullptr ? stream_->find(name) : nullptr;
    if (values != nullptr) charge(values->size(), sizeof(float));
    return values;
  }
  // Beside a stream there must be as many elements as it has points.
  template <class Element>
  std::vector<Element> outside_stream(const std::string& name, std::vector<Element> values) const {
    const std::size_t count =
        values.size() * sizeof(Element) / sizeof(float) / static_cast<std::size_t>(components(name));
    if (stream_ != nullptr && count != stream_->vertex_count)
      place_.at("attributes")
          .at(name)
          .refuse("has {} elements outside the stream, which has {} points", count, stream_->vertex_count);
    return values;
  }

  std::function<bool(std::uint64_t)> drawn_only() {
    if (indices_ == nullptr) return {};
    return [this](std::uint64_t vertex) { return is_drawn(vertex); };
  }

  bool is_drawn(std::uint64_t vertex) {
    if (drawn_.empty()) {
      const std::uint32_t last = indices_->empty() ? 0 : *std::max_element(indices_->begin(), indices_->end());
      charge(std::size_t{last} + 1, 1);
      drawn_.assign(std::size_t{last} + 1, false);
      for (const std::uint32_t index : *indices_) drawn_[index] = true;
    }
    return vertex < drawn_.size() && drawn_[vertex];
  }

  Document& document_;
  const json& primitive_;
  const DecodedMesh* stream_;
  const std::vector<std::uint32_t>* indices_;
  std::vector<bool> drawn_;  // by vertex; empty until it matters
  const Place& place_;
};

// Adds a joint's weight to the joint's entry if there is one, else to a free place, else in the place of the lightest.
// Returns the weight that finds no place.
float add_influence(SkinInfluence& influence, std::uint16_t joint, float weight) {
  std::size_t lightest = 0;
  for (std::size_t k = 0; k < influence.weights.size(); ++k) {
    if (influence.weights[k] > 0 && influence.joints[k] == joint) {
      influence.weights[k] += weight;
      return 0;
    }
    if (influence.weights[k] < influence.weights[lightest]) lightest = k;
  }
  if (weight <= influence.weights[lightest]) return weight;
  std::swap(weight, influence.weights[lightest]);
  influence.joints[lightest] = joint;
  return weight;
}

// A vertex follows eight joints; where a file has more sets, the heaviest of each vertex.
std::vector<SkinInfluence> build_influences(AttributeSource& source, std::size_t count, const Place& place,
                                            Notes& notes) {
  source.charge(count, sizeof(SkinInfluence));
  std::vector<SkinInfluence> influences(count);
  for (std::size_t set = 0; source.has("JOINTS_" + std::to_string(set)); ++set) {
    const std::string suffix = std::to_string(set);
    const std::vector<float> joints = source.floats("JOINTS_" + suffix), weights = source.floats("WEIGHTS_" + suffix);
    const Place at = place.at("attributes").at("WEIGHTS_" + suffix);
    std::size_t lost = 0;
    for (std::size_t v = 0; v < count; ++v)
      for (std::size_t k = 0; k < 4; ++k) {
        const auto joint = static_cast<std::uint16_t>(joints[4 * v + k]);
        // Draco's quantisation may turn a zero into a little less.
        if (weights[4 * v + k] < -0.001f) at.refuse("vertex {} has a negative weight", v);
        const float weight = std::max(weights[4 * v + k], 0.0f);
        if (set >= 2) {
          lost += weight > 0 && add_influence(influences[v], joint, weight) > 0 ? 1 : 0;
          continue;
        }
        influences[v].joints[4 * set + k] = joint;
        influences[v].weights[4 * set + k] = weight;
      }
    if (lost > 0)
      notes.add(at, "a vertex follows the eight heaviest of its joints",
                fmt::format("{} influences are a ninth or further one", lost));
  }
  // Exporters write weights that do not sum to 1; all zero means the first joint.
  for (SkinInfluence& influence : influences) {
    float sum = 0;
    for (const float w : influence.weights) sum += w;
    if (sum > 0 && std::isfinite(1.0f / sum)) {
      for (float& w : influence.weights) w /= sum;
    } else {
      influence.weights = {1.0f};
    }
  }
  return influences;
}

std::vector<MorphTarget> build_targets(Document& document, AttributeSource& source, const json& primitive,
                                       std::size_t vertex_count, const Place& place) {
  std::vector<MorphTarget> targets;
  const json& list = list_of(primitive, "targets");
  document.budget.charge(list.size(), sizeof(MorphTarget), place);
  targets.reserve(list.size());
  for (std::size_t t = 0; t < list.size(); ++t) {
    MorphTarget& target = targets.emplace_back();
    const auto read = [&](const char* name, std::vector<Vec3>& out) {
      const json* found = find(list[t], name);
      if (found == nullptr) return;
      out = source.read_vectors(found->get<std::size_t>());
      if (out.size() != vertex_count)
        place.at("targets").at(t).at(name).refuse("has {} elements, the decoded primitive {}", out.size(),
                                                  vertex_count);
    };
    read("POSITION", target.positions);
    read("NORMAL", target.normals);
    read("TANGENT", target.tangents);
    for (const auto& [name, index] : list[t].items())
      if (name.starts_with("COLOR_") || name.starts_with("TEXCOORD_"))
        document.notes.add(place.at("targets").at(t).at(name), "colours and coordinates stay as they rest",
                           "is a morph target that is not read");
  }
  return targets;
}

Vertices build_vertices(Document& document, const json& primitive, const DecodedMesh* stream,
                        const std::vector<std::uint32_t>* indices, const Place& place) {
  AttributeSource source(document, primitive, stream, indices, place);
  Vertices vertices;
  vertices.positions = source.vec3("POSITION");
  if (source.has("NORMAL")) vertices.normals = source.vec3("NORMAL");
  if (source.has("TANGENT")) vertices.tangents = source.vec4("TANGENT");
  constexpr std::string_view kTexcoord = "TEXCOORD_";
  for (const auto& [name, accessor] : primitive["attributes"].items()) {
    if (!name.starts_with(kTexcoord)) continue;
    std::size_t set = kMaxTexcoords;
    std::from_chars(name.data() + kTexcoord.size(), name.data() + name.size(), set);
    if (set >= kMaxTexcoords || name.substr(kTexcoord.size()) != std::to_string(set)) {
      document.notes.add(place.at("attributes").at(name), "such coordinates are not read", "is no set below 64");
      continue;
    }
    vertices.texcoords.resize(std::max(vertices.texcoords.size(), set + 1));
    vertices.texcoords[set] = source.vec2(name);
  }
  if (source.has("COLOR_0")) vertices.colors = source.vec4("COLOR_0");
  for (const auto& [name, accessor] : primitive["attributes"].items())
    if (name.starts_with("COLOR_") && name != "COLOR_0")
      document.notes.add(place.at("attributes").at(name), "surfaces have the colours of COLOR_0", "is not read");
  if (source.has("JOINTS_0")) vertices.influences = build_influences(source, vertices.count(), place, document.notes);
  vertices.morph_targets = build_targets(document, source, primitive, vertices.count(), place);
  return vertices;
}

// A list of triangles from any of glTF's three triangle modes; an incomplete last triangle is dropped.
std::vector<std::uint32_t> triangle_list(std::vector<std::uint32_t> in, int mode) {
  if (mode == kTriangles) {
    in.resize(in.size() / 3 * 3);
    return in;
  }
  std::vector<std::uint32_t> out;
  out.reserve(in.size() < 2 ? 0 : 3 * (in.size() - 2));
  for (std::size_t i = 2; i < in.size(); ++i) {
    // glTF 2.0 section 3.7.2.1: strips alternate, so that all triangles wind alike; fans turn about vertex 0.
    if (mode == kTriangleFan)
      out.insert(out.end(), {in[i - 1], in[i], in[0]});
    else if (i % 2 == 0)
      out.insert(out.end(), {in[i - 2], in[i - 1], in[i]});
    else
      out.insert(out.end(), {in[i - 1], in[i - 2], in[i]});
  }
  return out;
}

// Both ends of each segment of any of glTF's three line modes; an incomplete last line is dropped.
std::vector<std::uint32_t> segment_list(const std::vector<std::uint32_t>& in, int mode) {
  std::vector<std::uint32_t> out;
  for (std::size_t i = 0; i + 1 < in.size(); i += mode == kModeLines ? 2 : 1) out.insert(out.end(), {in[i], in[i + 1]});
  if (mode == kModeLineLoop && in.size() > 1) out.insert(out.end(), {in.back(), in.front()});
  return out;
}

// Concatenates the lists of all runs between indices equal to `restart`.
template <class MakeList>
std::vector<std::uint32_t> lists_of_runs(const std::vector<std::uint32_t>& in, std::uint32_t restart,
                                         const MakeList& make_list) {
  std::vector<std::uint32_t> out;
  for (auto first = in.begin(); first != in.end();) {
    const auto last = std::find(first, in.end(), restart);
    const std::vector<std::uint32_t> list = make_list(std::vector<std::uint32_t>(first, last));
    out.insert(out.end(), list.begin(), list.end());
    first = last == in.end() ? last : last + 1;
  }
  return out;
}

// Triangles as three indices each, segments as two, points as one.
std::vector<std::uint32_t> build_indices(Document& document, const json& primitive, std::size_t vertex_count, int mode,
                                         const Place& place) {
  std::vector<std::uint32_t> indices;
  std::optional<std::uint32_t> restart;  // the largest value of the indices' type, where one has it
  if (const json* found = find(primitive, "indices")) {
    const auto accessor = found->get<std::size_t>();
    indices = read_unsigned(document, accessor);
    const Place at = document.root.at("accessors").at(accessor);
    const std::uint32_t largest = indices.empty() ? 0 : *std::max_element(indices.begin(), indices.end());
    const std::uint64_t bytes = component_bytes(document.layouts[accessor].component_type);
    if (const auto most = static_cast<std::uint32_t>((std::uint64_t{1} << (8 * bytes)) - 1); largest == most)
      restart = most;
    for (std::size_t i = 0; largest >= vertex_count && i < indices.size(); ++i)
      if (indices[i] >= vertex_count && indices[i] != restart)
        at.refuse("index {} is {}, there are {} vertices", i, indices[i], vertex_count);
    if (restart)
      document.notes.violation(at, "primitives begin anew there", "index {} is {}, the value that restarts primitives",
                               std::find(indices.begin(), indices.end(), *restart) - indices.begin(), *restart);
  } else {
    document.budget.charge(vertex_count, sizeof(std::uint32_t), place);
    indices.resize(vertex_count);
    std::iota(indices.begin(), indices.end(), 0u);
  }
  if (mode == kModePoints) {
    if (restart) std::erase(indices, *restart);
    return indices;
  }
  // Charges a growing vector: the old block and the new one.
  document.budget.charge(indices.size(), mode == kTriangles ? 4 : mode < kTriangles ? 24 : 12, place);
  const auto make_list = [mode](std::vector<std::uint32_t> run) {
    return mode < kTriangles ? segment_list(run, mode) : triangle_list(std::move(run), mode);
  };
  return restart ? lists_of_runs(indices, *restart, make_list) : make_list(std::move(indices));
}

template <class Value>
void gather(std::vector<Value>& values, const std::vector<std::uint32_t>& from) {
  if (values.empty()) return;
  std::vector<Value> out;
  out.reserve(from.size());
  for (const std::uint32_t v : from) out.push_back(values[v]);
  values = std::move(out);
}

// Points or segments, by their ends, as two triangles each (Primitive::Wire).
void expand_wires(Document& document, const std::vector<std::uint32_t>& ends, int mode, const Place& place,
                  Primitive& primitive) {
  primitive.wire = mode == kModePoints ? Primitive::Wire::kPoints : Primitive::Wire::kSegments;
  const std::uint64_t copies = mode == kModePoints ? 4 : 2, count = copies * ends.size();
  if (count > std::numeric_limits<std::uint32_t>::max())
    throw LimitError(
        fmt::format("{}: {}: more points or lines than 32 bits can number", document.root.file(), place.pointer()));
  Vertices& v = primitive.vertices;
  std::uint64_t vertex_bytes = sizeof(Vec3) + (v.normals.empty() ? 0 : sizeof(Vec3)) +
                               (v.tangents.empty() ? 0 : sizeof(Vec4)) + (v.colors.empty() ? 0 : sizeof(Vec4)) +
                               (v.influences.empty() ? 0 : sizeof(SkinInfluence));
  for (const auto& set : v.texcoords) vertex_bytes += set.empty() ? 0 : sizeof(Vec2);
  for (const MorphTarget& target : v.morph_targets)
    for (const auto* list : {&target.positions, &target.normals, &target.tangents})
      vertex_bytes += list->empty() ? 0 : sizeof(Vec3);
  // And a vertex's number, and six indices for four vertices.
  document.budget.charge(count, vertex_bytes + sizeof(std::uint32_t) + 6, place);
  std::vector<std::uint32_t> from;
  from.reserve(count);
  for (const std::uint32_t end : ends) from.insert(from.end(), copies, end);
  gather(v.positions, from);
  gather(v.normals, from);
  gather(v.tangents, from);
  gather(v.colors, from);
  gather(v.influences, from);
  for (auto& set : v.texcoords) gather(set, from);
  for (MorphTarget& target : v.morph_targets) {
    gather(target.positions, from);
    gather(target.normals, from);
    gather(target.tangents, from);
  }
  primitive.indices.reserve(count / 4 * 6);
  for (std::uint32_t first = 0; first < count; first += 4)
    primitive.indices.insert(primitive.indices.end(), {first, first + 1, first + 2, first, first + 2, first + 3});
}

// Whether a primitive claims that its triangles lie in the cluster order of build_clusters().
bool claims_cluster_order(const json& primitive) {
  const json* clusters = find_extension(primitive, "TESSERA_clusters");
  return clusters != nullptr && (*clusters)["maxVertices"] == kMaxClusterVertices &&
         (*clusters)["maxTriangles"] == kMaxClusterTriangles && (*clusters)["range"] == kClusterRangeTriangles;
}

}  // namespace

std::optional<Primitive> build_primitive(Document& document, const json& json_primitive, const Place& place) {
  const int mode = json_primitive.value("mode", kTriangles);
  if (!json_primitive["attributes"].contains("POSITION")) {
    document.notes.add(place, "such primitives are not drawn", "has no POSITION");
    return std::nullopt;
  }
  Primitive primitive;
  primitive.material = json_primitive.value("material", kNone);
  if (find_extension(json_primitive, "KHR_draco_mesh_compression") != nullptr) {
    // Draco streams always hold triangle lists, whatever mode says.
    DecodedMesh draco = read_draco(document, json_primitive, place);
    primitive.vertices = build_vertices(document, json_primitive, &draco, nullptr, place);
    primitive.indices = std::move(draco.indices);
  } else if (find_encoded_clusters(json_primitive) != nullptr) {
    DecodedMesh clusters = read_clusters(document, json_primitive, place);
    primitive.vertices = build_vertices(document, json_primitive, &clusters, nullptr, place);
    primitive.indices = std::move(clusters.indices);
    primitive.triangles_of_cluster = std::move(clusters.triangles_of_cluster);
  } else {
    const auto position = json_primitive["attributes"]["POSITION"].get<std::size_t>();
    const std::uint64_t vertex_count = document.layouts[position].count;
    std::vector<std::uint32_t> indices = build_indices(document, json_primitive, vertex_count, mode, place);
    // Patches are drawn by all of their points, whatever the indices of their cage say.
    const bool is_surface = find_extension(json_primitive, "TESSERA_bezier_patches") != nullptr ||
                            find_extension(json_primitive, kSubdivision) != nullptr;
    if (indices.empty() && !is_surface) {
      document.notes.add(place, "such primitives are not drawn", "holds no whole point, line or triangle");
      return std::nullopt;
    }
    primitive.vertices = build_vertices(document, json_primitive, nullptr, is_surface ? nullptr : &indices, place);
    if (mode < kTriangles)
      expand_wires(document, indices, mode, place, primitive);
    else
      primitive.indices = std::move(indices);
    primitive.in_cluster_order = mode == kTriangles && !is_surface && claims_cluster_order(json_primitive);
  }
  if (const json* bezier = find_extension(json_primitive, "TESSERA_bezier_patches")) {
    primitive.kind = Primitive::Kind::kBezierPatches;
    const auto count = (*bezier)["count"].get<std::size_t>();
    if (primitive.vertices.count() != 16 * count)
      place.at("extensions")
          .at("TESSERA_bezier_patches")
          .refuse("is {} patches of 16 control points, the Draco stream has {} points", count,
                  primitive.vertices.count());
  }
  return primitive;
}

std::vector<Mesh> build_meshes(Document& document) {
  std::vector<Mesh> meshes;
  const json& array = list_of(document.json, "meshes");
  meshes.reserve(array.size());
  for (std::size_t m = 0; m < array.size(); ++m) {
    const json& model = array[m];
    Mesh& mesh = meshes.emplace_back();
    mesh.name = model.value("name", std::string());
    mesh.default_weights = list_of(model, "weights").get<std::vector<float>>();
    std::size_t targets = 0;
    const Place primitives = document.root.at("meshes").at(m).at("primitives");
    for (std::size_t p = 0; p < model["primitives"].size(); ++p) {
      const Place place = primitives.at(p);
      const json& json_primitive = model["primitives"][p];
      if (auto primitive = build_primitive(document, json_primitive, place)) {
        subdivide(document, json_primitive, place, *primitive);
        targets = std::max(targets, primitive->vertices.morph_targets.size());
        mesh.primitives.push_back(std::move(*primitive));
      }
    }
    if (!mesh.primitives.empty()) mesh.default_weights.resize(targets, 0.0f);
  }
  return meshes;
}

}  // namespace tessera::scene::gltf
