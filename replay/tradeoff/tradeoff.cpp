#include "replay/tradeoff/tradeoff.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"
#include "gpu/frame_graph.h"
#include "gpu/unread_keys.h"
#include "gpu/view_inputs.h"
#include "reference/reference_store.h"
#include "replay/commands.h"
#include "replay/point_files.h"
#include "replay/progress.h"
#include "replay/sweep/capture_library.h"
#include "replay/sweep/points.h"
#include "replay/tradeoff/combination_search.h"
#include "replay/tradeoff/decisions.h"
#include "replay/tradeoff/effect_costs.h"
#include "replay/tradeoff/trial.h"
#include "replay/tradeoff/trial_file.h"
#include "scene/capture_reader.h"

namespace tessera::replay {
namespace {

// A setting to be tried, and the place of its result.
struct Row {
  std::string label;
  KeyValues values;  // of the knob, without the user's values
  Trial trial;
};

// Settings of a knob to be run.
struct Block {
  Knob knob;
  std::string skipped;
  std::vector<Row> rows;
  bool combines = false;  // rows are combinations of settings of other knobs
};

// Trials whose rounds take turns, and that are kept together.
constexpr std::ptrdiff_t kTakingTurns = 16;
// Limits of a search: the number of combinations, and its work over the work of the knobs alone, at most and as
// expected. Knobs and search together then take 0.6 to 1.4 times the expected work, whenever the search ends.
constexpr std::size_t kSearched = 32;
constexpr double kSearchedWork = 1.5, kExpectedSearch = 0.75;

// All combinations of one setting from each axis; consecutive ones differ in the first axis.
std::vector<std::vector<KnobSetting>> combinations_of(const std::vector<std::vector<KnobSetting>>& axes) {
  std::vector<std::vector<KnobSetting>> all(1);
  for (auto axis = axes.rbegin(); axis != axes.rend(); ++axis) {
    std::vector<std::vector<KnobSetting>> longer;
    for (const std::vector<KnobSetting>& later : all)
      for (const KnobSetting& setting : *axis) {
        longer.push_back({setting});
        longer.back().insert(longer.back().end(), later.begin(), later.end());
      }
    all = std::move(longer);
  }
  return all;
}

class Tradeoff {
 public:
  explicit Tradeoff(const TradeoffOptions& options) : options_(options), points_(options.folder) {}

  TradeoffResult run() {
    check();
    scene::CaptureLimits limits;
    limits.max_bytes = options_.max_bytes;
    limits.strict = options_.strict;
    limits.variant = options_.variant;
    PackedCaptures captures(options_.capture, limits, options_.view, ImageSize{options_.width, options_.height});
    const gpu::PreparedCapture& prepared = *captures.original();
    place(prepared.capture);
    // Refuses passes that the machine does not render, before anything is done.
    const gpu::FrameGraph graph(prepared.capture, options_.gpu, options_.settings,
                                {0, 0, options_.width, options_.height}, {options_.width, options_.height});
    if (graph.bloom() != nullptr)
      throw UsageError("the reference has no bloom, by which every image would differ from it: set post.bloom=0");
    if (graph.taa() != nullptr)
      throw UsageError(
          "the reference has no temporal antialiasing, which gathers over frames what a knob changes: set post.taa=0");
    if (options_.effects) return run_effects(captures);
    std::vector<Block> blocks = plan(prepared);
    // Models of timing draw nothing.
    const bool draws = std::any_of(blocks.begin(), blocks.end(),
                                   [](const Block& block) { return !block.knob.timed && !block.rows.empty(); });
    std::optional<reference::Reference> reference;
    if (draws) reference = make_reference(prepared);
    // The results of trials depend on the kept reference that judged them, so its hash is part of their names.
    if (draws && !options_.kept_references.empty()) {
      place_.reference += ", kept: " + values_sha256(reference->color);
      for (Block& block : blocks)
        for (Row& row : block.rows) name_trial(row.trial, place_);
    }
    const Image* const color = reference ? &reference->color : nullptr;
    TradeoffResult out = empty_result();
    if (reference) out.reference = reference->info;
    Trial base{options_.settings, options_.gpu, false, {}, false, false, ""};
    name_trial(base, place_);
    {
      const Steps steps = steps_of(blocks);
      std::atomic<std::size_t> done{0};
      Progress progress(steps.works, options_.quiet, [&] { return progress_within(steps, done); });
      for (const Block& block : blocks) {
        if (stop_requested() || !measure(captures, block, color)) break;
        out.knobs.push_back(result_of(block, base.hash));
        progress.update(++done, block.knob.title);
      }
      if (options_.search && !stop_requested()) {
        add_search(captures, color, base.hash, kSearchedWork / kExpectedSearch * steps.works.back(), out.knobs);
        progress.update(++done, steps.titles.back());
      }
    }
    if (!options_.joint.empty() && !stop_requested()) add_joint(captures, color, base.hash, out.knobs);
    out.stopped = stop_requested();
    return out;
  }

