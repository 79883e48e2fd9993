#include "tilecore/tessellation/mesh_store.h"

#include "base/random.h"

namespace tessera::tilecore {

std::size_t MeshStore::KeyHash::operator()(const Key& key) const {
  const auto& r = key.range;
  const std::uint32_t range =
      std::uint32_t{r.i0} | std::uint32_t{r.j0} << 8 | std::uint32_t{r.i1} << 16 | std::uint32_t{r.j1} << 24;
  return hash32(
      key.patch, range,
      (key.effects.motion ? 1u : 0u) | (key.effects.lens ? 2u : 0u) | static_cast<std::uint32_t>(key.part) << 2);
}

MeshStore::Node& MeshStore::make_room() {
  if (unused_ > 0 && bytes_ < limit_bytes_) {
    --unused_;
    bytes_ -= nodes_.back().bytes;
    nodes_.splice(nodes_.begin(), nodes_, std::prev(nodes_.end()));
  } else if (bytes_ >= limit_bytes_ && !nodes_.empty()) {
    // Evicts down to the limit; the last evicted mesh leaves its arrays.
    while (true) {
      Node& oldest = nodes_.back();
      if (unused_ > 0)
        --unused_;
      else
        index_.erase(oldest.key);
      bytes_ -= oldest.bytes;
      if (bytes_ < limit_bytes_ || nodes_.size() == 1) break;
      nodes_.pop_back();
    }
    nodes_.splice(nodes_.begin(), nodes_, std::prev(nodes_.end()));
  } else {
    nodes_.emplace_front();
  }
  return nodes_.front();
}

const MeshStore::Item& MeshStore::get(const scene::FrameGeometry& frame, std::uint32_t patch,
                                      const scene::CellRange& range, RayEffects effects, bool displaced) {
  if (frame.identity != frame_identity_) {
    index_.clear();
    // Meshes of the old frame lend their memory to the new one.
    unused_ = nodes_.size();
    frame_identity_ = frame.identity;
  }
  const Key key{patch, range, frame.part.whole() ? -1 : frame.part.first, effects, displaced};
  if (const auto found = index_.find(key); found != index_.end()) {
    nodes_.splice(nodes_.begin(), nodes_, found->second);
    return nodes_.front().item;
  }
  Node& node = make_room();
  node.key = key;
  node.item.work = tessellator_.tessellate(frame, patch, range, effects, node.item.mesh, displaced);
  node.item.costs_.reset();
  node.item.groups_.reset();
  node.bytes = node.item.mesh.memory_bytes();
  bytes_ += node.bytes;
  index_[key] = nodes_.begin();
  return node.item;
}

}  // namespace tessera::tilecore
