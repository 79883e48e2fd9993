#include "baselines/buffer_pressure.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "base/check.h"
#include "base/round_up.h"
#include "binner/parameter_buffer.h"

namespace tessera::baselines {

std::uint64_t partial_render_bytes(std::span<const Growth> growth, std::uint64_t fixed_bytes,
                                   std::uint64_t needed_bytes, std::uint64_t capacity_bytes,
                                   std::span<const std::uint64_t> state_bytes) {
  if (needed_bytes <= capacity_bytes || capacity_bytes <= fixed_bytes) return 0;
  const std::uint64_t room = capacity_bytes - fixed_bytes, last = (needed_bytes - fixed_bytes - 1) / room;
  std::vector<std::uint64_t> stored_in(state_bytes.size(), 0);  // round, plus one
  std::uint64_t bytes = 0;
  for (const Growth& g : growth) {  // in rising order of bytes in use
    const std::uint64_t round = (std::max(g.bytes_in_use, fixed_bytes + 1) - fixed_bytes - 1) / room;
    if (round >= last || stored_in[g.tile] == round + 1) continue;
    stored_in[g.tile] = round + 1;
    bytes += 2 * state_bytes[g.tile];
  }
  return bytes;
}

std::uint64_t half_buffer_bytes(std::uint64_t needed_bytes, std::uint64_t fixed_bytes, std::uint64_t least_bytes,
                                std::uint64_t burst_bytes) {
  return fixed_bytes + std::max((needed_bytes - fixed_bytes) / 2 / burst_bytes * burst_bytes, least_bytes);
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

namespace {

using Placements = std::vector<binner::ListLevels::Placement>;

// The sub-patches that a machine binned, in order, each with the tiles that read it.
struct BinnedSubPatch {
  binner::ListEntry entry;
  Placements placements;
};
std::vector<BinnedSubPatch> binned_sub_patches(const gpu::ObservedWork& record) {
  std::vector<BinnedSubPatch> out;
  for (std::size_t t = 0; t < record.entries.size(); ++t)
    for (const binner::ListEntry& entry : record.entries[t]) {
      if (entry.record >= out.size()) out.resize(std::size_t{entry.record} + 1);
      BinnedSubPatch& sub_patch = out[entry.record];
      const auto tile = static_cast<binner::QueueIndex>(t);
      // Tiles of a second pass read their entries again.
      if (!sub_patch.placements.empty() && sub_patch.placements.back().queue == tile) continue;
      sub_patch.entry = entry;
      sub_patch.placements.push_back({tile, {entry.t0, entry.t1}});
    }
  return out;
}

// Fills a buffer with all sub-patches; calls full(sub-patch, its first refused placement) when the buffer is full.
template <class Full>
void fill(binner::ParameterBuffer& buffer, const std::vector<BinnedSubPatch>& sub_patches, const Full& full) {
  for (std::size_t n = 0; n < sub_patches.size(); ++n) {
    std::uint32_t next = 0;
    while (!buffer.append(sub_patches[n].entry, sub_patches[n].placements, next)) full(n, next);
  }
}

// Counts tile state that partial renders store and load, for each tile that got entries in a round before the last.
class StateTraffic {
 public:
  StateTraffic(const std::vector<BinnedSubPatch>& sub_patches, std::span<const std::uint64_t> state_bytes)
      : sub_patches_(sub_patches), state_bytes_(state_bytes), stored_in_(state_bytes.size(), 0) {}
  // Ends a round before placement `next` of sub-patch `n`.
  void end_round(std::size_t n, std::uint32_t next) {
    ++round_;
    for (; sub_patch_ <= n; ++sub_patch_, placement_ = 0) {
      const Placements& placements = sub_patches_[sub_patch_].placements;
      const std::size_t end = sub_patch_ == n ? next : placements.size();
      for (; placement_ < end; ++placement_) {
        const binner::QueueIndex tile = placements[placement_].queue;
        if (std::exchange(stored_in_[tile], round_) != round_) bytes_ += 2 * state_bytes_[tile];
      }
      if (sub_patch_ == n) break;
    }
  }
  std::uint64_t bytes() const { return bytes_; }

 private:
  const std::vector<BinnedSubPatch>& sub_patches_;
  std::span<const std::uint64_t> state_bytes_;
  std::vector<std::uint64_t> stored_in_;  // round
  std::uint64_t round_ = 0, bytes_ = 0;
  std::size_t sub_patch_ = 0, placement_ = 0;
};

}  // namespace

BufferPressure queue_pressure(const gpu::ObservedWork& record, const gpu::GpuConfiguration& gpu,
                              std::span<const std::uint64_t> state_bytes) {
  const std::vector<BinnedSubPatch> sub_patches = binned_sub_patches(record);
  const auto lists = static_cast<binner::QueueIndex>(record.entries.size());
  binner::BinnerSpec spec = gpu.binner_spec();
  const auto burst = static_cast<std::uint64_t>(spec.burst_bytes),
             chunk = static_cast<std::uint64_t>(spec.parameter_buffer.chunk_bytes);
  BufferPressure out;
  spec.parameter_buffer.full_policy = binner::FullPolicy::kPartialRender;
  spec.parameter_buffer.bytes = std::numeric_limits<std::int32_t>::max() * std::int64_t{64};
  {
    binner::ParameterBuffer buffer(spec, lists);
    fill(buffer, sub_patches, [](std::size_t, std::uint32_t) { TESSERA_CHECK(false, "a huge buffer takes all"); });
    out.needed_bytes = buffer.bytes_in_use();
    spec.parameter_buffer.bytes = static_cast<std::int64_t>(
        half_buffer_bytes(out.needed_bytes, buffer.layout().end(), round_up(chunk, burst) + burst, burst));
  }
  {
    binner::ParameterBuffer buffer(spec, lists);
    StateTraffic state(sub_patches, state_bytes);
    fill(buffer, sub_patches, [&](std::size_t n, std::uint32_t next) {
      state.end_round(n, next);
      buffer.reset();
    });
    out.partial_render_bytes = state.bytes();
  }
  spec.parameter_buffer.full_policy = binner::FullPolicy::kSpill;
  binner::ParameterBuffer buffer(spec, lists);
  fill(buffer, sub_patches, [](std::size_t, std::uint32_t) { TESSERA_CHECK(false, "a buffer that spills takes all"); });
  out.spill_bytes = 2 * buffer.counters().spilled_bytes;  // written and read
  return out;
}

}  // namespace tessera::baselines
