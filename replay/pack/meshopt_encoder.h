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

// [spec] the defaults of gltfpack -c; weights have its 8 bits.
inline constexpr QuantizationBits kMeshoptBits = {14, 8, 12, 8, 8};
inline constexpr int kMaxMeshoptBits = 16;

// A buffer view compressed with meshoptimizer: its stream, and the members of EXT_meshopt_compression that describe its
// unpacking: byteStride, count, mode, filter.
struct MeshoptStream {
  std::vector<std::uint8_t> bytes;
  nlohmann::json layout;
};

// Encodes elements of `stride` bytes, a multiple of 4 and at most 256, without loss. `filter` names the filter that
// encoded them.
MeshoptStream encode_elements(std::span<const std::uint8_t> elements, std::size_t stride,
                              const std::string& filter = "NONE");
// Encodes indices of `bytes` bytes each, 2 or 4. Triangles keep their order and winding, but may begin at another
// corner.
MeshoptStream encode_triangles(std::span<const std::uint32_t> indices, std::size_t bytes);
MeshoptStream encode_indices(std::span<const std::uint32_t> indices, std::size_t bytes);

// Exponent of the grid on which values from `low` to `high` have `bits` bits: the step, a power of two, is at most
// their distance / (2^bits - 1), and all values have 24 bits with sign. The grid begins at zero, so that equal values
// stay equal in every attribute.
int grid_exponent(float low, float high, int bits);

// An attribute encoded for meshoptimizer's vertex codec.
struct MeshoptAttribute {
  MeshoptStream stream;
  int component_type = 5126;
  bool normalized = false;
  std::vector<float> decoded;  // positions: their decoded values
};

// Quantises floats by the attribute's name as gltfpack -c -vpf -vtf does, and compresses: positions and texture
// coordinates stay floats on a grid (so that no node and no texture transform changes, and distances of displacement
// keep their unit), normals and tangents become octahedra, colours and weights normalised integers. Integers stay
// exact, and so do normals and tangents that are not unit vectors.
MeshoptAttribute encode_attribute(const DracoAttribute& attribute, const QuantizationBits& bits);

// Whether all vectors of normals or tangents have length 1, as octahedral encoding needs.
bool is_unit(const DracoAttribute& attribute);

// Moves every vertex to its new number, below `used`, and updates the indices. Vertices whose number is ~0 are dropped.
void renumber_vertices(DracoInput& mesh, const std::vector<std::uint32_t>& place, std::size_t used);

std::vector<Vec3> positions_of(const DracoInput& mesh);

// Joins vertices whose values are all equal, orders triangles cluster by cluster (scene::cluster_order) and vertices by
// first use; drops vertices that no triangle uses.
void order_for_meshopt(DracoInput& mesh);

}  // namespace tessera::replay
