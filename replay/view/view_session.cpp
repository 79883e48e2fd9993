#include "replay/view/view_session.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/error.h"
#include "base/image_codec.h"
#include "base/text.h"
#include "gpu/frame_timeline.h"
#include "gpu/image_bytes.h"
#include "gpu/machine_model.h"
#include "gpu/record_file.h"
#include "replay/commands.h"
#include "replay/frame_costs.h"
#include "replay/frame_files.h"
#include "replay/left_out.h"
#include "replay/pixel_history.h"
#include "replay/statistics.h"
#include "shaders_cpp/tone_map.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMaxHistory = 500;
constexpr const char* kMeasuring = "measuring";

double seconds_from(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// Figures of a card; where events were simulated, bytes are counted in simulated time.
json summary_json(const json& total, const gpu::FrameResult& frame, const gpu::GpuConfiguration& gpu) {
  const json& timing = total.at("timing");
  const auto bytes = [&]() -> std::uint64_t {
    if (const auto events = timing.find("events"); events != timing.end())
      return events->at("dram_read_bytes").get<std::uint64_t>() + events->at("dram_written_bytes").get<std::uint64_t>();
    const json& counters = total.at("counters");
    return counters.value("dram.read_bytes", std::uint64_t{0}) + counters.value("dram.written_bytes", std::uint64_t{0});
  };
  return {{"cycles", timing.at("cycles")},
          {"ms", frame.model->timing.cycles / gpu.clock_mhz * 1e-3},
          {"energy_nj", total.at("energy").at("total_nj")},
          {"dram_bytes", bytes()},
          {"bound_by", timing.at("bound_by")},
          {"coarser_models", timing.at("coarser_models")}};
}

json view_json(const gpu::FrameResult& frame, const IntRect& region) {
  return {{"label", fmt::format("frame {}", frame.frame)},
          {"frame", frame.frame},
          {"size", {region.width(), region.height()}},
          {"region", {region.x0, region.y0}}};
}

}  // namespace

struct ViewSession::Rendering {
  ViewPoint point;
  gpu::FrameResult frame;  // without images and record
  std::vector<timing::FrameWork> views;
  ViewImage image;
  DrawableNames names;
  gpu::CostAttribution shares;
  gpu::FrameTimeline timeline;  // of the left eye
  PixelHistory pixels;          // as well
};

ViewSession::ViewSession(ViewStart start, std::uint64_t max_bytes)
    : space_(std::move(start)),
      max_bytes_(max_bytes),
      prepared_(std::make_shared<const gpu::PreparedCapture>(*space_.start().capture)),
      wanted_(space_.start_point()) {
  wanted_.revision = 1;
  set_phase(wanted_, "rendering");
}

ViewSession::~ViewSession() { stop(); }

void ViewSession::run(Told told) {
  told_ = std::move(told);
  worker_ = std::thread([this] { work(); });
}

void ViewSession::stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
    if (device_ != nullptr) device_->abandon();
    end_measuring();
  }
  changed_.notify_all();
  if (worker_.joinable()) worker_.join();
}

bool ViewSession::wait_for_start(int milliseconds) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::milliseconds(milliseconds), [&] { return result_ || start_failure_; });
  if (start_failure_) std::rethrow_exception(start_failure_);
  return result_ != nullptr;
}

std::uint64_t ViewSession::request(const json& changes, bool keep) {
  std::uint64_t revision = 0;
  {
    const std::lock_guard lock(mutex_);
    ViewPoint next = space_.changed(wanted_, changes);
    next.keep = keep;
    next.revision = wanted_.revision + 1;
    if (next.frame == wanted_.frame && next.changes == wanted_.changes) {
      wanted_.keep |= keep;
      if (keep && result_ && result_->revision == wanted_.revision) remember(*result_);
      return wanted_.revision;
    }
    wanted_ = std::move(next);
    revision = wanted_.revision;
    if (device_ != nullptr && !in_hand_->renders_as(wanted_)) device_->abandon();
    end_measuring();
  }
  changed_.notify_all();
  return revision;
}

