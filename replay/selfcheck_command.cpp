#include <algorithm>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "replay/commands.h"
#include "replay/progress.h"
#include "replay/selfcheck.h"

namespace tessera::replay {
namespace {

class SelfCheckCommand final : public Command {
 public:
  explicit SelfCheckCommand(CLI::App& app) {
    app.add_option("CAPTURE", captures_,
                   "Captures on which tiling and immediate traffic are compared (default: those in the folder "
                   "captures, if it is there)")
        ->type_name("FILE");
    app.add_flag("--json", json_, "As JSON");
    add_strict_flag(app, strict_);
    app.footer(
        "Identities and published figures, computed again by the units of the machine. Exit status 1 when one does not "
        "hold.");
  }

  void run() override {
    std::vector<SelfCheck> checks;
    {
      const LongStep step("checking", LongStep::quiet_without_terminal());
      checks = check_identities();
      for (const std::filesystem::path& capture : captures()) checks.push_back(check_tiling(capture, strict_));
    }
    if (json_)
      print_json(checks);
    else
      print_table(checks);
    const auto failed =
        std::count_if(checks.begin(), checks.end(), [](const SelfCheck& check) { return !check.passed; });
    if (failed > 0) throw SystemError(fmt::format("{} of {} checks failed", failed, checks.size()));
  }

 private:
  std::vector<std::filesystem::path> captures() const {
    std::vector<std::filesystem::path> files(captures_.begin(), captures_.end());
    std::error_code ignored;
    if (files.empty())
      for (const auto& entry : std::filesystem::directory_iterator("captures", ignored))
        if (entry.path().extension() == ".glb") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
  }

  static void print_json(const std::vector<SelfCheck>& checks) {
    nlohmann::json rows = nlohmann::json::array();
    for (const SelfCheck& c : checks)
      rows.push_back(
          {{"name", c.name}, {"expected", c.expected}, {"got", c.got}, {"pass", c.passed}, {"note", c.note}});
    fmt::print("{}\n", rows.dump(2));
  }

  static void print_table(const std::vector<SelfCheck>& checks) {
    std::size_t name = 0, expected = 8;
    for (const SelfCheck& c : checks)
      name = std::max(name, c.name.size()), expected = std::max(expected, c.expected.size());
    fmt::print("{:<{}}  {:<{}}  pass  got\n", "check", name, "expected", expected);
    for (const SelfCheck& c : checks)
      fmt::print("{:<{}}  {:<{}}  {:<4}  {}\n", c.name, name, c.expected, expected, c.passed ? "yes" : "NO", c.got);
    std::string last;
    fmt::print("\nNotes\n");
    for (const SelfCheck& c : checks) {
      if (c.note == last) continue;
      fmt::print("  {}: {}\n", c.name, c.note);
      last = c.note;
    }
  }

  std::vector<std::string> captures_;
  bool json_ = false, strict_ = false;
};

}  // namespace

std::unique_ptr<Command> make_selfcheck_command(CLI::App& app) { return std::make_unique<SelfCheckCommand>(app); }

}  // namespace tessera::replay
