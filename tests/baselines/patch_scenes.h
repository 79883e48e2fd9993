#pragma once

#include "baselines/triangle_setup.h"
#include "tests/support/tests.h"

// Patches as a domain shader leaves them, and their triangles as sets, for comparison with decoded triangles.
namespace tessera::test {

using baselines::BaselineCounters;
using baselines::TessellatedPatch;
using baselines::TriangleList;

inline constexpr int kWidth = 200, kHeight = 150;

inline float on_grid(float v) { return std::round(v * 256.0f) / 256.0f; }

inline scene::Projection projection(double lens_scale) {
  scene::Projection p;
  p.near = 0.5;
  p.lens_scale = lens_scale;
  p.inverse_focus = lens_scale > 0 ? 0.25 : 0.0;
  return p;
}

struct Scatter {
  int triangles = 40;
  bool moving = false, two_sided = true;
  float size = 30;
};

inline TessellatedPatch scattered(const Scatter& s, Random& random) {
  TessellatedPatch patch;
  patch.moving = s.moving;
  patch.keep_positive = s.two_sided;
  for (int t = 0; t < s.triangles; ++t) {
    const float x = random.uniform(-40, kWidth + 40), y = random.uniform(-40, kHeight + 40);
    const float dx = random.uniform(-60, 60), dy = random.uniform(-60, 60);
    for (int k = 0; k < 3; ++k) {
      const float px = on_grid(x + random.uniform(-s.size, s.size)), py = on_grid(y + random.uniform(-s.size, s.size));
      patch.x0.push_back(px), patch.y0.push_back(py), patch.z0.push_back(random.uniform(1, 8));
      if (s.moving) {
        patch.x1.push_back(on_grid(px + dx + random.uniform(-5, 5))),
            patch.y1.push_back(on_grid(py + dy + random.uniform(-5, 5)));
        patch.z1.push_back(random.uniform(1, 8));
      }
      patch.projected.push_back(1);
    }
    const auto first = static_cast<std::uint32_t>(3 * t);
    patch.triangles.push_back({first, first + 1, first + 2});
    if (t % 30 == 29 && t + 1 < s.triangles)
      patch.group_ends.push_back(static_cast<std::uint32_t>(t + 1));
    else if (t % 20 == 19)
      patch.group_ends.push_back(static_cast<std::uint32_t>(t + 1));
  }
  if (patch.group_ends.empty() || patch.group_ends.back() != patch.triangles.size())
    patch.group_ends.push_back(static_cast<std::uint32_t>(s.triangles));
  return patch;
}

inline std::set<binner::TileIndex> tiles_of(const TriangleList& list, std::size_t triangle) {
  const std::uint32_t first = triangle == 0 ? 0 : list.triangles[triangle - 1].tiles_end;
  return {list.tiles.begin() + first, list.tiles.begin() + list.triangles[triangle].tiles_end};
}

using Position = std::array<float, 6>;  // at both motion keys; a still one has zeros at the second
using Triangle = std::array<Position, 3>;

inline Triangle turned(const Triangle& t) {
  return std::min({t, Triangle{t[1], t[2], t[0]}, Triangle{t[2], t[0], t[1]}});
}

inline Triangle triangle_of(const TessellatedPatch& patch, const std::array<std::uint32_t, 3>& vertex) {
  Triangle t{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t v = vertex[k];
    t[k] = {patch.x0[v], patch.y0[v], patch.z0[v], 0, 0, 0};
    if (patch.moving) t[k][3] = patch.x1[v], t[k][4] = patch.y1[v], t[k][5] = patch.z1[v];
  }
  return turned(t);
}

// A flat grid of n x n cells over a square, in groups of 7x7 cells as replays make them.
inline TessellatedPatch flat_grid(int n, float x0, float y0, float side) {
  TessellatedPatch patch;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      patch.x0.push_back(on_grid(x0 + side * static_cast<float>(i) / static_cast<float>(n)));
      patch.y0.push_back(on_grid(y0 + side * static_cast<float>(j) / static_cast<float>(n)));
      patch.z0.push_back(2);
      patch.projected.push_back(1);
    }
  for (int gj = 0; gj < n; gj += 7)
    for (int gi = 0; gi < n; gi += 7) {
      for (int j = gj; j < std::min(gj + 7, n); ++j)
        for (int i = gi; i < std::min(gi + 7, n); ++i) {
          const auto a = static_cast<std::uint32_t>(j * (n + 1) + i), b = a + 1,
                     d = a + static_cast<std::uint32_t>(n) + 1, c = d + 1;
          patch.triangles.push_back({a, c, d});
          patch.triangles.push_back({a, b, c});
        }
      patch.group_ends.push_back(static_cast<std::uint32_t>(patch.triangles.size()));
      patch.group_columns.push_back(static_cast<std::uint8_t>(std::min(gi + 7, n) - gi));
    }
  patch.domain_evaluations = patch.x0.size();
  patch.patch_bytes = 192;
  return patch;
}

