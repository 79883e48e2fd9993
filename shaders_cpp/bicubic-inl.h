// The bicubic domain shader for the SIMD target in force; for kernel sources that use foreach_target.h.

#include <array>
#include <cstddef>

#include "base/real.h"
#include "base/simd-inl.h"

#if defined(TESSERA_SHADERS_CPP_BICUBIC_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SHADERS_CPP_BICUBIC_INL_H_
#undef TESSERA_SHADERS_CPP_BICUBIC_INL_H_
#else
#define TESSERA_SHADERS_CPP_BICUBIC_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace tessera {
namespace shaders {
namespace HWY_NAMESPACE {

using tessera::HWY_NAMESPACE::Vector3;

#include "shaders_cpp/bicubic.inc"

}  // namespace HWY_NAMESPACE
}  // namespace shaders
}  // namespace tessera
HWY_AFTER_NAMESPACE();

#endif
