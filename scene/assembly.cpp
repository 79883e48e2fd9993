#include "scene/assembly.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <meshoptimizer.h>

#include "base/check.h"
#include "base/error.h"
#include "base/parallel.h"
#include "scene/pose.h"
#include "scene/position_lattice.h"
#include "scene/weld.h"

namespace tessera::scene {
namespace {

// ---- Shared edges -----------------------------------------------------------------------------------------------

constexpr std::array<std::array<std::size_t, 4>, 4> kEdgePoints = {
    {{0, 1, 2, 3}, {12, 13, 14, 15}, {0, 4, 8, 12}, {3, 7, 11, 15}}};
constexpr std::array<std::size_t, 4> kCornerPoints = {0, 3, 12, 15};

// ---- Instances --------------------------------------------------------------------------------------------------

// The next floats outwards, so that a range of them holds the double.
void widen(float& low, float& high, double value) {
  const auto f = static_cast<float>(value);
  const double back = static_cast<double>(f);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  low = std::min(low, back <= value ? f : std::nextafter(f, -kInfinity));
  high = std::max(high, back >= value ? f : std::nextafter(f, kInfinity));
}

InstanceGroup empty_group(std::size_t first) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  InstanceGroup group{};
  group.first = static_cast<std::uint32_t>(first);
  group.origin_low.fill(kInfinity), group.origin_high.fill(-kInfinity);
  for (auto& row : group.linear_low) row.fill(kInfinity);
  for (auto& row : group.linear_high) row.fill(-kInfinity);
  return group;
}

void add_instance(const InstanceTransform& instance, InstanceGroup& group) {
  const DMat4 m = instance_to_node(instance);
  ++group.count;
  for (int row = 0; row < 3; ++row) {
    const auto r = static_cast<std::size_t>(row);
    widen(group.origin_low[r], group.origin_high[r], m[3][row]);
    for (int column = 0; column < 3; ++column) {
      const auto c = static_cast<std::size_t>(column);
      widen(group.linear_low[r][c], group.linear_high[r][c], m[column][row]);
    }
  }
}

// ---- Drawables --------------------------------------------------------------------------------------------------

std::size_t instance_count(const Node& node) { return std::max<std::size_t>(node.instances.size(), 1); }

// The patches of a drawable that is otherwise complete.
void add_drawable(Drawable drawable, std::size_t patches, Assembly& assembly) {
  drawable.first_patch = static_cast<std::uint32_t>(assembly.patch_count());
  drawable.patch_count = static_cast<std::uint32_t>(patches);
  if (has_grid(drawable)) {
    drawable.first_grid = static_cast<std::uint32_t>(assembly.grid_patches.size());
    for (std::size_t p = 0; p < patches; ++p)
      assembly.grid_patches.push_back(drawable.first_patch + static_cast<std::uint32_t>(p));
  }
  assembly.patch_drawable.insert(assembly.patch_drawable.end(), patches,
                                 static_cast<std::uint32_t>(assembly.drawables.size()));
  assembly.drawables.push_back(drawable);
}

std::uint32_t take_records(std::size_t patches, Assembly& assembly) {
  const std::uint32_t first = assembly.record_count;
  assembly.record_count += static_cast<std::uint32_t>(patches);
  return first;
}

// Base patches of a procedure: each piece cut evenly, piece by piece, row by row.
void add_procedures(const Capture& capture, const Pose& rest, const DrawnFilter& drawn, Assembly& assembly) {
  for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
    const int number = capture.nodes[n].procedure;
    if (number == kNone || !rest.in_scene[n] || (drawn && !drawn(static_cast<int>(n), kNone))) continue;
    const Procedure& procedure = capture.procedures[static_cast<std::size_t>(number)];
    const shaders::StageDeclaration& shape = procedure.declaration();
    const std::size_t patches = procedure.pieces.size() * static_cast<std::size_t>(shape.patches_u * shape.patches_v);
    Drawable drawable{};
    drawable.node = static_cast<int>(n);
    drawable.mesh = drawable.primitive = kNone;
    drawable.material = procedure.material == kNone ? static_cast<int>(capture.materials.size()) : procedure.material;
    drawable.kind = Primitive::Kind::kProcedure;
    drawable.geometry = static_cast<std::uint32_t>(number);
    drawable.drawn = static_cast<std::uint32_t>(assembly.drawn.size());
    drawable.first_record = take_records(patches, assembly);
    assembly.drawn.push_back({static_cast<std::uint32_t>(assembly.drawables.size()), 1, 1});
    add_drawable(drawable, patches, assembly);
  }
}

