#include "frontend/occlusion_candidate.h"

#include "base/check.h"

namespace tessera::frontend {
namespace {

void put(std::uint64_t value, int bytes, std::vector<std::uint8_t>& out) {
  for (int k = 0; k < bytes; ++k) out.push_back(static_cast<std::uint8_t>(value >> (8 * k) & 0xFF));
}
std::uint32_t get(std::span<const std::uint8_t> bytes) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < bytes.size(); ++k) value |= std::uint32_t{bytes[k]} << (8 * k);
  return value;
}

}  // namespace

void pack_candidates(const OcclusionCandidate& d, std::vector<std::uint8_t>& out) {
  const IntRect& b = d.footprint.blocks;
  TESSERA_CHECK(b.x0 >= 0 && b.y0 >= 0 && !b.empty() && b.x1 <= 65536 && b.y1 <= 65536, "blocks fit 16 bits");
  TESSERA_CHECK(d.level < 8 && d.segment < 4096, "a level fits 3 bits, a segment 12");
  put(d.number, 4, out);
  put(d.footprint.nearest, 2, out);
  put(d.level | std::uint64_t{d.kind} << 3 | std::uint64_t{d.segment} << 4, 2, out);
  for (const int at : {b.x0, b.y0, b.x1 - 1, b.y1 - 1}) put(static_cast<std::uint64_t>(at), 2, out);
}

std::vector<OcclusionCandidate> unpack_candidates(std::span<const std::uint8_t> bytes) {
  std::vector<OcclusionCandidate> all;
  for (; bytes.size() >= kDeferredBytes; bytes = bytes.subspan(kDeferredBytes)) {
    const std::uint32_t word = get(bytes.subspan(6, 2));
    const auto block = [&](std::size_t at) { return static_cast<int>(get(bytes.subspan(at, 2))); };
    OcclusionCandidate d;
    d.kind = (word >> 3 & 1) != 0 ? OcclusionCandidate::kInstance : OcclusionCandidate::kGroup;
    d.level = static_cast<std::uint8_t>(word & 7);
    d.segment = static_cast<std::uint16_t>(word >> 4 & 0xFFF);
    d.number = get(bytes.first(4));
    d.footprint = {{block(8), block(10), block(12) + 1, block(14) + 1},
                   static_cast<DepthCode>(get(bytes.subspan(4, 2)))};
    all.push_back(d);
  }
  return all;
}

}  // namespace tessera::frontend
