#include "scene/shadow_settings.h"

namespace tessera::scene {

Keys<ShadowSettings> shadow_keys() {
  using S = ShadowSettings;
  return {
      {"shadows.filter", &S::filter,
       "How a shadow is looked up: one comparison with the nearest texel; four, weighed bilinearly (2x2); or a box of "
       "three by three of these, which reads 16 texels (3x3)."},
      {"shadows.format", &S::format,
       "How maps hold depths, which are linear between the nearest and the farthest caster: 16 bits, 24 bits in 4 "
       "bytes, "
       "or single precision."},
      {"shadows.size", &S::size, "texels", 0, 16384, "Along the sides of all maps; 0 takes the capture's."},
      {"shadows.cascades", &S::cascades, "", 0, 8, "Maps of a directional light; 0 takes the capture's."},
      {"shadows.fit", &S::fit,
       "How maps of a directional light lie over their parts of the view: over the sphere around "
       "the part, in steps of whole texels, so that edges stand still while the camera moves; over "
       "the part's own box; or over the box of the shadow receivers in it."},
      {"shadows.faces", &S::faces, "Which sides of single-sided surfaces cast."},
      {"shadows.blended", &S::blended, "Whether blended surfaces cast none, or as if they were opaque."},
      {"shadows.grids", &S::grids,
       "Which view sets the tessellation of patches in a map: the light's own, or the camera's. With the camera's a "
       "still "
       "surface is the same triangles in both views, and curved or displaced surfaces do not shade themselves."},
      {"shadows.times", &S::times, "", 1, 16,
       "Times of the shutter of which each light has maps, evenly spread, where anything moves. Receivers that move "
       "are "
       "looked up where they are at the time of a map, in the maps of all times, and the mean is taken."},
      {"shadows.bias", &S::bias, "", 0, 64,
       "Factor on the bias of a lookup: half a texel of the receiver's slope, half a step of the "
       "depths' format, and the shift by rounding vertices to sub-pixels."},
      {"shadows.offset", &S::offset, "scene units", 0, 1e6, "Is added to the bias of a lookup."},
      {"shadows.max_slope", &S::max_slope, "", 0, 1e6,
       "The steepest slope, depth over width, that the bias and the texels around a lookup take of a receiver."},
  };
}

}  // namespace tessera::scene
