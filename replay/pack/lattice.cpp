#include "replay/pack/lattice.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <unordered_map>

#include <glm/matrix.hpp>
#include <nlohmann/json.hpp>

#include "replay/pack/meshopt_encoder.h"
#include "scene/gltf/accessor_layout.h"
#include "scene/pose.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
namespace gltf = scene::gltf;

constexpr int kMantissaBits = 23;  // and a sign
constexpr int kTriangleMode = 4;

int QuantizationBits::*bits_of(const std::string& name) {
  if (name == "POSITION") return &QuantizationBits::position;
  if (name.starts_with("TEXCOORD_")) return &QuantizationBits::texcoord;
  if (name.starts_with("COLOR_")) return &QuantizationBits::color;
  return &QuantizationBits::generic;
}
// Positions and coordinates may lie anywhere; of other values zero and the largest one matter.
bool has_extent(const std::string& name) { return name == "POSITION" || name.starts_with("TEXCOORD_"); }

bool is_float(const gltf::Document& document, std::size_t accessor) {
  return document.layouts[accessor].component_type == gltf::kFloat;
}

bool on_grid(float value, int exponent) { return std::abs(std::ldexp(static_cast<double>(value), -exponent)) < 0x1p23; }

// By vertex: whether a triangle with an area uses it. All vertices, where there is no such triangle.
std::vector<bool> drawn_vertices(gltf::Document& document, const json& primitive, const std::vector<Vec3>& positions,
                                 bool deforms) {
  // A patch uses all of its control points.
  if (gltf::find_extension(primitive, "TESSERA_bezier_patches") != nullptr)
    return std::vector<bool>(positions.size(), true);
  std::vector<std::uint32_t> indices;
  if (const json* found = gltf::find(primitive, "indices"))
    indices = gltf::read_unsigned(document, found->get<std::size_t>());
  else
    for (std::uint32_t v = 0; v < positions.size(); ++v) indices.push_back(v);
  std::vector<bool> drawn(positions.size(), false);
  bool any = false;
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    const std::array<std::uint32_t, 3> t = {indices[i], indices[i + 1], indices[i + 2]};
    if (std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return v >= positions.size(); })) continue;
    const DVec3 a(positions[t[0]]), b(positions[t[1]]), c(positions[t[2]]);
    const bool flat = glm::cross(b - a, c - a) == DVec3(0.0);
    if (t[0] == t[1] || t[1] == t[2] || t[0] == t[2] || (flat && !deforms)) continue;
    for (const std::uint32_t v : t) drawn[v] = true;
    any = true;
  }
  if (!any) drawn.assign(positions.size(), true);
  return drawn;
}

std::set<std::size_t> skinned_meshes(const json& document) {
  std::set<std::size_t> meshes;
  for (const json& node : gltf::list_of(document, "nodes"))
    if (node.contains("skin") && node.contains("mesh")) meshes.insert(node["mesh"].get<std::size_t>());
  return meshes;
}

// A place where a mesh is drawn; skinned meshes lie where their vertices say.
struct Draw {
  std::size_t mesh;
  DMat4 to_world;
};
constexpr std::size_t kMaxDraws = 65536;  // beyond, instances are taken to touch nothing

std::vector<Draw> draws_of(const scene::Capture& capture) {
  const scene::Pose pose = scene::pose_at(capture, 0);
  std::vector<Draw> draws;
  for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
    const scene::Node& node = capture.nodes[n];
    if (node.mesh == scene::kNone || !pose.in_scene[n] || !pose.visible[n]) continue;
    const auto mesh = static_cast<std::size_t>(node.mesh);
    if (node.skin != scene::kNone) {
      draws.push_back({mesh, DMat4(1.0)});
    } else if (node.instances.empty()) {
      draws.push_back({mesh, pose.world[n]});
    } else if (draws.size() + node.instances.size() <= kMaxDraws) {
      for (const scene::InstanceTransform& instance : node.instances)
        draws.push_back({mesh, pose.world[n] * scene::instance_to_node(instance)});
    }
  }
  return draws;
}

struct Vec3Hash {
  std::size_t operator()(const std::array<std::uint32_t, 3>& v) const {
    std::uint64_t h = v[0];
    for (const std::uint32_t c : {v[1], v[2]}) h = (h ^ c) * 0x9E3779B97F4A7C15ull, h ^= h >> 29;
    return h;
  }
};

// Whether a transform between two places maps grid points to grid points: quarter turns, mirrors and steps of the grid.
bool keeps_grid(const DMat4& between, int exponent) {
  constexpr double kClose = 1e-9;
  for (int row = 0; row < 3; ++row) {
    int ones = 0;
    for (int column = 0; column < 3; ++column) {
      const double v = std::abs(between[column][row]);
      if (std::abs(v - 1) < kClose)
        ++ones;
      else if (v > kClose)
        return false;
    }
    const double steps = std::ldexp(between[3][row], -exponent);
    if (ones != 1 || std::abs(steps - std::round(steps)) > 1e-3) return false;
  }
  return true;
}

}  // namespace

Lattices::Lattices(gltf::Document& document, const scene::Capture& capture, const QuantizationBits& bits) {
  const json& meshes = gltf::list_of(document.json, "meshes");
  const std::set<std::size_t> skinned = skinned_meshes(document.json);
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    parents_.push_back(m);
    for (const json& primitive : meshes[m]["primitives"])
      if (primitive.value("mode", kTriangleMode) == kTriangleMode && primitive["attributes"].contains("POSITION") &&
          gltf::find_extension(primitive, "KHR_draco_mesh_compression") == nullptr &&
          gltf::find_encoded_clusters(primitive) == nullptr)
        measure(document, primitive, skinned.contains(m) || primitive.contains("targets"), m, bits);
  }
  join_touching(document, capture);
}

