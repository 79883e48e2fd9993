#include "gpu/machine_model.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"

namespace tessera::gpu {

namespace {

// `bound`: also finds the units that bound the work.
ViewCost time_work(const GpuConfiguration& gpu, const timing::FrameWork& work, timing::WarmCaches* caches, bool bound,
                   std::vector<memory::Burst>* transactions = nullptr) {
  ViewCost timed;
  hardware::EnergyEvents energy = timing::energy_events(work);
  if (gpu.queues.model == hardware::TimingModel::kEvents) {
    timing::EventSchedule events;
    if (bound) {
      timing::TimedEvents bounded = timing::time_events(gpu, work, caches, transactions);
      events = std::move(bounded.events);
      timed.timing = std::move(bounded.timing);
      hardware::Machine coarse = gpu;
      coarse.queues.model = hardware::TimingModel::kPhases;
      timed.timing.coarse_cycles = timing::schedule_frame(coarse, work).cycles;
    } else {
      events = timing::simulate_events(gpu, work, caches);
      timed.timing.cycles = events.schedule.cycles;
      timed.timing.latency = timing::latency(gpu, events.schedule);
    }
    timed.schedule = std::move(events.schedule);
    // Traffic of the caches as events simulated them.
    energy.dram_bytes = events.counts.memory.read_bytes + events.counts.memory.written_bytes;
    energy.counts[hardware::Event::kL2Lines] = events.counts.memory.l2_requests + events.counts.memory.l2_misses;
    for (const timing::WorkRound& round : work.rounds)
      for (const timing::TileItems& items : round.items) energy.counts[hardware::Event::kL2Lines] += items.cache_lines;
    if (gpu.shader.costs == hardware::ShaderCosts::kCompiled)
      timing::take_compiled(gpu, timing::compiled_clocks(gpu, work), energy.counts);
  } else {
    timed.schedule = timing::schedule_frame(gpu, work);
    timed.timing.cycles = timed.schedule.cycles;
    timed.timing.latency = timing::latency(gpu, timed.schedule);
    if (bound) timed.timing = timing::time_frame(gpu, work, timed.schedule);
  }
  timed.events = energy;
  timed.energy = hardware::frame_energy(gpu, energy, timed.timing.cycles, gpu.area().total_mm2());
  return timed;
}

void check_registers(const GpuConfiguration& gpu, const timing::FrameWork& work) {
  if (gpu.queues.model != hardware::TimingModel::kEvents || gpu.shader.costs != hardware::ShaderCosts::kCompiled)
    return;
  std::int64_t registers = 0;
  for (const timing::WorkRound& round : work.rounds)
    for (const timing::TileItems& tile : round.items) {
      for (const timing::WarpItem& warp : tile.warps) registers = std::max<std::int64_t>(registers, warp.registers);
      if (gpu.shader.domain == hardware::DomainShading::kUnit) continue;
      for (const timing::SubPatchItem& item : tile.sub_patches)
        registers = std::max<std::int64_t>(registers, item.domain_registers);
    }
  if (const std::int64_t bytes = registers * 4 * gpu.shader.warp_lanes; bytes > gpu.queues.register_bytes)
    throw UsageError(fmt::format(
        "shader.register_bytes: a shader of the frame takes {} registers, a warp of {} invocations {} bytes; "
        "a core has {}: set more, or less of shader.warp_lanes",
        registers, gpu.shader.warp_lanes, bytes, gpu.queues.register_bytes));
}

}  // namespace

MachineModel model_machine(const GpuConfiguration& gpu, FrameRecord record, timing::WarmCaches* caches,
                           bool keep_transactions) {
  std::vector<memory::Burst> transactions;
  ViewCost timed = view_cost(gpu, record.work, caches, keep_transactions ? &transactions : nullptr);
  return {std::move(record), std::move(timed.schedule), timed.timing, std::move(timed.energy),
          gpu.area(),        std::move(transactions)};
}

ViewCost view_cost(const GpuConfiguration& gpu, const timing::FrameWork& view, timing::WarmCaches* caches,
                   std::vector<memory::Burst>* transactions) {
  check_registers(gpu, view);
  return time_work(gpu, view, caches, true, transactions);
}

FrameCost frame_cost(const GpuConfiguration& gpu, const std::vector<timing::FrameWork>& views,
                     timing::WarmCaches* caches, const EachView& each) {
  FrameCost cost;
  cost.area = gpu.area();
  for (std::size_t view = 0; view < views.size(); ++view) {
    const timing::WarmCaches before = each && caches != nullptr ? *caches : timing::WarmCaches();
    const ViewCost timed = view_cost(gpu, views[view], caches);
    if (each) each(views[view], timed, before);
    if (view == 0)
      cost.timing = timed.timing;
    else
      cost.timing.accumulate(timed.timing);
    cost.energy.accumulate(timed.energy);
  }
  return cost;
}

CycleCost cycle_cost(const GpuConfiguration& gpu, std::span<const timing::FrameWork> views) {
  CycleCost cost;
  for (const timing::FrameWork& view : views) {
    const ViewCost timed = time_work(gpu, view, nullptr, false);
    cost.cycles += timed.timing.cycles;
    cost.energy_nj += timed.energy.total_nj();
    cost.views.emplace_back(timed.events, timed.timing.cycles);
  }
  return cost;
}

double energy_nj(const GpuConfiguration& gpu, const CycleCost& cost) {
  const double mm2 = gpu.area().total_mm2();
  double nj = 0;
  for (const auto& [events, cycles] : cost.views) nj += hardware::frame_energy(gpu, events, cycles, mm2).total_nj();
  return nj;
}

}  // namespace tessera::gpu
