#include "memory/dram_channel.h"

#include <algorithm>
#include <bit>

#include <fmt/format.h>

#include "base/error.h"

namespace tessera::memory {
namespace {

using enum DramCommandKind;

// Priorities of the commands that can be issued in the same clock; the lowest goes first.
enum Urgency : std::uint32_t { kOpenerUrgency, kRefreshUrgency, kColumnUrgency, kRowUrgency };

void at_least(DramClock& clock, DramClock to) { clock = std::max(clock, to); }

}  // namespace

DramControl default_control(const DramSpec& spec) {
  DramControl control;
  const std::uint32_t bursts = std::max(spec.transaction_bytes / spec.burst_bytes(), 1u);
  for (std::uint32_t* count : {&control.read_depth, &control.write_depth, &control.write_high, &control.write_low,
                               &control.max_overtaking, &control.max_drained, &control.min_reads})
    *count = std::max(*count / bursts, 1u);
  control.write_low = std::min(control.write_low, control.write_high - 1);
  return control;
}

void check_dram(const DramControl& control) {
  constexpr std::uint32_t kMaxDepth = 4096;
  const auto need = [](bool sound, const char* rule) {
    if (!sound) throw UsageError(fmt::format("memory controller: expected {}", rule));
  };
  need(control.read_depth >= 1 && control.read_depth <= kMaxDepth, "1 to 4096 reads");
  need(control.write_depth >= 1 && control.write_depth <= kMaxDepth, "1 to 4096 writes");
  need(control.write_low < control.write_high && control.write_high <= control.write_depth,
       "low watermark < high watermark <= writes");
  need(control.max_drained >= 1 && control.min_reads >= 1, "drains and reads between them of 1 at least");
}

DramChannel::DramChannel(const DramSpec& spec, const DramControl& control, std::uint32_t number)
    : spec_(&spec),
      n_(spec.timing),
      control_(control),
      number_(number),
      banks_of_rank_(spec.banks()),
      bursts_(spec.transaction_bytes / spec.burst_bytes()),
      entries_(control.read_depth + control.write_depth + std::size_t{spec.banks()} * spec.ranks),
      banks_(std::size_t{spec.banks()} * spec.ranks),
      groups_(std::size_t{spec.bank_groups} * spec.ranks),
      ranks_(spec.ranks),
      reads_since_drain_(control.min_reads) {
  for (std::size_t i = entries_.size(); i-- > 0;) {
    entries_[i].next = free_;
    free_ = static_cast<std::uint16_t>(i);
  }
  for (std::size_t i = 0; i < banks_.size(); ++i) {
    banks_[i].rank = static_cast<std::uint16_t>(i / banks_of_rank_);
    banks_[i].group = static_cast<std::uint16_t>(i / spec.banks_per_group);
  }
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    groups_[i].rank = static_cast<std::uint32_t>(i / spec.bank_groups);
    groups_[i].banks = (spec.banks_per_group < 64 ? (std::uint64_t{1} << spec.banks_per_group) - 1 : ~std::uint64_t{0})
                       << i * spec.banks_per_group;
  }
  for (std::vector<Next>& next : next_) next.resize(banks_.size());
  // Ranks are refreshed apart from each other.
  for (std::size_t i = 0; i < ranks_.size(); ++i) ranks_[i].refresh = n_.refi * (i + 1) / ranks_.size();
}

bool DramChannel::write_waits(const DramPlace& place, std::uint64_t transaction) const {
  const Bank& bank = banks_[place.rank * banks_of_rank_ + place.bank_group * spec_->banks_per_group + place.bank];
  if (bank.opener_writes && bank.opener != kNone && entries_[bank.opener].transaction == transaction) return true;
  for (std::uint16_t e = bank.first[1]; e != kNone; e = entries_[e].next)
    if (entries_[e].transaction == transaction) return true;
  return false;
}

