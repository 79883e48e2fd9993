#include "timing/events/shader_core.h"

#include <algorithm>
#include <functional>

namespace tessera::timing {

using hardware::Stage;

ShaderCore::Rates ShaderCore::rates_of(const hardware::Machine& gpu, std::uint64_t warp_lanes) {
  const auto lanes = static_cast<double>(warp_lanes);
  return {gpu.shader.operations,
          gpu.shader.surface_operations,
          static_cast<double>(gpu.shader.lanes),
          lanes,
          gpu.rates.texels_per_clk,
          lanes / gpu.rates.compacted_samples_per_clk,
          static_cast<std::size_t>(gpu.queues.max_warps),
          static_cast<double>(gpu.queues.register_bytes),
          static_cast<double>(gpu.queues.registers),
          1,
          gpu.shader.costs == hardware::ShaderCosts::kCompiled};
}

ShaderCore::ShaderCore(std::uint32_t core, const Rates& rates, EventQueue& events, TexturePath& textures)
    : core_(core), rates_(rates), events_(events), textures_(textures) {}

void ShaderCore::begin(const TileItems& items, double now) {
  count_idle(now);
  items_ = &items;
  warps_.assign(items.warps.size(), {});
  std::uint32_t line = 0;
  for (const SubPatchItem& item : items.sub_patches) line += item.texel_lines;
  for (std::size_t w = 0; w < warps_.size(); ++w) {
    warps_[w].first_line = line;
    line += items.warps[w].texel_lines;
  }
  next_ = oldest_ = in_flight_ = done_ = 0;
  registers_taken_ = 0;
  began_ = now;
  reason_ = Stall::kNoWarp;
  if (warps_.empty())
    events_.push(now, Stage::kShader, EventKind::kShaded, core_);
  else
    launch(now);
}

double ShaderCore::cycles(std::uint32_t warp, bool first_part) const {
  const WarpItem& item = items_->warps[warp];
  const double operations = rates_.compiled ? item.clocks * rates_.compiled_clk
                                            : rates_.operations + (item.evaluates != 0 ? rates_.surface_operations : 0);
  const double all = operations * rates_.warp_lanes / rates_.lanes;
  if (item.texels == 0) return all;
  return all * (first_part ? kBeforeLookups : 1 - kBeforeLookups);
}

double ShaderCore::register_bytes(std::uint32_t warp) const {
  return (rates_.compiled ? items_->warps[warp].registers : rates_.registers) * 4 * rates_.warp_lanes;
}

void ShaderCore::launch(double now) {
  packing_ = false;
  while (next_ < warps_.size() && in_flight_ < rates_.max_warps) {
    const double packed = began_ + rates_.compaction_clk * (next_ + 1);
    if (packed > now) {
      if (!packing_) events_.push(packed, Stage::kCompaction, EventKind::kWarpReady, core_);
      packing_ = true;
      break;
    }
    // A warp that needs more than there are runs alone.
    if (in_flight_ > 0 && registers_taken_ + register_bytes(next_) > rates_.register_bytes) break;
    ++in_flight_;
    registers_taken_ += register_bytes(next_);
    warps_[next_].state = State::kFirst;
    make_ready(next_++);
  }
  issue(now);
}

void ShaderCore::make_ready(std::uint32_t warp) {
  ready_.push_back(warp);
  std::push_heap(ready_.begin(), ready_.end(), std::greater<>());
}

void ShaderCore::issue(double now) {
  if (issuing_) return;
  if (ready_.empty()) {
    // What the oldest warp in flight waits for.
    while (oldest_ < next_ && warps_[oldest_].state == State::kDone) ++oldest_;
    count_idle(now);
    if (oldest_ == next_)
      reason_ = Stall::kNoWarp;
    else
      reason_ = warps_[oldest_].state == State::kLookUp ? Stall::kTexture : Stall::kMemory;
    return;
  }
  count_idle(now);
  std::pop_heap(ready_.begin(), ready_.end(), std::greater<>());
  on_lanes_ = ready_.back();
  ready_.pop_back();
  const double clk = cycles(on_lanes_, warps_[on_lanes_].state == State::kFirst);
  busy_ += clk;
  idle_since_ = now + clk;
  issuing_ = true;
  events_.push(now + clk, Stage::kShader, EventKind::kIssue, core_);
}

void ShaderCore::count_idle(double now) {
  if (now > idle_since_) stalls_[static_cast<std::size_t>(reason_)] += now - idle_since_;
  idle_since_ = std::max(idle_since_, now);
}

void ShaderCore::lanes_free(double now) {
  issuing_ = false;
  const std::uint32_t warp = on_lanes_;
  const WarpItem& item = items_->warps[warp];
  if (warps_[warp].state == State::kFirst && item.texels > 0) {
    warps_[warp].state = State::kLookUp;
    textures_.submit(items_->texel_lines.data() + warps_[warp].first_line, item.texel_lines,
                     item.texels / rates_.texels_per_clk, EventKind::kWarpRead, warp);
    issue(now);
    return;
  }
  finish(warp, now);
}

void ShaderCore::texels_read(std::uint32_t warp, double now) {
  warps_[warp].state = State::kLast;
  make_ready(warp);
  issue(now);
}

void ShaderCore::finish(std::uint32_t warp, double now) {
  warps_[warp].state = State::kDone;
  --in_flight_;
  registers_taken_ -= register_bytes(warp);
  if (++done_ == warps_.size()) {
    reason_ = Stall::kNoTile;
    events_.push(now, Stage::kShader, EventKind::kShaded, core_);
    return;
  }
  launch(now);
}

}  // namespace tessera::timing
