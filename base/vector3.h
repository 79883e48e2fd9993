#pragma once

namespace tessera {

#include "base/vector3.inc"

}  // namespace tessera
