#pragma once

#include "frontend/bounds/enclosure.h"

namespace tessera::frontend {

// The functions besides arithmetic that shapes of procedures (shaders_cpp/procedures) call on Enclosure. Each result
// holds the float function's result for all float arguments inside the argument's bounds.

// Exact within 2^-21, as sincos_by_series, apart from the argument's error.
void real_sincos_turns(const Enclosure& turns, Enclosure& sine, Enclosure& cosine);

// Constant if it is certain; otherwise its slopes are unknown.
Enclosure real_floor(const Enclosure& a);
// x or y if the comparison is certain; otherwise the hull of both with unknown slopes: they may differ where a and b
// meet.
Enclosure select_less(const Enclosure& a, const Enclosure& b, const Enclosure& x, const Enclosure& y);

Enclosure plane_noise(const Enclosure& x, const Enclosure& y);

Enclosure image_value(const float* values, int width, int height, const Enclosure& u, const Enclosure& v);

// Ranges over an interval, exposed for tests.
Interval sine_of_turns(const Interval& turns);
struct NoiseRange {
  Interval value, by_x, by_y;
};
NoiseRange noise_range(const Interval& x, const Interval& y);

}  // namespace tessera::frontend
