#include "baselines/baseline_set.h"

#include <optional>
#include <utility>

#include "base/parallel.h"
#include "baselines/control_list.h"
#include "baselines/deferred_vertex.h"
#include "baselines/immediate_frame.h"
#include "baselines/post_tessellation.h"
#include "baselines/visibility_stream.h"
#include "gpu/pipeline.h"
#include "tilecore/procedural/sampling_controller.h"

namespace tessera::baselines {
namespace {

using memory::Purpose;
using memory::Unit;

constexpr std::uint64_t kColorAndDepthBytes = 8;  // of a sample, as tiles of conventional machines keep them

// What machines that bin triangles share before their lists: hull stage, tessellation and setup.
// `attributes`: bytes of them that are read before.
void take_geometry(const BaselineCounters& geometry, std::uint64_t attributes, BaselineCounters& out) {
  out.primitives = geometry.primitives;
  out.patches_culled = geometry.patches_culled;
  out.culled_frustum = geometry.culled_frustum;
  out.culled_backface = geometry.culled_backface;
  out.culled_zero_area = geometry.culled_zero_area;
  out.bounding_operations = geometry.bounding_operations;
  out.tile_overlaps = geometry.tile_overlaps;
  out.patch_bytes += geometry.patch_bytes + attributes;
  out.patch_bytes_cached += geometry.patch_bytes_cached + attributes;
}

// The machines whose lists hold triangles, and the grid of bins that one of them has.
struct Binners {
  Binners(const tilecore::TileJob& job, const gpu::GpuConfiguration& gpu, const BinSize& bin)
      : bins(job.frame->request.width, job.frame->request.height, bin.width, bin.height, job.grid->region()),
        bin_setup(bins, job.frame->projection),
        post(gpu, *job.grid, job.frame->projection),
        position(gpu, *job.grid, job.frame->projection, VertexStorage::kSnapped),
        deferred(gpu, *job.grid),
        stream(gpu, bins),
        control(gpu, *job.grid) {}
  Binners(const Binners&) = delete;

  // Each machine by itself: as many threads as there are machines.
  void draw(std::span<const DrawnPatch> patches) {
    parallel_for(kMachines, [&](std::size_t machine) {
      for (const DrawnPatch& drawn : patches) {
        if (machine == 0) post.add(drawn.patch, drawn.tiles);
        if (machine == 1) position.add(drawn.patch, drawn.tiles);
        if (machine == 2) deferred.add(drawn.patch, drawn.tiles);
        if (machine == 3) stream.add(drawn.patch, drawn.bins);
        if (machine == 4) control.add(drawn.patch, drawn.tiles);
      }
    });
  }
  void finish(const VisibleTriangles& visible, std::span<const std::uint64_t> tile_state,
              std::span<const std::uint64_t> bin_state) {
    parallel_for(kMachines, [&](std::size_t machine) {
      if (machine == 0) post.finish(nullptr, tile_state);
      if (machine == 1) position.finish(&visible, tile_state);
      if (machine == 2) deferred.finish(tile_state);
      if (machine == 3) stream.finish(bin_state);
      if (machine == 4) control.finish(tile_state);
    });
  }

  static constexpr std::size_t kMachines = 5;

