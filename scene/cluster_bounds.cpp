#include "scene/cluster_bounds.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <span>

#include "base/parallel.h"
#include "scene/clusters.h"

namespace tessera::scene {
namespace {

constexpr double kLongest = 32767;     // largest number that 16 bits hold
constexpr std::size_t kLongEdges = 4;  // number of edges along which frames are tried
// A turned box costs nothing to store; a box that turning hardly shrinks stays aligned, because its faces are then
// exact.
constexpr double kWorthTurning = 0.95;
// A wider cone cannot cull a box seen under any angle.
constexpr double kLeastCosine = 0x1p-6;

// Rounded to a float that is no larger, no smaller.
float rounded_down(double x) {
  const auto f = static_cast<float>(x);
  return static_cast<double>(f) <= x ? f : std::nextafter(f, -std::numeric_limits<float>::infinity());
}
float rounded_up(double x) { return -rounded_down(-x); }

// A triangle of a cluster: two edges from its first corner, and the sum of its two longest.
struct ClusterTriangle {
  DVec3 a, b, normal;  // normal: of a x b, as long
  double edges, normal_length;
};

// Calls use(triangle) for each triangle except the ones with two corners in one place, which stay invisible however
// they move.
template <class Use>
void for_each_triangle(const Primitive& primitive, const MeshClusters& clusters, const Cluster& cluster,
                       const Use& use) {
  const auto point = [&](std::uint8_t corner) {
    return DVec3(primitive.vertices.positions[clusters.vertices[cluster.first_vertex + corner]]);
  };
  const auto add = [&](const DVec3& p, const DVec3& q, const DVec3& r) {
    if (p == q || q == r || r == p) return;
    const DVec3 a = q - p, b = r - p;
    const DVec3 c = r - q;
    const std::array<double, 3> squares = {glm::dot(a, a), glm::dot(b, b), glm::dot(c, c)};
    const auto shortest = static_cast<std::size_t>(std::ranges::min_element(squares) - squares.begin());
    const DVec3 normal = glm::cross(a, b);
    use(ClusterTriangle{a, b, normal, std::sqrt(squares[(shortest + 1) % 3]) + std::sqrt(squares[(shortest + 2) % 3]),
                        glm::length(normal)});
  };
  for (std::uint32_t k = cluster.first_cell; k < cluster.first_cell + cluster.cell_count; ++k) {
    const ClusterCell& cell = clusters.cells[k];
    const DVec3 first = point(cell.corner[0]), third = point(cell.corner[2]);
    add(first, point(cell.corner[1]), third);
    if (!cell.single()) add(first, third, point(cell.corner[3]));
  }
}

// ---- Cone -------------------------------------------------------------------------------------------------------

void find_cone(std::span<const ClusterTriangle> triangles, ClusterBound& out) {
  if (triangles.empty()) return;
  DVec3 sum(0.0);
  double height = std::numeric_limits<double>::infinity(), edges = height;
  for (const ClusterTriangle& t : triangles) {
    const double length = t.normal_length;
    if (!(length > 0 && std::isfinite(length))) return;  // a sliver faces anywhere once its vertices are rounded
    sum += t.normal / length;
    height = std::min(height, length / t.edges);
    edges = std::min(edges, t.edges);
  }
  const double length = glm::length(sum);
  if (!(length > 0)) return;
  const Vec3 axis(sum / length);
  double cosine = 1;
  const DVec3 unit = glm::normalize(DVec3(axis));
  for (const ClusterTriangle& t : triangles) cosine = std::min(cosine, glm::dot(t.normal, unit) / t.normal_length);
  cosine -= 0x1p-40;  // cosines in double precision are off by some 2^-50
  if (!(cosine > kLeastCosine)) return;
  out.cone_axis = {axis.x, axis.y, axis.z};
  out.cone_cosine = rounded_down(cosine);
  out.least_height = rounded_down(height * (1 - 0x1p-40));
  out.least_edges = rounded_down(edges * (1 - 0x1p-40));
}

// ---- Box --------------------------------------------------------------------------------------------------------

std::array<std::int16_t, 4> packed(const DQuat& q) {
  const auto part = [](double x) { return static_cast<std::int16_t>(std::lround(x * kLongest)); };
  return {part(q.x), part(q.y), part(q.z), part(q.w)};
}

void set_box(std::span<const DVec3> points, ClusterBound& bound) {
  const std::array<DVec3, 3> axes = bound.frame();
  for (std::size_t a = 0; a < 3; ++a) {
    double low = std::numeric_limits<double>::infinity(), high = -low, zero = 0;
    for (const DVec3& p : points) {
      const double s = glm::dot(axes[a], p);
      low = std::min(low, s), high = std::max(high, s);
      zero += s * 0;  // NaN where a coordinate is not finite: such a box is unusable rather than too small
    }
    low += zero, high += zero;
    // Extents along the object's axes are exact; along other axes they are sums of three rounded products.
    bound.low[a] = rounded_down(low), bound.high[a] = rounded_up(high);
  }
}

double half_surface(const ClusterBound& b) {
  std::array<double, 3> side;
  for (std::size_t a = 0; a < 3; ++a) side[a] = static_cast<double>(b.high[a]) - static_cast<double>(b.low[a]);
  return side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
}

// Points of a cluster for many boxes of about their size: float, from the first one, whole vectors of them.
class PointLanes {
 public:
  void take(std::span<const DVec3> points) {
    const std::size_t vectors = (points.size() + kLanes - 1) / kLanes;
    values_.resize(vectors * 3 * kLanes);
    for (std::size_t i = 0; i < vectors * kLanes; ++i) {
      const Vec3 p(points[std::min(i, points.size() - 1)] - points[0]);
      float* const vector = &values_[i / kLanes * 3 * kLanes + i % kLanes];
      vector[0] = p.x, vector[kLanes] = p.y, vector[2 * kLanes] = p.z;
    }
  }
  // Length of the points' extent along an axis.
  float extent(const Vec3& axis) const {
    Lanes low = load(0) * axis.x + load(kLanes) * axis.y + load(2 * kLanes) * axis.z, high = low;
    for (std::size_t at = 3 * kLanes; at < values_.size(); at += 3 * kLanes) {
      const Lanes s = load(at) * axis.x + load(at + kLanes) * axis.y + load(at + 2 * kLanes) * axis.z;
      low = s < low ? s : low;
      high = s > high ? s : high;
    }
    return std::max({high[0], high[1], high[2], high[3]}) - std::min({low[0], low[1], low[2], low[3]});
  }

