#include "reference/reference_scene.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "base/check.h"
#include "base/parallel.h"
#include "reference/bezier_extent.h"
#include "scene/domain_shader.h"
#include "scene/light_views.h"
#include "scene/procedure_patch.h"
#include "scene/wires.h"
#include "shaders_cpp/bicubic.h"
#include "shaders_cpp/procedures/procedures.h"
#include "tilecore/shading/transmission.h"

namespace tessera::reference {
namespace {

using scene::FrameGeometry;
using scene::PosedDrawable;

// A patch in object space at a key: the domain shader's formula on doubles.
class PatchSurface {
 public:
  PatchSurface(const FrameGeometry& frame, const PosedDrawable& drawable, std::uint32_t patch, std::size_t key) {
    const auto points = frame.control_points(drawable, patch, static_cast<int>(key));
    for (std::size_t i = 0; i < 16; ++i)
      points_[i] = {static_cast<double>(points[i].x), static_cast<double>(points[i].y),
                    static_cast<double>(points[i].z)};
    if (drawable.material->displacement) displacement_ = scene::patch_displacement(frame, drawable, patch);
  }

  DVec3 point(double u, double v) const {
    const shaders::SurfacePoint<double> p = shaders::bicubic_point<double>(shaders::bicubic_row(points_, v), u);
    Vector3<double> at = p.position;
    if (displacement_) {
      const auto offset = static_cast<double>(displacement_->offset(static_cast<float>(u), static_cast<float>(v)));
      at = at + shaders::bicubic_normal(points_, u, v, p) * offset;
    }
    return {at.x, at.y, at.z};
  }