  binner::TileGrid bins;
  TriangleSetup bin_setup;
  PostTessellationBinner post, position;
  DeferredVertexBinner deferred;
  VisibilityStreamBinner stream;
  ControlListBinner control;
};

// Counters of a machine with lists, from those of its binner.
template <class Machine>
BaselineCounters list_machine(const Machine& machine, const BaselineCounters& geometry, std::uint64_t attributes,
                              std::uint64_t frame_bytes, std::uint64_t invocations) {
  BaselineCounters out = machine.counters();
  take_geometry(geometry, attributes, out);
  out.pixel_shader_invocations = invocations;
  out.frame_bytes_written = frame_bytes;
  out.dram_bytes = machine.dram_bytes() + geometry.patch_bytes_cached + attributes + frame_bytes;
  out.dram_bytes_uncached = machine.dram_bytes_uncached() + geometry.patch_bytes + attributes + frame_bytes;
  return out;
}

// Work, cycles and energies of the machines that tessellate first.
void add_works(const tilecore::TileJob& job, const gpu::GpuConfiguration& gpu, const MachineWork& machine,
               const GeometryCounts& geometry, const ImmediateFrame& drawn, const Binners& binners, BaselineSet& out,
               SchemeWorks& works) {
  const SchemeWork work(gpu, job, machine, geometry, drawn);
  const std::uint64_t textures = texture_bytes(machine.textures);
  const auto finish = [&](Scheme scheme, timing::FrameWork of_scheme, std::uint64_t of_textures) {
    out[scheme].texture_bytes = of_textures;
    timing::FrameWork& kept = works[static_cast<std::size_t>(scheme)] = std::move(of_scheme);
    set_cost(gpu, kept, out[scheme]);
  };
  // What a scheme reads and writes before its tiles: records, attributes, lists.
  const auto front = [&](Scheme scheme, const TriangleBuffer& buffer, std::uint64_t records, std::uint64_t attributes) {
    const memory::Traffic lists = buffer.ledger().total();
    FrontWork of_scheme{0, records + attributes + lists.read_bytes, lists.written_bytes, true};
    of_scheme.vertices = out[scheme].position_evaluations;
    return of_scheme;
  };
  const auto add_stored = [&](Scheme scheme, const PostTessellationBinner& binner, std::uint64_t attributes) {
    FrontWork before = front(scheme, binner.buffer(), geometry.tiles.patch_bytes_cached, attributes);
    before.vertices += out[scheme].domain_evaluations;
    finish(scheme, work.tiled(out[scheme], before, binner.tiles(), *job.grid), textures);
  };
  const auto add_shaded_again = [&](Scheme scheme, const ReferenceLists& lists, const BaselineCounters& hull,
                                    const binner::TileGrid& bins, bool fetches_entries) {
    FrontWork before = front(scheme, lists.buffer(), hull.patch_bytes_cached, 0);
    before.fetches_entries = fetches_entries;
    finish(scheme, work.tiled(out[scheme], before, lists.tiles(), bins), textures);
  };
  add_stored(Scheme::kPostTessellation, binners.post, geometry.attribute_bytes);
  add_stored(Scheme::kPostPosition, binners.position, geometry.kept_attribute_bytes);
  add_shaded_again(Scheme::kDeferredVertex, binners.deferred.lists(), geometry.tiles, *job.grid, true);
  add_shaded_again(Scheme::kVisibilityStream, binners.stream.lists(), geometry.bins, binners.bins, false);
  add_shaded_again(Scheme::kControlList, binners.control.lists(), geometry.tiles, *job.grid, false);
  finish(Scheme::kImmediate, work.immediate(out[Scheme::kImmediate]), work.immediate_texture_bytes());
}

}  // namespace

void BaselineSet::accumulate(const BaselineSet& frame) {
  for (std::size_t s = 0; s < schemes.size(); ++s) tessera::accumulate(schemes[s], frame.schemes[s]);
}

BaselineCounters measure_patch_machine(const tilecore::TileJob& job, const gpu::GpuConfiguration& gpu,
                                       const gpu::RecordMemory& records, const gpu::FrameCounters& counters,
                                       const gpu::MachineRecord& record) {
  const memory::Ledger& ledger = counters.ledger;
  const memory::Traffic state = ledger.traffic(Unit::kTilecore, Purpose::kTileState),
                        frame = ledger.traffic(Unit::kResolve, Purpose::kFrameBuffer),
                        textures = ledger.traffic(Unit::kTilecore, Purpose::kTexture);
  memory::Traffic all = ledger.total();
  all.read_bytes -= textures.read_bytes;  // the same for every scheme that shades what is visible
  const std::uint64_t bound_records = ledger.traffic(Unit::kFrontend, Purpose::kPatchData).read_bytes,
                      tables = ledger.traffic(Unit::kFrontend, Purpose::kTexture).read_bytes,
                      tables_uncached = counters.frontend.table_lines * job.burst_bytes;
  const std::uint64_t tiles = ledger.traffic(Unit::kTilecore, Purpose::kPatchData).read_bytes;
  const std::uint64_t shading = ledger.traffic(Unit::kTilecore, Purpose::kAttributes).read_bytes;
  // Without the caches every request is a tessellation, and every line is read.
  const auto line_bytes = static_cast<std::uint64_t>(gpu.line_bytes());
  std::uint64_t evaluations_uncached = 0, tile_lines_uncached = 0;
  std::vector<gpu::RecordMemory::Lines> fetched;
  for (const tilecore::TessellationRequest& r : record.tessellations) {
    evaluations_uncached += r.vertices;
    records.of_tessellation(job.frame->segment(r.segment), r, fetched);
    for (const gpu::RecordMemory::Lines& lines : fetched) tile_lines_uncached += lines.end - lines.first;
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
  out.patch_bytes = bound_records + tables_uncached + uncached;
  out.patch_bytes_cached = bound_records + tables + tiles + shading;
  out.frame_bytes_read = state.read_bytes;
  out.frame_bytes_written = state.written_bytes + frame.written_bytes;
  out.dram_bytes = all.read_bytes + all.written_bytes;
  out.dram_bytes_uncached = out.dram_bytes - tables - tiles - shading + tables_uncached + uncached;
  out.pixel_shader_invocations = counters.shading.pixel_shader_invocations;
  set_pressure(queue_pressure(
                   record, gpu,
                   tile_state_bytes(*job.grid, job.pattern->samples_per_pixel(),
                                    tilecore::TileState::bytes_per_sample(tilecore::sees_rest(job)), job.burst_bytes)),
               out);
  return out;
}

void measure_triangle_machines(const tilecore::TileJob& job, const gpu::MachineRecord& record,
                               const frontend::PyramidLibrary& pyramids, const gpu::FrameCounters& replay,
                               const gpu::GpuConfiguration& gpu, BaselineSet& out, const MachineWork* machine,
                               SchemeWorks* works) {
  const std::uint64_t frame_bytes = replay.ledger.traffic(Unit::kResolve, Purpose::kFrameBuffer).written_bytes,
                      invocations = replay.shading.pixel_shader_invocations;
  const int samples = job.pattern->samples_per_pixel();
  Binners binners(job, gpu,
                  bin_size(job.grid->region(), samples, static_cast<std::uint64_t>(gpu.baselines.gmem_bytes)));
  const GeometryCounts geometry = run_geometry(job, pyramids, gpu, binners.post.setup(), binners.bin_setup,
                                               [&](std::span<const DrawnPatch> patches) { binners.draw(patches); });
  const ImmediateFrame drawn = draw_immediately(job, record, gpu);
  binners.finish(drawn.visible, tile_state_bytes(*job.grid, samples, kColorAndDepthBytes, job.burst_bytes),
                 tile_state_bytes(binners.bins, samples, kColorAndDepthBytes, job.burst_bytes));

  const BaselineCounters& by_tiles = geometry.tiles;
  out[Scheme::kPostTessellation] =
      list_machine(binners.post, by_tiles, geometry.attribute_bytes, frame_bytes, invocations);
  out[Scheme::kPostPosition] =
      list_machine(binners.position, by_tiles, geometry.kept_attribute_bytes, frame_bytes, invocations);
  out[Scheme::kDeferredVertex] = list_machine(binners.deferred.lists(), by_tiles, 0, frame_bytes, invocations);
  out[Scheme::kVisibilityStream] = list_machine(binners.stream.lists(), geometry.bins, 0, frame_bytes, invocations);
  out[Scheme::kControlList] = list_machine(binners.control.lists(), by_tiles, 0, frame_bytes, invocations);
  // Positions first; the rest for what setup keeps, or again where it is needed.
  BaselineCounters& position = out[Scheme::kPostPosition];
  position.domain_evaluations = position.domain_evaluations_cached = geometry.kept_vertices;
  for (const Scheme scheme :
       {Scheme::kPostPosition, Scheme::kDeferredVertex, Scheme::kVisibilityStream, Scheme::kControlList})
    out[scheme].position_evaluations = geometry.vertices;

  // The same triangles in the same order, but no bins.
  BaselineCounters& immediate = out[Scheme::kImmediate];
  take_geometry(by_tiles, geometry.attribute_bytes, immediate);
  immediate.tile_overlaps = 0;
  immediate.culled_occlusion = drawn.blocks_culled;
  immediate.pixel_shader_invocations = drawn.pixel_shader_invocations;
  immediate.domain_evaluations = immediate.domain_evaluations_cached = geometry.vertices;
  const std::uint64_t finished = samples > 1 ? frame_bytes : 0;  // else the colour surface is the frame
  immediate.frame_bytes_read = drawn.traffic.bytes_read;
  immediate.frame_bytes_written = drawn.traffic.bytes_written + finished;
  immediate.dram_bytes = drawn.traffic.bytes_read + immediate.frame_bytes_written + immediate.patch_bytes_cached;
  immediate.dram_bytes_uncached = drawn.traffic.bytes_uncached + finished + immediate.patch_bytes;
  if (machine != nullptr) add_works(job, gpu, *machine, geometry, drawn, binners, out, *works);
}

void BaselineObserver::view_rendered(const gpu::RenderedView& view) {
  tilecore::TileJob job = view.job;
  job.resolve = nullptr;  // every scheme shades all pixels
  last_ = {};
  works_ = {};
  last_[Scheme::kPreTessellation] =
      measure_patch_machine(job, view.gpu, view.records, view.result.counters, view.record);
  const gpu::GpuConfiguration whole_gpu = patch_whole_machine(view.gpu);
  gpu::FrameResult whole(view.result.frame, tilecore::FrameTargets(view.result.targets.region, false));
  gpu::WorkRecorder whole_work(whole_gpu, view.records, view.heights, false);
  gpu::MachineRecord whole_record;
  gpu::Pipeline(whole_gpu, view.pyramids).render({whole_gpu, job, whole_work, whole, &whole_record}, {});
  // The maps of procedures are made before the pipeline.
  if (job.procedures != nullptr) whole.counters.ledger += job.procedures->ledger();
  last_[Scheme::kPatchWhole] = measure_patch_machine(job, whole_gpu, view.records, whole.counters, whole_record);
  std::optional<MachineWork> machine;
  if (view.result.model) {
    machine.emplace(MachineWork{view.result.model->record.work, view.record.textures});
    add_patch_machine(view.gpu, machine->work, view.result.counters, Scheme::kPreTessellation);
    add_patch_machine(whole_gpu, whole_work.finish(job, whole.counters.ledger).work, whole.counters,
                      Scheme::kPatchWhole);
  }
  // What the previous frame's depth hid is in no list of this one, but an immediate machine draws it.
  measure_triangle_machines(job, view.gpu.frontend.previous_depth_culling ? whole_record : view.record, view.pyramids,
                            view.result.counters, view.gpu, last_, machine ? &*machine : nullptr, &works_);
}

void BaselineObserver::add_patch_machine(const gpu::GpuConfiguration& gpu, const timing::FrameWork& work,
                                         const gpu::FrameCounters& counters, Scheme scheme) {
  last_[scheme].texture_bytes = counters.ledger.traffic(Unit::kTilecore, Purpose::kTexture).read_bytes;
  works_[static_cast<std::size_t>(scheme)] = work;
  set_cost(gpu, work, last_[scheme]);
}

}  // namespace tessera::baselines
