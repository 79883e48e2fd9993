#include "captures/sources/plants.h"

#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "captures/sources/outdoors.h"
#include "captures/sources/patterns.h"
#include "captures/sources/surfaces.h"

namespace tessera::captures {
namespace {

constexpr float kFullTurn = 6.2831853f;

float chance(std::uint32_t seed, std::uint32_t number, std::uint32_t which) {
  return static_cast<float>(hash32(seed, number, which) >> 8) * 0x1p-24f;
}

Vec3 any_direction(std::uint32_t seed, std::uint32_t number, std::uint32_t which) {
  const float y = 2.0f * chance(seed, number, which) - 1.0f, around = kFullTurn * chance(seed, number, which + 1);
  const float r = std::sqrt(std::max(0.0f, 1.0f - y * y));
  return {r * std::cos(around), y, r * std::sin(around)};
}

struct LeafShape {
  Vec2 at;
  float angle, length, width;  // relative to the stem's direction
};

std::vector<LeafShape> sprig_leaves(int tile) {
  std::vector<LeafShape> leaves;
  const auto pairs = [&](int count, float from, float to, float angle, float length, float width) {
    for (int k = 0; k < count; ++k) {
      const float t = static_cast<float>(k) / static_cast<float>(count), y = from + (to - from) * t;
      for (const float side : {-1.0f, 1.0f})
        leaves.push_back(
            {{0.0f, y + 0.02f * side}, side * angle * (1.0f - 0.25f * t), length * (1.0f - 0.25f * t), width});
    }
    leaves.push_back({{0.0f, to - 0.02f}, 0.05f, 0.97f - to, width});
  };
  if (tile == 0) pairs(4, 0.12f, 0.70f, 0.95f, 0.46f, 0.105f);
  if (tile == 1) pairs(3, 0.10f, 0.62f, 0.80f, 0.52f, 0.145f);
  if (tile == 2) pairs(6, 0.06f, 0.80f, 1.05f, 0.34f, 0.070f);
  if (tile == 3) pairs(2, 0.16f, 0.52f, 0.85f, 0.55f, 0.190f);
  return leaves;
}

// Sway of plants in the wind: displacement of the tip of plant `number` by each morph target.
std::array<Vec3, 2> sway(std::uint32_t seed, std::uint32_t number, float reach) {
  const float around = kFullTurn * chance(seed, number, 41), far = reach * (0.5f + chance(seed, number, 42));
  const Vec3 wind(far, -0.15f * far, 0.25f * far * std::sin(around));
  return {wind, Vec3(std::cos(around), 0.0f, std::sin(around)) * (0.6f * far)};
}

// Moves control points [first, end) by `tips` times (height of the rest pose over the ground / height) squared.
void add_sway(Geometry& g, std::size_t first, const std::array<Vec3, 2>& tips, float height) {
  g.morphs.resize(2);
  for (std::size_t k = first; k < g.positions.size(); ++k) {
    const float t = std::min(1.2f, std::max(0.0f, g.positions[k].y / height));
    for (std::size_t m = 0; m < 2; ++m) g.morphs[m].push_back(glm::round(tips[m] * (t * t) * 2048.0f) / 2048.0f);
  }
}

// A narrow bent patch from `root` to `tip`; `out` is its direction at the root.
void add_ribbon(Geometry& g, Vec3 root, Vec3 out, Vec3 tip, Vec3 across, float width, float pointed, Vec3 low,
                Vec3 high) {
  std::array<Vec3, 16> points;
  const Vec3 path[4] = {root, root + out, tip - (tip - root - out) * 0.4f, tip};
  const float widths[4] = {1.0f, 1.0f, 0.5f + 0.5f * pointed, pointed};
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 4; ++i)
      points[4 * j + i] = path[j] + across * (width * widths[j] * (static_cast<float>(i) / 3.0f - 0.5f));
  add_patch(g, points, {{{{}, {0, 1}, low}, {{}, {1, 1}, low}, {{}, {0, 0}, high}, {{}, {1, 0}, high}}}, false);
}

// Petals around the top of a stem and the disc in their middle.
void add_blossom(Geometry& g, const Species& s, Vec3 at, Vec3 up, float turn, float fade) {
  const Vec3 side = glm::normalize(glm::cross(up, Vec3(0.3f, 0.1f, 1.0f))), front = glm::cross(side, up);
  const float reach = s.radius,
              width = 2.3f * s.radius * std::sin(kFullTurn / 2 / static_cast<float>(s.petals)) + 0.01f;
  for (int k = 0; k < s.petals; ++k) {
    const float around = turn + kFullTurn * static_cast<float>(k) / static_cast<float>(s.petals);
    const Vec3 out = side * std::cos(around) + front * std::sin(around), across = glm::cross(up, out);
    std::array<Vec3, 16> points;
    const float along[4] = {0.12f, 0.45f, 0.9f, 1.0f}, wide[4] = {0.25f, 1.0f, 1.15f, 0.55f},
                rise[4] = {0.0f, 0.35f * s.cup, 0.9f * s.cup, s.cup - 0.12f};
    for (std::size_t j = 0; j < 4; ++j)
      for (std::size_t i = 0; i < 4; ++i) {
        const float x = static_cast<float>(i) / 3.0f - 0.5f, hollow = 0.5f * x * x * s.cup;
        points[4 * j + i] = at + out * (reach * along[j]) + across * (width * wide[j] * x) +
                            up * (reach * (rise[j] + hollow) + 0.002f * static_cast<float>(k & 1));
      }
    const Vec3 inner = s.petal * (0.55f * fade), outer = s.petal * fade;
    add_patch(g, points, {{{{}, {0, 1}, inner}, {{}, {1, 1}, inner}, {{}, {0, 0}, outer}, {{}, {1, 0}, outer}}}, false);
  }
  std::array<Vec3, 16> disc;
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 4; ++i) {
      const Vec2 p = Vec2(static_cast<float>(i), static_cast<float>(j)) / 1.5f - 1.0f;
      const bool corner = std::abs(p.x) > 0.9f && std::abs(p.y) > 0.9f,
                 inner = std::abs(p.x) < 0.5f && std::abs(p.y) < 0.5f;
      const Vec2 round = p * (corner ? 0.72f : 1.0f);
      disc[4 * j + i] =
          at + (side * round.x + front * -round.y) * (0.30f * reach) + up * (reach * (inner ? 0.35f : 0.03f));
    }
  const Vec3 color = s.middle * fade;
  add_patch(g, disc, {{{{}, {0, 1}, color}, {{}, {1, 1}, color}, {{}, {0, 0}, color}, {{}, {1, 0}, color}}}, false);
}

}  // namespace

