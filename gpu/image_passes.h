#pragma once

#include "gpu/tile_scheduler.h"

namespace tessera::gpu {

// Charges tiles for reading or writing their parts of a level of the image behind surfaces that transmit.
void move_scene_color(WorkRecorder::Round& round, const OrderedTiles& tiles, const tilecore::TileJob& job, int level,
                      bool write);

// Makes the smaller levels of that image from its largest one.
ImagePass reduce_pass(const ViewRun& run, const OrderedTiles& tiles);
// Fills the pixels that resolve stencils left open because they reach into neighbouring tiles.
ImagePass stencil_pass(const ViewRun& run);
// Mixes the view's colours into its history; the view must outlive it.
ImagePass taa_pass(const ViewRun& run, const OrderedTiles& tiles);
// Runs a step of the view's bloom, whose levels are `images`; all of them must outlive it.
ImagePass bloom_pass(const ViewRun& run, const OrderedTiles& tiles, const BloomStep& step, std::vector<Image>& images);
// Copies an attachment and adds the bloom whose largest level is `bloom`, unless nullptr. All of them must outlive it.
ImagePass copy_pass(const ViewRun& run, const OrderedTiles& tiles, const CopyPass& copy, const Image* bloom);

}  // namespace tessera::gpu
