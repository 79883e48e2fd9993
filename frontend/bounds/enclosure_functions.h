#pragma once

#include "frontend/bounds/enclosure.h"

namespace tessera::frontend {

// What shapes of procedures (shaders_cpp/procedures) ask of Enclosure besides arithmetic. Each holds the float
// function's result for all float arguments inside the argument's bounds.

// Within 2^-21 of the truth, as sincos_by_series is, besides what the argument's error does.
void real_sincos_turns(const Enclosure& turns, Enclosure& sine, Enclosure& cosine);

// Constant where it is certain; else its slopes are unknown.
Enclosure real_floor(const Enclosure& a);
// Of x and y the one that is certain; else any of both, with unknown slopes: they may differ where a and b meet.
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
