#include "memory/dram_trace.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/json_text.h"
#include "base/text.h"
#include "base/whole_file.h"

namespace tessera::memory {
namespace {

// [assumed] A write is held longer than the queues of the known simulators can hold a read: DRAMsim3 serves no read
// while writes fill its queue of 32, so that only later reads push one through.
constexpr double kHoldNs = 4000, kMaxHoldNs = 1e9;
constexpr std::uint64_t kHoldReads = 512;

ReadWriteOrder::Bound hold_bound(double clock_mhz) {
  const auto clocks = [&](double ns) { return static_cast<std::uint64_t>(std::ceil(ns * clock_mhz * 1e-3)); };
  return {clocks(kHoldNs), kHoldReads, clocks(kMaxHoldNs)};
}

DramSpec by_bursts(DramSpec memory) {
  memory.transaction_bytes = memory.burst_bytes();
  return memory;
}

DramSpec as_written(DramSpec memory, std::uint32_t line_bytes) {
  memory.mapping = "RoBaRaCoCh";
  memory.transaction_bytes = memory.interleave_bytes = line_bytes;
  return memory;
}

const std::string kDescriptionSchema = "tessera.dram-trace/1";

// Parses "0xADDRESS READ|WRITE CYCLE" with any blanks between; returns false for any other line.
bool parse_burst(std::string_view line, Burst& burst) {
  const auto word = [&line] {
    constexpr std::string_view kBlanks = " \t\r";
    line.remove_prefix(std::min(line.find_first_not_of(kBlanks), line.size()));
    const std::string_view found = line.substr(0, line.find_first_of(kBlanks));
    line.remove_prefix(found.size());
    return found;
  };
  const auto number = [](std::string_view text, int base, std::uint64_t& value) {
    const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value, base);
    return fault == std::errc{} && end == text.data() + text.size();
  };
  const std::string_view address = word(), kind = word(), cycle = word();
  burst.write = kind == "WRITE";
  return (address.starts_with("0x") || address.starts_with("0X")) && number(address.substr(2), 16, burst.address) &&
         (burst.write || kind == "READ") && number(cycle, 10, burst.cycle) && word().empty();
}

}  // namespace

bool ReadWriteOrder::must_wait(const Address& address, const Burst& burst) const {
  if (!burst.write || !address.read) return false;
  const std::uint64_t cycle = std::max(cycle_, burst.cycle);
  if (cycle >= address.read_cycle + bound_.max_cycles) return false;
  return cycle < address.read_cycle + bound_.cycles || number_ - address.read_number < bound_.reads;
}

void ReadWriteOrder::hold_until_free(std::uint64_t address, const Address& state) {
  releases_.push({state.read_number + bound_.reads, state.read_cycle + bound_.cycles,
                  state.read_cycle + bound_.max_cycles, address});
}

void ReadWriteOrder::emit(Burst burst, Address& state) {
  burst.cycle = cycle_ = std::max(cycle_, burst.cycle);
  if (!burst.write) {
    ++number_;
    state.read = true;
    state.read_cycle = burst.cycle;
    state.read_number = number_;
    reads_.emplace_back(number_, burst.address);
  }
  out_(burst);
}

// Releases the held bursts that may go at `cycle`.
void ReadWriteOrder::release(std::uint64_t cycle, bool all) {
  while (!releases_.empty()) {
    const Release top = releases_.top();
    const bool free = number_ >= top.number && cycle >= top.cycle;
    if (!all && !free && cycle < top.late_cycle) return;
    releases_.pop();
    Address& state = addresses_[top.address];
    // The cycle is no later than the added burst's; at the end of the stream it is the cycle at which the bound is met.
    cycle_ = std::max(cycle_, all ? top.cycle : cycle);
    do {
      const Burst burst = state.held.front();
      state.held.pop_front();
      emit(burst, state);
    } while (!state.held.empty() && !must_wait(state, state.held.front()));
    if (!state.held.empty()) hold_until_free(top.address, state);
  }
}

// Forgets reads that no write has to wait for any more.
void ReadWriteOrder::forget(std::uint64_t cycle) {
  while (!reads_.empty() && number_ - reads_.front().first >= bound_.reads) {
    const auto found = addresses_.find(reads_.front().second);
    if (found != addresses_.end() && found->second.read_number == reads_.front().first) {
      if (cycle < found->second.read_cycle + bound_.cycles) return;
      if (found->second.held.empty()) addresses_.erase(found);
    }
    reads_.pop_front();
  }
}

void ReadWriteOrder::add(const Burst& burst) {
  release(burst.cycle, false);
  forget(burst.cycle);
  const auto found = addresses_.find(burst.address);
  if (found == addresses_.end() && burst.write) {
    Address none;
    emit(burst, none);
    return;
  }
  Address& state = found == addresses_.end() ? addresses_[burst.address] : found->second;
  if (!state.held.empty()) {
    state.held.push_back(burst);
  } else if (must_wait(state, burst)) {
    state.held.push_back(burst);
    hold_until_free(burst.address, state);
  } else {
    emit(burst, state);
  }
}

void ReadWriteOrder::finish() { release(cycle_, true); }

