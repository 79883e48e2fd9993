#include "replay/pack/quad_pairing.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include "scene/weld.h"

namespace tessera::replay {
namespace {

using scene::Primitive;
using Edge = std::pair<std::uint32_t, std::uint32_t>;

// Per vertex: the first vertex with the same point, texture coordinates and colour.
std::vector<std::uint32_t> first_alike(const scene::Vertices& vertices) {
  const std::vector<std::uint32_t> point = scene::weld_points(vertices);
  std::map<std::vector<std::uint32_t>, std::uint32_t> first;
  std::vector<std::uint32_t> out(vertices.count());
  for (std::size_t v = 0; v < out.size(); ++v) {
    std::vector<std::uint32_t> key = {point[v]};
    const auto add = [&](float f) { key.push_back(std::bit_cast<std::uint32_t>(f + 0.0f)); };
    for (const auto& set : vertices.texcoords)
      if (!set.empty()) add(set[v].x), add(set[v].y);
    if (!vertices.colors.empty())
      for (int c = 0; c < 4; ++c) add(vertices.colors[v][c]);
    out[v] = first.emplace(std::move(key), static_cast<std::uint32_t>(v)).first->second;
  }
  return out;
}

DVec3 triangle_normal(const DVec3& a, const DVec3& b, const DVec3& c) {
  const DVec3 n = glm::cross(b - a, c - a);
  const double length = glm::length(n);
  return length > 0 ? n / length : DVec3(0.0);
}

double cosine_of(double degrees) { return std::cos(degrees * std::numbers::pi / 180.0); }

struct Pair {
  double cost;
  std::uint32_t s, t;  // triangles
  std::array<std::uint32_t, 4> quad;
};

class Pairing {
 public:
  Pairing(const Primitive& mesh, double max_bend)
      : least_flat_(cosine_of(max_bend)),
        positions_(mesh.vertices.positions),
        indices_(mesh.indices.begin(),
                 mesh.indices.begin() + static_cast<std::ptrdiff_t>(mesh.indices.size() / 3 * 3)) {
    const std::vector<std::uint32_t> alike = first_alike(mesh.vertices);
    for (std::uint32_t& index : indices_) index = alike[index];
  }

  QuadDominantMesh run() {
    std::vector<Pair> pairs = candidates();
    std::sort(pairs.begin(), pairs.end(),
              [](const Pair& a, const Pair& b) { return std::tie(a.cost, a.s, a.t) < std::tie(b.cost, b.s, b.t); });
    QuadDominantMesh out;
    std::vector<bool> used(indices_.size() / 3, false);
    for (const Pair& pair : pairs) {
      if (used[pair.s] || used[pair.t]) continue;
      used[pair.s] = used[pair.t] = true;
      const auto& q = pair.quad;
      out.indices.insert(out.indices.end(), {q[0], q[1], q[2], q[0], q[2], q[3]});
      ++out.quads;
    }
    for (std::size_t t = 0; t < used.size(); ++t) {
      if (used[t]) continue;
      out.indices.insert(out.indices.end(), {indices_[3 * t], indices_[3 * t + 1], indices_[3 * t + 2]});
      ++out.triangles;
    }
    return out;
  }

 private:
  // Sides (from, to) of all triangles; a side that several triangles run through the same way pairs none of them.
  std::vector<Pair> candidates() const {
    constexpr std::uint32_t kAmbiguous = ~0u;
    std::map<Edge, std::uint32_t> side;  // index of its first corner
    for (std::uint32_t i = 0; i < indices_.size(); ++i) {
      const auto [at, fresh] = side.emplace(Edge{indices_[i], indices_[next(i)]}, i);
      if (!fresh) at->second = kAmbiguous;
    }
    std::vector<Pair> pairs;
    for (const auto& [edge, i] : side) {
      if (i == kAmbiguous || edge.first > edge.second) continue;
      const auto back = side.find({edge.second, edge.first});
      if (back == side.end() || back->second == kAmbiguous) continue;
      const std::uint32_t j = back->second;
      // The diagonal runs c -> a in s = (a, b, c) and a -> c in t = (a, c, d).
      const std::array<std::uint32_t, 4> quad = {indices_[next(i)], indices_[next(next(i))], indices_[i],
                                                 indices_[next(next(j))]};
      const double cost = quad_cost(quad, i / 3, j / 3);
      if (cost < kRefused) pairs.push_back({cost, std::min(i, j) / 3, std::max(i, j) / 3, quad});
    }
    return pairs;
  }

  static std::uint32_t next(std::uint32_t i) { return i % 3 == 2 ? i - 2 : i + 1; }

  static constexpr double kRefused = 1e9;

  // 0 for a flat rectangle, more for a bent or skewed quad; triangles adjacent in the file were often a quad.
  double quad_cost(const std::array<std::uint32_t, 4>& quad, std::uint32_t s, std::uint32_t t) const {
    std::array<DVec3, 4> p;
    for (std::size_t k = 0; k < 4; ++k) p[k] = DVec3(positions_[quad[k]]);
    const double flat = glm::dot(triangle_normal(p[0], p[1], p[2]), triangle_normal(p[0], p[2], p[3]));
    if (!(flat > least_flat_)) return kRefused;
    double skew = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const DVec3 a = p[(k + 1) % 4] - p[k], b = p[(k + 3) % 4] - p[k];
      skew = std::max(skew, std::abs(glm::dot(a, b)) / (glm::length(a) * glm::length(b)));
      // Concave: the corner turns against the face.
      if (glm::dot(glm::cross(a, b), triangle_normal(p[0], p[1], p[2]) + triangle_normal(p[0], p[2], p[3])) <= 0)
        return kRefused;
    }
    if (!(skew < 0.94)) return kRefused;  // cos 20 degrees
    return skew + 2.0 * (1.0 - flat) + ((s > t ? s - t : t - s) == 1 ? 0.0 : 0.25);
  }

  double least_flat_;  // cosine of the largest bend
  const std::vector<Vec3>& positions_;
  std::vector<std::uint32_t> indices_;
};

}  // namespace

QuadDominantMesh pair_into_quads(const Primitive& mesh, double max_bend) { return Pairing(mesh, max_bend).run(); }

std::vector<std::array<std::uint32_t, 2>> edges_sharper_than(const Primitive& mesh, std::size_t quads, double degrees) {
  const std::vector<std::uint32_t> point = scene::weld_points(mesh.vertices);
  const double least = cosine_of(degrees);
  std::map<Edge, DVec3> first_normal;
  std::vector<std::array<std::uint32_t, 2>> out;
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const std::uint32_t* t = &mesh.indices[i];
    const DVec3 normal = triangle_normal(DVec3(mesh.vertices.positions[t[0]]), DVec3(mesh.vertices.positions[t[1]]),
                                         DVec3(mesh.vertices.positions[t[2]]));
    if (normal == DVec3(0.0)) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      const bool diagonal = i < 6 * quads && k == (i % 2 == 0 ? 2u : 0u);  // of (a, b, c), (a, c, d)
      if (diagonal || point[a] == point[b]) continue;
      const auto [at, fresh] = first_normal.emplace(std::minmax(point[a], point[b]), normal);
      if (!fresh && glm::dot(at->second, normal) < least) out.push_back({a, b});
    }
  }
  return out;
}

}  // namespace tessera::replay
