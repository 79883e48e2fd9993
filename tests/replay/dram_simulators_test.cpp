// Our memory beside two simulators of others, unmodified: Ramulator 2 and DRAMsim3. They are no part of the project:
// where the folder with their archives is missing these tests are skipped.
#include <regex>

#include "tests/support/tests.h"

namespace tessera::replay::dram_simulators_test {
namespace {

// TESSERA_SIMULATORS, else beside the sources.
fs::path archives() {
  const char* named = std::getenv("TESSERA_SIMULATORS");
  return named != nullptr ? fs::path(named) : fs::path(TESSERA_SOURCE_DIR) / ".." / "shared" / "tools";
}

// Where the simulators are built, or why they are not.
struct Simulators {
  fs::path folder = fs::path(TESSERA_BINARY_DIR) / "simulators";
  std::string missing;

  Simulators() {
    if (!fs::exists(archives() / "build.sh")) {
      missing = "no simulators in " + archives().string();
      return;
    }
    if (fs::exists(folder / "ramulator_replay") && fs::exists(folder / "dramsim3_replay")) return;
    test::ProcessLimits limits;
    limits.seconds = 900;
    const test::ProcessResult built = test::run_process({(archives() / "build.sh").string(), folder.string()}, limits);
    if (built.status != 0) missing = "the simulators cannot be built here: " + built.errors.substr(0, 400);
  }
};

const Simulators& simulators() {
  static const Simulators built;
  return built;
}

// What follows `name` in a simulator's line.
double figure(const std::string& text, const std::string& name) {
  std::smatch match;
  if (!std::regex_search(text, match, std::regex(name + " ([0-9.]+)"))) return std::nan("");
  return std::stod(match[1]);
}

std::string frame_trace(const char* capture, const fs::path& folder, const char* transaction) {
  const std::string trace = (folder / (std::string(capture) + ".trace")).string();
  const test::ProcessResult r =
      run_tessera({"replay", test::shipped_capture(capture).string(), "--frames", "5:6", "--size", "1280x720",
                   "--quiet", "--no-report", "--out", (folder / "out").string(), "--dram-trace", trace, "--dram-clock",
                   "800", "--dram-transaction", transaction},
                  {.seconds = 600});
  EXPECT_EQ(r.status, 0) << r.errors;
  return trace;
}

// The simulators' drivers end after so many clocks: a frame that lasts longer is cut.
void cut(const std::string& trace, std::uint64_t cycles) {
  std::istringstream lines(test::read_text(trace));
  std::string kept;
  for (std::string line; std::getline(lines, line);)
    if (std::stoull(line.substr(line.rfind(' '))) < cycles) kept += line + '\n';
  test::write_text(trace, kept);
}

class DramSimulators : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!simulators().missing.empty()) GTEST_SKIP() << simulators().missing;
  }
  test::TemporaryFolder folder_;
};

// LPDDR5-6400, four channels of 16 bits, RoBaRaCoCh, transactions of 32 bytes.
TEST_P(DramSimulators, EndTogetherWithBanksAndReadAsFast) {
  const std::string trace = frame_trace(GetParam(), folder_.path(), "32");
  cut(trace, 19'000'000);
  for (const std::string pace : {"asap", "timed"}) {
    const test::ProcessResult other =
        test::run_process({(simulators().folder / "ramulator_replay").string(),
                           (archives() / "ramulator_lpddr5_6400_4ch.yaml").string(), trace, "800", pace, "32", "1.25"},
                          {.seconds = 600});
    const test::ProcessResult ours =
        run_tessera({"dram", trace, "--memory", "lpddr5-6400", "--pace", pace, "--clock", "800", "--burst", "32",
                     "--transaction", "32", "--mapping", "RoBaRaCoCh", "--json"},
                    {.seconds = 600});
    ASSERT_EQ(ours.status, 0) << ours.errors;
    const json result = json::parse(ours.output);
    const double end = result["end_ns"].get<double>() * 1e-3, latency = result["read_latency_mean_ns"];
    const double other_end = figure(other.output, "end"), other_latency = figure(other.output, "mean");
    std::printf("%-9s %-5s end %9.1f us, Ramulator 2 %9.1f (%+.1f %%); read latency %7.1f ns, %7.1f (%+.1f %%)\n",
                GetParam(), pace.c_str(), end, other_end, 100 * (end / other_end - 1), latency, other_latency,
                100 * (latency / other_latency - 1));
    EXPECT_NEAR(end / other_end, 1, 0.05) << pace << other.output;
    // As fast as possible, a read's latency is that of full queues, which hangs on who is starved how long.
    EXPECT_NEAR(latency / other_latency, 1, pace == "timed" ? 0.15 : 0.5) << other.output;
  }
}

INSTANTIATE_TEST_SUITE_P(Captures, DramSimulators,
                         testing::Values("city", "eggs", "flyby", "garden", "serpent", "stroll", "vases", "workshop"),
                         [](const auto& capture) { return std::string(capture.param); });

class DramSimulatorConfigurations : public DramSimulators {};

// Every transaction completes: DRAMsim3 stalls where a write meets a waiting read of its address.
TEST_P(DramSimulatorConfigurations, FinishTheTrace) {
  const fs::path config = simulators().folder / "dramsim3" / "configs" / (std::string(GetParam()) + ".ini");
  for (const char* capture : {"vases", "flyby"}) {
    const std::string trace = frame_trace(capture, folder_.path(), "64");
    for (const char* pace : {"timed", "asap"}) {
      const test::ProcessResult r = test::run_process({(simulators().folder / "dramsim3_replay").string(),
                                                       config.string(), trace, folder_.path().string(), "800", pace},
                                                      {.seconds = 600});
      constexpr double kDriversClocks = 6'000'000;
      const double end = figure(r.output, "end");
      std::printf("%-22s %-6s %-5s end %8.0f clocks\n", GetParam(), capture, pace, end);
      EXPECT_LT(end, kDriversClocks) << capture << " " << pace << ": " << r.output << r.errors;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(DramSim3, DramSimulatorConfigurations,
                         testing::Values("LPDDR4_8Gb_x16_2400", "DDR4_8Gb_x16_3200", "LPDDR3_8Gb_x32_1866",
                                         "GDDR6_8Gb_x16", "HBM2_8Gb_x128"),
                         [](const auto& config) { return std::string(config.param); });

}  // namespace
}  // namespace tessera::replay::dram_simulators_test