 private:
  static constexpr std::size_t kLanes = 4;
  // Four floats of every processor: too little work here for kernels that are chosen at run time.
  using Lanes = float __attribute__((vector_size(kLanes * sizeof(float))));

  Lanes load(std::size_t at) const {
    Lanes lanes;
    std::memcpy(&lanes, &values_[at], sizeof lanes);
    return lanes;
  }
  std::vector<float> values_;
};

// Tries frames along the longest edges, with a face's normal or the mean one: one of them fits man-made shapes, and for
// organic ones no frame is much better. Takes the frame whose box has the least surface, which is proportional to the
// box's mean area on screen. `lanes`: scratch.
void find_box(std::span<const DVec3> points, std::span<const ClusterTriangle> triangles, PointLanes& lanes,
              ClusterBound& out) {
  set_box(points, out);
  out.aligned_low = out.low, out.aligned_high = out.high;
  if (points.empty()) return;
  lanes.take(points);
  std::array<const ClusterTriangle*, kLongEdges> longest{};  // the longest first
  DVec3 mean(0.0);
  for (const ClusterTriangle& t : triangles) {
    mean += t.normal;
    const ClusterTriangle* sinks = &t;
    for (const ClusterTriangle*& place : longest)
      if (place == nullptr || sinks->edges > place->edges) {
        std::swap(place, sinks);
        if (sinks == nullptr) break;
      }
  }
  const double mean_length = glm::length(mean);
  DMat3 best(1.0);
  float least = std::numeric_limits<float>::infinity();
  // `along_x`: extent of the points along the edge.
  const auto consider = [&](const DVec3& x_unit, float along_x, const DVec3& normal, double normal_length) {
    const DVec3 y = glm::cross(normal, x_unit);
    const double y_length = glm::length(y);
    if (!(y_length > 1e-6 * normal_length)) return;
    const DVec3 y_unit = y / y_length, z_unit = glm::cross(x_unit, y_unit);
    const float along_y = lanes.extent(Vec3(y_unit));
    if (along_x * along_y >= least) return;
    const float along_z = lanes.extent(Vec3(z_unit)),
                surface = along_x * along_y + along_y * along_z + along_z * along_x;
    if (surface < least) best = DMat3(x_unit, y_unit, z_unit), least = surface;
  };
  for (const ClusterTriangle* t : longest) {
    if (t == nullptr) break;
    for (const DVec3& edge : {t->a, t->b, t->b - t->a}) {
      const double length = glm::length(edge);
      if (!(length > 0)) continue;
      const DVec3 x_unit = edge / length;
      const float along_x = lanes.extent(Vec3(x_unit));
      consider(x_unit, along_x, t->normal, t->normal_length);
      consider(x_unit, along_x, mean, mean_length);
    }
  }
  ClusterBound turned = out;
  turned.rotation = packed(glm::normalize(glm::quat_cast(best)));
  if (!turned.turned()) return;
  set_box(points, turned);
  if (half_surface(turned) < kWorthTurning * half_surface(out)) out = turned;
}

}  // namespace

std::array<DVec3, 3> ClusterBound::frame() const {
  if (!turned()) return {DVec3(1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 1)};
  const DMat3 axes = glm::mat3_cast(glm::normalize(DQuat(rotation[3], rotation[0], rotation[1], rotation[2])));
  return {axes[0], axes[1], axes[2]};
}

std::vector<ClusterBound> bound_clusters(const Primitive& primitive, const MeshClusters& clusters) {
  std::vector<ClusterBound> bounds(clusters.clusters.size());
  constexpr std::size_t kBlock = 64;
  parallel_for((bounds.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    std::vector<DVec3> points;
    std::vector<ClusterTriangle> triangles;
    PointLanes lanes;
    for (std::size_t c = block * kBlock; c < std::min(bounds.size(), (block + 1) * kBlock); ++c) {
      const Cluster& cluster = clusters.clusters[c];
      points.clear(), triangles.clear();
      for (std::uint32_t v = cluster.first_vertex; v < cluster.first_vertex + cluster.vertex_count; ++v)
        points.emplace_back(primitive.vertices.positions[clusters.vertices[v]]);
      for_each_triangle(primitive, clusters, cluster,
                        [&](const ClusterTriangle& triangle) { triangles.push_back(triangle); });
      find_box(points, triangles, lanes, bounds[c]);
      find_cone(triangles, bounds[c]);
    }
  });
  return bounds;
}

namespace {

PatchGroups::Box empty_group_box() {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  return {{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
}

void add_point(const Vec3& point, PatchGroups::Box& box) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    box.low[a] = std::min(box.low[a], point[axis]);
    box.high[a] = std::max(box.high[a], point[axis]);
  }
}

// `add_patch(p, box)` widens a box by patch p.
template <class AddPatch>
PatchGroups group_patches(std::size_t patches, const AddPatch& add_patch) {
  PatchGroups groups;
  if (patches <= kPatchesPerGroup) return groups;
  const auto count = [](std::size_t parts) { return (parts + kPatchesPerGroup - 1) / kPatchesPerGroup; };
  std::vector<PatchGroups::Box>& lowest = groups.levels.emplace_back(count(patches), empty_group_box());
  parallel_for(lowest.size(), [&](std::size_t g) {
    const std::size_t end = std::min(patches, (g + 1) * kPatchesPerGroup);
    for (std::size_t p = g * kPatchesPerGroup; p < end; ++p) add_patch(p, lowest[g]);
  });
  while (groups.levels.back().size() > kPatchesPerGroup) {
    const std::vector<PatchGroups::Box>& below = groups.levels.back();
    std::vector<PatchGroups::Box> level(count(below.size()), empty_group_box());
    for (std::size_t b = 0; b < below.size(); ++b)
      for (std::size_t a = 0; a < 3; ++a) {
        PatchGroups::Box& box = level[b / kPatchesPerGroup];
        box.low[a] = std::min(box.low[a], below[b].low[a]);
        box.high[a] = std::max(box.high[a], below[b].high[a]);
      }
    groups.levels.push_back(std::move(level));
  }
  return groups;
}

}  // namespace

std::size_t PatchGroups::box_count() const {
  std::size_t count = 0;
  for (const std::vector<Box>& level : levels) count += level.size();
  return count;
}

PatchGroups group_clusters(const Primitive& primitive, const MeshClusters& clusters) {
  return group_patches(clusters.clusters.size(), [&](std::size_t p, PatchGroups::Box& box) {
    const Cluster& cluster = clusters.clusters[p];
    for (std::uint32_t v = 0; v < cluster.vertex_count; ++v)
      add_point(primitive.vertices.positions[clusters.vertices[cluster.first_vertex + v]], box);
  });
}

PatchGroups group_bezier_patches(const Vertices& control_points) {
  return group_patches(control_points.count() / 16, [&](std::size_t p, PatchGroups::Box& box) {
    for (std::size_t k = 0; k < 16; ++k) add_point(control_points.positions[16 * p + k], box);
  });
}

}  // namespace tessera::scene
