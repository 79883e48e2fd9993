#pragma once

namespace tessera::tilecore {

// Which effects visibility must handle for a mesh; each combination has kernels of its own.
struct RayEffects {
  bool motion = false, lens = false;
  bool operator==(const RayEffects&) const = default;
};

}  // namespace tessera::tilecore