Image8 sprig_atlas(Vec3 dark, Vec3 light) {
  constexpr int kSide = 256;
  Image8 out(kSide, kSide, 4);
  std::vector<std::vector<LeafShape>> tiles;
  for (int tile = 0; tile < 4; ++tile) tiles.push_back(sprig_leaves(tile));
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const int tile = x / (kSide / 2) + 2 * (y / (kSide / 2));
      const Vec2 p((static_cast<float>(x % (kSide / 2)) + 0.5f) / (kSide / 2) - 0.5f,
                   1.0f - (static_cast<float>(y % (kSide / 2)) + 0.5f) / (kSide / 2));
      // The stem, then leaves over it; later leaves lie above.
      float inside = p.y < 0.8f ? 0.012f - std::abs(p.x) : -1.0f;
      Vec3 color = dark * 0.8f;
      std::uint32_t number = 0;
      for (const LeafShape& leaf : tiles[static_cast<std::size_t>(tile)]) {
        const Vec2 d = p - leaf.at;
        const float s = std::sin(leaf.angle), c = std::cos(leaf.angle);
        const float a = (d.x * s + d.y * c) / leaf.length, b = d.x * c - d.y * s;
        ++number;
        if (a <= 0.0f || a >= 1.0f) continue;
        const float depth = leaf.width * std::sin(0.5f * kFullTurn * std::pow(a, 0.8f)) - std::abs(b);
        if (depth < -0.01f || (depth < 0.0f && inside > depth)) continue;
        const float vein = smooth_step(0.012f, 0.0f, std::abs(b)) +
                           0.4f * smooth_step(0.2f, 0.0f, std::abs(std::sin(40.0f * (a - std::abs(b) * 2.5f))));
        const float tone = chance(5, number, static_cast<std::uint32_t>(tile));
        inside = depth;
        color = mix(dark, light, 0.25f + 0.55f * tone + 0.2f * a) * (1.0f + 0.12f * vein) * (b > 0 ? 1.0f : 0.9f);
      }
      const auto texel = out.at(x, y);
      for (int k = 0; k < 3; ++k)
        texel[static_cast<std::size_t>(k)] =
            static_cast<std::uint8_t>(std::clamp(color[k] * 255.0f, 0.0f, 255.0f) / 4.0f) * 4;
      texel[3] = static_cast<std::uint8_t>(std::clamp(0.5f + inside * 110.0f, 0.0f, 1.0f) * 15.0f + 0.5f) * 17;
    }
  return out;
}

