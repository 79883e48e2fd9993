#pragma once

#include "base/image.h"
#include "base/vec.h"

namespace tessera::shaders {

// Bloom: light around bright surfaces, as lenses and eyes spread it. A chain of levels is made, each from the level
// above at a lower resolution; on the way back every level adds the smaller ones. The filters come from M. Bjørge,
// "Bandwidth-Efficient Rendering", SIGGRAPH 2015 (dual filtering), with weights that give every level the same share.
//
// Invariants (cited by the tests):
//   BLM1  Weights add up to 1: an image of one colour stays that colour.
//   BLM2  A level equals the formulas in double precision, except for roundings of floats and of the level's format.

// Bilinear lookups of a texel on the way down, and on the way up, where it reads its own level once more.
inline constexpr int kBloomDownLookups = 5, kBloomUpLookups = 8;

// Bilinear lookup of the first three channels at a place in [0, 1]^2; beyond the edge the edge continues. Negative
// numbers and NaN count as 0, and the largest half float is the limit.
Vec3 bloom_lookup(const Image& image, float u, float v);

// Makes the texel (x, y) of a level of width x height from the larger image `from`: half from its centre, an eighth
// from each diagonal at a distance of one texel of `from`.
Vec3 bloom_down(const Image& from, int width, int height, int x, int y);

// The same from the smaller level `from`, on the way up: a sixth from each diagonal at half a texel of `from`, and a
// twelfth along each axis at one texel.
Vec3 bloom_up(const Image& from, int width, int height, int x, int y);

}  // namespace tessera::shaders
