#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "base/option_numbers.h"
#include "base/output_file.h"
#include "base/parallel.h"
#include "gpu/machine_model.h"
#include "gpu/record_file.h"
#include "gpu/tile_memory.h"
#include "gpu/unread_keys.h"
#include "replay/commands.h"
#include "replay/file_kind.h"
#include "replay/input_files.h"
#include "replay/machine_report.h"
#include "replay/sensitivity.h"
#include "replay/time_split.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

class TimeCommand final : public Command {
 public:
  explicit TimeCommand(CLI::App& app) {
    app.add_option("RECORD", record_, "A record from `tessera replay --record`")->required()->type_name("FILE");
    app.add_option("--gpu", gpu_,
                   fmt::format("The described machine: {} or a JSON file (default: the record's own)",
                               fmt::join(gpu::preset_names(), ", ")))
        ->type_name("PRESET|FILE");
    app.add_option("--set", sets_,
                   "Change a number of the machine, to a value or to a multiple of its own (KEY=x1.3); "
                   "repeatable")
        ->type_name("KEY=VALUE")
        ->allow_extra_args(false);
    app.add_flag("--sensitivity", sensitivity_,
                 "Time the first frame again with each number that timing reads at both ends of its plausible "
                 "range, and report its influence");
    app.add_option("--split", split_,
                   "Split the first frame's cycles, events and energy by drawables, materials or tiles: a table "
                   "of the ones with most, all of them with --json")
        ->type_name("drawables|materials|tiles");
    app.add_option("--json", json_, "Write cycles, units and energy of each frame and of all")->type_name("FILE");
    add_threads_option(app, threads_);
    add_memory_option(app, max_memory_gib_, "a frame of the record may take");
    app.footer(
        "Times the work of a replay again, on a machine that differs in speeds, sizes, memory and "
        "energies: in the keys\n"
        "that `tessera describe gpu` calls timing. Other keys change the work of the units, so that "
        "the frame must be rendered\n"
        "again; they are refused.\n"
        "\n"
        "Example:\n"
        "  tessera replay captures/eggs.glb --record eggs.record --out out\n"
        "  tessera time eggs.record --set shader.lanes=64 --set clock.mhz=600\n"
        "  tessera time eggs.record --set memory.type=lpddr5-6400  half as much bandwidth again");
  }

  void run() override {
    if (!json_.empty()) {
      check_output_file(json_);
      InputFiles inputs;
      inputs.add(record_);
      inputs.add(gpu_);
      inputs.check(json_);
    }
    std::optional<Split> split;
    if (!split_.empty()) split = parse_split("--split", split_);
    const std::uint64_t max_bytes = memory_bytes(max_memory_gib_);
    gpu::RecordReader record =
        read_as(FileKind::kRecord, record_, [&] { return gpu::RecordReader(record_, max_bytes); });
    gpu::RecordedMachine machine = gpu::recorded_machine(record.head(), record_);
    if (!gpu_.empty()) machine.gpu = read_as(FileKind::kMachine, gpu_, [&] { return gpu::load_gpu(gpu_); });
    for (const std::string& text : sets_) gpu::apply_setting(text, machine.settings, machine.gpu);
    gpu::check_gpu(machine.gpu);
    say_notes(gpu::configuration_notes(machine.gpu));
    const std::string notice =
        gpu::fit_tile_memory(machine.gpu, machine.settings, sets_key(sets_, "tilecore.memory_bytes"));
    if (!notice.empty()) std::fprintf(stderr, "note: %s\n", notice.c_str());
    gpu::check_same_function(record.head(), machine.gpu, machine.settings);
    const ThreadLimit threads(static_cast<std::size_t>(threads_));

    std::FILE* const words = beside_outputs({json_});
    fmt::print(words, "{:>6} {:>14} {:>10}  {:<14} {:<20} {:>12}\n", "frame", "cycles", "ms", "bound by",
               "longest on the path", "energy mJ");
    json frames = json::array();
    gpu::FrameCost total;
    json views = json::array();  // of the split, by eye
    std::vector<double> view_cycles;
    gpu::CachesOfFrames caches;
    std::optional<gpu::RecordedFrame> first;
    while (std::optional<gpu::RecordedFrame> frame = record.next()) {
      gpu::EachView each;
      if (split && frames.empty())
        each = [&](const timing::FrameWork& work, const gpu::ViewCost& cost, const timing::WarmCaches& before) {
          views.push_back(split_rows(*split, record.head(), machine.gpu, work, cost, before));
          view_cycles.push_back(cost.timing.cycles);
        };
      if (sensitivity_ && !first) first = *frame;
      const gpu::FrameCost cost =
          gpu::frame_cost(machine.gpu, frame->views, caches.of_frame(machine.gpu, frame->frame), each);
      frames.push_back({{"frame", frame->frame}, {"area", area_json(cost.area)}});
      put_model(machine.gpu, cost.timing, cost.energy, 1, frames.back());
      total.timing.accumulate(cost.timing);
      total.energy.accumulate(cost.energy);
      print_row(words, std::to_string(frame->frame), cost, machine.gpu);
    }
    if (frames.size() != 1) print_row(words, "all", total, machine.gpu);
    json sum = {{"area", area_json(machine.gpu.area())}};
    put_model(machine.gpu, total.timing, total.energy, static_cast<double>(frames.size()), sum);
    if (const std::string note = coarser_models_note(sum["timing"]); !note.empty()) fmt::print(words, "{}\n", note);
    json sensitivity;
    if (sensitivity_ && first) {
      const Sensitivity measured = measure_sensitivity(machine.gpu, first->views);
      print_sensitivity(words, measured);
      sensitivity = sensitivity_json(measured);
    }
    for (std::size_t view = 0; view < views.size(); ++view) print_split(words, *split, views[view], view_cycles[view]);
    if (json_.empty()) return;
    OutputFile file(json_);
    file.write(json_text({{"schema", "tessera.time/1"},
                          {"record", {{"capture", record.head().value("capture", json())}}},
                          {"gpu", gpu::gpu_json(machine.gpu)},
                          {"frames", frames},
                          {"sensitivity", sensitivity},
                          {"split", {{"by", split_}, {"views", views}}},
                          {"total", sum}},
                         1) +
               "\n");
    file.commit();
  }

 private:
  static void print_row(std::FILE* words, const std::string& frame, const gpu::FrameCost& cost,
                        const gpu::GpuConfiguration& gpu) {
    fmt::print(words, "{:>6} {:>14.0f} {:>10.3f}  {:<14} {:<20} {:>12.3f}\n", frame, std::ceil(cost.timing.cycles),
               cost.timing.cycles / gpu.clock_mhz * 1e-3, cost.timing.bound_by ? name(*cost.timing.bound_by) : "-",
               longest_on_path(cost.timing), cost.energy.total_nj() * 1e-6);
  }
  static std::string longest_on_path(const timing::FrameTiming& timing) {
    if (!timing.events || timing.cycles == 0) return "-";
    const auto& parts = timing.events->path.clk;
    const auto longest = std::max_element(parts.begin(), parts.end());
    return fmt::format("{} {:.0f} %", name(static_cast<timing::Bound>(longest - parts.begin())),
                       100 * *longest / timing.cycles);
  }

  std::string record_, gpu_, split_, json_;
  std::vector<std::string> sets_;
  unsigned threads_ = 0;
  double max_memory_gib_ = 4;
  bool sensitivity_ = false;
};

}  // namespace

std::unique_ptr<Command> make_time_command(CLI::App& app) { return std::make_unique<TimeCommand>(app); }

}  // namespace tessera::replay