 private:
  // Knobs, and a search after them, with the work that each is expected to be.
  struct Steps {
    std::vector<std::string> titles;
    std::vector<double> works;
  };

  Steps steps_of(const std::vector<Block>& blocks) {
    Steps steps;
    std::set<std::string> missing, all;
    double work = 0;
    for (const Block& block : blocks) {
      steps.titles.push_back(block.knob.title);
      steps.works.push_back(expect_missing(block, missing));
      for (const Row& row : block.rows)
        if (all.insert(row.trial.hash).second) work += all_work(row.trial, place_);
    }
    if (!options_.search) return steps;
    steps.titles.emplace_back("combinations that were tried");
    steps.works.push_back(kExpectedSearch * work);
    return steps;
  }

  StepProgress progress_within(const Steps& steps, std::size_t step) const {
    const auto first = steps.works.begin();
    const double before = std::accumulate(first, first + static_cast<std::ptrdiff_t>(step), 0.0);
    const double work = steps.works[step], done = clock_.done();
    if (!options_.search || step + 1 < steps.works.size())
      return {steps.titles[step], work > 0 ? std::min(1.0, (done - before) / work) : 0,
              clock_.seconds_left(options_.search ? steps.works.back() : 0)};
    if (work <= 0) return {steps.titles[step]};
    // A search ends soon after the first good-enough combination, or runs to its last one.
    const double left = good_enough_ ? work / 4 : (before + kSearchedWork / kExpectedSearch * work - done) / 2;
    const double share = (done / (done + std::max(left, 0.0)) * (before + work) - before) / work;
    return {steps.titles[step], std::clamp(share, 0.0, 1.0), clock_.seconds_left(std::max(left, 0.0))};
  }

  // Tells the clock of the work of rows that are not known, which are known from then on, and whose results are not there.
  // Returns that work. Trials and records are known by their names.
  double expect_missing(const Block& block, std::set<std::string>& known) {
    const double before = clock_.left();
    for (const Row& row : block.rows) {
      const Trial& trial = row.trial;
      if (results_.contains(trial.hash) || !known.insert(trial.hash).second || points_.has(trial.hash)) continue;
      const TrialWork work = expected_work(trial, place_);
      clock_.expect(WorkKind::kRender, work.before);
      if (trial.timed && known.insert(record_name(trial)).second) clock_.expect(WorkKind::kRecord, work.record);
      clock_.expect(kind_of(trial), work.round * place_.rounds);
    }
    return clock_.left() - before;
  }

  TradeoffResult empty_result() const {
    return {.capture = options_.capture.filename().string(),
            .variant = options_.variant,
            .view = options_.view,
            .frame = place_.frame,
            .first_frame = place_.first_frame,
            .width = options_.width,
            .height = options_.height,
            .rounds = options_.rounds,
            .arguments = as_arguments(options_.base),
            .settings = options_.settings,
            .gpu = options_.gpu,
            .gpu_name = options_.gpu_name,
            .reference = std::nullopt,
            .knobs = {},
            .stopped = false};
  }

