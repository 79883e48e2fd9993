#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "binner/tile_grid.h"
#include "gpu/configuration.h"
#include "tilecore/attachment_actions.h"
#include "tilecore/resolve/tile_store.h"

namespace tessera::gpu {

// Returns how an attachment is stored on this machine, without the state that frames leave to each other: compressed as the
// frame buffer is.
tilecore::FrameStore attachment_store(const GpuConfiguration& gpu, const tilecore::ColorAttachment& attachment);

// The attachments of colours of a view, and what its frames leave in them to each other: the bytes of compressed blocks, the
// signatures of tiles and the colours that these stand for.
//
// Invariants (cited by the tests):
//   AST1  Compression and transaction elimination change no colour that a pass loads, as long as signatures are wide enough.
//   AST2  A load moves the bytes of the last store: blocks as they are compressed, and their headers.
//   AST3  A tile whose stored codes have the signature of the previous frame writes no byte but its signature.
class AttachmentStores {
 public:
  // Begins a frame over `grid`. Returns the stores by number (ColorAttachment::number), which hold until the next call.
  // Signatures count only if the last finished frame was the previous one.
  std::span<const tilecore::FrameStore> begin(const GpuConfiguration& gpu,
                                              std::span<const tilecore::ColorAttachment> attachments,
                                              const binner::TileGrid& grid, int frame);
  // Ends that frame. A frame that does not finish leaves no signatures.
  void end(int frame);

 private:
  struct Content {
    tilecore::StoredFrame stored;
    std::vector<std::uint16_t> payloads;  // FrameStore::payloads
  };
  std::vector<Content> contents_;
  std::vector<tilecore::FrameStore> stores_;
  std::optional<int> finished_;
};

}  // namespace tessera::gpu
