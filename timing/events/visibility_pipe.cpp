#include "timing/events/visibility_pipe.h"

#include <algorithm>

namespace tessera::timing {

using hardware::Stage;

namespace {

// The stages of VisibilityPipe's units, in order.
constexpr std::array kStages = {Stage::kTessellator, Stage::kBoxes,         Stage::kBoxTests,   Stage::kStencil,
                                Stage::kSampling,    Stage::kTriangleTests, Stage::kAlphaTests, Stage::kCoarseDepth};

constexpr std::size_t unit_of(hardware::Event event) {
  return static_cast<std::size_t>(std::find(kStages.begin(), kStages.end(), *hardware::kEventTable[event].unit) -
                                  kStages.begin());
}

constexpr bool rows_follow_the_units() {
  for (std::size_t e = hardware::kFirstItemEvent; e + 1 < hardware::kFirstItemEvent + hardware::kItemEventCount; ++e)
    if (unit_of(static_cast<hardware::Event>(e)) > unit_of(static_cast<hardware::Event>(e + 1))) return false;
  return true;
}
static_assert(rows_follow_the_units(), "events of sub-patches stand in the order of the units that take them");

}  // namespace

VisibilityPipe::VisibilityPipe(const hardware::Machine& gpu, std::uint32_t core, EventQueue& events,
                               const Others& others)
    : gpu_(gpu),
      core_(core),
      events_(events),
      memory_(others.memory),
      textures_(others.textures),
      lanes_(others.lanes),
      on_lanes_(gpu.shades_on_lanes()),
      ring_(static_cast<std::uint32_t>(gpu.queues.items)),
      max_lines_(gpu.queues.fetched_lines) {
  for (std::size_t e = 0; e < hardware::kItemEventCount; ++e) {
    const auto event = static_cast<Event>(hardware::kFirstItemEvent + e);
    const bool shaded = on_lanes_ && event == Event::kVertices;  // lanes shade vertices, not this unit
    per_event_[e] = shaded ? 0 : gpu.clocks(event, 1);
    end_of_unit_[unit_of(event)] = e + 1;
  }
  fetch_clk_ = gpu.clocks(Event::kFetchedEntries, 1);
  sort_clk_ = gpu.clocks(Event::kSortSteps, 1);
  for (std::vector<Moment>& starts : starts_) starts.resize(ring_);
}

double VisibilityPipe::cycles(std::size_t unit, const SubPatchItem& item) const {
  double clk = 0;
  for (std::size_t e = unit == 0 ? 0 : end_of_unit_[unit - 1]; e < end_of_unit_[unit]; ++e)
    clk += item.events[e] * per_event_[e];
  return clk;
}

VisibilityPipe::Moment VisibilityPipe::moment(double now) {
  Moment moment{now, 0, {}};
  if (events_.recording()) {
    moment.event = static_cast<std::uint32_t>(paths_.size());
    paths_.push_back(events_.path());
  }
  return moment;
}

PathTime VisibilityPipe::path_of(const Moment& moment) const {
  if (!events_.recording()) return {};
  PathTime path = paths_[moment.event];
  for (std::size_t unit = 0; unit < kUnits; ++unit) path[bound_of(kStages[unit])] += moment.clk[unit];
  return path;
}

void VisibilityPipe::push(const Moment& moment, EventKind kind, std::uint32_t what) {
  // A moment that was computed ahead may be past by now; then the current event is its cause.
  if (moment.time < events_.now()) {
    events_.push(events_.now(), Stage::kFetch, kind, core_, what);
  } else {
    const PathTime path = path_of(moment);
    events_.push(moment.time, &path, kind, core_, what);
  }
}

void VisibilityPipe::begin(const TileWork& work, const TileItems& items, std::uint64_t address, double now) {
  work_ = &work;
  items_ = &items;
  address_ = address;
  count_ = static_cast<std::uint32_t>(items.sub_patches.size());
  fetched_ = given_ = started_ = passed_ = tested_ = 0;
  lines_waiting_ = 0;
  arrived_.assign(count_, {});
  if (on_lanes_) shaded_.assign(count_, {}), boxed_.assign(count_, {});
  left_.assign(count_, {});
  paths_.clear();
  first_line_.resize(count_);
  first_texel_line_.resize(count_);
  std::uint32_t line = 0, texel_line = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    first_line_[i] = line;
    first_texel_line_[i] = texel_line;
    line += items.sub_patches[i].lines;
    texel_line += items.sub_patches[i].texel_lines;
  }
  free_.fill(moment(now));
  last_given_ = free_[0];
  // Read the list and the tile's stored samples, then the records that the list names.
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
  // No entry leaves the sorter before the last entry is in it.
  const double entries = static_cast<double>(work_->events[Event::kFetchedEntries]) * fetch_clk_;
  fetch_free_ = now + entries + static_cast<double>(work_->events[Event::kSortSteps]) * sort_clk_;
  if (count_ == 0) {
    events_.push(fetch_free_, Stage::kFetch, EventKind::kTested, core_);
    return;
  }
  fetch_asked_ = true;
  events_.push(fetch_free_, Stage::kFetch, EventKind::kFetch, core_);
}

bool VisibilityPipe::may_fetch() const {
  return fetched_ < count_ && fetched_ < (on_lanes_ ? started_ : passed_) + ring_ &&
         (lines_waiting_ == 0 || lines_waiting_ + fetched_lines(items_->sub_patches[fetched_]) <= max_lines_);
}

