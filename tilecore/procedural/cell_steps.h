#pragma once

#include <algorithm>
#include <cstdint>

namespace tessera::tilecore {

// What of a cell's image decides how many samples it needs. From its middle to its side, along u and along v:
struct CellReach {
  double x_u = 0, y_u = 0, x_v = 0, y_v = 0;  // pixels along x and along y, at most
  double bend_u = 0, bend_v = 0;              // by how much two such ways differ, in pixels
};

// How many samples a cell has along each parameter: the fewest whose footprints are small and flat enough.
//
// Invariants (cited by the tests):
//   CEL1  for_reach(): half a step along u and half a step along v together move a sample's image by at most `most` pixels
//         along x, and along y, and its surface leaves its footprint's plane by no more than `flat` pixels as bend() tells,
//         unless `clamped`; with one step fewer along either parameter one of this would not be so.
//   CEL2  No pair with a smaller product is enough.
struct CellSteps {
  static constexpr std::uint16_t kMax = 128;
  // Where the reach is no number or infinite.
  static constexpr std::uint16_t kUnknown = 16;

  std::uint16_t u = 1, v = 1;

  // `clamped` becomes true where kMax is too few, or nothing is known.
  static CellSteps for_reach(const CellReach& reach, double most, double flat, bool& clamped);

  std::uint32_t count() const { return std::uint32_t{u} * v; }
  // Pixels that a smooth surface leaves the plane of a footprint at its sides: what the derivatives vary within the cell
  // they vary evenly, over two halves of it, and half of that is what adds up within half a step (Taylor).
  double bend(const CellReach& r) const { return (r.bend_u / u + r.bend_v / v) * std::max(1.0 / u, 1.0 / v) / 4; }
  bool operator==(const CellSteps&) const = default;
};

}  // namespace tessera::tilecore
