// External memory with banks: known answers, the rules of the standard, random streams.
#include <random>

#include "base/error.h"
#include "memory/dram_banks.h"
#include "tests/memory/dram_protocol.h"
#include "tests/support/tests.h"

namespace tessera::memory::dram_banks_test {
namespace {

// LPDDR5-6400 with one channel; a transaction is a burst, banks of a group lie a row apart.
DramSpec one_channel() {
  DramSpec spec = dram_spec("lpddr5-6400");
  spec.channels = 1;
  spec.mapping = "RoBaRaCoCh";
  spec.transaction_bytes = spec.interleave_bytes = spec.burst_bytes();
  return spec;
}

// Address of a burst of that channel: Ro Ba Bg Co.
std::uint64_t at(const DramSpec& spec, std::uint64_t row, std::uint64_t bank, std::uint64_t group,
                 std::uint64_t burst) {
  const std::uint64_t bank_number = (row * spec.banks_per_group + bank) * spec.bank_groups + group;
  return bank_number * spec.row_bytes() + burst * spec.burst_bytes();
}

struct Played {
  std::vector<DramCompletion> completions;
  std::vector<DramCommand> log;

  DramClock done(std::uint64_t id) const {
    for (const DramCompletion& completion : completions)
      if (completion.id == id) return completion.clock;
    return 0;
  }
  std::vector<DramClock> clocks(DramCommandKind kind) const {
    std::vector<DramClock> found;
    for (const DramCommand& command : log)
      if (command.kind == kind) found.push_back(command.clock);
    return found;
  }
};

struct Request {
  std::uint64_t address;
  bool write = false;
};

// Plays requests at clock 0, number n as id n, and returns their completions.
Played run_at_once(const DramSpec& spec, const std::vector<Request>& requests) {
  DramBanks dram(spec);
  Played run;
  dram.log_into(&run.log);
  for (std::size_t i = 0; i < requests.size(); ++i)
    EXPECT_TRUE(dram.submit(i, requests[i].address, requests[i].write)) << i;
  while (!dram.idle()) dram.advance(dram.next_event(), run.completions);
  return run;
}

TEST(DramBanks, AReadOfAnIdleMemoryTakesItsIdleLatency) {
  for (const std::string_view type : dram_types()) {
    const DramSpec spec = dram_spec(type);
    EXPECT_EQ(run_at_once(spec, {{0}}).done(0), spec.idle_latency_clocks()) << type;
  }
  const DramSpec spec = one_channel();
  EXPECT_EQ(spec.idle_latency_clocks(), 15u + 1 + 17 + 2) << "tRCD, the data clock's start, RL, the burst";
  EXPECT_DOUBLE_EQ(spec.idle_latency_ns(), 35 * 1.25);
}

TEST(DramBanks, PeakBandwidthFollowsFromThePins) {
  EXPECT_NEAR(dram_spec("lpddr4x-4266").peak_gb_s(), 4266.6e6 * 8 * 1e-9, 0.01);
  EXPECT_DOUBLE_EQ(dram_spec("lpddr5-6400").peak_gb_s(), 51.2);
  EXPECT_NEAR(dram_spec("lpddr5x-8533").peak_gb_s(), 68.27, 0.01);
}

TEST(DramBanks, RowHitsOfOneGroupFollowEachOtherAtTccdLong) {
  const DramSpec spec = one_channel();
  std::vector<Request> requests;
  for (std::uint64_t i = 0; i < 8; ++i) requests.push_back({at(spec, 0, 0, 0, i)});
  const Played run = run_at_once(spec, requests);
  for (std::uint64_t i = 0; i < 8; ++i) EXPECT_EQ(run.done(i), 35 + 4 * i);
}

TEST(DramBanks, RowHitsOfTwoGroupsFollowEachOtherAtTccdShort) {
  const DramSpec spec = one_channel();
  std::vector<Request> requests;
  for (std::uint64_t i = 0; i < 16; ++i) requests.push_back({at(spec, 0, 0, i % 2, i / 2)});
  const Played run = run_at_once(spec, requests);
  // The second group's row is opened tRRD after the first's; from then on the data bus never rests.
  const std::vector<DramClock> reads = run.clocks(DramCommandKind::kRead);
  ASSERT_EQ(reads.size(), 16u);
  for (std::size_t i = 4; i < 14; ++i) EXPECT_EQ(reads[i + 1] - reads[i], 2u) << i;
}

TEST(DramBanks, AnotherRowOfTheBankCostsPrechargeActivateAndRead) {
  const DramSpec spec = one_channel();
  const Played run = run_at_once(spec, {{at(spec, 0, 0, 0, 0)}, {at(spec, 1, 0, 0, 0)}});
  // Row 0 at 0; tRAS, tRP, tRCD; the data clock has long stopped.
  EXPECT_EQ(run.done(1), 34u + 15 + 15 + 1 + 17 + 2);
  EXPECT_EQ(run.clocks(DramCommandKind::kPrecharge), std::vector<DramClock>{34});
}

TEST(DramBanks, AFifthRowWaitsForTheWindowOfFour) {
  DramSpec spec = one_channel();
  spec.timing.faw = 40;
  const Played run = run_at_once(spec, {{at(spec, 0, 0, 0, 0)},
                                        {at(spec, 0, 0, 1, 0)},
                                        {at(spec, 0, 0, 2, 0)},
                                        {at(spec, 0, 0, 3, 0)},
                                        {at(spec, 0, 1, 0, 0)}});
  EXPECT_EQ(run.clocks(DramCommandKind::kActivate), (std::vector<DramClock>{0, 4, 8, 12, 40}));
}

TEST(DramBanks, TheBusTurnsRoundAtItsPrice) {
  DramSpec spec = one_channel();
  DramControl control;
  control.write_high = 1, control.write_low = 0, control.min_reads = 1;
  DramBanks dram(spec, control);
  Played run;
  dram.log_into(&run.log);
  // A read opens the row; then a write and a read of another group's open row.
  for (const std::uint64_t group : {0, 1}) EXPECT_TRUE(dram.submit(group, at(spec, 0, 0, group, 0), false));
  dram.advance(100, run.completions);
  EXPECT_TRUE(dram.submit(2, at(spec, 0, 0, 0, 1), false));
  dram.advance(102, run.completions);
  EXPECT_TRUE(dram.submit(3, at(spec, 0, 0, 0, 2), true));
  dram.advance(120, run.completions);
  EXPECT_TRUE(dram.submit(4, at(spec, 0, 0, 0, 3), false));
  dram.advance(200, run.completions);
  const std::vector<DramClock> reads = run.clocks(DramCommandKind::kRead), writes = run.clocks(DramCommandKind::kWrite);
  ASSERT_EQ(reads.size(), 4u);
  ASSERT_EQ(writes.size(), 1u);
  EXPECT_EQ(writes[0] - reads[2], 17u + 2 + 2 - 9) << "tRTW";
  EXPECT_EQ(reads[3] - writes[0], 9u + 4 + 10 + 1) << "WL, the group's array, tWTR_L; the data clock has stopped";
  EXPECT_EQ(dram.counters().turnarounds, 2u);
}

TEST(DramBanks, ARankIsRefreshedWhenItIsTime) {
  const DramSpec spec = one_channel();
  DramBanks dram(spec);
  Played run;
  dram.log_into(&run.log);
  EXPECT_TRUE(dram.submit(0, 0, false));
  dram.advance(3124, run.completions);
  EXPECT_TRUE(dram.submit(1, at(spec, 0, 0, 0, 1), false)) << "its row is open, but the refresh goes first";
  dram.advance(3125, run.completions);
  EXPECT_EQ(run.clocks(DramCommandKind::kRead).size(), 1u) << "the data clock needs the last slot";
  dram.advance(4000, run.completions);
  EXPECT_EQ(run.clocks(DramCommandKind::kPrechargeAll), std::vector<DramClock>{3125});
  EXPECT_EQ(run.clocks(DramCommandKind::kRefresh), std::vector<DramClock>{3125 + 17});
  EXPECT_EQ(run.done(1), 3125u + 17 + 168 + 35) << "tRPab, tRFC and a closed bank";
}

TEST(DramBanks, IdleTimeIsRefreshedAndCostsNoStepPerClock) {
  const DramSpec spec = one_channel();
  DramBanks dram(spec), stepped(spec);
  std::vector<DramCompletion> completions;
  const DramClock end = 3125 * 1000 + 500;
  dram.advance(end, completions);
  for (DramClock t = 0; t < end; t += 777) stepped.advance(t, completions);
  stepped.advance(end, completions);
  EXPECT_EQ(dram.counters().refreshes, 1000u);
  EXPECT_EQ(dram.counters(), stepped.counters());
  dram.advance(DramClock{1} << 50, completions);
  EXPECT_EQ(dram.counters().refreshes, ((DramClock{1} << 50) - 1) / 3125);
  EXPECT_EQ(dram.next_event(), kNoDramClock);
}

// DB4
TEST(DramBanks, AFullQueueRefusesAndSaysWhenToAskAgain) {
  const DramSpec spec = one_channel();
  DramBanks dram(spec);
  std::vector<DramCompletion> completions;
  for (std::uint64_t i = 0; i < 32; ++i) ASSERT_TRUE(dram.submit(i, at(spec, 0, 0, 0, i), false));
  EXPECT_FALSE(dram.can_accept(0, false));
  EXPECT_TRUE(dram.can_accept(0, true)) << "the other queue";
  const DramCounters before = dram.counters();
  EXPECT_FALSE(dram.submit(99, at(spec, 0, 1, 0, 0), false));
  EXPECT_EQ(dram.counters(), before);
  // The first activate takes its request along.
  EXPECT_EQ(dram.next_event(), 1u);
  dram.advance(1, completions);
  EXPECT_TRUE(dram.submit(99, at(spec, 0, 1, 0, 0), false));
}

TEST(DramBanks, AWaitingWriteAnswersReadsAndTakesInWrites) {
  const DramSpec spec = one_channel();
  DramBanks dram(spec);
  std::vector<DramCompletion> completions;
  EXPECT_TRUE(dram.submit(0, 64, true));
  EXPECT_TRUE(dram.submit(1, 64 + 31, false));
  EXPECT_TRUE(dram.submit(2, 64, true));
  EXPECT_TRUE(dram.submit(3, 96, false)) << "the next burst is another";
  dram.advance(1000, completions);
  ASSERT_EQ(completions.size(), 4u);
  EXPECT_EQ(completions[0], (DramCompletion{1, 1}));
  EXPECT_EQ(completions[1], (DramCompletion{2, 1}));
  EXPECT_EQ(dram.counters().forwarded_reads, 1u);
  EXPECT_EQ(dram.counters().merged_writes, 1u);
  EXPECT_EQ(dram.counters().write_bursts, 1u);
}

// ---- Random streams ---------------------------------------------------------------------------------------------

struct Stream {
  std::uint32_t seed;
  double writes;    // share
  double locality;  // share of requests beside the one before
  std::uint64_t span;
  double rate;  // requests a clock
};

std::vector<std::pair<DramClock, Request>> requests_of(const Stream& stream, std::size_t count) {
  std::mt19937_64 random(stream.seed);
  std::uniform_real_distribution<double> unit;
  std::vector<std::pair<DramClock, Request>> requests;
  std::uint64_t address = 0;
  double clock = 0;
  for (std::size_t i = 0; i < count; ++i) {
    address = unit(random) < stream.locality ? address + 32 : random() % stream.span;
    clock += -std::log(1 - unit(random)) / stream.rate;
    requests.push_back({static_cast<DramClock>(clock), {address, unit(random) < stream.writes}});
  }
  return requests;
}

Played play(const DramSpec& spec, const Stream& stream, std::size_t count, DramCounters* counters = nullptr,
            DramClock max_step = kNoDramClock) {
  DramBanks dram(spec);
  Played run;
  dram.log_into(&run.log);
  const auto requests = requests_of(stream, count);
  for (std::size_t i = 0; i < requests.size() || !dram.idle();) {
    while (i < requests.size() && requests[i].first <= dram.now() &&
           dram.submit(i, requests[i].second.address, requests[i].second.write))
      ++i;
    DramClock next = dram.next_event();
    if (i < requests.size() && requests[i].first > dram.now()) next = std::min(next, requests[i].first);
    if (max_step != kNoDramClock) next = std::min(next, dram.now() + max_step);
    dram.advance(next, run.completions);
  }
  if (counters != nullptr) *counters = dram.counters();
  return run;
}

constexpr Stream kStreams[] = {{1, 0, 0, 1u << 30, 2},      {2, 1, 0, 1u << 30, 2},      {3, 0.5, 0, 1u << 30, 2},
                               {4, 0.3, 0.9, 1u << 30, 4},  {5, 0.5, 0.5, 1u << 14, 1},  {6, 0.1, 0.95, 1u << 26, 0.05},
                               {7, 0.7, 0.97, 1u << 28, 8}, {8, 0.4, 0.2, 1u << 16, 0.3}};

std::vector<DramSpec> specs() {
  std::vector<DramSpec> all = {one_channel()};
  for (const std::string_view type : dram_types()) all.push_back(dram_spec(type));
  DramSpec ranks = dram_spec("lpddr5-6400");
  ranks.ranks = 2, ranks.channels = 2, ranks.mapping = "RoBaCoRaBgCh";
  all.push_back(ranks);
  DramSpec wide = dram_spec("lpddr4x-4266");
  wide.transaction_bytes = 128;
  all.push_back(wide);
  return all;
}

TEST(DramProtocol, EveryPairOfCommandsKeepsItsTiming) {
  for (const DramSpec& spec : specs())
    for (const Stream& stream : kStreams)
      EXPECT_EQ(protocol::ProtocolChecker(spec).check(play(spec, stream, 3000).log), "") << spec.type << stream.seed;
}

// DB1: the checker needs each of its rules: a controller that believes one timing to be shorter is caught.
TEST(DramProtocol, EachTimingThatIsBrokenIsCaught) {
  struct Twin {
    const char* rule;
    std::uint32_t DramTimings::*timing;
    std::uint32_t value;
  };
  DramSpec spec = one_channel();
  spec.ranks = 2;
  spec.mapping = "RoBaCoRaCh";
  DramTimings& n = spec.timing;
  // Wide enough apart that no rule hides behind another.
  n.faw = 40, n.rrd_l = 6, n.rtp = 20, n.ppd = 3, n.cs = 6;
  const Twin twins[] = {{"tCCD", &DramTimings::ccd_l, 2},
                        {"tRCD", &DramTimings::rcd, 10},
                        {"tRPpb", &DramTimings::rp, 8},
                        {"tRPab", &DramTimings::rp_all, 15},
                        {"tRAS", &DramTimings::ras, 20},
                        {"tRC", &DramTimings::rc, 34},
                        {"tRRD", &DramTimings::rrd_l, 4},
                        {"tFAW", &DramTimings::faw, 20},
                        {"tRTW", &DramTimings::rtw, 10},
                        {"tWTR", &DramTimings::wtr_l, 4},
                        {"tRTP", &DramTimings::rtp, 8},
                        {"tWR", &DramTimings::wr, 12},
                        {"tPPD", &DramTimings::ppd, 1},
                        {"data bus", &DramTimings::cs, 0},
                        {"tRFC", &DramTimings::rfc, 120},
                        {"tREFI", &DramTimings::refi, 20000},
                        {"command bus", &DramTimings::column_slots, 1},
                        {"tAAD", &DramTimings::act2_slots, 0}};
  for (const Twin& twin : twins) {
    DramSpec truth = spec;
    if (twin.timing == &DramTimings::ras) truth.timing.ras = 60, truth.timing.rc = 75;
    if (twin.timing == &DramTimings::rc) truth.timing.rc = 70;
    if (twin.timing == &DramTimings::column_slots) truth.timing.column_slots = 2, truth.timing.aad = 12;
    if (twin.timing == &DramTimings::act2_slots) truth.timing.act2_slots = 2, truth.timing.aad = 5;
    DramSpec lie = truth;
    lie.timing.*twin.timing = twin.value;
    std::string found;
    for (const Stream& stream : kStreams) found += protocol::ProtocolChecker(truth).check(play(lie, stream, 3000).log);
    EXPECT_THAT(found, testing::HasSubstr(twin.rule));
  }
}

// DB2, DB5
TEST(DramBanks, EveryRequestCompletesOnceAndIsCounted) {
  for (const DramSpec& spec : specs())
    for (const Stream& stream : kStreams) {
      DramCounters counters;
      const Played run = play(spec, stream, 3000, &counters);
      ASSERT_EQ(run.completions.size(), 3000u);
      std::set<std::uint64_t> ids;
      for (std::size_t i = 0; i < run.completions.size(); ++i) {
        ids.insert(run.completions[i].id);
        EXPECT_GE(run.completions[i].clock, run.completions[i > 0 ? i - 1 : 0].clock);
      }
      EXPECT_EQ(ids.size(), 3000u);
      const std::uint64_t reached =
          counters.reads + counters.writes - counters.forwarded_reads - counters.merged_writes;
      EXPECT_EQ(counters.reads + counters.writes, 3000u);
      EXPECT_EQ(counters.row_hits + counters.row_misses + counters.row_conflicts, reached);
      EXPECT_EQ(counters.read_bursts + counters.write_bursts, reached * (spec.transaction_bytes / spec.burst_bytes()));
      EXPECT_EQ(counters.bus_clocks, (counters.read_bursts + counters.write_bursts) * spec.timing.burst);
      EXPECT_LE(counters.active_rank_clocks, counters.rank_clocks);
    }
}

// DB3
TEST(DramBanks, HowOftenTimeIsAdvancedDoesNotMatter) {
  for (const DramSpec& spec : specs())
    for (const Stream& stream : kStreams) {
      DramCounters whole, stepped;
      const Played a = play(spec, stream, 1500, &whole), b = play(spec, stream, 1500, &stepped, 3);
      EXPECT_EQ(a.completions, b.completions) << spec.type << stream.seed;
      EXPECT_EQ(whole, stepped);
    }
}

// DB6: a stream of row hits does not keep another row of the bank out, nor a stream of writes a read.
TEST(DramBanks, NoRequestWaitsWithoutEnd) {
  const DramSpec spec = one_channel();
  for (const bool writes : {false, true}) {
    DramBanks dram(spec);
    std::vector<DramCompletion> completions;
    EXPECT_TRUE(dram.submit(0, at(spec, 0, 0, 0, 0), writes));
    dram.advance(30, completions);
    EXPECT_TRUE(dram.submit(1, at(spec, 7, 0, 0, 0), false));
    std::uint64_t id = 2;
    while (std::none_of(completions.begin(), completions.end(), [](const auto& c) { return c.id == 1; })) {
      for (int i = 0; i < 40 && dram.can_accept(0, writes); ++i)
        EXPECT_TRUE(dram.submit(id, at(spec, 0, 0, 0, id % 64), writes)), ++id;
      ASSERT_GT(dram.next_event(), dram.now());
      dram.advance(dram.next_event(), completions);
      ASSERT_LT(dram.now(), 5000u);
    }
  }
}

// ---- Specifications ---------------------------------------------------------------------------------------------

// DM1 DM2
TEST(DramMap, EachTransactionHasItsPlace) {
  for (const char* mapping : {"RoBaRaCoCh", "RoBaRaCoBgCh", "ChRoCoRaBgBa", "RoCoBgBaRaCh"}) {
    DramSpec spec = dram_spec("lpddr5-6400");
    spec.rows = 4, spec.columns = 64, spec.ranks = 2, spec.channels = 2, spec.mapping = mapping;
    const DramMap map(spec);
    std::set<std::vector<std::uint32_t>> places;
    for (std::uint64_t address = 0; address < spec.capacity_bytes(); address += 64) {
      const DramPlace p = map.place(address);
      EXPECT_EQ(map.place(address + 63), p);
      EXPECT_EQ(map.place(address + spec.capacity_bytes()), p) << "repeats";
      EXPECT_EQ(map.channel(address), p.channel);
      EXPECT_EQ(map.address(p), address);  // DM2
      places.insert({p.channel, p.rank, p.bank_group, p.bank, p.row, p.column});
    }
    EXPECT_EQ(places.size(), spec.capacity_bytes() / 64) << mapping;
  }
}

TEST(DramMap, PartsLieInTheOrderOfTheirNames) {
  const DramSpec spec = one_channel();
  const DramPlace p = DramMap(spec).place(at(spec, 5, 3, 2, 17));
  EXPECT_EQ(p, (DramPlace{0, 0, 2, 3, 5, 17}));
  const DramSpec inter = dram_spec("lpddr5-6400");
  EXPECT_EQ(DramMap(inter).place(64).channel, 1u);
  EXPECT_EQ(DramMap(inter).place(256).bank_group, 1u) << "groups before columns";
}

TEST(DramSpecs, ImpossibleSpecsAreRefused) {
  const auto refused = [](auto change) {
    DramSpec spec = dram_spec("lpddr5-6400");
    change(spec);
    EXPECT_THROW(DramBanks{spec}, UsageError);
  };
  refused([](DramSpec& s) { s.channels = 3; });
  refused([](DramSpec& s) { s.channels = 0; });
  refused([](DramSpec& s) { s.transaction_bytes = 16; });
  refused([](DramSpec& s) { s.interleave_bytes = 32; });
  refused([](DramSpec& s) { s.interleave_bytes = 4096; });
  refused([](DramSpec& s) { s.bank_groups = 8, s.banks_per_group = 16; });
  refused([](DramSpec& s) { s.tck_ns = 0; });
  refused([](DramSpec& s) { s.timing.refi = 100; });
  refused([](DramSpec& s) { s.timing.ccd_s = 1; });
  refused([](DramSpec& s) { s.timing.rc = 1u << 30; });
  refused([](DramSpec& s) { s.timing.rtw = 0; });
  for (const char* mapping : {"", "Ro", "RoBaRaCoCo", "RoBaRaCoChX", "RoBaRaCoBgChBg", "RoRaBgCoCh", "robaracoch"})
    refused([&](DramSpec& s) { s.mapping = mapping; });
  EXPECT_THROW(dram_spec("ddr9"), UsageError);
  DramControl control;
  control.write_high = 33;
  EXPECT_THROW(DramBanks(dram_spec("lpddr5-6400"), control), UsageError);
}

TEST(DramEnergies, AreEventsTimesPrices) {
  const DramSpec spec = one_channel();
  DramCounters counters;
  counters.activates = 10, counters.read_bursts = 100, counters.write_bursts = 50, counters.refreshes = 3;
  counters.active_rank_clocks = 1000, counters.rank_clocks = 4000;
  const DramEnergy energy = dram_energy(spec, counters);
  EXPECT_DOUBLE_EQ(energy.activate_nj, 10 * spec.energy.activate_nj.value);
  EXPECT_DOUBLE_EQ(energy.transfer_nj,
                   0.256 * (100 * spec.energy.read_pj_bit.value + 50 * spec.energy.write_pj_bit.value));
  EXPECT_DOUBLE_EQ(energy.io_nj, 0.256 * 150 * spec.energy.io_pj_bit.value);
  EXPECT_DOUBLE_EQ(energy.refresh_nj, 3 * spec.energy.refresh_nj.value);
  EXPECT_DOUBLE_EQ(energy.background_nj,
                   1.25e-3 * (1000 * spec.energy.active_mw.value + 3000 * spec.energy.idle_mw.value));
  for (const std::string_view type : dram_types()) {
    const DramEnergyPrices& e = dram_spec(type).energy;
    for (const DramEstimate& x :
         {e.activate_nj, e.read_pj_bit, e.write_pj_bit, e.io_pj_bit, e.refresh_nj, e.active_mw, e.idle_mw})
      EXPECT_TRUE(0 < x.low && x.low < x.value && x.value < x.high) << type;
    EXPECT_FALSE(dram_source(type).empty());
  }
}

}  // namespace
}  // namespace tessera::memory::dram_banks_test
