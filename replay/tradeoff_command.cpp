#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "base/error.h"
#include "base/option_numbers.h"
#include "base/output_file.h"
#include "base/parallel.h"
#include "base/text.h"
#include "gpu/unread_keys.h"
#include "replay/commands.h"
#include "replay/file_kind.h"
#include "replay/input_files.h"
#include "replay/output_lock.h"
#include "replay/progress.h"
#include "replay/report/report.h"
#include "replay/result_folder.h"
#include "replay/tradeoff/decisions.h"
#include "replay/tradeoff/effect_costs.h"
#include "replay/tradeoff/tradeoff.h"
#include "replay/tradeoff/tradeoff_files.h"
#include "replay/view_options.h"

namespace tessera::replay {
namespace {

namespace fs = std::filesystem;

// Knobs of --joint without a value: the ones with the largest trade.
constexpr const char* kUsualJoint = "samples,edge,shading";
// Knobs of a search, where no knobs are named.
constexpr const char* kSearchedKnobs = "samples,edge,shading,surface";

std::vector<std::string> listed_names(const std::string& text) {
  std::vector<std::string> names;
  std::stringstream stream(text);
  for (std::string name; std::getline(stream, name, ',');)
    if (!name.empty()) names.push_back(name);
  return names;
}

std::vector<std::string> knob_names() {
  std::vector<std::string> names;
  for (const Knob& knob : knobs()) names.push_back(knob.name);
  return names;
}

class TradeoffCommand final : public Command {
 public:
  explicit TradeoffCommand(CLI::App& app) {
    add_capture_argument(app, capture_);
    app.add_option("--out", out_, "Folder for the results; made when missing. Existing results are not computed again")
        ->required()
        ->type_name("DIR");
    app.add_option("--size", size_, "Size of the image")->type_name("WxH")->capture_default_str();
    app.add_option(
           "--frame", frame_,
           "The frame that is compared, counted from 0 (default: the last of a run from the capture's first frame on)")
        ->type_name("N");
    app.add_option("--run", run_,
                   "Frames of a run with history, which one frame leaves to the next; the last frame is compared")
        ->type_name("N")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    add_machine_options(app, gpu_, sets_, "Change the configuration from which all settings are varied; repeatable");
    app.add_option("--knobs", knobs_, fmt::format("Only these knobs: {}", fmt::join(knob_names(), ", ")))
        ->type_name("LIST");
    app.add_option(
           "--joint", joint_,
           fmt::format(
               "Turn these knobs together as well: all combinations of the settings on their own fronts; 'usual' is {}",
               kUsualJoint))
        ->type_name("LIST");
    app.add_option("--max-points", max_points_, "Refuse a joint search of more combinations")
        ->type_name("N")
        ->check(CLI::Range(1, 1000000))
        ->capture_default_str();
    app.add_flag("--effects", effects_,
                 "Instead of knobs: measure the cost of each effect of the frame, and the change of the image "
                 "without it; each effect is left out in turn, and no reference is rendered");
    app.add_option(
           "--max-flip", max_flip_,
           fmt::format("Find the cheapest setting whose mean FLIP error is at most this: combinations of {}, or "
                       "of --knobs, are searched",
                       kSearchedKnobs))
        ->type_name("X");
    app.add_option("--min-psnr", min_psnr_, "The same for a PSNR of at least this")->type_name("DB");
    app.add_option("--cost", cost_,
                   fmt::format("Cost that --max-flip and --min-psnr minimise: {}", fmt::join(kCostNames, ", ")))
        ->type_name("COST")
        ->capture_default_str();
    app.add_option("--rounds", rounds_,
                   "Times that everything is run; host times are medians (default: 3; 1 for --max-flip and --min-psnr)")
        ->type_name("N")
        ->check(CLI::Range(1, 1000));
    app.add_option("--reference-samples", samples_,
                   "Most samples per pixel of the reference: plain random numbers, all shaded, in double precision")
        ->type_name("N")
        ->check(CLI::Range(1, 1 << 20))
        ->capture_default_str();
    app.add_option("--reference-noise", noise_,
                   "The reference takes no more samples once its own noise, as PSNR of displayed values, is at least "
                   "this; 0: it takes all")
        ->type_name("DB")
        ->capture_default_str();
    app.add_option("--reference-edge", edge_,
                   "Wanted length of the sides of the reference's cells on screen, in pixels; 0: the machine's "
                   "own grids, so that errors are errors of everything but tessellation")
        ->type_name("PIXELS")
        ->capture_default_str();
    app.add_option("--reference-folder", kept_references_,
                   "Folder of references that are kept for all programs: read there while scene and shaders are "
                   "unchanged, else rendered and written there, in half precision")
        ->type_name("DIR");
    add_threads_option(app, threads_);
    add_memory_option(app, max_memory_gib_);
    add_strict_flag(app, strict_);
    add_variant_option(app, variant_);
    add_view_options(app, view_, kViewGroup);
    add_shutter_option(app, view_.shutter, kViewGroup);
    app.add_flag("--all", all_, "Also show settings that others beat, and the costs of each in words");
    app.add_flag("--quiet", quiet_, "No progress, no table");
    app.footer(
        "Measures the cost of accuracy: varies every knob that buys accuracy, one at a time, and "
        "shows each setting's error against\n"
        "a converged reference (PSNR, SSIM, FLIP, largest difference, as a display shows the images) "
        "beside its time in ms, memory\n"
        "traffic, energy and the host's time (median and spread of --rounds; CPU is processor time "
        "of all threads).\n"
        "Knobs of timing (timing, memory_model, shader_costs, warps, requests) time one record of "
        "the frame by coarser models:\n"
        "cycles and energy against the finest (machine.timing=events, memory.model=banks, "
        "shader.costs=compiled), host times\n"
        "of the timing alone. Registers that warps adds are an idealisation: they take no silicon.\n"
        "The table shows the settings that no other beats in FLIP and ms, and the one asked for; "
        "--all shows all, as the files\n"
        "and the page do.\n"
        "Writes tradeoff.json, tradeoff.csv and report.html. Killed at any moment, the same command "
        "goes on.\n"
        "\n"
        "Examples:\n"
        "  tessera tradeoff captures/eggs.glb --out out/accuracy\n"
        "  tessera tradeoff captures/eggs.glb --out out/effects --effects       the cost of each "
        "effect of the scene\n"
        "  tessera tradeoff captures/eggs.glb --out out/accuracy --joint samples,edge,shading\n"
        "  tessera tradeoff captures/eggs.glb --out out/accuracy --min-psnr 35   the cheapest "
        "combination at 35 dB");
  }

