#include "memory/dram_front.h"

#include <algorithm>

#include "base/check.h"

namespace tessera::memory {

DramFront::DramFront(const DramSpec& spec, const DramControl& control)
    : spec_((check_dram(spec), check_dram(control), spec)),
      map_(spec),
      transaction_mask_(~std::uint64_t{spec.transaction_bytes - 1}),
      read_clocks_(spec.timing.rl + spec.timing.burst),
      write_clocks_(std::min(spec.timing.rl, spec.timing.wl) + spec.timing.burst) {
  ports_.reserve(spec_.channels);
  for (std::uint32_t i = 0; i < spec_.channels; ++i) ports_.emplace_back(spec_, control, i);
}

void DramFront::ask(std::uint64_t id, std::uint64_t order, std::uint64_t address, bool write, DramClock clock,
                    std::vector<DramAnswer>& answers) {
  TESSERA_CHECK(clock >= now_, "memory: time runs backwards");
  now_ = clock;
  Port& port = ports_[map_.channel(address)];
  issue(port, clock, answers);
  Waiting asked{id, order, address & transaction_mask_, write, false};
  ++(write ? taken_.writes : taken_.reads);
  if (write) ++port.writes, ++written(port, asked.address);
  if (port.waiting.empty() && enter(port, asked, clock, answers)) return;
  asked.touches = may_touch(port, asked.address, write);
  port.touching += asked.touches ? 1 : 0;
  port.waiting.push_back(asked);
}

bool DramFront::enter(Port& port, const Waiting& asked, DramClock clock, std::vector<DramAnswer>& answers) {
  const bool full = port.channel.full(asked.write), touches = may_touch(port, asked.address, asked.write);
  if (full && !touches) return false;
  const DramPlace place = map_.place(asked.address);
  const bool merged = touches && port.channel.write_waits(place, asked.address);
  if (full && !merged) return false;
  if (log_ != nullptr) log_->push_back({clock, asked.address, asked.write});
  if (merged) {
    ++(asked.write ? taken_.merged_writes : taken_.forwarded_reads);
    if (asked.write)
      forget_write(port, asked.address);
    else
      ++taken_.read_latency_clocks;
    answers.push_back({asked.id, asked.order, clock + 1});
    return true;
  }
  port.channel.take(place, asked.address, asked.write, asked.id, asked.order, clock);
  return true;
}

void DramFront::issue(Port& port, DramClock until, std::vector<DramAnswer>& answers) {
  DramChannel& channel = port.channel;
  while (!channel.idle()) {
    const DramClock clock = channel.next_clock();
    if (clock >= until) return;
    const DramChannel::Issued issued = channel.issue();
    if (issued.ends) {
      answers.push_back({issued.id, issued.order, issued.done});
      if (issued.write) forget_write(port, issued.transaction);
    }
    while (!port.waiting.empty() && enter(port, port.waiting.front(), clock + 1, answers)) {
      port.touching -= port.waiting.front().touches ? 1 : 0;
      port.waiting.pop_front();
    }
  }
  channel.pass_idle_time(until);
}

DramClock DramFront::next_look(Port& port) const {
  if (port.channel.idle()) return kNoDramClock;
  const DramClock next = port.channel.next_clock();
  // A request that enters one clock later and finds its write there is answered in the clock after that.
  if (port.touching > 0) return next + 2;
  return next + (port.writes > 0 ? write_clocks_ : read_clocks_);
}

DramClock DramFront::next_look() {
  DramClock next = kNoDramClock;
  for (Port& port : ports_) next = std::min(next, next_look(port));
  return next;
}

void DramFront::look(DramClock clock, std::vector<DramAnswer>& answers) {
  TESSERA_CHECK(clock >= now_, "memory: time runs backwards");
  now_ = clock;
  for (Port& port : ports_) issue(port, clock, answers);
}

DramCounters DramFront::counters() const {
  DramCounters total = taken_;
  for (const Port& port : ports_) merge(total, port.channel.counters(now_));
  return total;
}

}  // namespace tessera::memory
