#include "tilecore/resolve/multisample_resolve.h"

namespace tessera::tilecore {

void resolve_multisample(const ResolveInput& in, Image& target, ResolveCounters& counters, memory::Ledger& ledger) {
  std::size_t sample = 0;
  for (int y = in.pixels.y0; y < in.pixels.y1; ++y) {
    for (int x = in.pixels.x0; x < in.pixels.x1; ++x) {
      const Vec4 mean = in.spp == 4 ? mean_of_samples<4>(&in.color[sample], &in.coverage[sample])
                                    : mean_of_samples(&in.color[sample], &in.coverage[sample], in.spp);
      sample += static_cast<std::size_t>(in.spp);
      const auto out = target.at(x - in.region.x0, y - in.region.y0);
      for (int c = 0; c < 4; ++c) out[static_cast<std::size_t>(c)] = mean[c];
    }
    // A tile's row of pixels is contiguous in memory.
    const auto width = static_cast<std::uint64_t>(in.pixels.width());
    const std::uint64_t address = in.region.index(in.pixels.x0, y) * kFramePixelBytes;
    if (in.charge)
      ledger.write_at(memory::Unit::kResolve, memory::Purpose::kFrameBuffer, address, width * kFramePixelBytes,
                      in.burst_bytes);
  }
  counters.pixels_shaded +=
      static_cast<std::uint64_t>(in.pixels.width()) * static_cast<std::uint64_t>(in.pixels.height());
}

}  // namespace tessera::tilecore
