#include <algorithm>
#include <bit>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/option_numbers.h"
#include "base/output_file.h"
#include "base/parallel.h"
#include "base/text.h"
#include "baselines/baseline_set.h"
#include "gpu/device.h"
#include "gpu/frame_graph.h"
#include "gpu/frame_stream.h"
#include "gpu/image_bytes.h"
#include "gpu/record_file.h"
#include "gpu/shading_paths.h"
#include "gpu/tile_memory.h"
#include "gpu/timeline.h"
#include "gpu/unread_keys.h"
#include "hardware/external_memory.h"
#include "replay/commands.h"
#include "replay/file_kind.h"
#include "replay/frame_costs.h"
#include "replay/frame_files.h"
#include "replay/input_files.h"
#include "replay/left_out.h"
#include "replay/output_lock.h"
#include "replay/pixel_history.h"
#include "replay/progress.h"
#include "replay/report/report.h"
#include "replay/result_folder.h"
#include "replay/sensitivity.h"
#include "replay/statistics.h"
#include "replay/view_options.h"
#include "scene/framing.h"

namespace tessera::replay {
namespace {

namespace fs = std::filesystem;

// Progress of the current frames. A second pass and partial renders visit tiles again.
StepProgress tiles_done(std::span<gpu::Device* const> devices) {
  std::size_t done = 0, tiles = 0;
  for (const gpu::Device* device : devices) done += device->progress().done(), tiles += device->progress().tiles();
  if (tiles == 0) return {"between tiles"};
  return {fmt::format("{} of {} tiles", done, tiles),
          std::min(1.0, static_cast<double>(done) / static_cast<double>(tiles))};
}

class ReplayCommand final : public Command {
 public:
  explicit ReplayCommand(CLI::App& app) {
    add_capture_argument(app, capture_);
    app.add_option("--frames", frames_,
                   "Frames to render, counted from 0, B not included (default: the capture's range, else 0:1)")
        ->type_name("A:B");
    app.add_option("--size", size_, "Size of the image (default: the capture's, else 1280x720)")->type_name("WxH");
    app.add_option("--spp", spp_, "Visibility samples per pixel, 1 to 64 (default 4)")->type_name("N");
    add_machine_options(app, gpu_, sets_,
                        "Change a setting or a number of the machine; repeatable. `tessera describe settings` and "
                        "`tessera describe gpu` list the keys");
    add_threads_option(app, threads_);
    app.add_option("--seed", seed_, "Chooses among equally good sample patterns (default 0)")->type_name("N");
    app.add_option("--region", region_, "Render only these pixels of the frame")->type_name("X,Y,W,H");
    app.add_option("--out", out_, "Folder for the results; made when missing")->type_name("DIR")->capture_default_str();
    app.add_option("--aux", aux_,
                   fmt::format("Auxiliary layers for the EXR files: {}", fmt::join(auxiliary_layers(), ", ")))
        ->type_name("LIST")
        ->delimiter(',');
    app.add_option(
           "--warmup", warmup_,
           "With resolve.desampling=adaptive or temporal antialiasing: render so many frames before the first one "
           "without writing them, so that it has a history")
        ->type_name("N");
    app.add_option("--history", history_, "Go on from the history that a replay left of the frame before the first one")
        ->type_name("FILE");
    app.add_option("--save-history", save_history_, "Write the history that the last frame leaves")->type_name("FILE");
    add_memory_option(app, max_memory_gib_);
    add_strict_flag(app, strict_);
    add_variant_option(app, variant_);
    add_view_options(app, view_, kViewGroup);
    add_shutter_option(app, view_.shutter, kViewGroup);
    app.add_option("--trace", trace_,
                   "Write the activity of each unit over time, for Perfetto, with the render stages of each "
                   "pass (Binning, LoadColor, LoadDepth, Render, StoreColor, StoreDepth): JSON, or protobuf "
                   "where FILE ends in .pftrace")
        ->type_name("FILE");
    app.add_option("--trace-frames", trace_frames_,
                   "Frames that --trace and --dram-trace hold, B not included (default: all)")
        ->type_name("A:B");
    app.add_option("--trace-tiles", trace_tiles_,
                   "Numbers of the tiles that --trace shows, row by row, B not included (default: all)")
        ->type_name("A:B");
    app.add_option(
           "--dram-trace", dram_trace_,
           "Write every transaction that the memory is asked for with its clock, as DRAMsim3 and drivers of "
           "Ramulator 2 read it, and FILE.json, which describes it to tessera dram; FILE.loadstore: as Ramulator "
           "2's LoadStoreTrace does, without time")
        ->type_name("FILE");
    app.add_option("--record", record_,
                   "Write a record of the units' work in each frame, to be timed on other machines: tessera "
                   "time FILE")
        ->type_name("FILE");
    app.add_option("--dram-clock", dram_clock_mhz_,
                   "Clock of the cycles in --dram-trace, in MHz (default: the clock of memory.type)")
        ->type_name("MHZ");
    app.add_option("--dram-transaction", dram_transaction_,
                   "Bytes that a line of --dram-trace moves: a power of two from a burst to 1024 (default: a burst of "
                   "the memory)")
        ->type_name("BYTES");
    app.add_flag("--baselines", baselines_,
                 "Run other ways to bin the same frames as well, pass by pass, and report which one wins by how much: "
                 "patches whole, triangles with vertices, positions or references, no bins at all");
    app.add_flag("--sensitivity", sensitivity_,
                 "Time the first frame again with each number that timing reads at both ends of its plausible "
                 "range, and report its influence; in stats.json as well");
    app.add_option("--without", without_,
                   "Render and time the first frame again without each drawable, material and effect, the N "
                   "with most cycles of each kind or all; reports the savings, in stats.json and report.html as "
                   "well")
        ->type_name("N|all");
    app.add_flag("--no-report", no_report_, "Do not write report.html");
    app.add_flag("--quiet", quiet_, "No progress, no summary");
    app.footer(
        "Writes frame_NNNN.exr (linear light), frame_NNNN.png, tiles_NNNN.json (work of each tile), "
        "stats.json and\n"
        "stats.csv (one row per frame), report.html (all of it on one page; needs Vega 5);\n"
        "with --baselines also baselines.csv (one row per frame and scheme).\n"
        "--trace, --dram-trace, --record and --save-history write a FIFO, a device or /dev/fd/N "
        "through as bytes come; a file\n"
        "appears whole, in a folder that must be there.\n"
        "Ctrl-C finishes the current frame and writes the statistics of the finished frames; so does "
        "a full disk.\n"
        "\n"
        "Examples:\n"
        "  tessera replay captures/eggs.glb --out out\n"
        "  tessera replay model.gltf --frames 0:48 --size 640x360 --spp 16 --set tile.width=16 --set "
        "tile.height=16");
  }

