#include "scene/cluster_bounds.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <span>

#include "base/parallel.h"
#include "scene/clusters.h"

namespace tessera::scene {
namespace {

constexpr double kLongest = 32767;     // of what is packed in 16 bits
constexpr std::size_t kLongEdges = 4;  // that frames are tried along
// A turned box costs nothing to keep; one that is hardly smaller is left aligned, whose faces are exact.
constexpr double kWorthTurning = 0.95;
// A cone that is wider proves nothing of a box that is seen under any angle.
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
  double edges;
};

// Calls use(triangle) for each but those two of whose corners are in one place: nobody sees them, however they move.
template <class Use>
void for_each_triangle(const Primitive& primitive, const MeshClusters& clusters, const Cluster& cluster,
                       const Use& use) {
  const auto point = [&](std::uint8_t corner) {
    return DVec3(primitive.vertices.positions[clusters.vertices[cluster.first_vertex + corner]]);
  };
  const auto add = [&](const DVec3& p, const DVec3& q, const DVec3& r) {
    if (p == q || q == r || r == p) return;
    const DVec3 a = q - p, b = r - p;
    const std::array<double, 3> length = {glm::length(a), glm::length(b), glm::length(r - q)};
    use(ClusterTriangle{a, b, glm::cross(a, b), length[0] + length[1] + length[2] - std::ranges::min(length)});
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
    const double length = glm::length(t.normal);
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
  for (const ClusterTriangle& t : triangles)
    cosine = std::min(cosine, glm::dot(t.normal, unit) / glm::length(t.normal));
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
    // Along the object's axes nothing is rounded; along others sums of three products are.
    bound.low[a] = rounded_down(low), bound.high[a] = rounded_up(high);
  }
}

double half_surface(const ClusterBound& b) {
  std::array<double, 3> side;
  for (std::size_t a = 0; a < 3; ++a) side[a] = static_cast<double>(b.high[a]) - static_cast<double>(b.low[a]);
  return side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
}

// Points of a cluster for many boxes of about their size: float, from the first one, whole lanes of them.
struct PointLanes {
  static constexpr std::size_t kLanes = 8;
  std::vector<std::array<float, 3 * kLanes>> blocks;  // x, y, z

  void take(std::span<const DVec3> points) {
    blocks.resize((points.size() + kLanes - 1) / kLanes);
    for (std::size_t i = 0; i < blocks.size() * kLanes; ++i) {
      const Vec3 p(points[std::min(i, points.size() - 1)] - points[0]);
      for (std::size_t c = 0; c < 3; ++c)
        blocks[i / kLanes][c * kLanes + i % kLanes] = p[static_cast<Vec3::length_type>(c)];
    }
  }
  float extent(const Vec3& axis) const {
    std::array<float, kLanes> low, high;
    low.fill(std::numeric_limits<float>::infinity()), high.fill(-std::numeric_limits<float>::infinity());
    for (const auto& block : blocks)
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const float s = axis.x * block[lane] + axis.y * block[kLanes + lane] + axis.z * block[2 * kLanes + lane];
        low[lane] = s < low[lane] ? s : low[lane];
        high[lane] = s > high[lane] ? s : high[lane];
      }
    return std::ranges::max(high) - std::ranges::min(low);
  }
  float half_surface(const std::array<DVec3, 3>& frame) const {
    const float a = extent(Vec3(frame[0])), b = extent(Vec3(frame[1])), c = extent(Vec3(frame[2]));
    return a * b + b * c + c * a;
  }
};

// Frames along the longest edges, with a face's normal or the mean one: of what people build one fits, and of what grows
// none fits much better. The one with the least surface, as that is what screens see of a box. `lanes`: scratch.
void find_box(std::span<const DVec3> points, std::span<const ClusterTriangle> triangles, PointLanes& lanes,
              ClusterBound& out) {
  set_box(points, out);
  out.aligned_low = out.low, out.aligned_high = out.high;
  if (points.empty()) return;
  lanes.take(points);
  std::vector<const ClusterTriangle*> longest;
  DVec3 mean(0.0);
  for (const ClusterTriangle& t : triangles) longest.push_back(&t), mean += t.normal;
  const std::size_t tried = std::min(kLongEdges, longest.size());
  std::ranges::partial_sort(longest, longest.begin() + static_cast<std::ptrdiff_t>(tried), std::greater<>(),
                            &ClusterTriangle::edges);
  ClusterBound best = out;
  float least = std::numeric_limits<float>::infinity();
  const auto consider = [&](const DVec3& edge, const DVec3& normal) {
    const DVec3 y = glm::cross(normal, edge);
    const double x_length = glm::length(edge), y_length = glm::length(y);
    if (!(x_length > 0 && y_length > 1e-6 * x_length * glm::length(normal))) return;
    const DVec3 x_unit = edge / x_length, y_unit = y / y_length;
    ClusterBound turned = out;
    turned.rotation = packed(glm::normalize(glm::quat_cast(DMat3(x_unit, y_unit, glm::cross(x_unit, y_unit)))));
    const float surface = lanes.half_surface(turned.frame());
    if (surface < least) best = turned, least = surface;
  };
  for (std::size_t k = 0; k < tried; ++k)
    for (const DVec3& normal : {longest[k]->normal, mean}) {
      consider(longest[k]->a, normal);
      consider(longest[k]->b, normal);
      consider(longest[k]->b - longest[k]->a, normal);
    }
  if (!best.turned()) return;
  set_box(points, best);
  if (half_surface(best) < kWorthTurning * half_surface(out)) out = best;
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

}  // namespace tessera::scene
