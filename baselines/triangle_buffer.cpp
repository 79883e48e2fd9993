#include "baselines/triangle_buffer.h"

#include <algorithm>
#include <cstring>

#include "base/round_up.h"
#include "baselines/tile_reference.h"

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
      writes_(burst_bytes_),
      grew_at_(tile_count, 0),
      combiner_(static_cast<std::uint64_t>(gpu.binner.combining_bursts), burst_bytes_, ledger_),
      lists_(
          {tile_count, static_cast<std::uint64_t>(gpu.parameter_buffer.first_chunk_bytes), chunk_bytes_, burst_bytes_},
          memory_, combiner_) {
  memory_.resize(lists_.layout().end());
  lists_.reset();
}

std::uint64_t TriangleBuffer::next_block() const { return round_up(memory_.size(), kBlockAlignment); }

std::uint64_t TriangleBuffer::store_block(std::span<const std::uint8_t> bytes) {
  const std::uint64_t address = next_block();
  memory_.resize(address + bytes.size());
  std::memcpy(&memory_[address], bytes.data(), bytes.size());
  combiner_.write(address, bytes.size());
  writes_.add(address, bytes.size());
  block_bytes_ += bytes.size();
  return address;
}

std::uint64_t TriangleBuffer::add_chunk() {
  const std::uint64_t address = round_up(memory_.size(), burst_bytes_);
  memory_.resize(address + chunk_bytes_);
  return address;
}

void TriangleBuffer::append(binner::TileIndex tile, std::span<const std::uint8_t> bytes) {
  lists_.append(
      tile, bytes, 0, [&] { return add_chunk(); },
      [&](std::uint64_t address, std::uint64_t count) { writes_.add(address, count); });
  // One record for each burst of growth is exact enough: rounds are far longer.
  if (grew_at_[tile] / burst_bytes_ != memory_.size() / burst_bytes_) growth_.push_back({memory_.size(), tile});
  grew_at_[tile] = memory_.size();
}

void TriangleBuffer::finish() {
  combiner_.flush();
  ledger_.read(memory::Unit::kBinner, memory::Purpose::kTileQueue,
               memory::burst_bytes(0, lists_.layout().bit_bytes(), burst_bytes_));
}

std::vector<std::uint8_t> TriangleBuffer::read_list(binner::TileIndex tile, memory::Ledger& ledger,
                                                    std::uint64_t& bytes_read, BurstBytes* reads) const {
  return lists_.read(tile, [&](std::uint64_t address, std::uint64_t bytes) {
    ledger.read(memory::Unit::kTilecore, memory::Purpose::kTileQueue,
                memory::burst_bytes(address, bytes, burst_bytes_));
    bytes_read += bytes;
    if (reads != nullptr) reads->add(address, bytes);
  });
}

BufferPressure TriangleBuffer::pressure(const BurstBytes& reads, std::span<const std::uint64_t> state_bytes) const {
  BufferPressure out;
  out.needed_bytes = bytes_in_use();
  const std::uint64_t fixed = lists_.layout().end(),
                      capacity = half_buffer_bytes(out.needed_bytes, fixed, round_up(chunk_bytes_, burst_bytes_),
                                                   burst_bytes_);
  if (capacity >= out.needed_bytes) return out;
  out.spill_bytes = writes_.from(capacity) + reads.from(capacity);
  out.partial_render_bytes = partial_render_bytes(growth_, fixed, out.needed_bytes, capacity, state_bytes);
  return out;
}

}  // namespace tessera::baselines
