#include "replay/sweep/rendered_point.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/image_codec.h"
#include "base/output_file.h"
#include "baselines/baseline_set.h"
#include "gpu/device.h"
#include "gpu/record_file.h"
#include "gpu/shading_paths.h"
#include "gpu/tile_memory.h"
#include "replay/frame_files.h"
#include "replay/machine_report.h"
#include "replay/statistics.h"
#include "shaders_cpp/tone_map.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

// Members of a frame that depend on the machine's timing keys.
constexpr std::array<const char*, 4> kTimedMembers = {"timing", "energy", "area", "split"};

void write_images(const PointRender& how, const SweepPoint& point, const PointConfiguration& configuration,
                  float own_exposure, const gpu::FrameResult& result) {
  const float exposure = configuration.settings.output.exposure > 0
                             ? static_cast<float>(configuration.settings.output.exposure)
                             : own_exposure;
  write_png(how.images->image_file(point.hash, result.frame), shaders::to_display(result.targets.color, exposure));
  write_file_atomically(how.images->tiles_file(point.hash, result.frame), tile_maps_json(result.frame, result.maps));
}

// Frames as a record's head has them: {"frame", "counters", ...}.
bool are_frames(const json& frames) {
  return frames.is_array() && std::all_of(frames.begin(), frames.end(), [](const json& frame) {
           return frame.is_object() && frame.contains("frame") && frame["frame"].is_number_integer();
         });
}

}  // namespace

void ImageMemory::take(std::uint64_t bytes) {
  if (bytes > max_)
    throw LimitError(fmt::format("the images of a point need {} bytes, --max-memory allows {}", bytes, max_));
  std::unique_lock lock(mutex_);
  returned_.wait(lock, [&] { return free_ >= bytes; });
  free_ -= bytes;
}

void ImageMemory::give(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  free_ += bytes;
  returned_.notify_all();
}

RenderedPoint render_point(const PointRender& how, const SweepPoint& point, const CaptureLibrary::Loaded& capture,
                           ImageMemory& memory, double& seconds) {
  const Study& study = how.study;
  const PointConfiguration configuration = configure_point(study, point.steps);
  const scene::CaptureSettings& own = capture.capture->settings;
  const gpu::RunSettings settings = gpu::follow_passes(*capture.capture, configuration.settings);
  if (configuration.chosen_tile_memory) gpu::check_tile_memory(configuration.gpu, settings);
  gpu::RenderRequest request;
  request.width = configuration.size ? configuration.size->width : own.width;
  request.height = configuration.size ? configuration.size->height : own.height;
  request.region = {0, 0, request.width, request.height};
  request.record_items = how.items;
  struct Reserved {
    ImageMemory& memory;
    std::uint64_t bytes;
    ~Reserved() { memory.give(bytes); }
  };
  // Colour and its encoded copies; the baselines render once more.
  const std::uint64_t bytes = static_cast<std::uint64_t>(request.width) * static_cast<std::uint64_t>(request.height) *
                              (study.baselines ? 64 : 32);
  memory.take(bytes);
  const Reserved reserved{memory, bytes};
  gpu::Device device(capture.prepared, configuration.gpu, settings, request);
  baselines::BaselineObserver schemes;
  if (study.baselines) device.set_observer(&schemes);
  FrameRange range = study.frames.value_or(FrameRange{own.first_frame, own.first_frame + own.frame_count});
  range = how.frames.value_or(range);

  RenderedPoint out{json::array(), nullptr, {}};
  if (how.head || !study.splits.empty())
    out.head = gpu::record_head(study.capture_names[point.capture], device.assembly(), configuration.gpu, settings,
                                request.width, request.height);
  for (int frame = range.first; frame < range.last; ++frame) {
    const Stopwatch watch;
    gpu::FrameResult result = device.render(frame);
    seconds += watch.seconds();
    out.frames.push_back(frame_json(configuration.gpu, result, study.baselines ? &schemes.last() : nullptr));
    std::vector<timing::FrameWork>& work = out.work.emplace_back();
    if (result.model) work.push_back(std::move(result.model->record.work));
    if (result.right && result.right->work) work.push_back(std::move(*result.right->work));
    if (study.images && how.images != nullptr) write_images(how, point, configuration, own.exposure, result);
  }
  if (!study.splits.empty()) out.frames = timed_frames(study, configuration.gpu, out);
  return out;
}

json timed_frames(const Study& study, const gpu::GpuConfiguration& gpu, const RenderedPoint& rendered) {
  json frames = rendered.frames;
  gpu::CachesOfFrames caches;
  for (std::size_t f = 0; f < rendered.work.size(); ++f) {
    if (rendered.work[f].empty()) continue;
    json& frame = frames.at(f);
    json splits = json::object();
    gpu::EachView each;
    if (!study.splits.empty())
      each = [&](const timing::FrameWork& work, const gpu::ViewCost& cost, const timing::WarmCaches& before) {
        for (const Split split : study.splits)
          splits[std::string(name(split))].push_back(split_rows(split, rendered.head, gpu, work, cost, before));
      };
    const gpu::FrameCost cost =
        gpu::frame_cost(gpu, rendered.work[f], caches.of_frame(gpu, frame["frame"].get<int>()), each);
    put_model(gpu, cost.timing, cost.energy, 1, frame);
    frame["area"] = area_json(cost.area);
    if (each) frame["split"] = std::move(splits);
  }
  return frames;
}

void write_render_record(const SweepFolder& folder, const std::string& function, const gpu::GpuConfiguration& gpu,
                         const RenderedPoint& rendered) {
  json head = rendered.head;
  head["gpu"] = gpu::gpu_json(gpu);
  head["frames"] = rendered.frames;
  for (json& frame : head["frames"])
    for (const char* member : kTimedMembers) frame.erase(member);
  const std::filesystem::path file = folder.record_file(function);
  make_folder(file.parent_path());
  gpu::RecordWriter writer(file, head);
  for (std::size_t f = 0; f < rendered.work.size(); ++f) {
    std::vector<const timing::FrameWork*> views;
    for (const timing::FrameWork& work : rendered.work[f]) views.push_back(&work);
    writer.add(rendered.frames.at(f).at("frame").get<int>(), views);
  }
  writer.commit();
}

std::optional<RenderedPoint> read_render_record(const SweepFolder& folder, const std::string& function,
                                                std::uint64_t max_bytes) {
  const std::filesystem::path file = folder.record_file(function);
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return std::nullopt;
  try {
    gpu::RecordReader reader(file, max_bytes);
    RenderedPoint rendered{reader.head().value("frames", json()), reader.head(), {}};
    rendered.head.erase("frames");
    if (!are_frames(rendered.frames)) return std::nullopt;
    while (std::optional<gpu::RecordedFrame> frame = reader.next()) rendered.work.push_back(std::move(frame->views));
    if (rendered.work.size() != rendered.frames.size()) return std::nullopt;
    return rendered;
  } catch (const InputError&) {
    return std::nullopt;
  } catch (const LimitError&) {
    return std::nullopt;
  }
}

}  // namespace tessera::replay
