#include "baselines/baseline_set.h"

#include <algorithm>

#include "base/parallel.h"
#include "baselines/immediate_frame.h"
#include "baselines/post_tessellation.h"
#include "gpu/pipeline.h"
#include "tilecore/tessellation/tessellator.h"

namespace tessera::baselines {
namespace {

using memory::Purpose;
using memory::Unit;

// Cells of a grid that share a block: 8x8 vertices, 98 triangles.
constexpr int kGroupCells = 7;

void add_grid_triangles(const scene::TessellationPattern& pattern, TessellatedPatch& patch) {
  const auto vertex = [&](int i, int j) { return static_cast<std::uint32_t>(j * (pattern.nu + 1) + i); };
  for (int gj = 0; gj < pattern.nv; gj += kGroupCells)
    for (int gi = 0; gi < pattern.nu; gi += kGroupCells) {
      for (int j = gj; j < std::min<int>(gj + kGroupCells, pattern.nv); ++j)
        for (int i = gi; i < std::min<int>(gi + kGroupCells, pattern.nu); ++i) {
          // The second triangle first: it shares an edge with the first one of the cell before, which makes a strip.
          const std::uint32_t a = vertex(i, j), b = vertex(i + 1, j), c = vertex(i + 1, j + 1), d = vertex(i, j + 1);
          patch.triangles.push_back({a, c, d});
          patch.triangles.push_back({a, b, c});
        }
      patch.group_ends.push_back(static_cast<std::uint32_t>(patch.triangles.size()));
    }
}

void add_cluster_triangles(const scene::MeshClusters& clusters, const scene::Cluster& cluster,
                           TessellatedPatch& patch) {
  for (std::uint32_t k = 0; k < cluster.cell_count; ++k) {
    const scene::ClusterCell& cell = clusters.cells[cluster.first_cell + k];
    const auto& c = cell.corner;
    if (!cell.single()) patch.triangles.push_back({c[0], c[2], c[3]});
    patch.triangles.push_back({c[0], c[1], c[2]});
  }
  patch.group_ends.push_back(static_cast<std::uint32_t>(patch.triangles.size()));
}

// Tessellates a whole base patch as the tile core would, for a machine that does so first.
TessellatedPatch tessellate_first(const tilecore::TileJob& job, std::uint32_t number,
                                  tilecore::Tessellator& tessellator, tilecore::MicroMesh& mesh) {
  const scene::FrameGeometry& frame = *job.frame;
  const scene::PosedDrawable& drawable = frame.drawable_of(number);
  TessellatedPatch patch;
  patch.state = frame.assembly->patch_drawable[number];
  patch.moving = drawable.moving;
  if (!drawable.material->double_sided) {
    patch.keep_positive = drawable.mirrored;
    patch.keep_negative = !drawable.mirrored;
  }
  patch.domain_evaluations = tessellator
                                 .tessellate(frame, number, scene::patch_cells(frame, number),
                                             {patch.moving, frame.projection.lens_scale != 0}, mesh)
                                 .domain_evaluations;
  patch.patch_bytes = memory::burst_bytes(
      0, frontend::patch_record_bytes(frame, number) + frontend::instance_record_bytes(drawable), job.burst_bytes);
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

// Batches of patches in parallel, joined in order.
BaselineCounters run_post_tessellation(const tilecore::TileJob& job, const gpu::GpuConfiguration& gpu,
                                       std::uint64_t frame_bytes) {
  constexpr std::size_t kBatch = 64;
  struct Prepared {
    bool drawn = false;
    TessellatedPatch patch;
    TriangleList list;
    BaselineCounters counters;
  };
  struct Scratch {
    tilecore::Tessellator tessellator;
    tilecore::MicroMesh mesh;
  };
  PostTessellationBinner post(gpu, *job.grid, job.frame->projection);
  const std::size_t patch_count = job.frame->assembly->patch_count();
  BaselineCounters counters;
  PerThread<Scratch> scratch;
  for (std::size_t first = 0; first < patch_count; first += kBatch) {
    std::vector<Prepared> batch(std::min(kBatch, patch_count - first));
    parallel_for(batch.size(), [&](std::size_t k) {
      Scratch& own = scratch.local();
      Prepared& prepared = batch[k];
      if (!job.frame->drawable_of(static_cast<std::uint32_t>(first + k)).visible) return;
      prepared.drawn = true;
      prepared.patch = tessellate_first(job, static_cast<std::uint32_t>(first + k), own.tessellator, own.mesh);
      prepared.list = post.setup().run(prepared.patch, prepared.counters);
    });
    for (const Prepared& prepared : batch) {
      if (!prepared.drawn) continue;
      merge(counters, prepared.counters);
      post.add(prepared.patch, prepared.list);
    }
  }
  post.finish();
  merge(counters, post.counters());
  counters.frame_bytes_written = frame_bytes;
  counters.dram_bytes = post.dram_bytes() + counters.patch_bytes + frame_bytes;
  counters.dram_bytes_uncached = post.dram_bytes_uncached() + counters.patch_bytes + frame_bytes;
  return counters;
}

}  // namespace

void BaselineSet::accumulate(const BaselineSet& frame) {
  for (std::size_t s = 0; s < schemes.size(); ++s) tessera::accumulate(schemes[s], frame.schemes[s]);
}

gpu::GpuConfiguration patch_whole_machine(gpu::GpuConfiguration gpu) {
  gpu.frontend.split_depth = 0;
  gpu.frontend.split_budget = 1;
  gpu.tessellator.sub_patch_cells = 64;
  gpu.frontend.previous_depth_culling = false;
  return gpu;
}

BaselineCounters measure_patch_machine(const gpu::FrameCounters& counters, const gpu::MachineRecord& record) {
  const memory::Ledger& ledger = counters.ledger;
  const memory::Traffic state = ledger.traffic(Unit::kTilecore, Purpose::kTileState),
                        frame = ledger.traffic(Unit::kResolve, Purpose::kFrameBuffer),
                        textures = ledger.traffic(Unit::kTilecore, Purpose::kTexture);
  memory::Traffic all = ledger.total();
  all.read_bytes -= textures.read_bytes;  // the same for every scheme that shades what is visible
  const std::uint64_t front_end = ledger.traffic(Unit::kFrontend, Purpose::kPatchData).read_bytes;
  const std::uint64_t tiles = ledger.traffic(Unit::kTilecore, Purpose::kPatchData).read_bytes;
  // Without the cache every request is a tessellation.
  std::uint64_t evaluations_uncached = 0, tiles_uncached = 0;
  for (const tilecore::TessellationRequest& r : record.tessellations)
    evaluations_uncached += r.vertices, tiles_uncached += r.patch_bytes;
  BaselineCounters out;
  out.primitives = counters.frontend.sub_patches;
  out.culled_frustum = counters.frontend.culled_frustum;
  out.culled_backface = counters.frontend.culled_backface;
  out.culled_occlusion = counters.tilecore.culled_occlusion;
  out.bounding_operations =
      counters.frontend.bounds_computed + counters.instances.groups_tested + counters.instances.instances_tested;
  out.tile_overlaps = counters.binner.tile_overlaps;
  out.entries = counters.binner.entries;
  out.queue_bytes_written = counters.binner.queue_bytes_written;
  out.queue_bytes_read = counters.binner.queue_bytes_read;
  out.queue_bytes_peak = counters.binner.queue_bytes_peak;
  out.buffer_overflows = counters.binner.partial_renders;
  out.domain_evaluations = evaluations_uncached;
  out.domain_evaluations_cached = counters.tessellation.domain_evaluations;
  out.patch_bytes = front_end + tiles_uncached;
  out.patch_bytes_cached = front_end + tiles;
  out.frame_bytes_read = state.read_bytes;
  out.frame_bytes_written = state.written_bytes + frame.written_bytes;
  out.dram_bytes = all.read_bytes + all.written_bytes;
  out.dram_bytes_uncached = out.dram_bytes - tiles + tiles_uncached;
  return out;
}

TriangleMachines measure_triangle_machines(const tilecore::TileJob& job, const gpu::MachineRecord& record,
                                           const memory::Ledger& frame_ledger, const gpu::GpuConfiguration& gpu) {
  const std::uint64_t frame_bytes = frame_ledger.traffic(Unit::kResolve, Purpose::kFrameBuffer).written_bytes;
  TriangleMachines out;
  out.post_tessellation = run_post_tessellation(job, gpu, frame_bytes);
  // The same triangles in the same order, but no bins.
  const BaselineCounters& post = out.post_tessellation;
  BaselineCounters& immediate = out.immediate;
  immediate.primitives = post.primitives;
  immediate.culled_frustum = post.culled_frustum;
  immediate.culled_backface = post.culled_backface;
  immediate.culled_zero_area = post.culled_zero_area;
  immediate.domain_evaluations = immediate.domain_evaluations_cached = post.domain_evaluations;
  immediate.patch_bytes = immediate.patch_bytes_cached = post.patch_bytes;
  const ImmediateTraffic traffic = draw_immediately(job, record, gpu);
  const std::uint64_t finished =
      job.pattern->samples_per_pixel() > 1 ? frame_bytes : 0;  // else the colour surface is the frame
  immediate.frame_bytes_read = traffic.bytes_read;
  immediate.frame_bytes_written = traffic.bytes_written + finished;
  immediate.dram_bytes = traffic.bytes_read + traffic.bytes_written + finished + immediate.patch_bytes;
  immediate.dram_bytes_uncached = traffic.bytes_uncached + finished + immediate.patch_bytes;
  return out;
}

void BaselineObserver::view_rendered(const gpu::RenderedView& view) {
  tilecore::TileJob job = view.job;
  job.resolve = nullptr;  // every scheme shades all pixels
  last_ = {};
  last_[Scheme::kPreTessellation] = measure_patch_machine(view.result.counters, view.record);
  const gpu::GpuConfiguration whole_gpu = patch_whole_machine(view.gpu);
  gpu::FrameResult whole(view.result.frame, tilecore::FrameTargets(view.result.targets.region, false));
  gpu::WorkRecorder whole_work(whole_gpu, nullptr, false);
  gpu::MachineRecord whole_record;
  gpu::Pipeline(whole_gpu, view.pyramids).render({job, whole_work, whole, &whole_record}, nullptr);
  last_[Scheme::kPatchWhole] = measure_patch_machine(whole.counters, whole_record);
  // What the previous frame's depth hid is in no list of this one, but an immediate machine draws it.
  const TriangleMachines machines =
      measure_triangle_machines(job, view.gpu.frontend.previous_depth_culling ? whole_record : view.record,
                                view.result.counters.ledger, view.gpu);
  last_[Scheme::kPostTessellation] = machines.post_tessellation;
  last_[Scheme::kImmediate] = machines.immediate;
}

}  // namespace tessera::baselines
