#pragma once

#include "hardware/machine.h"

namespace tessera::test {

// A machine whose time is known by hand: tiles in phases over a memory that moves bytes at a rate, shaders of
// constant costs, vertices in a unit of their own. A test refines the settings that it needs.
template <class Machine = hardware::Machine>
Machine coarse_machine(Machine gpu = {}) {
  gpu.queues.model = hardware::TimingModel::kPhases;
  gpu.memory.model = hardware::MemoryModel::kFluid;
  gpu.shader.costs = hardware::ShaderCosts::kConstant;
  gpu.shader.domain = hardware::DomainShading::kUnit;
  return gpu;
}

// Such a machine of one core, in which nothing takes time; simulated item by item. A test makes one thing slow.
template <class Machine = hardware::Machine>
Machine endless_machine() {
  auto gpu = coarse_machine<Machine>();
  gpu.queues.model = hardware::TimingModel::kEvents;
  gpu.cores.count = 1;
  gpu.rates.fill(1e30);
  gpu.shader.operations = gpu.shader.surface_operations = gpu.shader.background_operations = 0;
  gpu.set_bytes_per_clk(1e30);
  gpu.memory.gpu_share = 1;
  gpu.set_latency_clk(0);
  gpu.queues.texture_latency_clk = gpu.queues.l2_latency_clk = 0;
  gpu.queues.l2_lines_per_clk = 1e30;
  return gpu;
}

}  // namespace tessera::test
