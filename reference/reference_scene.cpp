#include "reference/reference_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "scene/domain_shader.h"
#include "scene/procedure_patch.h"
#include "scene/wires.h"
#include "shaders_cpp/bicubic.h"
#include "shaders_cpp/procedures/procedures.h"
#include "tilecore/shading/transmission.h"

namespace tessera::reference {
namespace {

using scene::FrameGeometry;
using scene::PosedDrawable;

// A point of a patch in object space at a key: the domain shader's formula on doubles.
DVec3 patch_point(const FrameGeometry& frame, const PosedDrawable& drawable, std::uint32_t patch, double u, double v,
                  std::size_t key) {
  const auto points = frame.control_points(drawable, patch, static_cast<int>(key));
  shaders::ControlPoints<double> c;
  for (std::size_t i = 0; i < 16; ++i)
    c[i] = {static_cast<double>(points[i].x), static_cast<double>(points[i].y), static_cast<double>(points[i].z)};
  const shaders::SurfacePoint<double> p = shaders::bicubic_point<double>(shaders::bicubic_row(c, v), u);
  Vector3<double> at = p.position;
  if (drawable.material->displacement) {
    const double offset = static_cast<double>(
        scene::patch_displacement(frame, drawable, patch).offset(static_cast<float>(u), static_cast<float>(v)));
    at = at + shaders::bicubic_normal(c, u, v, p) * offset;
  }
  return {at.x, at.y, at.z};
}

// A vertex of a grid, by the patch that owns it: neighbours meet without cracks here, too.
DVec3 grid_vertex(const FrameGeometry& frame, const PosedDrawable& drawable, std::uint32_t patch, int i, int j,
                  std::size_t key) {
  const scene::TessellationPattern& pattern = frame.pattern_of(patch);
  const std::uint32_t first = drawable.drawable->first_patch;
  if (i == 0 || j == 0 || i == pattern.nu || j == pattern.nv) {
    const scene::OwnedVertex owned =
        scene::boundary_vertex(pattern, frame.assembly->neighbours[drawable.drawable->geometry][patch - first], i, j);
    return patch_point(frame, drawable, owned.patch + first, static_cast<double>(owned.u), static_cast<double>(owned.v),
                       key);
  }
  return patch_point(frame, drawable, patch, static_cast<double>(pattern.u(i, j)), static_cast<double>(pattern.v(i, j)),
                     key);
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

void grow(ReferenceScene::Box& box, const double* p, double slack) {
  for (std::size_t a = 0; a < 3; ++a) {
    box.low[a] = std::min(box.low[a],
                          std::nextafterf(static_cast<float>(p[a] - slack), -std::numeric_limits<float>::infinity()));
    box.high[a] = std::max(box.high[a],
                           std::nextafterf(static_cast<float>(p[a] + slack), std::numeric_limits<float>::infinity()));
  }
}

ReferenceScene::Box empty_box() {
  ReferenceScene::Box box;
  box.low.fill(std::numeric_limits<float>::infinity());
  box.high.fill(-std::numeric_limits<float>::infinity());
  return box;
}

void grow(ReferenceScene::Box& box, const ReferenceScene::Box& other) {
  for (std::size_t a = 0; a < 3; ++a) {
    box.low[a] = std::min(box.low[a], other.low[a]);
    box.high[a] = std::max(box.high[a], other.high[a]);
  }
}

float middle(const std::array<ReferenceScene::Box, 2>& boxes, std::size_t axis) {
  return 0.25f * ((boxes[0].low[axis] + boxes[0].high[axis]) + (boxes[1].low[axis] + boxes[1].high[axis]));
}

// Rays run along the depth: what a node costs is its area across it, in pixels when it is in perspective.
double cost_of(const std::array<ReferenceScene::Box, 2>& boxes, bool orthographic) {
  double cost = 0;
  for (const ReferenceScene::Box& box : boxes) {
    const double z = orthographic ? 1.0 : std::max(0.5 * static_cast<double>(box.low[2] + box.high[2]), 1e-6);
    cost += static_cast<double>(box.high[0] - box.low[0]) * static_cast<double>(box.high[1] - box.low[1]) / (z * z);
  }
  return cost;
}

}  // namespace

ReferenceScene::ReferenceScene(const FrameGeometry& frame_in, int segment, bool behind)
    : frame(frame_in),
      posed(frame_in.segment(segment)),
      center_x(posed.projection.center_x),
      center_y(posed.projection.center_y),
      near(posed.projection.near),
      far(posed.projection.far > 0 ? posed.projection.far : std::numeric_limits<double>::infinity()),
      orthographic(posed.projection.orthographic),
      lens_scale(posed.projection.lens_scale),
      inverse_focus(posed.projection.inverse_focus) {
  const scene::Assembly& assembly = *frame.assembly;
  drawable_to_raster_.resize(frame.drawables.size());
  place_drawables(frame);
  if (segment != 0) place_drawables(posed);
  for (std::uint32_t patch = 0; patch < assembly.patch_count(); ++patch) {
    const PosedDrawable& drawable = frame.drawable_of(patch);
    if (behind && (tilecore::transmits(drawable) || drawable.material->alpha_mode == scene::AlphaMode::kBlend))
      continue;
    add_patch(patch);
  }
  for (const Leaf& leaf : leaves) leaf_boxes_.push_back(leaf_boxes(leaf));
  if (!leaves.empty()) {
    std::vector<std::uint32_t> order(leaves.size());
    for (std::size_t l = 0; l < order.size(); ++l) order[l] = static_cast<std::uint32_t>(l);
    nodes.reserve(2 * leaves.size());
    build(order, 0, order.size());
  }
  measure_blur();
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
  const bool both = drawable.material->double_sided;
  t.keep_positive = both || drawable.mirrored;
  t.keep_negative = both || !drawable.mirrored;
  t.opaque = drawable.material->alpha_mode == scene::AlphaMode::kOpaque;
  return t;
}

void ReferenceScene::add_patch(std::uint32_t patch) {
  const std::array<DMat4, 2>& to_raster = drawable_to_raster_[frame.assembly->patch_drawable[patch]];
  if (!frame.drawable_of(patch).visible) return;
  if (scene::has_grid(*frame.drawable_of(patch).drawable))
    add_grid(patch, to_raster);
  else
    add_cluster(patch, to_raster);
}

void ReferenceScene::finish_leaf(bool moving) {
  if (triangles.size() > leaf_first_triangle_)
    leaves.push_back({leaf_first_vertex_, leaf_first_triangle_,
                      static_cast<std::uint16_t>(vertices.size() - leaf_first_vertex_),
                      static_cast<std::uint16_t>(triangles.size() - leaf_first_triangle_), moving});
  leaf_first_vertex_ = static_cast<std::uint32_t>(vertices.size());
  leaf_first_triangle_ = static_cast<std::uint32_t>(triangles.size());
}

void ReferenceScene::add_grid(std::uint32_t patch, const std::array<DMat4, 2>& to_raster) {
  constexpr int kSide = 3;
  const PosedDrawable& drawable = posed_drawable(patch);
  const scene::TessellationPattern& pattern = frame.pattern_of(patch);
  const bool moving = drawable.moving;
  std::vector<std::array<double, 6>> grid;
  for (int j = 0; j <= pattern.nv; ++j)
    for (int i = 0; i <= pattern.nu; ++i) {
      std::array<double, 6> vertex;
      DVec3 p(0.0);
      for (std::size_t key = 0; key < 2; ++key) {
        const FrameGeometry& by = drawable.curved ? posed : frame;
        if (drawable.procedure != nullptr && (key == 0 || drawable.deforming))
          p = procedure_vertex(by, patch, i, j, key);
        else if (key == 0 || drawable.deforming)
          p = grid_vertex(by, drawable, patch, i, j, key);
        const std::array<double, 3> r = place(to_raster[moving ? key : 0], p);
        std::copy(r.begin(), r.end(), vertex.begin() + static_cast<std::ptrdiff_t>(3 * key));
      }
      cut_off(vertex, drawable);
      grid.push_back(vertex);
    }
  const Triangle form = triangle_of(patch);
  const std::size_t columns = std::size_t{pattern.nu} + 1;
  for (int lj = 0; lj < pattern.nv; lj += kSide)
    for (int li = 0; li < pattern.nu; li += kSide) {
      const int i1 = std::min<int>(li + kSide, pattern.nu), j1 = std::min<int>(lj + kSide, pattern.nv),
                width = i1 - li + 1;
      for (int j = lj; j <= j1; ++j)
        for (int i = li; i <= i1; ++i)
          vertices.push_back(grid[static_cast<std::size_t>(j) * columns + static_cast<std::size_t>(i)]);
      for (int j = lj; j < j1; ++j)
        for (int i = li; i < i1; ++i) {
          const auto corner = [&](int di, int dj) {
            return static_cast<std::uint8_t>((j + dj - lj) * width + (i + di - li));
          };
          Triangle t = form;
          t.corner = {corner(0, 0), corner(1, 0), corner(1, 1)};
          t.triangle = 2u * static_cast<std::uint32_t>(j * pattern.nu + i);
          triangles.push_back(t);
          t.corner = {corner(0, 0), corner(1, 1), corner(0, 1)};
          ++t.triangle;
          triangles.push_back(t);
        }
      finish_leaf(moving);
    }
}

void ReferenceScene::add_cluster(std::uint32_t patch, const std::array<DMat4, 2>& to_raster) {
  constexpr std::uint32_t kLeafTriangles = kLeafVertices / 3;
  const PosedDrawable& drawable = posed_drawable(patch);
  const scene::MeshClusters& clusters = frame.assembly->clusters[drawable.drawable->geometry];
  const scene::Cluster& cluster = clusters.clusters[patch - drawable.drawable->first_patch];
  Triangle t = triangle_of(patch);
  std::uint32_t in_leaf = 0;
  for (std::uint32_t c = 0; c < cluster.cell_count; ++c) {
    const scene::ClusterCell& cell = clusters.cells[cluster.first_cell + c];
    for (std::size_t half = 0; half < (cell.single() ? 1u : 2u); ++half) {
      const std::array<std::uint8_t, 3> corner = {cell.corner[0], cell.corner[half == 0 ? 1 : 2],
                                                  cell.corner[half == 0 ? 2 : 3]};
      for (std::size_t k = 0; k < 3; ++k) {
        std::array<double, 6> vertex;
        for (std::size_t key = 0; key < 2; ++key) {
          const Vec3& p =
              drawable.positions[drawable.moving ? key : 0][clusters.vertices[cluster.first_vertex + corner[k]]];
          const std::array<double, 3> r = place(to_raster[drawable.moving ? key : 0], DVec3(p));
          std::copy(r.begin(), r.end(), vertex.begin() + static_cast<std::ptrdiff_t>(3 * key));
        }
        cut_off(vertex, drawable);
        t.corner[k] = static_cast<std::uint8_t>(vertices.size() - leaf_first_vertex_);
        vertices.push_back(vertex);
      }
      t.triangle = 2 * c + static_cast<std::uint32_t>(half);
      triangles.push_back(t);
      if (++in_leaf == kLeafTriangles) {
        finish_leaf(drawable.moving);
        in_leaf = 0;
      }
    }
  }
  finish_leaf(drawable.moving);
}

ReferenceScene::Parameters ReferenceScene::grid_parameters(const Triangle& triangle, double b1, double b2) const {
  const scene::TessellationPattern& pattern = frame.pattern_of(triangle.patch);
  const std::array<double, 3> weight{1.0 - b1 - b2, b1, b2};
  Parameters mean{0, 0};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [i, j] = scene::grid_corner(pattern, triangle.triangle, k);
    mean.u += static_cast<double>(pattern.u(i, j)) * weight[k],
        mean.v += static_cast<double>(pattern.v(i, j)) * weight[k];
  }
  return mean;
}

// ---- The tree ---------------------------------------------------------------------------------------------------

std::array<ReferenceScene::Box, 2> ReferenceScene::leaf_boxes(const Leaf& leaf) const {
  std::array<Box, 2> boxes = {empty_box(), empty_box()};
  for (std::size_t v = leaf.first_vertex; v < std::size_t{leaf.first_vertex} + leaf.vertex_count; ++v) {
    // What the walk through the tree rounds in single precision: 16 units in the last place of everything that it adds
    // up there.
    double size = lens_scale;
    for (std::size_t key = 0; key < 2; ++key)
      for (std::size_t a = 0; a < 3; ++a)
        size = std::max(size, std::abs(vertices[v][3 * key + a]) * (a == 2 ? std::max(center_x, center_y) : 1.0));
    for (std::size_t key = 0; key < 2; ++key) grow(boxes[key], &vertices[v][3 * key], size * 0x1p-20);
  }
  return boxes;
}

std::int32_t ReferenceScene::build(std::vector<std::uint32_t>& order, std::size_t begin, std::size_t end) {
  constexpr std::size_t kBins = 16;
  const auto number = static_cast<std::int32_t>(nodes.size());
  Node node;
  node.box = {empty_box(), empty_box()};
  for (std::size_t k = begin; k < end; ++k) {
    for (std::size_t key = 0; key < 2; ++key) grow(node.box[key], leaf_boxes_[order[k]][key]);
    node.moving = node.moving || leaves[order[k]].moving;
  }
  nodes.push_back(node);
  if (end - begin == 1) {
    nodes.back().right = static_cast<std::int32_t>(order[begin]);
    return number;
  }
  // Binned surface-area heuristic over the middles of the leaves.
  std::size_t best_axis = 3, best_bin = 0;
  double best_cost = std::numeric_limits<double>::infinity();
  std::array<float, 3> low, high;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = std::numeric_limits<float>::infinity(), high[axis] = -low[axis];
    for (std::size_t k = begin; k < end; ++k) {
      const float m = middle(leaf_boxes_[order[k]], axis);
      low[axis] = std::min(low[axis], m), high[axis] = std::max(high[axis], m);
    }
  }
  const auto bin_of = [&](std::uint32_t leaf, std::size_t axis) {
    const float share = (middle(leaf_boxes_[leaf], axis) - low[axis]) / (high[axis] - low[axis]);
    return std::min<std::size_t>(static_cast<std::size_t>(share * static_cast<float>(kBins)), kBins - 1);
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!(high[axis] > low[axis])) continue;
    std::array<std::array<Box, 2>, kBins> box;
    std::array<std::size_t, kBins> count{};
    for (auto& b : box) b = {empty_box(), empty_box()};
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t bin = bin_of(order[k], axis);
      ++count[bin];
      for (std::size_t key = 0; key < 2; ++key) grow(box[bin][key], leaf_boxes_[order[k]][key]);
    }
    std::array<double, kBins> below{};  // of the bins up to here
    for (const bool up : {true, false}) {
      std::array<Box, 2> sum = {empty_box(), empty_box()};
      std::size_t total = 0;
      for (std::size_t step = 0; step + 1 < kBins; ++step) {
        const std::size_t bin = up ? step : kBins - 1 - step;
        total += count[bin];
        for (std::size_t key = 0; key < 2; ++key) grow(sum[key], box[bin][key]);
        const double cost = total == 0 ? 0 : cost_of(sum, orthographic) * static_cast<double>(total);
        if (up) {
          below[bin] = total == 0 ? std::numeric_limits<double>::infinity() : cost;
        } else if (total > 0 && below[bin - 1] + cost < best_cost) {
          best_cost = below[bin - 1] + cost;
          best_axis = axis;
          best_bin = bin;  // the first one of the right side
        }
      }
    }
  }
  std::size_t split = begin + (end - begin) / 2;
  if (best_axis < 3) {
    const auto at = std::stable_partition(order.begin() + static_cast<std::ptrdiff_t>(begin),
                                          order.begin() + static_cast<std::ptrdiff_t>(end),
                                          [&](std::uint32_t leaf) { return bin_of(leaf, best_axis) < best_bin; });
    split = static_cast<std::size_t>(at - order.begin());
  }
  if (split == begin || split == end) split = begin + (end - begin) / 2;
  const std::int32_t left = build(order, begin, split), right = build(order, split, end);
  nodes[static_cast<std::size_t>(number)].left = left;
  nodes[static_cast<std::size_t>(number)].right = right;
  return number;
}

void ReferenceScene::measure_blur() {
  double travel = 0, confusion = 0;
  std::size_t count = 0;
  for (const std::array<Box, 2>& boxes : leaf_boxes_) {
    std::array<double, 2> x, y, z;
    for (std::size_t key = 0; key < 2; ++key) {
      z[key] = 0.5 * static_cast<double>(boxes[key].low[2] + boxes[key].high[2]);
      const double w = orthographic ? 1.0 : z[key];
      x[key] = 0.5 * static_cast<double>(boxes[key].low[0] + boxes[key].high[0]) / w;
      y[key] = 0.5 * static_cast<double>(boxes[key].low[1] + boxes[key].high[1]) / w;
    }
    if (!(z[0] > near) || !(z[1] > near) || std::abs(x[0]) > center_x || std::abs(y[0]) > center_y) continue;
    travel += std::hypot(x[1] - x[0], y[1] - y[0]);
    confusion += lens_scale * std::abs(orthographic ? 1.0 - z[0] * inverse_focus : 1.0 / z[0] - inverse_focus);
    ++count;
  }
  if (count == 0) return;
  mean_travel_pixels = travel / static_cast<double>(count);
  mean_confusion_pixels = confusion / static_cast<double>(count);
}

}  // namespace tessera::reference
