#include <algorithm>
#include <cstdio>
#include <optional>
#include <thread>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/option_numbers.h"
#include "base/output_file.h"
#include "base/parallel.h"
#include "base/text.h"
#include "gpu/presets.h"
#include "replay/commands.h"
#include "replay/file_kind.h"
#include "replay/input_files.h"
#include "replay/output_lock.h"
#include "replay/progress.h"
#include "replay/report/report.h"
#include "replay/result_folder.h"
#include "replay/sweep/goal.h"
#include "replay/sweep/search.h"
#include "replay/sweep/sweep_estimate.h"
#include "replay/sweep/sweep_runner.h"

namespace tessera::replay {
namespace {

namespace fs = std::filesystem;

class SweepCommand final : public Command {
 public:
  explicit SweepCommand(CLI::App& app) {
    app.add_option(
           "STUDY", study_,
           "The design space: a JSON file as docs/studies.md describes it. With --gpu, --fps or --watts a capture "
           "instead: which of some machines holds a frame rate?")
        ->required()
        ->type_name("FILE");
    constexpr const char* kMachines = "Machines for a capture";
    app.add_option("--gpu", gpus_, "A machine to try, a preset or a file; repeatable (default: all presets)")
        ->type_name("NAME|FILE")
        ->group(kMachines);
    app.add_option("--fps", fps_, "Frames a second that the machine has to hold (default 60)")
        ->type_name("N")
        ->check(CLI::Range(0.01, 10000.0))
        ->group(kMachines);
    app.add_option("--watts", watts_, "Watts that it may take at that rate (default: any)")
        ->type_name("W")
        ->check(CLI::PositiveNumber)
        ->group(kMachines);
    app.add_option("--frames", frames_, "Frames to try, B not included (default: the capture's)")
        ->type_name("A:B")
        ->group(kMachines);
    app.add_option("--size", size_, "Size of the image (default: the capture's, else 1280x720)")
        ->type_name("WxH")
        ->group(kMachines);
    app.add_option("--out", out_, "Folder for the results; made when missing")->required()->type_name("DIR");
    app.add_option("--shard", shard_, "Render one part of N, counted from 0; `tessera report DIR` joins them")
        ->type_name("I/N");
    app.add_flag("--dry-run", dry_run_,
                 "Report how many points would be rendered, how many timed from their records, and how long "
                 "it would take, measured on a frame of each capture; write nothing");
    add_threads_option(app, threads_);
    app.add_option("--jobs", jobs_, "Most points at once; memory grows with it (default: one per thread)")
        ->type_name("N");
    add_memory_option(app, max_memory_gib_,
                      "a capture with a frame of it, and the images of all points at work, may take");
    add_strict_flag(app, strict_);
    app.add_option("--max-points", max_points_, "Refuse studies with more points")
        ->type_name("N")
        ->check(CLI::Range(1, 100000000))
        ->capture_default_str();
    app.add_flag("--quiet", quiet_, "No progress, no summary");
    app.footer(
        "Writes DIR/sweep.csv, a row per point and frame, and DIR/report.html; with \"split\" in the "
        "study also DIR/split.csv,\n"
        "a row per drawable, material or tile. Results are kept in DIR/points: stopped at any\n"
        "moment, killed included, the same command goes on where it was. Ctrl-C finishes the current "
        "points.\n"
        "\n"
        "Examples:\n"
        "  tessera sweep captures/studies/binning.json --out out/binning\n"
        "  tessera sweep study.json --out out/study --shard 0/4     one of four machines; see "
        "docs/studies.md\n"
        "  tessera sweep model.glb --fps 60 --watts 1 --out out/machines     which preset holds it?");
  }

