// Traces of external memory: their order, their text, playing them.
#include <random>

#include "base/error.h"
#include "memory/dram_replay.h"
#include "memory/dram_trace.h"
#include "tests/support/tests.h"

namespace tessera::memory::dram_trace_test {
namespace {

constexpr ReadWriteOrder::Bound kBound{400, 50, 4000};

// `flowing`: how many had come out before the end of the stream.
std::vector<Burst> ordered(const std::vector<Burst>& bursts, std::size_t* flowing = nullptr) {
  std::vector<Burst> out;
  ReadWriteOrder order(kBound, [&](const Burst& burst) { out.push_back(burst); });
  for (const Burst& burst : bursts) order.add(burst);
  if (flowing != nullptr) *flowing = out.size();
  order.finish();
  return out;
}

std::vector<Burst> random_bursts(std::uint32_t seed, std::uint64_t addresses, std::uint64_t pause) {
  std::mt19937_64 random(seed);
  std::vector<Burst> bursts;
  std::uint64_t cycle = 0;
  for (int i = 0; i < 4000; ++i)
    bursts.push_back({cycle += random() % pause, random() % addresses * 64, random() % 2 == 0});
  return bursts;
}

// Writes that come too soon after a read of their address: RW1, said another way.
int hasty_writes(const std::vector<Burst>& bursts, const ReadWriteOrder::Bound& bound, std::size_t last) {
  int hasty = 0;
  for (std::size_t i = 0; i < last; ++i)
    for (std::size_t j = i; bursts[i].write && j-- > 0;) {
      if (bursts[j].address != bursts[i].address || bursts[j].write) continue;
      const std::uint64_t cycles = bursts[i].cycle - bursts[j].cycle;
      const auto reads = std::count_if(bursts.begin() + static_cast<std::ptrdiff_t>(j) + 1,
                                       bursts.begin() + static_cast<std::ptrdiff_t>(i),
                                       [](const Burst& burst) { return !burst.write; });
      const bool bound_kept = cycles >= bound.cycles && reads >= static_cast<std::ptrdiff_t>(bound.reads);
      hasty += bound_kept || cycles >= bound.max_cycles ? 0 : 1;
      break;
    }
  return hasty;
}

// RW1
TEST(ReadWriteOrder, WritesKeepAwayFromReadsThatMayBeOutstanding) {
  for (const std::uint64_t addresses : {20, 300, 100000})
    for (const std::uint64_t pause : {1, 10, 200}) {
      std::size_t flowing = 0;
      const std::vector<Burst> bursts = random_bursts(7, addresses, pause), out = ordered(bursts, &flowing);
      EXPECT_EQ(hasty_writes(out, kBound, flowing), 0) << addresses << " " << pause;
      // The failing twin: the stream as it came.
      EXPECT_GT(hasty_writes(bursts, kBound, bursts.size()), addresses < 1000 ? 0 : -1);
    }
}

// RW2
TEST(ReadWriteOrder, LosesNothingAndKeepsTheOrderOfEachAddress) {
  for (const std::uint64_t addresses : {1, 20, 300, 100000}) {
    const std::vector<Burst> bursts = random_bursts(11, addresses, 5), out = ordered(bursts);
    ASSERT_EQ(out.size(), bursts.size());
    std::map<std::uint64_t, std::vector<bool>> before, after;
    for (const Burst& burst : bursts) before[burst.address].push_back(burst.write);
    for (const Burst& burst : out) after[burst.address].push_back(burst.write);
    EXPECT_EQ(before, after);
    for (std::size_t i = 1; i < out.size(); ++i) EXPECT_GE(out[i].cycle, out[i - 1].cycle);
  }
}

TEST(ReadWriteOrder, LeavesOrderedBurstsAlone) {
  std::vector<Burst> bursts;
  for (std::uint64_t i = 0; i < 500; ++i) bursts.push_back({i, i * 64, i % 3 == 0});
  EXPECT_EQ(ordered(bursts), bursts);
  // A write long after its read, and one that waits for time alone.
  EXPECT_EQ(ordered({{0, 64, false}, {4000, 64, true}}), (std::vector<Burst>{{0, 64, false}, {4000, 64, true}}));
  EXPECT_EQ(ordered({{0, 64, false}, {1, 64, true}}), (std::vector<Burst>{{0, 64, false}, {400, 64, true}}));
}

// A memory of 1600 MHz that moves 64 bytes at once.
DramSpec fast_memory() {
  DramSpec spec = dram_spec("lpddr5-6400");
  spec.tck_ns = 0.625;
  spec.mapping = "RoBaRaCoCh";
  return spec;
}

void write_trace(const std::filesystem::path& file, const DramTraceUnits& units, const std::vector<Burst>& bursts) {
  DramTrace trace(file, units, fast_memory());
  trace.add(bursts, 100);
  trace.add(bursts, 100);
  trace.commit();
}

std::string text_of(const std::string& name, const DramTraceUnits& units, const std::vector<Burst>& bursts) {
  const test::TemporaryFolder folder;
  write_trace(folder / name, units, bursts);
  return test::read_text(folder / name);
}

TEST(DramTrace, CountsClocksOfTheMemoryAndItsTransactions) {
  const std::vector<Burst> bursts = {{0, 0x40, false}, {10, 0x80, true}, {20, 0xC0, true}};
  EXPECT_EQ(text_of("t", {800, 64}, bursts),
            "0x40 READ 0\n0x80 WRITE 5\n0xc0 WRITE 10\n0x40 READ 50\n0x80 WRITE 55\n0xc0 WRITE 60\n");
  // In the second channel's first two columns; in the third channel.
  EXPECT_THAT(text_of("t", {800, 32}, bursts), testing::StartsWith("0x20 READ 0\n0xa0 READ 0\n0x40 WRITE 5\n0xc0"));
  EXPECT_THAT(text_of("t", {1600, 128}, bursts), testing::StartsWith("0x80 READ 0\n0x100 WRITE 10\n0x180 WRITE 20\n"));
  EXPECT_THAT(text_of("t.loadstore", {800, 64}, bursts), testing::StartsWith("LD 0x40\nST 0x80\nST 0xc0\n"));
}

TEST(DramTrace, IsDescribedByTheFileBesideIt) {
  const test::TemporaryFolder folder;
  write_trace(folder / "t", {800, 32}, {{0, 0x40, false}});
  const auto said = read_dram_trace_description(folder / "t");
  ASSERT_TRUE(said);
  EXPECT_EQ(said->units.clock_mhz, 800);
  EXPECT_EQ(said->units.transaction_bytes, 32u);
  EXPECT_EQ(said->memory.type, "lpddr5-6400");
  EXPECT_EQ(said->memory.channels, 4u);
  EXPECT_EQ(said->memory.mapping, "RoBaRaCoCh");
  EXPECT_EQ(said->memory.transaction_bytes, 32u);
  EXPECT_EQ(said->memory.interleave_bytes, 32u);
  EXPECT_FALSE(read_dram_trace_description(folder / "another"));
  const std::string right = test::read_text(folder / "t.json");
  for (const auto& [from, to] : {std::pair{"tessera.dram-trace/1", "tessera.dram-trace/9"},
                                 {"lpddr5-6400", "lpddr9"},
                                 {"\"channels\": 4", "\"channels\": 3"},
                                 {"\"channels\"", "\"channel\""},
                                 {"\"clock_mhz\": 800.0", "\"clock_mhz\": 0"},
                                 {"\"clock_mhz\": 800.0", "\"clock_mhz\": \"fast\""},
                                 {"{", "["}}) {
    std::string wrong = right;
    ASSERT_NE(wrong.find(from), wrong.npos) << from << right;
    wrong.replace(wrong.find(from), std::string_view(from).size(), to);
    test::write_text(folder / "t.json", wrong);
    EXPECT_THROW(read_dram_trace_description(folder / "t"), InputError) << wrong;
  }
}

// Whatever the memory's mapping and the lines of the trace: who reads it finds each burst in the place that it had.
TEST(DramTrace, BurstsStayInTheirBanks) {
  std::mt19937_64 random(3);
  for (const std::string_view type : dram_types())
    for (const std::uint32_t line : {32u, 64u}) {
      DramSpec spec = dram_spec(type);
      spec.transaction_bytes = 32, spec.interleave_bytes = 256;
      std::vector<Burst> bursts;
      for (std::uint64_t cycle = 0; cycle < 300; ++cycle)
        bursts.push_back({cycle * 5000, random() % spec.capacity_bytes() / 256 * 256, false});
      const test::TemporaryFolder folder;
      DramTrace trace(folder / "t", {spec.clock_mhz(), line}, spec);
      trace.add(bursts, 1);
      trace.commit();
      const std::vector<Burst> read = read_dram_trace(folder / "t", 1 << 20);
      const DramMap before(spec), after(read_dram_trace_description(folder / "t")->memory);
      ASSERT_EQ(read.size(), bursts.size());
      for (std::size_t k = 0; k < read.size(); ++k)
        EXPECT_EQ(after.place(read[k].address), before.place(bursts[k].address)) << type << " " << bursts[k].address;
    }
}

std::vector<Burst> read_text_trace(const std::string& text) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "t", text);
  return read_dram_trace(folder / "t", 1 << 20);
}

