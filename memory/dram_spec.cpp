#include "memory/dram_spec.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/error.h"
#include "base/text.h"

namespace tessera::memory {
namespace {

constexpr std::array<std::string_view, 4> kDramTypes = {"lpddr4x-4266", "lpddr5-6400", "lpddr5x-8533", "lpddr4-3200"};

constexpr std::string_view kLpddr4xSource =
    "JESD209-4: tRCD, tRPpb 18 ns, tRPab 21 ns, tRAS 42 ns, tRRD 7.5 ns, tFAW 30 ns, tWTR 10 ns, tWR 18 ns, tRTP 7.5 "
    "ns, tRFCab 280 ns (8 Gb a channel), tREFI 3.904 us, tCCD 8, RL 36, WL 18 at 2133 MHz, tDQSCK 3.5 ns; clocks of "
    "commands 4, 4 and 2";
constexpr std::string_view kLpddr4Source = "as lpddr4x-4266 in ns; RL 28, WL 14 at 1600 MHz";
constexpr std::string_view kLpddr5Source =
    "JESD209-5B, bank group mode, WCK:CK 4:1: RL 17, WL 9, BL/n 2 and 4, tRCD, tRPpb 18 ns, tRPab 21 ns, tRAS 42 ns, "
    "tRRD 5 ns, tFAW 20 ns, tRFCab 210 ns (8 Gb), tREFI 3.906 us; tAAD 8; tCS 2 clocks assumed";
constexpr std::string_view kLpddr5xSource =
    "as lpddr5-6400 in ns, 16 Gb (tRFCab 280 ns); RL 23, WL 12, nWR 37 at 1067 MHz assumed: the same ns";

// The least number of whole clocks that lasts at least `ns`.
std::uint32_t clocks(double ns, double tck_ns) { return static_cast<std::uint32_t>(std::ceil(ns / tck_ns - 1e-9)); }

DramSpec lpddr4(std::string_view type, double tck_ns, std::uint32_t rl, std::uint32_t wl) {
  DramSpec spec;
  spec.type = type;
  spec.bank_groups = 1;
  spec.banks_per_group = 8;
  spec.rows = 65536;
  spec.tck_ns = tck_ns;
  spec.mapping = "RoBaRaCoCh";
  spec.interleave_bytes = 256;
  const double t = spec.tck_ns;
  DramTimings& n = spec.timing;
  n.burst = n.burst_group = n.ccd_s = n.ccd_l = 8;
  n.rcd = clocks(18, t), n.rp = clocks(18, t), n.rp_all = clocks(21, t), n.ras = clocks(42, t), n.rc = n.ras + n.rp;
  n.rrd_s = n.rrd_l = clocks(7.5, t), n.faw = clocks(30, t);
  // The read latency at the pins includes tDQSCK.
  const std::uint32_t dqsck = clocks(3.5, t);
  n.rl = rl + dqsck, n.wl = wl;
  n.rtw = n.rl + n.burst + 2 - n.wl;
  n.wtr_s = n.wtr_l = clocks(10, t) + 1, n.rtp = clocks(7.5, t), n.wr = clocks(18, t) + 1, n.ppd = 4, n.cs = 4;
  n.refi = clocks(3904, t), n.rfc = clocks(280, t);
  n.act_slots = 4, n.column_slots = 4, n.precharge_slots = 2;
  spec.energy = {{1.6, 0.8, 3.2}, {3.2, 2.2, 4.5}, {3.0, 2.1, 4.2}, {8.0, 4.0, 10.0},
                 {26, 13, 52},    {26, 13, 52},    {15, 7, 30}};
  return spec;
}

// LPDDR5 in bank group mode; the arguments give the values that do not scale with the clock.
DramSpec lpddr5(std::string_view type, double tck_ns, std::uint32_t rl, std::uint32_t wl, std::uint32_t wr) {
  DramSpec spec;
  spec.type = type;
  spec.bank_groups = spec.banks_per_group = 4;
  spec.tck_ns = tck_ns;
  const double t = tck_ns;
  DramTimings& n = spec.timing;
  n.burst = 2, n.burst_group = 4, n.ccd_s = 2, n.ccd_l = 4;
  n.rcd = clocks(18, t), n.rp = clocks(18, t), n.rp_all = clocks(21, t), n.ras = clocks(42, t), n.rc = n.ras + n.rp;
  n.rrd_s = n.rrd_l = std::max(4u, clocks(5, t)), n.faw = std::max(16u, clocks(20, t));
  n.rl = rl, n.wl = wl, n.rtw = rl + n.burst + 2 - wl;
  n.wtr_s = clocks(6.25, t), n.wtr_l = clocks(12, t);
  n.rtp = clocks(10, t), n.wr = wr, n.ppd = 2, n.cs = 2;
  n.refi = clocks(3906, t), n.rfc = clocks(210, t);
  n.wck_post = 1, n.cas = 1;
  n.act2_slots = 1, n.aad = 8;
  spec.energy = {{1.3, 0.6, 2.6}, {2.5, 1.7, 3.5}, {2.4, 1.7, 3.4}, {6.5, 3.2, 8.0},
                 {25, 12, 50},    {28, 14, 56},    {16, 8, 32}};
  return spec;
}

DramSpec lpddr5x_8533() {
  DramSpec spec = lpddr5(kDramTypes[2], 0.9375, 23, 12, 37);
  spec.rows = 65536;
  spec.timing.rfc = clocks(280, spec.tck_ns);
  spec.energy = {{1.2, 0.6, 2.4}, {2.0, 1.4, 2.8}, {1.9, 1.3, 2.7}, {5.2, 2.6, 6.5},
                 {32, 16, 64},    {30, 15, 60},    {17, 8, 34}};
  return spec;
}

[[noreturn]] void refuse(const DramSpec& spec, std::string_view what) {
  throw UsageError(fmt::format("memory {}: {}", escape_control(spec.type), what));
}

void check_counts(const DramSpec& spec) {
  struct Count {
    const char* name;
    std::uint32_t value, most;
  };
  const Count counts[] = {{"channels", spec.channels, 64},
                          {"ranks", spec.ranks, 4},
                          {"bank groups", spec.bank_groups, 8},
                          {"banks of a group", spec.banks_per_group, 32},
                          {"rows", spec.rows, 1u << 20},
                          {"columns", spec.columns, 1u << 14},
                          {"bits of a channel", spec.channel_bits, 1024},
                          {"beats of a burst", spec.burst_length, 64},
                          {"bytes of a transaction", spec.transaction_bytes, 1u << 12},
                          {"bytes of the interleaving", spec.interleave_bytes, 1u << 16}};
  for (const Count& count : counts)
    if (!std::has_single_bit(count.value) || count.value > count.most)
      refuse(spec, fmt::format("{}: {}; expected a power of two, {} at most", count.name, count.value, count.most));
  if (spec.banks() * spec.ranks > 64)
    refuse(spec, fmt::format("{} banks of all ranks; expected 64 at most", spec.banks() * spec.ranks));
  if (spec.channel_bits < 8) refuse(spec, fmt::format("a channel of {} bits; expected 8 at least", spec.channel_bits));
  if (spec.transaction_bytes < spec.burst_bytes() || spec.transaction_bytes > spec.interleave_bytes ||
      spec.interleave_bytes > spec.row_bytes())
    refuse(spec,
           fmt::format("a burst of {} bytes, a transaction of {}, interleaving of {}, a row of {}: each must hold "
                       "the one before",
                       spec.burst_bytes(), spec.transaction_bytes, spec.interleave_bytes, spec.row_bytes()));
  if (!(spec.tck_ns >= 0.01 && spec.tck_ns <= 1000))
    refuse(spec, fmt::format("a clock of {} ns; expected 0.01 to 1000", spec.tck_ns));
}

void check_timings(const DramSpec& spec) {
  const DramTimings& n = spec.timing;
  constexpr std::uint32_t kMaxClocks = 1u << 20;
  for (const std::uint32_t value : {n.burst,  n.burst_group, n.ccd_s,      n.ccd_l, n.rcd,          n.rp,
                                    n.rp_all, n.ras,         n.rc,         n.rrd_s, n.rrd_l,        n.faw,
                                    n.rl,     n.wl,          n.rtw,        n.wtr_s, n.wtr_l,        n.rtp,
                                    n.wr,     n.ppd,         n.cs,         n.refi,  n.rfc,          n.wck_post,
                                    n.cas,    n.act_slots,   n.act2_slots, n.aad,   n.column_slots, n.precharge_slots})
    if (value > kMaxClocks) refuse(spec, fmt::format("a timing of {} clocks; expected {} at most", value, kMaxClocks));
  const auto need = [&](bool sound, std::string_view rule) {
    if (!sound) refuse(spec, fmt::format("timings: expected {}", rule));
  };
  need(n.burst >= 1 && n.burst_group >= n.burst, "burst_group >= burst >= 1");
  need(n.ccd_s >= n.burst && n.ccd_l >= n.ccd_s, "ccd_l >= ccd_s >= burst");
  need(n.act_slots >= 1 && n.column_slots >= 1 && n.precharge_slots >= 1, "a command takes a slot at least");
  need(n.act2_slots == 0 || n.aad >= n.act_slots + n.act2_slots + n.column_slots + n.cas, "aad: room for both halves");
  need(n.rc >= n.ras, "rc >= ras");
  need(n.rrd_l >= n.rrd_s, "rrd_l >= rrd_s");
  need(n.rp_all >= n.rp, "rp_all >= rp");
  need(n.wtr_l + n.burst_group >= n.wtr_s + n.burst, "wtr_l + burst_group >= wtr_s + burst");
  need(n.rtw + n.wl >= n.rl + n.burst, "rtw + wl >= rl + burst: data of a write follow the data of a read");
  need(n.refi > n.rfc + n.rp_all + n.ras + n.wl + n.burst + n.wr,
       "refi longer than rfc and the time that closes all banks");
}

}  // namespace

std::span<const std::string_view> dram_types() { return kDramTypes; }

DramSpec dram_spec(std::string_view type) {
  if (type == kDramTypes[0]) return lpddr4(type, 1 / 2.1333, 36, 18);
  if (type == kDramTypes[3]) return lpddr4(type, 1 / 1.6, 28, 14);
  // WR of JESD209-5B for 6400: 28.
  if (type == kDramTypes[1]) return lpddr5(kDramTypes[1], 1.25, 17, 9, 28);
  if (type == kDramTypes[2]) return lpddr5x_8533();
  throw UsageError(fmt::format("memory {}: types are {}", escape_control(type), fmt::join(kDramTypes, ", ")));
}

std::string_view dram_source(std::string_view type) {
  if (type == kDramTypes[0]) return kLpddr4xSource;
  if (type == kDramTypes[1]) return kLpddr5Source;
  if (type == kDramTypes[3]) return kLpddr4Source;
  return type == kDramTypes[2] ? kLpddr5xSource : "described by hand";
}

std::uint32_t DramSpec::idle_latency_clocks() const {
  const std::uint32_t bursts = transaction_bytes / burst_bytes();
  return timing.rcd + timing.cas + timing.rl + (bursts - 1) * timing.ccd_l + timing.burst;
}

void check_dram(const DramSpec& spec) {
  check_counts(spec);
  check_timings(spec);
  const DramMap map(spec);
}

DramMap::DramMap(const DramSpec& spec) {
  const auto bits = [](std::uint32_t count) { return static_cast<std::uint32_t>(std::countr_zero(count)); };
  burst_shift_ = bits(spec.burst_bytes());
  low_column_bits_ = bits(spec.interleave_bytes) - burst_shift_;
  low_column_ = {burst_shift_, ((1u << low_column_bits_) - 1) & ~(spec.transaction_bytes / spec.burst_bytes() - 1)};
  const std::uint32_t column_bits = bits(spec.row_bytes()) - burst_shift_ - low_column_bits_;

  const bool groups_apart = spec.mapping.find("Bg") != std::string::npos;
  std::uint32_t shift = burst_shift_ + low_column_bits_;
  const auto take = [&](Field& field, std::uint32_t width) {
    field = {shift, (1u << width) - 1};
    shift += width;
  };
  std::uint32_t seen = 0;
  const std::string_view text = spec.mapping;
  for (std::size_t at = text.size(); at >= 2; at -= 2) {
    static constexpr std::array<std::string_view, 6> kParts = {"Ro", "Ba", "Bg", "Ra", "Co", "Ch"};
    const auto found = std::find(kParts.begin(), kParts.end(), text.substr(at - 2, 2));
    const auto part = static_cast<std::uint32_t>(found - kParts.begin());
    if (found == kParts.end() || (seen >> part & 1) != 0) break;
    seen |= 1u << part;
    if (part == 0) take(row_, bits(spec.rows));
    if (part == 1 && !groups_apart) take(group_, bits(spec.bank_groups));
    if (part == 1) take(bank_, bits(spec.banks_per_group));
    if (part == 2) take(group_, bits(spec.bank_groups));
    if (part == 3) take(rank_, bits(spec.ranks));
    if (part == 4) take(column_, column_bits);
    if (part == 5) take(channel_, bits(spec.channels));
  }
  const std::uint32_t wanted = groups_apart ? 0b111111 : 0b111011;
  if (seen != wanted || text.size() != (groups_apart ? 12 : 10))
    refuse(spec, fmt::format("mapping {}: expected Ro, Ba, Ra, Co, Ch and perhaps Bg once each, as in RoBaRaCoCh",
                             escape_control(spec.mapping)));
}

DramPlace DramMap::place(std::uint64_t address) const {
  return {channel_.of(address), rank_.of(address), group_.of(address),
          bank_.of(address),    row_.of(address),  column_.of(address) << low_column_bits_ | low_column_.of(address)};
}

std::uint64_t DramMap::address(const DramPlace& place) const {
  const std::uint32_t low = place.column & ((1u << low_column_bits_) - 1);
  return channel_.at(place.channel) | rank_.at(place.rank) | group_.at(place.bank_group) | bank_.at(place.bank) |
         row_.at(place.row) | column_.at(place.column >> low_column_bits_) | std::uint64_t{low} << burst_shift_;
}

}  // namespace tessera::memory
