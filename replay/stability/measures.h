#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/image.h"
#include "replay/stability/stage.h"

namespace tessera::replay::stability {

// How far the machine is from double precision. Each measure is shared by the cases of a kind; its faults are what the
// kind's twins break.

// ---- Bounds -----------------------------------------------------------------------------------------------------

enum class BoundFault { kNone, kShrunk, kNoDisplacement, kNoMotion, kNoLens, kNotCut };

// Most pixels by which a point sticks out of the bounds of a sub-patch that it belongs to; negative where all are
// inside. The points are those of the displaced surface in double precision and the machine's vertices, at times and
// points of the lens that lie evenly, its rim included; the sub-patches whole patches, halves and single cells; the
// bounds those of every method.
double overhang(const Stage& stage, BoundFault fault = BoundFault::kNone);

// ---- Vertices ---------------------------------------------------------------------------------------------------

enum class VertexFault { kNone, kSingleMatrices, kNoDenormals };

// Most pixels between a vertex of the machine's tessellator, on its grid and on its straight pieces of motion, and the
// place of the same point at the same time (Judge). Vertices in front of the camera that are in or near the frame
// count.
double vertex_error(const Stage& stage, VertexFault fault = VertexFault::kNone);

// ---- Images -----------------------------------------------------------------------------------------------------

// Linear light and coverage.
Image render(const Stage& stage);

// Samples, of a million, that see another colour than the double-precision renderer (reference/) does with the same
// samples. Colours of the stage are 0 or 1 in each channel, without light.
double wrong_samples(const Stage& machine, const Stage& truth);

// Samples that do not see a grey value: of a surface that covers the whole frame once, white over black, 1; half
// transparent, so that two layers are told from one, 0.5.
double samples_unlike(const Stage& stage, float value);

// Pixels that differ in any bit.
double different_pixels(const Image& a, const Image& b);

// Largest difference of a channel from one colour, in steps of 2^-24 of it, over the pixels of a rectangle in the
// middle of the frame that is `share` of it wide and high.
double steps_from(const Image& image, const Vec3& color, double share);

// Root mean square difference of a channel from the mean of still frames at `stills` times of the shutter, in steps of
// 1/255.
double rms_of_stills(const Stage& stage, int stills);

}  // namespace tessera::replay::stability
