#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "scene/frame_geometry.h"

namespace tessera::reference {

// Divides the shutter of a frame into slices so short that motion is a straight line in each, from true pose to true
// pose. The slices follow from sampling the motion at random times: a slice is split at a key of an animation inside
// it, else at a random place, until no sampled point is farther than kMaxPixels from its line at three random times.
// The method has nothing in common with the machine's motion segments (scene/motion_segments.h): it has no bounds, no
// budget and no equal parts, and each slice's frame has its own materials, lights and visibility.
//
// Invariant (cited by the tests):
//   RSL1  Motion that repeats within the shutter, however often, is not mistaken for rest.
class ShutterSlices {
 public:
  static constexpr double kMaxPixels = 0.05;
  static constexpr std::size_t kMaxSlices = 4096;  // beyond this, kMaxPixels doubles until the slices suffice

  // `request`: the frame's request with the reference's grids; `assembly` must outlive the slices. `grids`, unless
  // nullptr, gives its grids to all slices.
  ShutterSlices(const scene::Assembly& assembly, const scene::CameraChoice& camera, const scene::FrameRequest& request,
                std::uint64_t seed, std::unique_ptr<scene::FrameGeometry> grids = nullptr);

  std::size_t count() const { return ends_.size() - 1; }
  // Time of the shutter, 0 to 1, at which slice k begins; at(count()) is 1.
  double at(std::size_t k) const { return ends_[k]; }
  // Slice k as a frame of its own, whose shutter is the slice.
  std::unique_ptr<scene::FrameGeometry> pose(std::size_t k) const;

  const scene::FrameRequest& request() const { return request_; }
  // One of the slices, for data that all share.
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
