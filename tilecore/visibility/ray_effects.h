#pragma once

namespace tessera::tilecore {

// Which effects visibility must handle for a mesh; each combination has kernels of its own.
struct RayEffects {
  bool motion = false, lens = false;
  bool operator==(const RayEffects&) const = default;
};

// Whether the build has code for motion, defocus and displacement: all but those with TESSERA_EFFECTS=static.
#ifdef TESSERA_STATIC_EFFECTS
inline constexpr bool kGeneralEffects = false;
#else
inline constexpr bool kGeneralEffects = true;
#endif

}  // namespace tessera::tilecore