inline std::vector<TessellatedPatch> mixed_scene(std::uint32_t seed) {
  Random random(seed);
  std::vector<TessellatedPatch> scene = {flat_grid(20, 5, 5, 120), flat_grid(3, 60, 20, 70),
                                         scattered({40, false, true, 20}, random),
                                         scattered({40, true, false, 8}, random), flat_grid(1, 10, 90, 30)};
  // A moving grid, partly outside of the view.
  scene.push_back(flat_grid(9, 150, 60, 80));
  TessellatedPatch& moving = scene.back();
  moving.moving = true;
  for (std::size_t v = 0; v < moving.x0.size(); ++v) {
    moving.x1.push_back(moving.x0[v] + 7.25f), moving.y1.push_back(moving.y0[v] - 3.5f);
    moving.z1.push_back(2.5f);
  }
  for (std::size_t p = 0; p < scene.size(); ++p) {
    scene[p].state = static_cast<std::uint32_t>(p == 3 || p == 5 ? 1 : 0);
    scene[p].number = static_cast<std::uint32_t>(100 * p);
    for (float& z : scene[p].z0) z += random.uniform(0, 0.01f);
  }
  return scene;
}

// An indexed mesh of n x n cells over a square, cut into clusters of 6x6 cells: patches of one draw that share the
// vertices on their edges.
inline std::vector<TessellatedPatch> indexed_mesh(int n, float x0, float y0, float side, std::uint32_t state,
                                                  bool moving) {
  constexpr int kCells = 6;
  std::vector<TessellatedPatch> clusters;
  for (int gj = 0; gj < n; gj += kCells)
    for (int gi = 0; gi < n; gi += kCells) {
      TessellatedPatch& patch = clusters.emplace_back();
      patch.number = 1000 * state + static_cast<std::uint32_t>(clusters.size());
      patch.state = state;
      patch.moving = moving;
      const int wide = std::min(kCells, n - gi), high = std::min(kCells, n - gj);
      for (int j = gj; j <= gj + high; ++j)
        for (int i = gi; i <= gi + wide; ++i) {
          patch.draw_numbers.push_back(static_cast<std::uint32_t>(j * (n + 1) + i));
          const float u = static_cast<float>(i) / static_cast<float>(n),
                      v = static_cast<float>(j) / static_cast<float>(n);
          patch.x0.push_back(x0 + side * u), patch.y0.push_back(y0 + side * v), patch.z0.push_back(2 + u * v);
          if (moving)
            patch.x1.push_back(patch.x0.back() + 7.25f), patch.y1.push_back(patch.y0.back() - 3.5f),
                patch.z1.push_back(2.5f + u);
          patch.projected.push_back(1);
        }
      for (int j = 0; j < high; ++j)
        for (int i = 0; i < wide; ++i) {
          const auto a = static_cast<std::uint32_t>(j * (wide + 1) + i), b = a + 1,
                     d = a + static_cast<std::uint32_t>(wide) + 1, c = d + 1;
          patch.triangles.push_back({a, c, d});
          patch.triangles.push_back({a, b, c});
        }
      patch.group_ends = {static_cast<std::uint32_t>(patch.triangles.size())};
      patch.domain_evaluations = patch.x0.size();
    }
  return clusters;
}

struct Binned {
  BaselineCounters setup;
  std::map<binner::TileIndex, std::set<std::array<std::uint64_t, 2>>>
      vertices;  // patches and vertices that a tile needs
  std::map<binner::TileIndex, std::multiset<Triangle>> expected;
  // Vertices of triangles in view, each once for its draw: by state and number in it, or by patch and vertex.
  std::set<std::array<std::uint64_t, 3>> draw_vertices;
};

// Sets up every patch and calls `add` with it; returns the expected contents of tiles.
template <class Add>
Binned bin(const baselines::TriangleSetup& setup, const std::vector<TessellatedPatch>& scene, const Add& add) {
  Binned out;
  for (const TessellatedPatch& patch : scene) {
    const TriangleList list = setup.run(patch, out.setup);
    for (const TriangleList::Triangle& t : list.triangles)
      for (const std::uint32_t v : t.vertex)
        out.draw_vertices.insert(patch.draw_numbers.empty()
                                     ? std::array<std::uint64_t, 3>{0, patch.number, v}
                                     : std::array<std::uint64_t, 3>{1, patch.state, patch.draw_numbers[v]});
    for (std::size_t t = 0; t < list.triangles.size(); ++t)
      for (const binner::TileIndex tile : tiles_of(list, t)) {
        out.expected[tile].insert(triangle_of(patch, list.triangles[t].vertex));
        for (const std::uint32_t v : list.triangles[t].vertex) out.vertices[tile].insert({patch.number, v});
      }
    add(patch, list);
  }
  return out;
}

}  // namespace tessera::test