// ---- Materials --------------------------------------------------------------------------------------------------

// Materials as primitives can have them: without the textures whose coordinates a primitive lacks, and for points and
// lines seen from both sides and, without normals, unlit (glTF 2.0 section 3.7.2.1).
class MaterialVariants {
 public:
  explicit MaterialVariants(Assembly& assembly) : assembly_(assembly) {}

  int of(const Primitive& primitive) {
    const auto plain = static_cast<std::size_t>(primitive.material == kNone ? default_ : primitive.material);
    Material material = assembly_.materials[plain];
    const auto lacks = [&](int set) {
      const auto& sets = primitive.vertices.texcoords;
      return static_cast<std::size_t>(set) >= sets.size() || sets[static_cast<std::size_t>(set)].empty();
    };
    unsigned changes = 0;
    for (std::size_t s = 0; s < material.slots().size(); ++s)
      if (TextureSlot& slot = *material.slots()[s]; slot.texture != nullptr && lacks(slot.texcoord)) {
        slot.texture = nullptr;
        changes |= 1u << s;
      }
    if (material.displacement && lacks(material.displacement->texcoord)) {
      material.displacement.reset();
      changes |= kNoDisplacement;
    }
    // Directions that nothing states: the surface stays as round as without them.
    if (material.has(MaterialEffect::kAnisotropy) && lacks(tangent_slot(material).texcoord) &&
        (primitive.vertices.tangents.empty() || primitive.kind != Primitive::Kind::kTriangles)) {
      material.effects.reset(static_cast<std::size_t>(MaterialEffect::kAnisotropy));
      changes |= kNoTangents;
    }
    if (primitive.wire != Primitive::Wire::kSurface) {
      material.double_sided = true;
      changes |= kWire;
      if (primitive.vertices.normals.empty() && !material.unlit) {
        material.unlit = material.glows_unlit = true;
        material.effects.reset();
        changes |= kGlow;
      }
    }
    if (changes == 0) return static_cast<int>(plain);
    const auto [number, fresh] = variants_.try_emplace({plain, changes}, static_cast<int>(assembly_.materials.size()));
    if (fresh) {
      assembly_.materials.push_back(std::move(material));
      assembly_.material_source.push_back(assembly_.material_source[plain]);
    }
    return number->second;
  }

 private:
  static constexpr unsigned kNoDisplacement = 1u << kMaterialTextureCount, kWire = kNoDisplacement << 1,
                            kGlow = kNoDisplacement << 2, kNoTangents = kNoDisplacement << 3;
  Assembly& assembly_;
  const int default_ = static_cast<int>(assembly_.materials.size()) - 1;
  std::map<std::pair<std::size_t, unsigned>, int> variants_;
};

// The geometry of every primitive that is drawn, once, and its number by mesh and primitive.
using GeometryNumbers = std::map<std::pair<int, int>, std::uint32_t>;
GeometryNumbers build_geometry(const Capture& capture, const Pose& rest, Assembly& assembly) {
  GeometryNumbers numbers;
  std::vector<const Primitive*> bezier, meshes;
  for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
    const int mesh = capture.nodes[n].mesh;
    if (mesh == kNone || !rest.in_scene[n]) continue;
    const auto& primitives = capture.meshes[static_cast<std::size_t>(mesh)].primitives;
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      std::vector<const Primitive*>& kind = primitives[p].kind == Primitive::Kind::kBezierPatches ? bezier : meshes;
      if (numbers.try_emplace({mesh, static_cast<int>(p)}, static_cast<std::uint32_t>(kind.size())).second)
        kind.push_back(&primitives[p]);
    }
  }
  assembly.neighbours.resize(bezier.size());
  assembly.clusters.resize(meshes.size());
  assembly.bezier_groups.resize(bezier.size());
  assembly.cluster_groups.resize(meshes.size());
  assembly.cluster_bounds.resize(meshes.size());
  parallel_for(bezier.size(), [&](std::size_t i) {
    assembly.neighbours[i] = find_neighbours(bezier[i]->vertices);
    assembly.bezier_groups[i] = group_bezier_patches(bezier[i]->vertices);
  });
  parallel_for(meshes.size(), [&](std::size_t i) {
    assembly.clusters[i] = build_clusters(*meshes[i]);
    assembly.cluster_groups[i] = group_clusters(*meshes[i], assembly.clusters[i]);
    if (rests_always(*meshes[i])) assembly.cluster_bounds[i] = bound_clusters(*meshes[i], assembly.clusters[i]);
  });
  return numbers;
}

