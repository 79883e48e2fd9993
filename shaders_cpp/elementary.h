#pragma once

#include "base/real.h"

namespace tessera::shaders {

// Not found by the arguments' namespace: lanes have functions of the same names.
namespace scalar {
#include "shaders_cpp/elementary.inc"
}  // namespace scalar
using namespace scalar;

}  // namespace tessera::shaders
