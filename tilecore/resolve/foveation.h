#pragma once

#include <cmath>
#include <string>

#include "base/vec.h"

namespace tessera::tilecore {

// The settings of foveation, for frames of any size.
struct FoveationSettings {
  double r0 = 0, r1 = 0;                // pixels; r0 = 0: off
  double focus_x = 0.5, focus_y = 0.5;  // of the frame
  std::string focus_node;               // node that the focus follows; "": the focus rests

  bool on() const { return r0 > 0; }
};

// Foveated rendering: areas far from the focus of the gaze need fewer samples. The rate falls in steps, so that
// neighbouring blocks share a pattern.
struct Foveation {
  bool on = false;
  Vec2 focus{0.0f};      // pixels of the frame
  float r0 = 0, r1 = 0;  // pixels; r0 <= r1

  Foveation() = default;
  // `focus_of_frame`: in widths and heights of the frame.
  Foveation(const FoveationSettings& settings, DVec2 focus_of_frame, int width, int height)
      : on(settings.on()),
        focus(static_cast<float>(focus_of_frame.x * width), static_cast<float>(focus_of_frame.y * height)),
        r0(static_cast<float>(settings.r0)),
        r1(static_cast<float>(settings.r1)) {}

  // Most samples of a block of 4x4 pixels whose middle is at `middle`: 16 up to r0, 8 up to r1, 4 beyond. Without
  // foveation 32, which limits no block.
  int max_samples(Vec2 middle) const {
    if (!on) return 32;
    const Vec2 d = middle - focus;
    const float distance2 = d.x * d.x + d.y * d.y;
    return distance2 <= r0 * r0 ? 16 : distance2 <= r1 * r1 ? 8 : 4;
  }
};

}  // namespace tessera::tilecore
