#include "replay/tradeoff/trial.h"

#include <chrono>
#include <cmath>
#include <map>
#include <optional>

#include "base/check.h"
#include "base/image_metrics.h"
#include "base/json_text.h"
#include "base/sha256.h"
#include "base/thread_clock.h"
#include "gpu/machine_model.h"
#include "gpu/record_file.h"
#include "gpu/view_inputs.h"
#include "reference/reference_renderer.h"
#include "reference/reference_store.h"
#include "replay/progress.h"
#include "replay/statistics.h"
#include "replay/sweep/columns.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Adds a round when it ends.
class RoundTimer {
 public:
  explicit RoundTimer(RoundTimes& host)
      : host_(host), processor_(process_seconds()), start_(std::chrono::steady_clock::now()) {}
  ~RoundTimer() {
    host_.wall_seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count());
    host_.processor_seconds.push_back(process_seconds() - processor_);
  }
  RoundTimer(const RoundTimer&) = delete;
  RoundTimer& operator=(const RoundTimer&) = delete;

 private:
  RoundTimes& host_;
  double processor_;
  std::chrono::steady_clock::time_point start_;
};

// All numbers of a frame but zeros, and the size of the capture's files.
std::map<std::string, Figure> figures_of(const hardware::Machine& gpu, const gpu::FrameResult& frame,
                                         const scene::Capture& capture) {
  std::map<std::string, Figure> figures;
  figures["capture.file_bytes"] = capture.file_bytes;
  for (const auto& [name, value] : frame_values(frame_json(gpu, frame)))
    if (value.is_number() && value != 0) {
      if (value.is_number_float())
        figures[name] = value.get<double>();
      else
        figures[name] = value.get<std::uint64_t>();  // counts, bytes, cycles: never below 0
    }
  return figures;
}

// Whether the compared frame continues from the previous frames.
bool goes_on(const Trial& trial, const TrialPlace& place) {
  return trial.settings.resolve.desampling == tilecore::Desampling::kAdaptive && !trial.in_double &&
         place.first_frame < place.frame;
}

class Runner {
 public:
  Runner(PackedCaptures& captures, const TrialPlace& place, const Image* reference, const gpu::RunSettings& settings,
         FrameRecords& records, WorkClock& clock)
      : captures_(captures),
        records_(records),
        clock_(clock),
        place_(place),
        exposure_(settings.output.exposure > 0 ? static_cast<float>(settings.output.exposure)
                                               : captures.original()->capture.settings.exposure),
        reference_(reference != nullptr ? reference::display_values(*reference, exposure_) : Image()) {}

  // Renders the frames before the compared one, whose history it needs.
  void prepare(const Trial& trial, std::optional<tilecore::History>& history) {
    if (!goes_on(trial, place_)) return;
    const auto start = std::chrono::steady_clock::now();
    gpu::RunSettings settings = trial.settings;
    settings.output.machine_model = false;  // the times of these frames are not needed
    gpu::Device renderer(prepared(trial), trial.gpu, settings, request());
    for (int frame = place_.first_frame; frame < place_.frame; ++frame) renderer.render(frame);
    history = renderer.history();
    clock_.finish(WorkKind::kRender, expected_work(trial, place_).before, seconds_since(start));
  }

  void run(const Trial& trial, const std::optional<tilecore::History>& history, TrialResult& result) {
    const auto start = std::chrono::steady_clock::now();
    record_seconds_ = 0;
    run_round(trial, history, result);
    clock_.finish(kind_of(trial), expected_work(trial, place_).round, seconds_since(start) - record_seconds_);
  }

  void run_round(const Trial& trial, const std::optional<tilecore::History>& history, TrialResult& result) {
    if (trial.timed) {
      name(time(trial, history, result), result);
      return;
    }
    Image image = trial.in_double ? render_in_double(trial, result.host) : render(trial, history, result);
    if (trial.stored) store(trial.gpu.frame_buffer.format, image);
    name(image, result);
    if (!errors_.contains(result.image_sha256)) errors_[result.image_sha256] = measure(image);
    result.error = errors_[result.image_sha256];
  }

