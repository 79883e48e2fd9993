#include "replay/tradeoff/tradeoff.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/json_text.h"
#include "base/whole_file.h"
#include "gpu/view_inputs.h"
#include "replay/progress.h"
#include "replay/sweep/capture_library.h"
#include "replay/sweep/points.h"
#include "replay/tradeoff/tradeoff_words.h"
#include "replay/tradeoff/trial.h"
#include "scene/capture_reader.h"

namespace tessera::replay {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// A setting that is to be tried, and where its result goes.
struct Row {
  std::string label;
  KeyValues values;  // of the knob, without what the user set
  Trial trial;
};

// Settings of a knob to be run.
struct Block {
  Knob knob;
  std::string skipped;
  std::vector<Row> rows;
};

// Trials whose rounds take turns, and that are kept together.
constexpr std::ptrdiff_t kTakingTurns = 16;

json spread(const json& rounds) {
  std::vector<double> values = rounds.get<std::vector<double>>();
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  const double median = n == 0 ? 0 : n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
  return {{"median", median}, {"low", n == 0 ? 0 : values.front()}, {"high", n == 0 ? 0 : values.back()}};
}

json value_or_null(const json& values, const std::string& name) {
  return values.contains(name) ? values[name] : json();
}

class Tradeoff {
 public:
  explicit Tradeoff(const TradeoffOptions& options) : options_(options) {}

  json run() {
    check();
    scene::CaptureLimits limits;
    limits.max_bytes = options_.max_bytes;
    const scene::Capture capture = scene::read_capture(options_.capture, limits);
    const auto prepared = std::make_shared<const gpu::PreparedCapture>(capture);
    place(capture);
    const std::vector<Block> blocks = plan(*prepared);
    std::size_t steps = 1;
    for (const Block& block : blocks) steps += block.rows.size();
    Progress progress(steps, options_.quiet);
    reference::ReferenceSettings wanted{options_.width, options_.height, place_.frame, options_.reference_samples,
                                        options_.reference_edge_pixels};
    const reference::Reference reference =
        get_reference(*prepared, options_.gpu, options_.settings, wanted, options_.folder, place_.inputs);
    std::size_t done = 1;
    progress.update(done, "reference");
    json out = {{"schema", "tessera.tradeoff/1"},
                {"capture", options_.capture.filename().string()},
                {"frame", place_.frame},
                {"first_frame", place_.first_frame},
                {"size", {options_.width, options_.height}},
                {"rounds", options_.rounds},
                {"arguments", as_arguments(options_.base)},
                {"settings", gpu::settings_json(options_.settings)},
                {"gpu", gpu::gpu_json(options_.gpu)},
                {"gpu_name", options_.gpu_name},
                {"reference", reference.info},
                {"knobs", json::array()},
                {"stopped", false}};
    Trial base{options_.settings, options_.gpu, false, ""};
    name_trial(base, place_);
    for (const Block& block : blocks) {
      if (stop_requested() || !measure(prepared, block, reference.color)) break;
      out["knobs"].push_back(block_json(block, base.hash));
      done += block.rows.size();
      progress.update(done, block.knob.title);
    }
    if (!options_.joint.empty() && !stop_requested()) add_joint(prepared, reference.color, base.hash, out);
    out["stopped"] = stop_requested();
    return out;
  }

 private:
  void check() const {
    if (options_.settings.stereo.eye_separation > 0)
      throw UsageError("a tradeoff looks at one eye; stereo.eye_separation asks for two");
    if (options_.settings.procedures.style == tilecore::ProcedureSettings::Style::kLines)
      throw UsageError("the reference has no ink lines; procedures.style=lines cannot be compared with it");
    if (!options_.settings.output.machine_model)
      throw UsageError("a tradeoff needs cycles and energy: output.machine_model must stay true");
    for (const std::string& name : options_.knobs) knob_named(name);
    for (const std::string& name : options_.joint) knob_named(name);
    // Scene, two images, histories: what reading the capture takes is checked there.
    const std::uint64_t bytes =
        static_cast<std::uint64_t>(options_.width) * static_cast<std::uint64_t>(options_.height) * 512;
    if (bytes > options_.max_bytes)
      throw LimitError(fmt::format("images of {}x{} need {} bytes, --max-memory allows {}", options_.width,
                                   options_.height, bytes, options_.max_bytes));
  }

  void place(const scene::Capture& capture) {
    const scene::CaptureSettings& own = capture.settings;
    place_.width = options_.width;
    place_.height = options_.height;
    place_.frame = options_.frame.value_or(own.first_frame + std::min(own.frame_count, options_.run) - 1);
    place_.first_frame = std::max(0, place_.frame - options_.run + 1);
    place_.rounds = options_.rounds;
    place_.inputs = capture_fingerprint(options_.capture) + program_fingerprint();
  }

  Row make_row(const std::string& label, const KeyValues& values, bool in_double) const {
    Row row{label, values, {options_.settings, options_.gpu, in_double, ""}};
    apply(values, row.trial.settings, row.trial.gpu);
    name_trial(row.trial, place_);
    return row;
  }

