#include "baselines/triangle_buffer.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "base/check.h"
#include "base/round_up.h"
#include "baselines/tile_reference.h"
#include "binner/parameter_buffer.h"

namespace tessera::baselines {

TriangleBuffer::TriangleBuffer(const gpu::GpuConfiguration& gpu, binner::TileIndex tile_count)
    : capacity_(static_cast<std::uint64_t>(gpu.parameter_buffer.bytes)),
      chunk_bytes_(static_cast<std::uint64_t>(gpu.parameter_buffer.chunk_bytes)),
      burst_bytes_(static_cast<std::uint64_t>(gpu.memory.burst_bytes)),
      memory_(round_up(tile_count * binner::kListHeadBytes, burst_bytes_)),
      combiner_(static_cast<std::uint64_t>(gpu.binner.combining_bursts), burst_bytes_, ledger_) {}

std::uint64_t TriangleBuffer::store_block(std::span<const std::uint8_t> bytes) {
  const std::uint64_t address = round_up(memory_.size(), kBlockAlignment);
  memory_.resize(address + bytes.size());
  std::memcpy(&memory_[address], bytes.data(), bytes.size());
  combiner_.write(address, bytes.size());
  bytes_written_ += bytes.size();
  return address;
}

void TriangleBuffer::add_chunk(Head& head) {
  TESSERA_CHECK(chunk_address_.size() < std::numeric_limits<std::uint32_t>::max(), "chunk numbers fit 32 bits");
  const auto chunk = static_cast<std::uint32_t>(chunk_address_.size());
  const std::uint64_t address = round_up(memory_.size(), burst_bytes_);
  memory_.resize(address + chunk_bytes_);
  chunk_address_.push_back(address);
  if (head.bytes == 0) {
    head.first_chunk = chunk;
  } else {
    std::memcpy(&memory_[chunk_address_[head.last_chunk]], &chunk, sizeof chunk);
    combiner_.write(chunk_address_[head.last_chunk], binner::kChunkLinkBytes);
    bytes_written_ += binner::kChunkLinkBytes;
  }
  head.last_chunk = chunk;
}

void TriangleBuffer::append(binner::TileIndex tile, std::span<const std::uint8_t> bytes) {
  Head head;
  std::memcpy(&head, &memory_[tile * binner::kListHeadBytes], sizeof head);
  if (head.bytes > 0)
    combiner_.read(tile * binner::kListHeadBytes, binner::kListHeadBytes);
  else
    bytes_written_ += binner::kListHeadBytes;
  bytes_written_ += bytes.size();
  const std::uint64_t room = chunk_bytes_ - binner::kChunkLinkBytes;
  while (!bytes.empty()) {
    const std::uint64_t slot = head.bytes % room;
    if (slot == 0) add_chunk(head);
    const std::uint64_t address = chunk_address_[head.last_chunk] + binner::kChunkLinkBytes + slot,
                        here = std::min<std::uint64_t>(room - slot, bytes.size());
    std::memcpy(&memory_[address], bytes.data(), here);
    combiner_.write(address, here);
    TESSERA_CHECK(here <= std::numeric_limits<std::uint32_t>::max() - head.bytes, "a list's length fits 32 bits");
    head.bytes += static_cast<std::uint32_t>(here);
    bytes = bytes.subspan(here);
  }
  std::memcpy(&memory_[tile * binner::kListHeadBytes], &head, sizeof head);
  combiner_.write(tile * binner::kListHeadBytes, binner::kListHeadBytes);
}

std::vector<std::uint8_t> TriangleBuffer::read_list(binner::TileIndex tile, memory::Ledger& ledger,
                                                    std::uint64_t& bytes_read) const {
  const auto charge = [&](std::uint64_t address, std::uint64_t bytes) {
    ledger.read(memory::Unit::kTilecore, memory::Purpose::kTileQueue,
                memory::burst_bytes(address, bytes, burst_bytes_));
    bytes_read += bytes;
  };
  Head head;
  std::memcpy(&head, &memory_[tile * binner::kListHeadBytes], sizeof head);
  charge(tile * binner::kListHeadBytes, binner::kListHeadBytes);
  std::vector<std::uint8_t> list;
  list.reserve(head.bytes);
  std::uint32_t chunk = head.first_chunk;
  while (list.size() < head.bytes) {
    const std::uint64_t here =
                            std::min<std::uint64_t>(chunk_bytes_ - binner::kChunkLinkBytes, head.bytes - list.size()),
                        address = chunk_address_[chunk];
    charge(address, binner::kChunkLinkBytes + here);
    const auto* first = &memory_[address + binner::kChunkLinkBytes];
    list.insert(list.end(), first, first + here);
    std::memcpy(&chunk, &memory_[address], sizeof chunk);
  }
  return list;
}

}  // namespace tessera::baselines
