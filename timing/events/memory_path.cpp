#include "timing/events/memory_path.h"

#include <algorithm>
#include <numeric>

#include "timing/work.h"

namespace tessera::timing {

MemoryPath::MemoryPath(const hardware::Machine& gpu, EventQueue& events, bool infinitely_fast)
    : events_(events),
      bytes_per_clk_(memory_rate(gpu)),
      latency_(gpu.latency_clk()),
      bank_clk_(1 / gpu.queues.l2_lines_per_clk),
      l2_latency_(gpu.queues.l2_latency_clk),
      line_bytes_(static_cast<std::uint32_t>(gpu.line_bytes())),
      fast_(infinitely_fast),
      l2_(gpu.caches.l2_bytes, gpu.caches.l2_ways, gpu.line_bytes()),
      bank_free_(static_cast<std::size_t>(gpu.queues.l2_banks), 0.0),
      requests_(static_cast<std::size_t>(gpu.queues.l2_requests)),
      free_requests_(requests_.size()) {
  // The lowest number first.
  std::iota(free_requests_.rbegin(), free_requests_.rend(), 0u);
  if (gpu.memory.model != hardware::MemoryModel::kBanks) return;
  memory::DramSpec spec = memory::dram_spec(word(gpu.memory.type));
  spec.channels = static_cast<std::uint32_t>(gpu.memory.channels);
  spec.ranks = static_cast<std::uint32_t>(gpu.memory.ranks);
  spec.transaction_bytes = spec.interleave_bytes = line_bytes_;
  banks_ = std::make_unique<memory::DramBanks>(spec);
  waiting_.resize(spec.channels);
  dram_clocks_per_clk_ = spec.clock_mhz() / gpu.clock_mhz;
}

std::uint32_t MemoryPath::open_group(EventKind kind, std::uint32_t who, std::uint32_t what) {
  std::uint32_t group;
  if (free_groups_.empty()) {
    group = static_cast<std::uint32_t>(groups_.size());
    groups_.emplace_back();
  } else {
    group = free_groups_.back();
    free_groups_.pop_back();
  }
  groups_[group] = {1, false, 0, kind, who, what};  // open: it waits for close_group()
  return group;
}

void MemoryPath::close_group(std::uint32_t group, double not_before) {
  groups_[group].closed = true;
  settle(group, not_before);
}

void MemoryPath::settle(std::uint32_t group, double time) {
  Group& g = groups_[group];
  g.ready = std::max(g.ready, time);
  if (--g.waits > 0) return;
  events_.push(g.ready, g.kind, g.who, g.what);
  free_groups_.push_back(group);
}

void MemoryPath::read_line(std::uint32_t line, std::uint32_t group, double now) {
  add_wait(group);
  read(line, {kNone, kGroup, group}, now);
}

void MemoryPath::read_line(std::uint32_t line, std::uint32_t core, std::uint32_t texture_request, double now) {
  read(line, {kNone, core, texture_request}, now);
}

void MemoryPath::answer(const Waiter& waiter, double time) {
  if (waiter.core == kGroup)
    settle(waiter.what, time);
  else
    events_.push(time, EventKind::kTextureFill, waiter.core, waiter.what);
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
      answer(waiter, start + l2_latency_);
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
  requests_[request] = {line, kNone};
  add_waiter(request, waiter);
  l2_.take(line, request);
  counts_.read_bytes += line_bytes_;
  if (banks_ != nullptr)
    ask_banks(request, std::uint64_t{line} * line_bytes_, false, now);
  else
    events_.push(move(line_bytes_, now) + latency_ + l2_latency_, EventKind::kMemory, 0, request);
}

double MemoryPath::move(std::uint64_t bytes, double now) {
  if (fast_) return now;
  const double clk = static_cast<double>(bytes) / bytes_per_clk_;
  counts_.memory_busy += clk;
  return memory_free_ = std::max(memory_free_, now) + clk;
}

void MemoryPath::memory_has_read(std::uint32_t request, double now) {
  const Request done = requests_[request];
  l2_.fill(done.line, request);
  free_requests_.push_back(request);
  for (std::uint32_t w = done.waiters; w != kNone;) {
    const Waiter waiter = waiters_[w];
    waiters_[w].next = free_waiter_;
    free_waiter_ = w;
    w = waiter.next;
    answer(waiter, now);
  }
  // Whoever waited for a request may find that its line is there or under way by now.
  while (!stalled_.empty() && !free_requests_.empty()) {
    const Stalled next = stalled_.front();
    stalled_.pop_front();
    if (const std::uint32_t* found = l2_.use(next.line)) {
      if (*found == RequestCache::kThere)
        answer(next.waiter, now + l2_latency_);
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
    settle(group, move(bytes, now) + latency_);
    return;
  }
  for (std::uint64_t at = 0; at < bytes; at += line_bytes_) {
    add_wait(group);
    ask_banks(kOfGroup | group, address + at, false, now);
  }
}

void MemoryPath::write_bytes(std::uint64_t address, std::uint64_t bytes, std::uint32_t group, double now) {
  if (bytes == 0) return;
  counts_.written_bytes += bytes;
  if (banks_ == nullptr) {
    add_wait(group);
    settle(group, move(bytes, now));
    return;
  }
  for (std::uint64_t at = 0; at < bytes; at += line_bytes_) {
    add_wait(group);
    ask_banks(kOfGroup | group, address + at, true, now);
  }
}

void MemoryPath::ask_banks(std::uint64_t id, std::uint64_t address, bool write, double now) {
  if (fast_) {
    answer_transaction(id, now);
    return;
  }
  settle_banks(now);
  std::deque<Transaction>& waiting = waiting_[banks_->channel(address)];
  if (!waiting.empty() || !banks_->submit(id, address, write)) waiting.push_back({id, address, write});
  schedule_banks();
}

void MemoryPath::answer_transaction(std::uint64_t id, double time) {
  if ((id & kOfGroup) != 0)
    settle(static_cast<std::uint32_t>(id), time);
  else
    events_.push(time + l2_latency_, EventKind::kMemory, 0, static_cast<std::uint32_t>(id));
}

void MemoryPath::banks_answer(double now) {
  settle_banks(now);
  schedule_banks();
}

void MemoryPath::settle_banks(double now) {
  banks_->advance(std::max(banks_->now(), dram_clock(now)), completions_);
  for (const memory::DramCompletion& done : completions_)
    answer_transaction(done.id, static_cast<double>(done.clock) / dram_clocks_per_clk_);
  completions_.clear();
  for (std::deque<Transaction>& waiting : waiting_)
    while (!waiting.empty() && banks_->submit(waiting.front().id, waiting.front().address, waiting.front().write))
      waiting.pop_front();
}

void MemoryPath::schedule_banks() {
  const memory::DramClock next = banks_->next_event();
  if (next == memory::kNoDramClock) return;
  const double at = static_cast<double>(next) / dram_clocks_per_clk_;
  // One event ahead is enough, unless something comes before it.
  if (banks_event_ > events_.now() && banks_event_ <= at) return;
  banks_event_ = at;
  events_.push(at, EventKind::kBanks);
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
