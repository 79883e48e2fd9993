#pragma once

#include "scene/capture.h"

// Scenes that desampling once got wrong: for tests of the resolve unit and for the images of docs/resolve.md. Their frames
// are kFaultWidth x kFaultHeight pixels.
namespace tessera::test {

inline constexpr int kFaultWidth = 640, kFaultHeight = 360;

// A wall whose normals turn while its vertices stay where they are.
scene::Capture turning_normals();
// One of two walls changes its colour.
scene::Capture changing_colour();
// The camera of `stroll` jumps at the middle of its walk, from frame 29 to 30.
scene::Capture walk_with_a_cut();
// A textured board crosses the frame at 12 pixels a frame, and stands still from frame 10 to the next.
scene::Capture board_that_stops();
// A bowl of brass whose lip hides its inside, slowly turned.
scene::Capture bowl_of_brass();
// A box whose faces a light tells apart, crossing the frame at rates that reconstruct.
scene::Capture box_with_creases();
// A torch that moves over a floor.
scene::Capture moving_torch();

}  // namespace tessera::test
