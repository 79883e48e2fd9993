#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "base/error.h"
#include "base/json_text.h"
#include "base/output_file.h"
#include "base/text.h"
#include "replay/commands.h"
#include "replay/compare/comparison.h"
#include "replay/compare/image_comparison.h"
#include "replay/file_kind.h"
#include "replay/input_files.h"
#include "replay/progress.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

// Whether a file holds figures of a replay: a folder, or a file that begins like JSON.
bool is_run(const fs::path& file) {
  std::error_code ignored;
  if (fs::is_directory(file, ignored)) return true;
  std::ifstream stream(file, std::ios::binary);
  char first = 0;
  return stream >> first && first == '{';
}

class CompareCommand final : public Command {
 public:
  explicit CompareCommand(CLI::App& app) {
    app.add_option("A", files_,
                   "Compared runs or images, the first with all others: folders of replays, their stats.json, "
                   "files of `tessera time --json`; or images (.png, .jpg, .webp, .exr)")
        ->required()
        ->expected(1, -1)
        ->type_name("B...");
    app.add_option(
           "--frame", frame_numbers_,
           "Of replays: compare this frame of each; given once for each of them, in their order, or several times "
           "with one replay: its frames")
        ->type_name("N")
        ->check(CLI::NonNegativeNumber)
        ->allow_extra_args(false);
    CLI::Option* as_json = app.add_flag("--json", json_, "As JSON");
    app.add_flag("--csv", csv_, "As a CSV table: section, name, a column for each")->excludes(as_json);
    app.add_flag("--all", all_, "Show rows that are equal, too");
    app.add_option("--threshold", thresholds_,
                   "End with status 5 when a later one is worse than the first. METRIC is time, cycles, energy, "
                   "traffic or the name of a counter, and may grow by LIMIT percent; for images METRIC is flip "
                   "or max, at most LIMIT, or psnr or ssim, at least LIMIT. LIMIT alone is for time, energy and "
                   "traffic; repeatable")
        ->type_name("[METRIC=]LIMIT")
        ->allow_extra_args(false);
    app.add_flag("--no-images", no_images_, "Leave the images of replays alone");
    app.add_option("--flip-map", map_, "Write the FLIP error of two images as a heat map")->type_name("FILE.png");
    app.add_option("--mask", mask_,
                   "Measure only the pixels of two images that this one covers: pixels with an alpha above 0, "
                   "or, without alpha, pixels that are not black")
        ->type_name("FILE");
    app.footer(
        "Replays: why one is slower than the first: the changes, and where the cycles went; then "
        "time, cycles, energy and traffic of a\n"
        "frame, the critical path, units, bytes by purpose, drawables, counters, the keys that "
        "differ, and the images.\n"
        "Frames that all runs have are compared, and averaged. For two captures the figures that "
        "distinguish them come first: patches,\n"
        "triangles, layers, lights, textures, passes.\n"
        "Images: PSNR, mean SSIM and mean FLIP of the images as a display shows them (EXR files are "
        "tone mapped first); max is the largest\n"
        "difference of any channel in [0, 1]. FLIP assumes 67 pixels per degree of visual angle.\n"
        "\n"
        "Examples:\n"
        "  tessera compare out/before out/after\n"
        "  tessera compare out/before out/after --threshold time=2 --threshold flip=0.01   a gate "
        "for scripts\n"
        "  tessera compare out/run --frame 3 --frame 7          why one frame is slower than "
        "another\n"
        "  tessera compare a.png b.png --flip-map map.png");
  }

  void run() override {
    const std::vector<Threshold> thresholds = parse_thresholds(thresholds_);
    spread_frames();
    check_files();
    if (is_run(files_[0]))
      compare_replays(thresholds);
    else
      compare_image_files(thresholds);
  }

 private:
  // A single replay is repeated for each of several frames; a single frame applies to all replays.
  void spread_frames() {
    if (files_.size() == 1 && frame_numbers_.size() < 2)
      throw UsageError("compare: give two or more replays or images, or one replay and --frame twice");
    if (files_.size() == 1) files_.assign(frame_numbers_.size(), files_[0]);
    if (frame_numbers_.size() == 1) frame_numbers_.assign(files_.size(), frame_numbers_[0]);
    if (!frame_numbers_.empty() && frame_numbers_.size() != files_.size())
      throw UsageError(fmt::format("--frame: {} of them for {} replays", frame_numbers_.size(), files_.size()));
    if (!frame_numbers_.empty() && !is_run(files_[0])) throw UsageError("--frame: is for replays");
  }

  // All are of one kind, and options fit it.
  void check_files() const {
    const bool runs = is_run(files_[0]);
    for (const std::string& file : files_) {
      std::error_code ignored;
      if (!fs::exists(file, ignored)) throw InputError(file, "", "no such file or folder");
      if (is_run(file) == runs) continue;
      if (fs::is_directory(file, ignored) || fs::is_directory(files_[0], ignored))
        throw UsageError("compare: give images or replays, not both");
      throw InputError(file, "", runs ? "is no figures of a replay as the first is" : "is no image as the first is");
    }
    if (runs && !map_.empty()) throw UsageError("--flip-map: is for two images");
    if (runs && !mask_.empty()) throw UsageError("--mask: is for two images");
    if (!map_.empty() && files_.size() != 2) throw UsageError("--flip-map: is for two images");
    if (!map_.empty()) {
      check_output_file(map_);
      InputFiles inputs;
      for (const std::string& file : {files_[0], files_[1], mask_}) inputs.add(file);
      inputs.check(map_);
    }
    if (beside_outputs({map_}) != stdout) throw UsageError("--flip-map: standard output is for the figures");
  }