void ViewSession::measure_without(const json& part) {
  std::optional<DrawableName> only;
  if (!part.is_object()) throw UsageError("without: expected {} or the names of a drawable");
  if (!part.empty()) {
    const auto text = [&](const char* member) {
      const auto at = part.find(member);
      if (at == part.end() || !at->is_string() || part.size() != 2)
        throw UsageError("without: a drawable has the texts \"node\" and \"material\"");
      return at->get<std::string>();
    };
    only = DrawableName{text("node"), text("material")};
  }
  {
    const std::lock_guard lock(mutex_);
    if (!result_) throw UsageError("without: the first frame is being rendered");
    if (only) {
      const json& drawables = result_->stats.at("frames").at(0).at("drawables");
      if (std::none_of(drawables.begin(), drawables.end(), [&](const json& row) {
            return row.at("node") == only->node && row.at("material") == only->material;
          }))
        throw UsageError(fmt::format("without: the frame draws no {} / {}", escape_control(only->node, 60),
                                     escape_control(only->material, 60)));
    }
    end_measuring();
    left_out_wanted_ = LeftOutWanted{std::move(only)};
    left_out_ = {
        {"revision", wanted_.revision}, {"phase", kMeasuring}, {"done", 0}, {"all", 0}, {"rows", json::array()}};
  }
  changed_.notify_all();
}

void ViewSession::cancel_measuring() {
  const std::lock_guard lock(mutex_);
  end_measuring();
}

void ViewSession::end_measuring() {
  left_out_wanted_.reset();
  end_measuring_ = true;
  if (measuring_ != nullptr) measuring_->abandon();
  if (left_out_.value("phase", "") == kMeasuring) left_out_["phase"] = "cancelled";
}

json ViewSession::left_out() const {
  const std::lock_guard lock(mutex_);
  return left_out_;
}

std::shared_ptr<const ViewResult> ViewSession::result() const {
  const std::lock_guard lock(mutex_);
  return result_;
}

json ViewSession::state() const {
  const std::lock_guard lock(mutex_);
  json state = state_;
  if (device_ != nullptr && state.at("phase") == "rendering") {
    state["done"] = device_->progress().done();
    state["tiles"] = device_->progress().tiles();
  }
  return state;
}

json ViewSession::history() const {
  const std::lock_guard lock(mutex_);
  return history_;
}

void ViewSession::work() {
  for (std::uint64_t served = 0;;) {
    ViewPoint point;
    std::optional<LeftOutWanted> without;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return stop_ || wanted_.revision != served || left_out_wanted_; });
      if (stop_) return;
      point = wanted_;
      if (point.revision == served) {
        without = std::exchange(left_out_wanted_, std::nullopt);
        end_measuring_ = false;
        left_out_["revision"] = result_->revision;
      }
    }
    if (without) {
      leave_out(without->only);
      continue;
    }
    served = point.revision;
    try {
      serve(point);
    } catch (const gpu::Abandoned&) {
      // Abandoned for a newer request, or for the end.
    } catch (const std::exception& error) {
      set_phase(point, "failed", escape_control(error.what(), 400));
      const std::lock_guard lock(mutex_);
      if (!result_) start_failure_ = std::current_exception();
      changed_.notify_all();
    }
  }
}

void ViewSession::serve(const ViewPoint& point) {
  if (can_time(point)) {
    const bool stale = !rendering_->point.renders_as(point);
    time(point, stale);
    const std::lock_guard lock(mutex_);
    if (!stale || wanted_.revision != point.revision) return;
  }
  render(point);
}

bool ViewSession::can_time(const ViewPoint& point) const {
  if (!rendering_ || rendering_->point.frame != point.frame) return false;
  // The caches left by previous frames belong to the machine that rendered them.
  if (point.gpu.queues.caches != hardware::FrameCaches::kEmpty &&
      point.first_frame(space_.start().warmup) < point.frame)
    return false;
  try {
    gpu::check_same_function({{"function", rendering_->point.function}}, point.gpu, point.settings);
    return true;
  } catch (const UsageError&) {
    return false;
  }
}

