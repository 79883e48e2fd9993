#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "base/error.h"
#include "base/output_file.h"
#include "replay/commands.h"
#include "replay/file_kind.h"
#include "replay/input_files.h"
#include "replay/progress.h"
#include "replay/report/report.h"

namespace tessera::replay {
namespace {

class ReportCommand final : public Command {
 public:
  explicit ReportCommand(CLI::App& app) {
    app.add_option("DIR", folders_,
                   "Folder of `tessera replay`, `tessera sweep` or `tessera tradeoff`; or folders of several "
                   "replays")
        ->required()
        ->type_name("DIR");
    app.footer(
        "Writes DIR/report.html: one file with images, maps, plots, tables and the configuration; it "
        "needs no network.\n"
        "For several replays it writes compare.html into the first folder, a page that compares all "
        "of them.\n"
        "For a sweep it joins the results of all shards so far and writes DIR/sweep.csv as well.");
  }

  void run() override {
    namespace fs = std::filesystem;
    if (folders_.size() > kMaxRuns)
      throw UsageError(fmt::format("a page shows {} replays side by side, not {}", kMaxRuns, folders_.size()));
    const bool joint = folders_.size() > 1;
    const fs::path first = folders_.front(), page = first / (joint ? "compare.html" : "report.html");
    if (fs::is_directory(first)) {
      const std::vector<std::string> results = {page.filename().string(), "sweep.csv"};
      InputFiles inputs;
      for (const fs::path folder : folders_)
        for (const char* name : {"stats.json", "tradeoff.json", "sweep.json"}) inputs.add(folder / name);
      inputs.check_folder(first, results);
      check_output_folder(first, results);
    }
    std::string note;
    {
      const LongStep step("writing the report", LongStep::quiet_without_terminal());
      note = joint ? write_joint_report({folders_.begin(), folders_.end()}, page)
                   : read_as(FileKind::kFolder, folders_.front(), [&] { return write_report(first); });
    }
    if (!note.empty()) std::fprintf(stderr, "note: %s\n", note.c_str());
    fmt::print("{}\n", page.string());
  }

 private:
  std::vector<std::string> folders_;
};

}  // namespace

std::unique_ptr<Command> make_report_command(CLI::App& app) { return std::make_unique<ReportCommand>(app); }

}  // namespace tessera::replay
