#include "baselines/deferred_vertex.h"

#include <algorithm>

#include "base/bit_stream.h"
#include "baselines/tile_reference.h"

namespace tessera::baselines {

void DeferredVertexBinner::add(const TessellatedPatch& patch, const TriangleList& list,
                               const std::optional<Reshading::Tessellation>& tessellation) {
  lists_.reshading().add(patch, list, tessellation);
  struct TileTriangle {
    binner::TileIndex tile;
    std::uint32_t triangle;
    auto operator<=>(const TileTriangle&) const = default;
  };
  std::vector<TileTriangle> touched;
  std::vector<std::uint8_t> bytes;
  std::size_t t = 0, tile = 0;
  for (std::size_t group = 0; group < list.group_ends.size(); ++group) {
    const std::uint32_t begins = group == 0 ? 0 : patch.group_ends[group - 1];
    touched.clear();
    for (; t < list.group_ends[group]; ++t)
      for (; tile < list.triangles[t].tiles_end; ++tile)
        touched.push_back({list.tiles[tile], list.triangles[t].number - begins});
    std::sort(touched.begin(), touched.end());
    for (std::size_t k = 0; k < touched.size();) {
      const binner::TileIndex of = touched[k].tile;
      Place& last = last_[of];
      const bool same = last.patch == patch.number;
      bytes.clear();
      put_number(patch.number - last.patch, bytes);
      if (patch.group_ends.size() > 1) put_number(same ? group - last.group : group, bytes);
      last = {patch.number, static_cast<std::uint32_t>(group)};
      std::bitset<kBlockTriangles> triangles;
      for (; k < touched.size() && touched[k].tile == of; ++k) triangles.set(touched[k].triangle);
      encode_triangles(triangles, patch.group_ends[group] - begins, bytes);
      lists_.append(of, bytes);
      lists_.count_entry(of);
      ++lists_.counters().entries;
    }
  }
}

std::unique_ptr<Scheme> make_deferred_vertex() {
  return std::make_unique<ReferenceScheme<DeferredVertexBinner, false, true>>();
}

}  // namespace tessera::baselines
