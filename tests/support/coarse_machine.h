#pragma once

#include "hardware/machine.h"

namespace tessera::test {

// A machine whose time is known by hand: tiles in phases over a memory that moves bytes at a rate, shaders of constant costs,
// vertices in a unit of their own. A test sets what it needs finer.
template <class Machine = hardware::Machine>
Machine coarse_machine(Machine gpu = {}) {
  gpu.queues.model = hardware::TimingModel::kPhases;
  gpu.memory.model = hardware::MemoryModel::kFluid;
  gpu.shader.costs = hardware::ShaderCosts::kConstant;
  gpu.shader.domain = hardware::DomainShading::kUnit;
  return gpu;
}

}  // namespace tessera::test
