#pragma once

#include "tests/support/tests.h"
#include "tests/tilecore/support.h"
#include "tilecore/visibility/sample_pattern.h"
#include "tilecore/visibility/tile_frustum.h"
#include "tilecore/visibility/visibility_method.h"

namespace tessera::tilecore {

// Meshes for the visibility methods, without a scene: vertices on the sub-pixel grid, cells as the tessellator leaves
// them, samples of one tile.
struct MethodMesh {
  MicroMesh mesh;
  RayEffects effects;
  VisibilitySettings settings;
  std::shared_ptr<const SamplePattern> pattern;  // the samples refer to it
  TileSamples samples;
  float lens_radius = 0;
  int time_bits = 8;
  std::size_t leaf_columns = 1;

  static float on_grid(float x) { return std::round(x * 256.0f) / 256.0f; }

  void resize(std::size_t vertices) {
    mesh.resize_vertices(vertices + 64, true);
    mesh.vertex_count = vertices;
    std::fill(mesh.projected.begin(), mesh.projected.end(), std::uint8_t{1});
  }
  void place(std::size_t v, float x, float y, float z) {
    mesh.x0[v] = mesh.x1[v] = on_grid(x);
    mesh.y0[v] = mesh.y1[v] = on_grid(y);
    mesh.z0[v] = mesh.z1[v] = z;
  }
  void move(std::size_t v, float dx, float dy, float z1) {
    if (!effects.motion) return;
    mesh.x1[v] = on_grid(mesh.x0[v] + dx);
    mesh.y1[v] = on_grid(mesh.y0[v] + dy);
    mesh.z1[v] = z1;
  }
  // Cells of a grid of (columns + 1) x (rows + 1) vertices numbered row by row, in leaves of 4x4.
  void add_grid_cells(int columns, int rows) {
    leaf_columns = static_cast<std::size_t>((columns + 3) / 4);
    for (int lj = 0; lj < rows; lj += 4)
      for (int li = 0; li < columns; li += 4) {
        mesh.begin_leaf({lj * (columns + 1) + li, columns + 1, std::min(4, columns - li)});
        for (int j = lj; j < std::min(lj + 4, rows); ++j)
          for (int i = li; i < std::min(li + 4, columns); ++i) {
            const std::int32_t a = j * (columns + 1) + i;
            mesh.add_cell({a, a + 1, a + columns + 2, a + columns + 1},
                          static_cast<std::uint32_t>(2 * (j * columns + i)));
          }
      }
  }
  void add_grid_cells(int side) { add_grid_cells(side, side); }
  // One cell; c == d: one triangle.
  void add_only_cell(const std::array<std::int32_t, 4>& corners) {
    mesh.begin_leaf();
    mesh.add_cell(corners, 0);
  }
  void finish(const IntRect& tile, int spp) {
    build_cells(mesh, {effects.motion, effects.lens, settings.orthographic, settings.inverse_focus, lens_radius});
    pattern = std::make_shared<const SamplePattern>(SamplingSettings{spp, 1, 0, 8, time_bits});
    samples.fill(*pattern, tile, lens_radius, effects.lens);
  }
  MeshInTile in_tile() const { return {mesh, samples, {}, effects, settings, leaf_columns}; }

  // Calls visit for each cell that is not clipped.
  template <class Visit>
  void for_each_cell(const Visit& visit) const {
    for (std::size_t l = 0; l < mesh.leaves.size(); ++l)
      for (std::size_t c = l * kLeafCells; c < l * kLeafCells + mesh.leaves[l].cell_count; ++c)
        if (is_projected(mesh, c)) visit(c);
  }
};

struct MeshOptions {
  RayEffects effects;
  bool orthographic = false;
  bool cluster = false;       // cells without a grid, turning and folding
  float x = 0, y = 0, z = 2;  // where
  IntRect tile = {0, 0, 24, 16};
  int spp = 4;
  int time_bits = 8;
};

inline MethodMesh random_mesh(test::Random& random, const MeshOptions& o) {
  MethodMesh m;
  m.effects = o.effects;
  m.settings.orthographic = o.orthographic;
  m.settings.limits.near = 1e-3f * o.z;
  m.settings.inverse_focus = o.effects.lens ? random.uniform(0, 1.5f) / o.z : 0.0f;
  m.lens_radius = o.effects.lens ? random.uniform(0, 10) * (o.orthographic ? 1.0f : o.z) : 0.0f;
  const float speed = random.integer(0, 3) == 0 ? 0.3f : random.uniform(0, 60), size = random.coin() ? 1.2f : 5.0f;
  const float way_x = random.uniform(-speed, speed), way_y = random.uniform(-speed, speed),
              approach = std::exp(random.uniform(-1.5f, 1.5f));
  const float jitter = random.coin() ? 0.0f : 0.4f * speed;
  // The middle of the motion is over the tile.
  const float start_x = o.x + 12 - 0.5f * way_x, start_y = o.y + 8 - 0.5f * way_y;
  const int n = random.integer(3, 9);
  const auto move = [&](std::size_t v) {
    m.move(v, way_x + random.uniform(-jitter, jitter), way_y + random.uniform(-jitter, jitter),
           m.mesh.z0[v] * (jitter > 0 ? std::exp(random.uniform(-1.5f, 1.5f)) : approach));
  };
  if (o.cluster) {
    const std::size_t cells = 40;
    m.resize(4 * cells);
    for (std::size_t v = 0; v < 4 * cells; ++v) {
      m.place(v, start_x + random.uniform(-3 * size, 3 * size), start_y + random.uniform(-3 * size, 3 * size),
              o.z * random.uniform(0.5f, 1.5f));
      if (random.integer(0, 5) > 0) move(v);
    }
    for (std::int32_t c = 0; c < static_cast<std::int32_t>(cells); ++c) {
      if (c % static_cast<std::int32_t>(kLeafCells) == 0) m.mesh.begin_leaf();
      m.mesh.add_cell({4 * c, 4 * c + 1, 4 * c + 2, random.coin() ? 4 * c + 3 : 4 * c + 2},
                      static_cast<std::uint32_t>(2 * c));
    }
    m.leaf_columns = m.mesh.leaves.size();
  } else {
    m.resize(static_cast<std::size_t>((n + 1) * (n + 1)));
    const float middle = 0.5f * static_cast<float>(n);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i) {
        const auto v = static_cast<std::size_t>(j * (n + 1) + i);
        m.place(v, start_x + size * (static_cast<float>(i) - middle + random.uniform(-0.3f, 0.3f)),
                start_y + size * (static_cast<float>(j) - middle + random.uniform(-0.3f, 0.3f)),
                o.z * (1 + 0.2f * std::sin(static_cast<float>(i + 2 * j))));
        move(v);
      }
    m.add_grid_cells(n);
  }
  m.time_bits = o.time_bits;
  m.finish(o.tile, o.spp);
  return m;
}

