#pragma once

#include "shaders_cpp/metallic_roughness.h"

namespace tessera::shaders {

// Pixel shader of metallic-roughness materials with glTF's extensions: layers of clearcoat, sheen and the base.
// Extensions change the base's reflectance, lobe and diffuse part (KHR_materials_*; formulas in layered_material.inc).
//
// Invariants (cited by the tests):
//   LAYER1  Without any flag, with f0 and f90 of a dielectric of index 1.5, this equals shade_material() up to rounding; for
//        metalness between 0 and 1, lights see a mixture of both surfaces here, and one surface of mixed reflectance there.
//   LAYER2  In a uniform environment no material returns more than 1.02 of the incoming light; a material that absorbs none
//        returns at least 0.9 in its brightest channel, and, without any flag, 0.98.

inline constexpr float kMinSheenRoughness = 0.07f;

// Constants that are the same for all points of a draw.
struct LayerConstants {
  Vec3 absorption{0.0f};  // -log2(attenuation colour) per unit of length
  float dispersion = 0.0f;
};

namespace scalar {
#include "shaders_cpp/layered_material.inc"
}  // namespace scalar
using namespace scalar;

}  // namespace tessera::shaders
