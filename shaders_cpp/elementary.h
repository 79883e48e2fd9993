#pragma once

#include "base/real.h"

namespace tessera::shaders {

// In a namespace that argument-dependent lookup does not search: lanes have functions of the same names.
namespace scalar {
#include "shaders_cpp/elementary.inc"
}  // namespace scalar
using namespace scalar;

}  // namespace tessera::shaders