// Every sample against every cell.
inline std::set<HitSet::Key> all_pairs(const MethodMesh& m) {
  HitSet sink;
  VisibilityWork work;
  std::vector<std::uint32_t> samples;
  all_samples(m.samples, m.samples.pixels, samples);
  m.for_each_cell([&](std::size_t cell) {
    test_cell_samples(m.mesh, cell, samples, m.samples, m.effects, m.settings, sink, work);
  });
  sink.flush();
  return sink.hits;
}

struct NamedMethod {
  const char* name;
  VisibilityMethodSettings settings;
};

// Hits that the default method finds: leaf by leaf, by classes of samples.
inline std::set<HitSet::Key> hits_by_class(const MethodMesh& m) {
  HitSet sink;
  VisibilityWork work;
  for (std::size_t l = 0; l < m.mesh.leaves.size(); ++l) {
    const TimeRange times = touching_times(m.mesh.leaves[l], m.samples.pixels, m.effects.motion, m.samples.lens_scale);
    if (!times.empty()) trace_leaf(m.mesh, l, m.samples, times, m.effects, m.settings, sink, work);
  }
  sink.flush();
  return sink.hits;
}

// Every method but the default, some with several settings.
inline std::vector<NamedMethod> methods_of_units() {
  using M = VisibilityMethod;
  return {{"brute", {M::kBrute}},
          {"segments", {M::kSegments}},
          {"one segment", {M::kSegments, 1}},
          {"seven segments", {M::kSegments, 7}},
          {"256 segments", {M::kSegments, 256}},
          {"partition", {M::kPartition}},
          {"clusters", {M::kClusters}},
          {"five segments of clusters", {M::kClusters, 5}},
          {"interleaved", {M::kInterleaved}},
          {"partition of clusters", {M::kClusterPartition}},
          {"rays from the root", {M::kPatchBvh, 0, Traversal::kRay, BranchNode::kRoot}},
          {"rays from the first fork", {M::kPatchBvh, 0, Traversal::kRay, BranchNode::kBothChildren}},
          {"rays from the leaf mask's node", {M::kPatchBvh, 0, Traversal::kRay, BranchNode::kLeafMask}}};
}

struct Found {
  std::set<HitSet::Key> hits;
  VisibilityWork work;
  StencilCounters stencil;
  RayCounters rays;
};

inline Found find(const MeshInTile& in, const VisibilityMethodSettings& method) {
  MeshVisibility visibility;
  HitSet sink;
  Found found;
  visibility.test(in, method, sink, found.work);
  sink.flush();
  found.hits = sink.hits;
  found.stencil = visibility.take_stencil_counters();
  found.rays = visibility.take_ray_counters();
  return found;
}

// With `by_class` false the samples do not belong to their pattern, and methods that go by classes are left out.
inline void expect_all_methods_find(const MethodMesh& m, const std::set<HitSet::Key>& expected, bool by_class = true) {
  if (by_class) {
    EXPECT_EQ(hits_by_class(m), expected);
  }
  for (const NamedMethod& method : methods_of_units()) {
    if (!by_class && method.settings.method == VisibilityMethod::kInterleaved) continue;  // goes by classes, too
    const Found found = find(m.in_tile(), method.settings);
    EXPECT_EQ(found.hits, expected) << method.name;
    EXPECT_EQ(found.work.sample_hits, expected.size()) << method.name;
    EXPECT_LE(found.stencil.hits, found.stencil.kept);
    EXPECT_EQ(found.rays.rays_hit, found.rays.rays_cast > 0 ? found.stencil.hits : 0u);
  }
}

}  // namespace tessera::tilecore
