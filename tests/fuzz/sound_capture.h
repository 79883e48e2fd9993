#pragma once

#include "scene/capture.h"

namespace tessera::fuzz {

// Ends the program unless every index of the capture points at something and every number of its geometry is finite;
// the rest of the program takes this for granted.
void require_sound(const scene::Capture& capture);

}  // namespace tessera::fuzz
