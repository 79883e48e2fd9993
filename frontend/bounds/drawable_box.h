#pragma once

#include <optional>

#include "frontend/bounds/screen_bounds.h"
#include "frontend/bounds/sub_patch_bounder.h"

namespace tessera::frontend {

// Bodies of whole drawables, or of large parts of them: boxes in object space that hold control points and offsets.

// Largest distance of a displaced vertex from the box of the control points, for a unit normal computed in single
// precision.
double largest_offset(const scene::PosedDrawable& drawable, const PyramidLibrary& pyramids);

double largest_coordinate(const MovingBox& box);

// The body of the part of a drawable that lies in `box`, at both motion keys, displacement included.
SubPatchBody box_body(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable, const MovingBox& box);

// Returns nullopt for a body that is outside the view or its depth range at all times.
std::optional<ScreenBounds> bounds_in_view(const SubPatchBody& body, const scene::FrameGeometry& frame);
bool outside_view(const SubPatchBody& body, const scene::FrameGeometry& frame);

}  // namespace tessera::frontend
