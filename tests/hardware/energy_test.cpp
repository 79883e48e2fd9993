// Energy by voltage, capacity and area.
#include "hardware/energy.h"
#include "hardware/voltage.h"
#include "tests/support/coarse_machine.h"
#include "tests/support/tests.h"

namespace tessera::hardware::energy_test {
namespace {

EnergyEvents some_of_each() {
  EnergyEvents events;
  EventCounts& counts = events.counts;
  counts[Event::kBounds] = 100, counts[Event::kVertices] = 1000, counts[Event::kHits] = 5000;
  counts[Event::kDepthBlocks] = 30, counts[Event::kShaderInvocations] = 2000, counts[Event::kTexels] = 8000;
  counts[Event::kL2Lines] = 600, counts[Event::kPixels] = 1024;
  events.dram_bytes = 100000;
  return events;
}

TEST(EnergyByVoltage, GoesWithItsSquareLeakageWithItAndTheMemoryNot) {
  Machine gpu = test::coarse_machine();
  const FrameEnergy nominal = frame_energy(gpu, some_of_each(), 1e5, 6);
  for (const double clock : {200.0, 500.0, 700.0, 1200.0}) {
    gpu.clock_mhz = clock;
    const double ratio = supply_volts(clock, gpu.nominal_mhz) / kNominalVolts;
    const FrameEnergy energy = frame_energy(gpu, some_of_each(), 1e5, 6);
    for (const auto& [unit, nj] : nominal.by_unit_nj) {
      const double expected = unit == "dram" ? nj : unit == "leakage" ? nj * ratio * 850 / clock : nj * ratio * ratio;
      EXPECT_DOUBLE_EQ(energy.by_unit_nj.at(unit), expected) << unit << " at " << clock;
    }
  }
}

TEST(Power, FollowsTheTargetRateAndLeaksBetweenFrames) {
  Machine gpu = test::coarse_machine();
  gpu.clock_mhz = 1000;
  FrameEnergy energy;
  energy.by_unit_nj = {{"shader", 1e6}, {"leakage", 1e5}};  // 1 mJ, and 0.1 W for a frame of 1 ms
  EXPECT_NEAR(power_w(gpu, energy, 1e6, 1), 60e-3 + 0.1, 1e-12);
  EXPECT_NEAR(power_w(gpu, energy, 2e6, 2), 30e-3 + 0.05, 1e-12) << "two frames that share it";
  gpu.rate.gating = PowerGating::kBetweenFrames;
  EXPECT_NEAR(power_w(gpu, energy, 1e6, 1), 60 * 1.1e-3, 1e-12);
  gpu.rate.target_fps = 0;
  EXPECT_NEAR(power_w(gpu, energy, 1e6, 1), 1.1, 1e-12);
  gpu.rate.target_fps = 1e4;
  EXPECT_NEAR(power_w(gpu, energy, 1e6, 1), 1.1, 1e-12) << "it draws no more than it can";
  EXPECT_EQ(power_w(gpu, energy, 0, 1), 0);
}

TEST(EnergyByCapacity, AccessesToALargerMemoryCostMore) {
  const Machine plain = test::coarse_machine();
  Machine large = plain;
  large.caches.texture_bytes *= 4, large.caches.l2_bytes *= 4, large.cores.memory_bytes *= 4;
  const FrameEnergy before = frame_energy(plain, some_of_each(), 0, 0),
                    after = frame_energy(large, some_of_each(), 0, 0);
  EXPECT_DOUBLE_EQ(after.by_unit_nj.at("l2"), 2 * before.by_unit_nj.at("l2"));
  EXPECT_DOUBLE_EQ(after.by_unit_nj.at("coarse_depth"), 2 * before.by_unit_nj.at("coarse_depth"));
  EXPECT_DOUBLE_EQ(after.by_unit_nj.at("triangle_tests"), 2 * before.by_unit_nj.at("triangle_tests"));  // hits alone
  EXPECT_DOUBLE_EQ(after.by_unit_nj.at("texture"), before.by_unit_nj.at("texture") * 4 / 3);
  EXPECT_EQ(after.by_unit_nj.at("shader"), before.by_unit_nj.at("shader"));
}

TEST(Leakage, IsPowerOfTheAreaForTheTimeThatTheFrameTakes) {
  const Machine gpu = test::coarse_machine();
  // 10 mW of each of 4 mm2 for 1 ms.
  EXPECT_DOUBLE_EQ(frame_energy(gpu, {}, 850e3, 4).by_unit_nj.at("leakage"), 40e-3 * 1e-3 * 1e9);
  EXPECT_EQ(frame_energy(gpu, {}, 850e3, 0).total_nj(), 0);
}

// The memory has its own clock.
TEST(Memory, KeepsItsRateAndLatencyWhenTheClockOfTheGpuChanges) {
  Machine gpu = test::coarse_machine();
  EXPECT_EQ(gpu.bytes_per_clk(), 40.1);
  EXPECT_EQ(gpu.latency_clk(), 192);
  gpu.clock_mhz /= 2;
  EXPECT_DOUBLE_EQ(gpu.bytes_per_clk(), 80.2);
  EXPECT_DOUBLE_EQ(gpu.latency_clk(), 96);
  gpu.set_bytes_per_clk(40.1);
  gpu.set_latency_clk(192);
  EXPECT_DOUBLE_EQ(gpu.memory.gb_per_s, 34.085 / 2);
  EXPECT_DOUBLE_EQ(gpu.memory.latency_ns, 2 * 192 / 0.85);
}

}  // namespace
}  // namespace tessera::hardware::energy_test
