// docs/tour.md: its commands work as they stand there, and its table has what they give.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "gpu/configuration.h"
#include "tests/support/captures.h"
#include "tests/support/csv_rows.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = TESSERA_SOURCE_DIR;

std::vector<std::string> tour_lines() {
  std::vector<std::string> lines;
  std::istringstream page(test::read_text(kRoot / "docs" / "tour.md"));
  for (std::string line; std::getline(page, line);) lines.push_back(line);
  return lines;
}

// Arguments of the program in the shell blocks, with captures where they lie and results below `out`.
std::vector<std::vector<std::string>> tour_commands(const test::TemporaryFolder& out) {
  std::vector<std::vector<std::string>> commands;
  bool shell = false;
  for (const std::string& line : tour_lines()) {
    if (line.starts_with("```")) shell = line == "```sh";
    if (!shell || !line.starts_with("./tessera ")) continue;
    std::istringstream words(line.substr(0, line.find(" #")));
    std::vector<std::string> arguments{std::istream_iterator<std::string>(words), {}};
    arguments.erase(arguments.begin());
    for (std::string& argument : arguments) {
      if (argument.starts_with("captures/")) argument = (kRoot / argument).string();
      if (argument.starts_with("out/")) argument = (out / argument).string();
    }
    commands.push_back(std::move(arguments));
  }
  return commands;
}

double cell(const std::map<std::string, std::string>& row, const char* column) { return std::stod(row.at(column)); }

TEST(Tour, ItsCommandsGiveItsTable) {
  const test::TemporaryFolder out;
  const auto commands = tour_commands(out);
  ASSERT_GE(commands.size(), 8u);
  for (const std::vector<std::string>& command : commands) {
    const test::ProcessResult r = test::run_tessera(command);
    EXPECT_EQ(r.status, 0) << testing::PrintToString(command) << "\n" << r.errors;
  }
  std::map<std::string, std::map<std::string, std::string>> machines;
  for (const auto& row : test::csv_rows(out / "out/tour/machines/sweep.csv")) machines[row.at("gpu")] = row;
  static const std::regex kRow("^\\| `([a-z-]+)` \\| ([0-9.]+) \\| ([0-9.]+) \\| ([0-9.]+|–) \\| ([0-9.]+) \\|$");
  int rows = 0;
  for (const std::string& line : tour_lines()) {
    std::smatch match;
    if (!std::regex_match(line, match, kRow)) continue;
    ASSERT_TRUE(machines.contains(match[1])) << line;
    const auto& row = machines[match[1]];
    const double mhz = gpu::load_gpu(match[1]).clock_mhz, mj = cell(row, "energy.total_nj") * 1e-6;
    EXPECT_NEAR(cell(row, "timing.cycles") / mhz * 1e-3, std::stod(match[2]), 0.05) << line;
    EXPECT_NEAR(mj, std::stod(match[3]), 0.05) << line;
    if (match[4] != "–") {
      EXPECT_NEAR(mj * 60e-3, std::stod(match[4]), 0.005) << line;
    }
    EXPECT_NEAR(cell(row, "area.total_mm2"), std::stod(match[5]), 0.05) << line;
    ++rows;
  }
  EXPECT_EQ(rows, 3);
  double least = 1e9;
  for (const auto& row : test::csv_rows(out / "out/tour/smallest/sweep.csv"))
    if (cell(row, "timing.cycles") <= 14166666) least = std::min(least, cell(row, "area.total_mm2"));
  std::smatch match;
  const std::string page = test::read_text(kRoot / "docs" / "tour.md");
  ASSERT_TRUE(std::regex_search(page, match, std::regex("do it on ([0-9.]+) mm²")));
  EXPECT_NEAR(least, std::stod(match[1]), 0.05);
}

}  // namespace
}  // namespace tessera
