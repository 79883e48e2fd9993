#pragma once

#include "memory/dram_channel.h"
#include "tests/support/tests.h"

namespace tessera::memory::protocol {

// Checks a log of commands against the standard's rules, pair by pair: two commands lie at least a minimum apart.
// Knows nothing of the controller. Returns the broken rules, "" where there are none.
class ProtocolChecker {
 public:
  explicit ProtocolChecker(const DramSpec& spec) : spec_(spec), n_(spec.timing) {}

  std::string check(std::vector<DramCommand> log) {
    faults_.clear();
    std::stable_sort(log.begin(), log.end(), [](const DramCommand& a, const DramCommand& b) {
      return std::tie(a.channel, a.clock) < std::tie(b.channel, b.clock);
    });
    for (std::size_t i = 0; i < log.size(); ++i) {
      for (std::size_t j = i; j-- > 0 && log[j].channel == log[i].channel && log[i].clock - log[j].clock <= reach();)
        check_pair(log[j], log[i]);
      check_state(log, i);
      check_windows(log, i);
    }
    std::string all;
    for (const std::string& fault : faults_) all += fault + "\n";
    return all;
  }

 private:
  using Kind = DramCommandKind;
  static bool column(Kind kind) { return kind == Kind::kRead || kind == Kind::kWrite; }
  static bool precharge(Kind kind) { return kind == Kind::kPrecharge || kind == Kind::kPrechargeAll; }
  static const char* name(Kind kind) {
    return std::array{"ACT", "PRE", "PREA", "RD", "WR", "REF"}[static_cast<std::size_t>(kind)];
  }

  // No rule reaches beyond this many clocks.
  DramClock reach() const { return n_.rfc + n_.rc + n_.faw + n_.wl + n_.burst_group + n_.wr + n_.wtr_l; }
  std::uint32_t slots(Kind kind) const {
    return kind == Kind::kActivate ? n_.act_slots : column(kind) ? n_.column_slots : n_.precharge_slots;
  }

  void need(const DramCommand& a, const DramCommand& b, const char* rule, std::uint64_t clocks) {
    if (b.clock < a.clock + clocks)
      faults_.insert(
          fmt::format("{}: {} to {} {} clocks, needs {}", rule, name(a.kind), name(b.kind), b.clock - a.clock, clocks));
  }

  void check_pair(const DramCommand& a, const DramCommand& b) {
    need(a, b, "command bus", slots(a.kind));
    if (column(a.kind) && column(b.kind)) check_columns(a, b);
    if (a.rank != b.rank) return;
    const bool all = a.kind == Kind::kPrechargeAll || b.kind == Kind::kPrechargeAll || a.kind == Kind::kRefresh ||
                     b.kind == Kind::kRefresh;
    const bool group = all || a.bank_group == b.bank_group;
    const bool bank = all || (group && a.bank == b.bank);
    if (a.kind == Kind::kActivate && b.kind == Kind::kActivate) {
      need(a, b, "tRRD", group ? n_.rrd_l : n_.rrd_s);
      if (bank) need(a, b, "tRC", n_.rc);
    }
    if (precharge(a.kind) && precharge(b.kind)) need(a, b, "tPPD", n_.ppd);
    if (!bank) return;
    if (a.kind == Kind::kActivate && column(b.kind)) need(a, b, "tRCD", n_.rcd);
    if (a.kind == Kind::kActivate && precharge(b.kind)) need(a, b, "tRAS", n_.ras);
    if (a.kind == Kind::kActivate && b.kind == Kind::kRefresh) need(a, b, "tRC", n_.rc);
    if (a.kind == Kind::kRead && precharge(b.kind)) need(a, b, "tRTP", n_.rtp);
    if (a.kind == Kind::kWrite && precharge(b.kind)) need(a, b, "tWR", n_.wl + n_.burst + n_.wr);
    const bool opens = b.kind == Kind::kActivate || b.kind == Kind::kRefresh;
    if (a.kind == Kind::kPrecharge && opens) need(a, b, "tRPpb", n_.rp);
    if (a.kind == Kind::kPrechargeAll && opens) need(a, b, "tRPab", n_.rp_all);
    if (a.kind == Kind::kRefresh) need(a, b, "tRFC", n_.rfc);
  }

