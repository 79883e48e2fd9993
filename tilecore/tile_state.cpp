#include "tilecore/tile_state.h"

#include <limits>

namespace tessera::tilecore {

void TileState::start(std::size_t samples) {
  z.assign(samples, std::numeric_limits<float>::infinity());
  patch.assign(samples, kNoPatch);
  triangle.assign(samples, kNoPatch);
  for (auto* v : {&b1, &b2, &rest_x, &rest_y}) v->assign(samples, 0.0f);
  layers.clear();
  started = true;
}

}  // namespace tessera::tilecore
