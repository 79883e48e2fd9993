#pragma once

#include <array>

#include "base/vec.h"
#include "base/vector3.h"
#include "shaders_cpp/elementary.h"
#include "shaders_cpp/radiance_image.h"
#include "shaders_cpp/surroundings.h"

namespace tessera::shaders {

// An environment image in the form that lookups read.
struct EnvironmentMap {
  RadianceView radiance;          // octahedral; level 0 is a mirror's, then one level for each roughness of kMapLevels
  std::array<Vec3, 9> diffuse{};  // factors of 1, x, y, z, xy, yz, zx, 3y^2 - 1, x^2 - z^2
};

namespace scalar {
#include "shaders_cpp/environment_map.inc"
}  // namespace scalar
using namespace scalar;

}  // namespace tessera::shaders