// One primitive of a node, as a drawable that lacks its patches and its instance.
struct NodePrimitive {
  Drawable drawable;
  std::size_t patches;
};
std::vector<NodePrimitive> primitives_of(const Capture& capture, std::size_t node, const GeometryNumbers& numbers,
                                         const DrawnFilter& drawn, const Assembly& assembly,
                                         MaterialVariants& variants) {
  std::vector<NodePrimitive> out;
  const int mesh = capture.nodes[node].mesh;
  const auto& primitives = capture.meshes[static_cast<std::size_t>(mesh)].primitives;
  for (std::size_t p = 0; p < primitives.size(); ++p) {
    const Primitive& primitive = primitives[p];
    if (drawn && !drawn(static_cast<int>(node), static_cast<int>(p))) continue;
    Drawable drawable{};
    drawable.node = static_cast<int>(node);
    drawable.mesh = mesh;
    drawable.primitive = static_cast<int>(p);
    drawable.material = variants.of(primitive);
    drawable.kind = primitive.kind;
    drawable.instanced = !capture.nodes[node].instances.empty();
    drawable.wire = primitive.wire != Primitive::Wire::kSurface;
    drawable.geometry = numbers.at({mesh, static_cast<int>(p)});
    out.push_back({drawable, primitive.kind == Primitive::Kind::kBezierPatches
                                 ? assembly.neighbours[drawable.geometry].size()
                                 : assembly.clusters[drawable.geometry].clusters.size()});
  }
  return out;
}

// Makes room for all drawables and patches of the nodes' primitives at once.
void reserve(const Capture& capture, const std::vector<std::vector<NodePrimitive>>& nodes, Assembly& assembly) {
  std::uint64_t drawables = 0, patches = 0, grids = 0;
  constexpr std::uint64_t kMaxPatches = 0xffff'fffe;  // patch + 1 is a number as well
  for (std::size_t n = 0; n < nodes.size(); ++n)
    for (const NodePrimitive& primitive : nodes[n]) {
      const std::uint64_t count = instance_count(capture.nodes[n]), all = count * primitive.patches;
      drawables += count, patches += all;
      if (has_grid(primitive.drawable)) grids += all;
      if (patches > kMaxPatches || drawables > kMaxPatches)
        throw LimitError(fmt::format("{}: has more than {} base patches, instances counted one by one",
                                     capture.file.string(), kMaxPatches));
    }
  assembly.drawables.reserve(drawables);
  assembly.patch_drawable.reserve(patches);
  assembly.grid_patches.reserve(grids);
}

void add_node(const Node& node, std::vector<NodePrimitive>& primitives, Assembly& assembly) {
  const auto stride = static_cast<std::uint32_t>(primitives.size());
  const auto count = static_cast<std::uint32_t>(instance_count(node));
  const auto first = static_cast<std::uint32_t>(assembly.drawables.size());
  const bool wires = std::any_of(primitives.begin(), primitives.end(), [](const auto& p) { return p.drawable.wire; });
  if (!node.instances.empty() && stride > 0 && !wires) {
    InstancedNode& instanced = assembly.instanced_nodes.emplace_back(group_instances(node.instances));
    instanced.node = primitives[0].drawable.node;
    instanced.first_drawable = first;
    instanced.primitives = stride;
    instanced.first_drawn = static_cast<std::uint32_t>(assembly.drawn.size());
  }
  // Points and lines differ from instance to instance: such a node is in memory as one for each of its instances.
  for (std::uint32_t p = 0; p < stride; ++p) {
    primitives[p].drawable.drawn = static_cast<std::uint32_t>(assembly.drawn.size());
    primitives[p].drawable.instanced = primitives[p].drawable.instanced && !wires;
    primitives[p].drawable.first_record = take_records(primitives[p].patches * (wires ? count : 1), assembly);
    const bool shared = !primitives[p].drawable.wire;
    for (std::uint32_t i = 0; i < (shared ? 1 : count); ++i)
      assembly.drawn.push_back({first + p + i * stride, stride, shared ? count : 1});
  }
  for (std::uint32_t i = 0; i < count; ++i)
    for (const NodePrimitive& primitive : primitives) {
      Drawable drawable = primitive.drawable;
      drawable.instance = i;
      drawable.drawn += drawable.wire ? i : 0;
      drawable.first_record += wires ? i * static_cast<std::uint32_t>(primitive.patches) : 0;
      add_drawable(drawable, primitive.patches, assembly);
    }
}

}  // namespace

