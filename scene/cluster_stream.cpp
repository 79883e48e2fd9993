#include "scene/cluster_stream.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include <fmt/format.h>

#include "base/bit_stream.h"
#include "base/check.h"
#include "scene/dgf_block.h"
#include "scene/geometry_record.h"

namespace tessera::scene {
namespace {

constexpr std::uint32_t kUnnamed = std::numeric_limits<std::uint32_t>::max();

std::uint32_t bits_of_name(std::size_t known) {
  return known == 0 ? 0 : static_cast<std::uint32_t>(std::bit_width(known - 1));
}

// Places that the primitive's triangles use, and the bits that their differences from the least corner need.
PositionLattice lattice_of(int exponent, const Primitive& primitive, int& bits) {
  PositionLattice lattice;
  lattice.exponent = exponent;
  LatticePoint low, high;
  low.fill(std::numeric_limits<std::int32_t>::max()), high.fill(std::numeric_limits<std::int32_t>::min());
  for (const std::uint32_t index : primitive.indices) {
    const LatticePoint place = lattice.place(primitive.vertices.positions[index]);
    for (std::size_t axis = 0; axis < 3; ++axis)
      low[axis] = std::min(low[axis], place[axis]), high[axis] = std::max(high[axis], place[axis]);
  }
  lattice.origin = low;
  bits = 1;
  for (std::size_t axis = 0; axis < 3; ++axis)
    bits = std::max(bits, static_cast<int>(std::bit_width(static_cast<std::uint32_t>(high[axis] - low[axis]))));
  return lattice;
}

void append_triangles(const ClusterCell& cell, std::span<const std::uint32_t> vertices,
                      std::vector<std::uint32_t>& indices) {
  const auto& c = cell.corner;
  indices.insert(indices.end(), {vertices[c[0]], vertices[c[1]], vertices[c[2]]});
  if (!cell.single()) indices.insert(indices.end(), {vertices[c[0]], vertices[c[2]], vertices[c[3]]});
}

}  // namespace

std::optional<ClusterStream> encode_cluster_stream(GeometryEncoding encoding, int exponent,
                                                   const Primitive& primitive) {
  TESSERA_CHECK(encoding != GeometryEncoding::kRaw && !primitive.indices.empty(), "triangles in an encoding");
  ClusterStream out;
  const PositionLattice lattice = lattice_of(exponent, primitive, out.bits);
  const GeometrySettings settings{encoding, out.bits};
  const MeshClusters clusters = build_clusters(primitive);
  out.clusters = clusters.clusters.size();
  std::vector<std::uint8_t> records;
  BitWriter numbers;
  std::vector<std::uint32_t> number(primitive.vertices.count(), kUnnamed);
  for (const Cluster& cluster : clusters.clusters) {
    const std::span<const std::uint32_t> vertices(&clusters.vertices[cluster.first_vertex], cluster.vertex_count);
    std::array<LatticePoint, kMaxClusterVertices> points;
    for (std::size_t v = 0; v < vertices.size(); ++v)
      points[v] = lattice.place(primitive.vertices.positions[vertices[v]]);
    if (encoding == GeometryEncoding::kDgf && !fits_dgf(std::span(points).first(vertices.size()))) return std::nullopt;
    const std::span<const ClusterCell> cells(&clusters.cells[cluster.first_cell], cluster.cell_count);
    const EncodedRecord record = encode_record(settings, lattice, std::span(points).first(vertices.size()), cells);
    TESSERA_CHECK(record.parts <= 255 && record.bytes.size() <= 0xffff, "records fit their headers");
    put_word(static_cast<std::uint32_t>(vertices.size() | record.parts << 8 | record.bytes.size() << 16), out.bytes);
    records.insert(records.end(), record.bytes.begin(), record.bytes.end());
    for (const std::uint8_t local : record.order) {
      std::uint32_t& known = number[vertices[local]];
      const bool fresh = known == kUnnamed;
      numbers.put(fresh ? 1 : 0, 1);
      if (fresh) {
        known = static_cast<std::uint32_t>(out.order.size());
        out.order.push_back(vertices[local]);
      } else {
        numbers.put(known, bits_of_name(out.order.size()));
      }
    }
    // A triangle without an area may have gone into a cell of one.
    for (const ClusterCell& cell : cells) out.triangles += cell.single() ? 1 : 2;
  }
  out.bytes.insert(out.bytes.end(), records.begin(), records.end());
  out.bytes.insert(out.bytes.end(), numbers.bytes().begin(), numbers.bytes().end());
  return out;
}

std::optional<DecodedClusters> decode_cluster_stream(const GeometrySettings& settings,
                                                     std::span<const std::uint8_t> bytes,
                                                     const ClusterStreamCounts& counts, std::string& fault) {
  if (counts.clusters > bytes.size() / kClusterHeaderBytes) {
    fault = fmt::format("has {} bytes, too few for {} clusters", bytes.size(), counts.clusters);
    return std::nullopt;
  }
  std::size_t at = counts.clusters * kClusterHeaderBytes, records = 0;
  for (std::size_t c = 0; c < counts.clusters; ++c)
    records += std::size_t{bytes[kClusterHeaderBytes * c + 2]} | std::size_t{bytes[kClusterHeaderBytes * c + 3]} << 8;
  if (records > bytes.size() - at) {
    fault = fmt::format("ends inside the records of its clusters, which take {} bytes", records);
    return std::nullopt;
  }
  BoundedBitReader numbers(bytes.subspan(at + records));
  DecodedClusters out;
  for (std::size_t c = 0; c < counts.clusters; ++c) {
    const std::uint8_t* const header = &bytes[kClusterHeaderBytes * c];
    const std::size_t vertices = header[0], size = std::size_t{header[2]} | std::size_t{header[3]} << 8;
    const std::optional<DecodedRecord> record = read_record(settings, bytes.subspan(at, size), vertices, header[1]);
    at += size;
    if (!record) {
      fault = fmt::format("cluster {} is no record of {} vertices and {} parts", c, vertices, header[1]);
      return std::nullopt;
    }
    std::array<std::uint32_t, kMaxClusterVertices> number;
    for (std::size_t v = 0; v < vertices; ++v) {
      const std::size_t known = out.positions.size();
      const bool fresh = numbers.get(1) != 0;
      number[v] = fresh ? static_cast<std::uint32_t>(known) : numbers.get(bits_of_name(known));
      if (numbers.overrun() || number[v] >= known + (fresh ? 1 : 0) || number[v] >= counts.vertices) {
        fault = fmt::format("cluster {} has a vertex that the primitive does not have", c);
        return std::nullopt;
      }
      if (fresh) out.positions.push_back(record->positions[v]);
      if (out.positions[number[v]] != record->positions[v]) {
        fault = fmt::format("cluster {} has vertex {} at another place than a cluster before", c, number[v]);
        return std::nullopt;
      }
    }
    const std::size_t before = out.indices.size() / 3;
    for (const ClusterCell& cell : record->cells)
      append_triangles(cell, std::span(number).first(vertices), out.indices);
    const std::size_t triangles = out.indices.size() / 3 - before;
    if (triangles == 0 || triangles > kMaxClusterTriangles || before + triangles > counts.triangles) {
      fault = fmt::format("cluster {} has {} triangles", c, triangles);
      return std::nullopt;
    }
    out.triangles_of_cluster.push_back(static_cast<std::uint8_t>(triangles));
  }
  if (out.positions.size() != counts.vertices || out.indices.size() != 3 * counts.triangles) {
    fault = fmt::format("has {} vertices and {} triangles, the accessors say {} and {}", out.positions.size(),
                        out.indices.size() / 3, counts.vertices, counts.triangles);
    return std::nullopt;
  }
  return out;
}

}  // namespace tessera::scene
