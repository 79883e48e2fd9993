#pragma once

#include <array>
#include <cstddef>

#include "base/real.h"
#include "base/vector3.h"

namespace tessera::shaders {

#include "shaders_cpp/bicubic.inc"

}  // namespace tessera::shaders