  void check_columns(const DramCommand& a, const DramCommand& b) {
    const bool rank = a.rank == b.rank, group = rank && a.bank_group == b.bank_group;
    const bool from = a.kind == Kind::kWrite, to = b.kind == Kind::kWrite;
    if (rank && from == to) need(a, b, "tCCD", group ? n_.ccd_l : n_.ccd_s);
    if (rank && !from && to) need(a, b, "tRTW", n_.rtw);
    if (rank && from && !to)
      need(a, b, "tWTR", group ? n_.wl + n_.burst_group + n_.wtr_l : n_.wl + n_.burst + n_.wtr_s);
    // The data of one command follow the data of the other on the bus.
    const DramClock first = a.clock + (from ? n_.wl : n_.rl) + n_.burst + (rank ? 0 : n_.cs);
    if (b.clock + (to ? n_.wl : n_.rl) < first)
      faults_.insert(fmt::format("data bus: {} {} clocks behind {}", name(b.kind), b.clock - a.clock, name(a.kind)));
  }

  // Columns of open rows, activates of closed banks, refreshes of closed ranks.
  void check_state(const std::vector<DramCommand>& log, std::size_t i) {
    const DramCommand& c = log[i];
    if (i == 0 || log[i - 1].channel != c.channel) rows_.clear(), refreshes_.clear();
    const auto bank = std::tuple(c.rank, c.bank_group, c.bank);
    const auto open = rows_.find(bank);
    if (column(c.kind) && (open == rows_.end() || open->second != c.row)) faults_.insert("a column of a row not open");
    if (c.kind == Kind::kActivate && open != rows_.end()) faults_.insert("an activate of an open bank");
    if (c.kind == Kind::kActivate) rows_[bank] = c.row;
    if (c.kind == Kind::kPrecharge && open == rows_.end()) faults_.insert("a precharge of a closed bank");
    if (c.kind == Kind::kPrecharge) rows_.erase(bank);
    const auto of_rank = [&](const auto& row) { return std::get<0>(row.first) == c.rank; };
    if (c.kind == Kind::kPrechargeAll) std::erase_if(rows_, of_rank);
    if (c.kind == Kind::kRefresh && std::any_of(rows_.begin(), rows_.end(), of_rank))
      faults_.insert("a refresh with an open row");
    if (c.kind == Kind::kRefresh) {
      // tREFI on average; JESD209 lets eight be late, this controller less than one.
      const std::uint64_t number = ++refreshes_[c.rank];
      if (c.clock > (number + 1) * n_.refi) faults_.insert(fmt::format("tREFI: refresh {} at {}", number, c.clock));
    }
  }

  // Rules of more than two commands: tFAW and the halves of an activate.
  void check_windows(const std::vector<DramCommand>& log, std::size_t i) {
    const DramCommand& c = log[i];
    if (c.kind != Kind::kActivate) return;
    std::size_t before = 0;
    for (std::size_t j = i; j-- > 0 && log[j].channel == c.channel;) {
      if (log[j].kind != Kind::kActivate || log[j].rank != c.rank) continue;
      if (++before < 4) continue;
      need(log[j], c, "tFAW", n_.faw);
      break;
    }
    if (n_.act2_slots == 0) return;
    // Slots that other commands leave free until the second half must have come.
    DramClock free = 0, at = c.clock + n_.act_slots;
    const DramClock until = c.clock + n_.aad;
    for (std::size_t j = i + 1; j < log.size() && log[j].channel == c.channel && at < until; ++j) {
      if (log[j].clock > at) free += std::min(log[j].clock, until) - at;
      at = std::max(at, log[j].clock + slots(log[j].kind));
      if (log[j].kind == Kind::kActivate && free < n_.act2_slots)
        faults_.insert("tAAD: an activate between two halves");
    }
    if (at < until) free += until - at;
    if (free < n_.act2_slots) faults_.insert("tAAD: no slot for the second half of an activate");
  }

  DramSpec spec_;
  DramTimings n_;
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>, std::uint32_t> rows_;
  std::map<std::uint32_t, std::uint64_t> refreshes_;
  std::set<std::string> faults_;
};

}  // namespace tessera::memory::protocol
