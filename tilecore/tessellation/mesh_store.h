#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "tilecore/tessellation/tessellator.h"
#include "tilecore/tessellation/vertex_groups.h"
#include "tilecore/visibility/method_choice.h"

namespace tessera::tilecore {

// Host memory of tessellated sub-patches: neighbouring tiles ask for the same ones, and the host need not make them
// again. TessellationCache accounts separately for the work that the emulated machine would repeat. Keeps the most
// recently used meshes; one instance per thread. A mesh depends on its key alone, so results do not depend on the kept
// meshes.
class MeshStore {
 public:
  // [measured] Moving triangles of 1 pixel^2 at 1280x720: 32 MiB and 128 MiB take the same time within the noise (4 %)
  // where neighbouring tiles follow one another; garden then takes less than 300 MB.
  static constexpr std::size_t kDefaultBytes = std::size_t{32} << 20;
  explicit MeshStore(std::size_t limit_bytes = kDefaultBytes) : limit_bytes_(limit_bytes) {}

  struct Item {
    MicroMesh mesh;
    Tessellator::Work work;
    // Test costs of the mesh, computed at the first request: every tile that it touches chooses by the same costs.
    const TestCosts& costs(RayEffects effects) const {
      if (!costs_) costs_ = test_costs(mesh, effects);
      return *costs_;
    }

    // Vertex groups of the mesh, likewise; callers may keep them.
    const std::shared_ptr<const std::vector<VertexGroup>>& groups(const scene::FrameGeometry& frame,
                                                                  std::uint32_t patch, const scene::CellRange& range,
                                                                  float lens_scale) const {
      if (groups_ == nullptr)
        groups_ =
            std::make_shared<const std::vector<VertexGroup>>(vertex_groups(frame, patch, range, mesh, lens_scale));
      return groups_;
    }

   private:
    friend class MeshStore;
    mutable std::optional<TestCosts> costs_;
    mutable std::shared_ptr<const std::vector<VertexGroup>> groups_;
  };
  // The mesh of a range of a patch, made now or before. Valid until the next call.
  const Item& get(const scene::FrameGeometry& frame, std::uint32_t patch, const scene::CellRange& range,
                  RayEffects effects, bool displaced = true);

  // Bytes of all kept meshes; at most the limit, unless a single mesh is larger.
  std::size_t memory_bytes() const { return bytes_; }

 private:
  struct Key {
    std::uint32_t patch;
    scene::CellRange range;
    int part;  // of the shutter: where it begins
    RayEffects effects;
    bool displaced;
    bool operator==(const Key&) const = default;
  };
  struct KeyHash {
    std::size_t operator()(const Key& key) const;
  };
  struct Node {
    Key key;
    std::size_t bytes = 0;
    Item item;
  };
  using List = std::list<Node>;

  // Returns a node at the front for a new mesh, which uses again the arrays of a mesh of an earlier frame or, when
  // memory is full, of the oldest one; otherwise a new node.
  Node& make_room();

  std::size_t limit_bytes_, bytes_ = 0;
  std::uint64_t frame_identity_ = 0;  // of the frame of all meshes
  List nodes_;                        // last used first
  std::size_t unused_ = 0;            // number of last nodes that belong to an earlier frame
  std::unordered_map<Key, List::iterator, KeyHash> index_;
  Tessellator tessellator_;
};

}  // namespace tessera::tilecore
