#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "memory/dram_counters.h"
#include "memory/dram_spec.h"

namespace tessera::memory {

using DramClock = std::uint64_t;
inline constexpr DramClock kNoDramClock = std::numeric_limits<DramClock>::max();

// How a controller serves its requests. Depths count transactions of one channel; all values are [assumed].
struct DramControl {
  std::uint32_t read_depth = 32, write_depth = 32;
  // A drain of writes begins when `write_high` writes wait or no read does; it ends when `write_low` wait and a read does.
  std::uint32_t write_high = 26, write_low = 6;
  // Number of row hits that may overtake an older request for another row of their bank.
  std::uint32_t max_overtaking = 16;
  // Most writes of one drain while reads wait, and the number of reads that are then served before the next drain.
  std::uint32_t max_drained = 256, min_reads = 16;
};

// The default queues for a memory: their places count bursts, so a request of several bursts takes several places.
DramControl default_control(const DramSpec& spec);

// Throws UsageError that names the contradiction: no queue, or watermarks outside it.
void check_dram(const DramControl& control);

enum class DramCommandKind : std::uint8_t { kActivate, kPrecharge, kPrechargeAll, kRead, kWrite, kRefresh };

// A command on the bus of a channel; a log of them shows that the timings hold.
struct DramCommand {
  DramClock clock = 0;
  DramCommandKind kind = DramCommandKind::kActivate;
  std::uint32_t channel = 0, rank = 0, bank_group = 0, bank = 0, row = 0, column = 0;
};

// The controller of one channel and the banks behind it. Requests wait in two queues, reads and writes, and FR-FCFS
// chooses among the requests of the current direction: the command that can be issued first; then a column command
// before an activate or precharge; then the command for the oldest request. The request for which a row is opened
// moves from its queue to the bank and goes before all others, whatever the current direction, so no row is opened
// without being used. Rows stay open until another is wanted or the rank is refreshed. A refresh is issued when it is
// due, before any other command of the rank.
//
// The channel plans its next command whenever its state changes and issues it when its clock has come, so clocks
// without a command cost nothing.
class DramChannel {
 public:
  // An issued command, and the transaction that it may complete.
  struct Issued {
    std::uint64_t id = 0, order = 0, transaction = 0;
    DramClock done = 0;
    bool ends = false;  // a transaction ended with this command
    bool write = false;
  };

  DramChannel(const DramSpec& spec, const DramControl& control, std::uint32_t number);

  bool full(bool write) const { return waiting_[write] >= (write ? control_.write_depth : control_.read_depth); }
  bool idle() const { return waiting_[0] + waiting_[1] == 0 && openers_ == 0; }
  // True when a write to the same transaction waits.
  bool write_waits(const DramPlace& place, std::uint64_t transaction) const;
  // Takes a request; the queue must not be full. `order` rises from request to request.
  void take(const DramPlace& place, std::uint64_t transaction, bool write, std::uint64_t id, std::uint64_t order,
            DramClock now);

  // The clock of the next command, refreshes included.
  DramClock next_clock() {
    if (!planned_) plan();
    return plan_.clock;
  }
  // Issues the planned command.
  Issued issue();
  // Issues the refreshes before `until` of a channel without requests, all at once where no other command falls between them.
  void pass_idle_time(DramClock until);

  // Counters up to clock `now`.
  DramCounters counters(DramClock now) const;
  void log_into(std::vector<DramCommand>* log) { log_ = log; }

 private:
  static constexpr std::uint16_t kNone = 0xFFFF;
  static constexpr std::uint32_t kClosed = 0xFFFFFFFF;

