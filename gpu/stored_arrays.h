#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "gpu/bloom.h"
#include "gpu/configuration.h"
#include "gpu/taa.h"
#include "gpu/work_recorder.h"
#include "tilecore/resolve/stored_texels.h"
#include "tilecore/resolve/tile_store.h"
#include "tilecore/tile_job.h"
#include "tilecore/tile_order.h"

namespace tessera::gpu {

// How this machine stores texels beside colours: compressed as the frame buffer is, and with signatures if it eliminates
// transactions.
tilecore::TexelCoding texel_coding(const GpuConfiguration& gpu);

// Bytes of memory that an array of these texels takes, headers included.
std::uint64_t array_bytes(const GpuConfiguration& gpu, const tilecore::TexelFormat& format, IntRect texels);

// An array of texels in the memory of attachments, tile by tile in the machine's order: what passes store in it, and what a
// frame leaves there for the next one.
//
// With frame_buffer.transaction_elimination a piece whose codes have the signature of the stored ones is not written. If
// they differ nevertheless, the machine would go on with the stored ones. The emulator counts this
// (resolve.wrong_matches) and goes on with the new ones.
//
// Invariants (cited by the tests):
//   SA1  Raw, an array moves its texels once each way, rounded up to bursts as a whole.
//   SA2  Compressed, a load moves the bytes of the last store: blocks as they are compressed, and their headers.
//   SA3  A piece with the signature of the stored one writes no byte but its signature.
class StoredArray {
 public:
  using Moves = std::function<bool(binner::TileIndex)>;

  // Begins a frame that stores the array at `base`. `pieces`: the texels of each tile, by its number; they are disjoint, and
  // with compression their blocks are disjoint, too. `signatures`: base address within the memory of signatures.
  void begin(const GpuConfiguration& gpu, tilecore::TexelFormat format, std::vector<IntRect> pieces, std::uint64_t base,
             std::uint64_t signatures);
  // Ends a finished frame.
  void end() { known_ = known_ || stored_; }
  // The content becomes unknown, and no signature matches it.
  void forget();

  // Codes the piece of a tile, on any thread: `fill` adds its planes to an encoder. Returns the work.
  template <class Fill>
  tilecore::StoreCounters store(std::size_t tile, const Fill& fill) {
    if (!how_.any() || pieces_[tile].empty()) return {};
    tilecore::TexelEncoder encoder(format_, how_, pieces_[tile]);
    fill(encoder);
    return keep(encoder.take(), contents_[tile]);
  }
  // The work of a tile that loads its piece.
  tilecore::StoreCounters load(std::size_t tile) const;

  // Charges the tiles with `moves(tile)` for storing or loading their pieces. Returns the bytes on the bus, signatures apart.
  std::uint64_t move(WorkRecorder::Round& round, const tilecore::TileOrder& order, bool write,
                     const Moves& moves) const;

  IntRect piece(std::size_t tile) const { return pieces_[tile]; }
  void set_base(std::uint64_t base) { base_ = base; }

 private:
  struct Content {
    std::vector<std::uint16_t> block_bytes;  // StoredTexels::block_bytes
    std::optional<std::uint64_t> signature;  // nullopt: unknown
    std::uint64_t check = 0;
    bool kept = false;  // the last store wrote nothing
  };
  // Makes the texels the content of a piece, unless their signature matches.
  tilecore::StoreCounters keep(tilecore::StoredTexels texels, Content& content) const;
  // Moves data that lie piece behind piece; bytes_of(piece).
  template <class Bytes>
  std::uint64_t move_pieces(WorkRecorder::Round& round, const tilecore::TileOrder& order, TileArray array,
                            const Bytes& bytes_of, const Moves& goes) const;
  std::uint64_t move_texels(WorkRecorder::Round& round, const tilecore::TileOrder& order, bool write,
                            const Moves& goes) const;
  std::uint64_t move_blocks(WorkRecorder::Round& round, const tilecore::TileOrder& order, bool write,
                            const Moves& goes) const;
  void move_signatures(WorkRecorder::Round& round, const tilecore::TileOrder& order, const Moves& moves) const;

  tilecore::TexelFormat format_;
  tilecore::TexelCoding how_;
  int signature_bits_ = 64;
  std::vector<IntRect> pieces_;
  std::vector<Content> contents_;
  std::uint64_t base_ = 0, signatures_ = 0;
  bool stored_ = false, known_ = false;  // this frame or an earlier one stores it; a finished frame has
};

// The arrays of a view.
class StoredArrays {
 public:
  // Passes of a frame that use arrays; nullptr if there is none.
  struct Passes {
    const Taa* taa = nullptr;
    const Bloom* bloom = nullptr;
  };
  // Begins a frame that renders `job`. `place`: first address behind all attachments. `colors`: number of attachments of
  // colours, whose signatures come first. Contents count only if the last finished frame was the previous one.
  void begin(const GpuConfiguration& gpu, const tilecore::TileJob& job, const Passes& passes, std::uint64_t place,
             int colors, int frame);
  // Ends that frame. A frame that does not finish leaves no contents.
  void end(int frame);

  StoredArray sample_depths;            // depths of all samples: from a prepass, or beside a packed G-buffer
  StoredArray gbuffer;                  // in memory, between its two passes
  StoredArray depths, velocities;       // stored by the pass that draws
  StoredArray history, history_before;  // of temporal antialiasing: of this frame, and of the one before
  std::vector<StoredArray> bloom;       // levels

 private:
  std::optional<int> finished_;
};

}  // namespace tessera::gpu