  std::vector<Block> plan(const gpu::PreparedCapture& prepared) const {
    const auto frame = scene::pose_frame(
        prepared.assembly, gpu::frame_camera(prepared.capture, options_.settings, options_.width, options_.height),
        gpu::frame_request(prepared.capture, options_.gpu, options_.settings, options_.width, options_.height,
                           place_.frame));
    std::vector<Block> blocks;
    for (const Knob& knob : knobs()) {
      if (!options_.knobs.empty() &&
          std::find(options_.knobs.begin(), options_.knobs.end(), knob.name) == options_.knobs.end() &&
          std::find(options_.joint.begin(), options_.joint.end(), knob.name) == options_.joint.end())
        continue;
      Block block{knob, why_without_effect(knob, *frame, place_.first_frame < place_.frame), {}};
      for (const KnobSetting& setting : knob.settings) {
        if (!block.skipped.empty()) break;
        KeyValues values = knob.context;
        values.insert(values.end(), setting.values.begin(), setting.values.end());
        block.rows.push_back(make_row(setting.label, values, setting.in_double));
      }
      blocks.push_back(std::move(block));
    }
    return blocks;
  }

  fs::path trial_file(const std::string& hash) const { return options_.folder / "points" / (hash + ".json"); }

  // False when asked to stop before all of the block was measured; what was is kept.
  bool measure(const std::shared_ptr<const gpu::PreparedCapture>& prepared, const Block& block,
               const Image& reference) {
    std::vector<Trial> missing;
    std::set<std::string> asked;
    std::error_code ignored;
    for (const Row& row : block.rows) {
      const std::string& hash = row.trial.hash;
      if (results_.contains(hash) || !asked.insert(hash).second) continue;
      if (fs::is_regular_file(trial_file(hash), ignored))
        results_[hash] = parse_json(read_whole_text(trial_file(hash)), trial_file(hash).string());
      else
        missing.push_back(row.trial);
    }
    for (auto first = missing.begin(); first != missing.end();) {
      const auto last = first + std::min<std::ptrdiff_t>(kTakingTurns, missing.end() - first);
      const std::vector<Trial> part(first, last);
      const std::vector<json> results = run_trials(prepared, part, place_, reference);
      if (results.empty()) return false;
      for (std::size_t t = 0; t < part.size(); ++t) {
        write_file_atomically(trial_file(part[t].hash), results[t].dump(1) + "\n");
        results_[part[t].hash] = results[t];
      }
      first = last;
    }
    return true;
  }

  json row_json(const Row& row, const Knob& knob, const std::string& base) const {
    const json& result = results_.at(row.trial.hash);
    const json& values = result.at("values");
    json bytes;
    if (values.contains("dram.read_bytes") || values.contains("dram.written_bytes"))
      bytes = values.value("dram.read_bytes", std::uint64_t{0}) + values.value("dram.written_bytes", std::uint64_t{0});
    KeyValues all = options_.base;
    all.insert(all.end(), row.values.begin(), row.values.end());
    return {{"label", row.label},
            {"arguments", as_arguments(all)},
            {"base", row.trial.hash == base},
            {"in_double", row.trial.in_double},
            {"error", result.at("error")},
            {"picture", result.at("picture")},
            {"cycles", value_or_null(values, "timing.cycles")},
            {"dram_bytes", bytes},
            {"energy_nj", value_or_null(values, "energy.total_nj")},
            {"watched", knob.watched.empty() ? json()
                        : values.empty()     ? json()
                                             : json(values.value(knob.watched, json(0)))},
            {"host",
             {{"seconds", spread(result.at("host").at("seconds"))},
              {"processor_seconds", spread(result.at("host").at("processor_seconds"))}}}};
  }

  json block_json(const Block& block, const std::string& base) const {
    json out = {{"name", block.knob.name},
                {"title", block.knob.title},
                {"context", as_arguments(block.knob.context)},
                {"against", block.knob.against},
                {"visual", block.knob.visual},
                {"watched", block.knob.watched},
                {"watched_as", block.knob.watched_as},
                {"skipped", block.skipped},
                {"settings", json::array()}};
    for (const Row& row : block.rows) out["settings"].push_back(row_json(row, block.knob, base));
    finish_block(out);
    return out;
  }

  // Fronts, and what is said of every setting.
  static void finish_block(json& block) {
    json& rows = block["settings"];
    block["idle"] = false;
    if (rows.empty()) return;
    const json against = rows[block["against"].get<std::size_t>()];
    for (json& row : rows) {
      row["front"] = json::object();
      row["same_picture"] = row["picture"] == against["picture"];
      row["says"] = setting_in_words(row, against, block);
    }
    block["idle"] = std::all_of(rows.begin(), rows.end(), [&](const json& row) {
      return row["picture"] == against["picture"] && row["cycles"] == against["cycles"] &&
             row["dram_bytes"] == against["dram_bytes"] && row["energy_nj"] == against["energy_nj"] &&
             row["watched"] == against["watched"];
    });
    for (const std::string cost : kCosts) {
      std::vector<ErrorAndCost> points;
      std::vector<std::size_t> of;
      for (std::size_t r = 0; r < rows.size(); ++r)
        if (const auto value = cost_of(rows[r], cost)) {
          points.push_back({rows[r]["error"]["flip"], *value});
          of.push_back(r);
        }
      const std::vector<bool> front = pareto_front(points);
      for (std::size_t k = 0; k < of.size(); ++k)
        (cost.ends_with("seconds") ? rows[of[k]]["host"]["front_" + cost] : rows[of[k]]["front"][cost]) =
            static_cast<bool>(front[k]);
    }
  }

