#pragma once

// Upper bound of the box and triangle tests per second of this machine: the arithmetic of visibility alone, for comparison
// with the kernels of tilecore/visibility/sample_tests.h. Data lie in the first-level cache with unit stride; results are
// masks; there is no gather, and hits are not processed. The roofline of a test is the better of its two arrangements.
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace tessera::bench {

constexpr std::size_t kPrimitives = 64, kSamples = 256;
static_assert(kPrimitives <= kSamples);

// Use of lanes: a primitive in registers against samples, or a sample in registers against primitives.
enum class Arrangement { kOnePrimitive, kOneSample };

// Raster-space samples at time t; boxes [low + t d_low, high + t d_high]; cells of four corners at (x, y, z), and at
// (x1, y1, z1) at shutter close.
template <std::size_t kCount>
struct alignas(64) Column : std::array<float, kCount> {};

struct RooflineInput {
  Column<kSamples> x, y, t;
  struct Box {
    Column<kPrimitives> x_low, x_d_low, x_high, x_d_high, y_low, y_d_low, y_high, y_d_high;
  } box;
  struct Corner {
    Column<kPrimitives> x, y, dx, dy, z, dz, z1;
  };
  std::array<Corner, 4> corner;
};

// Result bits of the tests, lane by lane, vector by vector: for every primitive all samples, or for every sample all
// primitives. Cells have two consecutive masks, for their triangles (a, b, c) and (a, c, d).
using Masks = std::vector<std::uint8_t>;

enum class RooflineTest { kBoxes, kLinearTriangles, kPerspectiveTriangles };

// Makes primitives of about a pixel in an 8x8 block, which move by up to four pixels.
RooflineInput make_roofline_input();
// Number of tests in one pass over all pairs.
std::size_t tests_in_pass(RooflineTest test);
// Runs one pass on the SIMD target in force. `masks` has as many elements as the pass has tests.
void test_all(RooflineTest test, const RooflineInput& in, Arrangement arrangement, Masks& masks);
// Whether masks equal the results of the scalar tests, with some bits set.
bool is_verified(RooflineTest test, const RooflineInput& in, Arrangement arrangement, const Masks& masks);
// Tests per second of the better arrangement, by this thread's processor time over about `seconds` each. Throws
// std::runtime_error if the masks are wrong.
double roofline(RooflineTest test, double seconds);

}  // namespace tessera::bench