 private:
  shaders::ControlPoints<double> points_;
  std::optional<scene::PatchDisplacement> displacement_;
};

// A vertex of a grid, computed by the patch that owns it: neighbours meet without cracks here, too. `own`: surface of `patch` itself.
DVec3 bezier_vertex(const FrameGeometry& frame, const PosedDrawable& drawable, std::uint32_t patch,
                    const PatchSurface& own, int i, int j, std::size_t key) {
  const scene::TessellationPattern& pattern = frame.pattern_of(patch);
  const std::uint32_t first = drawable.drawable->first_patch;
  if (i == 0 || j == 0 || i == pattern.nu || j == pattern.nv) {
    const scene::OwnedVertex owned =
        scene::boundary_vertex(pattern, frame.assembly->neighbours[drawable.drawable->geometry][patch - first], i, j);
    const PatchSurface owner(frame, drawable, owned.patch + first, key);
    return owner.point(static_cast<double>(owned.u), static_cast<double>(owned.v));
  }
  return own.point(static_cast<double>(pattern.u(i, j)), static_cast<double>(pattern.v(i, j)));
}

// The farthest distance that a displacement moves a vertex.
double displacement_reach(const scene::Displacement& displacement) {
  const auto scale = static_cast<double>(displacement.scale), bias = static_cast<double>(displacement.bias);
  const double a = scale * static_cast<double>(displacement.texture->lowest()),
               b = scale * static_cast<double>(displacement.texture->highest());
  // The machine adds them in single precision.
  const double rounding = 0x1p-20 * (std::max(std::abs(a), std::abs(b)) + std::abs(bias));
  return std::max(std::abs(a + bias), std::abs(b + bias)) + rounding;
}

DVec3 procedure_vertex(const FrameGeometry& frame, std::uint32_t patch, int i, int j, std::size_t key) {
  const scene::TessellationPattern& pattern = frame.pattern_of(patch);
  const scene::ProcedurePatch at = scene::procedure_patch(frame, patch);
  const Vector3<double> p = shaders::shape_point(at.shape, at.input(key), static_cast<double>(at.u(pattern.u(i, j))),
                                                 static_cast<double>(at.v(pattern.v(i, j))));
  return {p.x, p.y, p.z};
}

// Coordinates of the scene's lines (see the header): the third row of `raster` is the depth.
std::array<double, 3> place(const DMat4& to_raster, const DVec3& p) {
  const DVec4 r = to_raster * DVec4(p, 1.0);
  return {r.x, r.y, r.z};
}

}  // namespace

struct ReferenceScene::PatchWork {
  std::vector<std::uint8_t> seen;  // by leaf: rows of a grid's leaves, or a cluster's leaves in order
  // Vertices of a grid that have been computed.
  std::vector<std::array<double, 6>> grid;
  std::vector<std::uint8_t> known;
  std::array<std::optional<PatchSurface>, 2> surface;  // surface of a Bezier patch at both keys
};

ReferenceScene::ReferenceScene(const FrameGeometry& frame_in, const Options& options)
    : frame(frame_in),
      posed(frame_in.segment(options.segment)),
      segment(options.segment),
      center_x(posed.projection.center_x),
      center_y(posed.projection.center_y),
      near(posed.projection.near),
      far(posed.projection.far > 0 ? posed.projection.far : std::numeric_limits<double>::infinity()),
      orthographic(posed.projection.orthographic),
      lens_scale(posed.projection.lens_scale),
      inverse_focus(posed.projection.inverse_focus),
      region(options.region.value_or(
          SampleRegion(posed.projection, {0, 0, frame_in.request.width, frame_in.request.height}))) {
  if (options.casters != nullptr) casters = *options.casters;
  drawable_to_raster_.resize(frame.drawables.size());
  place_drawables(frame);
  find_reach();
  if (options.segment != 0) place_drawables(posed);
  const scene::Capture& capture = *frame.assembly->capture;
  scene::MemoryBudget own(capture.max_bytes, capture.file.string(), frame.assembly->charged_bytes());
  add_patches(options, options.budget != nullptr ? *options.budget : own);
  build_tree();
  measure_blur();
  leaf_boxes_ = {};
}

void ReferenceScene::find_reach() {
  for (const PosedDrawable& drawable : frame.drawables)
    reach_.push_back(drawable.material->displacement ? displacement_reach(*drawable.material->displacement) : 0.0);
}

void ReferenceScene::place_drawables(const FrameGeometry& by) {
  const scene::Capture& capture = *frame.assembly->capture;
  const double open = frame.request.open_time, close = frame.request.close_time;
  for (std::size_t key = 0; key < 2; ++key) {
    const double at = by.part.at(key);
    const scene::Pose pose = scene::pose_at(capture, at == 1.0 ? close : open + (close - open) * at);
    scene::Projection centred = by.projections[key];
    centred.center_x = centred.center_y = 0;
    for (std::size_t d = 0; d < frame.drawables.size(); ++d) {
      const PosedDrawable& drawable = frame.drawables[d];
      if (by.moves_here(drawable))
        drawable_to_raster_[d][key] =
            centred.matrix() * by.views[key].world_to_camera *
            scene::vertices_to_world(capture, drawable.drawable->node, drawable.drawable->instance, *drawable.primitive,
                                     pose, by.views[key]);
    }
  }
}

// ---- Triangles --------------------------------------------------------------------------------------------------

const PosedDrawable& ReferenceScene::posed_drawable(std::uint32_t patch) const {
  return frame.drawable_of(patch).curved ? posed.drawable_of(patch) : frame.drawable_of(patch);
}

void ReferenceScene::cut_off(std::array<double, 6>& vertex, const PosedDrawable& drawable) const {
  if (posed.part.whole() || drawable.curved || !drawable.moving) return;
  const std::array<double, 6> keys = vertex;
  for (std::size_t key = 0; key < 2; ++key)
    for (std::size_t a = 0; a < 3; ++a)
      vertex[3 * key + a] = keys[a] * (1.0 - posed.part.at(key)) + keys[3 + a] * posed.part.at(key);
}

ReferenceScene::Triangle ReferenceScene::triangle_of(std::uint32_t patch) const {
  const PosedDrawable& drawable = frame.drawable_of(patch);
  Triangle t{};
  t.patch = patch;
  const bool both = drawable.material->double_sided || (casters && casters->faces == scene::CasterFaces::kBoth),
             mirrored = drawable.mirrored != (casters && casters->faces == scene::CasterFaces::kBack);
  t.keep_positive = both || mirrored;
  t.keep_negative = both || !mirrored;
  // A blended surface that casts shadows is solid (shadows.blended).
  t.opaque = casters ? drawable.material->alpha_mode != scene::AlphaMode::kMask
                     : drawable.material->alpha_mode == scene::AlphaMode::kOpaque;
  return t;
}

bool ReferenceScene::left_out(std::uint32_t patch, bool behind) const {
  const PosedDrawable& drawable = frame.drawable_of(patch);
  return !drawable.visible || (casters && !scene::casts(*drawable.material, casters->blended)) ||
         (behind && (tilecore::transmits(drawable) || drawable.material->alpha_mode == scene::AlphaMode::kBlend));
}

void ReferenceScene::charge(const Amount& amount, const FrameGeometry& frame, scene::MemoryBudget& budget) {
  constexpr std::uint64_t kLeafBytes =
      sizeof(Leaf) + sizeof(std::array<Box, 2>) + sizeof(std::uint32_t) + 2 * sizeof(Node);
  const auto what = [&](const char* of) {
    return [&frame, of] {
      return fmt::format("the reference at {}x{} (smaller with a larger --reference-edge): {}", frame.request.width,
                         frame.request.height, of);
    };
  };
  budget.charge(amount.vertices, sizeof(std::array<double, 6>), what("vertices"));
  budget.charge(amount.triangles, sizeof(Triangle), what("triangles"));
  budget.charge(amount.leaves, kLeafBytes, what("leaves of the tree"));
  constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();
  if (amount.vertices > kMost || amount.triangles > kMost)
    throw scene::BudgetError(what("more than 2^31 vertices or triangles")());
}

void ReferenceScene::add_patches(const Options& options, scene::MemoryBudget& budget) {
  const std::size_t count = frame.assembly->patch_count();
  PerThread<PatchWork> work;
  std::vector<Amount> first(count + 1);
  budget.charge(first.size(), sizeof(Amount), "amounts of the reference's patches");
  parallel_for(count, [&](std::size_t p) {
    const auto patch = static_cast<std::uint32_t>(p);
    if (!left_out(patch, options.behind)) first[p] = find_seen(patch, work.local());
  });
  Amount sum;
  for (Amount& one : first) {
    const Amount own = one;
    one = sum;
    sum = {sum.vertices + own.vertices, sum.triangles + own.triangles, sum.leaves + own.leaves};
  }
  triangle_count = sum.triangles;
  if (options.count_only) return;
  charge(sum, frame, budget);
  vertices.resize(sum.vertices);
  triangles.resize(sum.triangles);
  leaves.resize(sum.leaves);
  parallel_for(count, [&](std::size_t p) {
    if (first[p].leaves == first[p + 1].leaves) return;
    const auto patch = static_cast<std::uint32_t>(p);
    find_seen(patch, work.local());
    if (scene::has_grid(*frame.drawable_of(patch).drawable))
      fill_grid(patch, first[p], work.local());
    else
      fill_cluster(patch, first[p], work.local());
  });
}

// ---- Visible leaves of a patch ----------------------------------------------------------------------------------

namespace {

constexpr int kSide = 3;  // cells of a grid's leaf

// State of a grid's leaf: left out, kept, or (among casters) replaced, in a square of leaves that no sample sees, by
// one leaf with correspondingly wider cells.
constexpr std::uint8_t kLeftOut = 0, kSeen = 1, kCoarse = 2;
// Cells along a side of a grid that no sample sees; grids behind a camera are the finest ones.
constexpr int kCoarseCells = 16;

int coarse_step(const scene::TessellationPattern& pattern) {
  int step = 1;
  while (std::max(pattern.nu, pattern.nv) > kCoarseCells * step) step *= 2;
  return step;
}

int leaves_along(int cells) { return (cells + kSide - 1) / kSide; }

// The cells of leaf (column, row) of a grid, or of a block of leaves.
scene::CellRange leaf_cells(const scene::TessellationPattern& pattern, const IntRect& block) {
  return {static_cast<std::uint8_t>(block.x0 * kSide), static_cast<std::uint8_t>(block.y0 * kSide),
          static_cast<std::uint8_t>(std::min<int>(block.x1 * kSide, pattern.nu)),
          static_cast<std::uint8_t>(std::min<int>(block.y1 * kSide, pattern.nv))};
}

// The cells of a leaf.
struct LeafGrid {
  scene::CellRange cells;
  int step, across, down;  // grid lines from one of the leaf's lines to the next; number of cells
  int column(int i) const { return std::min(cells.i0 + i * step, static_cast<int>(cells.i1)); }
  int row(int j) const { return std::min(cells.j0 + j * step, static_cast<int>(cells.j1)); }
};
LeafGrid leaf_grid(const scene::TessellationPattern& pattern, std::size_t leaf, std::uint8_t seen) {
  const int columns = leaves_along(pattern.nu), rows = leaves_along(pattern.nv);
  const int x = static_cast<int>(leaf) % columns, y = static_cast<int>(leaf) / columns;
  const int step = seen == kCoarse ? coarse_step(pattern) : 1;
  LeafGrid out{leaf_cells(pattern, {x, y, std::min(x + step, columns), std::min(y + step, rows)}), step, 0, 0};
  out.across = (out.cells.i1 - out.cells.i0 + step - 1) / step;
  out.down = (out.cells.j1 - out.cells.j0 + step - 1) / step;
  return out;
}

// Covers the left-out part of a grid by coarse leaves.
void cover_unseen(const scene::TessellationPattern& pattern, std::vector<std::uint8_t>& seen) {
  const int columns = leaves_along(pattern.nu), rows = leaves_along(pattern.nv), step = coarse_step(pattern);
  for (int y0 = 0; y0 < rows; y0 += step)
    for (int x0 = 0; x0 < columns; x0 += step) {
      const int x1 = std::min(x0 + step, columns), y1 = std::min(y0 + step, rows);
      bool any = step == 1;
      for (int y = y0; y < y1; ++y)
        any = any || std::any_of(seen.begin() + y * columns + x0, seen.begin() + y * columns + x1,
                                 [](std::uint8_t one) { return one != kLeftOut; });
      for (int y = y0; any && y < y1; ++y)
        std::fill(seen.begin() + y * columns + x0, seen.begin() + y * columns + x1, kSeen);
      if (!any) seen[static_cast<std::size_t>(y0 * columns + x0)] = kCoarse;
    }
}

// Marks the leaves of a block that the region may see; splits the block into quarters.
void mark_seen(const SampleRegion& region, const BezierExtent& patch, const scene::TessellationPattern& pattern,
               const IntRect& block, std::vector<std::uint8_t>& seen) {
  if (block.empty()) return;
  const SampleRegion::Extent extent = patch.over(scene::parameter_range(pattern, leaf_cells(pattern, block)));
  if (region.misses(extent)) return;
  const int columns = leaves_along(pattern.nu);
  if (region.holds(extent) || (block.width() == 1 && block.height() == 1)) {
    for (int y = block.y0; y < block.y1; ++y)
      std::fill_n(seen.begin() + y * columns + block.x0, block.width(), std::uint8_t{1});
    return;
  }
  const int x = (block.x0 + block.x1) / 2, y = (block.y0 + block.y1) / 2;
  for (const IntRect& quarter : {IntRect{block.x0, block.y0, x, y}, IntRect{x, block.y0, block.x1, y},
                                 IntRect{block.x0, y, x, block.y1}, IntRect{x, y, block.x1, block.y1}})
    mark_seen(region, patch, pattern, quarter, seen);
}

// Calls visit(corners) for the triangles of a cluster in order; corners are numbers of the cluster's vertices.
template <class Visit>
void visit_triangles(const scene::MeshClusters& clusters, const scene::Cluster& cluster, const Visit& visit) {
  for (std::uint32_t c = 0; c < cluster.cell_count; ++c) {
    const scene::ClusterCell& cell = clusters.cells[cluster.first_cell + c];
    for (std::uint32_t half = 0; half < (cell.single() ? 1u : 2u); ++half)
      visit(2 * c + half, std::array<std::uint8_t, 3>{cell.corner[0], cell.corner[half == 0 ? 1 : 2],
                                                      cell.corner[half == 0 ? 2 : 3]});
  }
}

constexpr std::size_t kClusterLeaf = ReferenceScene::kLeafVertices / 3;  // triangles of a cluster's leaf

}  // namespace

ReferenceScene::Amount ReferenceScene::find_seen(std::uint32_t patch, PatchWork& work) const {
  Amount amount;
  if (!scene::has_grid(*frame.drawable_of(patch).drawable)) {
    find_seen_of_cluster(patch, work);
    const PosedDrawable& drawable = posed_drawable(patch);
    const scene::MeshClusters& clusters = frame.assembly->clusters[drawable.drawable->geometry];
    std::size_t number = 0;
    visit_triangles(clusters, clusters.clusters[patch - drawable.drawable->first_patch],
                    [&](std::uint32_t, const auto&) { amount.triangles += work.seen[number++ / kClusterLeaf]; });
    amount.vertices = 3 * amount.triangles;
    for (const std::uint8_t seen : work.seen) amount.leaves += seen;
    return amount;
  }
  find_seen_of_grid(patch, work);
  const scene::TessellationPattern& pattern = frame.pattern_of(patch);
  if (casters) cover_unseen(pattern, work.seen);
  for (std::size_t leaf = 0; leaf < work.seen.size(); ++leaf) {
    if (work.seen[leaf] == kLeftOut) continue;
    const LeafGrid grid = leaf_grid(pattern, leaf, work.seen[leaf]);
    const auto across = static_cast<std::uint64_t>(grid.across), down = static_cast<std::uint64_t>(grid.down);
    amount.vertices += (across + 1) * (down + 1);
    amount.triangles += 2 * across * down;
    ++amount.leaves;
  }
  return amount;
}

void ReferenceScene::find_seen_of_grid(std::uint32_t patch, PatchWork& work) const {
  const PosedDrawable& drawable = posed_drawable(patch);
  const scene::TessellationPattern& pattern = frame.pattern_of(patch);
  const int columns = leaves_along(pattern.nu), rows = leaves_along(pattern.nv);
  work.seen.assign(static_cast<std::size_t>(columns * rows), 0);
  if (drawable.procedure == nullptr) {
    const FrameGeometry& by = drawable.curved ? posed : frame;
    const std::array<DMat4, 2>& to_raster = drawable_to_raster_[frame.assembly->patch_drawable[patch]];
    std::array<BezierExtent::Points, 2> points;
    for (std::size_t key = 0; key < 2; ++key) {
      const auto own = by.control_points(drawable, patch, drawable.deforming ? static_cast<int>(key) : 0);
      for (std::size_t k = 0; k < 16; ++k) points[key][k] = DVec3(own[k]);
    }
    const BezierExtent extent(region, points, {to_raster[0], to_raster[drawable.moving ? 1 : 0]},
                              reach_[frame.assembly->patch_drawable[patch]]);
    mark_seen(region, extent, pattern, {0, 0, columns, rows}, work.seen);
    return;
  }
  begin_grid(patch, work);
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      SampleRegion::Extent extent;
      const scene::CellRange cells = leaf_cells(pattern, {x, y, x + 1, y + 1});
      for (int j = cells.j0; j <= cells.j1; ++j)
        for (int i = cells.i0; i <= cells.i1; ++i) {
          const std::array<double, 6>& vertex = grid_vertex(patch, i, j, work);
          region.add(extent, &vertex[0]);
          region.add(extent, &vertex[3]);
        }
      work.seen[static_cast<std::size_t>(y * columns + x)] = region.misses(extent) ? 0 : 1;
    }
}
void ReferenceScene::find_seen_of_cluster(std::uint32_t patch, PatchWork& work) const {
  const PosedDrawable& drawable = posed_drawable(patch);
  const scene::MeshClusters& clusters = frame.assembly->clusters[drawable.drawable->geometry];
  const scene::Cluster& cluster = clusters.clusters[patch - drawable.drawable->first_patch];
  work.seen.clear();
  std::size_t in_leaf = 0;
  SampleRegion::Extent extent;
  visit_triangles(clusters, cluster, [&](std::uint32_t, const std::array<std::uint8_t, 3>& corner) {
    if (in_leaf == kClusterLeaf) {
      work.seen.push_back(region.misses(extent) ? 0 : 1);
      extent = {};
      in_leaf = 0;
    }
    ++in_leaf;
    for (const std::uint8_t c : corner) {
      const std::array<double, 6> vertex = cluster_vertex(patch, clusters.vertices[cluster.first_vertex + c]);
      region.add(extent, &vertex[0]);
      region.add(extent, &vertex[3]);
    }
  });
  if (in_leaf > 0) work.seen.push_back(region.misses(extent) ? 0 : 1);
  if (casters) std::ranges::fill(work.seen, kSeen);
}