  // All combinations of the settings that lie on the knobs' own fronts of error against cycles, with the one asked for.
  void add_joint(const std::shared_ptr<const gpu::PreparedCapture>& prepared, const Image& reference,
                 const std::string& base, json& out) {
    std::vector<std::vector<KnobSetting>> axes;
    std::set<std::string> keys;
    std::size_t count = 1;
    std::string title;
    for (const std::string& name : options_.joint) {
      const auto at =
          std::find_if(out["knobs"].begin(), out["knobs"].end(), [&](const json& k) { return k["name"] == name; });
      if (at == out["knobs"].end() || !at->at("skipped").get<std::string>().empty()) continue;
      const Knob& knob = knob_named(name);
      std::vector<KnobSetting> axis;
      for (std::size_t s = 0; s < knob.settings.size(); ++s) {
        const json& row = at->at("settings")[s];
        if (knob.settings[s].in_double || !(row["front"].value("cycles", false) || row["base"].get<bool>())) continue;
        KnobSetting setting = knob.settings[s];
        setting.values.insert(setting.values.begin(), knob.context.begin(), knob.context.end());
        axis.push_back(setting);
      }
      std::set<std::string> own;
      for (const KnobSetting& setting : axis)
        for (const auto& [key, value] : setting.values) own.insert(key);
      for (const std::string& key : own)
        if (!keys.insert(key).second)
          throw UsageError(fmt::format("--joint: {} would be set by two of the knobs", key));
      count *= axis.size();
      axes.push_back(std::move(axis));
      title += (title.empty() ? "" : ", ") + knob.title;
    }
    if (axes.empty()) return;
    if (count > options_.max_points)
      throw LimitError(fmt::format("--joint: {} combinations, --max-points allows {}", count, options_.max_points));
    Block block{{}, "", {}};
    block.knob.name = "joint";
    block.knob.title = title;
    for (std::size_t k = 0; k < count; ++k) {
      std::string label;
      KeyValues values;
      for (std::size_t a = 0, rest = k; a < axes.size(); ++a) {
        const KnobSetting& setting = axes[a][rest % axes[a].size()];
        rest /= axes[a].size();
        label += (label.empty() ? "" : " | ") + setting.label;
        values.insert(values.end(), setting.values.begin(), setting.values.end());
      }
      block.rows.push_back(make_row(label, values, false));
      if (block.rows.back().trial.hash == base) block.knob.against = k;
    }
    if (!measure(prepared, block, reference)) return;
    out["knobs"].push_back(block_json(block, base));
  }

  const TradeoffOptions& options_;
  TrialPlace place_;
  std::map<std::string, json> results_;  // by hash
};

}  // namespace

json run_tradeoff(const TradeoffOptions& options) { return Tradeoff(options).run(); }

std::optional<double> cost_of(const json& row, const std::string& cost) {
  if (cost.ends_with("seconds")) return row.at("host").at(cost).at("median").get<double>();
  if (!row.contains(cost) || row.at(cost).is_null()) return std::nullopt;
  return row.at(cost).get<double>();
}

std::vector<bool> pareto_front(const std::vector<ErrorAndCost>& points) {
  std::vector<bool> front(points.size(), true);
  for (std::size_t a = 0; a < points.size(); ++a)
    for (const ErrorAndCost& b : points)
      if (b.error <= points[a].error && b.cost <= points[a].cost &&
          (b.error < points[a].error || b.cost < points[a].cost))
        front[a] = false;
  return front;
}

json cheapest(const json& tradeoff, const std::string& cost, std::optional<double> max_flip,
              std::optional<double> min_psnr) {
  json best;
  double least = std::numeric_limits<double>::infinity(), error = least;
  for (const json& knob : tradeoff.at("knobs"))
    for (const json& row : knob.at("settings")) {
      const auto value = cost_of(row, cost);
      if (!value || row.value("in_double", false)) continue;
      const double flip = row.at("error").at("flip");
      const json& db = row.at("error").at("psnr_db");
      if (max_flip && flip > *max_flip) continue;
      if (min_psnr && !db.is_null() && db.get<double>() < *min_psnr) continue;
      if (*value > least || (*value == least && flip >= error)) continue;
      best = row;
      best["knob"] = knob.at("name");
      least = *value;
      error = flip;
    }
  return best;
}

}  // namespace tessera::replay
