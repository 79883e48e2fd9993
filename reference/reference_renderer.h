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

// Parameters of a reference image.
struct ReferenceRequest {
  tilecore::Lighting lighting;
  std::optional<Vec3> background;                // unset: the environment
  std::optional<scene::ShadowSettings> shadows;  // shadow settings for lights that cast; unset: no surface blocks light
  // Seed of plain random numbers for place, time and lens point, independent from sample to sample and pixel to
  // pixel: the error of a mean of n samples falls as n^-1/2. They are independent of the machine's pattern.
  std::uint64_t seed = 1;
  // Numbers of samples, ascending; each gives an image of the first samples, as many as it says.
  std::vector<int> samples = {1024};
  // If set, samples come from the machine's own pattern instead of random numbers, as many as it has. The result then
  // differs from the machine's by arithmetic alone.
  const tilecore::SamplePattern* pattern = nullptr;
  // Called after each image with all images so far; true ends the rendering. With it the scene is built once for each image.
  std::function<bool(std::span<const Image>)> enough{};
  // Called from any thread with the work finished since the last call, in pixels times samples. An image of the
  // background of transmitting surfaces counts as well.
  std::function<void(double)> finished{};
};

// Whether an image of the background of transmitting surfaces is rendered first.
bool shows_what_is_behind(const scene::FrameGeometry& frame);

// Renders the scene in double precision: it finds visibility sample by sample and shades every sample. Colour is
// linear light in three channels, the mean over a pixel's samples. The pixel shader is the machine's (a stage is part
// of the scene) and runs in single precision, at parameters that are found in double precision. There is one image
// per requested number of samples, with the same bits for any number of threads and any instruction set.
//
// For the scene of a motion segment, the images are the contribution of the samples in its part of the shutter to the mean.
// Transmitting surfaces show request.lighting.behind; for a frame, an image of their background with as many samples is
// rendered first. A frame or a shutter whose scene needs more memory than the capture left of its limit is rendered in
// parts of the image; BudgetError refuses it if the smallest part needs too much. A scene renders the pixels of its region.
std::vector<Image> render_reference(const ReferenceScene& scene, const ReferenceRequest& request);
// Renders a frame, segment by segment where its motion has some.
std::vector<Image> render_reference(const scene::FrameGeometry& frame, const ReferenceRequest& request);

// Renders a frame on the machine's own grids and at its own samples: the images differ by the machine's arithmetic,
// by invocations that samples share, and by shadow maps.
Image render_machines_samples(const scene::Assembly& assembly, const gpu::GpuConfiguration& gpu,
                              const gpu::RunSettings& settings, int width, int height, int frame);

// Renders a shutter in slices; each gets the samples whose random time lies in it. This is the truth of `tessera tradeoff`.
std::vector<Image> render_reference(const ShutterSlices& slices, const ReferenceRequest& request);

// Root mean square difference of two images of the same shape.
double rms_difference(const Image& a, const Image& b);

// Least-squares slope of log(error) over log(samples).
double convergence_slope(const std::vector<int>& samples, const std::vector<double>& errors);

}  // namespace tessera::reference
