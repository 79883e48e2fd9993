#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <optional>
#include <queue>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "base/output_file.h"
#include "memory/dram_spec.h"

namespace tessera::memory {

// One burst over the external memory interface.
struct Burst {
  std::uint64_t cycle = 0, address = 0;
  bool write = false;

  bool operator==(const Burst&) const = default;
};

// Separates writes from outstanding reads of the same address: a memory that takes both at once may do them in either
// order, and DRAMsim3 then never finishes. Bursts pass in the order in which they come. A write is held until its
// address's last read lies `reads` reads and `cycles` back, or `max_cycles`; later bursts to the address wait behind it.
//
// Invariants (cited by the tests):
//   RW1  A write comes no sooner after a read of its address than that bound. At the end of the stream, where no bursts
//        remain to put between them, cycles alone separate them.
//   RW2  Bursts come out once each, the bursts of one address in their order; cycles never fall.
class ReadWriteOrder {
 public:
  struct Bound {
    std::uint64_t cycles = 0, reads = 0, max_cycles = 0;
  };
  ReadWriteOrder(const Bound& bound, std::function<void(const Burst&)> out) : bound_(bound), out_(std::move(out)) {}

  void add(const Burst& burst);
  void finish();

 private:
  struct Address {
    std::uint64_t read_cycle = 0, read_number = 0;
    bool read = false;
    std::deque<Burst> held;
  };
  struct Release {
    std::uint64_t number = 0, cycle = 0, late_cycle = 0, address = 0;
    bool operator<(const Release& other) const {  // the first release is on top
      return number != other.number ? number > other.number : address > other.address;
    }
  };
  bool must_wait(const Address& address, const Burst& burst) const;
  void hold_until_free(std::uint64_t address, const Address& state);
  void release(std::uint64_t cycle, bool all);
  void emit(Burst burst, Address& state);
  void forget(std::uint64_t cycle);

  Bound bound_;
  std::function<void(const Burst&)> out_;
  std::uint64_t number_ = 0, cycle_ = 0;
  std::unordered_map<std::uint64_t, Address> addresses_;
  std::priority_queue<Release> releases_;
  std::deque<std::pair<std::uint64_t, std::uint64_t>> reads_;  // number and address of reads that will be forgotten
};

// Units of a trace's lines.
struct DramTraceUnits {
  double clock_mhz = 800;
  std::uint32_t transaction_bytes = 64;  // bytes of a line: at least a burst; addresses are multiples of it
};

// Description of a trace, FILE.json beside FILE: its units and the memory that took the requests, with the trace's addresses.
struct DramTraceDescription {
  DramTraceUnits units;
  DramSpec memory;
};

// The trace of `--dram-trace`: text with a line for each transaction, "0xADDRESS READ|WRITE CYCLE", the form of
// DRAMsim3 and of drivers of Ramulator 2's External front end. A file name that ends in .loadstore selects the form
// of Ramulator 2's LoadStoreTrace, which has no times: "LD|ST 0xADDRESS". Frames follow each other without a gap.
// Neighbouring bursts of one transaction share a line. Those simulators read addresses in the order RoBaRaCoCh, so
// the trace has them in that order, whatever the mapping of the memory, and each burst stays in its bank.
// ReadWriteOrder holds writes back by 512 reads and 4 us, a second at most. A second file,
// dram_trace_description(FILE), describes the trace, since those readers accept no other lines; a trace that goes to
// a stream has none. Throws WriteError.
class DramTrace {
 public:
  // `memory`: the memory whose transactions are added, in its clocks.
  DramTrace(const std::filesystem::path& file, const DramTraceUnits& units, const DramSpec& memory);

  // Adds a frame's transactions, in the order of their cycles; `frame_clocks` is the frame's length in clocks of the memory.
  void add(std::span<const Burst> transactions, double frame_clocks);
  void commit();
  std::uint64_t transactions() const { return transactions_; }

 private:
  void add_transaction(const Burst& transaction);
  void write(const Burst& transaction);

  OutputFile file_;
  std::optional<OutputFile> description_file_;
  DramTraceDescription description_;
  DramMap from_, to_;
  std::uint64_t burst_bytes_;
  double cycles_per_clock_;
  std::uint64_t start_ = 0, transactions_ = 0;
  Burst last_;
  bool any_ = false, load_store_;
  ReadWriteOrder order_;
  std::string text_;
};

// The name of the file that describes a trace: FILE.json.
std::filesystem::path dram_trace_description(const std::filesystem::path& trace);
// Reads the description of a trace; nothing where there is none. Throws InputError for an invalid one.
std::optional<DramTraceDescription> read_dram_trace_description(const std::filesystem::path& trace);

// Reads a trace in the form of DRAMsim3. Any bytes are taken: a line of another form, or a cycle that falls, throws
// InputError with the line's number. Throws LimitError beyond `max_bytes`.
std::vector<Burst> read_dram_trace(const std::filesystem::path& file, std::uint64_t max_bytes);

}  // namespace tessera::memory