  // Measures the cost of each effect of the frame by leaving it out. Images are compared with the one that has all
  // effects.
  TradeoffResult run_effects(PackedCaptures& captures) {
    TradeoffResult out = empty_result();
    KnobSetting plain;
    plain.label = "all effects";
    Block block{{}, "", {}, false};
    block.knob.name = "effects";
    block.knob.title = "effects, each left out";
    block.knob.settings = {plain};
    Trial whole{options_.settings, options_.gpu, false, {}, false, false, {}, {}};
    name_trial(whole, place_);
    place_.reference = "the frame with all effects, " + whole.hash;
    const gpu::FrameResult frame = render_trial(captures, whole, place_);
    out.effects = effects_of(frame);
    block.rows.push_back(make_row(plain.label, {}, plain, block.knob));
    for (std::size_t e = 0; e < out.effects.size(); ++e) {
      if (!out.effects[e].ran) continue;
      const EffectCase& one = effect_cases()[e];
      Row row = make_row("without " + one.name, one.without, plain, block.knob);
      if (one.of_scene()) row.trial.left_out = one.name;
      name_trial(row.trial, place_);
      out.effects[e].setting = block.rows.size();
      block.rows.push_back(std::move(row));
    }
    out.stopped = !measure(captures, block, &frame.targets.color);
    if (out.stopped) return out;
    out.knobs.push_back(result_of(block, block.rows.front().trial.hash));
    KnobResult& knob = out.knobs.back();
    for (EffectResult& effect : out.effects) {
      if (!effect.setting) continue;
      const auto& figures = results_.at(block.rows[*effect.setting].trial.hash).figures;
      if (figures.contains(fmt::format("effect_places.{}.tiles", effect.name)))
        effect.stays = fmt::format("runs all the same with {}", effect.without);
      SettingResult& without = knob.settings[*effect.setting];
      if (!without.in_double && without.arguments.empty()) without.arguments = "(" + effect.without + ")";
      if (!effect.stays.empty()) effect.setting.reset();
    }
    return out;
  }

  void check() const {
    if (options_.settings.stereo.eye_separation > 0 && !options_.effects)
      throw UsageError("a tradeoff looks at one eye; stereo.eye_separation asks for two");
    if (options_.settings.procedures.style == tilecore::ProcedureSettings::Style::kLines && !options_.effects)
      throw UsageError("the reference has no ink lines; procedures.style=lines cannot be compared with it");
    if (!options_.settings.output.machine_model)
      throw UsageError("a tradeoff needs cycles and energy: output.machine_model must stay true");
    for (const std::string& name : options_.knobs) knob_named(name);
    for (const std::string& name : options_.joint)
      if (knob_named(name).timed)
        throw UsageError(fmt::format("--joint: {} is about how a frame is timed, not about the machine", name));
    // Scene, two images, histories; reading the capture checks its own memory.
    const std::uint64_t bytes =
        static_cast<std::uint64_t>(options_.width) * static_cast<std::uint64_t>(options_.height) * 512;
    if (bytes > options_.max_bytes)
      throw LimitError(fmt::format("{}: images of {}x{} need {} bytes, --max-memory allows {}",
                                   escape_control(options_.capture.string()), options_.width, options_.height, bytes,
                                   options_.max_bytes));
  }

  void place(const scene::Capture& capture) {
    const scene::CaptureSettings& own = capture.settings;
    place_.width = options_.width;
    place_.height = options_.height;
    place_.frame = options_.frame.value_or(own.first_frame + std::min(own.frame_count, options_.run) - 1);
    place_.first_frame = std::max(0, place_.frame - options_.run + 1);
    place_.rounds = options_.rounds;
    place_.inputs = capture_fingerprint(options_.capture) + program_fingerprint();
    if (options_.variant) place_.inputs += " variant " + *options_.variant;
    place_.inputs += view_arguments(options_.view);
    place_.reference = fmt::format("{} samples, {} dB, cells of {}", options_.reference_samples,
                                   options_.reference_enough_db, options_.reference_edge_pixels);
  }

