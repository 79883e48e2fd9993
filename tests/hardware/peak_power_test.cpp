// Watts of the described machine at its peak rate of fused operations, against published ones (docs/validation.md).
#include <regex>

#include "gpu/configuration.h"
#include "hardware/area.h"
#include "hardware/energy.h"
#include "tests/support/tests.h"

namespace tessera::hardware::peak_power_test {
namespace {

// Peak rate of a machine whose lanes all issue an instruction in every clock of a second, without memory.
double peak_gops(const Machine& gpu) {
  return static_cast<double>(gpu.shader.lanes * gpu.cores.count) * gpu.clock_mhz * 1e-3;
}
double peak_watts(Machine gpu) {
  gpu.rate.target_fps = 0;
  const double cycles = gpu.clock_mhz * 1e6;
  EnergyEvents events;
  events.counts[Event::kShaderClocks] = static_cast<std::uint64_t>(peak_gops(gpu) * 1e9);
  return power_w(gpu, frame_energy(gpu, events, cycles, machine_area(gpu, {}).total_mm2()), cycles, 1);
}

// Power at the same speed by TSMC's figures: 7 nm takes 60 % less than 16 nm (2018), and 5 nm takes 30 % less than 7
// nm (2020).
constexpr double kPowerOf7Per16 = 1 - 0.6, kPowerOf5Per7 = 1 - 0.3;

// A measured part: its peak rate of fused operations, and its power at 7 nm for a rate of ours.
struct Part {
  double gops, watts, to_7nm;
  double at(double rate) const { return watts * to_7nm * rate / gops; }
};
// Notebookcheck, by Apple's own counters, of the GPU alone: 2.6 TFLOPS with 10 W; 5.3 TFLOPS with 15 to 20.6 W.
constexpr Part kAppleM1 = {1300, 10, 1 / kPowerOf5Per7}, kAppleM1Pro = {2650, 20.6, 1 / kPowerOf5Per7};
// AnandTech 2017, Manhattan 3.1 off screen, power of the phone less its idle power: four and eight cores of Mali that
// do 12 fused operations a clock, at 900 and 1037 MHz.
constexpr Part kKirin950 = {4 * 12 * 0.9, 2.75, kPowerOf7Per16}, kKirin960 = {8 * 12 * 1.037, 8.63, kPowerOf7Per16};

TEST(PeakPower, IsWithinTwiceTheMeasuredPowerOfAGpu) {
  const Machine gpu;
  for (const Part& part : {kAppleM1, kAppleM1Pro}) {
    const double ratio = peak_watts(gpu) / part.at(peak_gops(gpu));
    EXPECT_GT(ratio, 0.5);
    EXPECT_LT(ratio, 2);
  }
}

// A phone's figure holds its processors, its memory and its regulators: an upper bound.
TEST(PeakPower, IsAThirdOfThePowerOfWholePhones) {
  const Machine gpu;
  EXPECT_NEAR(kKirin950.at(peak_gops(gpu)) / peak_watts(gpu), 2.8, 0.05);
  EXPECT_NEAR(kKirin960.at(peak_gops(gpu)) / peak_watts(gpu), 3.8, 0.05);
}

TEST(PeakPower, EqualsThePage) {
  std::ifstream page(TESSERA_SOURCE_DIR "/docs/validation.md");
  std::string line;
  std::smatch cells;
  const std::regex row(R"(\| `mid-mobile` \| 7 \| ([0-9.]+) \| ([0-9.]+) \|.*)");
  while (std::getline(page, line) && !std::regex_match(line, cells, row)) {
  }
  ASSERT_EQ(cells.size(), 3u) << "docs/validation.md has no row of mid-mobile at its peak rate";
  EXPECT_NEAR(std::stod(cells[1]), peak_gops({}), 0.05);
  EXPECT_NEAR(std::stod(cells[2]), peak_watts({}), 0.005);
}

// Stillmaker and Baas 2017, energy of high-performance transistors at a voltage: a V^2 + b V + c.
struct EnergyFactor {
  double a, b, c;
  double at(double volts) const { return a * volts * volts + b * volts + c; }
};

TEST(EnergyOfAnInstruction, IsAQuarterOfThePublishedOneAndItsRangeHoldsBothPublishedLaws) {
  constexpr double kFetchDecodeOperands = 30, kFusedAt45nm = 3.7 + 0.9, kFusedAt7nm = 1.31 + 0.38;
  constexpr EnergyFactor k45nm = {1.018, -0.3107, 0.1539}, k16nm = {0.2958, -0.1241, 0.03024},
                         k7nm = {0.1776, -0.09097, 0.02447};
  const double at_45nm = kFetchDecodeOperands + kFusedAt45nm, by_transistors = k7nm.at(0.8) / k45nm.at(0.9),
               by_arithmetic = kFusedAt7nm / kFusedAt45nm;
  for (const char* name : {"energy.shader_operation_pj", "energy.sampling_operation_pj"}) {
    const auto* key = gpu::gpu_keys().find(name);
    ASSERT_NE(key, nullptr) << name;
    ASSERT_TRUE(key->ends) << name;
    const double value = std::get<double>(gpu::gpu_keys().default_value(*key));
    EXPECT_DOUBLE_EQ(value, at_45nm / 4) << name;
    EXPECT_LT(key->ends->low, at_45nm * by_transistors) << name;
    EXPECT_LT(at_45nm * by_transistors, value) << name;
    EXPECT_LT(value, at_45nm * by_arithmetic) << name;
    EXPECT_LT(at_45nm * by_arithmetic, key->ends->high) << name;
    // The bound if the logic around the operation were Volta's own, at 12 nm.
    EXPECT_LT((kFetchDecodeOperands + 1.5) * k7nm.at(0.8) / k16nm.at(0.9), key->ends->high) << name;
  }
}

}  // namespace
}  // namespace tessera::hardware::peak_power_test