TEST(DramTrace, IsReadBack) {
  EXPECT_EQ(read_text_trace("0x40 READ 0\n0xFFFFFFFFFFFFFFC0\tWRITE  7\r\n0Xab READ 7"),
            (std::vector<Burst>{{0, 0x40, false}, {7, 0xFFFFFFFFFFFFFFC0, true}, {7, 0xab, false}}));
  EXPECT_TRUE(read_text_trace("").empty());
}

TEST(DramTrace, AMalformedLineIsRefusedWithItsNumber) {
  for (const char* line : {"", "0x40", "0x40 READ", "40 READ 1", "0x READ 1", "0x40 LOAD 1", "0x40 READ -1",
                           "0x40 READ 1 2", "0x40 READ 1.5", "0x10000000000000000 READ 1",
                           "0x40 READ 99999999999999999999", "\xff\x01", "LD 0x40", "0x40 READ 4"}) {
    try {
      read_text_trace("0x40 READ 5\n" + std::string(line) + "\n0x40 READ 6\n");
      ADD_FAILURE() << line;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("line 2")) << line;
    }
  }
  std::mt19937 random(3);
  for (int i = 0; i < 2000; ++i) {
    std::string bytes(random() % 40, '\0');
    for (char& c : bytes) c = "0x4 READWITE\n\r\t\xff\0"[random() % 17];
    try {
      read_text_trace(bytes);
    } catch (const InputError&) {
    }
  }
  const test::TemporaryFolder folder;
  test::write_text(folder / "t", std::string(2000, ' '));
  EXPECT_THROW(read_dram_trace(folder / "t", 1000), LimitError);
  EXPECT_THROW(read_dram_trace(folder / "none", 1000), InputError);
}

