#pragma once

namespace tessera::frontend {

// Samples lie on a grid of 1/256 pixel, and so do vertices unless the machine has fewer bits for them (tessellator.subpixel_bits).
// [spec] 8 sub-pixel bits in Direct3D 11 and all current GPUs.
inline constexpr int kSubpixelBits = 8;
inline constexpr float kSubpixels = 256.0f;

// Farther out than this from the frame's corner a vertex is not put on the grid: float could no longer hold the
// difference of two positions exactly. 2^14 pixels with 8 fractional bits are 22 of float's 24.
inline constexpr float kGuardBandPixels = 16384.0f;

}  // namespace tessera::frontend