DramTrace::DramTrace(const std::filesystem::path& file, const DramTraceUnits& units, const DramSpec& memory)
    : file_(file),
      description_{units, as_written(memory, units.transaction_bytes)},
      from_(by_bursts(memory)),
      to_(description_.memory),
      burst_bytes_(memory.transaction_bytes),
      cycles_per_clock_(units.clock_mhz / memory.clock_mhz()),
      load_store_(file.extension() == ".loadstore"),
      order_(hold_bound(units.clock_mhz), [this](const Burst& transaction) { write(transaction); }) {
  if (!is_stream(file)) description_file_.emplace(dram_trace_description(file));
}

void DramTrace::write(const Burst& transaction) {
  ++transactions_;
  if (load_store_)
    fmt::format_to(std::back_inserter(text_), "{} 0x{:x}\n", transaction.write ? "ST" : "LD", transaction.address);
  else
    fmt::format_to(std::back_inserter(text_), "0x{:x} {} {}\n", transaction.address,
                   transaction.write ? "WRITE" : "READ", transaction.cycle);
}

void DramTrace::add_transaction(const Burst& transaction) {
  const bool same = any_ && transaction.address == last_.address && transaction.write == last_.write;
  last_ = transaction, any_ = true;
  // When a burst is as large as a line, every burst has its own line.
  if (!same || description_.units.transaction_bytes <= burst_bytes_) order_.add(transaction);
}

void DramTrace::add(std::span<const Burst> transactions, double frame_clocks) {
  const std::uint64_t line = description_.units.transaction_bytes;
  for (const Burst& moved : transactions) {
    const auto cycle = static_cast<std::uint64_t>(static_cast<double>(start_ + moved.cycle) * cycles_per_clock_);
    for (std::uint64_t at = moved.address; at < moved.address + burst_bytes_; at += line)
      add_transaction({cycle, to_.address(from_.place(at)) & ~(line - 1), moved.write});
  }
  file_.write(text_);
  text_.clear();
  start_ += static_cast<std::uint64_t>(std::ceil(frame_clocks));
}

void DramTrace::commit() {
  order_.finish();
  file_.write(text_);
  text_.clear();
  file_.commit();
  if (!description_file_) return;
  const DramSpec& memory = description_.memory;
  description_file_->write(json_text({{"schema", kDescriptionSchema},
                                      {"clock_mhz", description_.units.clock_mhz},
                                      {"line_bytes", description_.units.transaction_bytes},
                                      {"memory", memory.type},
                                      {"channels", memory.channels},
                                      {"mapping", memory.mapping},
                                      {"transaction_bytes", memory.transaction_bytes},
                                      {"interleave_bytes", memory.interleave_bytes}},
                                     1) +
                           "\n");
  description_file_->commit();
}

std::filesystem::path dram_trace_description(const std::filesystem::path& trace) {
  std::filesystem::path file = trace;
  return file += ".json";
}

std::optional<DramTraceDescription> read_dram_trace_description(const std::filesystem::path& trace) {
  constexpr std::uint64_t kMaxBytes = 1 << 20;
  const std::filesystem::path file = dram_trace_description(trace);
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return std::nullopt;
  const std::string name = escape_control(file.string());
  const std::vector<std::uint8_t> bytes = read_whole_file(file, kMaxBytes, name);
  const nlohmann::json said =
      parse_json(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()), name);
  try {
    if (said.at("schema") != kDescriptionSchema) throw InputError(name, "schema", "expected " + kDescriptionSchema);
    DramTraceDescription description;
    description.memory = dram_spec(said.at("memory").get<std::string>());
    description.memory.channels = said.at("channels").get<std::uint32_t>();
    description.memory.mapping = said.at("mapping").get<std::string>();
    description.memory.transaction_bytes = said.at("transaction_bytes").get<std::uint32_t>();
    description.memory.interleave_bytes = said.at("interleave_bytes").get<std::uint32_t>();
    check_dram(description.memory);
    description.units = {said.at("clock_mhz").get<double>(), said.at("line_bytes").get<std::uint32_t>()};
    const DramTraceUnits& units = description.units;
    if (!(units.clock_mhz >= 1 && units.clock_mhz <= 1e5) || units.transaction_bytes < 1 ||
        units.transaction_bytes > 65536)
      throw InputError(name, "clock_mhz, line_bytes", "expected 1 to 100000 MHz and 1 to 65536 bytes");
    return description;
  } catch (const nlohmann::json::exception& error) {
    throw InputError(name, "", escape_control(error.what()));
  } catch (const UsageError& error) {
    throw InputError(name, "", error.what());
  }
}

std::vector<Burst> read_dram_trace(const std::filesystem::path& file, std::uint64_t max_bytes) {
  const std::string name = escape_control(file.string());
  const std::vector<std::uint8_t> bytes = read_whole_file(file, max_bytes, name);
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::vector<Burst> bursts;
  bursts.reserve(static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) + 1);
  std::uint64_t last = 0;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    Burst burst;
    if (!parse_burst(line, burst))
      throw InputError(name, fmt::format("line {}", number),
                       fmt::format("\"{}\": expected 0xADDRESS READ|WRITE CYCLE", escape_control(line, 60)));
    if (burst.cycle < last)
      throw InputError(name, fmt::format("line {}", number),
                       fmt::format("cycle {} after cycle {}: cycles must not fall", burst.cycle, last));
    last = burst.cycle;
    bursts.push_back(burst);
  }
  return bursts;
}

}  // namespace tessera::memory