  gpu::FrameResult render_once(const Trial& trial) {
    std::optional<tilecore::History> history;
    prepare(trial, history);
    gpu::Device renderer(prepared(trial), trial.gpu, trial.settings, request());
    if (history) renderer.set_history(*history);
    return renderer.render(place_.frame);
  }

 private:
  const std::shared_ptr<const gpu::PreparedCapture>& prepared(const Trial& trial) const {
    return trial.left_out.empty() ? captures_.of(trial.packing) : captures_.without(trial.left_out);
  }

  void store(tilecore::FrameFormat format, Image& image) const {
    const tilecore::PixelCoder coder(format, exposure_);
    for (std::size_t p = 0; p + 3 < image.values.size(); p += 4) {
      float* const v = &image.values[p];
      const Vec4 held = coder.stored({v[0], v[1], v[2], v[3]});
      std::copy_n(&held.x, 4, v);
    }
  }

  static void name(const Image& image, TrialResult& result) {
    const std::string digits = values_sha256(image);
    TESSERA_CHECK(result.image_sha256.empty() || result.image_sha256 == digits, "a frame rendered again is the same");
    result.image_sha256 = digits;
  }

  gpu::RenderRequest request() const {
    gpu::RenderRequest out;
    out.width = place_.width;
    out.height = place_.height;
    out.region = {0, 0, place_.width, place_.height};
    return out;
  }

  Image render(const Trial& trial, const std::optional<tilecore::History>& history, TrialResult& result) {
    const std::shared_ptr<const gpu::PreparedCapture>& drawn = prepared(trial);
    gpu::Device renderer(drawn, trial.gpu, trial.settings, request());
    if (history) renderer.set_history(*history);
    std::optional<gpu::FrameResult> frame;
    {
      const RoundTimer timer(result.host);
      frame.emplace(renderer.render(place_.frame));
    }
    if (result.figures.empty()) result.figures = figures_of(trial.gpu, *frame, drawn->capture);
    return std::move(frame->targets.color);
  }

  // Cycles and energy alone: finding the bound takes as long again for each unit.
  const Image& time(const Trial& trial, const std::optional<tilecore::History>& history, TrialResult& result) {
    const FrameRecords::Record& record = record_of(trial, history);
    gpu::CycleCost cost;
    {
      const RoundTimer timer(result.host);
      cost = gpu::cycle_cost(trial.gpu, record.views);
    }
    result.figures = record.figures;
    result.figures["timing.cycles"] = static_cast<std::uint64_t>(std::ceil(cost.cycles));
    result.figures["energy.total_nj"] = cost.energy_nj;
    return record.color;
  }

  const FrameRecords::Record& record_of(const Trial& trial, const std::optional<tilecore::History>& history) {
    const std::string name = record_name(trial);
    if (const auto known = records_.known.find(name); known != records_.known.end()) return known->second;
    const auto start = std::chrono::steady_clock::now();
    const std::shared_ptr<const gpu::PreparedCapture>& drawn = prepared(trial);
    gpu::RenderRequest wanted = request();
    wanted.record_items = true;
    gpu::GpuConfiguration gpu = trial.gpu;
    gpu.queues.model = hardware::TimingModel::kPhases;  // here, its own timing is of no account
    gpu::Device renderer(drawn, gpu, trial.settings, wanted);
    if (history) renderer.set_history(*history);
    gpu::FrameResult frame = renderer.render(place_.frame);
    FrameRecords::Record& record = records_.known[name];
    record.figures = figures_of(trial.gpu, frame, drawn->capture);
    std::erase_if(record.figures, [](const auto& figure) {
      return figure.first.starts_with("timing.") || figure.first.starts_with("energy.");
    });
    record.views.push_back(std::move(frame.model->record.work));
    record.color = std::move(frame.targets.color);
    const double seconds = seconds_since(start);
    record_seconds_ += seconds;
    clock_.finish(WorkKind::kRecord, expected_work(trial, place_).record, seconds);
    return record;
  }

  Image render_in_double(const Trial& trial, RoundTimes& host) const {
    const gpu::PreparedCapture& prepared = *captures_.original();
    const RoundTimer timer(host);
    return reference::render_machines_samples(prepared.scene(trial.settings.textures).assembly, trial.gpu,
                                              trial.settings, place_.width, place_.height, place_.frame);
  }

