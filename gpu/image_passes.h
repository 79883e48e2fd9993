#pragma once

#include "gpu/tile_scheduler.h"

namespace tessera::gpu {

// Charges tiles for reading or writing their parts of a level of the image behind surfaces that transmit.
void move_scene_color(WorkRecorder::Round& round, const OrderedTiles& tiles, const tilecore::TileJob& job, int level,
                      bool write);

// Makes the smaller levels of that image from its largest one.
ImagePass reduce_pass(const ViewRun& run, const OrderedTiles& tiles);
// Fills what resolve stencils that reach into neighbouring tiles left open.
ImagePass stencil_pass(const ViewRun& run);
// Copies an attachment. `copy` must outlive it.
ImagePass copy_pass(const ViewRun& run, const CopyPass& copy);

}  // namespace tessera::gpu
