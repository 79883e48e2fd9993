#pragma once

#include <cstdint>
#include <vector>

#include "memory/dram_channel.h"
#include "memory/dram_counters.h"
#include "memory/dram_spec.h"

namespace tessera::memory {

// A completed transaction: its last data were on the bus at the end of `clock`.
struct DramCompletion {
  std::uint64_t id = 0;
  DramClock clock = 0;

  bool operator==(const DramCompletion&) const = default;
};

// The model `banks` of external memory: a controller with queues for each channel, ranks, bank groups, banks and rows
// behind it, in integer clocks of the memory. Driven from outside, one step of a discrete-event simulation after another:
//
//   t = min(own next event, dram.next_event())
//   dram.advance(t, completions)          // everything before t has happened
//   if (dram.can_accept(address, write)) dram.submit(id, address, write)   // at t
//
// Requests move one transaction, the one that holds `address`. A read completes with its last data. A write completes
// when its data have crossed the bus; a unit that posts its stores ignores this. A read of a transaction for which a
// write waits is answered from the queue one clock later; a write merges with a waiting one and completes in the next
// clock. The model holds no data: a unit that must read an address before it writes there waits for the read.
// data: whoever needs a read before a write to the same address waits for the read.
//
// Invariants (cited by the tests):
//   DB1  Commands of a channel keep every timing of the spec.
//   DB2  Every request that was taken completes exactly once, at a clock after it was taken; completions come ordered
//        by clock, then by the order of the requests.
//   DB3  Results do not depend on how often advance() is called in between.
//   DB4  A full queue refuses and changes nothing; next_event() says when to ask again.
//   DB5  Bursts = bursts of a transaction x (reads + writes - forwarded - merged); row hits, misses and conflicts add up
//        to the transactions that reached the banks.
//   DB6  No request waits without end while others are taken.
class DramBanks {
 public:
  // Throws the errors of check_dram().
  explicit DramBanks(const DramSpec& spec) : DramBanks(spec, default_control(spec)) {}
  DramBanks(const DramSpec& spec, const DramControl& control);
  DramBanks(const DramBanks&) = delete;
  DramBanks& operator=(const DramBanks&) = delete;

  const DramSpec& spec() const { return spec_; }
  const DramControl& control() const { return control_; }
  // The clock to which advance() was last called.
  DramClock now() const { return now_; }

  // Returns false when the channel's queue is full.
  bool can_accept(std::uint64_t address, bool write) const { return !channels_[map_.channel(address)].full(write); }
  std::uint32_t channel(std::uint64_t address) const { return map_.channel(address); }
  // Submits a request at now(); its first command is issued then at the earliest. Returns false when it is refused.
  [[nodiscard]] bool submit(std::uint64_t id, std::uint64_t address, bool write);

  // The next clock at which the outside may see a change: a completion, or a command that frees a place in a queue.
  // Later than now(); kNoDramClock when no request is in progress.
  DramClock next_event();
  // The same for the queues of the address's channel alone: the clock at which to submit a refused request again.
  DramClock next_place(std::uint64_t address) {
    DramChannel& channel = channels_[map_.channel(address)];
    return channel.idle() ? kNoDramClock : channel.next_clock() + 1;
  }
  // Lets time pass: commands of clocks before `until` are issued; completions of clocks up to `until` are appended.
  // `until` is not before now().
  void advance(DramClock until, std::vector<DramCompletion>& completions);

  bool idle() const;
  DramCounters counters() const;
  // Logs every command from now on; nullptr stops logging. `log` must outlive this object or the next call. Commands
  // of different channels come interleaved, the commands of one channel in the order of their clocks.
  void log_into(std::vector<DramCommand>* log);

 private:
  struct Over {
    DramClock clock = 0;
    std::uint64_t order = 0, id = 0;
    // Orders a heap whose top completes first.
    bool operator<(const Over& other) const { return clock != other.clock ? clock > other.clock : order > other.order; }
  };
  void add(const Over& over);

  DramSpec spec_;
  DramControl control_;
  DramMap map_;
  std::uint64_t transaction_mask_;
  std::vector<DramChannel> channels_;
  std::vector<Over> over_;
  DramClock now_ = 0;
  std::uint64_t order_ = 0;
  DramCounters taken_;
};

}  // namespace tessera::memory
