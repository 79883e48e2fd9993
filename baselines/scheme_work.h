#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "baselines/baseline_counters.h"
#include "baselines/scheme.h"
#include "baselines/triangle_buffer.h"
#include "binner/tile_grid.h"
#include "gpu/configuration.h"
#include "gpu/displacement_memory.h"
#include "gpu/view_observer.h"
#include "tilecore/tile_job.h"
#include "timing/work.h"

namespace tessera::baselines {

// Results of the machine's run that all schemes use: shading of visible surfaces, and textures.
struct MachineWork {
  std::span<const timing::WorkRound> rounds;  // in which the pass is drawn; with items: schemes have them as well
  std::span<const gpu::TextureUse> textures;  // by tile
  std::span<const gpu::LightUse> lights;      // by tile
  const gpu::DisplacementMemory* heights;     // nullptr where textures are not modelled
  std::uint32_t first_tile = 0;               // number of the pass's first tile in the rounds
};

// Work before the tiles of a scheme whose lists hold triangles.
struct FrontWork {
  std::uint64_t vertices = 0;  // vertices shaded before they are binned
  std::uint64_t whole = 0;     // vertices of these with all outputs; the others have a position alone
  std::uint64_t passes = 1;    // number of passes over the patches in which they are shaded
  std::uint64_t read_bytes = 0, written_bytes = 0;
  bool fetches_entries = true;  // cores look references up; otherwise set-up decodes triangles as it takes them
  // Patches with these vertices, and the number of each; nullptr: all vertices of all patches that the hull stage kept.
  const std::vector<PatchWork>* patches = nullptr;
  // Compute shaders and task shaders: instructions on lanes, and bilinear lookups.
  std::uint64_t instructions = 0, lookups = 0;
  bool bounds_on_lanes = false;  // these include the tests of the hull stage, which the front end makes otherwise
};

// Expresses schemes that bin or draw triangles as work of the timing model (timing/work.h), so that one model times
// all of them and one table of prices gives their energy. Units with the same work run at the same rates:
//
//   hull stage            bounds, elements decoded    front end
//   compute, task shader  instructions, lookups       lanes and texture units of all cores, before binning
//   vertex shader         vertices, heights           lanes and texture units of all cores, before binning; of a core, in
//                                                     its tiles
//   records               elements decoded            decoders of all cores, before binning; of a core, in its tiles
//   cull, set up          triangles                   triangle_setup.triangles_per_clk in each core, before binning
//   binner                entries, tile overlaps      binner
//   tile                  references                  entry fetch
//                         samples that may see the patch
//                                                     box builder, box, stencil and triangle tests, as the machine makes
//                                                     them; hierarchical depth drops the same share of them
//                                                     as of the hits [assumed]
//                         blocks of 8x8 pixels whose farthest depth is computed again
//                                                     coarse depth
//   shading, resolve      the machine's own for that tile, but patches are not evaluated again: vertices hold attributes
//   load, store           attachments, the finished frame, or the depths of a shadow map, by pixels
//
// Shadow maps are drawn depths alone: vertices are shaded to a place, and no pixel is. Passes over images have the machine's
// own rounds (append_image_passes()).
//
// With items (machine.timing=events) a tile has one for each patch that it draws, in the order of drawing, and the
// machine's warps with the compiled clocks of shaders that interpolate attributes. Its lists and the data that they
// reference are read as one stream that begins with the tile; vertices that are shaded in tiles read heights through
// the L2, as warps read texels.
//
// A G-buffer on chip takes the room of colours in the tile; draws that fill it take the fill half of their shader. Light halves are
// the machine's, and so are their light lists and the bytes that both move on chip.
//
// Immediate machines run the front end, then batches of drawn patches in sequence (a patch in a tile, joined up to a
// tile of samples), each on one core. Vertices and set-up of a patch come with its first tile, then the steps above.
// Pixels of a drawable's consecutive patches in a batch share warps.
// Colour and depth move as the cache misses. All drawn pixels are shaded, with as many lookups per invocation as the
// machine makes in that tile. Then the resolve follows, tile by tile, or the light halves over a G-buffer that is read again.
//
// Simplifications in favour of all schemes: no sorting; overlap tests that miss cost the binner nothing; decoding of
// packed positions, strips and runs of bits is free; lists are read ahead at any length. One goes against them: a
// position takes the time of a whole vertex.
//
// Where surfaces transmit, all machines draw the scene behind them, reduce its image, and draw the tiles with such surfaces again, from
// records to colours. A mask of these tiles is known before triangles are set up, in favour of all schemes.
//
// Invariants (cited by the tests):
//   BW1  A scheme's work moves its baseline.dram_bytes and baseline.texture_bytes, no more and no less.
//   BW2  Tiled schemes have the machine's shading, blending and resolving.
//   BW3  The items of a tile add up to its events, and move its bytes past the L2 except for textures.
class SchemeWork {
 public:
  // All arguments must outlive the object. `drawn`: hits and depth by tile. `loaded_bytes`: read by tiles before they
  // draw.
  SchemeWork(const gpu::GpuConfiguration& gpu, const tilecore::TileJob& job, const MachineWork& machine,
             const GeometryCounts& geometry, const ImmediateFrame& drawn, std::uint64_t loaded_bytes = 0);

  // `bins`: the grid of the scheme's lists. A bin's list is spread evenly over the machine's tiles in it: cores work on a bin together.
  timing::FrameWork tiled(const BaselineCounters& scheme, const FrontWork& front, std::span<const ListWork> lists,
                          const binner::TileGrid& bins) const;
  // `moved`: the scheme's traffic, see ImmediateRun::moved.
  timing::FrameWork immediate(const BaselineCounters& scheme, std::span<const ImmediateTraffic> moved) const;
  std::uint64_t immediate_texture_bytes() const;
  // Bytes of the textures of all tiles.
  std::uint64_t texture_bytes() const;