  reference::Reference make_reference(const gpu::PreparedCapture& prepared) const {
    const reference::ReferenceSettings wanted{options_.width,
                                              options_.height,
                                              place_.frame,
                                              options_.reference_samples,
                                              options_.reference_edge_pixels,
                                              options_.reference_enough_db};
    reference::ReferenceProgress made;
    Progress progress(1, options_.quiet, [&] {
      return StepProgress(fmt::format("reference, {:.0f} %", std::floor(100 * made.share())), made.share());
    });
    reference::Reference out = reference_of(prepared, wanted, made);
    progress.update(1, "reference");
    return out;
  }

  reference::Reference reference_of(const gpu::PreparedCapture& prepared, const reference::ReferenceSettings& wanted,
                                    reference::ReferenceProgress& made) const {
    if (options_.kept_references.empty())
      return get_reference(prepared, options_.gpu, options_.settings, wanted, options_.folder, place_.inputs, &made);
    std::string scene = capture_fingerprint(options_.capture) + view_arguments(options_.view), note;
    if (options_.variant) scene += " variant " + *options_.variant;
    reference::Reference out =
        get_kept_reference(prepared, options_.gpu, options_.settings, wanted,
                           {options_.kept_references, options_.capture.stem().string(), scene}, note, &made);
    if (!note.empty()) say_notes({note});
    return out;
  }

  Row make_row(const std::string& label, KeyValues values, const KnobSetting& how, const Knob& of) const {
    if (how.ideal_registers) keep_register_silicon(options_.gpu, values);
    Row row{label, values, {options_.settings, options_.gpu, how.in_double, how.packing, of.stored, of.timed, ""}};
    apply(values, row.trial.settings, row.trial.gpu);
    name_trial(row.trial, place_);
    return row;
  }

  // A knob as measured here: without settings that continue from previous frames if there are none.
  Knob turned(const std::string& name) const {
    Knob knob = knob_named(name);
    if (place_.first_frame < place_.frame) return knob;
    for (std::size_t s = knob.settings.size(); s-- > 0;)
      if (knob.settings[s].goes_on && s != knob.against) {
        knob.settings.erase(knob.settings.begin() + static_cast<std::ptrdiff_t>(s));
        knob.against -= s < knob.against ? 1 : 0;
      }
    return knob;
  }

  std::vector<Block> plan(const gpu::PreparedCapture& prepared) const {
    scene::FrameRequest request = gpu::frame_request(prepared.capture, options_.gpu, options_.settings, options_.width,
                                                     options_.height, place_.frame);
    request.motion_segments = 2;  // wherever anything moves along a curve
    const auto frame = scene::pose_frame(
        prepared.scene(options_.settings.textures).assembly,
        gpu::frame_camera(prepared.capture, options_.settings, options_.width, options_.height), request);
    std::vector<Block> blocks;
    for (const Knob& knob : knobs()) {
      if (!options_.knobs.empty() &&
          std::find(options_.knobs.begin(), options_.knobs.end(), knob.name) == options_.knobs.end() &&
          std::find(options_.joint.begin(), options_.joint.end(), knob.name) == options_.joint.end())
        continue;
      Block block{turned(knob.name), why_without_effect(knob, *frame, place_.first_frame < place_.frame), {}, false};
      for (const KnobSetting& setting : block.knob.settings) {
        if (!block.skipped.empty()) break;
        KeyValues values = knob.context;
        values.insert(values.end(), setting.values.begin(), setting.values.end());
        block.rows.push_back(make_row(setting.label, values, setting, knob));
      }
      blocks.push_back(std::move(block));
    }
    return blocks;
  }

