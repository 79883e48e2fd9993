#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "baselines/block_reader.h"
#include "baselines/meshlets.h"
#include "baselines/reshading.h"
#include "baselines/scheme_work.h"
#include "baselines/tile_reference.h"

namespace tessera::baselines {

// Machines with a mesh-shader pipeline in front of their tiler: task shaders drop meshlets, mesh shaders produce the
// triangles of the remaining ones, set-up culls these and finds their tiles, and lists name them by meshlet. The
// machines differ in the storage between the mesh shader and tiles.

// The work of a pass's mesh shaders, and the patches that they shaded with the number of vertices and triangles of each.
struct MeshPass {
  BaselineCounters setup;  // triangles of kept meshlets
  std::vector<PatchWork> patches;
  std::uint64_t vertices = 0;         // vertices of these patches
  std::uint64_t attribute_bytes = 0;  // bursts of the pixel shader's part of their records
  std::uint64_t unread_bytes = 0;     // bytes of records that no unit fetched, because no meshlet was kept
};

// Stores outputs in memory, as consecutive records of meshlets.
//
//   kRing     each record has room for the outputs of a full workgroup [spec: Mesa's emulation for Adreno A8xx]: positions
//             of 64 vertices (16 bytes each, twice that if they move), then attributes in slots of 16 bytes; for 124
//             triangles three indices and a cull word (4 bytes each). 4 032 bytes with one slot. To bin, a vertex shader
//             copies the positions and indices that the meshlet has
//   kCompact  each record has only the meshlet's own outputs: a head of 4 bytes, positions, attributes, 3 bytes for each
//             triangle, filled up to a multiple of 4. The binner takes the outputs as they are made [assumed, in its favour]
//
// A tile's list, in the order of drawing, has for each reference a number (7 bits a byte), the meshlet less the meshlet of
// the reference before, and the triangles that touch the tile, as in tile_reference.h. Tiles read the indices and
// positions of these triangles, and the attributes of the visible ones, through a cache of bursts (baselines.cache_bytes).
//
// Only positions and indices have real content, as in PostTessellationBinner.
//
// Invariants (cited by the tests):
//   MESH1  Every triangle of a kept meshlet that set-up keeps is in the list of every tile that it may touch, once.
//   MESH2  Each vertex of a kept meshlet is shaded and stored once for that meshlet.
enum class MeshStorage : std::uint8_t { kRing, kCompact };

class MeshletBinner {
 public:
  // [assumed] instructions of the copying shader for each vertex: its address, two loads, an export
  static constexpr std::uint64_t kCopyInstructions = 8;

  MeshletBinner(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid, MeshStorage storage);

  // Adds a patch. `meshlets`: its kept meshlets; `list`: the patch after set-up.
  void add(const TessellatedPatch& patch, std::span<const Meshlet> meshlets, const TriangleList& list);
  // Same contract as PostTessellationBinner::finish().
  void finish(const VisibleTriangles* visible = nullptr, std::span<const std::uint64_t> state_bytes = {});

  // Offsets of the parts of a meshlet's record.
  struct Layout {
    std::uint64_t positions, position_bytes, attributes, attribute_bytes, indices, triangle_bytes, bytes;
  };
  static Layout layout(MeshStorage storage, std::size_t vertices, std::size_t triangles, bool moving,
                       std::uint64_t attribute_bytes);

  const BaselineCounters& counters() const { return counters_; }
  const TriangleBuffer& buffer() const { return buffer_; }
  const std::vector<ListWork>& tiles() const { return tiles_; }
  std::uint64_t dram_bytes() const { return dram_bytes_; }
  std::uint64_t dram_bytes_uncached() const { return dram_bytes_uncached_; }
  // Bursts that are read to bin, and instructions of the copying shader.
  std::uint64_t read_to_bin_bytes() const { return read_to_bin_bytes_; }
  std::uint64_t copy_instructions() const {
    return storage_ == MeshStorage::kRing ? counters_.vertices_stored * kCopyInstructions : 0;
  }
  // Exposed for tests: address and number of triangles of each meshlet.
  std::uint64_t address(std::size_t meshlet) const { return stored_[meshlet].address; }
  std::size_t triangle_count(std::size_t meshlet) const { return stored_[meshlet].triangle_count; }

 private:
  struct Stored {
    std::uint64_t address;
    Layout layout;
    std::size_t first_triangle, triangle_count;  // in triangles_ and names_
  };
  void store(const TessellatedPatch& patch, const Meshlet& meshlet);
  void read_tile(binner::TileIndex tile, const VisibleTriangles* visible, BlockReader& cached);

  MeshStorage storage_;
  tilecore::TileOrder order_;
  TriangleBuffer buffer_;
  std::uint64_t burst_bytes_, cache_bytes_, read_to_bin_bytes_ = 0, dram_bytes_ = 0, dram_bytes_uncached_ = 0;
  BaselineCounters counters_;
  std::vector<ListWork> tiles_;
  std::vector<Stored> stored_;
  std::vector<BlockTriangle> triangles_;
  std::vector<std::uint64_t> names_;
  std::vector<std::uint64_t> last_;  // by tile: the last meshlet of its list
};

// Keeps references: mesh shaders run again in each tile that a meshlet touches, for all of its vertices, in front of
// Reshading's cache. A reference takes 8 bytes, or 24 for a part of a patch [spec: NVIDIA's vk_tessellated_clusters].
//
// Invariants (cited by the tests):
//   MR1  A kept meshlet is in the list of each tile that one of its triangles may touch, once.
class MeshReferenceBinner {
 public:
  static constexpr std::uint64_t kReferenceBytes = 8, kPartBytes = 24;

  MeshReferenceBinner(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid) : lists_(gpu, grid) {}

  void add(const TessellatedPatch& patch, std::span<const Meshlet> meshlets, const TriangleList& list);
  void finish(std::span<const std::uint64_t> state_bytes = {}) { lists_.finish(state_bytes); }
  const ReferenceLists& lists() const { return lists_; }

 private:
  ReferenceLists lists_;
  std::uint32_t meshlets_ = 0;
};

}  // namespace tessera::baselines
