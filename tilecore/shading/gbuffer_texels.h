#pragma once

#include "tilecore/resolve/stored_texels.h"
#include "tilecore/shading/shading_settings.h"

namespace tessera::tilecore {

// Texels of a G-buffer in memory, depths of the packed layout apart (gbuffer.h).
//   exact   16 words: depth, triangle and weights of the visibility record, then the twelve values. Floats are in the order
//           of their values.
//   packed  the words of gbuffer_packing.h by their fields; with fewer bits the last one is missing. Words beyond them
//           (gbuffer.bits) are what renderers keep whose materials this machine does not have: they are unknown planes.
// A sample that sees nothing has zeros. The colour of a surface that was shaded forward takes the place of the values: of the
// emission, or as half floats of the first two packed words.
TexelFormat gbuffer_format(const ShadingSettings& settings, int samples);

}  // namespace tessera::tilecore
