#pragma once

#include <cmath>
#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "hardware/machine.h"
#include "memory/dram_front.h"
#include "memory/dram_trace.h"
#include "timing/events/event_queue.h"
#include "timing/events/request_cache.h"
#include "timing/events/simulation_counts.h"

namespace tessera::timing {

// The L2 and the external memory, which all units share.
//
//   line ---> bank (l2.banks, a line per 1 / l2.lines_per_clk) ---> hit: after l2.latency_clk
//                |                                             \--> miss: one of l2.requests, or waits for one
//   traffic past the L2 ------------------------------------------> memory, fluid: bytes in sequence at the
//                                                                   GPU's rate, reads after memory.latency_ns
//                                                                   banks: transactions as memory::DramFront moves them
//
// A reader opens a group, asks for lines on its behalf, and closes it; the group's event comes when all of them have arrived.
class MemoryPath {
 public:
  // `transactions`, unless nullptr, gets the transactions that the banks' channels take, in each channel's order.
  MemoryPath(const hardware::Machine& gpu, EventQueue& events, std::vector<memory::Burst>* transactions = nullptr);

  std::uint32_t open_group(EventKind kind, std::uint32_t who, std::uint32_t what);
  // `spent` splits the time from now until the group's event.
  void close_group(std::uint32_t group, double not_before, const Spent& spent = Bound::kLatency);
  // Makes the group also wait for an answer that another unit reports with settle().
  void add_wait(std::uint32_t group) { ++groups_[group].waits; }
  void settle(std::uint32_t group, double time, const Spent& spent);

  void read_line(std::uint32_t line, std::uint32_t group, double now);
  // The same for a texture cache; its event comes when the line has arrived.
  void read_line(std::uint32_t line, std::uint32_t core, std::uint32_t texture_request, double now);
  // Moves bytes past the L2. The group waits until read bytes have arrived, or until the memory has taken written ones.
  void read_bytes(std::uint64_t address, std::uint64_t bytes, std::uint32_t group, double now);
  void write_bytes(std::uint64_t address, std::uint64_t bytes, std::uint32_t group, double now);

  void memory_has_read(std::uint32_t request, double now);
  void banks_answer(double now);

  RequestCache& l2() { return l2_; }
  // Counts at the end of the frame.
  MemoryCounts counts() const;

 private:
  // A reader that waits for a line: a group, or a request of a core's texture cache.
  struct Waiter {
    std::uint32_t next, core, what;
  };
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  static constexpr std::uint32_t kGroup = 0xFFFFFFFEu;  // marks a group, in Waiter::core
  // Time at which transactions were asked of the banks, and the path to it.
  struct Asked {
    double time = 0;
    PathTime path;
  };
  struct Group {
    std::uint32_t waits = 0;
    bool closed = false;
    bool of_banks = false;  // the last answer came from the banks
    double ready = 0;
    EventKind kind{};
    std::uint32_t who = 0, what = 0;
    std::uint64_t order = 0;  // position of its bytes past the L2 among all requests to the banks; 0 without such bytes
  };
  // Paths of a group, where paths are recorded.
  struct GroupPath {
    Asked asked;    // of its bytes past the L2
    PathTime path;  // to the last answer, unless the banks gave it
  };
  struct Request {
    std::uint32_t line = 0, waiters = kNone;
    std::uint32_t bursts = 0;  // bursts that the banks have not yet delivered
    double ready = 0;          // arrival of the last burst so far
    std::uint64_t order = 0;   // see Group::order
  };
  struct Stalled {
    std::uint32_t line;
    Waiter waiter;
  };

  void read(std::uint32_t line, const Waiter& waiter, double now);
  void answer(const Waiter& waiter, double time, const Spent& spent);
  void arrive(std::uint32_t group, double time);
  void add_waiter(std::uint32_t request, const Waiter& waiter);
  void ask_memory(std::uint32_t line, const Waiter& waiter, double now);
  Asked asked(double now) const;
  // Path to the answer of a transaction, where paths are recorded: the time that an idle memory takes is latency, the
  // rest waits for its banks and its bus.
  PathTime path_of(const Asked& asked, double time) const;
  // Time at which so many bytes have passed the interface.
  double move(std::uint64_t bytes, double now);
  void move_by_banks(std::uint64_t address, std::uint64_t bytes, std::uint32_t group, bool write, double now);
  // Asks the banks for the bursts of a line; `id` is an L2 request or, with kOfGroup, a group.
  void ask_banks(std::uint64_t id, std::uint64_t address, bool write, double now);
  // Takes all answers that are known by now; their times may lie ahead.
  void take_answers();
  void look_again();
  memory::DramClock dram_clock(double now) const {
    return static_cast<memory::DramClock>(std::ceil(now * dram_clocks_per_clk_));
  }

  EventQueue& events_;
  double bytes_per_clk_, latency_, bank_clk_, l2_latency_, idle_clk_ = 0;
  std::uint32_t line_bytes_, burst_bytes_ = 0;  // `burst_bytes_`: of the banks
  RequestCache l2_;
  std::vector<double> bank_free_;
  double memory_free_ = 0;
  std::vector<Request> requests_;
  std::vector<std::uint32_t> free_requests_;
  std::deque<Stalled> stalled_;
  std::vector<Waiter> waiters_;
  std::uint32_t free_waiter_ = kNone;
  static constexpr std::uint64_t kOfGroup = std::uint64_t{1} << 32;
  std::unique_ptr<memory::DramFront> banks_;  // nullptr with memory.model=fluid
  std::vector<memory::DramAnswer> answers_;
  double dram_clocks_per_clk_ = 0, look_ = 0;
  memory::DramClock banks_clock_ = 0;  // clock of the last transaction or look
  std::uint64_t asked_ = 0, transactions_ = 0;
  std::vector<Group> groups_;
  std::vector<GroupPath> group_paths_;  // empty unless paths are recorded
  std::vector<Asked> request_paths_;    // the same
  std::vector<std::uint32_t> free_groups_;
  MemoryCounts counts_;
};

}  // namespace tessera::timing
