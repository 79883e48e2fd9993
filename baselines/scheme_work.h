#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "baselines/baseline_counters.h"
#include "baselines/scheme.h"
#include "baselines/triangle_buffer.h"
#include "binner/tile_grid.h"
#include "gpu/configuration.h"
#include "gpu/view_observer.h"
#include "tilecore/tile_job.h"
#include "timing/work.h"

namespace tessera::baselines {

// What the machine's run gives to all schemes: it shades what is visible, and textures are its own.
struct MachineWork {
  const timing::FrameWork& work;
  std::span<const gpu::TextureUse> textures;  // by tile
};

// Before the tiles of a scheme whose lists hold triangles.
struct FrontWork {
  std::uint64_t vertices = 0;  // shaded before they are binned
  std::uint64_t read_bytes = 0, written_bytes = 0;
  bool fetches_entries = true;  // cores look references up; otherwise set-up decodes triangles as it takes them
};

// Puts schemes that bin or draw triangles into the words of the timing model (timing/work.h), so that one model times all
// of them and one table of prices gives their energy. Units that do the same run at the same rates:
//
//   hull stage            bounds                      front end
//   vertex shader         vertices                    tessellators of all cores, before binning; of a core, in its tiles
//   cull, set up          triangles                   triangle_setup.triangles_per_clk, before binning
//   binner                entries, tile overlaps      binner
//   tile                  references                  entry fetch
//                         triangles set up again      box builder
//                         samples of the stamps that triangles touch (TriangleSetup TS5), less what hierarchical depth
//                         drops, in proportion to hits [assumed]; hits
//                                                     triangle tests
//                         blocks of 8x8 pixels whose farthest depth is found again
//                                                     coarse depth
//   shading, resolve      the machine's own of that tile, but patches are not evaluated again: vertices hold attributes
//   store                 the finished frame, by pixels
//
// Immediate: the front end, then batches of what is drawn one behind the other (a patch in a tile, as many as make a tile
// of samples), each on one core: vertices and set-up of the patch with its first tile, then as above; colour and depth
// move as its cache misses; it shades what it draws, at the machine's lookups per invocation of that tile. Then
// the resolve, tile by tile.
//
// In favour of all of them: a whole vertex takes the time and energy of a position; nothing is sorted; overlaps that
// miss cost the binner nothing; what packed positions, strips and runs of bits take to be decoded costs nothing;
// immediate sets triangles up in all cores. Against them: all samples of the stamps that a triangle touches at any time
// and through any point of the lens are tested, as no time and no part of the lens is left out before.
//
// Invariants (cited by the tests):
//   BW1  A scheme's work moves its baseline.dram_bytes and baseline.texture_bytes, no more and no less.
//   BW2  Tiled schemes shade, blend and resolve what the machine does.
class SchemeWork {
 public:
  // All must outlive it. `drawn`: hits and depth by tile.
  SchemeWork(const gpu::GpuConfiguration& gpu, const tilecore::TileJob& job, const MachineWork& machine,
             const GeometryCounts& geometry, const ImmediateFrame& drawn);

  // `bins`: the grid that the scheme's lists follow. A bin's list is spread over the machine's tiles in it, evenly: cores
  // work on a bin together.
  timing::FrameWork tiled(const BaselineCounters& scheme, const FrontWork& front, std::span<const ListWork> lists,
                          const binner::TileGrid& bins) const;
  timing::FrameWork immediate(const BaselineCounters& scheme) const;
  std::uint64_t immediate_texture_bytes() const;
  // Bytes of the textures of all tiles.
  std::uint64_t texture_bytes() const;

 private:
  // Sums over the rounds of the machine, by tile.
  struct OwnTile {
    timing::TileWork work;
    std::uint64_t stamps = 0, hits = 0, depth_tests = 0, blocks_scanned = 0;
  };
  std::uint64_t lanes(std::uint64_t stamps, std::uint64_t hits, std::uint64_t depth_tests) const;
  timing::GeometryWork hull_stage(const BaselineCounters& scheme) const;
  std::vector<ListWork> spread(std::span<const ListWork> lists, const binner::TileGrid& bins) const;
  std::vector<timing::TileWork> batches(std::uint64_t patch_bytes) const;
  void add_drawn(const DrawnInTile& drawn, timing::TileWork& batch) const;
  std::vector<std::uint64_t> by_pixels(std::uint64_t bytes) const;

  const gpu::GpuConfiguration& gpu_;
  const tilecore::TileJob& job_;
  const GeometryCounts& geometry_;
  const ImmediateFrame& drawn_;
  std::span<const gpu::TextureUse> textures_;
  std::vector<binner::TileIndex> order_;
  std::vector<OwnTile> own_;
  std::uint64_t samples_;  // of a pixel
};

// Before the tiles of a scheme: its lists in `buffer`, and `geometry_bytes` of records and attributes.
FrontWork front_work(const BaselineCounters& scheme, const TriangleBuffer& buffer, std::uint64_t geometry_bytes);

// The counters of a scheme with lists, from those of its binner. `attributes`: bytes of them that are read before.
template <class Binner>
BaselineCounters list_counters(const Binner& binner, const DrawnPass& drawn, const BaselineCounters& geometry,
                               std::uint64_t attributes) {
  BaselineCounters out = binner.counters();
  take_geometry(geometry, attributes, out);
  out.pixel_shader_invocations = drawn.invocations;
  out.frame_bytes_written = drawn.frame_bytes;
  out.dram_bytes = binner.dram_bytes() + geometry.patch_bytes_cached + attributes + drawn.frame_bytes;
  out.dram_bytes_uncached = binner.dram_bytes_uncached() + geometry.patch_bytes + attributes + drawn.frame_bytes;
  return out;
}

// Times the work with machine.timing=phases and prices it: baseline.cycles, baseline.energy_nj.
void set_cost(const gpu::GpuConfiguration& gpu, const timing::FrameWork& work, BaselineCounters& out);

}  // namespace tessera::baselines
