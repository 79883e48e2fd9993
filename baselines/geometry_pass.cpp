#include "baselines/geometry_pass.h"

#include <algorithm>
#include <utility>

#include "base/parallel.h"
#include "baselines/block_code.h"
#include "frontend/front_end.h"
#include "tilecore/shading/transmission.h"
#include "tilecore/tessellation/tessellator.h"

namespace tessera::baselines {
namespace {

struct Scratch {
  tilecore::Tessellator tessellator;
  tilecore::MicroMesh mesh;
};

void add_grid_triangles(const scene::TessellationPattern& pattern, TessellatedPatch& patch) {
  patch.columns = pattern.nu, patch.rows = pattern.nv;
  const auto vertex = [&](int i, int j) { return static_cast<std::uint32_t>(j * (pattern.nu + 1) + i); };
  for (int gj = 0; gj < pattern.nv; gj += kGridCells)
    for (int gi = 0; gi < pattern.nu; gi += kGridCells) {
      const int end_i = std::min<int>(gi + kGridCells, pattern.nu), end_j = std::min<int>(gj + kGridCells, pattern.nv);
      for (int j = gj; j < end_j; ++j)
        for (int i = gi; i < end_i; ++i) {
          // The second triangle first: it shares an edge with the first one of the cell before, which makes a strip.
          const std::uint32_t a = vertex(i, j), b = vertex(i + 1, j), c = vertex(i + 1, j + 1), d = vertex(i, j + 1),
                              first = 2 * static_cast<std::uint32_t>(j * pattern.nu + i);
          patch.triangles.push_back({a, c, d});
          patch.triangles.push_back({a, b, c});
          patch.triangle_numbers.insert(patch.triangle_numbers.end(), {first + 1, first});
        }
      patch.group_ends.push_back(static_cast<std::uint32_t>(patch.triangles.size()));
      patch.group_columns.push_back(static_cast<std::uint8_t>(end_i - gi));
    }
}

void add_cluster_triangles(const scene::MeshClusters& clusters, const scene::Cluster& cluster,
                           TessellatedPatch& patch) {
  const auto first = clusters.vertices.begin() + cluster.first_vertex;
  patch.draw_numbers.assign(first, first + cluster.vertex_count);
  for (std::uint32_t k = 0; k < cluster.cell_count; ++k) {
    const scene::ClusterCell& cell = clusters.cells[cluster.first_cell + k];
    const auto& c = cell.corner;
    if (!cell.single()) {
      patch.triangles.push_back({c[0], c[2], c[3]});
      patch.triangle_numbers.push_back(2 * k + 1);
    }
    patch.triangles.push_back({c[0], c[1], c[2]});
    patch.triangle_numbers.push_back(2 * k);
  }
  patch.group_ends.push_back(static_cast<std::uint32_t>(patch.triangles.size()));
  patch.group_columns.push_back(0);
}

// Attributes of a vertex that a pass of depths alone needs: a coordinate of the texture that masks, and the alpha of the
// vertex's colour.
std::uint64_t mask_components(const scene::PosedDrawable& drawable) {
  if (drawable.material->alpha_mode != scene::AlphaMode::kMask || drawable.primitive == nullptr) return 0;
  return 2 + (drawable.primitive->vertices.colors.empty() ? 0u : 1u);
}

// Whether a pass that draws a part of the surfaces leaves this one out.
bool leaves_out(const tilecore::TileJob& job, const scene::PosedDrawable& drawable) {
  return (job.depths_alone && drawable.material->alpha_mode == scene::AlphaMode::kBlend) ||
         (job.behind && tilecore::transmits(drawable));
}

// Vertices of a base patch's record: the vertices of a cluster, or the corners of a patch.
std::uint64_t stored_vertices(const scene::FrameGeometry& frame, std::uint32_t number) {
  constexpr std::uint64_t kCorners = 4;
  const scene::Drawable& drawable = frame.assembly->drawable_of(number);
  if (drawable.kind != scene::Primitive::Kind::kTriangles) return kCorners;
  return frame.assembly->clusters[drawable.geometry].clusters[number - drawable.first_patch].vertex_count;
}

// Tessellates a whole base patch as the tile core would, for a machine that does so first.
TessellatedPatch tessellate_first(const tilecore::TileJob& job, std::uint32_t number, Scratch& scratch) {
  const scene::FrameGeometry& frame = *job.frame;
  const scene::PosedDrawable& drawable = frame.drawable_of(number);
  TessellatedPatch patch;
  patch.number = number;
  patch.state = frame.assembly->patch_drawable[number];
  patch.moving = drawable.moving;
  patch.deforming = drawable.moving && drawable.deforming;
  if (!drawable.material->double_sided) {
    patch.keep_positive = drawable.mirrored;
    patch.keep_negative = !drawable.mirrored;
  }
  tilecore::MicroMesh& mesh = scratch.mesh;
  patch.domain_evaluations = scratch.tessellator
                                 .tessellate(frame, number, scene::patch_cells(frame, number),
                                             {patch.moving, frame.projection.lens_scale != 0}, mesh)
                                 .domain_evaluations;
  const std::uint64_t component_bytes = frame.request.half_attributes ? 2 : sizeof(float);
  if (!job.shades()) {
    const std::uint64_t components = mask_components(drawable);
    patch.attribute_bytes = components * component_bytes;
    patch.stored_attribute_bytes =
        memory::burst_bytes(0, components * sizeof(float) * stored_vertices(frame, number), job.burst_bytes());
  } else {
    patch.attribute_bytes = frontend::vertex_components(*drawable.primitive, *drawable.material) * component_bytes;
    patch.stored_attribute_bytes = memory::burst_bytes(
        0, frontend::patch_attribute_bytes(*frame.assembly, number, drawable.deforming), job.burst_bytes());
  }
  patch.patch_bytes = memory::burst_bytes(
      0, frontend::patch_record_bytes(frame, number) + frontend::instance_record_bytes(drawable), job.burst_bytes());
  patch.decoded_elements = frontend::decoded_elements(*frame.assembly, number);
  const auto take = [&](const std::vector<float>& from, std::vector<float>& to) {
    to.assign(from.begin(), from.begin() + static_cast<std::ptrdiff_t>(mesh.vertex_count));
  };
  take(mesh.x0, patch.x0), take(mesh.y0, patch.y0), take(mesh.z0, patch.z0);
  if (patch.moving) take(mesh.x1, patch.x1), take(mesh.y1, patch.y1), take(mesh.z1, patch.z1);
  patch.projected.assign(mesh.projected.begin(),
                         mesh.projected.begin() + static_cast<std::ptrdiff_t>(mesh.vertex_count));
  if (scene::has_grid(*drawable.drawable)) {
    add_grid_triangles(frame.pattern_of(number), patch);
  } else {
    const scene::MeshClusters& clusters = frame.assembly->clusters[drawable.drawable->geometry];
    add_cluster_triangles(clusters, clusters.clusters[number - drawable.drawable->first_patch], patch);
  }
  return patch;
}

}  // namespace

TessellatedPatch tessellate_patch(const tilecore::TileJob& job, std::uint32_t number) {
  Scratch scratch;
  return tessellate_first(job, number, scratch);
}

gpu::GpuConfiguration patch_whole_machine(gpu::GpuConfiguration gpu) {
  gpu.frontend.split_depth = 0;
  gpu.frontend.split_budget = 1;
  gpu.tessellator.sub_patch_cells = 64;
  gpu.frontend.previous_depth_culling = false;
  return gpu;
}

HullStage run_hull_stage(const tilecore::TileJob& job, const frontend::PyramidLibrary& pyramids,
                         const gpu::GpuConfiguration& gpu, BaselineCounters& counters) {
  const scene::FrameGeometry& frame = *job.frame;
  frontend::FrontEndSpec spec = patch_whole_machine(gpu).front_end_spec();
  for (const scene::PosedDrawable& drawable : frame.drawables) spec.left_out.push_back(leaves_out(job, drawable));
  const frontend::FrontEndResult front_end = frontend::run_front_end(frame, pyramids, spec);
  counters.patches_culled =
      front_end.counters.culled_frustum + front_end.counters.culled_backface + front_end.groups.patches_culled;
  counters.bounding_operations =
      front_end.counters.bounds_computed + front_end.instances.groups_tested + front_end.instances.instances_tested;
  // Records, and the tables of heights by which whole patches are bounded.
  const auto read = [&](memory::Purpose purpose) {
    return front_end.ledger.traffic(memory::Unit::kFrontend, purpose).read_bytes;
  };
  const auto add_record = [&](std::uint32_t patch) {
    const std::uint64_t bytes = memory::burst_bytes(0, frontend::patch_record_bytes(frame, patch), job.burst_bytes());
    counters.patch_bytes += bytes;
    counters.patch_bytes_cached += bytes;
  };
  counters.patch_bytes =
      read(memory::Purpose::kPatchData) +
      (front_end.counters.record_lines - front_end.counters.record_misses + front_end.counters.table_lines) *
          job.burst_bytes();
  counters.patch_bytes_cached = read(memory::Purpose::kPatchData) + read(memory::Purpose::kTexture);
  HullStage out{std::vector<std::uint8_t>(frame.assembly->patch_count(), 0), front_end.counters.elements_decoded};
  std::vector<std::uint8_t>& kept = out.kept;
  for (const frontend::BoundedSubPatch& piece : front_end.sub_patches) {
    // Vertices are behind the records by which clusters are culled.
    if (kept[piece.base_patch] == 0 && frontend::resting_bound(frame, piece.base_patch) != nullptr)
      add_record(piece.base_patch);
    kept[piece.base_patch] = 1;
  }
  // Procedures that the replay samples without patches are tessellated here, all of them.
  if (!frame.request.sample_procedures || !frame.request.procedures) return out;
  for (const scene::PosedDrawable& drawable : frame.drawables) {
    if (drawable.procedure == nullptr || !drawable.visible) continue;
    if (leaves_out(job, drawable)) continue;
    for (std::uint32_t p = 0; p < drawable.drawable->patch_count; ++p) {
      const std::uint32_t patch = drawable.drawable->first_patch + p;
      kept[patch] = 1;
      add_record(patch);
    }
  }
  return out;
}

// Batches of patches in parallel, joined in order.
GeometryCounts run_geometry(const tilecore::TileJob& job, const frontend::PyramidLibrary& pyramids,
                            const gpu::GpuConfiguration& gpu, const TriangleSetup& tiles, const TriangleSetup& bins,
                            const std::function<void(std::span<const DrawnPatch>)>& draw) {
  constexpr std::size_t kBatch = 64;
  struct Counted {
    BaselineCounters tiles, bins;
  };
  GeometryCounts counts;
  const HullStage hull = run_hull_stage(job, pyramids, gpu, counts.tiles);
  counts.decoded_for_bounds = hull.decoded_for_bounds;
  counts.bins = counts.tiles;
  std::vector<std::uint32_t> patches;
  for (std::size_t p = 0; p < hull.kept.size(); ++p)
    if (hull.kept[p] != 0) patches.push_back(static_cast<std::uint32_t>(p));
  PerThread<Scratch> scratch;
  for (std::size_t first = 0; first < patches.size(); first += kBatch) {
    std::vector<DrawnPatch> batch(std::min(kBatch, patches.size() - first));
    std::vector<Counted> counted(batch.size());
    parallel_for(batch.size(), [&](std::size_t k) {
      DrawnPatch& drawn = batch[k];
      drawn.patch = tessellate_first(job, patches[first + k], scratch.local());
      drawn.tiles = tiles.run(drawn.patch, counted[k].tiles);
      drawn.bins = bins.run(drawn.patch, counted[k].bins);
    });
    for (std::size_t k = 0; k < batch.size(); ++k) {
      merge(counts.tiles, counted[k].tiles);
      merge(counts.bins, counted[k].bins);
      counts.vertices += batch[k].patch.domain_evaluations;
      counts.patches.push_back(
          {batch[k].patch.number, batch[k].patch.domain_evaluations, batch[k].patch.triangles.size()});
      counts.attribute_bytes += batch[k].patch.stored_attribute_bytes;
      if (!batch[k].tiles.triangles.empty()) counts.kept_attribute_bytes += batch[k].patch.stored_attribute_bytes;
    }
    draw(batch);
  }
  return counts;
}

}  // namespace tessera::baselines
