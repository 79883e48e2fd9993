#include "baselines/tile_reference.h"

#include "base/bit_stream.h"
#include "base/check.h"

namespace tessera::baselines {
namespace {

constexpr std::size_t kMax = 64;  // largest count in 6 bits

std::vector<std::uint8_t> runs_of(const std::bitset<kBlockTriangles>& triangles, std::size_t count) {
  std::vector<std::uint8_t> runs;
  for (std::size_t t = 0; t < count;) {
    std::size_t skipped = 0, taken = 0;
    for (; t < count && !triangles[t]; ++t) ++skipped;
    for (; t < count && triangles[t]; ++t) ++taken;
    if (taken == 0) break;
    runs.push_back(static_cast<std::uint8_t>(skipped));
    runs.push_back(static_cast<std::uint8_t>(taken));
  }
  return runs;
}

}  // namespace

void encode_triangles(const std::bitset<kBlockTriangles>& triangles, std::size_t count,
                      std::vector<std::uint8_t>& out) {
  const std::size_t taken = triangles.count(), mask_bytes = (count + 7) / 8;
  TESSERA_CHECK(taken > 0 && taken <= count && count <= kBlockTriangles,
                "a reference is to some triangles of its block");
  if (taken == count) {
    out.push_back(0);
    return;
  }
  const std::vector<std::uint8_t> runs = runs_of(triangles, count);
  const auto form = [&](unsigned kind, std::size_t n) {
    out.push_back(static_cast<std::uint8_t>(kind << 6 | (n - 1)));
  };
  if (taken <= kMax && taken <= mask_bytes && taken <= runs.size()) {
    form(2, taken);
    std::size_t next = 0;
    for (std::size_t t = 0; t < count; ++t) {
      if (!triangles[t]) continue;
      out.push_back(static_cast<std::uint8_t>(t - next));
      next = t + 1;
    }
  } else if (runs.size() / 2 <= kMax && runs.size() < mask_bytes) {
    form(3, runs.size() / 2);
    out.insert(out.end(), runs.begin(), runs.end());
  } else {
    form(1, 1);
    for (std::size_t byte = 0; byte < mask_bytes; ++byte) {
      unsigned bits = 0;
      for (std::size_t b = 0; b < 8 && byte * 8 + b < count; ++b) bits |= (triangles[byte * 8 + b] ? 1u : 0u) << b;
      out.push_back(static_cast<std::uint8_t>(bits));
    }
  }
}

void encode_reference(const TileReference& reference, std::size_t count, std::uint64_t before,
                      std::vector<std::uint8_t>& out) {
  TESSERA_CHECK(reference.address >= before && reference.address % kBlockAlignment == 0, "references of a tile rise");
  put_number((reference.address - before) / kBlockAlignment, out);
  encode_triangles(reference.triangles, count, out);
}

}  // namespace tessera::baselines