  void run() override {
    if (out_.empty()) throw UsageError("--out '': expected the name of a folder");
    const InputFiles inputs = input_files();
    check_named_outputs(inputs);
    inputs.check_folder(out_, results_);
    check_results_of(ResultKind::kReplay, out_);
    gpu::RunSettings settings;
    gpu::GpuConfiguration gpu = read_as(FileKind::kMachine, gpu_, [&] { return gpu::load_gpu(gpu_); });
    for (const std::string& text : sets_) gpu::apply_setting(text, settings, gpu);
    if (spp_) gpu::settings_keys().set(settings, *gpu::settings_keys().find("sampling.samples_per_pixel"), *spp_);
    if (seed_) gpu::settings_keys().set(settings, *gpu::settings_keys().find("sampling.seed"), *seed_);
    gpu::check_gpu(gpu);
    if (!quiet_) say_notes(gpu::configuration_notes(gpu));
    for (const std::string& layer : aux_)
      if (std::find(auxiliary_layers().begin(), auxiliary_layers().end(), layer) == auxiliary_layers().end())
        throw UsageError(
            fmt::format("--aux {}: layers are {}", escape_control(layer, 40), fmt::join(auxiliary_layers(), ", ")));
    const std::size_t left_out = without_.empty() ? 0 : parse_left_out(without_);
    const ThreadLimit threads(static_cast<std::size_t>(threads_));

    scene::CaptureLimits limits;
    limits.max_bytes = memory_bytes(max_memory_gib_);
    limits.strict = strict_;
    limits.variant = variant_;
    std::optional<LongStep> step(std::in_place, "reading " + escape_control(capture_), quiet_);
    const scene::Capture capture = read_capture(capture_, limits, view_, chosen_size());
    step.reset();
    settings = gpu::follow_passes(capture, settings);
    const std::string notice = gpu::fit_tile_memory(gpu, settings, sets_key(sets_, "tilecore.memory_bytes"));
    if (!quiet_ && !notice.empty()) std::fprintf(stderr, "note: %s\n", notice.c_str());
    const auto [first, last] = frame_range(capture);
    const gpu::RenderRequest request = render_request(capture, settings, gpu, limits.max_bytes, last - first > 1);
    repeat_failures_with(
        fmt::format("tessera replay {}{}{}", capture_, variant_argument(variant_), view_arguments(view_)));
    check_output_folder(out_, results_);

    step.emplace("assembling base patches", quiet_);
    const auto prepared = std::make_shared<const gpu::PreparedCapture>(capture);
    gpu::Device renderer(prepared, gpu, settings, request);
    const double assemble_seconds = step->seconds();
    step.reset();
    baselines::BaselineObserver schemes;
    if (baselines_) renderer.set_observer(&schemes);
    say_notices(capture, renderer);
    const std::string still = note_of_still_frames(capture, {first, last});
    if (!quiet_ && !still.empty()) std::fprintf(stderr, "note: %s\n", still.c_str());
    const std::optional<tilecore::History> history = earlier_history(limits.max_bytes);
    if (history) renderer.set_history(*history);
    Statistics statistics(capture, gpu, settings, request);
    statistics.add_gpu_notice(notice);
    statistics.add_notice(still);
    statistics.set_view(view_.json());
    statistics.set_host(capture.load_seconds, capture.decode_seconds, assemble_seconds);
    const float exposure =
        settings.output.exposure > 0 ? static_cast<float>(settings.output.exposure) : capture.settings.exposure;
    NamedFiles files(*this, gpu, settings, request, renderer, capture);
    install_stop_handler();
    const OutputLock lock(out_);
    OutputLock::remove_unfinished(out_);
    const std::vector<int> earlier = frames_left_in(out_);
    warm_up(renderer, std::max(0, first - warmup_), first);
    std::optional<gpu::Device> second;
    if (renders_two_at_once(capture, gpu, settings, request, last - first, limits.max_bytes))
      second.emplace(prepared, gpu, settings, request);
    const std::vector<gpu::Device*> devices = second ? std::vector{&renderer, &*second} : std::vector{&renderer};
    FirstFrame first_frame;
    ReservedSpace room(out_);
    const DrawableNames names(gpu::record_head("", renderer.assembly(), gpu, settings, request.width, request.height));
    try {
      render_frames(devices, {first, last}, {out_, aux_, exposure}, baselines_ ? &schemes : nullptr, {gpu, names},
                    files, statistics, first_frame, room);
    } catch (const WriteError& error) {
      room.release();
      save_what_was_done(statistics, {first, last}, error);
    }
    room.release();
    if (!first_frame.views.empty()) add_sensitivity(gpu, first_frame.views, statistics);
    if (first_frame.parts) {
      const LeaveOneOut without(capture, gpu, settings, request, {.most = left_out},
                                [&, start = first](gpu::Device& device) {
                                  if (history) device.set_history(*history);
                                  warm_up(device, std::max(0, start - warmup_), start);
                                });
      statistics.set_without(
          without.measure(*first_frame.parts, renderer.assembly(), names, watch_on_terminal(quiet_)));
      if (!quiet_) fmt::print(words(), "{}", left_out_table(statistics.first_frame()));
    }
    const bool parts_missing = first_frame.parts && stop_requested();
    const int done = static_cast<int>(statistics.frame_count());
    if (done < last - first) statistics.set_stopped(last - first, "a signal");
    statistics.write(out_);
    files.commit(renderer);
    const bool has_report = make_report(statistics);
    std::vector<int> written;
    for (int frame = first; frame < first + done; ++frame) written.push_back(frame);
    remove_earlier_results(out_, earlier, {written, settings.stereo.eye_separation > 0, baselines_, has_report});
    if (!quiet_) say_results(statistics);
    if (done < last - first)
      throw stopped(
          fmt::format("stopped after {} of {} frames; results of these are in {}; the same command with "
                      "--frames {}:{} and another --out goes on",
                      done, last - first, escape_control(out_), first + done, last));
    if (parts_missing) throw stopped("stopped: --without left out some parts only; the same command measures all");
  }

