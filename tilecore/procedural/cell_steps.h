#pragma once

#include <algorithm>
#include <cstdint>

namespace tessera::tilecore {

// Properties of a cell's image that decide its number of samples. From its middle to its side, along u and along v:
struct CellReach {
  double x_u = 0, y_u = 0, x_v = 0, y_v = 0;  // pixels along x and along y, at most
  double bend_u = 0, bend_v = 0;              // largest difference of two such changes, in pixels
};

// Number of samples of a cell along each parameter: the fewest whose footprints are small and flat enough.
//
// Invariants (cited by the tests):
//   CEL1  for_reach(): half a step along u and half a step along v together move a sample's image by at most `most` pixels
//         along x, and along y, and its surface leaves its footprint's plane by no more than `flat` pixels (bend()),
//         unless `clamped`; with one step fewer along either parameter this would fail.
//   CEL2  No pair with a smaller product is enough.
struct CellSteps {
  static constexpr std::uint16_t kMax = 128;
  // Used if the reach is NaN or infinite.
  static constexpr std::uint16_t kUnknown = 16;

  std::uint16_t u = 1, v = 1;

  // Sets `clamped` to true if kMax is too few, or if the reach is unknown.
  static CellSteps for_reach(const CellReach& reach, double most, double flat, bool& clamped);

  std::uint32_t count() const { return std::uint32_t{u} * v; }
  // Pixels by which a smooth surface leaves the plane of a footprint at its sides. Derivatives vary evenly within the
  // cell, over its two halves; half of their change adds up within half a step (Taylor).
  double bend(const CellReach& r) const { return (r.bend_u / u + r.bend_v / v) * std::max(1.0 / u, 1.0 / v) / 4; }
  bool operator==(const CellSteps&) const = default;
};

}  // namespace tessera::tilecore
