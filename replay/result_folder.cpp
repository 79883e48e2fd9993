#include "replay/result_folder.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <string>

#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"

namespace tessera::replay {
namespace {

namespace fs = std::filesystem;

struct Mark {
  ResultKind kind;
  const char *name, *command;
};
constexpr Mark kMarks[] = {{ResultKind::kReplay, "stats.json", "replay"},
                           {ResultKind::kSweep, "sweep.json", "sweep"},
                           {ResultKind::kTradeoff, "tradeoff.json", "tradeoff"},
                           {ResultKind::kTradeoff, "reference", "tradeoff"}};

}  // namespace

void check_results_of(ResultKind kind, const fs::path& folder) {
  std::error_code ignored;
  for (const Mark& mark : kMarks)
    if (mark.kind != kind && fs::exists(folder / mark.name, ignored))
      throw UsageError(fmt::format("cannot write to {}: it holds the results of a {}; choose another --out",
                                   escape_control(folder.string()), mark.command));
}

std::vector<int> frames_left_in(const fs::path& folder) {
  std::ifstream stream(folder / "stats.csv");
  std::vector<int> frames;
  std::string line;
  std::getline(stream, line);
  if (!line.starts_with("frame,")) return frames;
  while (std::getline(stream, line)) {
    int frame = 0;
    const auto [end, fault] = std::from_chars(line.data(), line.data() + line.size(), frame);
    if (fault == std::errc() && frame >= 0 && end != line.data() + line.size() && *end == ',') frames.push_back(frame);
  }
  return frames;
}

void remove_earlier_results(const fs::path& folder, const std::vector<int>& earlier, const Written& written) {
  if (earlier.empty()) return;
  std::error_code ignored;
  const auto remove = [&](const std::string& name) {
    if (fs::is_regular_file(fs::symlink_status(folder / name, ignored))) fs::remove(folder / name, ignored);
  };
  for (const int frame : earlier) {
    const bool replaced = std::binary_search(written.frames.begin(), written.frames.end(), frame);
    for (const char* ending : {"exr", "png"}) {
      if (!replaced) remove(fmt::format("frame_{:04d}.{}", frame, ending));
      if (!replaced || !written.right_eye) remove(fmt::format("frame_{:04d}.right.{}", frame, ending));
    }
    if (!replaced) remove(fmt::format("tiles_{:04d}.json", frame));
  }
  if (!written.baselines) remove("baselines.csv");
  if (!written.report) remove("report.html");
}

}  // namespace tessera::replay