void add_sprig(Geometry& g, const Sprig& s) {
  std::array<Vec3, 16> points;
  const Vec3 normal = glm::cross(s.across, s.along);
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 4; ++i) {
      const float t = static_cast<float>(j) / 3.0f, x = static_cast<float>(i) / 3.0f - 0.5f;
      points[4 * j + i] = s.at + s.along * (s.length * t) + s.across * (s.width * x) +
                          normal * (s.bend * s.length * (t * t * -0.6f + (0.25f - x * x)));
    }
  const Vec2 low = Vec2(static_cast<float>(s.tile & 1), static_cast<float>(s.tile >> 1)) * 0.5f + 0.003f,
             high = low + 0.494f;
  const Vec3 base = s.light * 0.75f;
  add_patch(g, points,
            {{{{}, {low.x, high.y}, base}, {{}, high, base}, {{}, low, s.light}, {{}, {high.x, low.y}, s.light}}},
            false);
}

Geometry crown(const Crown& c) {
  Geometry g;
  const Vec3 sun = glm::normalize(kToSun);
  for (int k = 0; k < c.count; ++k) {
    const auto n = static_cast<std::uint32_t>(k);
    const Vec3 from = any_direction(c.seed, n, 1);
    const float lump = 0.78f + 0.3f * noise(from.x * 0.5f + 0.5f, from.y * 0.5f + from.z * 0.31f + 0.5f, 5, 2, c.seed);
    const float r = std::cbrt(0.12f + 0.88f * chance(c.seed, n, 3)) * lump;
    const Vec3 along = glm::normalize(from + any_direction(c.seed, n, 4) * 0.75f + Vec3(0, 0.15f, 0));
    const Vec3 across = glm::normalize(glm::cross(along, any_direction(c.seed, n, 6) + along * 0.01f));
    const float size = c.size * (0.75f + 0.5f * chance(c.seed, n, 8));
    const float light =
        c.shaded ? (0.42f + 0.58f * smooth_step(0.45f, 1.0f, r)) * (0.78f + 0.22f * glm::dot(from, sun)) : 0.92f;
    const float warm = chance(c.seed, n, 9);
    add_sprig(g, {from * c.radii * r, along, across, size, size * 0.9f, 0.5f * chance(c.seed, n, 10) - 0.1f,
                  static_cast<int>(hash32(c.seed, n, 11) % 4),
                  Vec3(0.92f + 0.16f * warm, 1.0f, 1.0f - 0.25f * warm) * light});
    if (c.joints < 2) continue;
    const auto joint = static_cast<std::uint16_t>(1 + hash32(c.seed, n, 12) % static_cast<std::uint32_t>(c.joints - 1));
    for (int p = 0; p < 16; ++p) {
      const float weight = 0.4f + 0.2f * static_cast<float>(p / 4);
      g.joints.push_back({joint, 0, 0, 0});
      g.weights.emplace_back(weight, 1.0f - weight, 0.0f, 0.0f);
    }
  }
  return g;
}

