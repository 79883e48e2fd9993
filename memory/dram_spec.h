#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace tessera::memory {

// Timing parameters of a DRAM in clocks of its command clock (CK). The names come from the JEDEC standards:
//
//   burst       BL/n_min     clocks of the data bus that a burst takes
//   burst_group BL/n_max     clocks that one bank group is busy with it
//   ccd_s/_l    tCCD_S/_L    column command to column command, another bank group / the same
//   rcd, rp, rp_all, ras, rc tRCD, tRPpb, tRPab, tRAS, tRC: of a bank; rp_all after a precharge of all banks
//   rrd_s/_l    tRRD_S/_L    activate to activate, another bank group / the same
//   faw         tFAW         any five activates of a rank span more than this
//   rl, wl      RL, WL       column command to the first data, everything the pins add included
//   rtw         tRTW         read command to write command
//   wtr_s/_l    tWTR_S/_L    end of write data to read command, another bank group / the same
//   rtp, wr     tRTP, tWR    read command / end of write data to precharge
//   ppd         tPPD         precharge to precharge
//   cs          tCS          clocks that the data bus rests between two ranks
//   refi, rfc   tREFI, tRFCab
//   wck_post    clocks after a burst in which the data clock still runs; later ones need `cas` clocks to start it (0: the
//               standard has no such clock)
//   act_slots, column_slots, precharge_slots: clocks of the command bus that a command takes
//   act2_slots, aad          the same for the second half of an activate, which must end within tAAD of the first; all timings
//               count from the first. 0: there is none
struct DramTimings {
  std::uint32_t burst = 0, burst_group = 0, ccd_s = 0, ccd_l = 0;
  std::uint32_t rcd = 0, rp = 0, rp_all = 0, ras = 0, rc = 0, rrd_s = 0, rrd_l = 0, faw = 0;
  std::uint32_t rl = 0, wl = 0, rtw = 0, wtr_s = 0, wtr_l = 0, rtp = 0, wr = 0, ppd = 0, cs = 0;
  std::uint32_t refi = 0, rfc = 0;
  std::uint32_t wck_post = 0, cas = 0;
  std::uint32_t act_slots = 1, act2_slots = 0, aad = 0, column_slots = 1, precharge_slots = 1;
};

// A constant that is not published for this kind of memory: an estimate with its plausible range.
struct DramEstimate {
  double value = 0, low = 0, high = 0;
};

// Energy of events, all [assumed]: currents of LPDDR4X and later are under NDA. For a stream of row hits the sums
// reach the 12.5, 10 and 8 pJ/bit that trade sources give for whole systems of the three types.
struct DramEnergyPrices {
  DramEstimate activate_nj;                // one activate and its precharge
  DramEstimate read_pj_bit, write_pj_bit;  // array and column path
  DramEstimate io_pj_bit;                  // drivers and receivers at both ends, PHY
  DramEstimate refresh_nj;                 // one refresh of all banks of a rank of a channel
  DramEstimate active_mw, idle_mw;         // power of a rank of a channel with an open row, and without
};

// An external memory: its organization and its addressing. A plain value; every count is a power of two.
struct DramSpec {
  std::string type;  // name of the type, such as "lpddr5-6400"; any name for a memory described by hand
  std::uint32_t channels = 4, ranks = 1, bank_groups = 1, banks_per_group = 8;
  std::uint32_t rows = 32768, columns = 1024;  // size of a bank; a column is as wide as the channel
  std::uint32_t channel_bits = 16, burst_length = 16;
  double tck_ns = 1;
  DramTimings timing;
  DramEnergyPrices energy;

  // Address mapping, most significant part first: Ro row, Ba bank, Bg bank group, Ra rank, Co column, Ch channel,
  // each once. Without Bg the lowest bits of Ba are the group. Addresses repeat beyond the capacity.
  std::string mapping = "RoBaRaCoBgCh";
  // Bytes that one request moves: one burst, or several in consecutive columns.
  std::uint32_t transaction_bytes = 64;
  // Consecutive bytes in one channel: at least a transaction. They are columns, whatever the mapping says.
  std::uint32_t interleave_bytes = 64;

  std::uint32_t burst_bytes() const { return channel_bits / 8 * burst_length; }
  std::uint32_t row_bytes() const { return channel_bits / 8 * columns; }
  std::uint32_t banks() const { return bank_groups * banks_per_group; }
  std::uint64_t capacity_bytes() const { return std::uint64_t{row_bytes()} * rows * banks() * ranks * channels; }
  double clock_mhz() const { return 1e3 / tck_ns; }
  // Peak rate of all channels with data at every beat.
  double peak_gb_s() const { return static_cast<double>(burst_bytes()) * channels / (timing.burst * tck_ns); }
  // Latency of a read from a closed bank in an idle memory: activate, column command, data of one transaction.
  std::uint32_t idle_latency_clocks() const;
  double idle_latency_ns() const { return idle_latency_clocks() * tck_ns; }
};

// The known types: lpddr4x-4266, lpddr5-6400, lpddr5x-8533; each has four channels of 16 bits and one rank.
std::span<const std::string_view> dram_types();
// Throws UsageError for any other type.
DramSpec dram_spec(std::string_view type);
// Source of a type's figures.
std::string_view dram_source(std::string_view type);

// Throws UsageError that names the contradiction: a count that is no power of two, timings that contradict each
// other, a mapping that lacks a part.
void check_dram(const DramSpec& spec);

// Place of a transaction in the memory.
struct DramPlace {
  std::uint32_t channel = 0, rank = 0, bank_group = 0, bank = 0, row = 0;
  std::uint32_t column = 0;  // of the transaction's first byte, in bursts

  bool operator==(const DramPlace&) const = default;
};

// Maps addresses to places. Invariants (cited by the tests):
//   DM1  Two addresses below the capacity have the same place exactly when they lie in the same transaction.
//   DM2  address() gives back the first byte of an address's transaction.
class DramMap {
 public:
  explicit DramMap(const DramSpec& spec);
  DramPlace place(std::uint64_t address) const;
  // The address, below the capacity, of the burst at that place.
  std::uint64_t address(const DramPlace& place) const;
  std::uint32_t channel(std::uint64_t address) const {
    return static_cast<std::uint32_t>(address >> channel_.shift) & channel_.mask;
  }

 private:
  struct Field {
    std::uint32_t shift = 0, mask = 0;
    std::uint32_t of(std::uint64_t address) const { return static_cast<std::uint32_t>(address >> shift) & mask; }
    std::uint64_t at(std::uint32_t value) const { return std::uint64_t{value & mask} << shift; }
  };
  Field channel_, rank_, group_, bank_, row_, column_, low_column_;
  std::uint32_t low_column_bits_ = 0, burst_shift_ = 0;
};

}  // namespace tessera::memory
