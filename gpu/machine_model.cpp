#include "gpu/machine_model.h"

#include <utility>

namespace tessera::gpu {

namespace {

// `bound`: with what bounds it.
ViewCost time_work(const hardware::Machine& gpu, const timing::FrameWork& work, timing::WarmCaches* caches,
                   bool bound) {
  ViewCost timed;
  hardware::EnergyEvents energy = timing::energy_events(work);
  if (gpu.queues.model == hardware::TimingModel::kEvents) {
    const timing::WarmCaches before = bound && caches != nullptr ? *caches : timing::WarmCaches();
    timing::EventSchedule events = timing::simulate_events(gpu, work, caches, bound);
    timed.timing.cycles = events.schedule.cycles;
    timed.timing.latency = timing::latency(gpu, events.schedule);
    if (bound) timed.timing = timing::time_events(gpu, work, events, before);
    timed.schedule = std::move(events.schedule);
    // What the caches held in time.
    energy.dram_bytes = events.counts.memory.read_bytes + events.counts.memory.written_bytes;
    energy.l2_lines = events.counts.memory.l2_requests + events.counts.memory.l2_misses;
    if (gpu.shader.costs == hardware::ShaderCosts::kCompiled) {
      energy.shader_invocations = energy.surface_evaluations = 0;
      energy.shader_clocks = timing::compiled_clocks(work);
    }
  } else {
    timed.schedule = timing::schedule_frame(gpu, work);
    timed.timing.cycles = timed.schedule.cycles;
    timed.timing.latency = timing::latency(gpu, timed.schedule);
    if (bound) timed.timing = timing::time_frame(gpu, work, timed.schedule);
  }
  timed.energy = hardware::frame_energy(gpu, energy, timed.timing.cycles);
  return timed;
}

}  // namespace

MachineModel model_machine(const hardware::Machine& gpu, FrameRecord record, timing::WarmCaches* caches) {
  ViewCost timed = time_work(gpu, record.work, caches, true);
  return {std::move(record), std::move(timed.schedule), timed.timing, std::move(timed.energy)};
}

ViewCost view_cost(const hardware::Machine& gpu, const timing::FrameWork& view, timing::WarmCaches* caches) {
  return time_work(gpu, view, caches, true);
}

FrameCost frame_cost(const hardware::Machine& gpu, const std::vector<timing::FrameWork>& views,
                     timing::WarmCaches* caches) {
  FrameCost cost;
  for (std::size_t view = 0; view < views.size(); ++view) {
    const ViewCost timed = view_cost(gpu, views[view], caches);
    if (view == 0)
      cost.timing = timed.timing;
    else
      cost.timing.accumulate(timed.timing);
    cost.energy.accumulate(timed.energy);
  }
  return cost;
}

CycleCost cycle_cost(const hardware::Machine& gpu, const std::vector<timing::FrameWork>& views) {
  CycleCost cost;
  for (const timing::FrameWork& view : views) {
    const ViewCost timed = time_work(gpu, view, nullptr, false);
    cost.cycles += timed.timing.cycles;
    cost.energy_nj += timed.energy.total_nj();
  }
  return cost;
}

}  // namespace tessera::gpu
