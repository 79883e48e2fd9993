#include "baselines/buffer_pressure.h"

#include <algorithm>
#include <tuple>

#include "base/round_up.h"
#include "binner/parameter_buffer.h"
#include "binner/queue_entry.h"

namespace tessera::baselines {

std::uint64_t partial_render_bytes(std::span<const Growth> growth, std::uint64_t head_bytes, std::uint64_t needed_bytes,
                                   std::uint64_t capacity_bytes, std::span<const std::uint64_t> state_bytes) {
  if (needed_bytes <= capacity_bytes || capacity_bytes <= head_bytes) return 0;
  const std::uint64_t room = capacity_bytes - head_bytes, last = (needed_bytes - head_bytes - 1) / room;
  std::vector<std::uint64_t> stored_in(state_bytes.size(), 0);  // round, plus one
  std::uint64_t bytes = 0;
  for (const Growth& g : growth) {  // in rising order of bytes in use
    const std::uint64_t round = (std::max(g.bytes_in_use, head_bytes + 1) - head_bytes - 1) / room;
    if (round >= last || stored_in[g.tile] == round + 1) continue;
    stored_in[g.tile] = round + 1;
    bytes += 2 * state_bytes[g.tile];
  }
  return bytes;
}

std::vector<std::uint64_t> tile_state_bytes(const binner::TileGrid& grid, int samples_per_pixel,
                                            std::uint64_t bytes_per_sample, std::uint64_t burst_bytes) {
  std::vector<std::uint64_t> bytes(grid.tile_count());
  for (binner::TileIndex tile = 0; tile < grid.tile_count(); ++tile) {
    const IntRect pixels = grid.pixels(tile);
    bytes[tile] = round_up(static_cast<std::uint64_t>(pixels.width()) * static_cast<std::uint64_t>(pixels.height()) *
                               static_cast<std::uint64_t>(samples_per_pixel) * bytes_per_sample,
                           burst_bytes);
  }
  return bytes;
}

BufferPressure queue_pressure(const gpu::MachineRecord& record, const gpu::GpuConfiguration& gpu,
                              std::span<const std::uint64_t> state_bytes) {
  struct Written {
    std::uint32_t patch;
    binner::TileIndex tile;
  };
  std::vector<Written> order;
  for (std::size_t t = 0; t < record.entries.size(); ++t)
    for (const binner::QueueEntry& entry : record.entries[t])
      order.push_back({entry.base_patch, static_cast<binner::TileIndex>(t)});
  std::stable_sort(order.begin(), order.end(), [](const Written& a, const Written& b) {
    return std::tie(a.patch, a.tile) < std::tie(b.patch, b.tile);
  });
  const auto chunk_bytes = static_cast<std::uint64_t>(gpu.parameter_buffer.chunk_bytes),
             burst = static_cast<std::uint64_t>(gpu.memory.burst_bytes);
  const std::uint64_t per_chunk = (chunk_bytes - binner::kChunkLinkBytes) / binner::kQueueEntryBytes;
  BufferPressure out;
  const std::uint64_t heads = round_up(record.entries.size() * binner::kListHeadBytes, burst);
  struct List {
    std::uint64_t entries = 0, chunk_end = 0;
  };
  std::vector<List> lists(record.entries.size());
  std::vector<Growth> growth;
  std::uint64_t in_use = heads;
  const std::uint64_t capacity_chunks = [&] {
    std::uint64_t chunks = 0;
    for (const auto& entries : record.entries) chunks += (entries.size() + per_chunk - 1) / per_chunk;
    out.needed_bytes = heads + chunks * chunk_bytes;
    return std::max<std::uint64_t>(1, (std::max(out.needed_bytes / 2, heads) - heads) / chunk_bytes);
  }();
  const std::uint64_t capacity = heads + capacity_chunks * chunk_bytes;
  for (const Written& w : order) {
    List& list = lists[w.tile];
    if (list.entries++ % per_chunk == 0) list.chunk_end = in_use += chunk_bytes;
    growth.push_back({in_use, w.tile});
    // Written once and read once, with a share of its chunk's link.
    if (list.chunk_end > capacity)
      out.spill_bytes +=
          2 * (binner::kQueueEntryBytes + ((list.entries - 1) % per_chunk == 0 ? binner::kChunkLinkBytes : 0));
  }
  out.partial_render_bytes = partial_render_bytes(growth, heads, out.needed_bytes, capacity, state_bytes);
  return out;
}

}  // namespace tessera::baselines