void DramChannel::take(const DramPlace& place, std::uint64_t transaction, bool write, std::uint64_t id,
                       std::uint64_t order, DramClock now) {
  const std::uint32_t number = place.rank * banks_of_rank_ + place.bank_group * spec_->banks_per_group + place.bank;
  Bank& bank = banks_[number];
  // The direction in the clocks that have passed did not depend on this request, so it is decided first.
  if (now > std::max(bus_free_, now_)) turn(next_direction());
  const std::uint16_t e = free_;
  Entry& entry = entries_[e];
  free_ = entry.next;
  entry = {transaction, id, order, now, place.row, place.column, kNone, static_cast<std::uint8_t>(bursts_), false};
  if (bank.first[write] == kNone)
    bank.first[write] = e;
  else
    entries_[bank.last[write]].next = e;
  bank.last[write] = e;
  if (bank.hit[write] == kNone && bank.row == place.row) bank.hit[write] = e;
  ++waiting_[write];
  pending_[write] |= std::uint64_t{1} << number;
  at_least(now_, now);
  const std::uint16_t before = next_[write][number].entry;
  Next& next = next_[write][number];
  next = next_of(bank, write);

  // The new request can change only this bank's plan, unless it changes the direction.
  if (!planned_) return;
  if (next_direction() != plan_writing_) {
    planned_ = false;
  } else if (plan_writing_ == write && next.entry != before) {
    if (plan_.entry == before && before != kNone) {
      planned_ = false;
      return;
    }
    plan_bank(number, next, shared_clock(next.step, groups_[bank.group], write));
  }
}

// Chooses the direction: writes are collected so that the data bus rarely turns round.
bool DramChannel::next_direction() const {
  const auto [reads, writes] = waiting_;
  if (!writing_) {
    const bool drain = writes >= control_.write_high && reads_since_drain_ >= control_.min_reads;
    return writes > 0 && (drain || reads == 0);
  }
  return reads == 0 || (writes > control_.write_low && drained_ < control_.max_drained);
}

void DramChannel::turn(bool writing) {
  if (writing == writing_) return;
  writing_ = writing;
  if (writing) {
    drained_ = 0;
  } else {
    // A drain that ended by itself does not delay the next one.
    reads_since_drain_ = waiting_[1] <= control_.write_low ? control_.min_reads : 0;
  }
}

DramChannel::Next DramChannel::next_of(const Bank& bank, std::size_t direction) const {
  const std::uint16_t oldest = bank.first[direction], hit = bank.hit[direction];
  if (oldest == kNone) return {};
  if (hit != kNone && (hit == oldest || bank.overtaken < control_.max_overtaking))
    return {bank.column, entries_[hit].order, hit, Step::kColumn};
  const std::uint64_t order = entries_[oldest].order;
  if (bank.row == kClosed) return {bank.activate, order, oldest, Step::kActivate};
  if (bank.opener != kNone) return {};
  return {bank.precharge, order, oldest, Step::kPrecharge};
}

void DramChannel::update(std::uint32_t bank) {
  for (const std::size_t direction : {0u, 1u}) next_[direction][bank] = next_of(banks_[bank], direction);
}

// The first clock from `ready` on at which the command bus is free: after the second half of the last activate if
// that half can wait no longer.
DramClock DramChannel::command_clock(DramClock ready, bool activate, std::uint32_t slots) const {
  DramClock clock = std::max({ready, bus_free_, now_});
  if (second_half_ > 0 && (activate || clock + slots + second_half_ > second_half_until_))
    clock = std::max(clock, bus_free_ + second_half_);
  return clock;
}

// The clock at which everything that the banks of a group share, from the group to the command bus, is ready for a step.
DramClock DramChannel::shared_clock(Step step, const Group& group, bool write) const {
  const Rank& rank = ranks_[group.rank];
  switch (step) {
    case Step::kColumn:
      return command_clock(std::max(group.column[write], rank.column[write]), false, n_.column_slots + n_.cas);
    case Step::kActivate:
      return command_clock(std::max(group.activate, rank.activate), true, n_.act_slots);
    case Step::kPrecharge:
      return command_clock(rank.precharge, false, n_.precharge_slots);
    case Step::kNothing:
      break;
  }
  return kNoDramClock;
}

void DramChannel::plan_opener(std::uint32_t number) {
  const Bank& bank = banks_[number];
  const DramClock shared = shared_clock(Step::kColumn, groups_[bank.group], bank.opener_writes);
  const Plan plan{with_cas(std::max(bank.column, shared)),
                  entries_[bank.opener].order,
                  kOpenerUrgency,
                  number,
                  bank.opener,
                  bank.opener_writes ? kWrite : kRead,
                  true};
  if (plan.before(plan_)) plan_ = plan;
}

