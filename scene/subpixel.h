#pragma once

namespace tessera::scene {

// Samples lie on a grid of 1/256 pixel, and so do vertices unless the machine has fewer bits for them
// (tessellator.subpixel_bits). [spec] 8 sub-pixel bits in Direct3D 11 and all current GPUs.
inline constexpr int kSubpixelBits = 8;
inline constexpr float kSubpixels = 256.0f;

// Motion and blur below these thresholds are ignored, vertex by vertex and in every kernel of the tile core. So
// sub-patches that need no code for motion or for the lens can be recognized before they are tessellated
// (sub_patch_effects.h). A projected vertex that moves from shutter open to close by no more than a sub-pixel along
// either axis, and by no more than this share of its depth, does not move: it keeps its place at shutter open.
inline constexpr float kStillPixels = 1.0f / kSubpixels;
inline constexpr float kStillDepth = 0x1p-16f;
// A projected vertex whose circle of confusion has a radius (pixels) of no more than this is in focus: it is seen
// through the lens centre. A lens moves vertices off the grid, so the threshold is not a sub-pixel but the uncertainty
// of float arithmetic.
inline constexpr float kSharpPixels = 0x1p-15f;

// A vertex farther than this from the frame's corner is not rounded to the grid: float could no longer hold the
// difference of two positions exactly. 2^14 pixels with 8 fractional bits are 22 of float's 24.
inline constexpr float kGuardBandPixels = 16384.0f;

}  // namespace tessera::scene
