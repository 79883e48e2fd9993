#include "tilecore/tessellation/tessellator.h"

#include <algorithm>
#include <array>

#include "frontend/front_end.h"
#include "frontend/sub_patch_effects.h"
#include "scene/domain_shader.h"
#include "scene/patch_displacement.h"
#include "scene/procedure_patch.h"
#include "shaders_cpp/bicubic.h"
#include "tilecore/procedural/procedure_kernel.h"
#include "tilecore/tessellation/tessellator_kernel.h"

namespace tessera::tilecore {
namespace {

using scene::FrameGeometry;
using scene::PatchNeighbours;
using scene::PosedDrawable;
using scene::TessellationPattern;

constexpr std::size_t kVertexPadding = 64;  // vectors may write past the last vertex

void build_grid_cells(const TessellationPattern& pattern, const scene::CellRange& range, MicroMesh& mesh) {
  constexpr int kLeafSide = 4;  // kLeafCells = 16
  const int columns = range.i1 - range.i0 + 1;
  for (int lj = range.j0; lj < range.j1; lj += kLeafSide)
    for (int li = range.i0; li < range.i1; li += kLeafSide) {
      const std::int32_t first = (lj - range.j0) * columns + (li - range.i0);
      mesh.begin_leaf({first, columns, std::min<int>(kLeafSide, range.i1 - li)});
      for (int j = lj; j < std::min<int>(lj + kLeafSide, range.j1); ++j)
        for (int i = li; i < std::min<int>(li + kLeafSide, range.i1); ++i) {
          const std::int32_t a = (j - range.j0) * columns + (i - range.i0);
          mesh.add_cell({a, a + 1, a + 1 + columns, a + columns}, 2u * static_cast<std::uint32_t>(j * pattern.nu + i));
        }
    }
}

void build_cluster_cells(const scene::MeshClusters& clusters, const scene::Cluster& cluster, MicroMesh& mesh) {
  for (std::uint32_t c = 0; c < cluster.cell_count; ++c) {
    if (c % kLeafCells == 0) mesh.begin_leaf();
    const auto& corner = clusters.cells[cluster.first_cell + c].corner;
    mesh.add_cell({corner[0], corner[1], corner[2], corner[3]}, 2u * c);
  }
}

}  // namespace

void fetched_neighbours(const FrameGeometry& frame, std::uint32_t patch, const scene::CellRange& range, bool displaced,
                        std::vector<std::uint32_t>& others) {
  others.clear();
  const PosedDrawable& drawable = frame.drawable_of(patch);
  if (drawable.drawable->kind != scene::Primitive::Kind::kBezierPatches || !displaced) return;
  const std::uint32_t first = drawable.drawable->first_patch;
  const PatchNeighbours& neighbours = frame.assembly->neighbours[drawable.drawable->geometry][patch - first];
  const TessellationPattern& pattern = frame.pattern_of(patch);
  const std::array<bool, 4> touches = {range.j0 == 0, range.j1 == pattern.nv, range.i0 == 0, range.i1 == pattern.nu};
  const auto add = [&](std::uint32_t other) {
    if (other != patch) others.push_back(other);
  };
  for (std::size_t e = 0; e < 4; ++e)
    if (touches[e]) add(neighbours.edges[e].patch + first);
  for (std::size_t c = 0; c < 4; ++c)
    if (touches[(c & 1) != 0 ? 3 : 2] && touches[(c & 2) != 0 ? 1 : 0]) add(neighbours.corners[c].patch + first);
  std::sort(others.begin(), others.end());
  others.erase(std::unique(others.begin(), others.end()), others.end());
}

void Tessellator::resize(std::size_t vertices) {
  for (Points& points : object_) points.resize(vertices + kVertexPadding);
  normal_.resize(vertices + kVertexPadding);
  for (auto* v : {&u_, &v_, &offset_, &margin_, &texture_u_, &texture_v_}) v->resize(vertices + kVertexPadding);
}

Vec3 Tessellator::vertex_position(const FrameGeometry& frame, std::uint32_t patch, int i, int j, int key,
                                  bool displaced) {
  const PosedDrawable& drawable = frame.drawable_of(patch);
  const TessellationPattern& pattern = frame.pattern_of(patch);
  const std::uint32_t first = drawable.drawable->first_patch;
  if (i == 0 || j == 0 || i == pattern.nu || j == pattern.nv) {
    const PatchNeighbours& neighbours = frame.assembly->neighbours[drawable.drawable->geometry][patch - first];
    const scene::OwnedVertex owned = scene::boundary_vertex(pattern, neighbours, i, j);
    return scene::domain_point(frame, drawable, owned.patch + first, owned.u, owned.v, static_cast<std::size_t>(key),
                               displaced);
  }
  return scene::domain_point(frame, drawable, patch, pattern.u(i, j), pattern.v(i, j), static_cast<std::size_t>(key),
                             displaced);
}

template <bool kDisplaced>
void Tessellator::shade_bezier(const FrameGeometry& frame, const PosedDrawable& drawable, std::uint32_t patch,
                               const scene::CellRange& range, std::size_t key) {
  const TessellationPattern& pattern = frame.pattern_of(patch);
  const auto c = scene::shader_control_points(frame, drawable, patch, key);
  scene::PatchDisplacement displacement;
  if constexpr (kDisplaced) displacement = scene::patch_displacement(frame, drawable, patch);

  // Rows through the interior of the grid, all lanes at once; boundary vertices are overwritten below.
  const int columns = range.i1 - range.i0 + 1;
  const auto count = static_cast<std::size_t>(columns);
  for (int i = 0; i < columns; ++i)
    u_[static_cast<std::size_t>(i)] = static_cast<float>(range.i0 + i) / static_cast<float>(pattern.nu);
  for (int j = range.j0; j <= range.j1; ++j) {
    const std::size_t first = static_cast<std::size_t>(j - range.j0) * count;
    const PointArrays position = {&object_[key].x[first], &object_[key].y[first], &object_[key].z[first]};
    if (j > 0 && j < pattern.nv) {
      const float v = static_cast<float>(j) / static_cast<float>(pattern.nv);
      const shaders::BicubicRow<float> row = shaders::bicubic_row(c, v);
      const PointArrays normal = {normal_.x.data(), normal_.y.data(), normal_.z.data()};
      evaluate_row(row, u_.data(), count, position, normal, kDisplaced ? margin_.data() : nullptr);
      if constexpr (kDisplaced) {
        for (std::size_t i = 0; i < count; ++i) {
          const Vec2 at = displacement.coordinate(u_[i], v);
          texture_u_[i] = at.x, texture_v_[i] = at.y;
        }
        const scene::Displacement& material = *displacement.material;
        sample_heights(material.texture->view(), material.sampler, displacement.lod, texture_u_.data(),
                       texture_v_.data(), count, offset_.data());
        for (std::size_t i = 0; i < count; ++i) {
          offset_[i] = material.scale * offset_[i] + material.bias;  // PatchDisplacement::offset()
          if (margin_[i] > 0.0f) continue;
          const Vector3<float> n = shaders::limit_normal(c, u_[i], v, shaders::bicubic_point<float>(row, u_[i]));
          normal_.x[i] = n.x;
          normal_.y[i] = n.y;
          normal_.z[i] = n.z;
        }
        displace(count, offset_.data(), normal, position);
      }
    }
    for (int i = range.i0; i <= range.i1; ++i) {
      if (i > 0 && i < pattern.nu && j > 0 && j < pattern.nv) continue;
      const Vec3 p = vertex_position(frame, patch, i, j, static_cast<int>(key), kDisplaced);
      const std::size_t at = first + static_cast<std::size_t>(i - range.i0);
      object_[key].x[at] = p.x;
      object_[key].y[at] = p.y;
      object_[key].z[at] = p.z;
    }
  }
}

// Every vertex is a function of its parameters alone, and patches that share an edge have the same parameters on it.
void Tessellator::shade_procedure(const FrameGeometry& frame, std::uint32_t patch, const scene::CellRange& range,
                                  std::size_t key) {
  const TessellationPattern& pattern = frame.pattern_of(patch);
  const scene::ProcedurePatch at = scene::procedure_patch(frame, patch);
  std::size_t n = 0;
  for (int j = range.j0; j <= range.j1; ++j)
    for (int i = range.i0; i <= range.i1; ++i, ++n) {
      u_[n] = at.u(pattern.u(i, j));
      v_[n] = at.v(pattern.v(i, j));
    }
  procedure_vertices(at.shape, at.input(key), u_.data(), v_.data(), n,
                     {object_[key].x.data(), object_[key].y.data(), object_[key].z.data()});
}

void Tessellator::shade_cluster(const FrameGeometry& frame, const PosedDrawable& drawable, std::uint32_t patch,
                                std::size_t key) {
  const scene::MeshClusters& clusters = frame.assembly->clusters[drawable.drawable->geometry];
  const scene::Cluster& cluster = clusters.clusters[patch - drawable.drawable->first_patch];
  for (std::size_t v = 0; v < cluster.vertex_count; ++v) {
    const Vec3& p = drawable.positions[key][clusters.vertices[cluster.first_vertex + v]];
    object_[key].x[v] = p.x;
    object_[key].y[v] = p.y;
    object_[key].z[v] = p.z;
  }
}

Tessellator::Work Tessellator::tessellate(const FrameGeometry& frame, std::uint32_t patch,
                                          const scene::CellRange& range, RayEffects effects, MicroMesh& mesh,
                                          bool displaced) {
  const PosedDrawable& drawable = frame.drawable_of(patch);
  const bool bezier = drawable.drawable->kind == scene::Primitive::Kind::kBezierPatches,
             grid = scene::has_grid(*drawable.drawable);
  const bool moving = kGeneralEffects && effects.motion, lens = kGeneralEffects && effects.lens;
  const bool displaces = kGeneralEffects && displaced && bezier && drawable.material->displacement.has_value();
  std::size_t vertices;
  if (grid)
    vertices = static_cast<std::size_t>(range.i1 - range.i0 + 1) * static_cast<std::size_t>(range.j1 - range.j0 + 1);
  else
    vertices = frame.assembly->clusters[drawable.drawable->geometry]
                   .clusters[patch - drawable.drawable->first_patch]
                   .vertex_count;
  resize(vertices);
  mesh.resize_vertices(vertices + kVertexPadding, moving);
  mesh.vertex_count = vertices;

  // A rigid drawable has one object-space surface; only its transform differs between the keys.
  const std::size_t shaded_keys = moving && drawable.deforming ? 2 : 1;
  for (std::size_t key = 0; key < shaded_keys; ++key) {
    if (bezier && displaces) {
      if constexpr (kGeneralEffects) shade_bezier<true>(frame, drawable, patch, range, key);
    } else if (bezier)
      shade_bezier<false>(frame, drawable, patch, range, key);
    else if (grid)
      shade_procedure(frame, patch, range, key);
    else
      shade_cluster(frame, drawable, patch, key);
  }
  const auto arrays = [](Points& p) { return PointArrays{p.x.data(), p.y.data(), p.z.data()}; };
  mesh.all_projected = project_vertices(
      vertices, {arrays(object_[0]), arrays(object_[shaded_keys - 1])}, drawable.to_raster, moving,
      {frame.projection.orthographic, static_cast<float>(frame.projection.near), frame.request.subpixels()},
      {PointArrays{mesh.x0.data(), mesh.y0.data(), mesh.z0.data()},
       PointArrays{mesh.x1.data(), mesh.y1.data(), mesh.z1.data()}},
      mesh.projected.data());

  mesh.clear_cells();
  if (grid) {
    build_grid_cells(frame.pattern_of(patch), range, mesh);
  } else {
    const scene::MeshClusters& clusters = frame.assembly->clusters[drawable.drawable->geometry];
    build_cluster_cells(clusters, clusters.clusters[patch - drawable.drawable->first_patch], mesh);
  }
  build_cells(mesh, {moving, lens, frame.projection.orthographic, static_cast<float>(frame.projection.inverse_focus),
                     lens ? static_cast<float>(frame.projection.lens_scale) : 0.0f,
                     lens ? frontend::sharp_factor(frame.projection) : 0.0f});
  return {vertices, mesh.triangle_count};
}

}  // namespace tessera::tilecore