std::vector<PatchNeighbours> find_neighbours(const Vertices& control_points) {
  const std::vector<std::uint32_t> number = weld_points(control_points);  // so that edges compare as four numbers
  const std::size_t patch_count = control_points.count() / 16;
  std::vector<PatchNeighbours> out(patch_count);
  std::map<std::array<std::uint32_t, 4>, PatchNeighbours::EdgeOwner> edge_owner;
  std::map<std::uint32_t, PatchNeighbours::CornerOwner> corner_owner;
  // The first patch that has an edge or corner owns it.
  for (std::size_t p = 0; p < patch_count; ++p) {
    const auto patch = static_cast<std::uint32_t>(p);
    for (std::size_t e = 0; e < 4; ++e) {
      std::array<std::uint32_t, 4> key;
      for (std::size_t k = 0; k < 4; ++k) key[k] = number[16 * p + kEdgePoints[e][k]];
      std::array<std::uint32_t, 4> backward = {key[3], key[2], key[1], key[0]};
      const bool reversed = backward < key;
      const bool collapsed = key[0] == key[1] && key[1] == key[2] && key[2] == key[3];
      const PatchNeighbours::EdgeOwner self{patch, static_cast<std::uint8_t>(e), reversed, collapsed};
      PatchNeighbours::EdgeOwner owner = edge_owner.emplace(reversed ? backward : key, self).first->second;
      owner.reversed = owner.reversed != reversed;
      out[p].edges[e] = owner;
    }
    for (std::size_t c = 0; c < 4; ++c) {
      const PatchNeighbours::CornerOwner self{patch, static_cast<std::uint8_t>(c)};
      out[p].corners[c] = corner_owner.emplace(number[16 * p + kCornerPoints[c]], self).first->second;
    }
  }
  return out;
}

InstancedNode group_instances(const std::vector<InstanceTransform>& instances) {
  InstancedNode out{};
  const std::size_t count = instances.size();
  std::vector<std::uint32_t> place(count);
  meshopt_spatialSortRemap(place.data(), instances[0].translation.data(), count, sizeof(InstanceTransform));
  out.order.resize(count);
  for (std::size_t i = 0; i < count; ++i) out.order[place[i]] = static_cast<std::uint32_t>(i);
  for (std::size_t k = 0; k < count; ++k) {
    if (k % kInstancesPerGroup == 0) out.groups.push_back(empty_group(k));
    add_instance(instances[out.order[k]], out.groups.back());
  }
  return out;
}

Assembly assemble(const Capture& capture, const DrawnFilter& drawn) {
  Assembly assembly;
  assembly.capture = &capture;
  assembly.materials = capture.materials;
  assembly.materials.push_back(Material{});
  for (std::size_t m = 0; m < capture.materials.size(); ++m) assembly.material_source.push_back(static_cast<int>(m));
  assembly.material_source.push_back(kNone);
  MaterialVariants variants(assembly);
  const Pose rest = pose_at(capture, 0.0);
  const GeometryNumbers numbers = build_geometry(capture, rest, assembly);
  std::vector<std::vector<NodePrimitive>> nodes(capture.nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n)
    if (capture.nodes[n].mesh != kNone && rest.in_scene[n])
      nodes[n] = primitives_of(capture, n, numbers, drawn, assembly, variants);
  reserve(capture, nodes, assembly);
  for (std::size_t n = 0; n < nodes.size(); ++n)
    if (!nodes[n].empty()) add_node(capture.nodes[n], nodes[n], assembly);
  add_procedures(capture, rest, drawn, assembly);
  return assembly;
}

}  // namespace tessera::scene