  void compare_replays(const std::vector<Threshold>& thresholds) const {
    Comparison comparison;
    json images = json::array();
    const std::vector<Threshold> of_runs = chosen(thresholds, false), of_images = chosen(thresholds, true);
    {
      const LongStep step("comparing", LongStep::quiet_without_terminal());
      comparison = compare_runs({files_.begin(), files_.end()}, frame_numbers_);
      if (!no_images_) images = frame_images(comparison);
    }
    if (!of_images.empty() && images.empty())
      throw UsageError(fmt::format("--threshold {}: there are no images to compare", of_images[0].metric));
    std::vector<std::string> broken = broken_thresholds(comparison, of_runs);
    for (const json& row : images)
      for (std::string& text :
           broken_by_image(row["run"].get<std::string>() + " " + row["frame"].get<std::string>(), row, of_images))
        broken.push_back(std::move(text));
    if (json_) {
      json report = comparison_json(comparison);
      report["frames"] = images;
      fmt::print("{}\n", json_text(report, 2));
    } else if (csv_) {
      fmt::print("{}", comparison_csv(comparison));
    } else {
      fmt::print("{}", comparison_text(comparison, all_));
      if (!images.empty()) fmt::print("\n{}", images_head());
      for (const json& row : images)
        fmt::print("{}", images_line(comparison.runs.size() > 2
                                         ? row["frame"].get<std::string>() + " " + row["run"].get<std::string>()
                                         : row["frame"].get<std::string>(),
                                     row));
    }
    end_with(broken);
  }

  // Compares the images of each folder among the runs with the first run's.
  json frame_images(Comparison& comparison) const {
    json rows = json::array();
    const auto folder = [](const fs::path& file) { return file.parent_path(); };
    for (std::size_t r = 1; r < comparison.runs.size(); ++r)
      for (json& row : compare_frames(folder(comparison.runs[0].file), folder(comparison.runs[r].file),
                                      comparison.labels[r], comparison.frames, comparison.notes))
        rows.push_back(std::move(row));
    return rows;
  }

  void compare_image_files(const std::vector<Threshold>& thresholds) const {
    if (const auto of_runs = chosen(thresholds, false); !of_runs.empty())
      throw UsageError(
          fmt::format("--threshold {}: images have flip, max, psnr and ssim", escape_control(of_runs[0].metric, 60)));
    json rows = json::array();
    std::vector<std::string> broken;
    {
      const LongStep step("comparing", LongStep::quiet_without_terminal());
      for (std::size_t b = 1; b < files_.size(); ++b) {
        rows.push_back(compare_images(files_[0], files_[b], map_, mask_));
        rows.back()["file"] = files_[b];
        for (std::string& text : broken_by_image(escape_control(files_[b], 120), rows.back(), thresholds))
          broken.push_back(std::move(text));
      }
    }
    if (json_) {
      fmt::print("{}\n", json_text(rows.size() == 1 ? rows[0] : json{{"images", rows}}, 2));
    } else if (csv_) {
      fmt::print("file,psnr_db,ssim,flip,max_difference\n");
      for (const json& row : rows)
        fmt::print("{},{},{},{},{}\n", row["file"].dump(-1, ' ', false, json::error_handler_t::replace),
                   row["psnr_db"].is_null() ? "" : row["psnr_db"].dump(), row["ssim"].dump(), row["flip"].dump(),
                   row["max_difference"].dump());
    } else {
      fmt::print("{}", images_head());
      for (const json& row : rows)
        fmt::print(
            "{}", images_line(
                      rows.size() == 1 ? "images" : fs::path(row["file"].get<std::string>()).filename().string(), row));
    }
    end_with(broken);
  }

  static std::vector<Threshold> chosen(const std::vector<Threshold>& all, bool of_images) {
    std::vector<Threshold> some;
    for (const Threshold& threshold : all)
      if (threshold.of_images() == of_images) some.push_back(threshold);
    return some;
  }

  // Status 5 where something is worse than allowed.
  static void end_with(const std::vector<std::string>& broken) {
    if (broken.empty()) return;
    throw EarlyEnd{ExitStatus::kDifferent,
                   fmt::format("tessera: {}{}", broken[0],
                               broken.size() > 1 ? fmt::format("; and {} more", broken.size() - 1) : "")};
  }

  std::vector<std::string> files_, thresholds_;
  std::string map_, mask_;
  std::vector<int> frame_numbers_;
  bool json_ = false, csv_ = false, all_ = false, no_images_ = false;
};

}  // namespace

std::unique_ptr<Command> make_compare_command(CLI::App& app) { return std::make_unique<CompareCommand>(app); }

}  // namespace tessera::replay
