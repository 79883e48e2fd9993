#pragma once

#include "tests/support/tests.h"

namespace tessera::test {

// Captures on the border between needing an effect and not needing it. The shutter is open from second 0 to second 1.

// Objects and cameras that move by fractions of a sub-pixel to a few pixels, around the focus of a lens.
std::unique_ptr<scene::Capture> slow_scene(std::uint32_t seed);
// Displacement maps that are zero over most of their patches, and a closed surface whose shared edges read several of
// them.
std::unique_ptr<scene::Capture> partly_displaced_scene(std::uint32_t seed);
// Masked patches and triangles whose textures have holes here and there.
std::unique_ptr<scene::Capture> masked_scene(std::uint32_t seed);
// A still wall that fills the image, and one ball in front of it that moves; the camera moves by `camera_way`.
std::unique_ptr<scene::Capture> one_moving_ball(const DVec3& ball_way, const DVec3& camera_way = DVec3(0.0));

}  // namespace tessera::test
