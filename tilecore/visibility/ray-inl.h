// The ray path, and the kernels of a set of effects: SIMD source that kernel files include once per SIMD target.

#include <algorithm>
#include <span>
#include <vector>

#include "tilecore/visibility/sample_tests.h"

#if defined(TESSERA_TILECORE_RAY_PATH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_TILECORE_RAY_PATH_INL_H_
#undef TESSERA_TILECORE_RAY_PATH_INL_H_
#else
#define TESSERA_TILECORE_RAY_PATH_INL_H_
#endif

#include "tilecore/visibility/cell_samples-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

// Classes of the sample pattern: their sample in the first cell of the grid, and the lens points of all their samples.
struct ClassLanes {
  V x, y, t, lens_u, lens_v, lens_extent_u, lens_extent_v;
};

// `get` returns a vector of an array's elements.
template <class E, class Get>
HWY_INLINE ClassLanes class_lanes(const SampleClasses& classes, const Get& get) {
  const V none = hn::Zero(D());
  ClassLanes k;
  k.x = get(classes.x);
  k.y = get(classes.y);
  k.t = get(classes.t);
  k.lens_u = E::kLens ? get(classes.lens_u) : none;
  k.lens_v = E::kLens ? get(classes.lens_v) : none;
  k.lens_extent_u = E::kLens ? get(classes.lens_extent_u) : none;
  k.lens_extent_v = E::kLens ? get(classes.lens_extent_v) : none;
  return k;
}

// A leaf, the tile and the pattern's grid, the same in all lanes.
struct LeafLanes {
  float rate;
  V x_low, x_high, y_low, y_high, near;
  V drift_x, drift_y, lens_factor, lens_size, lens_width;
  V side, per_side, tile_x0, tile_x1, tile_y0, tile_y1;
};

HWY_INLINE LeafLanes leaf_lanes(const Context& to, const MicroMesh::Leaf& leaf) {
  const auto all = [](float v) HWY_ATTR { return hn::Set(D(), v); };
  const TileSamples& samples = to.samples;
  LeafLanes v;
  v.rate = leaf.rate;
  v.x_low = all(leaf.x_low), v.x_high = all(leaf.x_high), v.y_low = all(leaf.y_low), v.y_high = all(leaf.y_high);
  v.near = all(leaf.near);
  v.drift_x = all(leaf.drift_x), v.drift_y = all(leaf.drift_y), v.lens_factor = all(leaf.lens_factor);
  v.lens_size = all(samples.lens_scale * leaf.lens_factor), v.lens_width = hn::Abs(v.lens_size);
  v.side = all(static_cast<float>(samples.classes->side)),
  v.per_side = all(1.0f / static_cast<float>(samples.classes->side));
  // Samples lie 1/256 or more before the end of their pixel.
  v.tile_x0 = all(static_cast<float>(samples.pixels.x0)),
  v.tile_x1 = all(static_cast<float>(samples.pixels.x1) - 0x1p-8f);
  v.tile_y0 = all(static_cast<float>(samples.pixels.y0)),
  v.tile_y1 = all(static_cast<float>(samples.pixels.y1) - 0x1p-8f);
  return v;
}

// Rate-corrected time of the lanes (see MicroMesh).
HWY_INLINE V leaf_time(V t, float rate) {
  if (rate == 1.0f) return t;  // equals the formula, exactly
  const D d;
  const V tr = hn::Mul(t, hn::Set(d, rate));
  return hn::Div(tr, hn::Add(hn::Sub(hn::Set(d, 1.0f), t), tr));
}

// Columns and rows of the pattern's grid where the leaf's box, at the class's time and lens point, holds the class's
// sample; usually one of each, or none (`any` is not set).
struct GridCells {
  V tau, column0, column1, row0, row1;
  M any;
};

template <class E>
HWY_INLINE GridCells grid_cells(const LeafLanes& leaf, const ClassLanes& k) {
  const D d;
  GridCells g;
  g.tau = E::kMotion ? leaf_time(k.t, leaf.rate) : k.t;
  V shift_x = E::kMotion ? hn::Mul(g.tau, leaf.drift_x) : hn::Zero(d),
    shift_y = E::kMotion ? hn::Mul(g.tau, leaf.drift_y) : hn::Zero(d);
  V width_x = hn::Zero(d), width_y = hn::Zero(d);
  if constexpr (E::kLens) {
    shift_x = fma(hn::Neg(k.lens_u), leaf.lens_size, shift_x);
    shift_y = fma(hn::Neg(k.lens_v), leaf.lens_size, shift_y);
    width_x = hn::Mul(k.lens_extent_u, leaf.lens_width);
    width_y = hn::Mul(k.lens_extent_v, leaf.lens_width);
  }
  const auto cells_from = [&](V low, V width, V shift, V first, V at) HWY_ATTR {
    return hn::Ceil(hn::Mul(hn::Sub(hn::Max(hn::Sub(hn::Add(low, shift), width), first), at), leaf.per_side));
  };
  const auto cells_to = [&](V high, V width, V shift, V last, V at) HWY_ATTR {
    return hn::Floor(hn::Mul(hn::Sub(hn::Min(hn::Add(hn::Add(high, shift), width), last), at), leaf.per_side));
  };
  g.column0 = cells_from(leaf.x_low, width_x, shift_x, leaf.tile_x0, k.x),
  g.column1 = cells_to(leaf.x_high, width_x, shift_x, leaf.tile_x1, k.x);
  g.row0 = cells_from(leaf.y_low, width_y, shift_y, leaf.tile_y0, k.y),
  g.row1 = cells_to(leaf.y_high, width_y, shift_y, leaf.tile_y1, k.y);
  g.any = hn::And(hn::Le(g.column0, g.column1), hn::Le(g.row0, g.row1));
  return g;
}