  void run() override {
    SweepOptions options;
    options.strict = strict_;
    options.max_bytes = memory_bytes(max_memory_gib_);
    options.quiet = quiet_;
    options.threads = threads_ > 0 ? threads_ : std::max(1u, std::thread::hardware_concurrency());
    options.jobs = jobs_ > 0 ? jobs_ : options.threads;
    read_shard();
    const ThreadLimit threads(options.threads);
    Study study = for_capture() ? parse_study(machines_study(), study_, max_points_)
                                : read_as(FileKind::kStudy, study_, [&] { return read_study(study_, max_points_); });
    if (!quiet_) say_notes(study.key_notes);
    if (study.searches() && sharded())
      throw UsageError(
          "--shard: a search goes from generation to generation: run it as a whole; --jobs renders several "
          "points at once");
    if (!dry_run_) check_results(study);
    repeat_failures_with(fmt::format("tessera sweep {}", study_));

    // From here on Ctrl-C leaves complete results, even while a large study is expanded.
    install_stop_handler();
    CaptureLibrary library(study.captures, options.max_bytes, options.strict, study.variant, study.view, study.size);
    const SweepFolder folder(out_);
    if (dry_run_) return say_estimate(study, folder, options, library);
    const OutputLock taken(out_, OutputLock::Share::kShared);  // from other commands
    const SweepLock lock(folder, sharded());
    const SweepOutcome outcome = make_points(study, folder, options, library);
    if (!sharded()) finish(folder);
    if (!quiet_) say_outcome(outcome, library.load_seconds(), folder);
    if (outcome.stopped)
      throw stopped(fmt::format("stopped: {} of {} points are done; the same command goes on",
                                outcome.found + outcome.made, outcome.mine));
  }

 private:
  bool for_capture() const {
    if (!gpus_.empty() || fps_ || watts_) return true;
    if (!frames_.empty() || !size_.empty())
      throw UsageError("--frames and --size are for a capture, with --gpu, --fps or --watts; a study has its own");
    return false;
  }

  // The smallest of some machines that holds a frame rate on a capture, within some power.
  nlohmann::json machines_study() const {
    std::error_code ignored;
    if (!fs::is_regular_file(study_, ignored)) throw InputError(study_, "", "no such file");
    const double fps = fps_.value_or(60);
    std::vector<std::string> machines;
    for (const std::string& gpu : gpus_)
      machines.push_back(gpu::find_preset(gpu) != nullptr ? gpu : fs::absolute(gpu).string());
    if (machines.empty())
      for (const gpu::Preset& preset : gpu::presets()) machines.emplace_back(preset.name);
    nlohmann::json study = {
        {"title", fmt::format("Which machine holds {:g} frames/s{}?", fps,
                              watts_ ? fmt::format(" within {:g} W", *watts_) : std::string())},
        {"captures", {fs::path(study_).filename().string()}},
        {"settings", {{"machine.target_fps", fps}}},
        {"axes", {{{"key", "gpu"}, {"values", machines}}}},
        {"goal", {{"minimise", "area.total_mm2"}, {"subject_to", {{"timing.time_ms", {{"at_most", 1000 / fps}}}}}}}};
    study["goal"]["subject_to"]["energy.power_w"] = {{watts_ ? "at_most" : "at_least", watts_.value_or(0)}};
    if (!frames_.empty()) study["frames"] = frames_;
    if (!size_.empty()) study["size"] = size_;
    return study;
  }

  void check_results(const Study& study) const {
    const std::vector<std::string> results = {"sweep.json",   "sweep.csv",     "split.csv",    "report.html",
                                              "points/.lock", "points/*.json", "points/*.png", "records/*.record"};
    InputFiles inputs;
    inputs.add(study_);
    for (const fs::path& capture : study.captures) inputs.add_capture(capture);
    for (const fs::path& machine : machine_files(study)) inputs.add(machine);
    inputs.check_folder(out_, results);
    check_output_folder(out_, results);
    check_results_of(ResultKind::kSweep, out_);
  }

  SweepOutcome make_points(Study& study, const SweepFolder& folder, const SweepOptions& options,
                           CaptureLibrary& library) const {
    const std::string program = program_fingerprint();
    if (!study.searches()) {
      const std::vector<SweepPoint> points = expand_points(study, program);
      folder.write_manifest(study, points);
      return run_sweep(study, points, points_of_shard(points, shard_index_, shards_), folder, options, library);
    }
    const auto write = [&](const std::vector<SweepPoint>& points) { folder.write_manifest(study, points); };
    return run_search(study, program, folder, options, library, write).outcome;
  }

  // Joins the points and writes the report; a shard leaves that to `tessera report`.
  void finish(const SweepFolder& folder) const {
    const std::string missing = missing_for_reports();
    if (missing.empty()) {
      write_report(folder.path());
      return;
    }
    write_tables(folder, join_sweep(folder));
    if (!quiet_) std::fprintf(stderr, "note: no report.html: %s\n", missing.c_str());
  }

  bool sharded() const { return !shard_.empty(); }

  void read_shard() {
    if (!sharded()) return;
    constexpr const char* kForm = "I/N with I < N, counted from 0";
    const std::vector<long> numbers = parse_whole_numbers("--shard", shard_, '/', 2, kForm);
    if (numbers[0] >= numbers[1]) throw UsageError(fmt::format("--shard {}: expected {}", shard_, kForm));
    shard_index_ = static_cast<std::size_t>(numbers[0]);
    shards_ = static_cast<std::size_t>(numbers[1]);
  }

