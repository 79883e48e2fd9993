// Completion of command lines in real shells, and the manual page.
#include "gpu/configuration.h"
#include "tests/support/tests.h"

namespace tessera::replay::completion_test {
namespace {

using test::run_process;
using testing::Contains;
using testing::IsEmpty;
using testing::Not;

const std::vector<std::string> kCommands = {"replay",   "time",   "inspect", "pack",     "compare",   "sweep",
                                            "tradeoff", "report", "dram",    "describe", "selfcheck", "view"};

std::set<std::string> lines_of(const std::string& text) {
  std::set<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.insert(line);
  return lines;
}

// Completions that bash offers for these words, the last one unfinished; bash itself splits the line.
class BashCompletion : public testing::Test {
 protected:
  static constexpr const char* kBash = "/bin/bash";
  BashCompletion() {
    test::write_text(folder_ / "completion", run_tessera({"describe", "completion", "bash"}).output);
    test::write_text(folder_ / "model one.glb", "");
    test::write_text(folder_ / "study.json", "");
  }
  void SetUp() override {
    if (!fs::exists(kBash)) GTEST_SKIP() << "no bash";
  }
  std::set<std::string> offered(const std::vector<std::string>& words) const {
    const std::string script =
        "cd \"$1\" && source ./completion || exit 1; shift; COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1)); _tessera; "
        "printf '%s\\n' \"${COMPREPLY[@]}\"";
    std::vector<std::string> command = {kBash, "--norc", "--noprofile", "-c", script, "bash", folder_.path().string()};
    command.insert(command.end(), words.begin(), words.end());
    const ProcessResult r = run_process(command);
    EXPECT_EQ(r.status, 0) << r.errors;
    EXPECT_EQ(r.errors, "");
    std::set<std::string> lines = lines_of(r.output);
    lines.erase("");
    return lines;
  }
  test::TemporaryFolder folder_;
};

TEST_F(BashCompletion, OffersCommandsAndTheirOptions) {
  const auto commands = offered({"tessera", ""});
  for (const std::string& command : kCommands) EXPECT_THAT(commands, Contains(command));
  EXPECT_EQ(offered({"tessera", "re"}), (std::set<std::string>{"replay", "report"}));
  EXPECT_EQ(offered({"tessera", "replay", "--no"}), std::set<std::string>{"--no-report"});
  // Every option that --help names.
  for (const std::string& command : kCommands) {
    const auto options = offered({"tessera", command, "--"});
    std::istringstream help(run_tessera({command, "--help"}).output);
    for (std::string line; std::getline(help, line);) {
      const std::size_t at = line.find("--");
      if (!line.starts_with("  ") || at == std::string::npos || at >= 8) continue;
      EXPECT_THAT(options, Contains(line.substr(at, line.find_first_of(" ,", at) - at))) << line;
    }
  }
}

TEST_F(BashCompletion, OffersTheValuesOfAnOption) {
  const auto presets = offered({"tessera", "replay", "x.glb", "--gpu", ""});
  for (const std::string& preset : gpu::preset_names()) EXPECT_THAT(presets, Contains(preset));
  EXPECT_THAT(presets, Contains("study.json"));
  EXPECT_EQ(offered({"tessera", "replay", "--set", "tile.wid"}), std::set<std::string>{"tile.width="});
  EXPECT_EQ(offered({"tessera", "replay", "--set", "shading.rate", "=", "p"}),
            (std::set<std::string>{"pixel", "primitive"}));
  EXPECT_EQ(offered({"tessera", "replay", "--set", "shading.rate", "="}),
            (std::set<std::string>{"cache", "pixel", "primitive", "sample"}));
  EXPECT_EQ(offered({"tessera", "replay", "--gpu", "=", "v3"}), std::set<std::string>{"v3d"});
  EXPECT_EQ(offered({"tessera", "replay", "--aux", "depth,nor"}), std::set<std::string>{"depth,normal"});
  EXPECT_EQ(offered({"tessera", "time", "--split", "d"}), std::set<std::string>{"drawables"});
  EXPECT_EQ(offered({"tessera", "replay", "--animation", "a"}), std::set<std::string>{"all"});
  EXPECT_THAT(offered({"tessera", "replay", "--size", ""}), IsEmpty());
}

TEST_F(BashCompletion, OffersFilesAndTopics) {
  EXPECT_EQ(offered({"tessera", "replay", "model"}), std::set<std::string>{"model one.glb"});
  EXPECT_EQ(offered({"tessera", "replay", "--trace", "st"}), std::set<std::string>{"study.json"});
  EXPECT_EQ(offered({"tessera", "describe", "co"}), (std::set<std::string>{"completion", "counters"}));
  EXPECT_EQ(offered({"tessera", "describe", "completion", ""}), (std::set<std::string>{"bash", "zsh"}));
  EXPECT_EQ(offered({"tessera", "describe", "schema", "st"}), (std::set<std::string>{"stats", "study"}));
}

TEST(ZshCompletion, IsTakenByZshAndNamesEveryOption) {
  const std::string script = run_tessera({"describe", "completion", "zsh"}).output;
  EXPECT_THAT(script, testing::StartsWith("#compdef tessera\n"));
  for (const std::string& command : kCommands) EXPECT_THAT(script, HasSubstr("\n        " + command + ")\n"));
  EXPECT_THAT(script, HasSubstr("'--no-report["));
  const char* zsh = fs::exists("/bin/zsh") ? "/bin/zsh" : "/usr/bin/zsh";
  if (!fs::exists(zsh)) GTEST_SKIP() << "no zsh";
  const test::TemporaryFolder folder;
  test::write_text(folder / "_tessera", script);
  const ProcessResult r = run_process({zsh, "-f", "-n", (folder / "_tessera").string()});
  EXPECT_EQ(r.status, 0) << r.errors;
  EXPECT_EQ(r.errors, "");
}

TEST(ManualPage, NamesEveryCommandOptionAndStatus) {
  const std::string page = run_tessera({"describe", "man"}).output;
  EXPECT_THAT(page, HasSubstr(".TH TESSERA 1"));
  for (const std::string& command : kCommands) EXPECT_THAT(page, HasSubstr(".SS tessera " + command + " [OPTIONS]"));
  for (const char* option : {"\\-\\-camera \\fINAME|N|auto\\fR", "\\-\\-no\\-report", "\\-\\-threshold"})
    EXPECT_THAT(page, HasSubstr(option));
  for (const char* status : {".B 0\n", ".B 5\n", ".B 130\n"}) EXPECT_THAT(page, HasSubstr(status));
}

TEST(ManualPage, FormatsWithoutWarnings) {
  if (!fs::exists("/usr/bin/groff")) GTEST_SKIP() << "no groff";
  const test::TemporaryFolder folder;
  test::write_text(folder / "tessera.1", run_tessera({"describe", "man"}).output);
  const ProcessResult r =
      run_process({"/usr/bin/groff", "-man", "-Tutf8", "-ww", "-z", (folder / "tessera.1").string()});
  EXPECT_EQ(r.status, 0);
  EXPECT_EQ(r.errors, "");
}

TEST(Program, SaysItsVersion) {
  const ProcessResult r = run_tessera({"--version"});
  EXPECT_EQ(r.status, 0) << r.errors;
  EXPECT_THAT(r.output, testing::MatchesRegex("tessera [0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

TEST(DescribeGpu, TellsHowTwoMachinesDiffer) {
  const test::TemporaryFolder folder;
  const std::string mine = (folder / "mine.json").string();
  test::write_text(mine, R"({"name": "Mine", "description": "with small tiles", "base": "v3d", "tile": {"width": 8}})");
  test::write_text(folder / "next.json", R"({"base": "mine.json", "tile": {"height": 8}})");
  const ProcessResult r = run_tessera({"describe", "gpu", "--diff", "v3d", mine});
  EXPECT_EQ(r.status, 0) << r.errors;
  EXPECT_THAT(r.output, HasSubstr("Mine (" + mine + "): with small tiles\n"));
  EXPECT_THAT(r.output, testing::ContainsRegex("tile.width +[0-9]+ +8  pixels"));
  EXPECT_THAT(r.output, Not(HasSubstr("tile.height")));
  EXPECT_THAT(run_tessera({"describe", "gpu", "--diff", mine, (folder / "next.json").string()}).output,
              testing::ContainsRegex("tile.height +[0-9]+ +8  pixels"));
  EXPECT_THAT(run_tessera({"describe", "gpu", "--diff", mine, mine}).output, HasSubstr("no key differs"));
  const ProcessResult replay = run_tessera({"replay", test::shipped_capture("vases").string(), "--size", "16x16",
                                            "--no-report", "--gpu", mine, "--out", (folder / "out").string()});
  EXPECT_THAT(replay.output, HasSubstr("cycles of Mine at "));
}

}  // namespace
}  // namespace tessera::replay::completion_test
