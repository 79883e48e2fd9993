// Texts that people write: studies, machines, options. And results that other runs of the program wrote: sweeps,
// statistics, tradeoffs, points.
#include <algorithm>

#include "base/json_text.h"
#include "base/option_numbers.h"
#include "gpu/configuration.h"
#include "gpu/settings.h"
#include "replay/report/page_views.h"
#include "replay/report/report.h"
#include "replay/sweep/study.h"
#include "replay/tradeoff/decisions.h"
#include "replay/tradeoff/trial_file.h"
#include "tests/fuzz/document_mutator.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/support/captures.h"

namespace tessera::fuzz {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// ---- Studies ----------------------------------------------------------------------------------------------------

const fs::path& study_folder() {
  static const fs::path kFolder = [] {
    const fs::path folder = scratch_folder() / "study";
    fs::create_directories(folder);
    write_scratch(folder / "a.glb", std::string_view("x"));
    write_scratch(folder / "b.glb", std::string_view("y"));
    write_scratch(folder / "gpu.json", std::string_view(R"({"preset":"small","tile":{"width":16}})"));
    return folder;
  }();
  return kFolder;
}

void read_any_study(Bytes input) {
  constexpr std::uint64_t kMaxPoints = 256;
  const fs::path file = study_folder() / "study.json";
  write_scratch(file, input);
  expect_answer([&] {
    const replay::Study study = replay::read_study(file, kMaxPoints);
    std::uint64_t points = study.captures.size();
    if (study.is_grid()) {
      for (const replay::StudyAxis& axis : study.axes) points *= axis.values.size();
    } else {
      points *= study.sample ? study.sample->points : study.goal->points;
      require(!study.sample || study.chosen.size() == study.sample->points, "a sample has another number of points");
    }
    require(points == study.point_count && points <= kMaxPoints, "a study has another number of points than it says");
    // First and last step of every axis: values may not fit each other, and nothing else may go wrong.
    for (const bool last : {false, true}) {
      std::vector<std::uint32_t> steps;
      for (const replay::StudyAxis& axis : study.axes)
        steps.push_back(last ? static_cast<std::uint32_t>(axis.values.size()) - 1 : 0);
      const replay::PointConfiguration point = replay::configure_point(study, steps);
      gpu::check_gpu(point.gpu);
    }
  });
}

std::vector<std::string> studies() {
  const json small = {
      {"title", "t"},
      {"captures", {"a.glb", "b.glb"}},
      {"frames", "0:2"},
      {"size", "64x32"},
      {"gpu", "small"},
      {"settings", {{"sampling.samples_per_pixel", 4}}},
      {"axes",
       {{{"key", "tile.width"}, {"values", {8, 16}}},
        {{"keys", {"tile.height", "frontend.split_depth"}}, {"values", {{8, 1}, {16, 2}}}},
        {{"key", "parameter_buffer.bytes"}, {"range", {{"from", 65536}, {"to", 1048576}, {"factor", 4}}}}}},
      {"columns", {"binner.*", "dram.read_bytes", "timing.cycles"}},
      {"pictures", true}};
  json sampled = small, searched = small;
  sampled["axes"] = {{{"key", "clock.mhz"}, {"range", {{"from", 300}, {"to", 900}}}},
                     {{"key", "l2.bytes"}, {"range", {{"from", 65536}, {"to", 1048576}, {"scale", "log"}}}},
                     {{"key", "memory.gb_per_s"}, {"values", {"x0.7", "x1", "x1.3"}}}};
  sampled["sample"] = {{"method", "latin_hypercube"}, {"points", 5}, {"seed", 3}};
  searched["axes"] = sampled["axes"];
  searched["goal"] = {{"minimise", "energy.total_nj"},
                      {"subject_to", {{"timing.cycles", {{"at_most", 1e6}, {"at_least", 1}}}}},
                      {"points", 20},
                      {"population", 8}};
  json ranges = small, machines = small;
  ranges["axes"] = {{{"key", "resolve.reuse_speed"}, {"range", {{"from", 0.1}, {"to", 1}, {"step", 0.3}}}},
                    {{"key", "size"}, {"values", {"8x8", "16x16"}}}};
  machines["gpu"] = "gpu.json";
  machines["axes"] = {{{"key", "gpu"}, {"values", {"small", "middle", "gpu.json"}}}};
  machines["baselines"] = true;
  json shipped = json::parse(test::read_text(test::shipped_capture("eggs").parent_path() / "studies" / "binning.json"));
  shipped["captures"] = {"a.glb"};
  std::vector<std::string> all;
  for (const json& study : {small, ranges, machines, shipped, sampled, searched}) all.push_back(study.dump());
  return all;
}

// ---- Machines ---------------------------------------------------------------------------------------------------

void read_machine(Bytes input) {
  static const fs::path kFile = scratch_folder() / "machine.json";
  write_scratch(kFile, input);
  expect_answer([&] {
    const gpu::GpuConfiguration gpu = gpu::load_gpu(kFile.string());
    const std::string written = gpu::gpu_json(gpu).dump();
    bool fits = true;
    try {
      gpu::check_gpu(gpu);
    } catch (const UsageError&) {
      fits = false;
    }
    if (!fits) return;
    // The machine that a replay writes reads back as the same machine.
    write_scratch(kFile, written);
    require(gpu::gpu_json(gpu::load_gpu(kFile.string())).dump() == written, "a machine does not read back as itself");
  });
}

std::vector<std::string> machines() {
  std::vector<std::string> all = {R"({"preset":"small"})",
                                  R"({"tile":{"width":16,"height":8},"memory":{"burst_bytes":32}})"};
  for (const std::string& name : gpu::preset_names()) all.push_back(gpu::gpu_json(gpu::load_gpu(name)).dump());
  return all;
}

// ---- Options ----------------------------------------------------------------------------------------------------

// The first byte chooses the option, the rest is its text.
void parse_option(Bytes input) {
  if (input.empty()) return;
  // A command line has no zero bytes.
  std::string text(input.begin() + 1, input.end());
  text.resize(std::min(text.size(), text.find('\0')));
  expect_answer([&] {
    switch (input[0] % 6) {
      case 0: {
        const ImageSize size = parse_size("--size", text);
        require(size.width >= 1 && size.height >= 1 && size.width <= 16384 && size.height <= 16384,
                "a size beyond its range");
        break;
      }
      case 1: {
        const FrameRange range = parse_frames("--frames", text);
        require(range.first >= 0 && range.first < range.last, "an empty range of frames");
        break;
      }
      case 2: {
        const NumberPair pair = parse_pair("--shutter", text, "A:B");
        require(pair.a - pair.a == 0 && pair.b - pair.b == 0, "a number that is not finite");
        break;
      }
      case 3:
        require(parse_whole_numbers("--region", text, ',', 4, "X,Y,W,H").size() == 4, "a region of not four numbers");
        break;
      case 4:
        gpu::gpu_json(gpu::load_gpu(text.find('/') == std::string::npos && text.size() < 32 ? "preset " + text : ""));
        break;
      default: {
        gpu::RunSettings settings;
        gpu::GpuConfiguration gpu;
        gpu::apply_setting(text, settings, gpu);
        const std::string written = gpu::settings_json(settings).dump() + gpu::gpu_json(gpu).dump();
        require(written.find("null") == std::string::npos, "a setting that is not finite was accepted");
      }
    }
  });
}

std::vector<std::string> options() {
  std::vector<std::string> all = {std::string("\0", 1) + "1280x720",
                                  "\x01"
                                  "0:24",
                                  "\x02"
                                  "0:0.5",
                                  "\x02-1e-3:2",
                                  "\x03"
                                  "0,0,64,64",
                                  "\x04small"};
  const gpu::RunSettings settings;
  for (const auto& key : gpu::settings_keys().keys())
    all.push_back("\x05" + std::string(key.name) + "=" +
                  key_value_json(gpu::settings_keys().value(settings, key)).dump());
  for (const auto& key : gpu::gpu_keys().keys())
    all.push_back("\x05" + std::string(key.name) + "=" + std::to_string(static_cast<long long>(key.max)));
  return all;
}

// ---- Results ----------------------------------------------------------------------------------------------------

// The first byte chooses: a sweep with one result, a replay's statistics, a tradeoff.
void read_results(Bytes input) {
  if (input.empty()) return;
  static const fs::path kFolder = [] {
    const fs::path folder = scratch_folder() / "results";
    fs::create_directories(folder / "points");
    return folder;
  }();
  const std::string_view text(reinterpret_cast<const char*>(input.data()) + 1, input.size() - 1);
  expect_answer([&] {
    std::string note;
    replay::PageViews views;
    // The report turns a member that is missing or of another type into a refusal of its own; so does this.
    try {
      const unsigned kind = input[0] % 3;
      if (kind == 0) {
        const std::size_t cut = std::min(text.find('\n'), text.size());
        write_scratch(kFolder / "sweep.json", text.substr(0, cut));
        write_scratch(kFolder / "points" / "0123456789abcdef0123456789abcdef.json",
                      text.substr(std::min(cut + 1, text.size())));
        replay::sweep_report(kFolder, views, note);
      } else if (kind == 1) {
        write_scratch(kFolder / "stats.json", text);
        replay::replay_report({kFolder}, views, note);
      } else {
        write_scratch(kFolder / "tradeoff.json", text);
        const json page = replay::tradeoff_report(kFolder, views, note);
        require(page.at("title").is_string() && page.at("subtitle").is_string() &&
                    page.at("tradeoff").at("knobs").is_array(),
                "a tradeoff was accepted that no page can show");
      }
    } catch (const json::exception&) {
    }
  });
}

json tradeoff_seed() {
  const json times = {{"seconds", {{"median", 1.5}, {"low", 1}, {"high", 2}}},
                      {"processor_seconds", {{"median", 1.5}, {"low", 1}, {"high", 2}}}};
  const json row = {{"label", "4"},
                    {"says", "s"},
                    {"arguments", "--set a=4"},
                    {"base", true},
                    {"in_double", false},
                    {"picture", "p"},
                    {"same_picture", true},
                    {"ms", 0.5},
                    {"cycles", 9},
                    {"dram_bytes", 8},
                    {"energy_nj", 1.5},
                    {"watched", nullptr},
                    {"error", {{"psnr_db", 40.5}, {"ssim", 0.9}, {"flip", 0.1}, {"max_error", 0.2}}},
                    {"front", {{"ms", true}}},
                    {"host", times}};
  const json knob = {{"name", "samples"}, {"title", "t"},     {"context", ""}, {"against", 0},  {"visual", false},
                     {"watched", ""},     {"watched_as", ""}, {"skipped", ""}, {"idle", false}, {"settings", {row}}};
  return {{"schema", "tessera.tradeoff/1"},
          {"capture", "a.glb"},
          {"frame", 3},
          {"first_frame", 0},
          {"size", {8, 8}},
          {"rounds", 1},
          {"stopped", true},
          {"settings", {{"a", 4}}},
          {"gpu", {{"preset", "middle"}}},
          {"knobs", {knob}},
          {"reference",
           {{"samples", 16},
            {"edge_pixels", 1.0},
            {"psnr_db", nullptr},
            {"convergence", {{"samples", {8, 16}}, {"rms_error", {0.2, 0.1}}, {"slope", -0.5}, {"size", {2, 2}}}}}},
          {"cheapest",
           {{"cost", "ms"},
            {"max_flip", 0.5},
            {"min_psnr", nullptr},
            {"setting", {{"label", "4"}, {"knob", "t"}, {"arguments", ""}}},
            {"missed", nullptr}}}};
}

std::vector<std::string> results() {
  const json frame = {{"frame", 3},
                      {"counters", {{"binner.entries", 7}}},
                      {"timing", {{"cycles", 9}, {"bound_by", "dram"}}},
                      {"energy", {{"total_nj", 1.5}}}};
  const json sweep = {{"schema", "tessera.sweep/1"},
                      {"title", "t"},
                      {"captures", {"a.glb"}},
                      {"axes", {"tile.width"}},
                      {"columns", {"binner.entries", "timing.cycles"}},
                      {"points", {{{"hash", "0123456789abcdef0123456789abcdef"}, {"capture", 0}, {"values", {8}}}}}};
  const json point = {{"schema", "tessera.point/1"}, {"frames", {frame}}};
  const json stats = {{"schema", "tessera.stats/1"},
                      {"capture", {{"file", "a.glb"}}},
                      {"gpu", {{"preset", "middle"}}},
                      {"settings", {{"width", 8}, {"height", 8}, {"region", {0, 0, 8, 8}}}},
                      {"frames", {frame}},
                      {"total", {{"counters", {{"binner.entries", 7}}}}}};
  return {std::string(1, '\0') + sweep.dump() + "\n" + point.dump(),
          std::string(1, '\0') + sweep.dump() + "\n" + json{{"fault", "no"}}.dump(),
          std::string(1, '\1') + stats.dump(), std::string(1, '\2') + tradeoff_seed().dump()};
}

std::size_t mutate_results(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random) {
  if (size < 2) return mutate_bytes(data, size, max_size);
  std::uint8_t* const cut = std::find(data, data + size, '\n');
  if (cut == data + size) return 1 + mutate_json(data + 1, size - 1, max_size - 1, random);
  // Mutates one of the two documents; the first one is joined with the rest of the input.
  const std::size_t second = static_cast<std::size_t>(cut - data) + 1;
  if (second < 2) return mutate_bytes(data, size, max_size);  // the first byte is no choice but the end of a line
  if (random() % 2 == 0) return second + mutate_json(data + second, size - second, max_size - second, random);
  const std::string rest(cut, data + size);
  if (max_size <= rest.size() + 1 + second) return size;
  const std::size_t first = 1 + mutate_json(data + 1, second - 2, max_size - 1 - rest.size(), random);
  std::copy(rest.begin(), rest.end(), data + first);
  return first + rest.size();
}

// ---- Points of a tradeoff ---------------------------------------------------------------------------------------

void read_point(Bytes input) {
  static const fs::path kFile = scratch_folder() / "point.json", kAgain = scratch_folder() / "point_again.json";
  write_scratch(kFile, input);
  for (const bool timed : {false, true})
    expect_answer([&] {
      const replay::TrialResult trial = replay::read_trial(kFile, timed);
      // A result that was read can be judged, and is written back unchanged.
      const replay::Measurement measured = replay::measurement_of(trial, "tilecore.triangles", 850);
      require(measured.wall_seconds.low <= measured.wall_seconds.median &&
                  measured.wall_seconds.median <= measured.wall_seconds.high,
              "times that are not in order");
      require(measured.cycles.has_value() == trial.figures.contains("timing.cycles"), "cycles out of nowhere");
      require(measured.error.has_value() != timed, "an error without an image, or an image without one");
      replay::write_trial(kAgain, trial);
      require(replay::read_trial(kAgain, timed) == trial, "a point does not read back as itself");
    });
}

std::vector<std::string> points() {
  const json machine = {{"schema", "tessera.trial/1"},
                        {"error", {{"psnr_db", 40.5}, {"ssim", 0.9}, {"flip", 0.1}, {"max_error", 0.2}}},
                        {"picture", std::string(64, 'a')},
                        {"values",
                         {{"timing.cycles", 900},
                          {"dram.read_bytes", 64},
                          {"dram.written_bytes", 128},
                          {"energy.total_nj", 1.5},
                          {"timing.units.l2.utilisation", 0.25},
                          {"tilecore.triangles", 7}}},
                        {"host", {{"seconds", {0.1, 0.2}}, {"processor_seconds", {0.3, 0.4}}}}};
  json in_double = machine, timed = machine;
  in_double["values"] = json::object();
  in_double["error"]["psnr_db"] = nullptr;
  timed["error"] = nullptr;
  return {machine.dump(), in_double.dump(1), timed.dump()};
}

}  // namespace

const Target kStudyTarget{"study", "any bytes as a study of `sweep`", 8 << 10, read_any_study, studies, mutate_json};
const Target kMachineTarget{"machine",  "any bytes as a machine of `--gpu`", 16 << 10, read_machine, machines,
                            mutate_json};
const Target kOptionTarget{"option", "any text as a number, range, size or KEY=VALUE of the command line",
                           256,      parse_option,
                           options,  nullptr};
const Target kResultTarget{"result", "any bytes as results that `compare`, `report` and `sweep` read back",
                           8 << 10,  read_results,
                           results,  mutate_results};
const Target kPointTarget{"point",    "any bytes as a result that `tradeoff` goes on from", 8 << 10, read_point, points,
                          mutate_json};

}  // namespace tessera::fuzz
