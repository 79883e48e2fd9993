// Visibility without motion and lens: the raster path, and the ray path for tests of it.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/visibility/raster_kernel.cpp"
#include <hwy/foreach_target.h>

#include "tilecore/visibility/ray-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

// ---- Raster path ------------------------------------------------------------------------------------------------

struct SampleRow {
  std::size_t first, last;  // natural order; last excluded
};
HWY_INLINE SampleRow samples_of_row(const TileSamples& samples, int y, const IntRect& box) {
  const auto row = static_cast<std::size_t>((y - samples.pixels.y0) * samples.pixels.width());
  const auto of = [&](int x) {
    return (row + static_cast<std::size_t>(x - samples.pixels.x0)) * static_cast<std::size_t>(samples.spp);
  };
  return {of(box.x0), of(box.x1)};
}

// The cell against the pixels of `box`, row by row.
template <class E>
void raster_cell(const Context& to, std::size_t slot, IntRect box) {
  const D d;
  const TileSamples& samples = to.samples;
  const Cell cell = load_cell<E>(to.mesh, slot);
  const std::uint64_t triangles = hn::AllFalse(d, cell.second) ? 1 : 2;
  for (int y = box.y0; y < box.y1; ++y) {
    const auto [first, last] = samples_of_row(samples, y, box);
    to.work.triangle_lanes += triangles * VisibilityWork::lanes_of(last - first);
    for (std::size_t i = first; i < last; i += hn::Lanes(d)) {
      SampleLanes s;
      s.x = hn::LoadU(d, samples.x.data() + i);
      s.y = hn::LoadU(d, samples.y.data() + i);
      s.t = s.lens_u = s.lens_v = hn::Zero(d);
      s.id = numbers_from(i);
      test_cell<E>(to, cell, s, hn::FirstN(d, last - i));
    }
  }
}

// Pixels of the tile that a static box touches.
HWY_INLINE IntRect pixels_of(float x_low, float x_high, float y_low, float y_high, const IntRect& tile) {
  const auto first = [](float low, int begin, int end) {
    return low > static_cast<float>(begin) ? (low < static_cast<float>(end) ? static_cast<int>(low) : end) : begin;
  };
  const auto last = [](float high, int begin, int end) {
    return high >= static_cast<float>(begin) ? (high < static_cast<float>(end) ? static_cast<int>(high) + 1 : end)
                                             : begin;
  };
  return {first(x_low, tile.x0, tile.x1), first(y_low, tile.y0, tile.y1), last(x_high, tile.x0, tile.x1),
          last(y_high, tile.y0, tile.y1)};
}

// Leaves whose cells cover fewer pixels than this on average go through pairs of sample and cell, others cell by cell:
// rows of samples fill vectors only when they are long. [measured] tessera_embree_baseline --profile.
constexpr int kPairedCellPixels = 9;

// The samples of the pixels of `box` against the leaf's cells.
template <class E>
void raster_pairs(const Context& to, std::size_t l, IntRect box) {
  const D d;
  const DI di;
  const TileSamples& samples = to.samples;
  const MicroMesh::Leaf& leaf = to.mesh.leaves[l];
  const V x_low = hn::Set(d, leaf.x_low), x_high = hn::Set(d, leaf.x_high), y_low = hn::Set(d, leaf.y_low),
          y_high = hn::Set(d, leaf.y_high);
  const V near = hn::Set(d, leaf.near);
  Survivors survivors;
  for (int y = box.y0; y < box.y1; ++y) {
    const auto [first, last] = samples_of_row(samples, y, box);
    to.work.box_lanes += VisibilityWork::lanes_of(last - first);
    for (std::size_t i = first; i < last; i += hn::Lanes(d)) {
      const V sample_x = hn::LoadU(d, samples.x.data() + i), sample_y = hn::LoadU(d, samples.y.data() + i);
      M in = hn::And(hn::And(hn::Ge(sample_x, x_low), hn::Le(sample_x, x_high)),
                     hn::And(hn::Ge(sample_y, y_low), hn::Le(sample_y, y_high)));
      in = hn::And(in, hn::FirstN(d, last - i));
      if (hn::AllFalse(d, in)) continue;
      const VI id = hn::IfThenElseZero(hn::RebindMask(di, in), numbers_from(i));
      // A gather: the array of depths ends with the last sample.
      if (to.settings.depth != nullptr) in = hn::And(in, hn::Ge(hn::GatherIndex(d, to.settings.depth, id), near));
      const std::size_t at = survivors.count;
      compress_store(sample_x, in, d, survivors.x + at);
      compress_store(sample_y, in, d, survivors.y + at);
      compress_store(sample_x, in, d, survivors.rest_x + at);
      compress_store(sample_y, in, d, survivors.rest_y + at);
      survivors.count += compress_store(id, in, di, survivors.id + at);
      if (survivors.count + hn::Lanes(d) > Survivors::kCapacity) test_survivors<E>(to, l, survivors);
    }
  }
  if (survivors.count > 0) test_survivors<E>(to, l, survivors);
  to.work.end_leaf();
}

template <class E>
void raster(const Context& to) {
  const MicroMesh& mesh = to.mesh;
  for (std::size_t l = 0; l < mesh.leaves.size(); ++l) {
    const MicroMesh::Leaf& leaf = mesh.leaves[l];
    ++to.work.box_tests;
    ++to.work.box_lanes;
    const IntRect leaf_box = pixels_of(leaf.x_low, leaf.x_high, leaf.y_low, leaf.y_high, to.samples.pixels);
    if (leaf_box.empty()) continue;
    // The size of the whole leaf decides, not of its part in the tile.
    if ((leaf.x_high - leaf.x_low) * (leaf.y_high - leaf.y_low) <
        static_cast<float>(kPairedCellPixels * std::popcount(leaf.cells))) {
      raster_pairs<E>(to, l, leaf_box);
      if (to.settings.depth != nullptr) to.sink.flush();  // the next leaf sees the samples that this one covered
      continue;
    }
    to.work.box_tests += static_cast<std::uint64_t>(std::popcount(leaf.cells));
    to.work.box_lanes += kLeafCells;
    for (std::uint32_t cells = leaf.cells; cells != 0; cells &= cells - 1) {
      const std::size_t c = l * kLeafCells + static_cast<std::size_t>(std::countr_zero(cells));
      const IntRect box =
          pixels_of(mesh.box_x_low[c], mesh.box_x_high[c], mesh.box_y_low[c], mesh.box_y_high[c], to.samples.pixels);
      if (!box.empty()) raster_cell<E>(to, c, box);
    }
    if (to.settings.depth != nullptr) to.sink.flush();
  }
}

void RasterMesh(const MicroMesh& mesh, const TileSamples& samples, const VisibilitySettings& settings, HitSink& sink,
                VisibilityWork& work) {
  const Context context{mesh, samples, settings, sink, work};
  if (settings.orthographic)
    raster<Effects<false, false, false, true>>(context);
  else
    raster<Effects<false, false, false, false>>(context);
}

// ---- Ray path ---------------------------------------------------------------------------------------------------

VisibilityKernels StillKernels() { return kernels_with<false, false>(); }

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(StillKernels);
HWY_EXPORT(RasterMesh);

VisibilityKernels still_kernels() { return HWY_DYNAMIC_DISPATCH(StillKernels)(); }

void raster_mesh(const MicroMesh& mesh, const TileSamples& samples, const VisibilitySettings& settings, HitSink& sink,
                 VisibilityWork& work) {
  HWY_DYNAMIC_DISPATCH(RasterMesh)(mesh, samples, settings, sink, work);
}

}  // namespace tessera::tilecore
#endif
