#pragma once

#include <cstdint>

#include "base/vec.h"
#include "base/vector3.h"
#include "shaders_cpp/elementary.h"
#include "shaders_cpp/studio.h"

namespace tessera::shaders {

// What lights surfaces from all around, as scalar registers hold it. Which kind it is is known when a shader is
// compiled.
struct Surroundings {
  enum class Kind : std::uint8_t {
    kStudio,  // studio.h
    kUniform  // the same radiance from everywhere: a furnace
  };
  Kind kind = Kind::kStudio;
  float intensity = 1.0f;  // factor on all of it; the radiance of a uniform one

  bool operator==(const Surroundings&) const = default;
};

namespace scalar {
#include "shaders_cpp/studio_light.inc"
#include "shaders_cpp/surroundings.inc"
}  // namespace scalar
using namespace scalar;

}  // namespace tessera::shaders