// Plans the next command of a bank; `shared` is the clock at which its group is ready for it.
void DramChannel::plan_bank(std::uint32_t number, const Next& next, DramClock shared) {
  DramClock clock = std::max(next.ready, shared);
  if (clock > plan_.clock) return;
  const bool column = next.step == Step::kColumn;
  if (column) clock = with_cas(clock);
  // The rank issues no other command once its refresh is due.
  if (clock >= ranks_[banks_[number].rank].refresh) return;
  const Plan plan{clock,
                  next.order,
                  column ? kColumnUrgency : kRowUrgency,
                  number,
                  next.entry,
                  column ? (plan_writing_ ? kWrite : kRead) : next.step == Step::kActivate ? kActivate : kPrecharge,
                  false};
  if (plan.before(plan_)) plan_ = plan;
}

void DramChannel::plan() {
  plan_ = {};
  plan_writing_ = next_direction();
  for (std::uint64_t left = openers_; left != 0; left &= left - 1)
    plan_opener(static_cast<std::uint32_t>(std::countr_zero(left)));
  const std::uint64_t pending = pending_[plan_writing_];
  const std::vector<Next>& next = next_[plan_writing_];
  for (const Group& group : groups_) {
    std::uint64_t left = pending & group.banks;
    if (left == 0) continue;
    // 0: not computed yet, or computed to be 0.
    std::array<DramClock, 4> shared{};
    for (; left != 0; left &= left - 1) {
      const auto number = static_cast<std::uint32_t>(std::countr_zero(left));
      if (next[number].ready > plan_.clock) continue;
      DramClock& clock = shared[static_cast<std::size_t>(next[number].step)];
      if (clock == 0) clock = shared_clock(next[number].step, group, plan_writing_);
      plan_bank(number, next[number], clock);
    }
  }
  for (std::uint32_t rank = 0; rank < ranks_.size(); ++rank) {
    // No command of the refresh can be issued before it is due.
    if (ranks_[rank].refresh > plan_.clock) continue;
    const Plan plan = plan_of_refresh(rank);
    if (plan.before(plan_)) plan_ = plan;
  }
  planned_ = true;
}

DramChannel::Plan DramChannel::plan_of_refresh(std::uint32_t number) const {
  const Rank& rank = ranks_[number];
  Plan plan;
  if (rank.openers > 0) return plan;
  plan.bank = number;
  plan.urgency = kRefreshUrgency;
  plan.kind = rank.open_banks > 0 ? kPrechargeAll : kRefresh;
  plan.clock = std::max({bus_free_ + second_half_, rank.refresh, plan.kind == kPrechargeAll ? rank.precharge : 0});
  for (std::uint32_t i = 0; i < banks_of_rank_; ++i) {
    const Bank& bank = banks_[number * banks_of_rank_ + i];
    if (plan.kind == kRefresh)
      at_least(plan.clock, bank.activate);
    else if (bank.row != kClosed)
      at_least(plan.clock, bank.precharge);
  }
  return plan;
}

DramChannel::Issued DramChannel::issue() {
  const DramClock at = next_clock();
  const Plan plan = plan_;
  turn(plan_writing_);
  // The second half of an activate used the gap before this command, as far as there was one.
  const bool column = plan.kind == kRead || plan.kind == kWrite;
  const DramClock begin = column && at >= wck_until_ + n_.cas ? at - n_.cas : at;
  second_half_ -= static_cast<std::uint32_t>(std::min<DramClock>(second_half_, begin - bus_free_));
  Issued issued;
  std::uint32_t slots = n_.precharge_slots;
  switch (plan.kind) {
    case kRead:
    case kWrite:
      issue_column(banks_[plan.bank], at, issued);
      slots = n_.column_slots;
      break;
    case kActivate:
      issue_activate(banks_[plan.bank], at);
      slots = n_.act_slots;
      second_half_ = n_.act2_slots;
      second_half_until_ = at + n_.aad;
      break;
    case kPrecharge:
      issue_precharge(banks_[plan.bank], at);
      break;
    case kPrechargeAll:
      issue_precharge_all(plan.bank, at);
      break;
    case kRefresh:
      issue_refresh(plan.bank, at);
      break;
  }
  if (plan.kind != kPrechargeAll && plan.kind != kRefresh) update(plan.bank);
  now_ = at;
  bus_free_ = at + slots;
  planned_ = false;
  return issued;
}

