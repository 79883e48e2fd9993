#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "base/image.h"
#include "gpu/configuration.h"
#include "gpu/settings.h"
#include "reference/reference_scene.h"
#include "reference/shadow_rays.h"
#include "reference/shutter_slices.h"
#include "tilecore/shading/pixel_shader.h"
#include "tilecore/visibility/sample_pattern.h"

namespace tessera::reference {

// What a reference image is made with.
struct ReferenceRequest {
  tilecore::Lighting lighting;
  std::optional<Vec3> background;                // else the environment
  std::optional<scene::ShadowSettings> shadows;  // lights that cast do so by these; unset: nothing is in their way
  // Plain random numbers for place, time and lens point, independent from sample to sample and pixel to pixel: the
  // error of a mean of n samples falls as n^-1/2. They have nothing in common with the machine's pattern.
  std::uint64_t seed = 1;
  // Numbers of samples, ascending: an image of the first so many samples is made of each.
  std::vector<int> samples = {1024};
  // Instead of random numbers: the samples of the machine's own pattern, whose number they then are. What is left to
  // differ from the machine is its arithmetic.
  const tilecore::SamplePattern* pattern = nullptr;
  // Asked after each image, with all of them so far; true ends it. With it the scene is built once for each image.
  std::function<bool(std::span<const Image>)> enough{};
  // Told, from any thread, how many samples are finished since it was last told, in pixels times samples. An image of
  // what is behind surfaces that transmit counts as well.
  std::function<void(double)> finished{};
};

// Whether an image of what is behind surfaces that transmit is made first.
bool shows_what_is_behind(const scene::FrameGeometry& frame);

// Renders the scene in double precision: visibility sample by sample, and every sample shaded. Colour is linear light,
// three channels, the mean over a pixel's samples. The pixel shader is the machine's (a stage is part of the scene), in
// single precision, at parameters that are found in double. One image per number of samples asked for. The same bits
// for any number of threads and any instruction set.
// A scene of a motion segment gives what the samples in its part of the shutter add to the mean. What transmits shows
// request.lighting.behind; of a frame, an image of what is behind it that is made first, of as many samples.
// A frame or a shutter whose scene needs more memory than the capture left of its limit is rendered in parts of the
// image, and refused with BudgetError where the smallest part needs too much. A scene renders the pixels of its region.
std::vector<Image> render_reference(const ReferenceScene& scene, const ReferenceRequest& request);
// Of a frame, segment by segment where its motion has some.
std::vector<Image> render_reference(const scene::FrameGeometry& frame, const ReferenceRequest& request);

// A frame as the machine would render it, on the grids and by the samples that it has: the images differ by the machine's
// arithmetic, by invocations that samples share, and by shadow maps.
Image render_machines_samples(const scene::Assembly& assembly, const gpu::GpuConfiguration& gpu,
                              const gpu::RunSettings& settings, int width, int height, int frame);

// Of a shutter in slices: each as many samples as have their random time in it. This is the truth of `tessera tradeoff`.
std::vector<Image> render_reference(const ShutterSlices& slices, const ReferenceRequest& request);

// Root mean square difference of two images of one shape.
double rms_difference(const Image& a, const Image& b);

// Least-squares slope of log(error) over log(samples).
double convergence_slope(const std::vector<int>& samples, const std::vector<double>& errors);

}  // namespace tessera::reference
