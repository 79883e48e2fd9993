#include "baselines/baseline_set.h"

#include <memory>
#include <optional>
#include <utility>

#include "base/parallel.h"
#include "baselines/visibility_stream.h"
#include "gpu/pipeline.h"
#include "tilecore/procedural/sampling_controller.h"

namespace tessera::baselines {
namespace {

using memory::Purpose;
using memory::Unit;

}  // namespace

void BaselineSet::accumulate(const BaselineSet& frame) {
  for (std::size_t s = 0; s < schemes.size(); ++s) tessera::accumulate(schemes[s], frame.schemes[s]);
}

BaselineCounters measure_patch_machine(const tilecore::TileJob& job, const gpu::GpuConfiguration& gpu,
                                       const gpu::PatchTable& records, const gpu::FrameCounters& counters,
                                       const gpu::ObservedWork& record) {
  const memory::Ledger& ledger = counters.ledger;
  const memory::Traffic state = ledger.traffic(Unit::kTilecore, Purpose::kTileState),
                        frame = ledger.traffic(Unit::kResolve, Purpose::kFrameBuffer),
                        textures = ledger.traffic(Unit::kTilecore, Purpose::kTexture);
  memory::Traffic all = ledger.total();
  all.read_bytes -= textures.read_bytes;  // the same for every scheme that shades only visible surfaces
  const std::uint64_t bound_records = ledger.traffic(Unit::kFrontend, Purpose::kPatchData).read_bytes,
                      tables = ledger.traffic(Unit::kFrontend, Purpose::kTexture).read_bytes,
                      tables_uncached = counters.frontend.table_lines * job.burst_bytes(),
                      records_kept =
                          (counters.frontend.record_lines - counters.frontend.record_misses) * job.burst_bytes();
  const std::uint64_t tiles = ledger.traffic(Unit::kTilecore, Purpose::kPatchData).read_bytes;
  const std::uint64_t shading = ledger.traffic(Unit::kTilecore, Purpose::kAttributes).read_bytes;
  // Without the caches every request is a tessellation, and every line is read.
  const auto line_bytes = static_cast<std::uint64_t>(gpu.line_bytes());
  std::uint64_t evaluations_uncached = 0, tile_lines_uncached = 0;
  std::vector<gpu::PatchTable::Lines> fetched;
  for (const tilecore::TessellationRequest& r : record.tessellations) {
    evaluations_uncached += r.vertices;
    records.of_tessellation(job.frame->segment(r.segment), r, fetched);
    for (const gpu::PatchTable::Lines& lines : fetched) tile_lines_uncached += lines.end - lines.first;
  }
  const std::uint64_t uncached = (tile_lines_uncached + counters.l2.attribute_requests) * line_bytes;
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
  out.patch_bytes = bound_records + records_kept + tables_uncached + uncached;
  out.patch_bytes_cached = bound_records + tables + tiles + shading;
  out.frame_bytes_read = state.read_bytes;
  out.frame_bytes_written = state.written_bytes + frame.written_bytes;
  out.dram_bytes = all.read_bytes + all.written_bytes;
  out.dram_bytes_uncached = out.dram_bytes - tables - tiles - shading + records_kept + tables_uncached + uncached;
  out.pixel_shader_invocations = counters.shading.pixel_shader_invocations;
  set_pressure(queue_pressure(record, gpu,
                              tile_state_bytes(*job.grid, job.pattern->samples_per_pixel(),
                                               tilecore::sample_layout(job).sample_bytes(), job.burst_bytes())),
               out);
  return out;
}

void measure_triangle_machines(const tilecore::TileJob& job, const gpu::ObservedWork& record,
                               const frontend::PyramidLibrary& pyramids, const gpu::FrameCounters& replay,
                               const gpu::GpuConfiguration& gpu, BaselineSet& out, const MachineWork* machine,
                               SchemeWorks* works) {
  const int samples = job.pattern->samples_per_pixel();
  const BinSize bin = bin_size(job.grid->region(), samples, static_cast<std::uint64_t>(gpu.baselines.gmem_bytes));
  const binner::TileGrid bins(job.frame->request.width, job.frame->request.height, bin.width, bin.height,
                              job.grid->region());
  const ImmediateFrame drawn = draw_immediately(job, record, gpu);
  const Pass pass{gpu, job, bins, drawn.depths};
  std::vector<std::pair<std::size_t, std::unique_ptr<Scheme>>> others;
  for (std::size_t s = 0; s < kSchemeCount; ++s)
    if (kSchemes[s].make != nullptr) others.emplace_back(s, kSchemes[s].make());
  for (auto& [s, other] : others) other->begin(pass);
  // Each machine runs on its own: at most as many threads as machines.
  const auto draw = [&](std::span<const DrawnPatch> patches) {
    parallel_for(others.size(), [&](std::size_t r) {
      for (const DrawnPatch& patch : patches) others[r].second->add(patch);
    });
  };
  const GeometryCounts geometry = run_geometry(job, pyramids, gpu, TriangleSetup(*job.grid, job.frame->projection),
                                               TriangleSetup(bins, job.frame->projection), draw);
  const std::vector<std::uint64_t> tile_state =
                                       tile_state_bytes(*job.grid, samples, kColorAndDepthBytes, job.burst_bytes()),
                                   bin_state = tile_state_bytes(bins, samples, kColorAndDepthBytes, job.burst_bytes());
  std::optional<SchemeWork> work;
  if (machine != nullptr) work.emplace(gpu, job, *machine, geometry, drawn);
  const DrawnPass whole{geometry,
                        drawn,
                        replay.ledger.traffic(Unit::kResolve, Purpose::kFrameBuffer).written_bytes,
                        replay.shading.pixel_shader_invocations,
                        tile_state,
                        bin_state,
                        work ? &*work : nullptr};
  parallel_for(others.size(), [&](std::size_t r) {
    auto& [s, other] = others[r];
    SchemeResult result = other->finish(whole);
    if (work) set_cost(gpu, result.work, result.counters);
    out.schemes[s] = result.counters;
    if (work) (*works)[s] = std::move(result.work);
  });
}

void BaselineObserver::view_rendered(const gpu::RenderedView& view) {
  tilecore::TileJob job = view.job;
  job.resolve = nullptr;  // every scheme shades all pixels
  job.pixel_ids = false;
  last_ = {};
  works_ = {};
  last_[SchemeId::kTessera] = measure_patch_machine(job, view.gpu, view.records, view.result.counters, view.record);
  const gpu::GpuConfiguration whole_gpu = patch_whole_machine(view.gpu);
  gpu::FrameResult whole(view.result.frame, tilecore::FrameTargets(view.result.targets.region, false));
  const bool items = view.gpu.queues.model == hardware::TimingModel::kEvents;
  gpu::WorkRecorder whole_work(whole_gpu, view.records, view.heights, false, items);
  gpu::ObservedWork whole_record;
  gpu::Pipeline(whole_gpu, view.pyramids).render({whole_gpu, job, whole_work, whole, &whole_record}, {});
  // The maps of procedures are made before the pipeline.
  if (job.procedures != nullptr) whole.counters.ledger += job.procedures->ledger();
  last_[SchemeId::kPatchWhole] = measure_patch_machine(job, whole_gpu, view.records, whole.counters, whole_record);
  std::optional<MachineWork> machine;
  if (view.result.model) {
    machine.emplace(MachineWork{view.result.model->record.work, view.record.textures, view.heights});
    add_patch_machine(view.gpu, machine->work, view.result.counters, SchemeId::kTessera);
    add_patch_machine(whole_gpu, whole_work.finish(whole.counters.ledger).work, whole.counters, SchemeId::kPatchWhole);
  }
  // Patches that the previous frame's depth hid are in no list of this frame, but an immediate machine draws them.
  measure_triangle_machines(job, view.gpu.frontend.previous_depth_culling ? whole_record : view.record, view.pyramids,
                            view.result.counters, view.gpu, last_, machine ? &*machine : nullptr, &works_);
}

void BaselineObserver::add_patch_machine(const gpu::GpuConfiguration& gpu, const timing::FrameWork& work,
                                         const gpu::FrameCounters& counters, SchemeId scheme) {
  last_[scheme].texture_bytes = counters.ledger.traffic(Unit::kTilecore, Purpose::kTexture).read_bytes;
  works_[static_cast<std::size_t>(scheme)] = work;
  set_cost(gpu, work, last_[scheme]);
}

}  // namespace tessera::baselines
