#include "scene/assembly.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <optional>
#include <utility>

#include <meshoptimizer.h>

#include "base/check.h"
#include "scene/pose.h"
#include "scene/weld.h"

namespace tessera::scene {
namespace {

// ---- Clusters ---------------------------------------------------------------------------------------------------

using LocalTriangle = std::array<std::uint8_t, 3>;

// The quad of two triangles that share an edge and wind alike, or nothing.
std::optional<ClusterCell> join(const LocalTriangle& s, const LocalTriangle& t) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      // The shared edge runs c->a in s = (a, b, c) and a->c in t = (a, c, d).
      const std::uint8_t a = s[i], b = s[(i + 1) % 3], c = s[(i + 2) % 3];
      if (t[j] == a && t[(j + 1) % 3] == c && t[(j + 2) % 3] != b) return ClusterCell{{a, b, c, t[(j + 2) % 3]}};
    }
  return std::nullopt;
}

// Pairs each triangle with the next free neighbour; what stays alone is a cell of its own.
void pair_triangles(const std::vector<LocalTriangle>& triangles, std::vector<ClusterCell>& cells) {
  std::vector<bool> used(triangles.size(), false);
  for (std::size_t s = 0; s < triangles.size(); ++s) {
    if (used[s]) continue;
    std::optional<ClusterCell> cell;
    for (std::size_t t = s + 1; t < triangles.size() && !cell; ++t) {
      if (used[t]) continue;
      cell = join(triangles[s], triangles[t]);
      if (cell) used[t] = true;
    }
    const LocalTriangle& alone = triangles[s];
    cells.push_back(cell.value_or(ClusterCell{{alone[0], alone[1], alone[2], alone[2]}}));
  }
}

// ---- Shared edges -----------------------------------------------------------------------------------------------

constexpr std::array<std::array<std::size_t, 4>, 4> kEdgePoints = {
    {{0, 1, 2, 3}, {12, 13, 14, 15}, {0, 4, 8, 12}, {3, 7, 11, 15}}};
constexpr std::array<std::size_t, 4> kCornerPoints = {0, 3, 12, 15};

