#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "scene/frame_geometry.h"

namespace tessera::reference {

// The shutter of a frame in slices so short that motion is a line in each, from true pose to true pose. They come from
// the motion itself, looked at at random times: a slice is split at a key of an animation that lies in it, else at a
// random place, until no point that is looked at is farther than kMaxPixels from its line at three random times. This
// has nothing in common with the machine's segments of motion (scene/motion_segments.h): no bounds, no budget, no equal
// parts, and materials, lights and visibility as its frames have them.
//
// Invariant (cited by the tests):
//   RSL1  What repeats within the shutter, however often, is not taken for something that rests.
class ShutterSlices {
 public:
  static constexpr double kMaxPixels = 0.05;
  static constexpr std::size_t kMaxSlices = 4096;  // beyond, kMaxPixels doubles until they are enough

  // `request`: of the frame, as fine as the reference is wanted; `assembly` must outlive the slices. `grids` (may be
  // null) gives all slices its grids.
  ShutterSlices(const scene::Assembly& assembly, const scene::CameraChoice& camera, const scene::FrameRequest& request,
                std::uint64_t seed, std::unique_ptr<scene::FrameGeometry> grids = nullptr);

  std::size_t count() const { return ends_.size() - 1; }
  // Time of the shutter, 0 to 1, at which slice k begins; k = count(): 1.
  double at(std::size_t k) const { return ends_[k]; }
  // Slice k as a frame whose shutter it is.
  std::unique_ptr<scene::FrameGeometry> pose(std::size_t k) const;

  const scene::FrameRequest& request() const { return request_; }
  // Any of them, for what they have in common.
  const scene::FrameGeometry& common() const { return *common_; }

 private:
  scene::FrameRequest slice_request(double a, double b) const;
  void split(std::uint64_t seed, double max_pixels);

  const scene::Assembly& assembly_;
  scene::CameraChoice camera_;
  scene::FrameRequest request_;
  std::unique_ptr<scene::FrameGeometry> grids_, common_;
  std::vector<double> ends_;
};

}  // namespace tessera::reference