// ---- Vertices and triangles -------------------------------------------------------------------------------------

void ReferenceScene::begin_grid(std::uint32_t patch, PatchWork& work) const {
  const PosedDrawable& drawable = posed_drawable(patch);
  const scene::TessellationPattern& pattern = frame.pattern_of(patch);
  const std::size_t count = (std::size_t{pattern.nu} + 1) * (std::size_t{pattern.nv} + 1);
  work.known.assign(count, 0);
  work.grid.resize(count);
  if (drawable.procedure != nullptr) return;
  for (std::size_t key = 0; key < (drawable.deforming ? 2u : 1u); ++key)
    work.surface[key].emplace(drawable.curved ? posed : frame, drawable, patch, key);
}

const std::array<double, 6>& ReferenceScene::grid_vertex(std::uint32_t patch, int i, int j, PatchWork& work) const {
  const std::size_t number =
      static_cast<std::size_t>(j) * (std::size_t{frame.pattern_of(patch).nu} + 1) + static_cast<std::size_t>(i);
  std::array<double, 6>& vertex = work.grid[number];
  if (work.known[number] != 0) return vertex;
  work.known[number] = 1;
  const PosedDrawable& drawable = posed_drawable(patch);
  const FrameGeometry& by = drawable.curved ? posed : frame;
  const std::array<DMat4, 2>& to_raster = drawable_to_raster_[frame.assembly->patch_drawable[patch]];
  DVec3 p(0.0);
  for (std::size_t key = 0; key < 2; ++key) {
    if (key == 0 || drawable.deforming)
      p = drawable.procedure != nullptr ? procedure_vertex(by, patch, i, j, key)
                                        : bezier_vertex(by, drawable, patch, *work.surface[key], i, j, key);
    const std::array<double, 3> r = place(to_raster[drawable.moving ? key : 0], p);
    std::copy(r.begin(), r.end(), vertex.begin() + static_cast<std::ptrdiff_t>(3 * key));
  }
  cut_off(vertex, drawable);
  return vertex;
}

