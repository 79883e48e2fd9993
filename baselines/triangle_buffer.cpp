#include "baselines/triangle_buffer.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "base/check.h"
#include "base/round_up.h"
#include "baselines/tile_reference.h"
#include "binner/parameter_buffer.h"

namespace tessera::baselines {

void BurstBytes::add(std::uint64_t address, std::uint64_t bytes) {
  if (bytes == 0) return;
  const std::uint64_t last = (address + bytes - 1) / burst_bytes_;
  if (last >= bytes_.size()) bytes_.resize(last + 1, 0);
  for (std::uint64_t burst = address / burst_bytes_; burst <= last; ++burst)
    bytes_[burst] += std::min((burst + 1) * burst_bytes_, address + bytes) - std::max(burst * burst_bytes_, address);
}

std::uint64_t BurstBytes::from(std::uint64_t address) const {
  std::uint64_t sum = 0;
  for (std::uint64_t burst = address / burst_bytes_; burst < bytes_.size(); ++burst) sum += bytes_[burst];
  return sum;
}

TriangleBuffer::TriangleBuffer(const gpu::GpuConfiguration& gpu, binner::TileIndex tile_count)
    : capacity_(static_cast<std::uint64_t>(gpu.parameter_buffer.bytes)),
      chunk_bytes_(static_cast<std::uint64_t>(gpu.parameter_buffer.chunk_bytes)),
      burst_bytes_(static_cast<std::uint64_t>(gpu.memory.burst_bytes)),
      head_bytes_(round_up(tile_count * binner::kListHeadBytes, burst_bytes_)),
      memory_(head_bytes_),
      writes_(burst_bytes_),
      grew_at_(tile_count, 0),
      combiner_(static_cast<std::uint64_t>(gpu.binner.combining_bursts), burst_bytes_, ledger_) {}

void TriangleBuffer::write(std::uint64_t address, std::uint64_t bytes) {
  combiner_.write(address, bytes);
  writes_.add(address, bytes);
}

std::uint64_t TriangleBuffer::store_block(std::span<const std::uint8_t> bytes) {
  const std::uint64_t address = round_up(memory_.size(), kBlockAlignment);
  memory_.resize(address + bytes.size());
  std::memcpy(&memory_[address], bytes.data(), bytes.size());
  write(address, bytes.size());
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
    write(chunk_address_[head.last_chunk], binner::kChunkLinkBytes);
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
    write(address, here);
    TESSERA_CHECK(here <= std::numeric_limits<std::uint32_t>::max() - head.bytes, "a list's length fits 32 bits");
    head.bytes += static_cast<std::uint32_t>(here);
    bytes = bytes.subspan(here);
  }
  std::memcpy(&memory_[tile * binner::kListHeadBytes], &head, sizeof head);
  write(tile * binner::kListHeadBytes, binner::kListHeadBytes);
  // One note for each burst of growth is exact enough: rounds are far longer.
  if (grew_at_[tile] / burst_bytes_ != memory_.size() / burst_bytes_) growth_.push_back({memory_.size(), tile});
  grew_at_[tile] = memory_.size();
}

std::vector<std::uint8_t> TriangleBuffer::read_list(binner::TileIndex tile, memory::Ledger& ledger,
                                                    std::uint64_t& bytes_read, BurstBytes* reads) const {
  const auto charge = [&](std::uint64_t address, std::uint64_t bytes) {
    ledger.read(memory::Unit::kTilecore, memory::Purpose::kTileQueue,
                memory::burst_bytes(address, bytes, burst_bytes_));
    bytes_read += bytes;
    if (reads != nullptr) reads->add(address, bytes);
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

BufferPressure TriangleBuffer::pressure(const BurstBytes& reads, std::span<const std::uint64_t> state_bytes) const {
  BufferPressure out;
  out.needed_bytes = bytes_in_use();
  const std::uint64_t capacity =
      std::max(out.needed_bytes / 2 / burst_bytes_ * burst_bytes_, head_bytes_ + round_up(chunk_bytes_, burst_bytes_));
  if (capacity >= out.needed_bytes) return out;
  out.spill_bytes = writes_.from(capacity) + reads.from(capacity);
  out.partial_render_bytes = partial_render_bytes(growth_, head_bytes_, out.needed_bytes, capacity, state_bytes);
  return out;
}

}  // namespace tessera::baselines
