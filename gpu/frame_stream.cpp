#include "gpu/frame_stream.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "base/parallel.h"

namespace tessera::gpu {

bool frames_are_independent(const scene::Capture& capture, const GpuConfiguration& gpu, const RunSettings& settings,
                            const RenderRequest& request) {
  // A loaded compressed frame has the size that its content compressed to.
  const bool loads = capture.settings.graph && std::ranges::any_of(capture.settings.graph->passes,
                                                                   [](const auto& pass) { return !pass.load.empty(); });
  return !loads && !antialiases(capture, settings) && settings.resolve.desampling != tilecore::Desampling::kAdaptive &&
         !gpu.frontend.previous_depth_culling && !eliminates(gpu) &&
         gpu.queues.caches == hardware::FrameCaches::kEmpty && !request.record_accesses &&
         !request.keep_transactions;  // transactions may take many times the memory of the rest of a frame
}

FrameStream::FrameStream(std::vector<Device*> devices, int first, int last)
    : slots_(devices.size()), first_(first), next_(first), last_(last), threads_(thread_count()) {
  for (std::size_t k = 0; k < devices.size(); ++k) slots_[k].device = devices[k];
  if (slots_.size() == 1) return;
  for (std::size_t k = 0; k < slots_.size(); ++k) {
    slots_[k].device->share_memory(slots_.size());
    slots_[k].thread = std::thread([this, k] { work(k); });
  }
}

FrameStream::~FrameStream() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  for (Slot& slot : slots_) {
    if (slot.thread.joinable()) slot.thread.join();
    slot.device->share_memory(1);
  }
}

void FrameStream::work(std::size_t number) {
  Slot& slot = slots_[number];
  const int step = static_cast<int>(slots_.size());
  for (int frame = first_ + static_cast<int>(number); frame < last_; frame += step) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return stopping_ || (!paused_ && !slot.result && !slot.failure); });
      if (stopping_) return;
      slot.busy = true;
    }
    std::optional<FrameResult> result;
    std::exception_ptr failure;
    // When fewer frames than devices are left, each gets more threads.
    const std::size_t at_once = std::min(slots_.size(), static_cast<std::size_t>(last_ - frame));
    try {
      with_threads(std::max<std::size_t>(1, threads_ / at_once), [&] { result.emplace(slot.device->render(frame)); });
    } catch (...) {
      failure = std::current_exception();
    }
    {
      const std::lock_guard lock(mutex_);
      slot.result = std::move(result);
      slot.failure = failure;
      slot.busy = false;
    }
    changed_.notify_all();
  }
}

FrameResult FrameStream::render_alone(std::unique_lock<std::mutex>& lock, Device& device, int frame) {
  paused_ = true;
  changed_.wait(lock, [&] { return std::none_of(slots_.begin(), slots_.end(), [](const Slot& s) { return s.busy; }); });
  device.share_memory(1);
  FrameResult result = device.render(frame);
  device.share_memory(slots_.size());
  paused_ = false;
  return result;
}

FrameResult FrameStream::next() {
  const int frame = next_++;
  if (slots_.size() == 1) return slots_[0].device->render(frame);
  Slot& slot = slots_[static_cast<std::size_t>(frame - first_) % slots_.size()];
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return slot.result || slot.failure; });
  std::optional<FrameResult> result;
  if (slot.failure) {
    try {
      std::rethrow_exception(slot.failure);
    } catch (const LimitError&) {
      result.emplace(render_alone(lock, *slot.device, frame));
    }
  } else {
    result = std::move(slot.result);
  }
  slot.failure = nullptr;
  slot.result.reset();
  lock.unlock();
  changed_.notify_all();
  return std::move(*result);
}

}  // namespace tessera::gpu