  // Returns false if a stop was requested before all of the block was measured; finished results are kept.
  bool measure(PackedCaptures& captures, const Block& block, const Image* reference) {
    std::vector<Trial> missing;
    std::set<std::string> asked;
    for (const Row& row : block.rows) {
      const std::string& hash = row.trial.hash;
      if (results_.contains(hash) || !asked.insert(hash).second) continue;
      if (points_.has(hash))
        results_[hash] = read_trial(points_.file(hash), row.trial.timed);
      else
        missing.push_back(row.trial);
    }
    for (auto first = missing.begin(); first != missing.end();) {
      const auto last = first + std::min<std::ptrdiff_t>(kTakingTurns, missing.end() - first);
      const std::vector<Trial> part(first, last);
      const std::vector<TrialResult> results = run_trials(captures, part, place_, reference, records_, clock_);
      if (results.empty()) return false;
      for (std::size_t t = 0; t < part.size(); ++t) {
        write_trial(points_.file(part[t].hash), results[t]);
        results_[part[t].hash] = results[t];
      }
      first = last;
    }
    return true;
  }

  KnobResult result_of(const Block& block, const std::string& base) const {
    KnobResult out{.name = block.knob.name,
                   .title = block.knob.title,
                   .context = as_arguments(block.knob.context),
                   .against = block.knob.against,
                   .visual = block.knob.visual,
                   .watched = block.knob.watched,
                   .watched_as = block.knob.watched_as,
                   .skipped = block.skipped,
                   .timed = block.knob.timed,
                   .idle = false,
                   .combines = block.combines,
                   .settings = {}};
    for (const Row& row : block.rows) {
      KeyValues all = options_.base;
      all.insert(all.end(), row.values.begin(), row.values.end());
      // Drops values that the chosen models do not read: the replay command would refuse them.
      std::erase_if(all, [&](const auto& value) { return !gpu::unread_because(row.trial.gpu, value.first).empty(); });
      SettingResult& setting = out.settings.emplace_back();
      setting.label = row.label;
      setting.arguments = as_arguments(all);
      if (const std::string packing = row.trial.packing.arguments(); !packing.empty())
        setting.arguments =
            fmt::format("(pack {}){}{}", packing, setting.arguments.empty() ? "" : " ", setting.arguments);
      setting.is_base = row.trial.hash == base;
      setting.in_double = row.trial.in_double;
      setting.measured = measurement_of(results_.at(row.trial.hash), block.knob.watched, row.trial.gpu.clock_mhz);
    }
    judge(out);
    return out;
  }

  // A knob of a joint search.
  struct JointAxis {
    std::string title;
    std::vector<KnobSetting> settings;  // the ones on its own front of error against time, and the requested one
    std::optional<std::size_t> base;    // index into `settings`: the requested one
    bool later = false;                 // turned where the others are at their best: see add_joint()
  };

  JointAxis joint_axis(const Knob& knob, const KnobResult& result) const {
    JointAxis axis{knob.title, {}, {}, false};
    for (std::size_t s = 0; s < knob.settings.size(); ++s) {
      const SettingResult& measured = result.settings[s];
      if (measured.in_double || !(measured.on_front(Cost::kMs).value_or(false) || measured.is_base)) continue;
      if (measured.is_base) axis.base = axis.settings.size();
      axis.settings.push_back(in_context(knob, knob.settings[s]));
    }
    axis.later = axis.base.has_value() && uses_history(knob);
    return axis;
  }

  // Settings of several knobs at once, of which one at most packs the capture.
  Row combined_row(const std::vector<KnobSetting>& settings) const {
    KnobSetting all;
    for (const KnobSetting& setting : settings) {
      all.label += (all.label.empty() ? "" : " | ") + setting.label;
      all.values.insert(all.values.end(), setting.values.begin(), setting.values.end());
      if (setting.packing.bits > 0) all.packing = setting.packing;
    }
    return make_row(all.label, all.values, all, {});
  }

  static KnobSetting in_context(const Knob& knob, KnobSetting setting) {
    setting.values.insert(setting.values.begin(), knob.context.begin(), knob.context.end());
    return setting;
  }

