#include "tilecore/procedural/procedure_settings.h"

namespace tessera::tilecore {

Keys<ProcedureSettings> procedure_keys() {
  using S = ProcedureSettings;
  return {
      {"procedures.path", &S::path,
       "How procedures are drawn: by the sampling controller, or as ordinary patches whose vertices the procedure "
       "evaluates."},
      {"procedures.maps", &S::maps,
       "Sparse pass of the sampling controller: cells bounded by interval evaluation, or one tuple per cell and a "
       "padded radius."},
      {"procedures.scatter", &S::scatter,
       "What a sample writes: the sample points inside its footprint, or, as published, the sub-pixel it falls into "
       "(still objects only)."},
      {"procedures.style", &S::style, "Shaded surfaces, or a drawing with lines along the parameters."},
      {"procedures.lists", &S::lists,
       "What a tile knows of a piece: the cells that it may see, or one range of the parameters that holds them all; "
       "it "
       "then evaluates the cells between in vain."},
      {"procedures.crossing", &S::crossing,
       "Samples whose footprints reach several tiles: evaluated by each; or by the tile of their middle alone, and "
       "what "
       "falls outside is lost, as published, or handed to the other tiles through memory."},
      {"procedures.image_reads", &S::image_reads,
       "Geometry images are read through the L2 for each cell, or through the core's texture cache, emptied before "
       "every tile."},
      {"procedures.spacing", &S::spacing, "sub-pixels", 0.125, 64,
       "Samples are so dense that no footprint reaches farther than this from its middle; smaller is more exact and "
       "slower."},
      {"procedures.flatness", &S::flatness, "pixels", 1e-3, 64,
       "And so dense that a smooth surface leaves the plane of a footprint by no more than this."},
      {"procedures.cell_pixels", &S::cell_pixels, "pixels", 1, 512,
       "Interval maps: cells of the parameter domain larger than this on screen are halved."},
      {"procedures.padding", &S::padding, "", 0, 16,
       "Published maps: padding of a cell's place on screen, in its radius."},
      {"procedures.sparse_spacing", &S::sparse_spacing, "sub-pixels", 0.5, 256,
       "Published maps: distance of the tuples of the sparse pass."},
      {"procedures.refill", &S::refill,
       "Look for holes between samples, tile by tile, and sample them again; for spacings too wide for the scatter."},
      {"procedures.lanes", &S::lanes, "lanes", 1, 1024, "Lanes of the emulated SIMD array."},
  };
}

}  // namespace tessera::tilecore
