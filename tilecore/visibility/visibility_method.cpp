#include "tilecore/visibility/visibility_method.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "base/check.h"

namespace tessera::tilecore {
namespace {

// Side of the rectangles that have their own frustum: 4x4 pixels, as published.
constexpr int kBundleSide = 4;

std::size_t append_pieces(const PrimitiveBound& bound, const MeshInTile& in, const VisibilityMethodSettings& method,
                          std::vector<BoundingPiece>& out) {
  const IntRect& tile = in.samples.pixels;
  switch (method.method) {
    case VisibilityMethod::kPartition:
    case VisibilityMethod::kClusterPartition:
      return partition_pieces(bound, tile, in.times, out);
    case VisibilityMethod::kInterleaved:
      return interleaved_pieces(bound, tile, in.times, *in.samples.classes, out);
    case VisibilityMethod::kSegments:
    case VisibilityMethod::kClusters:
      return segment_pieces(bound, tile, in.times,
                            method.stencil_segments > 0 ? method.stencil_segments : segments_for(bound), out);
    case VisibilityMethod::kPatchBvh:
    case VisibilityMethod::kBrute:
      break;
  }
  return whole_motion_piece(bound, tile, in.times, out);
}

}  // namespace

void MeshVisibility::DistinctSamples::take(std::span<const Hit> hits) {
  for (const Hit& hit : hits) {
    distinct_ += last_round_[hit.sample] != round_ ? 1 : 0;
    last_round_[hit.sample] = round_;
  }
  next_.take(hits);
}

std::uint64_t MeshVisibility::DistinctSamples::end_round() {
  flush();
  ++round_;
  return std::exchange(distinct_, 0);
}

void MeshVisibility::test(const MeshInTile& in, const VisibilityMethodSettings& method, HitSink& sink,
                          VisibilityWork& work) {
  TESSERA_CHECK(!method.by_class(), "classes have kernels of their own");
  if (last_round_.size() < in.samples.count)
    last_round_.resize(in.samples.count, std::numeric_limits<std::uint64_t>::max());
  // The inside test finds hidden hits, too, because the units count all samples that are inside.
  inside_settings_ = in.settings;
  inside_settings_.depth = nullptr;
  DistinctSamples distinct(sink, last_round_, round_);
  if (method.method == VisibilityMethod::kPatchBvh)
    test_rays(in, method, distinct, work);
  else
    test_polygons(in, method, distinct, work);
}

// ---- Bounding polygons ------------------------------------------------------------------------------------------

void MeshVisibility::test_polygons(const MeshInTile& in, const VisibilityMethodSettings& method, DistinctSamples& sink,
                                   VisibilityWork& work) {
  const MicroMesh& mesh = in.mesh;
  PrimitiveBound bound(mesh, in.effects, in.settings, static_cast<double>(in.samples.lens_scale));
  const bool clusters =
      method.method == VisibilityMethod::kClusters || method.method == VisibilityMethod::kClusterPartition;
  const std::size_t cells_per_polygon = clusters ? kLeafCells : 1;
  for (std::size_t l = 0; l < mesh.leaves.size(); ++l) {
    const std::size_t end = l * kLeafCells + mesh.leaves[l].cell_count;
    for (std::size_t first = l * kLeafCells; first < end; first += cells_per_polygon) {
      bound.clear();
      cells_.clear();
      for (std::size_t cell = first; cell < std::min(first + cells_per_polygon, end); ++cell) {
        if (!is_projected(mesh, cell)) continue;
        bound.add_cell(cell);
        cells_.push_back(static_cast<std::uint32_t>(cell));
      }
      if (cells_.empty()) continue;
      ++work.boxes_built;
      pieces_.clear();
      const std::uint64_t tests = append_pieces(bound, in, method, pieces_);
      work.box_tests += tests, work.box_lanes += tests;
      for (const BoundingPiece& piece : pieces_) {
        // Without a stencil test where nothing would fail it: brute force runs no stencil unit.
        const bool all_times = piece.references.whole_shutter() && in.samples.part.whole(),
                   stencil = method.method != VisibilityMethod::kBrute || !all_times;
        if (stencil)
          stencil_.keep(in.samples, piece.pixels, piece.references, kept_);
        else
          all_samples(in.samples, piece.pixels, kept_);
        if (kept_.empty()) continue;
        for (const std::uint32_t cell : cells_)
          test_cell_samples(mesh, cell, kept_, in.samples, in.effects, inside_settings_, sink, work);
        const std::uint64_t hits = sink.end_round();
        if (stencil) stencil_.record_hits(hits);
      }
    }
  }
}

// ---- Rays -------------------------------------------------------------------------------------------------------

void MeshVisibility::test_rays(const MeshInTile& in, const VisibilityMethodSettings& method, DistinctSamples& sink,
                               VisibilityWork& work) {
  const IntRect& tile = in.samples.pixels;
  const RaySpace space{0.5 * (tile.x0 + tile.x1),
                       0.5 * (tile.y0 + tile.y1),
                       in.settings.orthographic,
                       in.effects.motion,
                       static_cast<double>(in.settings.inverse_focus),
                       in.effects.lens ? static_cast<double>(in.samples.lens_scale) : 0.0,
                       in.effects.lens
                           ? static_cast<double>(in.settings.sharp_factor) * static_cast<double>(in.samples.lens_scale)
                           : 0.0};
  const RayCounters before = bvh_.counters();
  work.boxes_built += bvh_.build(in.mesh, in.leaf_columns, in.effects, space);
  BundleFrustum frustum(space, tile, in.settings.limits.near, std::min(in.settings.farthest, in.settings.limits.far));
  frustum.drop_depth_planes(bvh_.node(MotionBvh::kRoot));
  const MotionBvh::Overlap overlap = bvh_.traverse(frustum, MotionBvh::kRoot, method.branch_node);
  if (overlap.any)
    for (int y = tile.y0; y < tile.y1; y += kBundleSide)
      for (int x = tile.x0; x < tile.x1; x += kBundleSide)
        test_rectangle(in, method, space, IntRect{x, y, x + kBundleSide, y + kBundleSide}.intersect(tile),
                       overlap.branch, sink, work);
  const RayCounters& now = bvh_.counters();
  const std::uint64_t tests =
      (now.frustum_node_tests - before.frustum_node_tests) + (now.node_visits - before.node_visits);
  work.box_tests += tests, work.box_lanes += tests;
}

void MeshVisibility::test_rectangle(const MeshInTile& in, const VisibilityMethodSettings& method, const RaySpace& space,
                                    const IntRect& pixels, std::uint32_t start, DistinctSamples& sink,
                                    VisibilityWork& work) {
  const float unlimited = in.settings.limits.far;
  const float* depth = in.settings.depth;
  float farthest = unlimited;
  if (depth != nullptr) {
    all_samples(in.samples, pixels, kept_);
    farthest = 0.0f;
    for (const std::uint32_t s : kept_) farthest = std::max(farthest, depth[s]);
    farthest = std::min(farthest, unlimited);
  }
  BundleFrustum frustum(space, pixels, in.settings.limits.near, farthest);
  frustum.drop_depth_planes(bvh_.node(start));
  if (!bvh_.traverse(frustum, start, method.branch_node).any) return;
  const MotionBvh::Overlap overlap = bvh_.within(in.times);
  if (!overlap.any) return;
  stencil_.keep(in.samples, pixels, StencilReferences::of(overlap.stencils), kept_);
  rays_.clear();
  for (const std::uint32_t s : kept_)
    rays_.push_back(bvh_.ray(in.samples, s, depth == nullptr ? unlimited : std::min(unlimited, depth[s])));
  bvh_.counters().rays_cast += rays_.size();
  bvh_.trace(rays_, overlap.branch, [&](const MotionBvh::CellRays& leaf) {
    test_cell_samples(in.mesh, leaf.cell, leaf.samples, in.samples, in.effects, inside_settings_, sink, work);
  });
  const std::uint64_t hits = sink.end_round();
  bvh_.counters().rays_hit += hits;
  stencil_.record_hits(hits);
}

}  // namespace tessera::tilecore