  // Whether the knob's settings, alone and combined with other knobs', give ordinary frames: the image is not the
  // stored one, nothing is packed, and none of its keys is in `keys`, to which they are added.
  static bool combines(const Knob& knob, std::set<std::string>& keys) {
    std::set<std::string> own;
    for (const KnobSetting& setting : knob.settings) {
      if (setting.packing.bits > 0) return false;
      for (const auto& [key, value] : in_context(knob, setting).values) own.insert(key);
    }
    if (knob.stored || knob.timed ||
        std::any_of(own.begin(), own.end(), [&](const auto& k) { return keys.contains(k); }))
      return false;
    keys.insert(own.begin(), own.end());
    return true;
  }

  // The axes of the requested knobs, the later ones last. A knob without effect here has no axis.
  std::vector<JointAxis> joint_axes(const std::vector<KnobResult>& results) const {
    std::vector<JointAxis> axes;
    std::set<std::string> keys;
    for (const std::string& name : options_.joint) {
      const auto result =
          std::find_if(results.begin(), results.end(), [&](const KnobResult& r) { return r.name == name; });
      if (result == results.end() || !result->skipped.empty() || result->idle) continue;
      const Knob knob = turned(name);
      axes.push_back(joint_axis(knob, *result));
      const bool packs = std::any_of(knob.settings.begin(), knob.settings.end(),
                                     [](const KnobSetting& setting) { return setting.packing.bits > 0; });
      if (packs && !keys.insert("bits of packed attributes").second)
        throw UsageError("--joint: bits of packed attributes would be set by two of the knobs");
      std::set<std::string> own;
      for (const KnobSetting& setting : axes.back().settings)
        for (const auto& [key, value] : setting.values) own.insert(key);
      for (const std::string& key : own)
        if (!keys.insert(key).second)
          throw UsageError(fmt::format("--joint: {} would be set by two of the knobs", key));
    }
    std::stable_partition(axes.begin(), axes.end(), [](const JointAxis& axis) { return !axis.later; });
    return axes;
  }

  // Measures all combinations of the axes of the requested knobs. Knobs that continue from previous frames cost many
  // frames per trial: they first stay as requested, and are then varied at the combinations on the front.
  void add_joint(PackedCaptures& captures, const Image* reference, const std::string& base,
                 std::vector<KnobResult>& results) {
    const std::vector<JointAxis> axes = joint_axes(results);
    if (axes.empty()) return;
    Block block{{}, "", {}, false};
    block.knob.name = "joint";
    block.combines = true;
    std::vector<std::vector<KnobSetting>> first;
    for (const JointAxis& axis : axes) {
      block.knob.title += (block.knob.title.empty() ? "" : ", ") + axis.title;
      first.push_back(axis.later ? std::vector<KnobSetting>{axis.settings[*axis.base]} : axis.settings);
    }
    std::vector<std::vector<KnobSetting>> tried = combinations_of(first);
    if (!measure_joint(captures, block, tried, reference, base)) return;
    if (axes.back().later) {
      std::vector<std::vector<KnobSetting>> more;
      for (const std::size_t row : unbeaten(block)) {
        std::vector<std::vector<KnobSetting>> around;
        for (std::size_t a = 0; a < axes.size(); ++a)
          around.push_back(axes[a].later ? axes[a].settings : std::vector<KnobSetting>{tried[row][a]});
        for (std::vector<KnobSetting>& settings : combinations_of(around)) more.push_back(std::move(settings));
      }
      if (!measure_joint(captures, block, more, reference, base)) return;
    }
    results.push_back(result_of(block, base));
  }

