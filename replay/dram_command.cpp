#include <cstdio>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/json_text.h"
#include "base/option_numbers.h"
#include "memory/dram_replay.h"
#include "memory/dram_trace.h"
#include "replay/commands.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

constexpr std::uint64_t kMaxTraceBytes = std::uint64_t{4} << 30;

json dram_report(const memory::DramSpec& spec, const memory::DramReplayResult& result) {
  json counters = json::object();
  for (const auto& field : kCounterFields<memory::DramCounters>)
    counters[std::string(field.name)] = result.counters.*field.member;
  const memory::DramEnergy& energy = result.energy;
  return {{"memory", spec.type},
          {"channels", spec.channels},
          {"mapping", spec.mapping},
          {"transaction_bytes", spec.transaction_bytes},
          {"peak_gb_s", spec.peak_gb_s()},
          {"idle_latency_ns", spec.idle_latency_ns()},
          {"transactions", result.transactions},
          {"reads", result.reads},
          {"end_ns", result.end_ns(spec)},
          {"gb_s", result.gb_s(spec)},
          {"read_latency_mean_ns", result.mean_latency_ns},
          {"read_latency_p95_ns", result.p95_latency_ns},
          {"read_latency_max_ns", result.max_latency_ns},
          {"max_lag_ns", result.max_lag_ns},
          {"row_hit_rate", result.row_hit_rate()},
          {"energy_nj",
           {{"activate", energy.activate_nj},
            {"transfer", energy.transfer_nj},
            {"io", energy.io_nj},
            {"refresh", energy.refresh_nj},
            {"background", energy.background_nj},
            {"total", energy.total_nj()}}},
          {"counters", counters}};
}

void print_dram(const memory::DramSpec& spec, const memory::DramReplayResult& result) {
  const memory::DramEnergy& energy = result.energy;
  const double total = energy.total_nj();
  fmt::print("{}: {} channels of {} bits, {:.1f} GB/s peak, {:.1f} ns idle latency, {}, transactions of {} bytes\n",
             spec.type, spec.channels, spec.channel_bits, spec.peak_gb_s(), spec.idle_latency_ns(), spec.mapping,
             spec.transaction_bytes);
  fmt::print("{:<22}{:>14.1f} us\n", "end", result.end_ns(spec) * 1e-3);
  fmt::print("{:<22}{:>14} ({} reads)\n", "transactions", result.transactions, result.reads);
  fmt::print("{:<22}{:>14.2f} GB/s, {:.1f} % of the peak\n", "bandwidth", result.gb_s(spec),
             100 * result.gb_s(spec) / spec.peak_gb_s());
  fmt::print("{:<22}{:>14.1f} ns mean, {:.1f} ns 95th percentile, {:.1f} ns at most\n", "read latency",
             result.mean_latency_ns, result.p95_latency_ns, result.max_latency_ns);
  fmt::print("{:<22}{:>14.1f} ns at most\n", "wait to be taken", result.max_lag_ns);
  fmt::print("{:<22}{:>14.1f} %\n", "row hits", 100 * result.row_hit_rate());
  fmt::print("{:<22}{:>14.1f} uJ: activate {:.1f}, transfer {:.1f}, I/O {:.1f}, refresh {:.1f}, background {:.1f}\n",
             "energy", total * 1e-3, energy.activate_nj * 1e-3, energy.transfer_nj * 1e-3, energy.io_nj * 1e-3,
             energy.refresh_nj * 1e-3, energy.background_nj * 1e-3);
}

class DramCommand final : public Command {
 public:
  explicit DramCommand(CLI::App& app) {
    app.add_option("TRACE", trace_, "A file from `tessera replay --dram-trace`: lines of 0xADDRESS READ|WRITE CYCLE")
        ->required()
        ->type_name("FILE");
    app.add_option("--memory", type_,
                   fmt::format("Kind of memory: {} (default: as TRACE.json says, else {})",
                               fmt::join(memory::dram_types(), ", "), kDefaultType))
        ->type_name("TYPE");
    app.add_option("--pace", pace_, "timed: requests come at their cycles; asap: as fast as the memory takes them")
        ->type_name("timed|asap")
        ->capture_default_str();
    app.add_option("--clock", clock_mhz_,
                   "Clock of the trace's cycles, in MHz (default: as TRACE.json says, else the memory's)")
        ->type_name("MHZ");
    app.add_option("--burst", burst_bytes_,
                   "Bytes that a line of the trace moves (default: as TRACE.json says, else 64)")
        ->type_name("BYTES");
    app.add_option("--channels", channels_, "Channels of 16 bits (default: as TRACE.json says, else 4)")
        ->type_name("N");
    app.add_option("--ranks", ranks_, "Ranks of a channel (default 1)")->type_name("N");
    app.add_option("--mapping", mapping_, "Parts of an address, the highest first, as RoBaRaCoBgCh")
        ->type_name("PARTS");
    app.add_option("--transaction", transaction_,
                   "Bytes that a request moves: whole bursts (default: as TRACE.json says, else 64)")
        ->type_name("BYTES");
    app.add_option("--interleave", interleave_, "Consecutive bytes in a channel (default: the transaction's)")
        ->type_name("BYTES");
    app.add_flag("--json", json_, "As JSON, with all counters");
    app.footer(
        "Energies are events times assumed prices: trust their proportions and their changes, not "
        "the watts.\n"
        "A read's latency counts from its cycle (timed) or from being taken (asap).");
  }

  void run() override {
    const std::optional<memory::DramTraceDescription> said = memory::read_dram_trace_description(trace_);
    memory::DramSpec spec = memory::dram_spec(!type_.empty() ? type_ : said ? said->memory.type : kDefaultType);
    if (said) {
      spec.channels = said->memory.channels, spec.mapping = said->memory.mapping;
      spec.transaction_bytes = said->memory.transaction_bytes, spec.interleave_bytes = said->memory.interleave_bytes;
    }
    const std::uint32_t burst = burst_bytes_.value_or(said ? said->units.transaction_bytes : 64);
    check_number("--burst", burst, 1, 65536);
    if (channels_) spec.channels = *channels_;
    if (ranks_) spec.ranks = *ranks_;
    if (!mapping_.empty()) spec.mapping = mapping_;
    if (transaction_) spec.transaction_bytes = *transaction_;
    if (interleave_)
      spec.interleave_bytes = *interleave_;
    else if (transaction_)
      spec.interleave_bytes = *transaction_;
    if (pace_ != "timed" && pace_ != "asap") throw UsageError(fmt::format("--pace {}: expected timed or asap", pace_));
    const double clock = clock_mhz_ ? check_number("--clock", *clock_mhz_, 1, 100000)
                         : said     ? said->units.clock_mhz
                                    : spec.clock_mhz();
    memory::DramBanks dram(spec);
    const std::vector<memory::Burst> bursts = memory::read_dram_trace(trace_, kMaxTraceBytes);
    const memory::DramReplayResult result = memory::replay_bursts(dram, bursts, {pace_ == "timed", 1e3 / clock, burst});
    if (json_)
      fmt::print("{}\n", json_text(dram_report(spec, result), 2));
    else
      print_dram(spec, result);
  }

 private:
  static constexpr const char* kDefaultType = "lpddr5-6400";

  std::string trace_, type_, pace_ = "timed", mapping_;
  std::optional<double> clock_mhz_;
  std::optional<std::uint32_t> channels_, ranks_, transaction_, interleave_, burst_bytes_;
  bool json_ = false;
};

}  // namespace

std::unique_ptr<Command> make_dram_command(CLI::App& app) { return std::make_unique<DramCommand>(app); }

}  // namespace tessera::replay
