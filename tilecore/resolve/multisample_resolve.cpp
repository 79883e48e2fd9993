#include "tilecore/resolve/multisample_resolve.h"

namespace tessera::tilecore {

void resolve_multisample(const ResolveInput& in, Image& target, ResolveCounters& counters, hardware::Ledger& ledger) {
  const float share = 1.0f / static_cast<float>(in.spp);
  std::size_t sample = 0;
  for (int y = in.pixels.y0; y < in.pixels.y1; ++y) {
    for (int x = in.pixels.x0; x < in.pixels.x1; ++x) {
      Vec3 color(0.0f);
      float coverage = 0.0f;
      for (int k = 0; k < in.spp; ++k, ++sample) {
        color += in.color[sample];
        coverage += in.coverage[sample];
      }
      const auto out = target.at(x - in.region.x0, y - in.region.y0);
      for (int c = 0; c < 3; ++c) out[static_cast<std::size_t>(c)] = color[c] * share;
      out[3] = coverage * share;
    }
    // A tile's row of pixels is contiguous in memory.
    const auto width = static_cast<std::uint64_t>(in.pixels.width());
    const auto address = (static_cast<std::uint64_t>(y - in.region.y0) * static_cast<std::uint64_t>(in.region.width()) +
                          static_cast<std::uint64_t>(in.pixels.x0 - in.region.x0)) * kFramePixelBytes;
    ledger.write_at(hardware::Unit::kResolve, hardware::Purpose::kFrameBuffer, address, width * kFramePixelBytes, in.burst_bytes);
  }
  counters.pixels_shaded += static_cast<std::uint64_t>(in.pixels.width()) * static_cast<std::uint64_t>(in.pixels.height());
}

}  // namespace tessera::tilecore
