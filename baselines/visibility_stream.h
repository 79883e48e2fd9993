#pragma once

#include "base/rect.h"
#include "baselines/reshading.h"

namespace tessera::baselines {

// Size of the bins of a machine whose tile memory holds `gmem_bytes`: multiples of 32 pixels [spec: a6xx, Mesa].
// There are as few bins as possible while each fits colour and depth (4 bytes each, or `sample_bytes` together) of its
// samples, and they are as square as possible. At least 32x32, as with fewer bytes no bin would fit.
struct BinSize {
  int width, height;
};
BinSize bin_size(const IntRect& region, int samples_per_pixel, std::uint64_t gmem_bytes,
                 std::uint64_t sample_bytes = 8);

// A machine whose binning pass leaves one bit per triangle and bin; each bin reads and shades again the geometry that
// its bits name [spec: Adreno, VSC and GMEM; assumed: the coding of the bits].
//
// A bin's stream has numbers (7 bits a byte) that alternate: triangles left out, triangles visible. They cover all
// triangles of patches that the hull stage keeps, in the order of drawing, up to the last visible one.
//
// Invariants (cited by the tests):
//   VS1  The stream of a bin names exactly the triangles that setup keeps and that may touch the bin.
//   VS2  Each bin shades each vertex of its triangles once, and no other.
class VisibilityStreamBinner {
 public:
  VisibilityStreamBinner(const gpu::GpuConfiguration& gpu, const binner::TileGrid& bins)
      : lists_(gpu, bins), bins_(bins.tile_count()) {}

  void add(const TessellatedPatch& patch, const TriangleList& list);
  void finish(std::span<const std::uint64_t> state_bytes = {});
  const ReferenceLists& lists() const { return lists_; }

 private:
  struct Stream {
    std::uint64_t coded = 0;           // triangles before this one are in the list
    std::uint64_t begin = 0, end = 0;  // visible run that is not yet in the list
  };
  void put_run(binner::TileIndex bin);

  ReferenceLists lists_;
  std::vector<Stream> bins_;
  std::uint64_t triangles_ = 0;
};

}  // namespace tessera::baselines