void DramChannel::count_first(Entry& entry, std::uint64_t& counter) {
  counter += entry.counted ? 0 : 1;
  entry.counted = true;
}

void DramChannel::issue_column(Bank& bank, DramClock at, Issued& issued) {
  const int direction = plan_.kind == kWrite;
  const std::uint16_t e = plan_.entry;
  Entry& entry = entries_[e];
  log(at, &bank, bank.rank);
  count_first(entry, counters_.row_hits);
  if (!plan_.opener && e != bank.first[direction]) ++bank.overtaken;

  // Updates the earliest clocks of the commands that this one delays.
  Group& group = groups_[bank.group];
  const DramClock data = at + (direction != 0 ? n_.wl : n_.rl), end = data + n_.burst;
  group.column[direction] = at + n_.ccd_l;
  for (Rank& rank : ranks_) {
    const bool same = &rank == &ranks_[bank.rank];
    at_least(rank.column[direction], at + (same ? n_.ccd_s : n_.burst + n_.cs));
    if (direction == 0)
      at_least(rank.column[1], at + n_.rtw + (same ? 0 : n_.cs));
    else
      at_least(rank.column[0], same ? end + n_.wtr_s : std::max(at + 1, end + n_.cs - std::min<DramClock>(end, n_.rl)));
  }
  if (direction == 0) {
    at_least(bank.precharge, at + n_.rtp);
  } else {
    at_least(group.column[0], data + n_.burst_group + n_.wtr_l);
    at_least(bank.precharge, end + n_.wr);
  }
  at_least(wck_until_, end + n_.wck_post);

  counters_.bus_clocks += n_.burst;
  ++(direction != 0 ? counters_.write_bursts : counters_.read_bursts);
  const bool write = direction != 0;
  if (counters_.read_bursts + counters_.write_bursts > 1 && write != last_column_was_write_) ++counters_.turnarounds;
  last_column_was_write_ = write;
  ++entry.column;
  if (--entry.bursts > 0) return;
  issued = {entry.id, entry.order, entry.transaction, end, true, write};
  if (direction == 0)
    counters_.read_latency_clocks += end - entry.arrival, ++reads_since_drain_;
  else
    ++drained_;
  if (plan_.opener) {
    bank.opener = kNone;
    openers_ &= ~(std::uint64_t{1} << plan_.bank);
    --ranks_[bank.rank].openers;
  } else {
    leave_queue(bank, direction, e);
  }
  entries_[e].next = free_;
  free_ = e;
}

void DramChannel::issue_activate(Bank& bank, DramClock at) {
  Entry& entry = entries_[plan_.entry];
  Rank& rank = ranks_[bank.rank];
  bank.row = entry.row;
  log(at, &bank, bank.rank);
  count_first(entry, counters_.row_misses);
  ++counters_.activates;
  bank.overtaken = 0;
  bank.column = at + n_.rcd;
  at_least(bank.precharge, at + n_.ras);
  at_least(bank.activate, at + n_.rc);
  groups_[bank.group].activate = at + n_.rrd_l;
  rank.activates[rank.activate_number++ % 4] = at + n_.faw;
  rank.activate = std::max(at + n_.rrd_s, rank.activates[rank.activate_number % 4]);
  if (rank.open_banks++ == 0) rank.opened = at;
  leave_queue(bank, plan_writing_, plan_.entry);
  bank.opener = plan_.entry;
  bank.opener_writes = plan_writing_;
  openers_ |= std::uint64_t{1} << plan_.bank;
  ++rank.openers;
  for (const int direction : {0, 1}) find_hit(bank, direction, bank.first[static_cast<std::size_t>(direction)]);
}