void ReferenceScene::fill_grid(std::uint32_t patch, Amount at, PatchWork& work) {
  const scene::TessellationPattern& pattern = frame.pattern_of(patch);
  const bool moving = posed_drawable(patch).moving;
  Triangle t = triangle_of(patch);
  begin_grid(patch, work);
  for (std::size_t leaf = 0; leaf < work.seen.size(); ++leaf) {
    if (work.seen[leaf] == kLeftOut) continue;
    const LeafGrid grid = leaf_grid(pattern, leaf, work.seen[leaf]);
    const Amount first = at;
    for (int j = 0; j <= grid.down; ++j)
      for (int i = 0; i <= grid.across; ++i)
        vertices[at.vertices++] = grid_vertex(patch, grid.column(i), grid.row(j), work);
    t.step_bits = static_cast<std::uint8_t>(std::countr_zero(static_cast<unsigned>(grid.step)));
    for (int j = 0; j < grid.down; ++j)
      for (int i = 0; i < grid.across; ++i) {
        const auto corner = [&](int di, int dj) {
          return static_cast<std::uint8_t>((j + dj) * (grid.across + 1) + (i + di));
        };
        t.corner = {corner(0, 0), corner(1, 0), corner(1, 1)};
        t.triangle = 2u * static_cast<std::uint32_t>(grid.row(j) * pattern.nu + grid.column(i));
        triangles[at.triangles++] = t;
        t.corner = {corner(0, 0), corner(1, 1), corner(0, 1)};
        ++t.triangle;
        triangles[at.triangles++] = t;
      }
    leaves[at.leaves++] = leaf_between(first, at, moving);
  }
}