void ViewSession::time(const ViewPoint& point, bool stale) {
  const Clock::time_point start = Clock::now();
  set_phase(point, "timing");
  gpu::CachesOfFrames caches;
  // The traffic of a tile does not depend on its timing.
  const std::vector<gpu::TileTraffic>& traffic = rendering_->shares.traffic;
  std::optional<gpu::CostAttribution> shares;
  gpu::FrameTimeline timeline;
  const auto each = [&](const timing::FrameWork& work, const gpu::ViewCost& view, const timing::WarmCaches& before) {
    gpu::CostAttribution of =
        gpu::attribute_costs(point.gpu, work, view.schedule, view.timing, view.energy,
                             shares ? std::vector<gpu::TileTraffic>(traffic.size()) : traffic, before, false);
    if (shares) return shares->add(of);
    timeline = gpu::frame_timeline(point.gpu, work, view.schedule, view.timing);
    shares = std::move(of);
  };
  gpu::FrameCost cost = gpu::frame_cost(point.gpu, rendering_->views, caches.of_frame(point.gpu, point.frame), each);
  rendering_->shares = std::move(*shares);
  rendering_->timeline = std::move(timeline);
  gpu::MachineModel& model = *rendering_->frame.model;
  model.timing = std::move(cost.timing);
  model.energy = std::move(cost.energy);
  model.area = std::move(cost.area);
  publish(point, false, stale, seconds_from(start));
}

void ViewSession::check_memory(const ViewPoint& point) const {
  const std::uint64_t bytes = gpu::image_bytes(point.request, point.settings, point.gpu, *space_.start().capture);
  if (bytes > max_bytes_)
    throw LimitError(fmt::format("{}: images of {}x{} need {} bytes, --max-memory allows {}",
                                 escape_control(space_.start().file), point.request.width, point.request.height, bytes,
                                 max_bytes_));
}

void ViewSession::render(const ViewPoint& point) {
  const Clock::time_point start = Clock::now();
  check_memory(point);
  set_phase(point, "rendering");
  repeat_failures_with(space_.command_without_frames(point));
  gpu::Device device(prepared_, point.gpu, point.settings, point.request);
  // While it lives, request() may abandon the frame.
  struct InHand {
    ViewSession& session;
    ~InHand() {
      const std::lock_guard lock(session.mutex_);
      session.device_ = nullptr;
      session.in_hand_.reset();
    }
  } in_hand{*this};
  {
    const std::lock_guard lock(mutex_);
    if (stop_ || !point.renders_as(wanted_)) throw gpu::Abandoned();
    device_ = &device;
    in_hand_ = point;
  }
  for (int frame = point.first_frame(space_.start().warmup); frame < point.frame; ++frame) device.render(frame);
  gpu::FrameResult frame = device.render(point.frame);
  std::vector<timing::FrameWork> views;
  views.push_back(std::move(frame.model->record.work));
  if (frame.right) views.push_back(std::move(*frame.right->work));
  gpu::FrameTimeline timeline =
      gpu::frame_timeline(point.gpu, views.front(), frame.model->schedule, frame.model->timing);
  gpu::CostAttribution shares = std::move(*frame.shares);
  DrawableNames names(
      gpu::record_head("", device.assembly(), point.gpu, point.settings, point.request.width, point.request.height));
  frame.model->record = {};
  frame.model->schedule = {};
  const tilecore::FrameTargets targets = std::move(frame.targets);
  if (frame.right) static_cast<void>(tilecore::FrameTargets(std::move(frame.right->targets)));
  const double exposure = point.settings.output.exposure;
  ViewImage image;
  image.number = ++images_;
  image.png = std::make_shared<const std::string>(
      encode_png(shaders::to_display(targets.color, exposure > 0 ? static_cast<float>(exposure)
                                                                 : space_.start().capture->settings.exposure),
                 PngEffort::kFast));
  image.view = view_json(frame, point.request.region);
  rendering_ = std::make_unique<Rendering>(Rendering{point, std::move(frame), std::move(views), std::move(image),
                                                     std::move(names), std::move(shares), std::move(timeline),
                                                     PixelHistory(targets, device.assembly())});
  publish(point, true, false, seconds_from(start));
}

