#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>

#include "timing/bound.h"

namespace tessera::timing {

// Cycles of a frame up to a moment, split by unit along the chain of events that led to it. Each event is caused by
// the event whose handling asked for it, or by the last one that it waited for. The parts add up to the moment.
inline constexpr std::size_t kPathParts = hardware::kStageCount + 2;  // stages, kLatency, kL2
struct PathTime {
  std::array<double, kPathParts> clk{};

  double& operator[](Bound part) { return clk[index(part)]; }
  double operator[](Bound part) const { return clk[index(part)]; }
  double total() const { return std::accumulate(clk.begin(), clk.end(), 0.0); }
};
static_assert(index(Bound::kLatency) + 1 == index(Bound::kL2) && index(Bound::kL2) + 1 == kPathParts);

// Splits the time from one moment to another: up to `first_clk` to `first`, then up to `second_clk` to `second`, the
// remainder to `rest`. A wait for a unit that is busy with other work belongs to that unit.
struct Spent {
  Bound rest{};
  Bound first{};
  double first_clk = 0;
  Bound second{};
  double second_clk = 0;

  Spent(Bound all) : rest(all) {}
  Spent(hardware::Stage all) : rest(bound_of(all)) {}
  Spent(Bound all, Bound before, double before_clk, Bound then = {}, double then_clk = 0)
      : rest(all), first(before), first_clk(before_clk), second(then), second_clk(then_clk) {}

  void add_to(PathTime& path, double clk) const {
    if (clk <= 0) return;
    const double before = std::clamp(first_clk, 0.0, clk), then = std::clamp(second_clk, 0.0, clk - before);
    path[first] += before;
    path[second] += then;
    path[rest] += clk - before - then;
  }
};

}  // namespace tessera::timing
