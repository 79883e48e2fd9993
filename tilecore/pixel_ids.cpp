#include "tilecore/pixel_ids.h"

#include <algorithm>
#include <tuple>

#include "tilecore/tile_state.h"
#include "tilecore/visibility/sample_pattern.h"

namespace tessera::tilecore {
namespace {

std::uint32_t packed_range(const scene::CellRange& range) {
  return static_cast<std::uint32_t>(range.i0) | static_cast<std::uint32_t>(range.j0) << 8 |
         static_cast<std::uint32_t>(range.i1) << 16 | static_cast<std::uint32_t>(range.j1) << 24;
}

scene::CellRange unpacked_range(std::uint32_t bits) {
  return {static_cast<std::uint8_t>(bits), static_cast<std::uint8_t>(bits >> 8), static_cast<std::uint8_t>(bits >> 16),
          static_cast<std::uint8_t>(bits >> 24)};
}

// Layers in front of the first sample of each pixel.
struct FirstLayers {
  std::uint32_t count = 0, patch = 0;
  float z = 0;
};

std::vector<FirstLayers> layers_of(const TileSamples& samples, const TileState& state) {
  const auto spp = static_cast<std::size_t>(samples.spp);
  std::vector<FirstLayers> first(samples.count / spp);
  for (const TileState::Layer& layer : state.layers) {
    if (layer.sample % spp != 0 || layer.z > state.z[layer.sample]) continue;
    FirstLayers& at = first[layer.sample / spp];
    if (at.count == 0 || std::tie(layer.z, layer.patch) < std::tie(at.z, at.patch))
      at.z = layer.z, at.patch = layer.patch;
    ++at.count;
  }
  return first;
}

}  // namespace

bool SeenSubPatches::before(const Triangle& a, const Triangle& b) {
  return std::tie(a.patch, a.triangle) < std::tie(b.patch, b.triangle);
}

void SeenSubPatches::add(std::uint32_t patch, const scene::CellRange& range, std::span<const std::uint32_t> triangles) {
  for (const std::uint32_t triangle : triangles) triangles_.push_back({patch, triangle, range});
  sorted_ = sorted_ && triangles.empty();
}

scene::CellRange SeenSubPatches::find(std::uint32_t patch, std::uint32_t triangle) {
  if (!sorted_) std::sort(triangles_.begin(), triangles_.end(), before);
  sorted_ = true;
  const Triangle wanted{patch, triangle, {}};
  const auto found = std::lower_bound(triangles_.begin(), triangles_.end(), wanted, before);
  return found != triangles_.end() && !before(wanted, *found) ? found->range : scene::CellRange{};
}

std::array<std::uint32_t, PixelId::kChannels> PixelId::packed() const {
  return {patch, packed_range(range),
          std::min(samples, 255u) | std::min(layers, 255u) << 8 | std::min(invocations, 65535u) << 16, nearest_layer};
}

PixelId PixelId::unpacked(std::span<const std::uint32_t> channels) {
  return {channels[0], unpacked_range(channels[1]), channels[2] & 255u, channels[2] >> 8 & 255u, channels[2] >> 16,
          channels[3]};
}

void write_pixel_ids(const TileSamples& samples, TileState& state, std::span<const std::uint32_t> invocations,
                     const IntRect& region, ImageOf<std::uint32_t>& ids) {
  const auto spp = static_cast<std::size_t>(samples.spp);
  const std::vector<FirstLayers> layers = layers_of(samples, state);
  std::uint32_t known_patch = TileState::kNoPatch, known_triangle = 0;
  scene::CellRange known;
  std::size_t pixel = 0;
  for (int y = samples.pixels.y0; y < samples.pixels.y1; ++y)
    for (int x = samples.pixels.x0; x < samples.pixels.x1; ++x, ++pixel) {
      const std::size_t s = pixel * spp;
      PixelId id;
      const std::uint32_t patch = state.patch[s];
      id.patch = patch + 1;  // kNoPatch wraps to 0
      if (id.patch != 0) {
        if (patch != known_patch || state.triangle[s] != known_triangle)
          known_patch = patch, known_triangle = state.triangle[s], known = state.seen.find(patch, known_triangle);
        id.range = known;
        for (std::size_t k = 0; k < spp; ++k) id.samples += state.patch[s + k] == patch ? 1u : 0u;
      }
      id.layers = layers[pixel].count;
      if (id.layers > 0) id.nearest_layer = layers[pixel].patch + 1;
      id.invocations = invocations[pixel];
      const auto packed = id.packed();
      std::copy(packed.begin(), packed.end(), ids.at(x - region.x0, y - region.y0).begin());
    }
}

}  // namespace tessera::tilecore
