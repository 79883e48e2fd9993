// Lines and streams on their way through the L2 to the banks of the external memory.
#include "timing/events/memory_path.h"
#include "hardware/external_memory.h"
#include "tests/support/tests.h"

namespace tessera::timing::memory_path_test {
namespace {

using hardware::Machine;
using Stretch = std::pair<std::uint64_t, std::uint64_t>;  // first byte, bytes

// One channel, whose clock is the GPU's; L2 and texture units take no time.
Machine one_channel() {
  Machine gpu;
  gpu.memory.type = hardware::MemoryType::kLpddr5_6400;
  gpu.memory.channels = 1;
  gpu.clock_mhz = hardware::external_memory(gpu).clock_mhz();
  gpu.queues.l2_latency_clk = 0;
  gpu.queues.l2_lines_per_clk = 1e30;
  return gpu;
}

struct Moved {
  double end = 0;  // when the group's event comes
  MemoryCounts counts;
  std::vector<memory::Burst> bursts;
};

// One group asks for streams and lines.
Moved moved(const Machine& gpu, const std::vector<Stretch>& streams, const std::vector<std::uint32_t>& lines = {}) {
  Moved out;
  EventQueue events(false);
  MemoryPath memory(gpu, events, &out.bursts);
  const std::uint32_t group = memory.open_group(EventKind::kListRead, 0, 0);
  for (const auto& [address, bytes] : streams) memory.read_bytes(address, bytes, group, 0);
  for (const std::uint32_t line : lines) memory.read_line(line, group, 0);
  memory.close_group(group, 0);
  while (!events.empty()) {
    const SimulationEvent event = events.pop();
    if (event.kind == EventKind::kBanks) memory.banks_answer(event.time);
    if (event.kind == EventKind::kMemory) memory.memory_has_read(event.what, event.time);
    if (event.kind == EventKind::kListRead) out.end = event.time;
  }
  out.counts = memory.counts();
  return out;
}

std::vector<std::uint64_t> addresses(const Moved& moved) {
  std::vector<std::uint64_t> out;
  for (const memory::Burst& burst : moved.bursts) out.push_back(burst.address);
  std::sort(out.begin(), out.end());
  return out;
}

TEST(MemoryPath, StreamsThatFollowEachOtherAskForEachLineOnce) {
  const Machine gpu = one_channel();
  const Moved whole = moved(gpu, {{0, 192}}), cut = moved(gpu, {{0, 100}, {100, 20}, {120, 72}});
  const std::vector<std::uint64_t> bursts = {0, 32, 64, 96, 128, 160};
  EXPECT_EQ(addresses(whole), bursts);
  EXPECT_EQ(addresses(cut), bursts);
  EXPECT_EQ(cut.counts.read_bytes, 192u);
  EXPECT_EQ(cut.end, whole.end);
  EXPECT_EQ(addresses(moved(gpu, {{100, 20}})), std::vector<std::uint64_t>()) << "the stream before has its line";
  EXPECT_EQ(moved(gpu, {{100, 20}}).end, 0);
}

// Two bursts of a row: the second follows at tCCD_L, and the line is there with its last data.
TEST(MemoryPath, ALineIsThereWithItsLastBurst) {
  const Machine gpu = one_channel();
  memory::DramSpec of_bursts = hardware::external_memory(gpu), of_lines = of_bursts;
  of_lines.transaction_bytes = 64;
  const Moved line = moved(gpu, {}, {7});
  EXPECT_EQ(addresses(line), (std::vector<std::uint64_t>{7 * 64, 7 * 64 + 32}));
  EXPECT_EQ(line.end, of_lines.idle_latency_clocks());
  EXPECT_GT(line.end, of_bursts.idle_latency_clocks());
  EXPECT_EQ(moved(gpu, {{7 * 64, 64}}).end, line.end) << "a stream of one line";
  EXPECT_EQ(line.counts.l2_misses, 1u);
}

// A line that is under way is not asked for again.
TEST(MemoryPath, ALineTwiceIsOneMiss) {
  const Moved once = moved(one_channel(), {}, {7}), twice = moved(one_channel(), {}, {7, 7});
  EXPECT_EQ(twice.bursts.size(), once.bursts.size());
  EXPECT_EQ(twice.counts.l2_requests, 2u);
  EXPECT_EQ(twice.counts.l2_misses, 1u);
  EXPECT_EQ(twice.end, once.end);
}

TEST(MemoryPath, FluidMemoryHasNoBursts) {
  Machine gpu = one_channel();
  gpu.memory.model = hardware::MemoryModel::kFluid;
  gpu.memory.gpu_share = 1;
  gpu.set_bytes_per_clk(2);
  gpu.set_latency_clk(50);
  const Moved stream = moved(gpu, {{0, 192}});
  EXPECT_TRUE(stream.bursts.empty());
  EXPECT_EQ(stream.end, 192 / 2 + 50);
}

}  // namespace
}  // namespace tessera::timing::memory_path_test
