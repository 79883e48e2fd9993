#include "scene/tessellation_settings.h"

namespace tessera::scene {

Keys<TessellationSettings> tessellation_keys() {
  using S = TessellationSettings;
  return {
      {"tessellation.target_edge_pixels", &S::target_edge_pixels, "pixels", 0.25, 64,
       "Wanted length on screen of the sides of tessellated cells; smaller is more exact and slower."},
      {"tessellation.displacement_bias", &S::displacement_bias, "levels", -16, 16,
       "Added to the level of the height map that vertices and normals are made from; 0 fits it to the tessellated "
       "cells, more is smoother, less aliases."},
  };
}

}  // namespace tessera::scene