std::array<double, 6> ReferenceScene::cluster_vertex(std::uint32_t patch, std::uint32_t number) const {
  const PosedDrawable& drawable = posed_drawable(patch);
  const std::array<DMat4, 2>& to_raster = drawable_to_raster_[frame.assembly->patch_drawable[patch]];
  std::array<double, 6> vertex;
  for (std::size_t key = 0; key < 2; ++key) {
    const std::size_t by = drawable.moving ? key : 0;
    const std::array<double, 3> r = place(to_raster[by], DVec3(drawable.positions[by][number]));
    std::copy(r.begin(), r.end(), vertex.begin() + static_cast<std::ptrdiff_t>(3 * key));
  }
  cut_off(vertex, drawable);
  return vertex;
}

void ReferenceScene::fill_cluster(std::uint32_t patch, Amount at, PatchWork& work) {
  const PosedDrawable& drawable = posed_drawable(patch);
  const scene::MeshClusters& clusters = frame.assembly->clusters[drawable.drawable->geometry];
  const scene::Cluster& cluster = clusters.clusters[patch - drawable.drawable->first_patch];
  Triangle t = triangle_of(patch);
  Amount first = at;
  std::size_t number = 0;
  const auto finish_leaf = [&] {
    if (at.triangles > first.triangles) leaves[at.leaves++] = leaf_between(first, at, drawable.moving);
    first = at;
  };
  visit_triangles(clusters, cluster, [&](std::uint32_t triangle, const std::array<std::uint8_t, 3>& corner) {
    if (number % kClusterLeaf == 0) finish_leaf();
    if (work.seen[number++ / kClusterLeaf] == 0) return;
    t.triangle = triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      t.corner[k] = static_cast<std::uint8_t>(at.vertices - first.vertices);
      vertices[at.vertices++] = cluster_vertex(patch, clusters.vertices[cluster.first_vertex + corner[k]]);
    }
    triangles[at.triangles++] = t;
  });
  finish_leaf();
}

