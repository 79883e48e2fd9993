#pragma once

#include "base/image.h"
#include "base/vec.h"

namespace tessera::shaders {

// Bloom: light around what is bright, as lenses and eyes spread it. A chain of levels, each made from the one above at a
// lower resolution; on the way back every level takes in what the smaller ones hold. The filters are those of
// M. Bjørge, "Bandwidth-Efficient Rendering", SIGGRAPH 2015 (dual filtering), with weights that make every level count as
// much as any other.
//
// Invariants (cited by the tests):
//   BLM1  Weights add up to 1: an image of one colour stays that colour.
//   BLM2  A level is what the formulas say in double precision, but for roundings of floats and of the level's format.

// Bilinear lookups of a texel on the way down and on the way up; the latter reads its own level once more.
inline constexpr int kBloomDownLookups = 5, kBloomUpLookups = 8;

// Bilinear lookup of the first three channels at a place in [0, 1]^2; beyond the edge is what lies at it. What is negative
// or no number is no light, and none is brighter than the largest half float.
Vec3 bloom_lookup(const Image& image, float u, float v);

// The texel (x, y) of a level of width x height that is made from the larger image `from`: half from its middle, an eighth
// from each diagonal, a texel of `from` away.
Vec3 bloom_down(const Image& from, int width, int height, int x, int y);

// The same from the smaller level `from`, on the way up: a sixth from each diagonal, half a texel of `from` away, and a
// twelfth along each axis, a texel away.
Vec3 bloom_up(const Image& from, int width, int height, int x, int y);

}  // namespace tessera::shaders
