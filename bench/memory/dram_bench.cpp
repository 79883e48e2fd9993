// Measures the host time of a transaction of 64 bytes in the external memory with banks, in a stream of 10^6, by kind of
// memory and of stream. The goal is 250 ns. Streams: 0 sequential reads; 1 runs of 1 KiB, half of them writes; 2 random reads.
#include <benchmark/benchmark.h>

#include <random>
#include <vector>

#include "memory/dram_replay.h"

namespace tessera::memory {
namespace {

constexpr std::size_t kDramRequests = 1'000'000;

std::vector<Burst> dram_stream(std::int64_t kind) {
  std::mt19937_64 random(1);
  std::vector<Burst> bursts(kDramRequests);
  Burst run;
  for (std::size_t i = 0; i < bursts.size(); ++i) {
    if (kind == 2 || (kind == 1 && i % 16 == 0))
      run = {0, random() % (1u << 20) * 1024, kind == 1 && random() % 2 == 0};
    bursts[i] = run;
    run.address += 64;
  }
  return bursts;
}

void BM_DramTransaction(benchmark::State& state) {
  const DramSpec spec = dram_spec(dram_types()[static_cast<std::size_t>(state.range(0))]);
  const std::vector<Burst> bursts = dram_stream(state.range(1));
  for (auto _ : state) {
    DramBanks dram(spec);
    const DramReplayResult result = replay_bursts(dram, bursts, {false, 1, 64});
    if (result.transactions != bursts.size() ||
        result.counters.read_bursts + result.counters.write_bursts < bursts.size()) {
      state.SkipWithError("transactions are missing");
      return;
    }
    benchmark::DoNotOptimize(result.end);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(bursts.size()));
  state.SetLabel(spec.type);
}
BENCHMARK(BM_DramTransaction)->ArgsProduct({{0, 1, 2}, {0, 1, 2}})->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tessera::memory