TEST(DramReplay, MovesEveryByteOfTheTrace) {
  DramBanks dram(dram_spec("lpddr5-6400"));
  // A burst that lies across two transactions, at the end of all addresses.
  const DramReplayResult result =
      replay_bursts(dram, {{0, 0, false}, {5, 96, true}, {1000, ~std::uint64_t{0} - 63, false}}, {true, 1.25, 64});
  EXPECT_EQ(result.transactions, 4u);
  EXPECT_EQ(result.reads, 2u);
  EXPECT_GE(result.end, 1000u);
  EXPECT_GT(result.energy.total_nj(), 0);
  EXPECT_DOUBLE_EQ(result.mean_latency_ns, dram.spec().idle_latency_ns());
}

TEST(DramReplay, OfNothingEndsAtOnce) {
  DramBanks dram(dram_spec("lpddr5x-8533"));
  const DramReplayResult result = replay_bursts(dram, {}, {});
  EXPECT_EQ(result.end, 0u);
  EXPECT_EQ(result.gb_s(dram.spec()), 0);
}

TEST(DramReplay, CyclesBeyondTheClockAreRefused) {
  DramBanks dram(dram_spec("lpddr5-6400"));
  EXPECT_THROW(replay_bursts(dram, {{~std::uint64_t{0}, 0, false}}, {true, 1.25, 64}), LimitError);
  EXPECT_NO_THROW(replay_bursts(dram, {{std::uint64_t{1} << 50, 0, false}}, {true, 1.25, 64})) << "idle time is free";
}

}  // namespace
}  // namespace tessera::memory::dram_trace_test