 private:
  class NamedFiles;

  // Data of the first frame that is kept to time it again.
  struct FirstFrame {
    std::vector<timing::FrameWork> views;             // with --sensitivity
    std::optional<LeaveOneOut::MeasuredFrame> parts;  // with --without
  };

  // Sources for the costs of a frame's tiles and drawables.
  struct CostSources {
    const gpu::GpuConfiguration& gpu;
    const DrawableNames& names;
  };

  // Renders frames and writes each frame's files, until the last frame or a signal. Space for a frame's statistics is
  // reserved before its images are written. Throws WriteError.
  void render_frames(const std::vector<gpu::Device*>& devices, FrameRange range, FrameWriter::Settings writer,
                     const baselines::BaselineObserver* schemes, const CostSources& sources, NamedFiles& files,
                     Statistics& statistics, FirstFrame& first, ReservedSpace& room) const {
    FrameWriter images(std::move(writer));
    const int frames = range.last - range.first;
    Progress progress(static_cast<std::size_t>(frames), quiet_, [&] { return tiles_done(devices); });
    gpu::FrameStream stream(devices, range.first, range.last);
    for (int frame = range.first; frame < range.last && !stop_requested(); ++frame) {
      gpu::FrameResult result = stream.next();
      if (sensitivity_ && first.views.empty()) first.views = views_of(result);
      if (!without_.empty() && !first.parts) first.parts = {result.frame, *result.shares, result.effects};
      std::optional<FrameCosts> costs;
      if (result.shares) costs.emplace(*result.shares, sources.names);
      if (!quiet_)
        for (const std::string& note : result.notes) std::fprintf(stderr, "note: %s\n", note.c_str());
      statistics.add(result, schemes != nullptr ? &schemes->last() : nullptr, costs ? &*costs : nullptr);
      if (schemes != nullptr) statistics.add_baseline_passes(schemes->passes());
      room.grow(statistics.bytes_at_most());
      files.add(result);
      std::string members;
      if (costs)
        members = costs->tile_members() + timeline_member(gpu::frame_timeline(sources.gpu, *result.model)) +
                  PixelHistory(result.targets, devices.front()->assembly()).member(*costs);
      images.add(frame, std::move(result.targets));
      if (result.right) images.add(frame, std::move(result.right->targets), "right");
      write_file_atomically(fs::path(out_) / tile_maps_name(frame), tile_maps_json(frame, result.maps, members));
      progress.update(static_cast<std::size_t>(frame - range.first + 1),
                      fmt::format("frame {}: {:.2f} s", frame, result.seconds));
    }
    const LongStep writing("writing images", quiet_);
    images.finish();
  }

