#pragma once

#include <limits>

#include "frontend/bounds/oriented_box.h"
#include "scene/frame_geometry.h"
#include "scene/procedure_patch.h"

namespace tessera::frontend {

// Object-space box of a part of a procedure's base patch, its evaluation's rounding included: the shape instantiated
// with Enclosure. `range` is in the patch's parameters.
MovingBox procedure_box(const scene::ProcedurePatch& patch, const scene::ParameterRange& range);

// A box of a piece's parameters.
struct ParameterBox {
  double u0, v0, u1, v1;
};

// Screen bounds of a box of parameters during the whole shutter, through the whole lens, and the rate at which its
// image changes.
struct ProcedureCellBounds {
  bool outside = false;       // no point of it lies in the depth range; nothing else is set then
  bool faces_away = false;    // all of it shows its back (drawables at rest without lens only)
  bool crosses_near = false;  // some of it may lie in front of the near plane
  double x0, y0, x1, y1;      // pixels, closed
  double near_z, far_z;
  // Largest change of x or of y on screen, in pixels, from the middle of the box to its side along each parameter.
  // Infinite where the shape or the projection has no bounded derivative.
  double reach_u = 0, reach_v = 0;
  // The same by axis.
  double reach_x_u = 0, reach_y_u = 0, reach_x_v = 0, reach_y_v = 0;
  // Largest difference, along x or y, of two of these changes at one key through the lens centre: how far from a
  // straight line its image may bend.
  double bend_u = 0, bend_v = 0;
  MovingBox box;        // of the points, in object space
  double rounding = 0;  // pixels that their single-precision projections may be off
  // The image of a drawable at rest through a pinhole, in pixels: a point at s of [-1, 1] from the box's middle to its
  // side along u, and at t along v, projects to (x, y) + s * (x_u, y_u) + t * (x_v, y_v), with an error along x and
  // along y of at most off + |s| * off_u + |t| * off_v. Infinite if no bound is known.
  struct Image {
    double x = 0, y = 0, x_u = 0, y_u = 0, x_v = 0, y_v = 0;
    double off = std::numeric_limits<double>::infinity(), off_u = 0, off_v = 0;
  };
  Image image;
};

// Bounds hold for every (u, v) of the box, every time and every lens point at which the point lies in front of the near
// plane, rounding included; so does the reach, for derivatives of the exact image. Points move linearly between the
// keys in raster space (see FrameGeometry), even if the shape's numbers differ between them.
ProcedureCellBounds bound_procedure_cell(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable,
                                         std::size_t piece, const ParameterBox& box);

}  // namespace tessera::frontend
