#pragma once

namespace tessera::tilecore {

// Effects that visibility must handle for a mesh; each combination has its own kernels.
struct RayEffects {
  bool motion = false, lens = false;
  bool operator==(const RayEffects&) const = default;
};

// Whether the build has code for motion, defocus and displacement; a build with TESSERA_EFFECTS=static lacks it.
#ifdef TESSERA_STATIC_EFFECTS
inline constexpr bool kGeneralEffects = false;
#else
inline constexpr bool kGeneralEffects = true;
#endif

}  // namespace tessera::tilecore
