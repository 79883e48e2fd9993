#include "tilecore/procedural/cell_steps.h"

#include <cmath>

namespace tessera::tilecore {
namespace {

bool enough(const CellReach& r, const CellSteps& steps, double most, double flat) {
  const double u = steps.u, v = steps.v;
  return r.x_u / u + r.x_v / v <= most && r.y_u / u + r.y_v / v <= most && steps.bend(r) <= flat;
}

}  // namespace

CellSteps CellSteps::for_reach(const CellReach& r, double most, double flat, bool& clamped) {
  if (!std::isfinite(r.x_u + r.y_u + r.x_v + r.y_v + r.bend_u + r.bend_v)) {
    clamped = true;
    return {kUnknown, kUnknown};
  }
  // If kMax is too few along one parameter, each gets half of the reach.
  const auto half = [&](double reach) {
    return static_cast<std::uint16_t>(std::clamp(std::ceil(2 * reach / most), 1.0, static_cast<double>(kMax)));
  };
  CellSteps best{half(std::max(r.x_u, r.y_u)), half(std::max(r.x_v, r.y_v))};
  bool found = false;
  for (std::uint16_t u = 1; u <= kMax; ++u) {
    // More steps along u than the best pair's product do not help, even with one step along v.
    if (found && u >= best.count()) break;
    // The fewest along v: more are enough where fewer are.
    std::uint16_t low = 1, high = found ? static_cast<std::uint16_t>((best.count() - 1) / u) : kMax;
    if (!enough(r, {u, std::min(high, kMax)}, most, flat)) continue;
    high = std::min(high, kMax);
    while (low < high) {
      const auto middle = static_cast<std::uint16_t>((low + high) / 2);
      if (enough(r, {u, middle}, most, flat))
        high = middle;
      else
        low = static_cast<std::uint16_t>(middle + 1);
    }
    best = {u, high};
    found = true;
  }
  clamped = clamped || !found;
  return best;
}

}  // namespace tessera::tilecore
