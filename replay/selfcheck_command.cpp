#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/output_file.h"
#include "base/webp_codec.h"
#include "replay/commands.h"
#include "replay/progress.h"
#include "replay/selfcheck.h"
#include "replay/stability/stability.h"

namespace tessera::replay {
namespace {

class SelfCheckCommand final : public Command {
 public:
  explicit SelfCheckCommand(CLI::App& app) {
    app.add_option("CAPTURE", captures_,
                   "Captures on which machines are compared (default: the files of the folder captures, if it "
                   "exists)")
        ->type_name("FILE");
    app.add_flag("--json", json_, "As JSON");
    add_strict_flag(app, strict_);
    CLI::Option* stability = app.add_flag(
        "--stability", stability_, "Instead: hard cases of small scenes against double precision, each with its bound");
    app.add_option("--out", out_, "Where the page's table and images of the hard cases are written")
        ->type_name("DIR")
        ->needs(stability);
    app.footer(
        "Published figures, measured again under their published conditions. A figure that does not "
        "hold is shown\n"
        "as NO. Exit status 1 when the reason of such a figure is not known; figures with a reason "
        "beside them (and in\n"
        "docs/validation.md) do not count. With --stability: 1 when a hard case (docs/hard_cases.md) "
        "is beyond its bound.");
  }

  void run() override {
    if (stability_) return run_stability();
    const std::vector<std::filesystem::path> files = captures();
    std::vector<SelfCheck> checks;
    {
      // The rates of memories, then each capture twice.
      Progress progress(1 + 2 * files.size(), LongStep::quiet_without_terminal());
      checks = check_memory_rates();
      std::size_t done = 1;
      progress.update(done, "rates of memories");
      for (SelfCheck& check :
           check_captures(files, strict_, [&](const std::string& what) { progress.update(++done, what); }))
        checks.push_back(std::move(check));
    }
    if (const std::vector<std::string> missing = left_out(checks); !missing.empty())
      fmt::print(stderr, "note: left out, as {}: {}\n",
                 files.empty() ? "there are no captures in ./captures and none is named" : "no capture has textures",
                 fmt::join(missing, "; "));
    if (json_)
      print_json(checks);
    else
      print_table(checks);
    if (const std::size_t failed = failures(checks); failed > 0)
      throw SystemError(fmt::format("{} of {} checks failed", failed, checks.size()));
  }

 private:
  void run_stability() const {
    if (!captures_.empty()) throw UsageError("--stability makes its scenes itself: it takes no captures");
    const std::filesystem::path folder(out_);
    if (!out_.empty()) check_output_folder(folder, {"stability.md", "*.webp"});
    const std::vector<stability::StabilityCase>& cases = stability::stability_cases();
    std::vector<stability::StabilityResult> results;
    {
      install_stop_handler();
      Progress progress(cases.size(), LongStep::quiet_without_terminal());
      for (const stability::StabilityCase& of : cases) {
        if (stop_requested()) throw stopped("stopped");
        results.push_back(stability::measure(of));
        if (!out_.empty()) write_thumbnail(of, folder);
        progress.update(results.size(), std::string(of.name));
      }
    }
    if (!out_.empty())
      write_file_atomically(folder / "stability.md", stability::stability_page(results, "images/stability"));
    if (json_)
      print_json(results);
    else
      print_table(results);
    const auto failed =
        std::count_if(results.begin(), results.end(), [](const auto& result) { return !result.holds(); });
    if (failed > 0) throw SystemError(fmt::format("{} of {} cases do not keep their bounds", failed, results.size()));
  }

  static void write_thumbnail(const stability::StabilityCase& of, const std::filesystem::path& folder) {
    constexpr int kQuality = 80;
    write_file_atomically(folder / stability::thumbnail_file(of),
                          encode_webp(stability::thumbnail(of), kQuality, false));
  }

  static void print_json(const std::vector<stability::StabilityResult>& results) {
    nlohmann::json rows = nlohmann::json::array();
    for (const stability::StabilityResult& result : results)
      rows.push_back({{"section", result.of->section},
                      {"case", result.of->name},
                      {"error", result.error},
                      {"bound", result.of->bound},
                      {"unit", result.of->unit},
                      {"holds", result.holds()}});
    fmt::print("{}\n", rows.dump(2));
  }

  static void print_table(const std::vector<stability::StabilityResult>& results) {
    std::string_view section;
    for (const stability::StabilityResult& result : results) {
      const stability::StabilityCase& of = *result.of;
      if (of.section != section)
        fmt::print("{}{:<58} {:>9} {:>9}  {:<8} holds\n", section.empty() ? "" : "\n", of.section, "error", "bound",
                   "unit");
      section = of.section;
      fmt::print("  {:<56} {:>9} {:>9}  {:<8} {}\n", of.name, stability::error_text(result.error),
                 stability::error_text(of.bound), of.unit, result.holds() ? "yes" : "NO");
    }
  }

  std::vector<std::filesystem::path> captures() const {
    std::vector<std::filesystem::path> files(captures_.begin(), captures_.end());
    std::error_code ignored;
    if (files.empty())
      for (const auto& entry : std::filesystem::directory_iterator("captures", ignored))
        if (entry.path().extension() == ".glb") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
  }

  static std::vector<std::string> left_out(const std::vector<SelfCheck>& checks) {
    std::vector<std::string> names = capture_check_names();
    std::erase_if(names, [&](const std::string& name) {
      return std::any_of(checks.begin(), checks.end(), [&](const SelfCheck& check) { return check.name == name; });
    });
    return names;
  }

  static void print_json(const std::vector<SelfCheck>& checks) {
    nlohmann::json rows = nlohmann::json::array();
    for (const SelfCheck& c : checks)
      rows.push_back({{"name", c.name},
                      {"condition", c.condition},
                      {"expected", c.expected},
                      {"got", c.got},
                      {"pass", c.passed},
                      {"reason", c.reason},
                      {"note", c.note}});
    fmt::print("{}\n", rows.dump(2));
  }

  static void print_table(const std::vector<SelfCheck>& checks) {
    for (const SelfCheck& c : checks) {
      fmt::print("{:<4} {}: {}\n", c.passed ? "yes" : "NO", c.name, c.got);
      fmt::print("     expected: {}; at: {}\n", c.expected, c.condition);
      if (!c.passed && !c.reason.empty()) fmt::print("     why not: {}\n", c.reason);
      fmt::print("     {}\n", c.note);
    }
  }

  std::vector<std::string> captures_;
  std::string out_;
  bool json_ = false, strict_ = false, stability_ = false;
};

}  // namespace

std::unique_ptr<Command> make_selfcheck_command(CLI::App& app) { return std::make_unique<SelfCheckCommand>(app); }

}  // namespace tessera::replay
