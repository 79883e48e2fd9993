#include "binner/parameter_buffer.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include <fmt/format.h>

#include "base/check.h"
#include "base/error.h"
#include "base/round_up.h"

namespace tessera::binner {

ParameterBuffer::ParameterBuffer(const BinnerSpec& spec, QueueIndex queue_count)
    : capacity_(static_cast<std::uint64_t>(spec.parameter_buffer.bytes)),
      chunk_bytes_(static_cast<std::uint64_t>(spec.parameter_buffer.chunk_bytes)),
      burst_bytes_(static_cast<std::uint64_t>(spec.burst_bytes)),
      entries_per_chunk_((chunk_bytes_ - kChunkLinkBytes) / kQueueEntryBytes),
      heads_bytes_(round_up(queue_count * kListHeadBytes, burst_bytes_)),
      spill_(spec.parameter_buffer.full_policy == FullPolicy::kSpill),
      combiner_(static_cast<std::uint64_t>(spec.binner.combining_bursts), burst_bytes_, ledger_) {
  if (heads_bytes_ + chunk_bytes_ > capacity_)
    throw UsageError(fmt::format(
        "parameter_buffer.bytes: {} bytes cannot hold the list heads of {} queues ({} bytes) and one chunk of {} bytes",
        capacity_, queue_count, heads_bytes_, chunk_bytes_));
  reset();
}

void ParameterBuffer::reset() {
  memory_.assign(heads_bytes_, 0);
  chunks_in_use_ = 0;
}

std::uint64_t ParameterBuffer::bytes_in_use() const { return chunk_address(chunks_in_use_); }

ParameterBuffer::Head ParameterBuffer::load_head(QueueIndex queue) const {
  Head head;
  std::memcpy(&head, &memory_[queue * kListHeadBytes], sizeof head);
  return head;
}

void ParameterBuffer::store_head(QueueIndex queue, const Head& head) {
  std::memcpy(&memory_[queue * kListHeadBytes], &head, sizeof head);
  combiner_.write(queue * kListHeadBytes, kListHeadBytes);
}

bool ParameterBuffer::add_chunk(Head& head) {
  if (chunk_address(chunks_in_use_ + 1) > capacity_) {
    if (!spill_) return false;
    ++counters_.spilled_chunks;
  }
  TESSERA_CHECK(chunks_in_use_ < std::numeric_limits<std::uint32_t>::max(), "chunk numbers fit 32 bits");
  const auto chunk = static_cast<std::uint32_t>(chunks_in_use_++);
  const std::uint64_t needed = chunk_address(chunks_in_use_);
  if (needed > memory_.capacity()) {
    const std::uint64_t room = std::max<std::uint64_t>(needed, 2 * memory_.capacity());
    if (budget_ != nullptr) budget_->charge(room, 1, "a larger parameter buffer");
    memory_.reserve(room);
  }
  memory_.resize(needed);
  if (head.entries == 0) {
    head.first_chunk = chunk;
  } else {
    // Link from the chunk before.
    std::memcpy(&memory_[chunk_address(head.last_chunk)], &chunk, sizeof chunk);
    combiner_.write(chunk_address(head.last_chunk), kChunkLinkBytes);
    counters_.queue_bytes_written += kChunkLinkBytes;
  }
  head.last_chunk = chunk;
  counters_.queue_bytes_peak = std::max(counters_.queue_bytes_peak, bytes_in_use());
  return true;
}

bool ParameterBuffer::append(QueueIndex queue, const QueueEntry& entry) {
  Head head = load_head(queue);
  const std::uint64_t slot = head.entries % entries_per_chunk_;
  if (slot == 0 && !add_chunk(head)) return false;
  // The head of a queue that has entries already is read before it is changed; a fresh one is known to be empty.
  if (head.entries > 0) combiner_.read(queue * kListHeadBytes, kListHeadBytes);
  const auto bytes = pack(entry);
  const std::uint64_t address = chunk_address(head.last_chunk) + kChunkLinkBytes + slot * kQueueEntryBytes;
  std::memcpy(&memory_[address], bytes.data(), bytes.size());
  combiner_.write(address, kQueueEntryBytes);
  TESSERA_CHECK(head.entries < std::numeric_limits<std::uint32_t>::max(), "a queue's length fits 32 bits");
  // A head is one record of the queue however often it changes; the bursts of its updates are in the ledger.
  counters_.queue_bytes_written += kQueueEntryBytes + (head.entries == 0 ? kListHeadBytes : 0);
  ++head.entries;
  store_head(queue, head);
  ++counters_.entries;
  return true;
}

void ParameterBuffer::finish() { combiner_.flush(); }

void ParameterBuffer::read_queue(QueueIndex queue, std::vector<QueueEntry>& entries, memory::Ledger& ledger,
                                 std::uint64_t& bytes_read) const {
  const auto charge = [&](std::uint64_t address, std::uint64_t bytes) {
    ledger.read_at(memory::Unit::kTilecore, memory::Purpose::kTileQueue, address, bytes, burst_bytes_);
    bytes_read += bytes;
  };
  const Head head = load_head(queue);
  charge(queue * kListHeadBytes, kListHeadBytes);
  entries.reserve(entries.size() + head.entries);
  std::uint32_t chunk = head.first_chunk;
  for (std::uint64_t left = head.entries; left > 0;) {
    const std::uint64_t here = std::min(entries_per_chunk_, left);
    left -= here;
    const std::uint64_t address = chunk_address(chunk);
    charge(address, kChunkLinkBytes + here * kQueueEntryBytes);
    for (std::uint64_t e = 0; e < here; ++e)
      entries.push_back(unpack(std::span<const std::uint8_t, kQueueEntryBytes>(
          &memory_[address + kChunkLinkBytes + e * kQueueEntryBytes], kQueueEntryBytes)));
    std::memcpy(&chunk, &memory_[address], sizeof chunk);
  }
}

}  // namespace tessera::binner
