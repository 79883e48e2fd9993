#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "baselines/immediate.h"
#include "baselines/visible_triangles.h"
#include "gpu/machine_record.h"
#include "tilecore/tile_core.h"

namespace tessera::baselines {

// Samples of a line that take the colour of a pixel-shader invocation.
struct ColorWrite {
  std::uint64_t samples;  // bit k: sample k of the line
  std::uint32_t point;    // of the tile's colours
};

// A triangle on a line of samples; `passes`: some are in front of what was drawn before.
struct LineTouch {
  std::uint32_t line;
  bool passes, blends;
  std::uint32_t first_write, write_count;  // in the tile's writes
};

// The touches of one base patch in one tile.
struct DrawnInTile {
  std::uint32_t patch, tile;
  std::size_t begin, end;         // in the tile's touches
  std::uint64_t hits = 0;         // samples in its triangles
  std::uint64_t depth_tests = 0;  // of them, those that hierarchical depth left
  std::uint64_t invocations = 0, blended = 0;
  std::uint64_t blocks_scanned = 0;  // whose farthest depth was found again
};

// What drawing in submission order does to the samples of one tile, and what they see in the end.
//
//   triangle -> hierarchical depth: blocks of 8x8 pixels all of whose samples are nearer -> samples in front of what was
//   drawn before -> one pixel-shader invocation per pixel and triangle
struct TileDrawing {
  std::vector<DrawnInTile> drawn;
  std::vector<LineTouch> touches;
  std::vector<ColorWrite> writes;
  std::vector<std::uint32_t> colors;   // RGBA8, by point
  std::uint64_t blocks_culled = 0;     // pairs of a triangle and a block
  std::vector<std::uint64_t> visible;  // see VisibleTriangles
};

// Scratch memory of a thread.
struct TileDrawer {
  tilecore::TileCore core;
  tilecore::PixelShader shader;
};

// `entries`: of the tile, cut and ordered in any way. Hits are exact, also where motion and defocus scatter them.
// `colors` false: no pixel is shaded, colours stay empty; `point` still numbers invocations.
TileDrawing draw_tile(const tilecore::TileJob& job, std::uint32_t tile, std::vector<binner::QueueEntry> entries,
                      const SampleLayout& layout, bool colors, TileDrawer& drawer, std::uint64_t& invocations);

}  // namespace tessera::baselines
