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
  std::uint64_t bytes_uncached = 0;                 // read and written without a cache
};

// Bytes that a colour and depth cache moves in a frame.
struct ImmediateRun {
  ImmediateTraffic traffic;
  std::vector<ImmediateTraffic> moved;  // with the cache, up to the end of each element of ImmediateFrame::order
};

// Depths that a prepass has left, by tile and sample (TileDrawing::depths).
struct PrepassDepths {
  std::vector<std::vector<float>> tiles;
};

struct ImmediateFrame {
  std::vector<DrawnInTile> order;              // in the order of drawing
  ImmediateRun immediate;                      // traffic of the machine `immediate`
  ImmediateRun untiled;                        // traffic of the machine `untiled`; empty where it uses tiles
  std::uint64_t blocks_culled = 0;             // pairs of a triangle and a block that hierarchical depth dropped
  std::uint64_t pixel_shader_invocations = 0;  // one per pixel and triangle that passes its depth test
  VisibleTriangles visible;  // triangles visible in the finished frame, for machines that defer shading
  DepthPyramid depths{{}};   // depths of the finished frame, for machines that test against them
  PrepassDepths prepass;     // of a prepass
};

// Draws the frame as an immediate-mode machine does: base patch by base patch in submission order, within a patch one
// screen area (a tile) after another, within an area triangle by triangle. Each triangle is tested against the depth
// drawn so far, first against the farthest depth of blocks of 8x8 pixels, which is on chip [spec: one value per 8x8
// pixels, Adreno's LRZ and other hierarchical depth buffers; assumed, in its favour: exact, and never in memory]. A
// triangle touches the lines that hold samples inside it, also where motion and defocus scatter them: exactly, not by
// bounds. The result does not depend on how patches were split and binned for `record`.
//
// Colour is compressed (CompressedColorMemory) if that moves fewer bytes in the frame than plain lines: `untiled`
// does so always, `immediate` if immediate.color_compression is on.
//
// A shadow map has lines of depths alone, in its own format, behind the same cache; no pixel is shaded. Colours
// of an attachment have the bytes of its format. In favour of the machine: colours that a pass loads are in memory
// already, and depths that are stored once a pixel are resolved as they leave the cache.
//
// A G-buffer takes the place of colours, in lines of its own width; blended layers wait in a surface of their own. If the
// job lights it, all lines are read in the end with their depths and layers; a stored G-buffer stays in memory. `known`: depths of a
// prepass, or nullptr; then depths are read, but do not change, and a pixel is shaded for the surface that reaches them.
ImmediateFrame draw_immediately(const tilecore::TileJob& job, const gpu::ObservedWork& record,
                                const gpu::GpuConfiguration& gpu, const PrepassDepths* known = nullptr);

// Whether a pass has tessellated patches, in view or not.
bool has_patches(const scene::FrameGeometry& frame);

}  // namespace tessera::baselines
