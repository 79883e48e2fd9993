#pragma once

#include "base/key_table.h"

namespace tessera::scene {

// Accuracy knobs of tessellation; keys tessellation.*.
struct TessellationSettings {
  double target_edge_pixels = 3.0;  // wanted length of a cell's side on screen
  double displacement_bias = 0.0;   // added to the level of detail at which heights are read

  bool operator==(const TessellationSettings&) const = default;
};
Keys<TessellationSettings> tessellation_keys();

}  // namespace tessera::scene
