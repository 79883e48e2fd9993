#include <chrono>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/json_text.h"
#include "base/option_numbers.h"
#include "base/output_file.h"
#include "base/parallel.h"
#include "base/text.h"
#include "replay/commands.h"
#include "replay/input_files.h"
#include "replay/progress.h"
#include "replay/report/report.h"
#include "replay/view/view_server.h"
#include "replay/view_options.h"

namespace tessera::replay {
namespace {

namespace fs = std::filesystem;

class ViewCommand final : public Command {
 public:
  explicit ViewCommand(CLI::App& app) {
    add_capture_argument(app, start_.file);
    app.add_option("--frame", frame_, "The frame to view (default: the capture's first)")->type_name("N");
    app.add_option("--size", start_.size, "Size of the image (default: the capture's, else 1280x720)")
        ->type_name("WxH");
    add_machine_options(app, start_.gpu, start_.sets, "Set a key at the start of the view; repeatable");
    app.add_option("--warmup", start_.warmup,
                   "With resolve.desampling=adaptive: render so many frames before, so that it has a history")
        ->type_name("N");
    app.add_option("--port", port_, "Port on 127.0.0.1; 0 takes any that is free")
        ->type_name("N")
        ->capture_default_str();
    app.add_option("--out", out_, "Keep each result there: view_NNNN.json (statistics), view_NNNN.png")
        ->type_name("DIR");
    add_threads_option(app, threads_);
    add_memory_option(app, max_memory_gib_);
    add_strict_flag(app, strict_);
    add_variant_option(app, start_.variant);
    add_view_options(app, start_.look, kViewGroup);
    add_shutter_option(app, start_.look.shutter, kViewGroup);
    app.footer(
        "Prints the address of a page like report.html, with sliders for settings and numbers of the "
        "machine. A change\n"
        "of a key that only timing reads (pass `timing` of `tessera describe gpu`) times the frame "
        "again, any other renders it.\n"
        "A button measures the frame without each drawable, as `tessera replay --without` does.\n"
        "The page can be opened on this machine only, and only with its address. Ctrl-C ends it.\n"
        "\n"
        "Example:\n"
        "  tessera view captures/eggs.glb --size 640x360");
  }

  void run() override {
    if (frame_) start_.frame = static_cast<int>(parse_whole_numbers("--frame", *frame_, ',', 1, "a whole number")[0]);
    if (start_.warmup < 0) throw UsageError("--warmup must not be negative");
    if (port_ < 0 || port_ > 65535) throw UsageError(fmt::format("--port {}: expected 0 to 65535", port_));
    if (!out_.empty()) {
      const std::vector<std::string> results = {"view_*.json", "view_*.png"};
      InputFiles inputs;
      inputs.add_capture(start_.file);
      inputs.add(start_.gpu);
      inputs.check_folder(out_, results);
      check_output_folder(out_, results);
    }
    if (const std::string missing = missing_for_reports(); !missing.empty()) throw SystemError("no page: " + missing);
    const ThreadLimit threads(static_cast<std::size_t>(threads_));
    scene::CaptureLimits limits;
    limits.max_bytes = memory_bytes(max_memory_gib_);
    limits.strict = strict_;
    limits.variant = start_.variant;
    std::optional<LongStep> step(std::in_place, "reading " + escape_control(start_.file), false);
    const std::optional<ImageSize> size =
        start_.size.empty() ? std::nullopt : std::optional(parse_size("--size", start_.size));
    const scene::Capture capture = read_capture(start_.file, limits, start_.look, size);
    step.reset();
    for (const std::string& notice : capture.notices) std::fprintf(stderr, "note: %s\n", notice.c_str());
    start_.capture = &capture;
    install_stop_handler();
    {
      ViewServer server(start_, limits.max_bytes, port_, [this](const ViewResult& result) { keep(result); });
      step.emplace("rendering the first frame", false);
      while (!stop_requested() && !server.session().wait_for_start(50)) {
      }
      step.reset();
      if (!stop_requested()) {
        fmt::print("{}\n", server.url());
        std::fflush(stdout);
      }
      while (!stop_requested()) {
        server.beat();
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
      }
    }
    throw stopped("");
  }

 private:
  // A full disk does not end the view.
  void keep(const ViewResult& result) const {
    if (out_.empty()) return;
    try {
      const fs::path file = fs::path(out_) / fmt::format("view_{:04}", result.revision);
      write_file_atomically(file.string() + ".json", json_text(result.stats, 1) + "\n");
      write_file_atomically(file.string() + ".png", *result.image.png);
    } catch (const WriteError& error) {
      std::fprintf(stderr, "note: not kept: %s\n", error.what());
    }
  }

  ViewStart start_;
  std::optional<std::string> frame_;
  std::string out_;
  int port_ = 0;
  unsigned threads_ = 0;
  double max_memory_gib_ = 4;
  bool strict_ = false;
};

}  // namespace

std::unique_ptr<Command> make_view_command(CLI::App& app) { return std::make_unique<ViewCommand>(app); }

}  // namespace tessera::replay
