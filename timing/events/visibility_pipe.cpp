#include "timing/events/visibility_pipe.h"

#include <algorithm>

namespace tessera::timing {

using hardware::Stage;

VisibilityPipe::VisibilityPipe(const hardware::Machine& gpu, std::uint32_t core, EventQueue& events, MemoryPath& memory,
                               TexturePath& textures, std::optional<Stage> infinitely_fast)
    : gpu_(gpu),
      core_(core),
      events_(events),
      memory_(memory),
      textures_(textures),
      ring_(static_cast<std::uint32_t>(gpu.queues.items)),
      max_lines_(gpu.queues.fetched_lines) {
  const hardware::Throughputs& rates = gpu.rates;
  const auto clk = [&](Stage stage, double per_clk) { return stage == infinitely_fast ? 0 : 1 / per_clk; };
  per_event_ = {clk(Stage::kTessellator, rates.vertices_per_clk),
                clk(Stage::kBoxes, rates.boxes_per_clk),
                clk(Stage::kBoxTests, rates.box_tests_per_clk),
                clk(Stage::kStencil, rates.stencil_tests_per_clk),
                clk(Stage::kSampling, rates.sampling_operations_per_clk),
                clk(Stage::kTriangleTests, rates.triangle_tests_per_clk),
                clk(Stage::kAlphaTests, rates.alpha_tests_per_clk),
                clk(Stage::kCoarseDepth, rates.depth_blocks_per_clk)};
  transform_clk_ = clk(Stage::kTessellator, rates.transforms_per_clk);
  fetch_clk_ = clk(Stage::kFetch, rates.fetched_entries_per_clk);
  sort_clk_ = clk(Stage::kFetch, rates.sort_steps_per_clk);
  for (std::vector<double>& starts : starts_) starts.resize(ring_);
}

double VisibilityPipe::cycles(std::size_t unit, const SubPatchItem& item) const {
  const std::array<std::uint32_t, kUnits> events = {
      item.vertices,       item.boxes,       item.box_lanes,   item.stencil_tests, item.sampling_operations,
      item.triangle_lanes, item.alpha_tests, item.depth_blocks};
  return events[unit] * per_event_[unit] + (unit == 0 ? item.transforms * transform_clk_ : 0);
}

void VisibilityPipe::begin(const TileWork& work, const TileItems& items, std::uint64_t address, double now) {
  work_ = &work;
  items_ = &items;
  address_ = address;
  count_ = static_cast<std::uint32_t>(items.sub_patches.size());
  fetched_ = passed_ = tested_ = 0;
  lines_waiting_ = 0;
  arrived_.assign(count_, kUnknown);
  left_.assign(count_, kUnknown);
  first_line_.resize(count_);
  first_texel_line_.resize(count_);
  std::uint32_t line = 0, texel_line = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    first_line_[i] = line;
    first_texel_line_[i] = texel_line;
    line += items.sub_patches[i].lines;
    texel_line += items.sub_patches[i].texel_lines;
  }
  free_.fill(now);
  // The list and what was stored of the tile; then the records that it names.
  steps_ = items.record_bytes > 0 ? 2 : 1;
  const std::uint32_t group = memory_.open_group(EventKind::kListRead, core_, 0);
  memory_.read_bytes(address_, items.list_bytes + items.load_bytes, group, now);
  memory_.close_group(group, now);
}

void VisibilityPipe::list_read(double now) {
  if (--steps_ > 0) {
    const std::uint32_t group = memory_.open_group(EventKind::kListRead, core_, 0);
    memory_.read_bytes(address_ + items_->list_bytes + items_->load_bytes, items_->record_bytes, group, now);
    memory_.close_group(group, now);
    return;
  }
  // Nothing leaves the sorter before the last entry is in it.
  const double entries = static_cast<double>(work_->entries) * fetch_clk_;
  fetch_free_ = now + entries + static_cast<double>(work_->sort_steps) * sort_clk_;
  if (count_ == 0) {
    events_.push(fetch_free_, EventKind::kTested, core_);
    return;
  }
  fetch_asked_ = true;
  events_.push(fetch_free_, EventKind::kFetch, core_);
}

