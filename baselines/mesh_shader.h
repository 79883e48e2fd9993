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

// Machines with a mesh-shader pipeline in front of their tiler: task shaders drop meshlets, mesh shaders give the triangles
// of those that are left, set-up culls and covers these, and lists name them by meshlet. They differ in what is kept between
// the mesh shader and tiles.

// The work of a pass's mesh shaders; and which patches they shaded, with how many vertices and triangles each.
struct MeshPass {
  BaselineCounters setup;  // of the triangles of meshlets that were kept
  std::vector<PatchWork> patches;
  std::uint64_t vertices = 0;         // of these
  std::uint64_t attribute_bytes = 0;  // bursts of what their records hold for the pixel shader
  std::uint64_t unread_bytes = 0;     // of records that nobody fetched, as no meshlet was kept
};

// Keeps outputs in memory: a record for each meshlet, one behind the other.
//
//   kRing     as many as a workgroup may have, whatever it has [spec: Mesa's emulation for Adreno A8xx]: of 64 vertices
//             positions (16 bytes each, twice that where they move), then attributes in slots of 16 bytes; of 124
//             triangles three indices and a word that culls it (4 bytes each). 4 032 bytes with one slot. A vertex shader
//             that copies reads positions and indices of what there is, to bin
//   kCompact  what there is: a head of 4 bytes, positions, attributes, 3 bytes for each triangle, filled up to 4. The
//             binner takes it as it is made [assumed, in its favour]
//
// A tile's list, in the order of drawing: number (7 bits a byte), the meshlet less that of the reference before; its
// triangles that touch the tile, as in tile_reference.h. Tiles read the indices and positions of these, and the attributes
// of those that they see, through a cache of bursts (baselines.cache_bytes).
//
// Only positions and indices are stored as they are, as PostTessellationBinner has it.
//
// Invariants (cited by the tests):
//   MESH1  Every triangle of a kept meshlet that set-up keeps is in the list of every tile that it may touch, once.
//   MESH2  Each vertex of a kept meshlet is shaded and stored once for that meshlet.
enum class MeshStorage : std::uint8_t { kRing, kCompact };

class MeshletBinner {
 public:
  // [assumed] of the shader that copies, for each vertex: its address, two loads, an export
  static constexpr std::uint64_t kCopyInstructions = 8;

  MeshletBinner(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid, MeshStorage storage);

  // `meshlets`: of the patch, those that are kept; `list`: what set-up makes of the patch.
  void add(const TessellatedPatch& patch, std::span<const Meshlet> meshlets, const TriangleList& list);
  // As PostTessellationBinner::finish().
  void finish(const VisibleTriangles* visible = nullptr, std::span<const std::uint64_t> state_bytes = {});

  // Where the parts of a meshlet's record are, relative to it.
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
  // Bursts that are read to bin, and instructions of the shader that copies.
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
  std::vector<std::uint64_t> last_;  // of each tile's list: its last meshlet
};

// Keeps references: mesh shaders run again in each tile that a meshlet touches, for all of its vertices, in front of the
// cache that Reshading has. A reference takes 8 bytes, of a part of a patch 24 [spec: NVIDIA's vk_tessellated_clusters].
//
// Invariants (cited by the tests):
//   MR1  A kept meshlet is in the list of each tile that a triangle of it may touch, once.
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