  // After a failed write, saves the statistics, the last result that can be saved. Throws WriteError that reports all
  // of it.
  [[noreturn]] void save_what_was_done(Statistics& statistics, FrameRange range, const WriteError& error) const {
    const std::size_t done = statistics.frame_count();
    if (done == 0) throw error;
    statistics.set_stopped(range.last - range.first, error.what());
    try {
      statistics.write(out_);
    } catch (const WriteError&) {
      throw error;  // the first fault is the one to mend
    }
    throw WriteError(fmt::format(
        "{}; statistics of {} of {} frames are in {}; make room and run the same command again", error.what(), done,
        range.last - range.first, escape_control((fs::path(out_) / "stats.json").string())));
  }

  // Stream for texts about results: not one into which another result is written.
  std::FILE* words() const { return beside_outputs({trace_, dram_trace_, record_, save_history_}); }

  void say_results(const Statistics& statistics) const {
    if (statistics.frame_count() == 0) return;
    if (baselines_) fmt::print(words(), "{}", statistics.verdict());
    std::error_code ignored;
    const bool page = !no_report_ && fs::exists(fs::path(out_) / "report.html", ignored);
    fmt::print(
        words(), "{}",
        replay_summary(statistics.json(), fmt::format("{}: {}stats.json, stats.csv, {} frame{}", escape_control(out_),
                                                      page ? "report.html, " : "", statistics.frame_count(),
                                                      statistics.frame_count() == 1 ? "" : "s")));
  }

  // The history that the frame before the first one left, with --history.
  std::optional<tilecore::History> earlier_history(std::uint64_t max_bytes) const {
    // Colour, depth and surface of a pixel, and the blocks of a region of one.
    constexpr std::uint64_t kHistoryBytesPerPixel = 26;
    if (history_.empty()) return std::nullopt;
    return tilecore::History::restore(history_, max_bytes / kHistoryBytesPerPixel);
  }

