#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "scene/capture.h"
#include "scene/clusters.h"
#include "scene/geometry_settings.h"
#include "scene/position_lattice.h"

namespace tessera::scene {

// TESSERA_clusters, version 2, keeps the positions and triangles of a primitive in a buffer view. Each cluster has a record of
// scene/geometry_record.h, and a list says which vertices several records share. Little endian:
//
//   4 bytes a cluster   8 bits: its vertices, 1 to 64; 8 bits: its parts, 1 to 255: cells, or blocks of dgf; 16 bits: bytes of
//                       its record
//   records             one after another, in the order of the clusters
//   vertices            a stream of bits, the lowest of each byte first, zeros at the end. For each vertex of each record: 1 bit,
//                       1 for the next vertex of the primitive; after a 0 the number of an earlier one, in as few bits as
//                       hold the numbers so far
//
// Invariants (cited by the tests):
//   CLS1  decode_cluster_stream() gives the places that encode_cluster_stream() was given, and the triangles of each cluster
//         with their windings; `order` names the vertices.
//   CLS2  decode_cluster_stream() reads any bytes. It returns clusters within the limits of scene/clusters.h, finite positions
//         and triangles whose vertices exist, or a fault. It takes no more memory than the requested counts need.
inline constexpr std::size_t kClusterHeaderBytes = 4;

struct ClusterStream {
  std::vector<std::uint8_t> bytes;
  std::size_t clusters = 0;
  int bits = 0;                      // GeometrySettings::bits: bits of quantised records along each axis
  std::vector<std::uint32_t> order;  // by vertex of the stream: its number in the primitive
  std::size_t triangles = 0;         // triangles of the cells; the primitive's triangles without area may be missing
};
// Encodes a primitive; `encoding` is not raw. The positions that triangles use are points of a lattice with steps of
// 2^exponent, and with dgf at most 2^kDgfPlaceBits steps from the origin. Vertices that no triangle uses are left out.
// Returns nothing where a cluster is too large for a block of dgf.
std::optional<ClusterStream> encode_cluster_stream(GeometryEncoding encoding, int exponent, const Primitive& primitive);

// Numbers of elements that the stream has to have.
struct ClusterStreamCounts {
  std::size_t clusters = 0, vertices = 0, triangles = 0;
};
struct DecodedClusters {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;  // three a triangle, cluster after cluster
  std::vector<std::uint8_t> triangles_of_cluster;
};
// Returns nothing where the bytes are no such stream; `fault` then says why.
std::optional<DecodedClusters> decode_cluster_stream(const GeometrySettings& settings,
                                                     std::span<const std::uint8_t> bytes,
                                                     const ClusterStreamCounts& counts, std::string& fault);

}  // namespace tessera::scene
