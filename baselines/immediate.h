#pragma once

#include <cstdint>
#include <vector>

#include "baselines/depth_pyramid.h"
#include "baselines/tessellated_patch.h"
#include "baselines/tile_drawing.h"
#include "gpu/configuration.h"
#include "gpu/view_observer.h"
#include "tilecore/tile_core.h"

namespace tessera::baselines {

struct ImmediateTraffic {
  std::uint64_t bytes_read = 0, bytes_written = 0;  // through the cache of baselines.cache_bytes
  std::uint64_t bytes_uncached = 0;                 // both, without
};

// Bytes that a colour and depth cache moves in a frame.
struct ImmediateRun {
  ImmediateTraffic traffic;
  std::vector<ImmediateTraffic> moved;  // with the cache, up to the end of each of ImmediateFrame::order
};

struct ImmediateFrame {
  std::vector<DrawnInTile> order;              // as it was drawn
  ImmediateRun immediate;                      // of the machine `immediate`
  ImmediateRun untiled;                        // of the machine `untiled`; empty where it uses tiles
  std::uint64_t blocks_culled = 0;             // pairs of a triangle and a block that hierarchical depth dropped
  std::uint64_t pixel_shader_invocations = 0;  // one per pixel and triangle that passes its depth test
  VisibleTriangles visible;                    // in the end, for machines that defer
  DepthPyramid depths{{}};                     // likewise, for machines that test it
};

// Draws the frame as an immediate-mode machine does: base patch by base patch in submission order, within one area of
// the screen (a tile) after the other, within that triangle by triangle, each against the depth that was drawn before.
// First against the farthest depth of blocks of 8x8 pixels, which is on chip [spec: one value per 8x8 pixels, Adreno's
// LRZ and other hierarchical depth buffers; assumed, in its favour: exact, and never in memory]. A triangle touches the
// lines that hold samples inside it, also where motion and defocus scatter them: exact, not bounded. How patches were
// split and binned for `record` does not matter.
//
// Colour is compressed (CompressedColorMemory) where that moves fewer bytes in the frame than plain lines do: by `untiled`
// always, by `immediate` if immediate.color_compression is on.
ImmediateFrame draw_immediately(const tilecore::TileJob& job, const gpu::ObservedWork& record,
                                const gpu::GpuConfiguration& gpu);

// Whether a pass has tessellated patches, in view or not.
bool has_patches(const scene::FrameGeometry& frame);

}  // namespace tessera::baselines