void ViewSession::leave_out(const std::optional<DrawableName>& only) {
  const ViewPoint& point = *shown_;
  const LeaveOneOut measurement(*space_.start().capture, point.gpu, point.settings, point.request,
                                {.drawables_only = true, .only = only}, [&](gpu::Device& device) {
                                  for (int f = point.first_frame(space_.start().warmup); f < point.frame; ++f)
                                    device.render(f);
                                });
  LeaveOneOut::Watch watch;
  watch.stop = [this] {
    const std::lock_guard lock(mutex_);
    return end_measuring_;
  };
  watch.renders = [this](gpu::Device* device) {
    const std::lock_guard lock(mutex_);
    measuring_ = device;
    if (device != nullptr && end_measuring_) device->abandon();
  };
  watch.measured = [this](const json& so_far, std::size_t done, std::size_t all, const json&) {
    const std::lock_guard lock(mutex_);
    if (end_measuring_) return;
    left_out_["done"] = done;
    left_out_["all"] = all;
    left_out_["rows"] = so_far.at("drawables");
  };
  std::string error;
  try {
    check_memory(point);
    measurement.measure({point.frame, rendering_->shares, rendering_->frame.effects},
                        prepared_->scene(point.settings.textures).assembly, rendering_->names, watch);
  } catch (const gpu::Abandoned&) {
    // end_measuring() has said so.
  } catch (const std::exception& fault) {
    error = escape_control(fault.what(), 400);
  }
  const std::lock_guard lock(mutex_);
  if (end_measuring_) return;
  left_out_["phase"] = error.empty() ? "done" : "failed";
  if (!error.empty()) left_out_["error"] = error;
}

void ViewSession::publish(const ViewPoint& point, bool rendered, bool stale, double seconds) {
  shown_ = point;
  const scene::Capture& capture = *space_.start().capture;
  Statistics statistics(capture, point.gpu, point.settings, point.request);
  statistics.add_gpu_notice(point.notice);
  statistics.set_view(space_.start().look.json());
  statistics.set_host(capture.load_seconds, capture.decode_seconds, 0);
  const FrameCosts costs(rendering_->shares, rendering_->names);
  statistics.add(rendering_->frame, nullptr, &costs);
  auto result = std::make_shared<ViewResult>();
  result->revision = point.revision;
  result->rendered = rendered;
  result->stale = stale;
  result->seconds = seconds;
  result->frame = point.frame;
  result->changes = ViewSpace::changes_json(point);
  result->command = space_.command(point);
  result->stats = statistics.json();
  result->summary = summary_json(result->stats.at("total"), rendering_->frame, point.gpu);
  result->image = rendering_->image;
  result->image.view["tiles"] = json::parse(
      tile_maps_json(point.frame, rendering_->frame.maps,
                     costs.tile_members() + timeline_member(rendering_->timeline) + rendering_->pixels.member(costs)));
  {
    const std::lock_guard lock(mutex_);
    result->kept = point.keep || (wanted_.revision == point.revision && wanted_.keep);
    if (result->kept) remember(*result);
    result_ = result;
    state_ = {{"revision", point.revision}, {"phase", stale ? "rendering" : "idle"}};
  }
  changed_.notify_all();
  told_(result);
}

void ViewSession::remember(const ViewResult& result) {
  if (!history_.empty() && history_.back().at("revision") == result.revision) history_.erase(history_.size() - 1);
  if (history_.size() >= kMaxHistory) history_.erase(1);
  history_.push_back({{"revision", result.revision},
                      {"rendered", result.rendered},
                      {"seconds", result.seconds},
                      {"frame", result.frame},
                      {"changes", result.changes},
                      {"summary", result.summary}});
}

void ViewSession::set_phase(const ViewPoint& point, const char* phase, const std::string& error) {
  const std::lock_guard lock(mutex_);
  state_ = {{"revision", point.revision}, {"phase", phase}};
  if (!error.empty()) state_["error"] = error;
}

}  // namespace tessera::replay
