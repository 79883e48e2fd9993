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

// The L2 and the external memory, shared by all.
//
//   line ---> bank (l2.banks, a line per 1 / l2.lines_per_clk) ---> hit: after l2.latency_clk
//                |                                             \--> miss: one of l2.requests, or waits for one
//   what bypasses the L2 -----------------------------------------> memory, fluid: bytes one after the other at the
//                                                                   GPU's rate, reads after memory.latency_ns
//                                                                   banks: transactions as memory::DramFront moves them
//
// Who reads opens a group, asks for lines on its behalf, and closes it; the group's event comes when all of them are
// there.
class MemoryPath {
 public:
  // `transactions`, unless null: gets what the banks' channels take, each channel's in order.
  MemoryPath(const hardware::Machine& gpu, EventQueue& events, std::vector<memory::Burst>* transactions = nullptr);

  std::uint32_t open_group(EventKind kind, std::uint32_t who, std::uint32_t what);
  // `spent`: what the time from now on goes to.
  void close_group(std::uint32_t group, double not_before, const Spent& spent = Bound::kLatency);
  // The line also waits for something that somebody else settles with settle().
  void add_wait(std::uint32_t group) { ++groups_[group].waits; }
  void settle(std::uint32_t group, double time, const Spent& spent);

  void read_line(std::uint32_t line, std::uint32_t group, double now);
  // The same on behalf of a texture cache, whose event comes when the line is there.
  void read_line(std::uint32_t line, std::uint32_t core, std::uint32_t texture_request, double now);
  // Bytes at an address past the L2; the group waits until they are there, or until the memory has taken them.
  void read_bytes(std::uint64_t address, std::uint64_t bytes, std::uint32_t group, double now);
  void write_bytes(std::uint64_t address, std::uint64_t bytes, std::uint32_t group, double now);

  void memory_has_read(std::uint32_t request, double now);
  void banks_answer(double now);

  RequestCache& l2() { return l2_; }
  // As the frame ends.
  MemoryCounts counts() const;

 private:
  // Who waits for a line: a group, or a request of a core's texture cache.
  struct Waiter {
    std::uint32_t next, core, what;
  };
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  static constexpr std::uint32_t kGroup = 0xFFFFFFFEu;  // in place of a core
  // When transactions were asked of the banks, and what led there.
  struct Asked {
    double time = 0;
    PathTime path;
  };
  struct Group {
    std::uint32_t waits = 0;
    bool closed = false;
    bool of_banks = false;  // what was ready last
    double ready = 0;
    EventKind kind{};
    std::uint32_t who = 0, what = 0;
    std::uint64_t order = 0;  // of its bytes past the L2 among all that the banks are asked for; 0: there are none
  };
  // Of a group, where paths are recorded.
  struct GroupPath {
    Asked asked;    // its bytes past the L2
    PathTime path;  // of what was ready last, unless it came from the banks
  };
  struct Request {
    std::uint32_t line = 0, waiters = kNone;
    std::uint32_t bursts = 0;  // of the banks that are not there yet
    double ready = 0;          // when the last of the others is
    std::uint64_t order = 0;   // as Group::order
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
  // To the answer of a transaction, where paths are recorded: what an idle memory takes is latency, the rest waits for
  // its banks and its bus.
  PathTime path_of(const Asked& asked, double time) const;
  // When so many bytes have passed the interface.
  double move(std::uint64_t bytes, double now);
  void move_by_banks(std::uint64_t address, std::uint64_t bytes, std::uint32_t group, bool write, double now);
  // The bursts of a line; `id`: an L2 request or, with kOfGroup, a group.
  void ask_banks(std::uint64_t id, std::uint64_t address, bool write, double now);
  // What is certain by now: it may lie ahead.
  void take_answers();
  void look_again();
  memory::DramClock dram_clock(double now) const {
    return static_cast<memory::DramClock>(std::ceil(now * dram_clocks_per_clk_));
  }

  EventQueue& events_;
  double bytes_per_clk_, latency_, bank_clk_, l2_latency_, idle_clk_ = 0;
  std::uint32_t line_bytes_, burst_bytes_ = 0;  // of the banks
  RequestCache l2_;
  std::vector<double> bank_free_;
  double memory_free_ = 0;
  std::vector<Request> requests_;
  std::vector<std::uint32_t> free_requests_;
  std::deque<Stalled> stalled_;
  std::vector<Waiter> waiters_;
  std::uint32_t free_waiter_ = kNone;
  static constexpr std::uint64_t kOfGroup = std::uint64_t{1} << 32;
  std::unique_ptr<memory::DramFront> banks_;  // null: fluid
  std::vector<memory::DramAnswer> answers_;
  double dram_clocks_per_clk_ = 0, look_ = 0;
  memory::DramClock banks_clock_ = 0;  // of the last transaction or look
  std::uint64_t asked_ = 0, transactions_ = 0;
  std::vector<Group> groups_;
  std::vector<GroupPath> group_paths_;  // where paths are recorded
  std::vector<Asked> request_paths_;    // likewise
  std::vector<std::uint32_t> free_groups_;
  MemoryCounts counts_;
};

}  // namespace tessera::timing
