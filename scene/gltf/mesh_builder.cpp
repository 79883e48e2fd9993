#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "scene/gltf/accessor_layout.h"
#include "scene/gltf/builders.h"
#include "scene/gltf/subdivision_builder.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

constexpr int kTriangles = 4, kTriangleStrip = 5, kTriangleFan = 6;

std::vector<Vec3> as_vec3(const std::vector<float>& scalars) {
  std::vector<Vec3> out(scalars.size() / 3);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = {scalars[3 * i], scalars[3 * i + 1], scalars[3 * i + 2]};
  return out;
}

std::vector<Vec2> as_vec2(const std::vector<float>& scalars) {
  std::vector<Vec2> out(scalars.size() / 2);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = {scalars[2 * i], scalars[2 * i + 1]};
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

// Attribute values of one primitive, from its Draco stream where that has them, from accessors otherwise.
class AttributeSource {
 public:
  AttributeSource(Document& document, const json& primitive, const DracoMesh* draco, const Place& place)
      : document_(document), primitive_(primitive), draco_(draco), place_(place) {}

  bool has(const std::string& name) const { return primitive_["attributes"].contains(name); }

  int components(const std::string& name) const {
    const auto& type = document_.json["accessors"][accessor(name)]["type"].get_ref<const std::string&>();
    return type.back() - '0';
  }

  std::vector<float> floats(const std::string& name) {
    if (draco_ != nullptr)
      if (const std::vector<float>* values = draco_->find(name)) {
        charge(values->size(), sizeof(float));
        return *values;
      }
    std::vector<float> values = read_floats(document_, accessor(name));
    if (draco_ != nullptr && values.size() != draco_->vertex_count * static_cast<std::size_t>(components(name)))
      place_.at("attributes")
          .at(name)
          .refuse("has {} elements outside the Draco stream, which has {} points",
                  values.size() / static_cast<std::size_t>(components(name)), draco_->vertex_count);
    return values;
  }

  // For vectors that are made from the scalars.
  void charge(std::size_t count, std::uint64_t bytes) { document_.budget.charge(count, bytes, place_.pointer()); }

  std::vector<Vec2> vec2(const std::string& name) {
    const std::vector<float> scalars = floats(name);
    charge(scalars.size(), sizeof(float));
    return as_vec2(scalars);
  }
  std::vector<Vec3> vec3(const std::string& name) {
    const std::vector<float> scalars = floats(name);
    charge(scalars.size(), sizeof(float));
    return as_vec3(scalars);
  }
  std::vector<Vec4> vec4(const std::string& name) {
    const std::vector<float> scalars = floats(name);
    const int n = components(name);
    charge(scalars.size() / static_cast<std::size_t>(n), sizeof(Vec4));
    return as_vec4(scalars, n);
  }

 private:
  std::size_t accessor(const std::string& name) const { return primitive_["attributes"][name].get<std::size_t>(); }

  Document& document_;
  const json& primitive_;
  const DracoMesh* draco_;
  const Place& place_;
};

std::vector<SkinInfluence> build_influences(AttributeSource& source, std::size_t count, const Place& place) {
  source.charge(count, sizeof(SkinInfluence));
  std::vector<SkinInfluence> influences(count);
  for (std::size_t set = 0; set < 2; ++set) {
    const std::string suffix = std::to_string(set);
    if (!source.has("JOINTS_" + suffix)) break;
    const std::vector<float> joints = source.floats("JOINTS_" + suffix), weights = source.floats("WEIGHTS_" + suffix);
    for (std::size_t v = 0; v < count; ++v)
      for (std::size_t k = 0; k < 4; ++k) {
        influences[v].joints[4 * set + k] = static_cast<std::uint16_t>(joints[4 * v + k]);
        const float weight = weights[4 * v + k];
        // Draco's quantisation may turn a zero into a little less.
        if (weight < -0.001f)
          place.at("attributes").at("WEIGHTS_" + suffix).refuse("vertex {} has a negative weight", v);
        influences[v].weights[4 * set + k] = std::max(weight, 0.0f);
      }
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

std::vector<MorphTarget> build_targets(Document& document, const json& primitive, std::size_t vertex_count,
                                       const Place& place) {
  std::vector<MorphTarget> targets;
  const auto list = primitive.find("targets");
  if (list == primitive.end()) return targets;
  document.budget.charge(list->size(), sizeof(MorphTarget), place.pointer());
  targets.reserve(list->size());
  for (std::size_t t = 0; t < list->size(); ++t) {
    MorphTarget& target = targets.emplace_back();
    const auto read = [&](const char* name, std::vector<Vec3>& out) {
      const auto found = (*list)[t].find(name);
      if (found == (*list)[t].end()) return;
      const std::vector<float> scalars = read_floats(document, found->get<std::size_t>());
      document.budget.charge(scalars.size(), sizeof(float), place.pointer());
      out = as_vec3(scalars);
      if (out.size() != vertex_count)
        place.at("targets").at(t).at(name).refuse("has {} elements, the decoded primitive {}", out.size(),
                                                  vertex_count);
    };
    read("POSITION", target.positions);
    read("NORMAL", target.normals);
    read("TANGENT", target.tangents);
  }
  return targets;
}

Vertices build_vertices(Document& document, const json& primitive, const DracoMesh* draco, const Place& place) {
  AttributeSource source(document, primitive, draco, place);
  Vertices vertices;
  vertices.positions = source.vec3("POSITION");
  if (source.has("NORMAL")) vertices.normals = source.vec3("NORMAL");
  if (source.has("TANGENT")) vertices.tangents = source.vec4("TANGENT");
  for (int set = 0; source.has("TEXCOORD_" + std::to_string(set)); ++set)
    vertices.texcoords.push_back(source.vec2("TEXCOORD_" + std::to_string(set)));
  if (source.has("COLOR_0")) vertices.colors = source.vec4("COLOR_0");
  if (source.has("JOINTS_0")) vertices.influences = build_influences(source, vertices.count(), place);
  vertices.morph_targets = build_targets(document, primitive, vertices.count(), place);
  return vertices;
}

// A list of triangles from any of glTF's three triangle modes; an incomplete last triangle is dropped.
std::vector<std::uint32_t> triangle_list(const std::vector<std::uint32_t>& in, int mode) {
  std::vector<std::uint32_t> out;
  if (mode == kTriangles) {
    out.assign(in.begin(), in.begin() + static_cast<std::ptrdiff_t>(in.size() / 3 * 3));
  } else {
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
  }
  return out;
}

std::vector<std::uint32_t> build_indices(Document& document, const json& primitive, std::size_t vertex_count, int mode,
                                         const Place& place) {
  std::vector<std::uint32_t> indices;
  if (const auto found = primitive.find("indices"); found != primitive.end()) {
    const auto accessor = found->get<std::size_t>();
    indices = read_unsigned(document, accessor);
    const Place at = document.root.at("accessors").at(accessor);
    for (std::size_t i = 0; i < indices.size(); ++i)
      if (indices[i] >= vertex_count) at.refuse("index {} is {}, there are {} vertices", i, indices[i], vertex_count);
    // The largest value of the type would restart strips on some machines and draw a vertex on others.
    const std::uint64_t bytes = component_bytes(accessor_layout(document.json, accessor).component_type);
    const auto restart = static_cast<std::uint32_t>((std::uint64_t{1} << (8 * bytes)) - 1);
    if (const auto found_restart = std::find(indices.begin(), indices.end(), restart); found_restart != indices.end())
      at.refuse("index {} is {}, the value that restarts primitives", found_restart - indices.begin(), restart);
  } else {
    document.budget.charge(vertex_count, sizeof(std::uint32_t), place.pointer());
    indices.resize(vertex_count);
    std::iota(indices.begin(), indices.end(), 0u);
  }
  document.budget.charge(indices.size(), mode == kTriangles ? 4 : 12, place.pointer());
  return triangle_list(indices, mode);
}

}  // namespace

std::optional<Primitive> build_primitive(Document& document, const json& json_primitive, const Place& place) {
  const int mode = json_primitive.value("mode", kTriangles);
  if (mode < kTriangles) {
    document.notices.push_back(place.pointer() + ": points and lines are not drawn");
    return std::nullopt;
  }
  if (!json_primitive["attributes"].contains("POSITION")) {
    document.notices.push_back(place.pointer() + ": has no POSITION and is not drawn");
    return std::nullopt;
  }
  Primitive primitive;
  primitive.material = json_primitive.value("material", kNone);
  if (find_extension(json_primitive, "KHR_draco_mesh_compression") != nullptr) {
    // Draco streams always hold triangle lists, whatever mode says.
    DracoMesh draco = read_draco(document, json_primitive, place);
    primitive.vertices = build_vertices(document, json_primitive, &draco, place);
    primitive.indices = std::move(draco.indices);
  } else {
    primitive.vertices = build_vertices(document, json_primitive, nullptr, place);
    primitive.indices = build_indices(document, json_primitive, primitive.vertices.count(), mode, place);
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
  const auto array = document.json.find("meshes");
  const std::size_t count = array == document.json.end() ? 0 : array->size();
  meshes.reserve(count);
  for (std::size_t m = 0; m < count; ++m) {
    const json& model = (*array)[m];
    Mesh& mesh = meshes.emplace_back();
    mesh.name = model.value("name", std::string());
    if (const auto weights = model.find("weights"); weights != model.end())
      mesh.default_weights = weights->get<std::vector<float>>();
    const Place primitives = document.root.at("meshes").at(m).at("primitives");
    for (std::size_t p = 0; p < model["primitives"].size(); ++p) {
      const Place place = primitives.at(p);
      const json& json_primitive = model["primitives"][p];
      if (auto primitive = build_primitive(document, json_primitive, place)) {
        subdivide(document, json_primitive, place, *primitive);
        mesh.default_weights.resize(primitive->vertices.morph_targets.size(), 0.0f);
        mesh.primitives.push_back(std::move(*primitive));
      }
    }
  }
  return meshes;
}

}  // namespace tessera::scene::gltf