// Adds the samples of one cell of the grid for each class of `in` to the survivors, unless they miss the leaf's box or
// see a nearer surface.
template <class E>
HWY_INLINE void add_survivors(const Context& to, const LeafLanes& leaf, const ClassLanes& k, V tau, VI class_sample,
                              V column, V row, M in, Survivors& survivors) {
  const D d;
  const DI di;
  const TileSamples& samples = to.samples;
  const V sample_x = fma(column, leaf.side, k.x), sample_y = fma(row, leaf.side, k.y);
  const VI pixel_x = hn::ConvertTo(di, hn::Sub(fma(column, leaf.side, hn::Floor(k.x)), leaf.tile_x0));
  const VI pixel_y = hn::ConvertTo(di, hn::Sub(fma(row, leaf.side, hn::Floor(k.y)), leaf.tile_y0));
  const VI tile_width = hn::Set(di, samples.pixels.width()), spp = hn::Set(di, samples.spp);
  const VI number = hn::Add(hn::Mul(hn::Add(hn::Mul(pixel_y, tile_width), pixel_x), spp), class_sample);
  const VI id = hn::IfThenElseZero(hn::RebindMask(di, in), number);
  V rest_x = E::kMotion ? fma(hn::Neg(tau), leaf.drift_x, sample_x) : sample_x,
    rest_y = E::kMotion ? fma(hn::Neg(tau), leaf.drift_y, sample_y) : sample_y;
  V lens_u = hn::Zero(d), lens_v = hn::Zero(d);
  if constexpr (E::kLens) {
    // The class's box of lens points admits more than this sample's point.
    lens_u = hn::GatherIndex(d, samples.lens_u.data(), id);
    lens_v = hn::GatherIndex(d, samples.lens_v.data(), id);
    rest_x = fma(lens_u, leaf.lens_factor, rest_x);
    rest_y = fma(lens_v, leaf.lens_factor, rest_y);
    in = hn::And(in, hn::And(hn::And(hn::Ge(rest_x, leaf.x_low), hn::Le(rest_x, leaf.x_high)),
                             hn::And(hn::Ge(rest_y, leaf.y_low), hn::Le(rest_y, leaf.y_high))));
  }
  if (to.settings.depth != nullptr) in = hn::And(in, hn::Ge(hn::GatherIndex(d, to.settings.depth, id), leaf.near));
  const std::size_t at = survivors.count;
  compress_store(sample_x, in, d, survivors.x + at);
  compress_store(sample_y, in, d, survivors.y + at);
  compress_store(rest_x, in, d, survivors.rest_x + at);
  compress_store(rest_y, in, d, survivors.rest_y + at);
  if constexpr (E::kMotion) compress_store(k.t, in, d, survivors.t + at);
  if constexpr (E::kLens) {
    compress_store(lens_u, in, d, survivors.lens_u + at);
    compress_store(lens_v, in, d, survivors.lens_v + at);
  }
  survivors.count += compress_store(id, in, di, survivors.id + at);
}