void add_tube(Geometry& g, const std::array<Vec3, 4>& path, float thick, float thin, float turns) {
  constexpr float kCircle = 0.5522847498f;
  static constexpr float kCos[5] = {1, 0, -1, 0, 1}, kSin[5] = {0, 1, 0, -1, 0};
  const Vec3 axis = glm::normalize(path[3] - path[0]);
  const Vec3 x = glm::normalize(glm::cross(axis, std::abs(axis.z) < 0.9f ? Vec3(0, 0, 1) : Vec3(1, 0, 0))),
             y = glm::cross(axis, x);
  for (std::size_t quarter = 0; quarter < 4; ++quarter) {
    const Vec2 a(kCos[quarter], kSin[quarter]), b(kCos[quarter + 1], kSin[quarter + 1]);
    const std::array<Vec2, 4> arc = {a, a + b * kCircle, b + a * kCircle, b};
    std::array<Vec3, 16> points;
    for (std::size_t j = 0; j < 4; ++j)
      for (std::size_t i = 0; i < 4; ++i) {
        const float r = thick + (thin - thick) * static_cast<float>(j) / 3.0f;
        points[4 * j + i] = path[j] + (x * arc[i].x + y * arc[i].y) * r;
      }
    const float u0 = static_cast<float>(quarter) / 4.0f, u1 = u0 + 0.25f;
    add_patch(g, points, {{{{}, {u0, 0}, Vec3(0.8f)}, {{}, {u1, 0}, Vec3(0.8f)}, {{}, {u0, turns}}, {{}, {u1, turns}}}},
              true);
  }
}

Geometry flowers(const Species& s, int count) {
  Geometry g;
  for (int k = 0; k < count; ++k) {
    const auto n = static_cast<std::uint32_t>(k);
    const std::size_t first = g.positions.size();
    const float around = kFullTurn * (static_cast<float>(k) / static_cast<float>(count) + 0.3f * chance(s.seed, n, 1)),
                away = 0.05f + 0.15f * chance(s.seed, n, 2), height = s.height * (0.72f + 0.5f * chance(s.seed, n, 3));
    const Vec3 out(std::cos(around), 0, std::sin(around)), root = out * (0.3f * away),
                                                           tip = out * away + Vec3(0, height, 0);
    const Vec3 green(0.05f, 0.13f, 0.03f);
    add_ribbon(g, root, Vec3(0, 0.5f * height, 0), tip, glm::normalize(Vec3(out.z, 0, -out.x) + Vec3(0.4f, 0, 0.3f)),
               0.011f, 0.7f, green * 0.5f, green);
    const Vec3 up = glm::normalize(out * 0.55f + Vec3(0, 1, 0.35f));
    add_blossom(g, s, tip, up, around * 3.0f, 0.75f + 0.25f * chance(s.seed, n, 5));
    add_sway(g, first, sway(s.seed, n, 0.2f * s.height), s.height);
  }
  return g;
}

Geometry grass(int count, float radius, float height, std::uint32_t seed) {
  Geometry g;
  for (int k = 0; k < count; ++k) {
    const auto n = static_cast<std::uint32_t>(k);
    const std::size_t first = g.positions.size();
    const float around = kFullTurn * chance(seed, n, 1), away = radius * std::sqrt(chance(seed, n, 2)),
                tall = height * (0.55f + 0.75f * chance(seed, n, 3)), way = kFullTurn * chance(seed, n, 4);
    const Vec3 root(away * std::cos(around), 0, away * std::sin(around)), lean(std::cos(way), 0, std::sin(way));
    const float tone = 0.6f + 0.5f * chance(seed, n, 5);
    const Vec3 green(0.16f * tone, 0.26f * tone, 0.045f);
    add_ribbon(g, root, Vec3(0, 0.6f * tall, 0), root + Vec3(0, tall, 0) + lean * (0.45f * tall),
               Vec3(-lean.z, 0, lean.x), 0.011f, 0.08f, green * 0.4f, green);
    add_sway(g, first, sway(seed, n, 0.5f * height), height);
  }
  return g;
}

}  // namespace tessera::captures
