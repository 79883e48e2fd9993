#pragma once

#include "base/image.h"

namespace tessera {

// Differences between two images of the same size, 3 channels, display-referred sRGB values in [0, 1].
// All functions are deterministic, and all but flip_map() are symmetric. They expect equal shapes (checked). `covered`,
// where given, is an image of one channel and the same size (checked): only pixels where it is above 0 count, and there
// must be at least one (checked). Windows and filters still read the neighbours of such pixels.

// Peak signal-to-noise ratio in dB over all channels; infinity for equal images.
double psnr(const Image& a, const Image& b, const Image* covered = nullptr);

// Largest absolute difference of any channel.
double max_difference(const Image& a, const Image& b, const Image* covered = nullptr);

// Mean structural similarity of the luma (Wang et al. 2004: Gaussian window of 11x11, sigma 1.5, K1 = 0.01,
// K2 = 0.03). At the border the window reads the nearest pixel, so that every pixel counts.
double mssim(const Image& a, const Image& b, const Image* covered = nullptr);

// Pixels per degree of visual angle at which the published FLIP figures are stated: 0.7 m from a screen 0.7 m and
// 3840 pixels wide.
inline constexpr double kFlipPixelsPerDegree = 67.0206432766;

// Per-pixel perceived difference of flipping between a reference and a test image, in [0, 1]
// (Andersson et al. 2020, "FLIP: a difference evaluator for alternating images", LDR variant). One channel.
Image flip_map(const Image& reference, const Image& test, double pixels_per_degree = kFlipPixelsPerDegree);

// Mean of a one-channel map.
double mean_value(const Image& map, const Image* covered = nullptr);

}  // namespace tessera
