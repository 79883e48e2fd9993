#include "memory/dram_replay.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/error.h"

namespace tessera::memory {
namespace {

// Splits a stream of bursts into requests.
class RequestStream {
 public:
  RequestStream(const std::vector<Burst>& bursts, const DramReplayOptions& options, const DramSpec& spec)
      : bursts_(bursts), options_(options), transaction_(spec.transaction_bytes), tck_ns_(spec.tck_ns) {
    start();
  }

  bool done() const { return at_ == bursts_.size(); }
  std::uint64_t address() const { return address_; }
  bool write() const { return bursts_[at_].write; }
  DramClock due() const { return due_; }
  void next() {
    address_ += transaction_;
    if (--left_ > 0) return;
    ++at_;
    start();
  }

 private:
  void start() {
    if (done()) return;
    const std::uint64_t offset = bursts_[at_].address & (transaction_ - 1);
    address_ = bursts_[at_].address - offset;
    left_ = (offset + options_.burst_bytes + transaction_ - 1) / transaction_;
    if (!options_.timed) return;
    const double clock = std::ceil(static_cast<double>(bursts_[at_].cycle) * options_.cycle_ns / tck_ns_ - 1e-9);
    constexpr double kMaxClock = 4503599627370496.0;
    if (!(clock < kMaxClock))
      throw LimitError(fmt::format("cycle {} lies beyond 2^52 clocks of the memory", bursts_[at_].cycle));
    due_ = static_cast<DramClock>(clock);
  }

  const std::vector<Burst>& bursts_;
  const DramReplayOptions& options_;
  std::uint64_t transaction_;
  double tck_ns_;
  std::size_t at_ = 0;
  std::uint64_t address_ = 0, left_ = 0;
  DramClock due_ = 0;
};

// Latencies of reads, by the number of the request.
class Latencies {
 public:
  explicit Latencies(double tck_ns) : tck_ns_(tck_ns) {}

  void asked(DramClock at) { since_.push_back(at); }
  void over(const DramCompletion& completion) {
    if (since_[completion.id] == kNoDramClock) return;
    clocks_.push_back(static_cast<std::uint32_t>(std::min<DramClock>(completion.clock - since_[completion.id], ~0u)));
  }
  void result(DramReplayResult& result) {
    result.reads = clocks_.size();
    if (clocks_.empty()) return;
    std::sort(clocks_.begin(), clocks_.end());
    double sum = 0;
    for (const std::uint32_t clock : clocks_) sum += clock;
    result.mean_latency_ns = sum / static_cast<double>(clocks_.size()) * tck_ns_;
    result.p95_latency_ns = clocks_[clocks_.size() * 95 / 100] * tck_ns_;
    result.max_latency_ns = clocks_.back() * tck_ns_;
  }

 private:
  double tck_ns_;
  std::vector<DramClock> since_;  // time of each read; kNoDramClock for a write
  std::vector<std::uint32_t> clocks_;
};

}  // namespace

double DramReplayResult::gb_s(const DramSpec& spec) const {
  return end == 0 ? 0 : static_cast<double>(transactions) * spec.transaction_bytes / end_ns(spec);
}

double DramReplayResult::row_hit_rate() const {
  const std::uint64_t all = counters.row_hits + counters.row_misses + counters.row_conflicts;
  return all == 0 ? 0 : static_cast<double>(counters.row_hits) / static_cast<double>(all);
}

DramReplayResult replay_bursts(DramBanks& dram, const std::vector<Burst>& bursts, const DramReplayOptions& options) {
  const DramSpec& spec = dram.spec();
  DramReplayResult result;
  Latencies latencies(spec.tck_ns);
  std::vector<DramCompletion> completions;
  DramClock max_lag = 0;
  for (RequestStream stream(bursts, options, spec); !stream.done() || !dram.idle();) {
    while (!stream.done() && stream.due() <= dram.now()) {
      if (!dram.submit(result.transactions, stream.address(), stream.write())) break;
      if (options.timed) max_lag = std::max(max_lag, dram.now() - stream.due());
      latencies.asked(stream.write() ? kNoDramClock : options.timed ? stream.due() : dram.now());
      ++result.transactions;
      stream.next();
    }
    // The state changes next at the time of the next request, or when a place for it becomes free.
    const DramClock next = stream.done()               ? dram.next_event()
                           : stream.due() > dram.now() ? stream.due()
                                                       : dram.next_place(stream.address());
    if (next == kNoDramClock) break;
    completions.clear();
    dram.advance(next, completions);
    for (const DramCompletion& completion : completions) latencies.over(completion), result.end = completion.clock;
  }
  latencies.result(result);
  result.max_lag_ns = static_cast<double>(max_lag) * spec.tck_ns;
  result.counters = dram.counters();
  result.energy = dram_energy(spec, result.counters);
  return result;
}

}  // namespace tessera::memory
