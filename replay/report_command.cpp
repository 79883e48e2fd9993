#include <cstdio>
#include <filesystem>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "base/output_file.h"
#include "replay/commands.h"
#include "replay/file_kind.h"
#include "replay/progress.h"
#include "replay/report/report.h"

namespace tessera::replay {
namespace {

class ReportCommand final : public Command {
 public:
  explicit ReportCommand(CLI::App& app) {
    app.add_option("DIR", folder_, "What `tessera replay`, `tessera sweep` or `tessera tradeoff` wrote")
        ->required()
        ->type_name("DIR");
    app.footer(
        "Writes DIR/report.html: one file with images, maps, plots, tables and the configuration; it needs no "
        "network.\n"
        "For a sweep it joins what all shards have done so far and writes DIR/sweep.csv as well.");
  }

  void run() override {
    if (std::filesystem::is_directory(folder_)) check_output_folder(folder_, {"report.html", "sweep.csv"});
    std::string note;
    {
      const LongStep step("writing the report", LongStep::quiet_without_terminal());
      note = read_as(FileKind::kFolder, folder_, [&] { return write_report(folder_); });
    }
    if (!note.empty()) std::fprintf(stderr, "note: %s\n", note.c_str());
    fmt::print("{}\n", (std::filesystem::path(folder_) / "report.html").string());
  }

 private:
  std::string folder_;
};

}  // namespace

std::unique_ptr<Command> make_report_command(CLI::App& app) { return std::make_unique<ReportCommand>(app); }

}  // namespace tessera::replay