ReferenceScene::Leaf ReferenceScene::leaf_between(const Amount& begin, const Amount& end, bool moving) {
  return {static_cast<std::uint32_t>(begin.vertices), static_cast<std::uint32_t>(begin.triangles),
          static_cast<std::uint16_t>(end.vertices - begin.vertices),
          static_cast<std::uint16_t>(end.triangles - begin.triangles), moving};
}

ReferenceScene::Parameters ReferenceScene::grid_parameters(const Triangle& triangle, double b1, double b2) const {
  const scene::TessellationPattern& pattern = frame.pattern_of(triangle.patch);
  const std::array<double, 3> weight{1.0 - b1 - b2, b1, b2};
  Parameters mean{0, 0};
  for (std::size_t k = 0; k < 3; ++k) {
    auto [i, j] = scene::grid_corner(pattern, triangle.triangle, k);
    if (triangle.step_bits > 0) {
      const int cell = static_cast<int>(triangle.triangle / 2), i0 = cell % pattern.nu, j0 = cell / pattern.nu;
      i = std::min(i0 + ((i - i0) << triangle.step_bits), static_cast<int>(pattern.nu));
      j = std::min(j0 + ((j - j0) << triangle.step_bits), static_cast<int>(pattern.nv));
    }
    mean.u += static_cast<double>(pattern.u(i, j)) * weight[k],
        mean.v += static_cast<double>(pattern.v(i, j)) * weight[k];
  }
  return mean;
}

tilecore::SurfaceLocation ReferenceScene::location(std::int64_t number, double b1, double b2, double t) const {
  const Triangle& triangle = triangles[static_cast<std::size_t>(number)];
  const PosedDrawable& drawable = frame.drawable_of(triangle.patch);
  const float time = drawable.moving ? static_cast<float>(t) : 0.0f;
  if (!tilecore::has_grid(drawable))
    return {triangle.patch, triangle.triangle, static_cast<float>(b1), static_cast<float>(b2), time};
  const Parameters at = grid_parameters(triangle, b1, b2);
  return {triangle.patch, tilecore::SurfaceLocation::kWholePatch, static_cast<float>(at.u), static_cast<float>(at.v),
          time};
}

}  // namespace tessera::reference
