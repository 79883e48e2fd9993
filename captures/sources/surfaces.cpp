#include "captures/sources/surfaces.h"

#include <cmath>

#include "base/color.h"

namespace tessera::captures {
namespace {

// Control points are multiples of 1/kGrid metres. Corners lie on a grid four times as coarse: thirds between them are
// never halfway between two points of the fine one, so rounding errors do not open edges.
constexpr float kGrid = 4096.0f;

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

void add_patch(Geometry& g, const std::array<Vec3, 16>& points, const std::array<Corner, 4>& corners, bool fine_cage) {
  g.bezier = true;
  const auto first = static_cast<std::uint32_t>(g.positions.size());
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 4; ++i) {
      const float u = static_cast<float>(i) / 3.0f, v = static_cast<float>(j) / 3.0f;
      const auto blend = [&](const auto& a, const auto& b, const auto& c, const auto& d) {
        return (a * (1 - u) + b * u) * (1 - v) + (c * (1 - u) + d * u) * v;
      };
      g.positions.push_back(glm::round(points[4 * j + i] * kGrid) / kGrid);
      g.texcoords.push_back(blend(corners[0].texcoord, corners[1].texcoord, corners[2].texcoord, corners[3].texcoord));
      const Vec3 light = blend(corners[0].light, corners[1].light, corners[2].light, corners[3].light);
      g.colors.push_back({to_unorm8(light.x), to_unorm8(light.y), to_unorm8(light.z), 255});
    }
  if (fine_cage) return add_cage(g, first);
  for (std::uint32_t j = first; j < first + 12; j += 4)
    g.indices.insert(g.indices.end(), {j, j + 3, j + 7, j, j + 7, j + 4});
}

void add_patch(Geometry& g, const std::array<Corner, 4>& corners) {
  std::array<Vec3, 4> at;
  for (std::size_t k = 0; k < 4; ++k) at[k] = glm::round(corners[k].at * (kGrid / 4)) / (kGrid / 4);
  std::array<Vec3, 16> points;
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 4; ++i) {
      const float u = static_cast<float>(i) / 3.0f, v = static_cast<float>(j) / 3.0f;
      points[4 * j + i] = (at[0] * (1 - u) + at[1] * u) * (1 - v) + (at[2] * (1 - u) + at[3] * u) * v;
    }
  add_patch(g, points, corners, false);
}

Geometry patches_of(const std::function<Vec3(float, float)>& surface, int nu, int nv,
                    const std::function<Vec3(float, float)>& light) {
  // Control points of the cubic through four points at thirds.
  static constexpr float kThrough[4][4] = {
      {1, 0, 0, 0}, {-5.0f / 6, 3, -1.5f, 1.0f / 3}, {1.0f / 3, -1.5f, 3, -5.0f / 6}, {0, 0, 0, 1}};
  Geometry g;
  for (int y = 0; y < nv; ++y)
    for (int x = 0; x < nu; ++x) {
      const auto at = [&](std::size_t i, std::size_t j) {
        return Vec2(static_cast<float>(3 * x + static_cast<int>(i)) / static_cast<float>(3 * nu),
                    static_cast<float>(3 * y + static_cast<int>(j)) / static_cast<float>(3 * nv));
      };
      std::array<Vec3, 16> through, points;
      for (std::size_t j = 0; j < 4; ++j)
        for (std::size_t i = 0; i < 4; ++i) through[4 * j + i] = surface(at(i, j).x, at(i, j).y);
      for (std::size_t j = 0; j < 4; ++j)
        for (std::size_t i = 0; i < 4; ++i) {
          Vec3 sum(0.0f);
          for (std::size_t b = 0; b < 4; ++b)
            for (std::size_t a = 0; a < 4; ++a) sum += through[4 * b + a] * (kThrough[i][a] * kThrough[j][b]);
          points[4 * j + i] = sum;
        }
      std::array<Corner, 4> corners;
      for (std::size_t k = 0; k < 4; ++k) {
        const Vec2 p = at(3 * (k & 1), 3 * (k >> 1)), middle = (at(1, 1) + at(2, 2)) * 0.5f;
        corners[k] = {{}, p, light(middle.x, middle.y)};
      }
      add_patch(g, points, corners, true);
    }
  return g;
}

void append(Geometry& to, const Geometry& patches) {
  to.bezier = true;
  const auto first = static_cast<std::uint32_t>(to.positions.size());
  to.positions.insert(to.positions.end(), patches.positions.begin(), patches.positions.end());
  to.texcoords.insert(to.texcoords.end(), patches.texcoords.begin(), patches.texcoords.end());
  to.colors.insert(to.colors.end(), patches.colors.begin(), patches.colors.end());
  for (const std::uint32_t index : patches.indices) to.indices.push_back(first + index);
}

void add_box(Geometry& g, Vec3 low, Vec3 high, unsigned faces, float scale, Vec3 light) {
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      if (!(faces >> (2 * axis + side) & 1u)) continue;
      // u x v points outwards.
      const int u = side ? (axis + 1) % 3 : (axis + 2) % 3, v = side ? (axis + 2) % 3 : (axis + 1) % 3;
      std::array<Corner, 4> corners;
      for (int k = 0; k < 4; ++k) {
        Vec3 p = side ? high : low;
        p[u] = k & 1 ? high[u] : low[u];
        p[v] = k & 2 ? high[v] : low[v];
        const Vec2 metres = axis == 0 ? Vec2(p.z, -p.y) : axis == 1 ? Vec2(p.x, p.z) : Vec2(p.x, -p.y);
        corners[static_cast<std::size_t>(k)] = {p, metres * scale, light};
      }
      add_patch(g, corners);
    }
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
