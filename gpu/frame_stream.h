#pragma once

#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "gpu/device.h"

namespace tessera::gpu {

// Whether frames of a replay leave nothing to each other, so that several may be rendered at once.
bool frames_are_independent(const scene::Capture& capture, const GpuConfiguration& gpu, const RunSettings& settings,
                            const RenderRequest& request);

// Frames [first, last) in order, of one device or of several alike. Several render at once, each a frame of its own with
// its share of the threads and of the memory that the capture left: what a frame does one after the other then costs no
// waiting thread.
//
// Invariants (cited by the tests):
//   FS1  Frames are those that one device renders, in order, for any number of devices.
//   FS2  Each device holds one frame at most, rendered or being rendered.
//   FS3  A frame that needs more than its share of the memory is rendered again, alone and with all of it.
class FrameStream {
 public:
  // The devices outlive it. More than one: frames_are_independent().
  FrameStream(std::vector<Device*> devices, int first, int last);
  // Waits for the frames on their way.
  ~FrameStream();
  FrameStream(const FrameStream&) = delete;
  FrameStream& operator=(const FrameStream&) = delete;

  // The next frame. Throws what rendering it threw.
  FrameResult next();

 private:
  // What a device renders, and what became of it.
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