  ImageError measure(const Image& image) const {
    const Image shown = reference::display_values(image, exposure_);
    const double db = psnr(reference_, shown);
    return {std::isinf(db) ? std::nullopt : std::optional(db), mssim(reference_, shown),
            mean_value(flip_map(reference_, shown)), max_difference(reference_, shown)};
  }

  PackedCaptures& captures_;
  FrameRecords& records_;
  WorkClock& clock_;
  double record_seconds_ = 0;  // time of the current round that went into its record
  const TrialPlace& place_;
  float exposure_;
  Image reference_;                           // as shown
  std::map<std::string, ImageError> errors_;  // of images that were measured
};

}  // namespace

// The factors are fitted to eight captures at 320x180 (docs/images/accuracy/all.csv): 64 samples take 1.8 to 7 times
// the host time of four. The factor of the double-precision frame is a guess.
TrialWork expected_work(const Trial& trial, const TrialPlace& place) {
  const double frame = 0.65 + 0.085 * trial.settings.sampling.samples_per_pixel;
  TrialWork work;
  if (goes_on(trial, place)) work.before = 0.5 * frame * (place.frame - place.first_frame);  // untimed
  if (trial.timed) work.record = frame;
  work.round = trial.timed ? 0.1 : trial.in_double ? 4 * frame : frame;
  return work;
}

WorkKind kind_of(const Trial& trial) {
  return trial.timed ? WorkKind::kTiming : trial.in_double ? WorkKind::kInDouble : WorkKind::kRender;
}

std::string record_name(const Trial& trial) {
  return json_text(gpu::functional_json(trial.gpu, trial.settings)) + trial.packing.arguments();
}

double all_work(const Trial& trial, const TrialPlace& place) {
  const TrialWork work = expected_work(trial, place);
  return work.before + work.round * place.rounds;
}

void name_trial(Trial& trial, const TrialPlace& place) {
  json inputs = {{"schema", "tessera.trial/1"},
                 {"inputs", place.inputs},
                 {"size", {place.width, place.height}},
                 {"frame", place.frame},
                 {"rounds", place.rounds},
                 {"in_double", trial.in_double},
                 {"gpu", gpu::gpu_json(trial.gpu)},
                 {"settings", gpu::settings_json(trial.settings)}};
  if (trial.settings.resolve.desampling == tilecore::Desampling::kAdaptive) inputs["first_frame"] = place.first_frame;
  if (trial.timed)
    inputs["timed"] = true;
  else
    inputs["reference"] = place.reference;
  if (trial.stored) inputs["stored"] = true;
  if (trial.packing.bits > 0) inputs["packing"] = trial.packing.arguments();
  if (!trial.left_out.empty()) inputs["left_out"] = trial.left_out;
  trial.hash = sha256_name(json_text(inputs));
}

std::string values_sha256(const Image& image) {
  Sha256 hash;
  hash.add({reinterpret_cast<const std::uint8_t*>(image.values.data()), image.values.size() * sizeof(float)});
  return hash.finish();
}

gpu::FrameResult render_trial(PackedCaptures& captures, const Trial& trial, const TrialPlace& place) {
  FrameRecords none;
  WorkClock nobody;
  return Runner(captures, place, nullptr, trial.settings, none, nobody).render_once(trial);
}

std::vector<TrialResult> run_trials(PackedCaptures& captures, const std::vector<Trial>& trials, const TrialPlace& place,
                                    const Image* reference_linear, FrameRecords& records, WorkClock& clock) {
  std::vector<TrialResult> results(trials.size());
  if (trials.empty()) return results;
  for (const Trial& trial : trials) gpu::check_gpu(trial.gpu);
  Runner runner(captures, place, reference_linear, trials.front().settings, records, clock);
  std::vector<std::optional<tilecore::History>> histories(trials.size());
  for (std::size_t t = 0; t < trials.size(); ++t) {
    if (stop_requested()) return {};
    runner.prepare(trials[t], histories[t]);
  }
  for (int round = 0; round < place.rounds; ++round)
    for (std::size_t t = 0; t < trials.size(); ++t) {
      if (stop_requested()) return {};
      runner.run(trials[t], histories[t], results[t]);
    }
  return results;
}

}  // namespace tessera::replay
