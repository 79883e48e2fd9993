#include "captures/sources/surfaces.h"

#include <cmath>

namespace tessera::captures {
namespace {

// Two triangles per cell of the 4x4 control cage.
void add_cage(Geometry& g, std::uint32_t first) {
  for (std::uint32_t j = 0; j < 3; ++j)
    for (std::uint32_t i = 0; i < 3; ++i) {
      const std::uint32_t a = first + 4 * j + i;
      g.indices.insert(g.indices.end(), {a, a + 1, a + 5, a, a + 5, a + 4});
    }
}

}  // namespace

std::vector<ProfileSegment> smooth_profile(const std::vector<Vec2>& p, bool round_start, bool round_end) {
  std::vector<Vec2> tangent(p.size());
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vec2 before = p[i == 0 ? 0 : i - 1], after = p[i + 1 == p.size() ? i : i + 1];
    tangent[i] = (after - before) * (i == 0 || i + 1 == p.size() ? 1.0f : 0.5f);
  }
  if (round_start) tangent.front() = {glm::length(tangent.front()) * 1.2f, 0.0f};
  if (round_end) tangent.back() = {-glm::length(tangent.back()) * 1.2f, 0.0f};
  std::vector<ProfileSegment> segments;
  for (std::size_t i = 0; i + 1 < p.size(); ++i)
    segments.push_back({p[i], p[i] + tangent[i] / 3.0f, p[i + 1] - tangent[i + 1] / 3.0f, p[i + 1]});
  return segments;
}

Geometry revolve(const std::vector<ProfileSegment>& profile) {
  constexpr float kCircle = 0.5522847498f;
  Geometry g;
  g.bezier = true;
  for (std::size_t s = 0; s < profile.size(); ++s)
    for (int quarter = 0; quarter < 4; ++quarter) {
      const auto first = static_cast<std::uint32_t>(g.positions.size());
      // Exact directions, so that quarters share their edges bit by bit.
      static constexpr float kCos[5] = {1, 0, -1, 0, 1}, kSin[5] = {0, 1, 0, -1, 0};
      const Vec2 a(kCos[quarter], kSin[quarter]), b(kCos[quarter + 1], kSin[quarter + 1]);
      const std::array<Vec2, 4> arc = {a, a + b * kCircle, b + a * kCircle, b};
      for (std::size_t j = 0; j < 4; ++j)
        for (std::size_t i = 0; i < 4; ++i) {
          const Vec2& point = profile[s][j];
          // u runs clockwise seen from above: dp/du x dp/dv then points outwards.
          g.positions.emplace_back(arc[i].x * point.x, point.y, -arc[i].y * point.x);
          g.texcoords.emplace_back(
              (static_cast<float>(quarter) + static_cast<float>(i) / 3.0f) / 4.0f,
              1.0f - (static_cast<float>(s) + static_cast<float>(j) / 3.0f) / static_cast<float>(profile.size()));
        }
      add_cage(g, first);
    }
  return g;
}

Geometry ground(Vec2 low, Vec2 high, int nx, int nz) {
  Geometry g;
  g.bezier = true;
  for (int z = 0; z < nz; ++z)
    for (int x = 0; x < nx; ++x) {
      const auto first = static_cast<std::uint32_t>(g.positions.size());
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) {
          const Vec2 s(static_cast<float>(3 * x + i) / static_cast<float>(3 * nx),
                       static_cast<float>(3 * z + j) / static_cast<float>(3 * nz));
          const Vec2 p = low + (high - low) * s;
          // v runs towards -z, so that the normal is +y.
          g.positions.emplace_back(p.x, 0.0f, -p.y);
          g.texcoords.push_back(s);
        }
      add_cage(g, first);
    }
  return g;
}

Geometry mesh_of(const std::function<Vec3(float, float)>& surface, int nu, int nv) {
  Geometry g;
  for (int j = 0; j <= nv; ++j)
    for (int i = 0; i <= nu; ++i) {
      const float u = static_cast<float>(i) / static_cast<float>(nu),
                  v = static_cast<float>(j) / static_cast<float>(nv);
      constexpr float kStep = 1e-3f;
      const Vec3 du = surface(u + kStep, v) - surface(u - kStep, v), dv = surface(u, v + kStep) - surface(u, v - kStep);
      const Vec3 n = glm::cross(du, dv);
      g.positions.push_back(surface(u, v));
      g.normals.push_back(glm::length(n) > 1e-8f ? glm::normalize(n) : glm::normalize(surface(u, v)));
      g.texcoords.emplace_back(u, v);
    }
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      const auto a = static_cast<std::uint32_t>(j * (nu + 1) + i), row = static_cast<std::uint32_t>(nu + 1);
      g.indices.insert(g.indices.end(), {a, a + 1, a + row + 1, a, a + row + 1, a + row});
    }
  return g;
}

Geometry box(Vec3 h) {
  Geometry g;
  for (int axis = 0; axis < 3; ++axis)
    for (const float side : {-1.0f, 1.0f}) {
      Vec3 n(0.0f), s(0.0f), t(0.0f);
      n[axis] = side;
      s[(axis + 1) % 3] = side;
      t[(axis + 2) % 3] = 1.0f;
      const auto first = static_cast<std::uint32_t>(g.positions.size());
      for (const Vec2& c : {Vec2(-1, -1), Vec2(1, -1), Vec2(1, 1), Vec2(-1, 1)}) {
        g.positions.push_back((n + s * c.x + t * c.y) * h);
        g.normals.push_back(n);
        g.texcoords.push_back(c * 0.5f + 0.5f);
      }
      g.indices.insert(g.indices.end(), {first, first + 1, first + 2, first, first + 2, first + 3});
    }
  return g;
}

}  // namespace tessera::captures
