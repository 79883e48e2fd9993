// Parts of pixel-shader invocations, for the SIMD target in force; for kernel sources that use foreach_target.h.

#include <array>
#include <cstddef>

#include "base/real.h"
#include "base/simd-inl.h"
#include "shaders_cpp/environment_map.h"
#include "shaders_cpp/layered_material.h"
#include "shaders_cpp/radiance_image.h"
#include "shaders_cpp/shadow_map.h"
#include "shaders_cpp/texture.h"

#if defined(TESSERA_SHADERS_CPP_SHADING_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SHADERS_CPP_SHADING_INL_H_
#undef TESSERA_SHADERS_CPP_SHADING_INL_H_
#else
#define TESSERA_SHADERS_CPP_SHADING_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace tessera {
namespace shaders {
namespace HWY_NAMESPACE {

using tessera::HWY_NAMESPACE::Vector3;

// Each file needs the files before it.
// clang-format off
#include "shaders_cpp/bicubic.inc"
#include "shaders_cpp/elementary.inc"
#include "shaders_cpp/texture_sampling.inc"
#include "shaders_cpp/radiance_image.inc"
#include "shaders_cpp/studio_light.inc"
#include "shaders_cpp/surroundings.inc"
#include "shaders_cpp/environment_map.inc"
#include "shaders_cpp/metallic_roughness.inc"
#include "shaders_cpp/layered_material.inc"
#include "shaders_cpp/shadow_texels.inc"
#include "shaders_cpp/shadow_map.inc"
// clang-format on

}  // namespace HWY_NAMESPACE
}  // namespace shaders
}  // namespace tessera
HWY_AFTER_NAMESPACE();

#endif
