#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/counter.h"
#include "base/round_up.h"
#include "binner/binner.h"
#include "gpu/configuration.h"
#include "tilecore/frame_targets.h"
#include "tilecore/tile_job.h"

namespace tessera::gpu {

struct EliminationCounters {
  std::uint64_t tiles_eliminated = 0;
  std::uint64_t signature_bytes = 0;
  std::uint64_t wrong_eliminations = 0;
};

// Whether frames leave signatures of tiles to the next frame.
inline bool eliminates(const GpuConfiguration& gpu) {
  return gpu.tile.rendering_elimination || gpu.frame_buffer.transaction_elimination;
}

// Layout of the signatures of tiles in their memory: of colours, of the inputs of even frames, of the inputs of odd frames,
// and of the colours in each attachment.
struct SignatureMemory {
  std::uint64_t array_bytes;  // whole bursts

  SignatureMemory(std::uint64_t tiles, std::uint64_t signature_bytes, std::uint64_t burst_bytes)
      : array_bytes(round_up(tiles * signature_bytes, burst_bytes)) {}
  std::uint64_t of_colors() const { return 0; }
  std::uint64_t of_inputs(int frame) const { return array_bytes * (1 + static_cast<std::uint64_t>(frame & 1)); }
  std::uint64_t of_attachment(int number) const { return array_bytes * (3 + static_cast<std::uint64_t>(number)); }
  std::uint64_t bytes(int attachments = 0) const { return of_attachment(attachments); }
};

// Rendering elimination (Anglada et al. 2019): signatures of the inputs of each tile of a view, from frame to frame.
// The binner makes them as it appends entries: a base patch's record is hashed once, where the front end reads it, a
// sub-patch's with it, and a tile's list hashes eight bytes of that for each entry. The paper instead hashes all
// attributes of all triangles.
//
// Where the pixel shader looks up shadows, every tile's signature includes one signature of all shadow maps.
//
// The inputs of a tile are its entries in their order, with each entry's record except for its number, and the pose,
// vertices, grids and material of its drawable; camera and lights; and, if a drawable or light moves in the tile or a
// lens is open, the frame's number, which changes the times and lens points of samples. The frame's number also counts
// for all tiles with features that carry state from frame to frame or from tile to tile: desampling, the previous
// frame's depths, and sampled procedures. The vertices are the whole drawable's, not the patch's, so fewer tiles
// match than could.
//
// Invariants (cited by the tests):
//   IS1  Images equal the images of a machine that renders all tiles, as long as signatures are wide enough.
//   IS2  An unchanged tile reaches no core: it does no work, and it moves no bytes but its signatures, which
//        the tile scheduler compares when the lists are done.
//   IS3  A signature that matches though inputs differ is counted, and the image shows the frame before.
class InputSignatures {
 public:
  // Begins a frame. `follows`: the last rendered frame was the previous one.
  void begin(bool follows);
  // Tells that the frame's lists will not be whole, so that the frame has no signatures.
  void forget() { known_ = whole_ = false; }
  // The tiles that need no rendering. Call it when all lists are complete.
  std::vector<bool> unchanged(const GpuConfiguration& gpu, const tilecore::TileJob& job, const binner::Binner& binner,
                              EliminationCounters& counters);
  // Whether the previous frame has signatures.
  bool known() const { return known_; }
  // One signature of all tiles of this frame, for views that read this one's results; nullopt if its lists were not
  // whole.
  std::optional<std::uint64_t> of_all_tiles() const;
  // Copies the images of an unchanged tile from the previous frame.
  void keep_images(IntRect tile, tilecore::FrameTargets& targets) const;
  // Ends the frame.
  void finish(const tilecore::FrameTargets& targets);

 private:
  bool known_ = false, whole_ = false;  // the previous frame has signatures; this frame has
  std::vector<std::uint64_t> shown_;    // by tile: CRC-64 of the inputs of the pixels it shows
  tilecore::FrameTargets images_{{}, false};
};

}  // namespace tessera::gpu

namespace tessera {

template <>
inline constexpr bool kAbsentWhenIdle<gpu::EliminationCounters> = true;

template <>
inline constexpr auto kCounterFields<gpu::EliminationCounters> = std::to_array<CounterField<gpu::EliminationCounters>>({
    {"tilecore.tiles_eliminated", &gpu::EliminationCounters::tiles_eliminated, Combine::kSum, "tiles",
     "Tiles that were not rendered because their inputs have the same signature as in the previous frame, with "
     "tile.rendering_elimination.",
     ""},
    {"binner.signature_bytes", &gpu::EliminationCounters::signature_bytes, Combine::kSum, "bytes",
     "Bytes hashed for signatures of tiles' inputs: records of base patches, instances and sub-patches once, ten "
     "bytes an entry, eight a tile.",
     ""},
    {"tilecore.wrong_eliminations", &gpu::EliminationCounters::wrong_eliminations, Combine::kSum, "tiles",
     "Tiles of tilecore.tiles_eliminated whose inputs differ nevertheless: the image is wrong there.", ""},
});
TESSERA_COUNTERS_COVER(gpu::EliminationCounters);

}  // namespace tessera
