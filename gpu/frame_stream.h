#pragma once

#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "gpu/device.h"

namespace tessera::gpu {

// Whether frames of a replay do not depend on each other, so that several may be rendered at once.
bool frames_are_independent(const scene::Capture& capture, const GpuConfiguration& gpu, const RunSettings& settings,
                            const RenderRequest& request);

// Frames [first, last) in order, from one device or several identical ones. Each device renders a frame of its own,
// with its share of the threads and of the memory that the capture left, so that serial parts of a frame leave no
// thread idle.
//
// Invariants (cited by the tests):
//   FS1  Frames equal the frames of one device, in order, for any number of devices.
//   FS2  Each device holds at most one frame, finished or in progress.
//   FS3  A frame that needs more than its share of the memory is rendered again, alone and with all of it.
class FrameStream {
 public:
  // The devices must outlive it. Several devices require frames_are_independent().
  FrameStream(std::vector<Device*> devices, int first, int last);
  // Waits for the frames in progress.
  ~FrameStream();
  FrameStream(const FrameStream&) = delete;
  FrameStream& operator=(const FrameStream&) = delete;

  // Returns the next frame. Throws the error of its rendering.
  FrameResult next();

 private:
  // A device's current frame and its result.
  struct Slot {
    Device* device = nullptr;
    std::thread thread;
    bool busy = false;
    std::optional<FrameResult> result;
    std::exception_ptr failure;
  };
  void work(std::size_t number);
  FrameResult render_alone(std::unique_lock<std::mutex>& lock, Device& device, int frame);

  std::vector<Slot> slots_;
  int first_, next_, last_;
  std::size_t threads_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false, paused_ = false;
};

}  // namespace tessera::gpu
