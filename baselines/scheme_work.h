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

// What the machine's run gives to all schemes: it shades what is visible, and textures are its own.
struct MachineWork {
  const timing::FrameWork& work;              // with items: schemes have them as well
  std::span<const gpu::TextureUse> textures;  // by tile
  const gpu::DisplacementMemory* heights;     // nullptr where textures are not modelled
};

// Conventional machines keep so many bytes of a sample in a tile.
inline constexpr std::uint64_t kColorAndDepthBytes = 8;

// Before the tiles of a scheme whose lists hold triangles.
struct FrontWork {
  std::uint64_t vertices = 0;  // shaded before they are binned
  std::uint64_t whole = 0;     // of these, with what pixels interpolate; of the others the place alone
  std::uint64_t passes = 1;    // over the patches, in which they are shaded
  std::uint64_t read_bytes = 0, written_bytes = 0;
  bool fetches_entries = true;  // cores look references up; otherwise set-up decodes triangles as it takes them
  // Whose vertices they are, with how many each; nullptr: all patches that the hull stage kept, with all of theirs.
  const std::vector<PatchWork>* patches = nullptr;
  // Compute shaders and task shaders: instructions on lanes, and bilinear lookups.
  std::uint64_t instructions = 0, lookups = 0;
  bool bounds_on_lanes = false;  // of these, tests that the hull stage would make; otherwise the front end makes them
};

// Puts schemes that bin or draw triangles into the words of the timing model (timing/work.h), so that one model times all
// of them and one table of prices gives their energy. Units that do the same run at the same rates:
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
//                                                     them; hierarchical depth drops a share of them: that of the hits
//                                                     [assumed]
//                         blocks of 8x8 pixels whose farthest depth is found again
//                                                     coarse depth
//   shading, resolve      the machine's own of that tile, but patches are not evaluated again: vertices hold attributes
//   store                 the finished frame, by pixels
//
// With items (machine.timing=events) a tile has one for each patch that it draws, in the order of drawing, and the
// machine's warps with the compiled clocks of shaders that interpolate attributes. Its lists, and what they lead to, are
// read as one stream that begins with the tile; vertices that are shaded in tiles read heights through the L2, as warps
// read texels.
//
// Immediate: the front end, then batches of what is drawn one behind the other (a patch in a tile, as many as make a tile
// of samples), each on one core: vertices and set-up of the patch with its first tile, then as above; colour and depth
// move as its cache misses; it shades what it draws, at the machine's lookups per invocation of that tile. Then
// the resolve, tile by tile.
//
// In favour of all of them: nothing is sorted; overlaps that miss cost the binner nothing; what packed positions, strips
// and runs of bits take to be decoded costs nothing; lists are read ahead however long they are. Against them: a position
// takes the time of a whole vertex.
//
// Invariants (cited by the tests):
//   BW1  A scheme's work moves its baseline.dram_bytes and baseline.texture_bytes, no more and no less.
//   BW2  Tiled schemes shade, blend and resolve what the machine does.
//   BW3  Items of a tile add up to its events, and past the L2 move what it moves but for textures.
class SchemeWork {
 public:
  // All must outlive it. `drawn`: hits and depth by tile.
  SchemeWork(const gpu::GpuConfiguration& gpu, const tilecore::TileJob& job, const MachineWork& machine,
             const GeometryCounts& geometry, const ImmediateFrame& drawn);

  // `bins`: the grid that the scheme's lists follow. A bin's list is spread over the machine's tiles in it, evenly: cores
  // work on a bin together.
  timing::FrameWork tiled(const BaselineCounters& scheme, const FrontWork& front, std::span<const ListWork> lists,
                          const binner::TileGrid& bins) const;
  // `moved`: the scheme's, as ImmediateRun has it.
  timing::FrameWork immediate(const BaselineCounters& scheme, std::span<const ImmediateTraffic> moved) const;
  std::uint64_t immediate_texture_bytes() const;
  // Bytes of the textures of all tiles.
  std::uint64_t texture_bytes() const;

 private:
  // Sums over the rounds of the machine, by tile.
  struct OwnTile {
    timing::TileWork work;
    std::vector<std::uint32_t> drawn;  // ImmediateFrame::order, in this tile
    // With items:
    std::vector<timing::WarpItem> warps;
    std::vector<std::uint32_t> alpha_lines, texel_lines;  // TileItems::texel_lines
  };
  // Shaders of a drawable's triangles.
  struct Shaders {
    timing::WarpItem pixel;
    hardware::ShaderCost place, whole;  // of a vertex: where it is; and what pixels interpolate
    bool masks = false, displaced = false;
  };
  // The part of the machine's work in a tile that falls to a patch which is drawn there, or to the environment behind.
  struct DrawnShare {
    std::uint64_t texels, decoded_texels, l2_lines, visibility_bytes, shading_bytes, alpha_tests, texel_lines,
        alpha_lines;
  };
  class Parts;
  class TileShares;
  // A batch of the immediate machine, or a tile of the others.
  struct Draw {
    timing::TileWork& work;
    timing::TileItems& items;
  };

  void take_shaders();
  void add_own_items(const timing::TileItems& items, OwnTile& own) const;
  const Shaders& shaders_of(std::uint32_t patch) const { return shaders_[job_.frame->assembly->patch_drawable[patch]]; }
  void shade_before(const FrontWork& front, timing::WorkRound& round) const;
  timing::SubPatchItem tests_of(const DrawnInTile& drawn) const;
  // Vertices that are shaded with an item.
  void shade_vertices(std::uint32_t patch, std::uint64_t vertices, timing::TileItems& items,
                      timing::SubPatchItem& item) const;
  void add_items(const ListWork& list, const OwnTile& own, Draw out) const;
  timing::GeometryWork hull_stage(const BaselineCounters& scheme) const;
  // Elements of a patch's record that its vertices take, besides what the hull stage decoded to bound it.
  std::uint64_t decoded_for_vertices(std::uint32_t patch) const;
  std::vector<ListWork> spread(std::span<const ListWork> lists, const binner::TileGrid& bins) const;
  std::vector<TileShares> shares() const;  // by tile
  void add_batches(std::uint64_t patch_bytes, std::span<const ImmediateTraffic> traffic,
                   std::vector<TileShares>& shares, timing::WorkRound& round) const;
  static void add_lookups(const DrawnShare& share, timing::TileWork& work);
  void add_warps(const DrawnInTile& drawn, const DrawnShare& share, TileShares& tile, Draw out) const;
  // Samples of a tile that see the environment, drawn where nothing else was.
  void add_background(const OwnTile& own, TileShares& tile, Draw out) const;
  std::vector<std::uint64_t> by_pixels(std::uint64_t bytes) const;

  const gpu::GpuConfiguration& gpu_;
  const tilecore::TileJob& job_;
  const GeometryCounts& geometry_;
  const ImmediateFrame& drawn_;
  const MachineWork& machine_;
  std::span<const gpu::TextureUse> textures_;
  bool has_items_;
  std::vector<Shaders> shaders_;  // by drawable
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

// Times the work, from empty caches, and prices it: baseline.cycles, baseline.energy_nj.
void set_cost(const gpu::GpuConfiguration& gpu, const timing::FrameWork& work, BaselineCounters& out);

}  // namespace tessera::baselines