  struct Entry {
    std::uint64_t transaction = 0, id = 0, order = 0;
    DramClock arrival = 0;
    std::uint32_t row = 0, column = 0;
    std::uint16_t next = kNone;  // next younger entry of the same bank and direction
    std::uint8_t bursts = 0;     // bursts that are still to be issued
    bool counted = false;        // already counted as hit, miss or conflict
  };
  struct Bank {
    std::uint32_t row = kClosed, overtaken = 0;
    std::uint16_t rank = 0, group = 0;  // group: number over all ranks
    DramClock column = 0, activate = 0, precharge = 0;
    // The request for which the row was opened, with its direction, until it is served.
    std::uint16_t opener = kNone;
    bool opener_writes = false;
    // The other requests by direction: the oldest, the youngest, and the oldest for the open row.
    std::array<std::uint16_t, 2> first = {kNone, kNone}, last = {kNone, kNone}, hit = {kNone, kNone};
  };
  struct Group {
    std::uint32_t rank = 0;
    std::uint64_t banks = 0;  // one bit for each bank
    DramClock activate = 0;
    std::array<DramClock, 2> column{};
  };
  struct Rank {
    DramClock activate = 0, precharge = 0, refresh = 0, opened = 0;
    std::array<DramClock, 2> column{};
    std::array<DramClock, 4> activates{};  // clock after which tFAW allows another activate after the n-th last one
    std::uint32_t activate_number = 0, open_banks = 0, openers = 0;
  };
  enum class Step : std::uint8_t { kColumn, kActivate, kPrecharge, kNothing };
  // The next step for a bank's requests of one direction, and the clock at which the bank itself is ready for it.
  struct Next {
    DramClock ready = 0;
    std::uint64_t order = 0;
    std::uint16_t entry = kNone;
    Step step = Step::kNothing;
  };
  // Orders plans: earlier clock first, then lower urgency, then older request.
  struct Plan {
    DramClock clock = kNoDramClock;
    std::uint64_t order = 0;
    std::uint32_t urgency = 0, bank = 0;
    std::uint16_t entry = kNone;
    DramCommandKind kind = DramCommandKind::kRefresh;
    bool opener = false;
    bool before(const Plan& other) const {
      if (clock != other.clock) return clock < other.clock;
      if (urgency != other.urgency) return urgency < other.urgency;
      return order < other.order;
    }
  };

  void plan();
  bool next_direction() const;
  void turn(bool writing);
  void plan_opener(std::uint32_t bank);
  void plan_bank(std::uint32_t bank, const Next& next, DramClock shared);
  Plan plan_of_refresh(std::uint32_t rank) const;
  DramClock command_clock(DramClock ready, bool activate, std::uint32_t slots) const;
  DramClock shared_clock(Step step, const Group& group, bool write) const;
  DramClock with_cas(DramClock clock) const { return n_.cas != 0 && clock >= wck_until_ ? clock + n_.cas : clock; }
  Next next_of(const Bank& bank, std::size_t direction) const;
  void update(std::uint32_t bank);
  void find_hit(Bank& bank, int direction, std::uint16_t from) const;
  void leave_queue(Bank& bank, int direction, std::uint16_t entry);
  void issue_column(Bank& bank, DramClock at, Issued& issued);
  void issue_activate(Bank& bank, DramClock at);
  void issue_precharge(Bank& bank, DramClock at);
  void issue_precharge_all(std::uint32_t rank, DramClock at);
  void issue_refresh(std::uint32_t rank, DramClock at);
  void close(Bank& bank, DramClock at, DramClock rp);
  void count_first(Entry& entry, std::uint64_t& counter);
  void log(DramClock at, const Bank* bank, std::uint32_t rank) {
    if (log_ != nullptr) add_to_log(at, bank, rank);
  }
  void add_to_log(DramClock at, const Bank* bank, std::uint32_t rank);

  const DramSpec* spec_;
  DramTimings n_;
  DramControl control_;
  std::uint32_t number_, banks_of_rank_, bursts_;

  std::vector<Entry> entries_;
  std::uint16_t free_ = kNone;
  std::vector<Bank> banks_;
  std::array<std::vector<Next>, 2> next_;  // by direction and bank
  std::vector<Group> groups_;
  std::vector<Rank> ranks_;
  std::array<std::uint32_t, 2> waiting_{};
  std::array<std::uint64_t, 2> pending_{};  // banks with requests, by direction
  std::uint64_t openers_ = 0;               // banks with an opener

  DramClock now_ = 0;        // clock of the last command or request
  DramClock bus_free_ = 0;   // clock at which the command bus is free
  DramClock wck_until_ = 0;  // the data clock runs until then
  DramClock second_half_until_ = 0;
  std::uint32_t second_half_ = 0;  // slots that the second half of the last activate still needs by then
  // The direction of the last command, and the direction for which the plan is made.
  bool writing_ = false, plan_writing_ = false, last_column_was_write_ = false;
  std::uint32_t drained_ = 0, reads_since_drain_;
  bool planned_ = false;
  Plan plan_;
  DramCounters counters_;
  std::vector<DramCommand>* log_ = nullptr;
};

}  // namespace tessera::memory
