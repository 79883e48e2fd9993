#include "timing/events/memory_path.h"

#include <algorithm>
#include <numeric>

#include "base/round_up.h"
#include "hardware/external_memory.h"
#include "timing/work.h"

namespace tessera::timing {

MemoryPath::MemoryPath(const hardware::Machine& gpu, EventQueue& events, std::vector<memory::Burst>* transactions)
    : events_(events),
      bytes_per_clk_(memory_rate(gpu)),
      latency_(gpu.latency_clk()),
      bank_clk_(1 / gpu.queues.l2_lines_per_clk),
      l2_latency_(gpu.queues.l2_latency_clk),
      line_bytes_(static_cast<std::uint32_t>(gpu.line_bytes())),
      l2_(gpu.caches.l2_bytes, gpu.caches.l2_ways, gpu.line_bytes()),
      bank_free_(static_cast<std::size_t>(gpu.queues.l2_banks), 0.0),
      requests_(static_cast<std::size_t>(gpu.queues.l2_requests)),
      free_requests_(requests_.size()) {
  // The lowest number is used first.
  std::iota(free_requests_.rbegin(), free_requests_.rend(), 0u);
  if (events.recording()) request_paths_.resize(requests_.size());
  if (gpu.memory.model != hardware::MemoryModel::kBanks) return;
  const memory::DramSpec spec = hardware::external_memory(gpu);
  burst_bytes_ = spec.transaction_bytes;
  banks_ = std::make_unique<memory::DramFront>(spec);
  banks_->log_into(transactions);
  dram_clocks_per_clk_ = spec.clock_mhz() / gpu.clock_mhz;
  idle_clk_ = spec.idle_latency_clocks() / dram_clocks_per_clk_;
}

std::uint32_t MemoryPath::open_group(EventKind kind, std::uint32_t who, std::uint32_t what) {
  std::uint32_t group;
  if (free_groups_.empty()) {
    group = static_cast<std::uint32_t>(groups_.size());
    groups_.emplace_back();
    if (events_.recording()) group_paths_.emplace_back();
  } else {
    group = free_groups_.back();
    free_groups_.pop_back();
  }
  Group& g = groups_[group];
  g.waits = 1;  // an open group waits for close_group()
  g.closed = g.of_banks = false;
  g.ready = 0;
  g.order = 0;
  g.kind = kind, g.who = who, g.what = what;
  return group;
}

void MemoryPath::close_group(std::uint32_t group, double not_before, const Spent& spent) {
  groups_[group].closed = true;
  settle(group, not_before, spent);
}

void MemoryPath::settle(std::uint32_t group, double time, const Spent& spent) {
  Group& g = groups_[group];
  if (time >= g.ready) {
    g.of_banks = false;
    if (events_.recording()) group_paths_[group].path = events_.path_to(time, spent);
  }
  arrive(group, time);
}

void MemoryPath::arrive(std::uint32_t group, double time) {
  Group& g = groups_[group];
  g.ready = std::max(g.ready, time);
  if (--g.waits > 0) return;
  PathTime* path = events_.recording() ? &group_paths_[group].path : nullptr;
  if (path != nullptr && g.of_banks) *path = path_of(group_paths_[group].asked, g.ready);
  if (g.order > 0)
    events_.push_answer(g.ready, g.order, path, g.kind, g.who, g.what);
  else
    events_.push(g.ready, path, g.kind, g.who, g.what);
  free_groups_.push_back(group);
}

void MemoryPath::read_line(std::uint32_t line, std::uint32_t group, double now) {
  add_wait(group);
  read(line, {kNone, kGroup, group}, now);
}

void MemoryPath::read_line(std::uint32_t line, std::uint32_t core, std::uint32_t texture_request, double now) {
  read(line, {kNone, core, texture_request}, now);
}

void MemoryPath::answer(const Waiter& waiter, double time, const Spent& spent) {
  if (waiter.core == kGroup)
    settle(waiter.what, time, spent);
  else
    events_.push(time, spent, EventKind::kTextureFill, waiter.core, waiter.what);
}

void MemoryPath::add_waiter(std::uint32_t request, const Waiter& waiter) {
  std::uint32_t at = free_waiter_;
  if (at == kNone) {
    at = static_cast<std::uint32_t>(waiters_.size());
    waiters_.emplace_back();
  } else {
    free_waiter_ = waiters_[at].next;
  }
  waiters_[at] = waiter;
  waiters_[at].next = requests_[request].waiters;
  requests_[request].waiters = at;
}

void MemoryPath::read(std::uint32_t line, const Waiter& waiter, double now) {
  ++counts_.l2_requests;
  double& bank_free = bank_free_[line % bank_free_.size()];
  const double start = std::max(now, bank_free);
  bank_free = start + bank_clk_;
  if (const std::uint32_t* request = l2_.use(line)) {
    if (*request == RequestCache::kThere)
      answer(waiter, start + l2_latency_, {Bound::kLatency, Bound::kL2, start - now});
    else
      add_waiter(*request, waiter);
    return;
  }
  if (free_requests_.empty() || !stalled_.empty())
    stalled_.push_back({line, waiter});
  else
    ask_memory(line, waiter, start);
}

void MemoryPath::ask_memory(std::uint32_t line, const Waiter& waiter, double now) {
  ++counts_.l2_misses;
  const std::uint32_t request = free_requests_.back();
  free_requests_.pop_back();
  requests_[request].line = line;
  requests_[request].waiters = kNone;
  add_waiter(request, waiter);
  l2_.take(line, request);
  counts_.read_bytes += line_bytes_;
  if (banks_ != nullptr) {
    if (events_.recording()) request_paths_[request] = asked(now);
    requests_[request].order = ++asked_;
    requests_[request].bursts = line_bytes_ / burst_bytes_;
    requests_[request].ready = 0;
    ask_banks(request, std::uint64_t{line} * line_bytes_, false, now);
    look_again();
    return;
  }
  const double moved = move(line_bytes_, now), waited = std::max(0.0, now - events_.now());
  events_.push(moved + latency_ + l2_latency_,
               {Bound::kLatency, Bound::kL2, waited, bound_of(hardware::Stage::kDram), moved - now}, EventKind::kMemory,
               0, request);
}

double MemoryPath::move(std::uint64_t bytes, double now) {
  const double clk = static_cast<double>(bytes) / bytes_per_clk_;
  counts_.memory_busy += clk;
  return memory_free_ = std::max(memory_free_, now) + clk;
}

void MemoryPath::memory_has_read(std::uint32_t request, double now) {
  l2_.fill(requests_[request].line, request);
  free_requests_.push_back(request);
  for (std::uint32_t w = requests_[request].waiters; w != kNone;) {
    const Waiter waiter = waiters_[w];
    waiters_[w].next = free_waiter_;
    free_waiter_ = w;
    w = waiter.next;
    answer(waiter, now, Bound::kLatency);
  }
  // The line of a reader that waited for a request may be cached or in flight by now.
  while (!stalled_.empty() && !free_requests_.empty()) {
    const Stalled next = stalled_.front();
    stalled_.pop_front();
    if (const std::uint32_t* found = l2_.use(next.line)) {
      if (*found == RequestCache::kThere)
        answer(next.waiter, now + l2_latency_, Bound::kLatency);
      else
        add_waiter(*found, next.waiter);
    } else {
      ask_memory(next.line, next.waiter, now);
    }
  }
}

void MemoryPath::read_bytes(std::uint64_t address, std::uint64_t bytes, std::uint32_t group, double now) {
  if (bytes == 0) return;
  counts_.read_bytes += bytes;
  if (banks_ == nullptr) {
    add_wait(group);
    const double moved = move(bytes, now);
    settle(group, moved + latency_, Spent(Bound::kLatency, bound_of(hardware::Stage::kDram), moved - events_.now()));
    return;
  }
  move_by_banks(address, bytes, group, false, now);
}

void MemoryPath::write_bytes(std::uint64_t address, std::uint64_t bytes, std::uint32_t group, double now) {
  if (bytes == 0) return;
  counts_.written_bytes += bytes;
  if (banks_ == nullptr) {
    add_wait(group);
    settle(group, move(bytes, now), Spent(hardware::Stage::kDram));
    return;
  }
  move_by_banks(address, bytes, group, true, now);
}

void MemoryPath::move_by_banks(std::uint64_t address, std::uint64_t bytes, std::uint32_t group, bool write,
                               double now) {
  if (events_.recording()) group_paths_[group].asked = asked(now);
  groups_[group].order = ++asked_;
  // A line belongs to the stream in which it begins, so that consecutive streams ask for it once.
  for (std::uint64_t at = round_up(address, line_bytes_); at < address + bytes; at += line_bytes_) {
    groups_[group].waits += line_bytes_ / burst_bytes_;
    ask_banks(kOfGroup | group, at, write, now);
  }
  look_again();
}

void MemoryPath::ask_banks(std::uint64_t id, std::uint64_t address, bool write, double now) {
  banks_clock_ = std::max(banks_clock_, dram_clock(now));
  for (std::uint64_t at = address; at < address + line_bytes_; at += burst_bytes_)
    banks_->ask(id, transactions_++, at, write, banks_clock_, answers_);
}

MemoryPath::Asked MemoryPath::asked(double now) const { return {now, events_.path_to(now, Bound::kL2)}; }

PathTime MemoryPath::path_of(const Asked& asked, double time) const {
  PathTime path = asked.path;
  Spent(bound_of(hardware::Stage::kDram), Bound::kLatency, idle_clk_).add_to(path, time - asked.time);
  return path;
}

void MemoryPath::banks_answer(double now) {
  banks_clock_ = std::max(banks_clock_, dram_clock(now));
  banks_->look(banks_clock_, answers_);
  look_again();
}

void MemoryPath::take_answers() {
  for (const memory::DramAnswer& answer : answers_) {
    const double time = static_cast<double>(answer.clock) / dram_clocks_per_clk_;
    const auto number = static_cast<std::uint32_t>(answer.id);
    if ((answer.id & kOfGroup) != 0) {
      if (time >= groups_[number].ready) groups_[number].of_banks = true;
      arrive(number, time);
      continue;
    }
    Request& request = requests_[number];
    request.ready = std::max(request.ready, time);
    if (--request.bursts > 0) continue;
    const double there = request.ready + l2_latency_;
    const std::uint64_t order = request.order;
    if (!events_.recording()) {
      events_.push_answer(there, order, nullptr, EventKind::kMemory, 0, number);
      continue;
    }
    PathTime path = path_of(request_paths_[number], request.ready);
    path[Bound::kLatency] += l2_latency_;
    events_.push_answer(there, order, &path, EventKind::kMemory, 0, number);
  }
  answers_.clear();
}

void MemoryPath::look_again() {
  take_answers();
  const memory::DramClock next = banks_->next_look();
  if (next == memory::kNoDramClock) return;
  const double at = static_cast<double>(next) / dram_clocks_per_clk_;
  // One scheduled look is enough, unless an earlier one becomes necessary.
  if (look_ > events_.now() && look_ <= at) return;
  look_ = at;
  events_.push(at, hardware::Stage::kDram, EventKind::kBanks);
}

MemoryCounts MemoryPath::counts() const {
  MemoryCounts counts = counts_;
  if (banks_ != nullptr) {
    const memory::DramCounters dram = banks_->counters();
    counts.memory_busy = static_cast<double>(dram.bus_clocks) / (dram_clocks_per_clk_ * banks_->spec().channels);
    counts.row_hits = dram.row_hits, counts.activates = dram.activates;
  }
  return counts;
}

}  // namespace tessera::timing