  void run() override {
    const ThreadLimit threads(static_cast<std::size_t>(threads_));
    TradeoffOptions options = read_options();
    if (max_flip_) check_number("--max-flip", *max_flip_, 0, 1);
    if (min_psnr_) check_number("--min-psnr", *min_psnr_, 0, 1000);
    const CheapestWanted wanted{read_cost(), max_flip_, min_psnr_};
    const bool asks = max_flip_ || min_psnr_;
    if (effects_ && (asks || !knobs_.empty() || !joint_.empty()))
      throw UsageError("--effects leaves effects out, one at a time; it turns no knobs");
    options.effects = effects_;
    if (asks && options.joint.empty()) {
      options.search = wanted;
      if (options.knobs.empty()) options.knobs = listed_names(kSearchedKnobs);
    }
    const std::vector<std::string> results = {"tradeoff.json",    "tradeoff.csv",    "effects.csv",  "report.html",
                                              "reference/*.json", "reference/*.exr", "points/*.json"};
    InputFiles inputs;
    inputs.add_capture(capture_);
    inputs.add(gpu_);
    inputs.check_folder(out_, results);
    check_output_folder(out_, results);
    check_results_of(ResultKind::kTradeoff, out_);
    repeat_failures_with(
        fmt::format("tessera tradeoff {}{}{}", capture_, variant_argument(variant_), view_arguments(view_)));
    install_stop_handler();
    const OutputLock lock(out_);
    const TradeoffResult result = run_tradeoff(options);
    std::optional<CheapestAnswer> answer;
    if (asks) answer = {wanted, cheapest(result.knobs, wanted), nearest_miss(result.knobs, wanted)};
    write_tradeoff(out_, result, answer);
    if (const std::string missing = missing_for_reports(); missing.empty())
      write_report(out_);
    else if (!quiet_)
      std::fprintf(stderr, "note: no report.html: %s\n", missing.c_str());
    // A question without more is answered in a few lines.
    if (!quiet_ && (!answer || !knobs_.empty() || !joint_.empty())) say(result, all_);
    if (answer) fmt::print("{}", cheapest_text(result, *answer));
    if (!quiet_) fmt::print("results are in {}\n", (fs::path(out_) / "tradeoff.csv").string());
    if (result.stopped) throw stopped("stopped; the same command goes on from here");
  }