  void say_estimate(Study& study, const SweepFolder& folder, const SweepOptions& options,
                    CaptureLibrary& library) const {
    const std::string program = program_fingerprint();
    const std::vector<SweepPoint> points =
        study.searches() ? expected_points(study, program) : expand_points(study, program);
    const SweepEstimate estimate =
        estimate_sweep(study, points, points_of_shard(points, shard_index_, shards_), folder, options, library);
    fmt::print(
        "{}{} points: {} are there, {} to render and {} to time from their records{}\n",
        study.searches() ? "at most " : "", estimate.points, estimate.found, estimate.renders, estimate.timings,
        estimate.refused == 0 ? "" : fmt::format(", {} with values that do not fit each other", estimate.refused));
    if (study.searches()) fmt::print("a search finds out which: these are of a Latin hypercube of as many\n");
    if (estimate.renders > 0)
      fmt::print(
          "about {:.1f} s, {} at a time: a frame renders in {:.3f} s and is timed in {:.3f} s, measured on the "
          "first one of each capture\n",
          estimate.seconds, estimate.workers, estimate.render_seconds, estimate.timing_seconds);
  }

  // Prints the candidates that a goal ranks first, with its columns, and the winner; without a goal only the best.
  static void say_candidates(const JoinedSweep& sweep) {
    constexpr std::size_t kShown = 10;
    const std::vector<Candidate> candidates = rank_candidates(sweep);
    if (candidates.empty()) return;
    const Goal goal = goal_of(sweep.manifest);
    if (sweep.manifest.contains("goal")) {
      fmt::print("{:<40}", "");
      for (const std::string& column : goal_columns(goal)) fmt::print(" {:>24}", column);
      fmt::print("\n");
      for (std::size_t k = 0; k < std::min(kShown, candidates.size()); ++k) {
        fmt::print("{:<40}", escape_control(candidates[k].label, 40));
        for (const double value : candidates[k].values) fmt::print(" {:>24.5g}", value);
        fmt::print("  {}\n", candidates[k].meets_limits() ? "meets the limits" : "misses them");
      }
      if (candidates.size() > kShown) fmt::print("... {} more in sweep.csv\n", candidates.size() - kShown);
    }
    const Candidate& best = candidates[0];
    fmt::print("best{}: {} at point {}{}\n", best.meets_limits() ? "" : " (none meets the limits)",
               objective_text(goal, best.score), best.point, best.label.empty() ? "" : ": " + best.label);
  }

  void say_outcome(const SweepOutcome& outcome, double load_seconds, const SweepFolder& folder) const {
    fmt::print("{} points: {} were there, {} rendered and {} timed from their records in {:.1f} s, {} at a time",
               outcome.mine, outcome.found, outcome.rendered, outcome.timed, outcome.seconds, outcome.workers);
    const double worked = outcome.seconds * static_cast<double>(outcome.workers);
    if (outcome.rendered > 0)
      fmt::print("; {:.1f} % of it rendering, {:.2f} s reading captures", 100 * outcome.render_seconds / worked,
                 load_seconds);
    fmt::print("\n");
    if (sharded()) {
      fmt::print("once all shards are done: tessera report {}\n", out_);
      return;
    }
    const JoinedSweep sweep = join_sweep(folder);
    if (const auto at_fault = std::count_if(sweep.rows.begin(), sweep.rows.end(),
                                            [](const SweepRow& row) { return row.frame.is_null(); });
        at_fault > 0)
      fmt::print("{} points have values that do not fit each other; column 'status' says why\n", at_fault);
    say_candidates(sweep);
    fmt::print("results are in {}\n", (folder.path() / "sweep.csv").string());
  }

  std::string study_, out_, shard_, frames_, size_;
  std::vector<std::string> gpus_;
  std::optional<double> fps_, watts_;
  unsigned threads_ = 0, jobs_ = 0;
  double max_memory_gib_ = 4;
  std::uint64_t max_points_ = 100000;
  std::size_t shard_index_ = 0, shards_ = 1;
  bool quiet_ = false, strict_ = false, dry_run_ = false;
};

}  // namespace

std::unique_ptr<Command> make_sweep_command(CLI::App& app) { return std::make_unique<SweepCommand>(app); }

}  // namespace tessera::replay
