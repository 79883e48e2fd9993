#include "tilecore/resolve/pixel_surfaces.h"

#include <algorithm>
#include <limits>

#include "base/random.h"
#include "tilecore/resolve/block_pixels.h"

namespace tessera::tilecore {
namespace {

// Number of the sample nearest to the middle of its pixel; the pattern has the same offsets in every pixel.
std::size_t center_of(const TileSamples& samples) {
  std::size_t best = 0;
  float best2 = std::numeric_limits<float>::infinity();
  for (std::size_t k = 0; k < static_cast<std::size_t>(samples.spp); ++k) {
    const float dx = samples.x[k] - static_cast<float>(samples.pixels.x0) - 0.5f,
                dy = samples.y[k] - static_cast<float>(samples.pixels.y0) - 0.5f;
    if (const float d2 = dx * dx + dy * dy; d2 < best2) best2 = d2, best = k;
  }
  return best;
}

std::uint8_t stillness(const MotionField* motion, std::uint32_t drawable) {
  if (motion == nullptr) return 0;
  const bool rests = motion->kind(drawable) == MotionField::Kind::kStill;
  return static_cast<std::uint8_t>((rests ? PixelSurfaces::kAtRest : 0) |
                                   (motion->same_shading(drawable) ? PixelSurfaces::kSameShading : 0));
}

// The samples of one drawable that lie behind a step in depth, a bit each; 0: there is no step.
std::uint32_t behind_step(const float* z, std::size_t count) {
  const auto [nearest, farthest] = std::minmax_element(z, z + count);
  if (!(*farthest - *nearest > PixelSurfaces::kDepthStep * *nearest)) return 0;
  const float middle = *nearest + 0.5f * (*farthest - *nearest);
  std::uint32_t behind = 0;
  for (std::size_t k = 0; k < count; ++k) behind |= static_cast<std::uint32_t>(z[k] > middle) << (k % 32);
  return behind;
}

// How many pixels of four samples each see `patch` alone, from the first on and at most `most`; four at a time.
std::size_t pixels_that_see(std::uint32_t patch, const std::uint32_t* samples, std::size_t most) {
  std::size_t pixels = 0;
  for (; pixels + 4 <= most; pixels += 4) {
    std::uint32_t other = 0;
    for (std::size_t k = 0; k < 16; ++k) other |= samples[4 * pixels + k] ^ patch;
    if (other != 0) break;
  }
  while (pixels < most && all_are(&samples[4 * pixels], patch)) ++pixels;
  return pixels;
}

}  // namespace

void PixelSurfaces::gather(const scene::FrameGeometry& frame, const TileSamples& samples, TileState& state,
                           const MotionField* motion) {
  pixels = samples.pixels;
  spp = samples.spp;
  still_in = motion;
  center_sample = center_of(samples);
  const std::size_t count = samples.count / static_cast<std::size_t>(spp);
  depth.resize(count);
  patch.resize(count);
  surface.resize(count);
  still.resize(count);
  layered.assign(count, 0);
  gather_opaque(frame, state, motion);
  state.drop_hidden_layers();
  if (!state.layers.empty()) gather_layers(frame, state, motion);
}

void PixelSurfaces::gather_opaque(const scene::FrameGeometry& frame, const TileState& state,
                                  const MotionField* motion) {
  const auto n = static_cast<std::size_t>(spp);
  const std::vector<std::uint32_t>& drawable_of = frame.assembly->patch_drawable;
  // Neighbouring pixels mostly see one patch, so its properties are looked up once.
  std::uint32_t last_patch = TileState::kNoPatch, last_surface = 0;
  constexpr std::uint8_t kBoth = kAtRest | kSameShading;
  std::uint8_t last_still = kBoth;
  const auto look_up = [&](std::uint32_t p) {
    if (p == last_patch) return;
    last_patch = p;
    last_surface = p == TileState::kNoPatch ? 0 : drawable_of[p] + 1;
    last_still = p == TileState::kNoPatch ? kBoth : stillness(motion, drawable_of[p]);
  };
  const std::uint32_t* const patches = state.patch.data();
  const float* const depths = state.z.data() + center_sample;
  const std::size_t count = depth.size();
  for (std::size_t pixel = 0; pixel < count; ++pixel) {
    // Mostly the samples see the same patch as the previous pixel.
    const std::size_t alike = n == 4 ? pixels_that_see(last_patch, &patches[4 * pixel], count - pixel) : 0;
    if (alike != 0) {
      for (std::size_t k = 0; k < alike; ++k) depth[pixel + k] = depths[4 * (pixel + k)];
      std::fill_n(&patch[pixel], alike, last_patch);
      std::fill_n(&surface[pixel], alike, last_surface);
      std::fill_n(&still[pixel], alike, last_still);
      pixel += alike - 1;
      continue;
    }
    const std::uint32_t* seen = &patches[pixel * n];
    depth[pixel] = depths[pixel * n];
    patch[pixel] = seen[center_sample];
    std::uint32_t same = 1;
    for (std::size_t k = 1; k < n; ++k) same &= static_cast<std::uint32_t>(seen[k] == seen[0]);
    look_up(seen[0]);
    std::uint32_t first = last_surface;
    std::uint8_t rests = last_still;
    if (same == 0) {
      std::uint32_t hash = first;
      bool one_surface = true;
      for (std::size_t k = 1; k < n; ++k) {
        look_up(seen[k]);
        one_surface = one_surface && last_surface == first;
        rests &= last_still;
        hash = mix32(hash) + last_surface;
      }
      if (!one_surface)
        first = mix32(hash) | kMixed;
      else if (const std::uint32_t behind = behind_step(&state.z[pixel * n], n); behind != 0)
        first = hash32(first, behind, 0x57E9u) | kMixed;
    }
    surface[pixel] = first;
    still[pixel] = rests;
  }
}

void PixelSurfaces::gather_layers(const scene::FrameGeometry& frame, const TileState& state,
                                  const MotionField* motion) {
  samples_with_layers += state.layers.size();
  const auto n = static_cast<std::uint32_t>(spp);
  // Layers come in any order; a sum does not depend on it.
  std::vector<std::uint32_t> sum(depth.size(), 0);
  for (const TileState::Layer& layer : state.layers) {
    const std::size_t pixel = layer.sample / n;
    const std::uint32_t drawable = frame.assembly->patch_drawable[layer.patch];
    layered[pixel] = 1;
    still[pixel] &= stillness(motion, drawable);
    sum[pixel] += hash32(layer.sample % n, drawable, 0x1A7E4u);
  }
  for (std::size_t pixel = 0; pixel < depth.size(); ++pixel)
    if (layered[pixel] != 0) surface[pixel] = hash32(surface[pixel], sum[pixel]) | kMixed;
}

}  // namespace tessera::tilecore