// Base patches of a procedure: each piece cut evenly, piece by piece, row by row.
void add_procedures(const Capture& capture, const Pose& rest, Assembly& assembly) {
  for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
    const int number = capture.nodes[n].procedure;
    if (number == kNone || !rest.in_scene[n]) continue;
    const Procedure& procedure = capture.procedures[static_cast<std::size_t>(number)];
    const shaders::StageDeclaration& shape = procedure.declaration();
    const std::size_t patches = procedure.pieces.size() * static_cast<std::size_t>(shape.patches_u * shape.patches_v);
    Drawable drawable{};
    drawable.node = static_cast<int>(n);
    drawable.mesh = drawable.primitive = kNone;
    drawable.material = procedure.material == kNone ? static_cast<int>(capture.materials.size()) : procedure.material;
    drawable.kind = Primitive::Kind::kProcedure;
    drawable.first_patch = static_cast<std::uint32_t>(assembly.patch_count());
    drawable.patch_count = static_cast<std::uint32_t>(patches);
    drawable.geometry = static_cast<std::uint32_t>(number);
    assembly.patch_drawable.insert(assembly.patch_drawable.end(), patches,
                                   static_cast<std::uint32_t>(assembly.drawables.size()));
    assembly.drawables.push_back(drawable);
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
    if (primitive.wire != Primitive::Wire::kSurface) {
      material.double_sided = true;
      changes |= kWire;
      if (primitive.vertices.normals.empty() && !material.unlit) {
        material.unlit = material.glows_unlit = true;
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
  static constexpr unsigned kNoDisplacement = 1u << 5, kWire = 1u << 6, kGlow = 1u << 7;
  Assembly& assembly_;
  const int default_ = static_cast<int>(assembly_.materials.size()) - 1;
  std::map<std::pair<std::size_t, unsigned>, int> variants_;
};

}  // namespace

MeshClusters build_clusters(const Primitive& primitive) {
  MeshClusters out;
  const std::size_t vertex_count = primitive.vertices.count(), index_count = primitive.indices.size();
  if (index_count == 0) return out;
  const std::size_t capacity = meshopt_buildMeshletsBound(index_count, kMaxClusterVertices, kMaxClusterTriangles);
  std::vector<meshopt_Meshlet> meshlets(capacity);
  std::vector<unsigned int> vertices(capacity * kMaxClusterVertices);
  std::vector<unsigned char> triangles(capacity * kMaxClusterTriangles * 3);
  const std::size_t count = meshopt_buildMeshlets(
      meshlets.data(), vertices.data(), triangles.data(), primitive.indices.data(), index_count,
      &primitive.vertices.positions[0].x, vertex_count, sizeof(Vec3), kMaxClusterVertices, kMaxClusterTriangles, 0.0f);
  for (std::size_t m = 0; m < count; ++m) {
    const meshopt_Meshlet& meshlet = meshlets[m];
    Cluster cluster{};
    cluster.first_vertex = static_cast<std::uint32_t>(out.vertices.size());
    cluster.vertex_count = meshlet.vertex_count;
    cluster.first_cell = static_cast<std::uint32_t>(out.cells.size());
    cluster.triangle_count = meshlet.triangle_count;
    out.vertices.insert(out.vertices.end(), vertices.begin() + meshlet.vertex_offset,
                        vertices.begin() + meshlet.vertex_offset + meshlet.vertex_count);
    std::vector<LocalTriangle> local(meshlet.triangle_count);
    for (std::size_t t = 0; t < local.size(); ++t)
      std::memcpy(local[t].data(), &triangles[meshlet.triangle_offset + 3 * t], 3);
    pair_triangles(local, out.cells);
    cluster.cell_count = static_cast<std::uint32_t>(out.cells.size()) - cluster.first_cell;
    out.clusters.push_back(cluster);
  }
  return out;
}

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

Assembly assemble(const Capture& capture) {
  Assembly assembly;
  assembly.capture = &capture;
  assembly.materials = capture.materials;
  assembly.materials.push_back(Material{});
  for (std::size_t m = 0; m < capture.materials.size(); ++m) assembly.material_source.push_back(static_cast<int>(m));
  assembly.material_source.push_back(kNone);
  MaterialVariants variants(assembly);
  const Pose rest = pose_at(capture, 0.0);
  std::map<std::pair<int, int>, std::uint32_t> geometry_of;  // (mesh, primitive)
  for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
    const int mesh = capture.nodes[n].mesh;
    if (mesh == kNone || !rest.in_scene[n]) continue;
    const auto& primitives = capture.meshes[static_cast<std::size_t>(mesh)].primitives;
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      const Primitive& primitive = primitives[p];
      const bool bezier = primitive.kind == Primitive::Kind::kBezierPatches;
      const auto [slot, fresh] = geometry_of.try_emplace({mesh, static_cast<int>(p)}, 0u);
      if (fresh && bezier) {
        slot->second = static_cast<std::uint32_t>(assembly.neighbours.size());
        assembly.neighbours.push_back(find_neighbours(primitive.vertices));
      } else if (fresh) {
        slot->second = static_cast<std::uint32_t>(assembly.clusters.size());
        assembly.clusters.push_back(build_clusters(primitive));
      }
      const std::size_t patches =
          bezier ? assembly.neighbours[slot->second].size() : assembly.clusters[slot->second].clusters.size();
      Drawable drawable{};
      drawable.node = static_cast<int>(n);
      drawable.mesh = mesh;
      drawable.primitive = static_cast<int>(p);
      drawable.material = variants.of(primitive);
      drawable.kind = primitive.kind;
      drawable.first_patch = static_cast<std::uint32_t>(assembly.patch_count());
      drawable.patch_count = static_cast<std::uint32_t>(patches);
      drawable.geometry = slot->second;
      assembly.patch_drawable.insert(assembly.patch_drawable.end(), patches,
                                     static_cast<std::uint32_t>(assembly.drawables.size()));
      assembly.drawables.push_back(drawable);
    }
  }
  add_procedures(capture, rest, assembly);
  return assembly;
}

}  // namespace tessera::scene
