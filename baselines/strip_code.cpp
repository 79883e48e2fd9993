#include "baselines/strip_code.h"

#include "base/check.h"
#include "baselines/bit_stream.h"

namespace tessera::baselines {
namespace {

constexpr std::uint32_t kFresh = 3, kDeltaBits = 6;

// The edge of `before` that `next` has the other way round, and the corner of `next` opposite to it.
struct SharedEdge {
  std::uint32_t edge = kFresh;
  std::size_t corner = 0;
};

SharedEdge shared_edge(const BlockTriangle& before, const BlockTriangle& next) {
  for (std::uint32_t k = 0; k < 3; ++k)
    for (std::size_t c = 0; c < 3; ++c)
      if (next[(c + 1) % 3] == before[(k + 1) % 3] && next[(c + 2) % 3] == before[k]) return {k, c};
  return {};
}

}  // namespace

std::vector<std::uint8_t> encode_strip(std::span<const BlockTriangle> triangles) {
  BitWriter out;
  std::uint32_t used = 0;  // numbers below it have been used
  const auto put_vertex = [&](std::uint32_t vertex) {
    TESSERA_CHECK(vertex <= used && used <= kBlockVertices, "vertices are numbered by first use");
    out.put(vertex == used ? 1 : 0, 1);
    if (vertex == used)
      ++used;
    else
      out.put(used - 1 - vertex, kDeltaBits);
  };
  BlockTriangle before{};
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const BlockTriangle& next = triangles[t];
    const SharedEdge shared = t > 0 ? shared_edge(before, next) : SharedEdge{};
    out.put(shared.edge, 2);
    if (shared.edge == kFresh) {
      for (const std::uint8_t vertex : next) put_vertex(vertex);
      before = next;
    } else {
      put_vertex(next[shared.corner]);
      before = {next[(shared.corner + 1) % 3], next[(shared.corner + 2) % 3], next[shared.corner]};
    }
  }
  return out.bytes();
}

std::vector<BlockTriangle> decode_strip(std::span<const std::uint8_t> bytes, std::size_t count) {
  BitReader in(bytes);
  std::uint32_t used = 0;
  const auto get_vertex = [&] {
    const std::uint32_t vertex = in.get(1) != 0 ? used++ : used - 1 - in.get(kDeltaBits);
    return static_cast<std::uint8_t>(vertex);
  };
  std::vector<BlockTriangle> triangles;
  triangles.reserve(count);
  BlockTriangle before{};
  for (std::size_t t = 0; t < count; ++t) {
    const std::uint32_t edge = in.get(2);
    if (edge == kFresh)
      for (std::uint8_t& vertex : before) vertex = get_vertex();
    else
      before = {before[(edge + 1) % 3], before[edge], get_vertex()};
    triangles.push_back(before);
  }
  return triangles;
}

}  // namespace tessera::baselines