template <class E>
void trace(const Context& to, std::size_t l, TimeRange times) {
  const D d;
  const DI di;
  const SampleClasses& classes = *to.samples.classes;
  const std::size_t begin = classes.first_at[static_cast<std::size_t>(times.first)],
                    end = classes.first_at[static_cast<std::size_t>(times.last) + 1];
  to.work.box_tests += end - begin;
  to.work.box_lanes += VisibilityWork::lanes_of(end - begin);
  E::Clock::count(RayStage::kClasses, end - begin);
  const LeafLanes leaf = leaf_lanes(to, to.mesh.leaves[l]);

  // Few classes in a vector have a sample inside the box: these are first packed into full vectors.
  constexpr std::size_t kCapacity = 256;
  alignas(64) std::int32_t found[kCapacity + 2 * kMaxLanes];
  Survivors survivors;
  for (std::size_t c = begin; c < end;) {
    std::size_t count = 0;
    for (; c < end && count < kCapacity; c += hn::Lanes(d)) {
      const GridCells grid = grid_cells<E>(leaf, class_lanes<E>(classes, [&](const std::vector<float>& v) HWY_ATTR {
                                             return hn::LoadU(d, v.data() + c);
                                           }));
      const M any = hn::And(grid.any, hn::FirstN(d, end - c));
      count += compress_store(numbers_from(c), any, di, found + count);
    }
    hn::StoreU(hn::Zero(di), di, found + count);
    for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
      const VI number = hn::Load(di, found + i), class_sample = hn::GatherIndex(di, classes.sample.data(), number);
      const ClassLanes k = class_lanes<E>(
          classes, [&](const std::vector<float>& v) HWY_ATTR { return hn::GatherIndex(d, v.data(), number); });
      const GridCells grid = grid_cells<E>(leaf, k);
      const M any = hn::And(grid.any, hn::FirstN(d, count - i));
      const V one = hn::Set(d, 1.0f);
      for (V row = grid.row0;; row = hn::Add(row, one)) {
        const M in_row = hn::And(any, hn::Le(row, grid.row1));
        if (hn::AllFalse(d, in_row)) break;
        for (V column = grid.column0;; column = hn::Add(column, one)) {
          const M in = hn::And(in_row, hn::Le(column, grid.column1));
          if (hn::AllFalse(d, in)) break;
          to.work.box_lanes += hn::CountTrue(d, in);
          add_survivors<E>(to, leaf, k, grid.tau, class_sample, column, row, in, survivors);
          if (survivors.count + hn::Lanes(d) > Survivors::kCapacity) test_survivors<E>(to, l, survivors);
        }
      }
    }
  }
  if (survivors.count > 0) test_survivors<E>(to, l, survivors);
  to.work.end_leaf();
}

template <class E>
void test_samples(const Context& to, std::size_t slot, std::span<const std::uint32_t> list) {
  const D d;
  const DI di;
  const TileSamples& samples = to.samples;
  const Cell cell = load_cell<E>(to.mesh, slot);
  to.work.triangle_lanes += VisibilityWork::lanes_of(list.size()) * (hn::AllFalse(d, cell.second) ? 1 : 2);
  for (std::size_t i = 0; i < list.size(); i += hn::Lanes(d)) {
    const M valid = hn::FirstN(d, list.size() - i);
    alignas(64) std::int32_t id[kMaxLanes] = {};
    alignas(64) float t[kMaxLanes] = {};
    for (std::size_t k = 0; k < std::min(hn::Lanes(d), list.size() - i); ++k) {
      id[k] = static_cast<std::int32_t>(list[i + k]);
      t[k] = samples.t(list[i + k]);
    }
    SampleLanes s;
    s.id = hn::Load(di, id);
    s.x = hn::GatherIndex(d, samples.x.data(), s.id);
    s.y = hn::GatherIndex(d, samples.y.data(), s.id);
    s.t = hn::Load(d, t);
    s.lens_u = E::kLens ? hn::GatherIndex(d, samples.lens_u.data(), s.id) : hn::Zero(d);
    s.lens_v = E::kLens ? hn::GatherIndex(d, samples.lens_v.data(), s.id) : hn::Zero(d);
    test_cell<E>(to, cell, s, valid);
  }
}

// Calls run(Effects<...>()) with the other effects of a leaf: whether its corners change their depth, and the
// projection.
template <bool kMotion, bool kLens, class Clock, class Run>
HWY_INLINE void with_leaf(bool flat, bool orthographic, const Run& run) {
  if constexpr (kMotion) {
    if (!flat) {
      if (orthographic)
        run(Effects<true, true, kLens, true, Clock>());
      else
        run(Effects<true, true, kLens, false, Clock>());
      return;
    }
  }
  if (orthographic)
    run(Effects<kMotion, false, kLens, true, Clock>());
  else
    run(Effects<kMotion, false, kLens, false, Clock>());
}

template <bool kMotion, bool kLens, class Clock>
void trace_leaf_with(const MicroMesh& mesh, std::size_t leaf, const TileSamples& samples, TimeRange times,
                     const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work) {
  const Context context{mesh, samples, settings, sink, work};
  Clock::enter(RayStage::kClasses);
  with_leaf<kMotion, kLens, Clock>(mesh.leaves[leaf].flat, settings.orthographic,
                                   [&](auto e) { trace<decltype(e)>(context, leaf, times); });
  Clock::enter(RayStage::kRest);
}

template <bool kMotion, bool kLens>
void test_cell_samples_with(const MicroMesh& mesh, std::size_t cell, std::span<const std::uint32_t> list,
                            const TileSamples& samples, const VisibilitySettings& settings, HitSink& sink,
                            VisibilityWork& work) {
  const Context context{mesh, samples, settings, sink, work};
  with_leaf<kMotion, kLens, NoStageClock>(mesh.leaves[cell / kLeafCells].flat, settings.orthographic,
                                          [&](auto e) { test_samples<decltype(e)>(context, cell, list); });
}

// The kernels of a set of effects for the current SIMD target.
template <bool kMotion, bool kLens, class Clock = NoStageClock>
VisibilityKernels kernels_with() {
  return {&trace_leaf_with<kMotion, kLens, Clock>, &test_cell_samples_with<kMotion, kLens>};
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
