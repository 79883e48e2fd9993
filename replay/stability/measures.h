#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/image.h"
#include "replay/stability/stage.h"

namespace tessera::replay::stability {

// Errors of the machine against double precision. The cases of a kind share a measure; the kind's twins inject its
// faults.

// ---- Bounds -----------------------------------------------------------------------------------------------------

enum class BoundFault { kNone, kShrunk, kNoDisplacement, kNoMotion, kNoLens, kNotCut };

// The largest distance in pixels by which a point sticks out of the bounds of its sub-patch; negative where all points
// are inside. The points are points of the displaced surface in double precision and the machine's vertices, at evenly
// spaced times and points of the lens, its rim included. The sub-patches are whole patches, halves and single cells;
// each of them is tested against the bounds of every method.
double overhang(const Stage& stage, BoundFault fault = BoundFault::kNone);

// ---- Vertices ---------------------------------------------------------------------------------------------------

enum class VertexFault { kNone, kSingleMatrices, kNoDenormals };

// The largest distance in pixels between a vertex of the machine's tessellator, on its grid and on its straight pieces
// of motion, and the place of the same point at the same time (Judge). Only vertices in front of the camera and in or
// near the frame count.
double vertex_error(const Stage& stage, VertexFault fault = VertexFault::kNone);

// ---- Images -----------------------------------------------------------------------------------------------------

// The rendered image: linear light and coverage.
Image render(const Stage& stage);

// Samples, of a million, whose colour differs from the double-precision renderer's (reference/) for the same samples.
// Colours of the stage are 0 or 1 in each channel, without light.
double wrong_samples(const Stage& machine, const Stage& truth);

// Number of samples that do not have this grey value. For a surface that covers the whole frame once, it is 1 for white
// over black, and 0.5 for a half-transparent surface, which tells two layers from one.
double samples_unlike(const Stage& stage, float value);

// Number of pixels that differ in any bit.
double different_pixels(const Image& a, const Image& b);

// Largest difference of a channel from one colour, in steps of 2^-24 of it, over the pixels of a rectangle in the
// middle of the frame that is `share` of it wide and high.
double steps_from(const Image& image, const Vec3& color, double share);

// Root mean square difference of a channel from the mean of still frames at `stills` times of the shutter, in steps of
// 1/255.
double rms_of_stills(const Stage& stage, int stills);

}  // namespace tessera::replay::stability
