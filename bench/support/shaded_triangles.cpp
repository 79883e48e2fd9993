#include "bench/support/shaded_triangles.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <stdexcept>

#include "base/parallel.h"
#include "tests/support/mesh_triangles.h"
#include "tilecore/shading/surface.h"
#include "tilecore/tessellation/tessellator.h"

namespace tessera::bench {
namespace {

using Vertex = ShadedTriangles::Vertex;

// One patch of a list, with its own vertex numbers from 0.
struct Piece {
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;
  const scene::Material* material = nullptr;
  bool colored = false;
  float depth = std::numeric_limits<float>::infinity();  // of its nearest vertex
};

Vec4 clip_position(const scene::FrameGeometry& frame, const tilecore::MicroMesh& mesh, std::size_t v) {
  const double z = static_cast<double>(mesh.z0[v]), near = frame.projection.near, far = frame.projection.far,
               times = mesh.projected[v] ? z : 1.0;
  const auto clip = [&](float pixels, int size) {
    return static_cast<float>(2.0 * static_cast<double>(pixels) * times / size - z);
  };
  return {clip(mesh.x0[v], frame.request.width), clip(mesh.y0[v], frame.request.height),
          static_cast<float>(far > 0 ? near * (far - z) / (far - near) : near), mesh.z0[v]};
}

void add_attributes(const tilecore::Surface& surface, const scene::TextureSlot* images, Vertex& vertex) {
  vertex.position = surface.position, vertex.normal = surface.normal, vertex.color = Vec4(1.0f);
  if (surface.drawable->procedure != nullptr) return;
  if (images != nullptr) vertex.texcoord = surface.texcoord(images->texcoord, images->transform).value;
  const std::vector<Vec4>& colors = surface.drawable->primitive->vertices.colors;
  if (colors.empty()) return;
  vertex.color = Vec4(0.0f);
  for (std::size_t k = 0; k < static_cast<std::size_t>(surface.corner_count); ++k)
    vertex.color += surface.weight[k] * colors[surface.vertex[k]];
}

Piece list_patch(const scene::FrameGeometry& frame, std::uint32_t patch, tilecore::Tessellator& tessellator,
                 tilecore::MicroMesh& mesh) {
  const scene::PosedDrawable& drawable = frame.drawable_of(patch);
  tessellator.tessellate(frame, patch, scene::patch_cells(frame, patch), {drawable.moving, false}, mesh);
  Piece piece;
  piece.material = drawable.material;
  piece.colored = drawable.procedure == nullptr && !drawable.primitive->vertices.colors.empty();
  const scene::TextureSlot* const images = image_coordinates(*drawable.material);
  // Each corner of a flat triangle has its own normal.
  const bool flat = !tilecore::has_grid(drawable) && drawable.normals[0].empty();
  constexpr std::uint32_t kNew = 0xFFFFFFFFu;
  std::vector<std::uint32_t> number(mesh.vertex_count, kNew);
  test::for_each_triangle(mesh, [&](const std::array<std::int32_t, 3>& corners, std::uint32_t triangle) {
    for (const std::size_t k : {0, 1, 2}) {
      const std::size_t c = drawable.mirrored ? 2 - k : k, v = static_cast<std::size_t>(corners[c]);
      if (flat || number[v] == kNew) {
        number[v] = static_cast<std::uint32_t>(piece.vertices.size());
        Vertex& vertex = piece.vertices.emplace_back();
        vertex.clip = clip_position(frame, mesh, v);
        add_attributes(
            tilecore::evaluate_surface(frame, {patch, triangle, c == 1 ? 1.0f : 0.0f, c == 2 ? 1.0f : 0.0f, 0}), images,
            vertex);
        piece.depth = std::min(piece.depth, mesh.z0[v]);
      }
      piece.indices.push_back(number[v]);
    }
  });
  return piece;
}

// Numbers of the pieces in the order of ShadedTriangles::draws.
std::vector<std::size_t> draw_order(const std::vector<Piece>& pieces) {
  using Group = std::pair<const scene::Material*, bool>;
  std::map<Group, float> nearest;
  for (const Piece& p : pieces) {
    float& depth = nearest.try_emplace({p.material, p.colored}, p.depth).first->second;
    depth = std::min(depth, p.depth);
  }
  struct Key {
    scene::AlphaMode mode;
    float group_depth;
    Group group;
    float depth;
    auto operator<=>(const Key&) const = default;
  };
  const auto key = [&](std::size_t k) -> Key {
    const Piece& p = pieces[k];
    const scene::AlphaMode mode = p.material->alpha_mode;
    if (mode == scene::AlphaMode::kBlend) return {mode, 0, {}, -p.depth};
    const Group group(p.material, p.colored);
    return {mode, nearest.at(group), group, p.depth};
  };
  std::vector<std::size_t> order(pieces.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  return order;
}

}  // namespace

const scene::TextureSlot* image_coordinates(const scene::Material& material) {
  const scene::TextureSlot* found = nullptr;
  for (const scene::TextureSlot* slot :
       {&material.base_color_texture, &material.metallic_roughness_texture, &material.emissive_texture}) {
    if (slot->texture == nullptr) continue;
    if (found != nullptr && (slot->texcoord != found->texcoord || slot->transform.matrix != found->transform.matrix ||
                             slot->transform.offset != found->transform.offset))
      throw std::runtime_error("a material reads its images at several coordinates");
    found = slot;
  }
  return found;
}

ShadedTriangles list_shaded_triangles(const scene::FrameGeometry& frame, const std::vector<std::uint32_t>& patches) {
  if (frame.projection.orthographic) throw std::runtime_error("a list of triangles knows no orthographic camera");
  std::vector<Piece> pieces(patches.size());
  PerThread<tilecore::Tessellator> tessellators;
  PerThread<tilecore::MicroMesh> meshes;
  parallel_for(patches.size(),
               [&](std::size_t p) { pieces[p] = list_patch(frame, patches[p], tessellators.local(), meshes.local()); });

  ShadedTriangles list;
  for (const std::size_t k : draw_order(pieces)) {
    const Piece& piece = pieces[k];
    if (list.draws.empty() || list.draws.back().material != piece.material ||
        list.draws.back().colored != piece.colored)
      list.draws.push_back({piece.material, piece.colored, list.indices.size(), 0});
    list.draws.back().count += piece.indices.size();
    const auto first = static_cast<std::uint32_t>(list.vertices.size());
    for (const std::uint32_t i : piece.indices) list.indices.push_back(first + i);
    list.vertices.insert(list.vertices.end(), piece.vertices.begin(), piece.vertices.end());
  }
  return list;
}

}  // namespace tessera::bench