  void warm_up(gpu::Device& renderer, int begin, int end) const {
    if (begin == end) return;
    Progress progress(static_cast<std::size_t>(end - begin), quiet_, [device = &renderer] {
      return tiles_done({&device, 1});
    });
    for (int frame = begin; frame < end && !stop_requested(); ++frame) {
      renderer.render(frame);
      progress.update(static_cast<std::size_t>(frame - begin + 1), fmt::format("frame {}, not written", frame));
    }
  }

  static std::vector<timing::FrameWork> views_of(const gpu::FrameResult& result) {
    std::vector<timing::FrameWork> views = {result.model->record.work};
    if (result.right) views.push_back(*result.right->work);
    return views;
  }

  void add_sensitivity(const gpu::GpuConfiguration& gpu, const std::vector<timing::FrameWork>& views,
                       Statistics& statistics) const {
    const LongStep step("timing it again", quiet_);
    const Sensitivity sensitivity = measure_sensitivity(gpu, views);
    statistics.set_sensitivity(sensitivity_json(sensitivity));
    if (!quiet_) print_sensitivity(words(), sensitivity);
  }

  InputFiles input_files() const {
    InputFiles inputs;
    inputs.add_capture(capture_);
    inputs.add(gpu_);
    if (!history_.empty()) inputs.add(history_);
    return inputs;
  }

  // Files beside the folder of --out: each can be written, is no input and is named once.
  void check_named_outputs(const InputFiles& inputs) const {
    std::vector<fs::path> files;
    for (const std::string& file : {trace_, dram_trace_, record_, save_history_})
      if (!file.empty()) files.emplace_back(file);
    if (!dram_trace_.empty() && !is_stream(dram_trace_)) files.push_back(memory::dram_trace_description(dram_trace_));
    for (std::size_t k = 0; k < files.size(); ++k) {
      check_output_file(files[k], out_);
      inputs.check(files[k]);
      if (is_stream(files[k])) continue;
      const auto same = [&](const fs::path& other) {
        std::error_code ignored;
        return fs::weakly_canonical(other, ignored) == fs::weakly_canonical(files[k], ignored);
      };
      if (std::any_of(files.begin(), files.begin() + static_cast<std::ptrdiff_t>(k), same))
        throw UsageError(fmt::format("{}: two results would have this name", escape_control(files[k].string())));
    }
  }

  memory::DramTraceUnits dram_units(const memory::DramSpec& memory) const {
    const std::uint32_t bytes = dram_transaction_.value_or(memory.transaction_bytes);
    if (dram_transaction_ && (!std::has_single_bit(bytes) || bytes < memory.burst_bytes() || bytes > 1024))
      throw UsageError(fmt::format("--dram-transaction {}: expected a power of two from {}, a burst of {}, to 1024",
                                   bytes, memory.burst_bytes(), memory.type));
    return {check_number("--dram-clock", dram_clock_mhz_.value_or(memory.clock_mhz()), 1, 100000), bytes};
  }