bool VisibilityPipe::may_fetch() const {
  return fetched_ < count_ && fetched_ < passed_ + ring_ &&
         (lines_waiting_ == 0 || lines_waiting_ + items_->sub_patches[fetched_].lines <= max_lines_);
}

void VisibilityPipe::fetch(double now) {
  fetch_asked_ = false;
  while (may_fetch()) {
    const SubPatchItem& item = items_->sub_patches[fetched_];
    const std::uint32_t i = fetched_++;
    if (item.lines == 0) {
      arrived_[i] = now;
      continue;
    }
    lines_waiting_ += item.lines;
    const std::uint32_t group = memory_.open_group(EventKind::kItemRead, core_, i);
    for (std::uint32_t k = 0; k < item.lines; ++k) memory_.read_line(items_->lines[first_line_[i] + k], group, now);
    memory_.close_group(group, now);
  }
  pass_all();
}

void VisibilityPipe::item_read(std::uint32_t item, double now) {
  arrived_[item] = now;
  lines_waiting_ -= items_->sub_patches[item].lines;
  pass_all();
}

double VisibilityPipe::pass(std::uint32_t item, std::size_t first, std::size_t last, double arrival) {
  for (std::size_t unit = first; unit < last; ++unit) {
    const double start = std::max(arrival, free_[unit]);
    double leaves = start + cycles(unit, items_->sub_patches[item]);
    // It stays until the next unit's queue has room: until that took the item ring_ before.
    if (unit + 1 < kUnits && item >= ring_) leaves = std::max(leaves, start_of(unit + 1, item));
    start_of(unit, item) = start;
    arrival = free_[unit] = leaves;
  }
  return arrival;
}

void VisibilityPipe::pass_all() {
  // The places of the units before the alpha tests depend on when those took the item ring_ before.
  bool again = true;
  while (again) {
    again = false;
    if (passed_ < fetched_ && arrived_[passed_] != kUnknown && passed_ < tested_ + ring_) {
      const std::uint32_t i = passed_++;
      left_[i] = pass(i, 0, kAlpha, arrived_[i]);
      again = true;
      if (items_->sub_patches[i].texel_lines > 0 && i == tested_)
        events_.push(std::max(left_[i], free_[kAlpha]), EventKind::kAlphaStart, core_, i);
    }
    while (tested_ < passed_ && items_->sub_patches[tested_].texel_lines == 0) {
      finish_alpha(tested_, pass(tested_, kAlpha, kAlpha + 1, left_[tested_]));
      again = true;
    }
  }
  if (!fetch_asked_ && may_fetch()) {
    fetch_asked_ = true;
    events_.push(events_.now(), EventKind::kFetch, core_);
  }
}

void VisibilityPipe::finish_alpha(std::uint32_t item, double left_tests) {
  const double done = pass(item, kAlpha + 1, kUnits, left_tests);
  ++tested_;
  if (tested_ == count_) {
    events_.push(done, EventKind::kTested, core_);
    return;
  }
  if (tested_ < passed_ && items_->sub_patches[tested_].texel_lines > 0)
    events_.push(std::max(left_[tested_], free_[kAlpha]), EventKind::kAlphaStart, core_, tested_);
}

void VisibilityPipe::alpha_start(std::uint32_t item, double) {
  const SubPatchItem& work = items_->sub_patches[item];
  textures_.submit(items_->texel_lines.data() + first_texel_line_[item], work.texel_lines,
                   work.alpha_tests / gpu_.rates.texels_per_clk, EventKind::kAlphaRead, item);
}

void VisibilityPipe::alpha_read(std::uint32_t item, double now) {
  // The tests run while texels come, and end with the last of them.
  const double left = std::max(now, pass(item, kAlpha, kAlpha + 1, left_[item]));
  free_[kAlpha] = left;
  finish_alpha(item, left);
  pass_all();
}

}  // namespace tessera::timing