void VisibilityPipe::fetch(double now) {
  fetch_asked_ = false;
  while (may_fetch()) {
    const SubPatchItem& item = items_->sub_patches[fetched_];
    const std::uint32_t i = fetched_++, lines = fetched_lines(item);
    if (lines == 0) {
      arrived_[i] = moment(now);
      continue;
    }
    lines_waiting_ += lines;
    const std::uint32_t group = memory_.open_group(EventKind::kItemRead, core_, i);
    for (std::uint32_t k = 0; k < lines; ++k) memory_.read_line(items_->lines[first_line_[i] + k], group, now);
    memory_.close_group(group, now);
  }
  pass_all();
}

void VisibilityPipe::item_read(std::uint32_t item, double now) {
  arrived_[item] = moment(now);
  lines_waiting_ -= fetched_lines(items_->sub_patches[item]);
  pass_all();
}

void VisibilityPipe::start_domain() {
  const auto later = [](const Moment& a, const Moment& b) -> const Moment& { return b.time > a.time ? b : a; };
  while (given_ < fetched_ && arrived_[given_].time != kUnknown) {
    Moment at = later(last_given_, arrived_[given_]);
    if (given_ > ring_) {
      // The box builder takes a sub-patch's vertices out of the queue when it begins with it.
      const Moment& room = boxed_[given_ - ring_ - 1];
      if (room.time == kUnknown) return;
      at = later(at, room);
    }
    last_given_ = at;
    push(at, EventKind::kDomainStart, given_++);
  }
}

void VisibilityPipe::domain_start(std::uint32_t item, double now) {
  ++started_;
  const SubPatchItem& work = items_->sub_patches[item];
  if (work[Event::kVertices] == 0) {
    shaded_[item] = moment(now);
  } else {
    const std::uint32_t* heights = items_->lines.data() + first_line_[item] + fetched_lines(work);
    lanes_.shade_vertices(item, work, heights, now);
  }
  pass_all();
}

void VisibilityPipe::domain_shaded(std::uint32_t item, double now) {
  shaded_[item] = moment(now);
  pass_all();
}

VisibilityPipe::Moment VisibilityPipe::pass(std::uint32_t item, std::size_t first, std::size_t last,
                                            const Moment& arrival) {
  Moment at = arrival;
  for (std::size_t unit = first; unit < last; ++unit) {
    if (free_[unit].time > at.time) at = free_[unit];
    const Moment start = at;
    const double clk = cycles(unit, items_->sub_patches[item]);
    at.time += clk;
    at.clk[unit] += clk;
    // The item stays until the next unit's queue has room, which is when that unit takes the item ring_ before.
    if (unit + 1 < kUnits && item >= ring_ && start_of(unit + 1, item).time > at.time) at = start_of(unit + 1, item);
    start_of(unit, item) = start;
    free_[unit] = at;
  }
  return at;
}

void VisibilityPipe::pass_all() {
  // Places of the units before the alpha tests depend on when the alpha tests took the item ring_ before.
  bool again = true;
  while (again) {
    again = false;
    const std::vector<Moment>& ready = on_lanes_ ? shaded_ : arrived_;
    if (passed_ < fetched_ && ready[passed_].time != kUnknown && passed_ < tested_ + ring_) {
      const std::uint32_t i = passed_++;
      left_[i] = pass(i, 0, kAlpha, ready[i]);
      if (on_lanes_) boxed_[i] = start_of(1, i);
      again = true;
      if (items_->sub_patches[i].texel_lines > 0 && i == tested_) start_alpha(i);
    }
    while (tested_ < passed_ && items_->sub_patches[tested_].texel_lines == 0) {
      finish_alpha(tested_, pass(tested_, kAlpha, kAlpha + 1, left_[tested_]));
      again = true;
    }
  }
  if (on_lanes_) start_domain();
  if (!fetch_asked_ && may_fetch()) {
    fetch_asked_ = true;
    events_.push(events_.now(), Stage::kFetch, EventKind::kFetch, core_);
  }
}

void VisibilityPipe::start_alpha(std::uint32_t item) {
  push(left_[item].time < free_[kAlpha].time ? free_[kAlpha] : left_[item], EventKind::kAlphaStart, item);
}

void VisibilityPipe::finish_alpha(std::uint32_t item, const Moment& left_tests) {
  const Moment done = pass(item, kAlpha + 1, kUnits, left_tests);
  ++tested_;
  if (tested_ == count_) {
    push(done, EventKind::kTested);
    return;
  }
  if (tested_ < passed_ && items_->sub_patches[tested_].texel_lines > 0) start_alpha(tested_);
}

void VisibilityPipe::alpha_start(std::uint32_t item, double) {
  const SubPatchItem& work = items_->sub_patches[item];
  textures_.submit(items_->texel_lines.data() + first_texel_line_[item], work.texel_lines,
                   work[Event::kAlphaTests] / gpu_.per_clk(Event::kTexels), EventKind::kAlphaRead, item);
}

void VisibilityPipe::alpha_read(std::uint32_t item, double now) {
  // The tests run while texels arrive, and end with the last of them.
  Moment left = pass(item, kAlpha, kAlpha + 1, left_[item]);
  if (left.time < now) left = moment(now);
  free_[kAlpha] = left;
  finish_alpha(item, left);
  pass_all();
}

}  // namespace tessera::timing
