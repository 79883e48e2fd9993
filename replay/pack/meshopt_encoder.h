#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/vec.h"
#include "replay/pack/draco_encoder.h"

namespace tessera::replay {

// [spec] the defaults of gltfpack -c; weights are its bytes.
inline constexpr QuantizationBits kMeshoptBits = {14, 8, 12, 8, 8};
inline constexpr int kMaxMeshoptBits = 16;

// A buffer view compressed with meshoptimizer: its stream, and the members of EXT_meshopt_compression that say how it
// unpacks: byteStride, count, mode, filter.
struct MeshoptStream {
  std::vector<std::uint8_t> bytes;
  nlohmann::json layout;
};

// Elements of `stride` bytes, a multiple of 4 and at most 256, without loss. `filter` is what was applied to them.
MeshoptStream encode_elements(std::span<const std::uint8_t> elements, std::size_t stride,
                              const std::string& filter = "NONE");
// Indices of `bytes` bytes each, 2 or 4. Triangles come back in their order and winding, with another first corner.
MeshoptStream encode_triangles(std::span<const std::uint32_t> indices, std::size_t bytes);
MeshoptStream encode_indices(std::span<const std::uint32_t> indices, std::size_t bytes);

// The power of two of the grid on which values from `low` to `high` lie with `bits` bits: a step is at most their
// distance / (2^bits - 1), and all values have 24 bits with sign. The grid begins at zero, so that equal values stay
// equal whatever they are stored with.
int grid_exponent(float low, float high, int bits);

// An attribute as meshoptimizer's vertex codec wants it.
struct MeshoptAttribute {
  MeshoptStream stream;
  int component_type = 5126;
  bool normalized = false;
  std::vector<float> decoded;  // positions: as they are read back
};

// Quantises floats by the attribute's name as gltfpack -c -vpf -vtf does, and compresses: positions and texture
// coordinates stay floats on a grid (so that no node and no texture transform changes, and distances of displacement
// keep their unit), normals and tangents become octahedra, colours and weights normalised integers. Integers stay
// exact, and so do normals and tangents that are not unit vectors.
MeshoptAttribute encode_attribute(const DracoAttribute& attribute, const QuantizationBits& bits);

// Whether all vectors of normals or tangents have the length 1: what octahedra can hold.
bool is_unit(const DracoAttribute& attribute);

// Moves every vertex to its new number, of `used`, and names it so in the indices. Those whose number is ~0 are dropped.
void renumber_vertices(DracoInput& mesh, const std::vector<std::uint32_t>& place, std::size_t used);

std::vector<Vec3> positions_of(const DracoInput& mesh);

// Joins vertices whose values are all equal, orders triangles cluster by cluster (scene::cluster_order) and vertices by
// first use; vertices that no triangle has are dropped.
void order_for_meshopt(DracoInput& mesh);

}  // namespace tessera::replay