void Lattices::measure(gltf::Document& document, const json& primitive, bool deforming, std::size_t mesh,
                       const QuantizationBits& bits) {
  const std::vector<Vec3> positions = gltf::read_vec3(document, primitive["attributes"]["POSITION"].get<std::size_t>(),
                                                      [](std::uint64_t) { return false; });
  const std::vector<bool> drawn = drawn_vertices(document, primitive, positions, deforming);
  for (const auto& [name, index] : primitive["attributes"].items()) {
    const auto accessor = index.get<std::size_t>();
    if (!is_float(document, accessor) || name == "NORMAL" || name.starts_with("_")) continue;
    const auto components = static_cast<std::size_t>(document.layouts[accessor].components);
    const std::vector<float> values = gltf::read_floats(document, accessor, [](std::uint64_t) { return false; });
    float extent = 0, farthest = 0;
    for (std::size_t c = 0; c < components; ++c) {
      float low = std::numeric_limits<float>::max(), high = -low;
      for (std::size_t v = 0; v < drawn.size() && v * components + c < values.size(); ++v)
        if (drawn[v])
          low = std::min(low, values[v * components + c]), high = std::max(high, values[v * components + c]);
      if (low > high) continue;
      extent = std::max(extent, high - low);
      farthest = std::max({farthest, std::abs(low), std::abs(high)});
    }
    Extent& known = extents_[{mesh, name}];
    const float size = has_extent(name) ? extent : farthest;
    if (size > 0) known.step = std::min(known.step, grid_exponent(0, size, bits.*bits_of(name)));
    if (farthest > 0) known.mantissa = std::max(known.mantissa, grid_exponent(0, farthest, kMantissaBits));
  }
}

std::size_t Lattices::group_of(std::size_t mesh) const {
  while (parents_[mesh] != mesh) mesh = parents_[mesh];
  return mesh;
}

void Lattices::join_touching(gltf::Document& document, const scene::Capture& capture) {
  const std::vector<Draw> draws = draws_of(capture);
  const json& meshes = gltf::list_of(document.json, "meshes");
  std::unordered_map<std::array<std::uint32_t, 3>, std::size_t, Vec3Hash> owners;  // the first draw with a vertex there
  std::set<std::pair<std::size_t, std::size_t>> contacts;
  constexpr std::size_t kMaxVertices = 16u << 20;
  for (std::size_t k = 0; k < draws.size() && owners.size() < kMaxVertices; ++k) {
    const Draw& draw = draws[k];
    if (draw.mesh >= meshes.size()) continue;
    for (const json& primitive : meshes[draw.mesh]["primitives"]) {
      const json* position = gltf::find(primitive["attributes"], "POSITION");
      if (position == nullptr || !is_float(document, position->get<std::size_t>()) ||
          !extents_.contains({draw.mesh, "POSITION"}))
        continue;
      for (const Vec3& p :
           gltf::read_vec3(document, position->get<std::size_t>(), [](std::uint64_t) { return false; })) {
        const DVec4 world = draw.to_world * DVec4(DVec3(p), 1.0);
        std::array<std::uint32_t, 3> key;
        for (int c = 0; c < 3; ++c)
          key[static_cast<std::size_t>(c)] = std::bit_cast<std::uint32_t>(static_cast<float>(world[c]) + 0.0f);
        if (const auto [at, fresh] = owners.try_emplace(key, k); !fresh && at->second != k)
          contacts.emplace(at->second, k);
      }
    }
  }
  for (const auto& [a, b] : contacts) parents_[group_of(draws[a].mesh)] = group_of(draws[b].mesh);

  std::map<std::size_t, std::size_t> members;  // of groups
  for (std::size_t m = 0; m < parents_.size(); ++m) ++members[group_of(m)];
  std::map<std::pair<std::size_t, std::string>, Extent> of_groups;
  for (const auto& [key, extent] : extents_) {
    Extent& all = of_groups[{group_of(key.first), key.second}];
    all.step = std::min(all.step, extent.step);
    all.mantissa = std::max(all.mantissa, extent.mantissa);
  }
  for (const auto& [key, extent] : of_groups) {
    // A single mesh far from its origin has the precision of floats there; a small mesh beside a large one stays exact.
    const bool fits = members[key.first] == 1 || extent.mantissa <= extent.step;
    grids_[key] = fits ? std::optional(std::max(extent.step == 127 ? extent.mantissa : extent.step, extent.mantissa))
                       : std::nullopt;
  }
  for (const auto& [a, b] : contacts) {
    std::optional<int>& grid = grids_[{group_of(draws[a].mesh), "POSITION"}];
    if (grid && !keeps_grid(glm::inverse(draws[b].to_world) * draws[a].to_world, *grid)) grid.reset();
  }
}

void Lattices::apply(std::size_t mesh, DracoAttribute& attribute) const {
  if (attribute.component_type != gltf::kFloat || attribute.name == "NORMAL") return;
  const auto found = grids_.find({group_of(mesh), attribute.name});
  attribute.exact = true;
  if (found == grids_.end() || !found->second) return;
  const int exponent = *found->second;
  if (!std::all_of(attribute.values.begin(), attribute.values.end(), [&](float v) { return on_grid(v, exponent); }))
    return;
  for (float& v : attribute.values)
    v = static_cast<float>(std::ldexp(std::round(std::ldexp(static_cast<double>(v), -exponent)), exponent));
  attribute.exact = false;
  attribute.exponent = exponent;
}

}  // namespace tessera::replay
