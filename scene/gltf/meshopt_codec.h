#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace tessera::scene::gltf {

enum class MeshoptMode { kAttributes, kTriangles, kIndices };
enum class MeshoptFilter { kNone, kOctahedral, kQuaternion, kExponential, kColor };

// Layout of an unpacked buffer view: `count` elements of `stride` bytes. The stride of attributes is a multiple of 4,
// at most 256; the stride of indices is 2 or 4, and triangles have a multiple of 3 indices. A filter goes with
// attributes and some strides only: octahedral and colour 4 or 8, quaternion 8.
struct MeshoptLayout {
  std::uint64_t count = 0, stride = 0;
  MeshoptMode mode = MeshoptMode::kAttributes;
  MeshoptFilter filter = MeshoptFilter::kNone;

  std::uint64_t bytes() const { return count * stride; }
};

// The bitstreams of KHR_meshopt_compression, appendices A and B: attributes of versions 0 and 1, triangles and indices
// of version 1, all filters. EXT_meshopt_compression has the same ones without version 1 of attributes and without the
// colour filter. meshoptimizer decodes triangles and indices. Attributes are decoded here, as Debian's library does not
// know their version 1, and so are filters, as its own use approximate reciprocals where the host has them and images
// must not depend on the host.
//
// Invariants (cited by the tests):
//   MO1  A stream is used up to its last byte: a stream that is shorter or longer than its elements need is refused.
//   MO2  A vertex that a stream of triangles reuses before it has named one decodes to the index of all ones, which no
//        primitive may have.
//   MO3  A filter refuses elements without a scale, which is a 1 of K bits, or an alpha with its high bit.
//   MO4  A filter's results are computed by its formula in single precision, rounded half away from zero, clamped to
//        the component's range.

// The least bytes of a stream of this layout: a shorter stream is refused before its elements are allocated.
std::uint64_t min_meshopt_bytes(const MeshoptLayout& layout);

// Unpacks into `out`, layout.bytes() bytes. Returns the fault in words in `fault` and false for bytes that are no such
// stream; `out` is then undefined.
[[nodiscard]] bool decode_meshopt(std::span<const std::uint8_t> stream, const MeshoptLayout& layout,
                                  std::span<std::uint8_t> out, std::string& fault);

}  // namespace tessera::scene::gltf
