#include "tilecore/procedural/procedure_settings.h"

namespace tessera::tilecore {

Keys<ProcedureSettings> procedure_keys() {
  using S = ProcedureSettings;
  return {
      {"procedures.path", &S::path,
       "Drawing of procedures: by the sampling controller, or as ordinary patches whose vertices the procedure "
       "evaluates."},
      {"procedures.mode", &S::mode,
       "Method of the sampling controller: cells bounded by interval evaluation and samples that cover their "
       "footprints; or, as published, one tuple per cell with a padded radius, samples written to the sub-pixel that "
       "holds them (unless they move or are out of focus), and geometry images read through the core's texture cache."},
      {"procedures.style", &S::style, "Shaded surfaces, or a drawing with lines along the parameters."},
      {"procedures.spacing", &S::spacing, "sub-pixels", 0.125, 64,
       "Samples are so dense that no footprint reaches farther than this from its middle; smaller is more exact and "
       "slower. In published mode at most 1, between samples."},
      {"procedures.flatness", &S::flatness, "pixels", 1e-3, 64,
       "Samples are also so dense that a smooth surface leaves the plane of a footprint by no more than this."},
      {"procedures.cell_pixels", &S::cell_pixels, "pixels", 1, 512,
       "Interval mode: cells of the parameter domain larger than this on screen are halved."},
      {"procedures.padding", &S::padding, "", 0, 16,
       "Published mode: padding of a cell's place on screen, in its radius."},
      {"procedures.sparse_spacing", &S::sparse_spacing, "sub-pixels", 0.5, 256,
       "Published mode: distance of the tuples of the sparse pass."},
  };
}

}  // namespace tessera::tilecore