  // The files of --trace, --dram-trace and --save-history.
  class NamedFiles {
   public:
    NamedFiles(const ReplayCommand& command, const gpu::GpuConfiguration& gpu, const gpu::RunSettings& settings,
               const gpu::RenderRequest& request, const gpu::Device& renderer, const scene::Capture& capture) {
      if (!settings.output.machine_model &&
          (command.sensitivity_ ||
           !(command.trace_ + command.dram_trace_ + command.record_ + command.without_).empty()))
        throw UsageError("--trace, --dram-trace, --record, --sensitivity and --without need output.machine_model=true");
      if (!command.trace_frames_.empty()) frames_ = parse_frames("--trace-frames", command.trace_frames_);
      gpu::Timeline::Limits tiles;
      if (!command.trace_tiles_.empty()) {
        const FrameRange range = parse_frames("--trace-tiles", command.trace_tiles_);
        tiles = {static_cast<std::uint32_t>(range.first), static_cast<std::uint32_t>(range.last)};
      }
      // They may lie in it.
      if (!(command.trace_ + command.dram_trace_ + command.record_ + command.save_history_).empty())
        make_folder(command.out_);
      if (!command.trace_.empty()) {
        const gpu::FrameGraph graph(capture, gpu, settings, request.region, {request.width, request.height});
        timeline_.emplace(command.trace_, gpu, tiles, graph.actions().depth_bytes > 0 ? graph.name() : std::string());
      }
      if (!command.record_.empty())
        record_.emplace(command.record_,
                        gpu::record_head(fs::path(command.capture_).filename().string(), renderer.assembly(), gpu,
                                         settings, request.region.width(), request.region.height()));
      if (!command.dram_trace_.empty()) {
        if (!gpu.has_banks())
          throw UsageError(
              "--dram-trace needs machine.timing=events and memory.model=banks: it holds the commands of "
              "their channels");
        const memory::DramSpec memory = hardware::external_memory(gpu);
        dram_.emplace(command.dram_trace_, command.dram_units(memory), memory);
        dram_clocks_per_cycle_ = memory.clock_mhz() / gpu.clock_mhz;
      }
      if (!command.save_history_.empty()) history_.emplace(command.save_history_);
    }
    void add(const gpu::FrameResult& result) {
      if (record_) {
        std::vector<const timing::FrameWork*> views = {&result.model->record.work};
        if (result.right) views.push_back(&*result.right->work);
        record_->add(result.frame, views);
      }
      if (result.frame < frames_.first || result.frame >= frames_.last) return;
      if (timeline_) timeline_->add(result);
      if (dram_) dram_->add(result.model->transactions, result.model->timing.cycles * dram_clocks_per_cycle_);
    }
    void commit(const gpu::Device& renderer) {
      if (timeline_) timeline_->commit();
      if (dram_) dram_->commit();
      if (record_) record_->commit();
      if (!history_) return;
      history_->write(renderer.history().bytes());
      history_->commit();
    }

   private:
    FrameRange frames_{0, std::numeric_limits<int>::max()};
    std::optional<gpu::Timeline> timeline_;
    std::optional<memory::DramTrace> dram_;
    std::optional<gpu::RecordWriter> record_;
    std::optional<OutputFile> history_;
    double dram_clocks_per_cycle_ = 0;
  };

  std::optional<ImageSize> chosen_size() const {
    return size_.empty() ? std::nullopt : std::optional(parse_size("--size", size_));
  }

  gpu::RenderRequest render_request(const scene::Capture& capture, const gpu::RunSettings& settings,
                                    const gpu::GpuConfiguration& gpu, std::uint64_t max_bytes,
                                    bool several_frames) const {
    gpu::RenderRequest request;
    request.width = capture.settings.width;
    request.height = capture.settings.height;
    if (const std::optional<ImageSize> size = chosen_size()) {
      request.width = size->width;
      request.height = size->height;
    }
    request.region = {0, 0, request.width, request.height};
    if (!region_.empty()) {
      const auto r = parse_whole_numbers("--region", region_, ',', 4, "X,Y,WIDTH,HEIGHT inside the frame");
      if (r[2] < 1 || r[3] < 1 || r[0] + r[2] > request.width || r[1] + r[3] > request.height)
        throw UsageError(
            fmt::format("--region {}: is not inside the frame of {}x{}", region_, request.width, request.height));
      request.region = {static_cast<int>(r[0]), static_cast<int>(r[1]), static_cast<int>(r[0] + r[2]),
                        static_cast<int>(r[1] + r[3])};
    }
    request.auxiliary = !aux_.empty();
    request.keep_transactions = !dram_trace_.empty();
    request.record_items = !record_.empty();
    request.attribute = request.pixel_ids = settings.output.machine_model;
    request.resolve_auxiliary = std::any_of(aux_.begin(), aux_.end(), is_resolve_layer);
    request.error = std::find(aux_.begin(), aux_.end(), "error") != aux_.end();
    if (request.resolve_auxiliary && settings.resolve.desampling == tilecore::Desampling::kOff)
      throw UsageError(
          "--aux rate, velocity, edges, discrepancy, origin and error need --set resolve.desampling=adaptive or "
          "another than off");
    const bool accumulates = warmup_ > 0 && gpu::antialiases(capture, settings);
    if (((warmup_ > 0 && !accumulates) || !history_.empty() || !save_history_.empty()) &&
        settings.resolve.desampling != tilecore::Desampling::kAdaptive)
      throw UsageError("--warmup, --history and --save-history need --set resolve.desampling=adaptive");
    if (warmup_ < 0) throw UsageError("--warmup must not be negative");
    if (!save_history_.empty() && settings.stereo.eye_separation > 0)
      throw UsageError("--save-history keeps one eye; stereo.eye_separation asks for two");
    if (!history_.empty() && settings.stereo.eye_separation > 0)
      throw UsageError("--history is of one eye; stereo.eye_separation asks for two");
    // A frame's images are written while the next frame is rendered.
    const std::uint64_t bytes = gpu::image_bytes(request, settings, gpu, capture) * (several_frames ? 2 : 1);
    if (bytes > max_bytes)
      throw LimitError(fmt::format("{}: images of {}x{} need {} bytes, --max-memory allows {}",
                                   escape_control(capture_), request.region.width(), request.region.height(), bytes,
                                   max_bytes));
    return request;
  }

