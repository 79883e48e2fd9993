#pragma once

#include "scene/subpixel.h"
#include "tests/frontend/bound_scenes.h"
#include "tests/support/tests.h"

namespace tessera::frontend {

// Points of a scene against the bounds of the sub-patches that they lie in.

enum class BoundTwin { kHonest, kNoDisplacement, kNoForeignVertices, kNoMotion, kShrunk };

struct BoundOutcome {
  std::int64_t points = 0, violations = 0;
  void add(bool held) {
    ++points;
    violations += held ? 0 : 1;
  }
};

// Body of a bound that makes a typical mistake.
inline SubPatchBody twin_body(BoundTwin twin, SubPatchBounder& bounder, const scene::CellRange& cells) {
  SubPatchBody body = bounder.body(cells);
  const auto& to_raster = bounder.drawable().to_raster;
  if (twin == BoundTwin::kNoMotion)
    for (std::size_t k = 0; k < 8; ++k) body.corners[8 + k] = body.corners[k];
  if (twin == BoundTwin::kShrunk)  // by a fiftieth, towards its middle
    for (const std::size_t first : {std::size_t{0}, std::size_t{8}}) {
      DVec4 middle(0.0);
      for (std::size_t k = 0; k < 8; ++k) middle += body.corners[first + k] * 0.125;
      for (std::size_t k = 0; k < 8; ++k) body.corners[first + k] = middle + (body.corners[first + k] - middle) * 0.98;
    }
  if (twin != BoundTwin::kNoDisplacement && twin != BoundTwin::kNoForeignVertices) return body;
  const CornerFrame frame = corner_frame(bounder.nets());
  MovingBox box = empty_box(frame.axes);
  for (std::size_t key = 0; key < 2; ++key) {
    const PatchNet& net = bounder.nets()[std::min(key, bounder.nets().size() - 1)];
    const Extents e = measure_extents(net, frame.axes);
    NormalRange normals;
    const NetMeasure m = measure_net(net, frame.axes, frame.tangent_u, frame.tangent_v);
    if (const auto cones = tangent_cones(m, frame)) normals = normal_range(tpatch_cone(*cones, {0, 1, 1}));
    const double reach = twin == BoundTwin::kNoDisplacement ? 0 : 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto [low, high] = std::minmax({static_cast<double>(bounder.offsets().low) * normals.low[axis],
                                            static_cast<double>(bounder.offsets().low) * normals.high[axis],
                                            static_cast<double>(bounder.offsets().high) * normals.low[axis],
                                            static_cast<double>(bounder.offsets().high) * normals.high[axis]});
      box.low[key][axis] = e.low[axis] + reach * low;
      box.high[key][axis] = e.high[axis] + reach * high;
    }
  }
  return {box_corners(box, to_raster),
          vertex_rounding_margin(box, bounder.largest_coordinate(), to_raster, static_cast<double>(scene::kSubpixels))};
}

// Checks random cell ranges of a scene at random times and lens points: points of the surface in double precision,
// and the vertices that the machine computes, also where another patch evaluates them.
inline BoundOutcome check_scene(const Scene& scene, test::Random& random, BoundMethod method, BoundTwin twin,
                                int ranges) {
  BoundOutcome outcome;
  const scene::FrameGeometry& frame = *scene.frame;
  SubPatchBounder bounder(frame, *scene.pyramids, method);
  const auto add = [&](const std::optional<ScreenBounds>& bounds, const DVec4& open, const DVec4& close, int times) {
    for (int s = 0; s < times; ++s) {
      const double t = s < 2 ? s : static_cast<double>(random.uniform(0, 1));
      const double angle = static_cast<double>(random.uniform(0, 6.2831f)),
                   radius = s < 4 ? 1.0 : static_cast<double>(random.uniform(0, 1));
      const SampledPoint seen =
          see(open * (1 - t) + close * t, frame.projection, radius * std::cos(angle), radius * std::sin(angle));
      if (seen.drawn) outcome.add(bounds && inside(*bounds, seen));
    }
  };
  for (std::uint32_t patch = 0; patch < frame.assembly->patch_count(); ++patch) {
    bounder.begin(patch);
    const scene::PosedDrawable& drawable = frame.drawable_of(patch);
    const scene::TessellationPattern& pattern = frame.pattern_of(patch);
    const scene::PatchNeighbours& neighbours = frame.assembly->neighbours[0][patch];
    for (int trial = 0; trial < ranges; ++trial) {
      scene::CellRange cells;
      cells.i0 = static_cast<std::uint8_t>(random.coin() ? 0 : random.integer(0, pattern.nu - 1));
      cells.j0 = static_cast<std::uint8_t>(random.coin() ? 0 : random.integer(0, pattern.nv - 1));
      cells.i1 = static_cast<std::uint8_t>(std::min<int>(pattern.nu, cells.i0 + random.integer(1, 16)));
      cells.j1 = static_cast<std::uint8_t>(std::min<int>(pattern.nv, cells.j0 + random.integer(1, 16)));
      const SubPatchBody body =
          twin == BoundTwin::kHonest ? bounder.body(cells) : (bounder.body(cells), twin_body(twin, bounder, cells));
      const auto bounds = screen_bounds(body.corners, frame.projection, body.margin);
      // Points of the surface lie in this patch's own part; beyond it there are only vertices of other patches.
      const scene::ParameterRange& range = bounder.inner_range();
      for (int k = 0; k < 30; ++k) {
        const float u = k < 4 ? (k & 1 ? range.u1 : range.u0) : random.uniform(range.u0, range.u1);
        const float v = k < 4 ? (k & 2 ? range.v1 : range.v0) : random.uniform(range.v0, range.v1);
        add(bounds, displaced_point(frame, patch, u, v, 0), displaced_point(frame, patch, u, v, 1), 8);
      }
      for (int k = 0; k < 24; ++k) {
        // Vertices, most of them on the boundary of the cells.
        int i = random.integer(cells.i0, cells.i1), j = random.integer(cells.j0, cells.j1);
        if (k % 3 == 0) i = random.coin() ? cells.i0 : cells.i1;
        if (k % 3 == 1) j = random.coin() ? cells.j0 : cells.j1;
        scene::OwnedVertex vertex{patch, pattern.u(i, j), pattern.v(i, j)};
        if (i == 0 || j == 0 || i == pattern.nu || j == pattern.nv) vertex = boundary_vertex(pattern, neighbours, i, j);
        std::array<DVec4, 2> r;
        for (std::size_t key = 0; key < 2; ++key)
          r[key] = DVec4(drawable.to_raster[key] *
                         Vec4(domain_point(frame, drawable, vertex.patch, vertex.u, vertex.v, key), 1.0f));
        add(bounds, r[0], r[1], 8);
      }
    }
  }
  return outcome;
}

}  // namespace tessera::frontend
