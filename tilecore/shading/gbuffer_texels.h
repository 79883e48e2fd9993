#pragma once

#include "tilecore/resolve/stored_texels.h"
#include "tilecore/shading/shading_settings.h"

namespace tessera::tilecore {

// Texels of a G-buffer in memory, depths of the packed layout apart (gbuffer.h).
//   exact   16 words: depth, triangle and weights of the visibility record, then the twelve values. Floats are in the order
//           of their values.
//   packed  the words of gbuffer_packing.h by their fields; with fewer bits the last one is missing. Words beyond them
//           (gbuffer.bits) are what renderers keep whose materials this machine does not have: they are unknown planes.
// A sample that no invocation filled has zeros, but for the colour of a surface that was shaded forward, which is in the place of
// the emission.
TexelFormat gbuffer_format(const ShadingSettings& settings, int samples);

}  // namespace tessera::tilecore
