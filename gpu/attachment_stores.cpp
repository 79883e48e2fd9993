#include "gpu/attachment_stores.h"

#include <utility>

#include "tilecore/resolve/frame_compression.h"

namespace tessera::gpu {

tilecore::FrameStore attachment_store(const GpuConfiguration& gpu, const tilecore::ColorAttachment& attachment) {
  tilecore::FrameStore store;
  store.coder = attachment.coder;
  store.samples = attachment.samples;
  store.compressed = gpu.frame_buffer.compression == tilecore::FrameBufferCompression::kLossless;
  store.signature_bits = gpu.frame_buffer.signature_bits;
  store.purpose = memory::Purpose::kAttachment;
  store.base = attachment.base;
  store.by_tile = true;
  return store;
}

std::span<const tilecore::FrameStore> AttachmentStores::begin(const GpuConfiguration& gpu,
                                                              std::span<const tilecore::ColorAttachment> attachments,
                                                              const binner::TileGrid& grid, int frame) {
  const std::optional<int> before = std::exchange(finished_, std::nullopt);
  contents_.resize(attachments.size());
  stores_.clear();
  for (std::size_t number = 0; number < attachments.size(); ++number) {
    tilecore::FrameStore& store = stores_.emplace_back(attachment_store(gpu, attachments[number]));
    Content& content = contents_[number];
    if (gpu.frame_buffer.transaction_elimination) {
      if (!before || *before != frame - 1) content.stored.forget(grid.tile_count(), grid.region());
      store.before = &content.stored;
    }
    if (!store.compressed) continue;
    content.payloads.resize(tilecore::TileStore::header_bytes(store, grid.region()) / tilecore::kBlockHeaderBytes);
    store.payloads = &content.payloads;
  }
  return stores_;
}

void AttachmentStores::end(int frame) {
  for (Content& content : contents_) content.stored.known = true;
  finished_ = frame;
}

}  // namespace tessera::gpu