void DramChannel::close(Bank& bank, DramClock at, DramClock rp) {
  Rank& rank = ranks_[bank.rank];
  bank.row = kClosed;
  bank.hit = {kNone, kNone};
  at_least(bank.activate, at + rp);
  if (--rank.open_banks == 0) counters_.active_rank_clocks += at - rank.opened;
}

void DramChannel::issue_precharge(Bank& bank, DramClock at) {
  log(at, &bank, bank.rank);
  count_first(entries_[plan_.entry], counters_.row_conflicts);
  ++counters_.precharges;
  close(bank, at, n_.rp);
  ranks_[bank.rank].precharge = at + n_.ppd;
}

void DramChannel::issue_precharge_all(std::uint32_t rank, DramClock at) {
  log(at, nullptr, rank);
  ++counters_.precharges;
  for (std::uint32_t i = 0; i < banks_of_rank_; ++i) {
    Bank& bank = banks_[rank * banks_of_rank_ + i];
    if (bank.row != kClosed)
      close(bank, at, n_.rp_all);
    else
      at_least(bank.activate, at + n_.rp_all);
    update(rank * banks_of_rank_ + i);
  }
  ranks_[rank].precharge = at + n_.ppd;
}

void DramChannel::issue_refresh(std::uint32_t rank, DramClock at) {
  log(at, nullptr, rank);
  ++counters_.refreshes;
  for (std::uint32_t i = rank * banks_of_rank_; i < (rank + 1) * banks_of_rank_; ++i) {
    at_least(banks_[i].activate, at + n_.rfc);
    update(i);
  }
  ranks_[rank].refresh += n_.refi;
}

void DramChannel::pass_idle_time(DramClock until) {
  while (idle() && next_clock() < until) {
    bool closed = log_ == nullptr;
    for (const Rank& rank : ranks_) closed = closed && rank.open_banks == 0;
    if (closed) {
      // Only refreshes happen, and each ends long before the next is due: all but the last are counted at once.
      for (Rank& rank : ranks_) {
        if (rank.refresh + 2 * DramClock{n_.refi} >= until) continue;
        const DramClock times = (until - 1 - rank.refresh) / n_.refi - 1;
        rank.refresh += times * n_.refi;
        counters_.refreshes += times;
      }
      planned_ = false;
      if (next_clock() >= until) return;
    }
    issue();
  }
}

void DramChannel::find_hit(Bank& bank, int direction, std::uint16_t from) const {
  while (from != kNone && entries_[from].row != bank.row) from = entries_[from].next;
  bank.hit[static_cast<std::size_t>(direction)] = from;
}

void DramChannel::leave_queue(Bank& bank, int direction, std::uint16_t e) {
  const auto d = static_cast<std::size_t>(direction);
  const std::uint16_t next = entries_[e].next;
  std::uint16_t before = kNone;
  if (bank.first[d] == e) {
    bank.first[d] = next;
  } else {
    before = bank.first[d];
    while (entries_[before].next != e) before = entries_[before].next;
    entries_[before].next = next;
  }
  if (bank.last[d] == e) bank.last[d] = before;
  if (bank.first[d] == kNone) pending_[d] &= ~(std::uint64_t{1} << plan_.bank);
  // Earlier requests of the bank are for other rows.
  find_hit(bank, direction, next);
  --waiting_[d];
}

void DramChannel::add_to_log(DramClock at, const Bank* bank, std::uint32_t rank) {
  DramCommand command{at, plan_.kind, number_, rank, 0, 0, 0, 0};
  if (bank != nullptr) {
    const auto number = static_cast<std::uint32_t>(bank - banks_.data()) % banks_of_rank_;
    command.bank_group = number / spec_->banks_per_group;
    command.bank = number % spec_->banks_per_group;
    command.row = bank->row;
    if (plan_.kind == kRead || plan_.kind == kWrite) command.column = entries_[plan_.entry].column;
  }
  log_->push_back(command);
}

DramCounters DramChannel::counters(DramClock now) const {
  DramCounters counters = counters_;
  for (const Rank& rank : ranks_) {
    if (rank.open_banks > 0 && now > rank.opened) counters.active_rank_clocks += now - rank.opened;
    counters.rank_clocks += now;
  }
  return counters;
}

}  // namespace tessera::memory
