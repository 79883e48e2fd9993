#include "memory/dram_banks.h"

#include <algorithm>

#include "base/check.h"

namespace tessera::memory {

DramEnergy dram_energy(const DramSpec& spec, const DramCounters& counters) {
  const double burst_bits = 8.0 * spec.burst_bytes();
  const double read_bits = burst_bits * static_cast<double>(counters.read_bursts);
  const double written_bits = burst_bits * static_cast<double>(counters.write_bursts);
  const double active = static_cast<double>(counters.active_rank_clocks) * spec.tck_ns;
  const double idle = static_cast<double>(counters.rank_clocks) * spec.tck_ns - active;
  const DramEnergyPrices& price = spec.energy;
  // A picojoule is 1e-3 nJ; 1 mW for 1 ns is 1e-3 nJ.
  return {static_cast<double>(counters.activates) * price.activate_nj.value,
          1e-3 * (read_bits * price.read_pj_bit.value + written_bits * price.write_pj_bit.value),
          1e-3 * (read_bits + written_bits) * price.io_pj_bit.value,
          static_cast<double>(counters.refreshes) * price.refresh_nj.value,
          1e-3 * (active * price.active_mw.value + idle * price.idle_mw.value)};
}

DramBanks::DramBanks(const DramSpec& spec, const DramControl& control)
    : spec_((check_dram(spec), spec)),
      control_((check_dram(control), control)),
      map_(spec),
      transaction_mask_(~std::uint64_t{spec.transaction_bytes - 1}) {
  channels_.reserve(spec_.channels);
  for (std::uint32_t i = 0; i < spec_.channels; ++i) channels_.emplace_back(spec_, control_, i);
  // Room for every transaction that waits in a queue or is on its way to the pins.
  over_.reserve(std::size_t{2} * spec_.channels * (control_.read_depth + control_.write_depth));
}

bool DramBanks::submit(std::uint64_t id, std::uint64_t address, bool write) {
  DramChannel& channel = channels_[map_.channel(address)];
  const std::uint64_t transaction = address & transaction_mask_;
  const DramPlace place = map_.place(address);
  if (channel.write_waits(place, transaction)) {
    ++(write ? taken_.merged_writes : taken_.forwarded_reads);
    if (!write) ++taken_.read_latency_clocks;
    add({now_ + 1, order_++, id});
  } else {
    if (channel.full(write)) return false;
    channel.take(place, transaction, write, id, order_++, now_);
  }
  ++(write ? taken_.writes : taken_.reads);
  return true;
}

void DramBanks::add(const Over& over) {
  over_.push_back(over);
  std::push_heap(over_.begin(), over_.end());
}

DramClock DramBanks::next_event() {
  DramClock next = over_.empty() ? kNoDramClock : over_.front().clock;
  for (DramChannel& channel : channels_)
    if (!channel.idle()) next = std::min(next, channel.next_clock() + 1);
  return next;
}

void DramBanks::advance(DramClock until, std::vector<DramCompletion>& completions) {
  TESSERA_CHECK(until >= now_, "memory: time runs backwards");
  for (DramChannel& channel : channels_) {
    while (!channel.idle() && channel.next_clock() < until)
      if (const DramChannel::Issued issued = channel.issue(); issued.ends) add({issued.done, issued.order, issued.id});
    if (channel.idle()) channel.pass_idle_time(until);
  }
  while (!over_.empty() && over_.front().clock <= until) {
    completions.push_back({over_.front().id, over_.front().clock});
    std::pop_heap(over_.begin(), over_.end());
    over_.pop_back();
  }
  now_ = until;
}

bool DramBanks::idle() const {
  return over_.empty() &&
         std::all_of(channels_.begin(), channels_.end(), [](const DramChannel& channel) { return channel.idle(); });
}

DramCounters DramBanks::counters() const {
  DramCounters total = taken_;
  for (const DramChannel& channel : channels_) merge(total, channel.counters(now_));
  return total;
}

void DramBanks::log_into(std::vector<DramCommand>* log) {
  for (DramChannel& channel : channels_) channel.log_into(log);
}

}  // namespace tessera::memory