 private:
  Cost read_cost() const {
    const auto found = std::find(kCostNames.begin(), kCostNames.end(), cost_);
    if (found == kCostNames.end())
      throw UsageError(fmt::format("--cost {}: expected {}", escape_control(cost_, 80), fmt::join(kCostNames, ", ")));
    return kCosts[static_cast<std::size_t>(found - kCostNames.begin())];
  }

  TradeoffOptions read_options() const {
    TradeoffOptions options;
    options.capture = capture_;
    options.folder = out_;
    options.gpu_name = gpu_;
    options.gpu = read_as(FileKind::kMachine, gpu_, [&] { return gpu::load_gpu(gpu_); });
    for (const std::string& text : sets_) {
      apply_setting(text, options.settings, options.gpu);
      options.base.emplace_back(text.substr(0, text.find('=')), text.substr(text.find('=') + 1));
    }
    gpu::check_gpu(options.gpu);
    if (!quiet_) say_notes(gpu::configuration_notes(options.gpu));
    const ImageSize size = parse_size("--size", size_);
    options.width = size.width;
    options.height = size.height;
    if (frame_) options.frame = static_cast<int>(check_number("--frame", *frame_, 0, 1e8));
    options.run = run_;
    options.rounds = rounds_.value_or(max_flip_ || min_psnr_ ? 1 : 3);
    options.reference_samples = samples_;
    options.reference_enough_db = check_number("--reference-noise", noise_, 0, 1000);
    options.reference_edge_pixels = edge_ == 0 ? 0.0 : check_number("--reference-edge", edge_, 0.25, 64);
    options.kept_references = kept_references_;
    options.knobs = listed_names(knobs_);
    options.joint = listed_names(joint_ == "usual" ? kUsualJoint : joint_);
    options.max_points = static_cast<std::size_t>(max_points_);
    options.strict = strict_;
    options.variant = variant_;
    view_.check();
    options.view = view_;
    options.max_bytes = memory_bytes(max_memory_gib_);
    options.quiet = quiet_;
    return options;
  }

  static void say_reference(const reference::ReferenceInfo& reference) {
    fmt::print(
        "; reference: {} samples per pixel{}, {}, {} triangles", reference.samples,
        reference.samples < reference.asked_samples ? fmt::format(" of {}", reference.asked_samples) : "",
        reference.edge_pixels == 0 ? "the machine's own grids" : fmt::format("cells of {} px", reference.edge_pixels),
        reference.triangles);
    if (reference.psnr_db) fmt::print(", its own noise {:.1f} dB", *reference.psnr_db);
    if (reference.convergence.slope) fmt::print(", error falls as samples^{:.3f}", *reference.convergence.slope);
  }

  static void say(const TradeoffResult& result, bool all) {
    fmt::print("{} frame {}, {}x{}", result.capture, result.frame, result.width, result.height);
    if (result.reference) say_reference(*result.reference);
    if (!result.effects.empty() && !result.knobs.empty())
      fmt::print("\n{}", effects_table(result.effects, result.knobs.front()));
    else
      fmt::print("\n{}", tradeoff_table(result, all));
  }

  std::string kept_references_, capture_, out_, size_ = "640x360", gpu_ = "mid-mobile", knobs_, joint_, cost_ = "ms";
  std::vector<std::string> sets_;
  std::optional<double> frame_, max_flip_, min_psnr_;
  std::optional<std::string> variant_;
  ViewChoices view_;
  std::optional<int> rounds_;
  int run_ = 6, samples_ = 1024, max_points_ = 400;
  double noise_ = TradeoffOptions().reference_enough_db, edge_ = 1.0, max_memory_gib_ = 4;
  unsigned threads_ = 0;
  bool quiet_ = false, strict_ = false, effects_ = false, all_ = false;
};

}  // namespace

std::unique_ptr<Command> make_tradeoff_command(CLI::App& app) { return std::make_unique<TradeoffCommand>(app); }

}  // namespace tessera::replay