  // [measured] With two threads, frames of one thread each are no faster than frames of both, one after the other.
  static constexpr std::size_t kThreadsForTwoFrames = 2;
  // Two frames at once, while the images of a third are written.
  bool renders_two_at_once(const scene::Capture& capture, const gpu::GpuConfiguration& gpu,
                           const gpu::RunSettings& settings, const gpu::RenderRequest& request, int frames,
                           std::uint64_t max_bytes) const {
    return frames > 1 && thread_count() >= kThreadsForTwoFrames && !baselines_ &&
           gpu::frames_are_independent(capture, gpu, settings, request) &&
           gpu::image_bytes(request, settings, gpu, capture) <= max_bytes / 3;
  }

  FrameRange frame_range(const scene::Capture& capture) const {
    if (frames_.empty())
      return {capture.settings.first_frame, capture.settings.first_frame + capture.settings.frame_count};
    return parse_frames("--frames", frames_);
  }

  // A machine without the page's modules still gives images and figures. Whether there is a page.
  bool make_report(const Statistics& statistics) const {
    if (no_report_ || statistics.frame_count() == 0) return false;
    const std::string missing = missing_for_reports();
    if (!missing.empty()) {
      if (!quiet_) std::fprintf(stderr, "note: no report.html: %s\n", missing.c_str());
      return false;
    }
    const LongStep step("writing the report", quiet_);
    write_report(out_);
    return true;
  }

  // A note about frames after the last key of the played animations, which are all equal.
  static std::string note_of_still_frames(const scene::Capture& capture, FrameRange range) {
    const double end = scene::played_seconds(capture);
    if (end <= 0) return "";
    const double rate = capture.settings.frame_rate;
    int still = range.last;
    while (still > range.first && (still - 1 + capture.settings.shutter_open) / rate > end) --still;
    if (still == range.last) return "";
    const std::string without =
        still == range.first ? "" : fmt::format(" (--frames {}:{} leaves them out)", range.first, still);
    return fmt::format(
        "frames {}:{} lie behind the end of the animation at {:.4g} s and show how it ends; means over all frames "
        "count "
        "them{}",
        still, range.last, end, without);
  }

  void say_notices(const scene::Capture& capture, const gpu::Device& renderer) const {
    if (quiet_) return;
    for (const std::string& notice : capture.notices) std::fprintf(stderr, "note: %s\n", notice.c_str());
    if (renderer.automatic_camera())
      std::fprintf(stderr, "note: the capture has no camera; the scene is framed automatically\n");
    if (!capture.settings.declared)
      std::fprintf(stderr, "note: the capture has no settings of its own; size, frames and shutter are the defaults\n");
  }

  // Names of results in the folder of --out.
  const std::vector<std::string> results_ = {"frame_*.exr", "frame_*.png",   "tiles_*.json", "stats.json",
                                             "stats.csv",   "baselines.csv", "report.html"};
  std::string capture_, frames_, size_, gpu_ = "mid-mobile", region_, out_ = "out";
  std::string trace_, trace_frames_, trace_tiles_, dram_trace_, record_, without_;
  std::vector<std::string> sets_, aux_;
  std::optional<std::string> spp_, seed_, variant_;
  ViewChoices view_;
  std::string history_, save_history_;
  std::optional<double> dram_clock_mhz_;
  std::optional<std::uint32_t> dram_transaction_;
  int warmup_ = 0;
  unsigned threads_ = 0;
  double max_memory_gib_ = 4;
  bool quiet_ = false, baselines_ = false, no_report_ = false, strict_ = false, sensitivity_ = false;
};

}  // namespace

std::unique_ptr<Command> make_replay_command(CLI::App& app) { return std::make_unique<ReplayCommand>(app); }

}  // namespace tessera::replay
