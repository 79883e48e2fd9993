#include "tilecore/resolve/multisample_resolve.h"

#include <algorithm>

namespace tessera::tilecore {

void resolve_multisample(const ResolveInput& in, Image& target, ResolveCounters& counters, memory::Ledger& ledger) {
  std::size_t sample = 0;
  for (int y = in.pixels.y0; y < in.pixels.y1; ++y) {
    const auto width = static_cast<std::size_t>(in.pixels.width()), spp = static_cast<std::size_t>(in.spp);
    float* out = target.at(in.pixels.x0 - in.region.x0, y - in.region.y0).data();
    if (in.spp == 4) {
      means_of_row(&in.color[sample], &in.coverage[sample], width, out);
      sample += width * spp;
    } else {
      for (std::size_t x = 0; x < width; ++x, sample += spp, out += 4) {
        const Vec4 mean = mean_of_samples(&in.color[sample], &in.coverage[sample], in.spp);
        std::copy_n(&mean.x, 4, out);
      }
    }
    // A tile's row of pixels is contiguous in memory.
    const std::uint64_t address = in.region.index(in.pixels.x0, y) * kFramePixelBytes;
    if (in.charge)
      ledger.write_at(memory::Unit::kResolve, memory::Purpose::kFrameBuffer, address, width * kFramePixelBytes,
                      in.burst_bytes);
  }
  counters.pixels_shaded +=
      static_cast<std::uint64_t>(in.pixels.width()) * static_cast<std::uint64_t>(in.pixels.height());
}

}  // namespace tessera::tilecore