  // Adds a row for each combination that has none, and measures them. False when asked to stop.
  bool measure_joint(PackedCaptures& captures, Block& block, const std::vector<std::vector<KnobSetting>>& tried,
                     const Image* reference, const std::string& base) {
    std::set<std::string> rows;
    for (const Row& row : block.rows) rows.insert(row.trial.hash);
    const bool further = !rows.empty();
    if (const std::size_t count = rows.size() + tried.size(); count > options_.max_points)
      throw LimitError(fmt::format("--joint: {} combinations, --max-points allows {}", count, options_.max_points));
    for (const std::vector<KnobSetting>& settings : tried) {
      Row row = combined_row(settings);
      if (further && !rows.insert(row.trial.hash).second) continue;
      if (row.trial.hash == base) block.knob.against = block.rows.size();
      block.rows.push_back(std::move(row));
    }
    std::set<std::string> known;
    const double work = expect_missing(block, known), before = clock_.done();
    const std::string text = fmt::format("{} combinations", block.rows.size());
    Progress progress(1, options_.quiet, [&] {
      return StepProgress(text, work > 0 ? (clock_.done() - before) / work : 0, clock_.seconds_left());
    });
    if (!measure(captures, block, reference)) return false;
    progress.update(1, text);
    return true;
  }

  // The rows that no other beats in time and either error.
  std::vector<std::size_t> unbeaten(const Block& block) const {
    std::vector<ErrorAndCost> by_flip, by_psnr;
    for (const Row& row : block.rows) {
      const Measurement m = measurement_of(results_.at(row.trial.hash), "", row.trial.gpu.clock_mhz);
      by_flip.push_back({m.error->flip, m.ms.value_or(0)});
      by_psnr.push_back({-m.error->psnr_db.value_or(std::numeric_limits<double>::infinity()), m.ms.value_or(0)});
    }
    const std::vector<bool> flip = pareto_front(by_flip), psnr = pareto_front(by_psnr);
    std::vector<std::size_t> rows;
    for (std::size_t row = 0; row < block.rows.size(); ++row)
      if (flip[row] || psnr[row]) rows.push_back(row);
    return rows;
  }

  // Tries combinations of settings: the cheapest one that should be good enough, by the measurements so far, until no
  // remaining one should be cheaper than the best; before one is good enough, the one that should come nearest. Ends
  // when the expected work of all tries reaches `max_work`.
  void add_search(PackedCaptures& captures, const Image* reference, const std::string& base, double max_work,
                  std::vector<KnobResult>& results) {
    std::vector<KnobResult> searched;
    std::set<std::string> keys;
    for (const KnobResult& knob : results)
      if (knob.skipped.empty() && combines(turned(knob.name), keys)) searched.push_back(knob);
    if (searched.empty()) return;
    Block block{{}, "", {}, false};
    block.knob.name = "search";
    block.combines = true;
    block.knob.title = "combinations that were tried";
    CombinationSearch search(searched, *options_.search);
    double work = 0;
    while (block.rows.size() < kSearched && work < max_work) {
      good_enough_ = search.found();
      const auto next = search.next();
      if (!next) break;
      std::vector<KnobSetting> settings;
      for (std::size_t k = 0; k < searched.size(); ++k) {
        const Knob knob = turned(searched[k].name);
        settings.push_back(in_context(knob, knob.settings[(*next)[k]]));
      }
      Block one{block.knob, "", {combined_row(settings)}, true};
      if (!measure(captures, one, reference)) break;
      const Trial& trial = one.rows.front().trial;
      work += all_work(trial, place_);
      search.add(*next, measurement_of(results_.at(trial.hash), "", trial.gpu.clock_mhz));
      block.rows.push_back(one.rows.front());
    }
    if (!block.rows.empty()) results.push_back(result_of(block, base));
  }

  const TradeoffOptions& options_;
  PointFiles points_;
  TrialPlace place_;
  FrameRecords records_;
  std::map<std::string, TrialResult> results_;  // by hash
  WorkClock clock_;                             // clock of the work in this run
  std::atomic<bool> good_enough_{false};        // a search has found a good-enough combination
};

}  // namespace

TradeoffResult run_tradeoff(const TradeoffOptions& options) { return Tradeoff(options).run(); }

}  // namespace tessera::replay
