#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

#include "memory/dram_channel.h"
#include "memory/dram_counters.h"
#include "memory/dram_spec.h"
#include "memory/dram_trace.h"

namespace tessera::memory {

// A transaction whose end is known. `order` says which was asked for first when several end in one clock.
struct DramAnswer {
  std::uint64_t id = 0, order = 0;
  DramClock clock = 0;
};

// External memory as DramBanks models it, for a simulation of events. It refuses no request, and it advances a
// channel only when a request arrives or an answer may be due. A request that finds its channel's queue full waits in
// front of it, first come first served, and enters in the clock after a command has freed a place.
//
//   front.ask(id, address, write, clock, answers)    // clocks never fall
//   front.next_look()                                // nothing that is not in `answers` yet is over before
// no answer that is missing in `answers` lies before this clock
//
// Invariants (cited by the tests):
//   DF1  Commands and answers equal the results of a DramBanks that gets the requests in the same clocks and is advanced in
//        every one.
//   DF2  Every transaction is answered exactly once, in time: a call for a clock not after the answer's appends it to
//        `answers`. The answer is known when its last column command is issued.
//   DF3  Answers and counters do not depend on how often look() is called in between.
class DramFront {
 public:
  explicit DramFront(const DramSpec& spec) : DramFront(spec, default_control(spec)) {}
  DramFront(const DramSpec& spec, const DramControl& control);
  DramFront(const DramFront&) = delete;
  DramFront& operator=(const DramFront&) = delete;

  const DramSpec& spec() const { return spec_; }
  // From now on `log` gets every transaction with the clock in which a channel takes it, in each channel's order.
  void log_into(std::vector<Burst>* log) { log_ = log; }

  // Asks for one transaction, the one that holds `address`; `order` rises from call to call.
  void ask(std::uint64_t id, std::uint64_t order, std::uint64_t address, bool write, DramClock clock,
           std::vector<DramAnswer>& answers);
  // The latest clock for the next call of look(); later than the last look(). kNoDramClock when no request is in progress.
  DramClock next_look();
  void look(DramClock clock, std::vector<DramAnswer>& answers);

  // Counters up to the clock of the last look().
  DramCounters counters() const;

 private:
  struct Waiting {
    std::uint64_t id, order, address;
    bool write, touches;
  };
  // A channel and the requests that wait in front of it.
  struct Port {
    Port(const DramSpec& spec, const DramControl& control, std::uint32_t number) : channel(spec, control, number) {}

    DramChannel channel;
    std::deque<Waiting> waiting;
    std::uint32_t writes = 0;    // writes in the channel and in front of it
    std::uint32_t touching = 0;  // waiting requests that may find a write to their transaction
    // Number of those writes by a hash of their transactions; a request whose slot is 0 meets no write.
    std::array<std::uint16_t, 256> written{};
  };
  std::uint16_t& written(Port& port, std::uint64_t address) const {
    return port.written[(address / spec_.transaction_bytes * 0x9E3779B97F4A7C15u) >> 56];
  }
  // True when a write to the same transaction may wait; `written` counts the asking write as well.
  bool may_touch(Port& port, std::uint64_t address, bool write) const {
    return written(port, address) > (write ? 1 : 0);
  }
  void forget_write(Port& port, std::uint64_t address) const { --port.writes, --written(port, address); }
  // Returns false when the queue is full.
  bool enter(Port& port, const Waiting& asked, DramClock clock, std::vector<DramAnswer>& answers);
  void issue(Port& port, DramClock until, std::vector<DramAnswer>& answers);
  DramClock next_look(Port& port) const;

  DramSpec spec_;
  DramMap map_;
  std::uint64_t transaction_mask_;
  std::uint32_t read_clocks_, write_clocks_;  // from a column command to the end of its data
  std::vector<Port> ports_;
  DramClock now_ = 0;
  DramCounters taken_;
  std::vector<Burst>* log_ = nullptr;
};

}  // namespace tessera::memory
