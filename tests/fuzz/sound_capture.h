#pragma once

#include "frontend/capture.h"

namespace tessera::fuzz {

// Ends the program unless every index of the capture points at something and every number of its geometry is finite:
// what the rest of the program takes for granted.
void require_sound(const frontend::Capture& capture);

}  // namespace tessera::fuzz
