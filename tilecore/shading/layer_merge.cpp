#include "tilecore/shading/layer_merge.h"

#include <algorithm>
#include <tuple>

#include "base/check.h"

namespace tessera::tilecore {

bool nearer(const BlendedLayer& a, const BlendedLayer& b) {
  return std::tie(a.z, b.patch, b.triangle) < std::tie(b.z, a.patch, a.triangle);
}

std::size_t LayerMerger::merge(std::vector<BlendedLayer>& far_to_near, std::size_t capacity) {
  TESSERA_CHECK(capacity > 0 && capacity <= kMaxCapacity, "a sample has room for 1 to 64 layers");
  if (far_to_near.size() <= capacity) return 0;
  const std::size_t overflows = far_to_near.size() - capacity;
  std::sort(far_to_near.begin(), far_to_near.end(), [](const BlendedLayer& a, const BlendedLayer& b) {
    return std::tie(a.patch, a.triangle, a.z) < std::tie(b.patch, b.triangle, b.z);
  });
  std::size_t count = 0;
  for (const BlendedLayer& layer : far_to_near) {
    std::size_t place = count++;
    for (; place > 0 && nearer(layer, kept_[place - 1]); --place) kept_[place] = kept_[place - 1];
    kept_[place] = layer;
    if (count <= capacity) continue;
    const BlendedLayer& last = kept_[--count];
    BlendedLayer& front = kept_[count - 1];
    const float through = 1.0f - front.alpha;
    front.color = front.color + last.color * through;
    front.alpha = front.alpha + last.alpha * through;
  }
  far_to_near.assign(kept_.rend() - static_cast<std::ptrdiff_t>(count), kept_.rend());
  return overflows;
}

}  // namespace tessera::tilecore