 private:
  // The machine's work in a tile, summed over its rounds.
  struct OwnTile {
    timing::TileWork work;
    std::vector<std::uint32_t> drawn;  // ImmediateFrame::order, in this tile
    gpu::LightUse light;               // of light halves on chip
    // With items:
    std::vector<timing::WarpItem> warps;
    std::vector<std::uint32_t> alpha_lines, texel_lines, light_lines;  // TileItems::texel_lines; of light halves apart
  };
  // Shaders of a drawable's triangles.
  struct Shaders {
    timing::WarpItem pixel;             // of a draw: the fill half where it fills a G-buffer
    hardware::ShaderCost place, whole;  // of a vertex: position alone, and with the outputs that pixels interpolate
    bool masks = false, displaced = false;
  };
  // The part of the machine's work in a tile that belongs to one drawn patch, or to the environment behind.
  struct DrawnShare {
    std::uint64_t texels = 0, decoded_texels = 0, l2_lines = 0, visibility_bytes = 0, shading_bytes = 0;
    std::uint64_t alpha_tests = 0, texel_lines = 0, alpha_lines = 0;
  };
  class Parts;
  class TileShares;
  // A batch of the immediate machine, or a tile of the others.
  struct Draw {
    timing::TileWork& work;
    timing::TileItems& items;
  };

  // The last warp of a batch of the immediate machine: the next pixels of its drawable take the free lanes.
  struct OpenWarp {
    std::uint32_t drawable = 0;  // + 1; 0: no warp yet
    std::uint64_t free_lanes = 0;
  };

  void take_shaders();
  void add_own_items(const timing::TileItems& items, OwnTile& own) const;
  const Shaders& shaders_of(std::uint32_t patch) const { return shaders_[job_.frame->assembly->patch_drawable[patch]]; }
  void shade_before(const FrontWork& front, timing::WorkRound& round) const;
  timing::SubPatchItem tests_of(const DrawnInTile& drawn) const;
  // Adds vertices that are shaded with an item.
  void shade_vertices(std::uint32_t patch, std::uint64_t vertices, timing::TileItems& items,
                      timing::SubPatchItem& item) const;
  void add_items(const ListWork& list, const OwnTile& own, Draw out) const;
  timing::GeometryWork hull_stage(const BaselineCounters& scheme) const;
  // Elements of a patch's record that its vertices need, besides the ones that the hull stage decoded to bound it.
  std::uint64_t decoded_for_vertices(std::uint32_t patch) const;
  std::vector<ListWork> spread(std::span<const ListWork> lists, const binner::TileGrid& bins) const;
  std::vector<TileShares> shares() const;  // by tile
  void add_batches(std::uint64_t patch_bytes, std::span<const ImmediateTraffic> traffic,
                   std::vector<TileShares>& shares, timing::WorkRound& round) const;
  static void add_lookups(const DrawnShare& share, timing::TileWork& work);
  void add_warps(const DrawnInTile& drawn, const DrawnShare& share, TileShares& tile, Draw out, OpenWarp& open) const;
  // Adds the light halves of a tile, with the machine's warps and light lists.
  void add_lights(const OwnTile& own, TileShares& tile, Draw out) const;
  // Adds samples of a tile that see the environment, where no patch was drawn.
  void add_background(const OwnTile& own, TileShares& tile, Draw out) const;
  std::vector<std::uint64_t> by_pixels(std::uint64_t bytes) const;

  const gpu::GpuConfiguration& gpu_;
  const tilecore::TileJob& job_;
  const GeometryCounts& geometry_;
  const ImmediateFrame& drawn_;
  const MachineWork& machine_;
  std::uint64_t loaded_bytes_;
  std::span<const gpu::TextureUse> textures_;
  bool has_items_;
  std::vector<Shaders> shaders_;          // by drawable
  std::vector<binner::TileIndex> order_;  // tiles that the pass draws, in the machine's order
  std::vector<OwnTile> own_;
  std::uint64_t samples_;  // samples of a pixel
};

// Number of pixels of a tile.
std::uint64_t pixels_of(const binner::TileGrid& grid, binner::TileIndex tile);

// Work before the tiles of a scheme with lists in `buffer` and `geometry_bytes` of records and attributes.
FrontWork front_work(const BaselineCounters& scheme, const TriangleBuffer& buffer, std::uint64_t geometry_bytes);

// The counters of a scheme with lists, from its binner's. `attributes`: bytes of attributes that are read before.
template <class Binner>
BaselineCounters list_counters(const Binner& binner, const DrawnPass& drawn, const BaselineCounters& geometry,
                               std::uint64_t attributes) {
  BaselineCounters out = binner.counters();
  take_geometry(geometry, attributes, out);
  out.pixel_shader_invocations = drawn.invocations;
  out.frame_bytes_read = drawn.loaded_bytes;
  out.frame_bytes_written = drawn.frame_bytes;
  const std::uint64_t frame = drawn.loaded_bytes + drawn.frame_bytes;
  out.dram_bytes = binner.dram_bytes() + geometry.patch_bytes_cached + attributes + frame;
  out.dram_bytes_uncached = binner.dram_bytes_uncached() + geometry.patch_bytes + attributes + frame;
  return out;
}

// Times the work from empty caches and prices it: baseline.cycles, baseline.energy_nj.
void set_cost(const gpu::GpuConfiguration& gpu, const timing::FrameWork& work, BaselineCounters& out);

}  // namespace tessera::baselines
