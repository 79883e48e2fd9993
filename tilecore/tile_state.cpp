#include "tilecore/tile_state.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"

namespace tessera::tilecore {

void TileState::start(std::size_t samples, int width, int spp) {
  depth_blocks_.start(samples, width, spp);
  uncovered = samples;
  z.assign(samples, std::numeric_limits<float>::infinity());
  patch.assign(samples, kNoPatch);
  triangle.assign(samples, kNoPatch);
  positive.assign(samples, 0);
  for (auto* v : {&b1, &b2, &rest_x, &rest_y}) v->assign(samples, 0.0f);
  layers.clear();
  triangles.clear();
  seen.clear();
  next_drop_ = std::min<std::size_t>(max_layers, 4096);
  started = true;
}

void TileState::hide_behind(std::vector<float> depths, int width, int spp) {
  known_depths_ = std::move(depths);
  known_blocks_.start(known_depths_.size(), width, spp);
  for (std::size_t s = 0; s < known_depths_.size(); ++s)
    if (known_depths_[s] < kNothing) known_blocks_.touch(s, true);
}

void TileState::drop_hidden_layers() {
  std::erase_if(layers, [&](const Layer& layer) { return layer.z > z[layer.sample]; });
}

void TileState::make_room() {
  drop_hidden_layers();
  if (layers.size() >= max_layers)
    throw LimitError(
        fmt::format("a tile sees more than {} blended surfaces, all samples together; fewer samples per pixel (--spp) "
                    "or smaller tiles (tile.width, tile.height) need less",
                    max_layers));
  // Twice the number of visible layers, so that the search for hidden ones stays in proportion to the layers that were
  // added.
  next_drop_ = std::min(max_layers, std::max<std::size_t>(2 * layers.size(), 4096));
}

std::uint64_t TileState::bytes(std::size_t capacity) const {
  return z.size() * layout.sample_bytes() + extra_bytes(capacity);
}

std::uint64_t TileState::extra_bytes(std::size_t capacity) const {
  std::uint64_t kept = 0;
  std::vector<std::size_t> of_sample(layers.empty() ? 0 : z.size());
  for (const Layer& layer : layers)
    if (layer.z <= z[layer.sample] && ++of_sample[layer.sample] <= capacity) ++kept;
  return kept * layout.layer_bytes() + (layout.parameters || layout.depth_only ? 0 : triangles.bytes());
}

}  // namespace tessera::tilecore
