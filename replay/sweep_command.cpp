#include <algorithm>
#include <cstdio>
#include <thread>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/output_file.h"
#include "base/parallel.h"
#include "replay/commands.h"
#include "replay/file_kind.h"
#include "replay/option_numbers.h"
#include "replay/output_lock.h"
#include "replay/progress.h"
#include "replay/report/report.h"
#include "replay/reproduction.h"
#include "replay/sweep/sweep_runner.h"

namespace tessera::replay {
namespace {

class SweepCommand final : public Command {
 public:
  explicit SweepCommand(CLI::App& app) {
    app.add_option("STUDY", study_, "The design space: a JSON file as docs/studies.md describes it")
        ->required()
        ->type_name("FILE");
    app.add_option("--out", out_, "Folder for the results; made when missing")->required()->type_name("DIR");
    app.add_option("--shard", shard_, "Render one part of N, counted from 0; `tessera report DIR` joins them")
        ->type_name("I/N");
    app.add_option("--threads", threads_, "Host threads (default: all). The result does not depend on it")
        ->type_name("N");
    app.add_option("--jobs", jobs_, "Most points at once; memory grows with it (default: one per thread)")
        ->type_name("N");
    app.add_option(
           "--max-memory", max_memory_gib_,
           "Most memory that a capture with a frame of it, and the images of all points at work, may take, in GiB")
        ->type_name("GIB")
        ->capture_default_str();
    add_strict_flag(app, strict_);
    app.add_option("--max-points", max_points_, "Refuse studies with more points")
        ->type_name("N")
        ->check(CLI::Range(1, 100000000))
        ->capture_default_str();
    app.add_flag("--quiet", quiet_, "No progress, no summary");
    app.footer(
        "Writes DIR/sweep.csv, a row per point and frame, and DIR/report.html; with \"split\" in the study also "
        "DIR/split.csv,\n"
        "a row per drawable, material or tile. Results are kept in DIR/points: stopped at any\n"
        "moment, killed included, the same command goes on where it was. Ctrl-C finishes the points in hand.\n\n"
        "Examples:\n"
        "  tessera sweep captures/studies/binning.json --out out/binning\n"
        "  tessera sweep study.json --out out/study --shard 0/4     one of four machines; see docs/cluster.md");
  }

  void run() override {
    const double gib = check_number("--max-memory", max_memory_gib_, 0, 1048576, true);
    SweepOptions options;
    options.strict = strict_;
    options.max_bytes = static_cast<std::uint64_t>(gib * 1073741824.0);
    options.quiet = quiet_;
    options.threads = threads_ > 0 ? threads_ : std::max(1u, std::thread::hardware_concurrency());
    options.jobs = jobs_ > 0 ? jobs_ : options.threads;
    read_shard(options);
    const ThreadLimit threads(options.threads);
    const Study study = read_as(FileKind::kStudy, study_, [&] { return read_study(study_, max_points_); });
    check_output_folder(
        out_, {"sweep.json", "sweep.csv", "split.csv", "report.html", "points/.lock", "points/*.json", "points/*.png"});
    repeat_failures_with(fmt::format("tessera sweep {}", study_));

    // From here on Ctrl-C leaves whole results, also while a large study is expanded.
    install_stop_handler();
    const std::vector<SweepPoint> points = expand_points(study, program_fingerprint());
    const OutputLock taken(out_, OutputLock::Share::kShared);  // from other commands
    const SweepFolder folder(out_);
    const SweepLock lock(folder, sharded());
    folder.write_manifest(study, points);
    const SweepOutcome outcome = run_sweep(study, points, folder, options);
    if (!sharded()) finish(folder);
    if (!quiet_) say_outcome(outcome, points);
    if (outcome.stopped)
      throw stopped(fmt::format("stopped: {} of {} points are done; the same command goes on",
                                outcome.found + outcome.rendered, outcome.mine));
  }

 private:
  // What joins the points; a shard leaves it to `tessera report`.
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

  void read_shard(SweepOptions& options) const {
    if (!sharded()) return;
    constexpr const char* kForm = "I/N with I < N, counted from 0";
    const std::vector<long> numbers = parse_whole_numbers("--shard", shard_, '/', 2, kForm);
    if (numbers[0] >= numbers[1]) throw UsageError(fmt::format("--shard {}: expected {}", shard_, kForm));
    options.shard = static_cast<std::size_t>(numbers[0]);
    options.shards = static_cast<std::size_t>(numbers[1]);
  }

  void say_outcome(const SweepOutcome& outcome, const std::vector<SweepPoint>& points) const {
    const double worked = outcome.seconds * static_cast<double>(outcome.workers);
    fmt::print("{} points: {} were there, {} rendered and {} timed from their records in {:.1f} s, {} at a time",
               outcome.mine, outcome.found, outcome.rendered - outcome.timed_again, outcome.timed_again,
               outcome.seconds, outcome.workers);
    if (outcome.rendered > 0)
      fmt::print("; {:.1f} % of it rendering, {:.2f} s reading captures", 100 * outcome.render_seconds / worked,
                 outcome.load_seconds);
    fmt::print("\n");
    if (const auto at_fault =
            std::count_if(points.begin(), points.end(), [](const SweepPoint& point) { return !point.fault.empty(); });
        at_fault > 0)
      fmt::print("{} points have values that do not fit each other; column 'status' says why\n", at_fault);
    if (sharded())
      fmt::print("once all shards are done: tessera report {}\n", out_);
    else
      fmt::print("results are in {}\n", (SweepFolder(out_).path() / "sweep.csv").string());
  }

  std::string study_, out_, shard_;
  unsigned threads_ = 0, jobs_ = 0;
  double max_memory_gib_ = 4;
  std::uint64_t max_points_ = 100000;
  bool quiet_ = false, strict_ = false;
};

}  // namespace

std::unique_ptr<Command> make_sweep_command(CLI::App& app) { return std::make_unique<SweepCommand>(app); }

}  // namespace tessera::replay
