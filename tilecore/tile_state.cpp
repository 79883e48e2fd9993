#include "tilecore/tile_state.h"

#include <algorithm>
#include <array>
#include <limits>

#include <fmt/format.h>

#include "base/error.h"

namespace tessera::tilecore {

void TileState::start(std::size_t samples) {
  uncovered = samples;
  z.assign(samples, std::numeric_limits<float>::infinity());
  patch.assign(samples, kNoPatch);
  triangle.assign(samples, kNoPatch);
  positive.assign(samples, 0);
  for (auto* v : {&b1, &b2, &rest_x, &rest_y}) v->assign(samples, 0.0f);
  layers.clear();
  next_drop_ = std::min<std::size_t>(max_layers, 4096);
  started = true;
}

void TileState::drop_hidden_layers() {
  std::erase_if(layers, [&](const Layer& layer) { return layer.z >= z[layer.sample]; });
}

void TileState::make_room() {
  drop_hidden_layers();
  if (layers.size() >= max_layers)
    throw LimitError(
        fmt::format("a tile sees more than {} blended surfaces, all samples together; fewer samples per pixel (--spp) "
                    "or smaller tiles (tile.width, tile.height) need less",
                    max_layers));
  // Twice what is visible now: the work of looking stays in proportion to the layers that came.
  next_drop_ = std::min(max_layers, std::max<std::size_t>(2 * layers.size(), 4096));
}

float TileState::farthest() const {
  if (uncovered > 0) return std::numeric_limits<float>::infinity();
  // Several running maxima, so that the loop is not one chain of dependent steps.
  std::array<float, 16> most{};
  std::size_t i = 0;
  for (; i + most.size() <= z.size(); i += most.size())
    for (std::size_t k = 0; k < most.size(); ++k) most[k] = z[i + k] > most[k] ? z[i + k] : most[k];
  for (; i < z.size(); ++i) most[0] = std::max(most[0], z[i]);
  return *std::max_element(most.begin(), most.end());
}

std::uint64_t TileState::bytes(std::size_t capacity) const {
  std::uint64_t kept = 0;
  std::vector<std::size_t> of_sample(layers.empty() ? 0 : z.size());
  for (const Layer& layer : layers)
    if (layer.z < z[layer.sample] && ++of_sample[layer.sample] <= capacity) ++kept;
  return z.size() * kBytesPerSample + kept * kBytesPerLayer;
}

}  // namespace tessera::tilecore
