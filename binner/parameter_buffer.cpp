#include "binner/parameter_buffer.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include <fmt/format.h>

#include "base/check.h"
#include "base/error.h"
#include "base/round_up.h"
#include "binner/list_code.h"

namespace tessera::binner {

std::uint64_t ParameterBuffer::table_address(const BinnerSpec& spec) {
  if (spec.parameter_buffer.full_policy == FullPolicy::kSpill) return std::uint64_t{1} << TileLists::kAddressBits;
  return round_up(static_cast<std::uint64_t>(spec.parameter_buffer.bytes), 4096);
}

ParameterBuffer::ParameterBuffer(const BinnerSpec& spec, QueueIndex list_count)
    : capacity_(static_cast<std::uint64_t>(spec.parameter_buffer.bytes)),
      burst_bytes_(static_cast<std::uint64_t>(spec.burst_bytes)),
      table_address_(table_address(spec)),
      spill_(spec.parameter_buffer.full_policy == FullPolicy::kSpill),
      combiner_(static_cast<std::uint64_t>(spec.binner.combining_bursts), burst_bytes_, ledger_),
      lists_({list_count, static_cast<std::uint64_t>(spec.parameter_buffer.first_chunk_bytes),
              static_cast<std::uint64_t>(spec.parameter_buffer.chunk_bytes), burst_bytes_},
             memory_, combiner_) {
  if (bytes_with(1, kRecordBytes) > capacity_)
    throw UsageError(fmt::format(
        "parameter_buffer.bytes: {} bytes cannot hold the first chunks of {} lists ({} bytes), one chunk of "
        "{} bytes and a burst of sub-patches",
        capacity_, list_count, layout().end(), layout().chunk_bytes));
  reset();
}

std::uint64_t ParameterBuffer::bytes_with(std::uint64_t chunks, std::uint64_t table_bytes) const {
  return layout().end() + round_up(chunks * layout().chunk_bytes, burst_bytes_) + round_up(table_bytes, burst_bytes_);
}

void ParameterBuffer::reset() {
  memory_.assign(layout().end(), 0);
  table_.clear();
  chunks_ = 0;
  spilled_from_ = records_spilled_from_ = std::numeric_limits<std::uint64_t>::max();
  lists_.reset();
  count_content();
}

void ParameterBuffer::count_content() {
  counters_.queue_bytes_written = lists_.content_bytes() + table_bytes_written_;
  counters_.queue_bytes_peak = std::max(counters_.queue_bytes_peak, bytes_in_use());
}

void ParameterBuffer::grow(std::vector<std::uint8_t>& memory, std::uint64_t bytes) {
  if (bytes > memory.capacity()) {
    const std::uint64_t room = std::max<std::uint64_t>(bytes, 2 * memory.capacity());
    if (budget_ != nullptr) budget_->charge(room, 1, "a larger parameter buffer");
    memory.reserve(room);
  }
  memory.resize(bytes);
}

std::uint64_t ParameterBuffer::add_chunk() {
  const std::uint64_t address = layout().end() + chunks_ * layout().chunk_bytes;
  ++chunks_;
  grow(memory_, address + layout().chunk_bytes);
  return address;
}

std::uint32_t ParameterBuffer::number_of_next(const PackedRecord& record) const {
  return static_cast<std::uint32_t>(round_up(table_.size(), record.size) / kSlotBytes);
}

void ParameterBuffer::write_record(std::uint32_t number, std::span<const std::uint8_t> bytes) {
  const std::uint64_t offset = number * std::uint64_t{kSlotBytes};
  std::memcpy(&table_[offset], bytes.data(), bytes.size());
  combiner_.write(table_address_ + offset, bytes.size());
  if (offset >= records_spilled_from_) counters_.spilled_bytes += bytes.size();
}

bool ParameterBuffer::append_entry(const ListLevels::Placement& placement, const PackedRecord* record) {
  const std::uint32_t number = record != nullptr ? number_of_next(*record) : last_record_;
  TESSERA_CHECK(number < (std::uint32_t{1} << TileLists::kNoteBits) - 1, "numbers of records fit a list's cursor");
  code_.clear();
  encode_entry({number, placement.times}, lists_.note(placement.queue), code_);
  const std::uint64_t chunks = chunks_ + lists_.chunks_needed(placement.queue, code_.size());
  const std::uint64_t table_bytes =
      record != nullptr ? number * std::uint64_t{kSlotBytes} + record->size : table_.size();
  if (bytes_with(chunks, table_bytes) > capacity_) {
    if (!spill_) return false;
    // Content already in the buffer stays there, and records complete the burst that they have begun.
    spilled_from_ = std::min(spilled_from_, layout().end() + chunks_ * layout().chunk_bytes);
    records_spilled_from_ = std::min(records_spilled_from_, round_up(table_.size(), burst_bytes_));
  }
  if (record != nullptr) {
    grow(table_, table_bytes);
    write_record(number, record->used());
    last_record_ = number;
    table_bytes_written_ += record->size;
    ++counters_.table_records;
  }
  lists_.append(
      placement.queue, code_, number + 1, [&] { return add_chunk(); },
      [&](std::uint64_t address, std::uint64_t bytes) {
        if (address >= spilled_from_) counters_.spilled_bytes += bytes;
      });
  ++counters_.entries;
  count_content();
  return true;
}

bool ParameterBuffer::append(const ListEntry& sub_patch, std::span<const ListLevels::Placement> placements,
                             std::uint32_t& next) {
  constexpr std::size_t kMost = std::numeric_limits<std::uint16_t>::max();
  const std::uint32_t first = next;
  ListEntry named = sub_patch;
  named.lists = static_cast<std::uint16_t>(std::min(placements.size() - first, kMost));
  PackedRecord record = pack_record(named);
  for (; next < placements.size(); ++next) {
    if (append_entry(placements[next], next == first ? &record : nullptr)) continue;
    if (next > first) {  // the record named all lists, but not all took it
      lower_lists(std::span(record.bytes).first(record.size),
                  static_cast<std::uint16_t>(std::min<std::size_t>(next - first, kMost)));
      write_record(last_record_, record.used());
    }
    return false;
  }
  return true;
}

void ParameterBuffer::finish() {
  combiner_.flush();
  ledger_.read_at(memory::Unit::kBinner, memory::Purpose::kTileQueue, 0, layout().bit_bytes(), burst_bytes_);
}

void ParameterBuffer::read_queue(QueueIndex list, std::vector<ListEntry>& entries, memory::Ledger& ledger,
                                 std::uint64_t& bytes_read) const {
  const std::vector<std::uint8_t> bytes = lists_.read(list, [&](std::uint64_t address, std::uint64_t count) {
    ledger.read_at(memory::Unit::kTilecore, memory::Purpose::kTileQueue, address, count, burst_bytes_);
    bytes_read += count;
  });
  std::uint32_t before = 0;
  for (std::size_t at = 0; at < bytes.size();) {
    const CodedEntry code = decode_entry(bytes, before, at);
    ListEntry& entry =
        entries.emplace_back(unpack_record(std::span(table_).subspan(std::size_t{code.record} * kSlotBytes)));
    entry.record = code.record;
    entry.t0 = static_cast<std::uint8_t>(code.times.first);
    entry.t1 = static_cast<std::uint8_t>(code.times.last);
    before = code.record + 1;
  }
}

}  // namespace tessera::binner
