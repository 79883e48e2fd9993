#pragma once

#include <cstdint>
#include <vector>

#include "base/counter.h"
#include "base/rect.h"
#include "tilecore/visibility/sample_pattern.h"

namespace tessera::tilecore {

// The two reference values of a draw, 8 bits each like the stencil itself: ref1 <= stencil < ref2. That form cannot
// reach 255, so the last segment of the shutter is closed at the top. A sample of stencil value s has s/256 <= t <
// (s+1)/256.
struct StencilReferences {
  std::uint8_t ref1 = 0, ref2 = 255;
  bool closed = true;

  bool keeps(int stencil) const { return stencil >= ref1 && (stencil < ref2 || (closed && stencil == ref2)); }
  bool whole_shutter() const { return ref1 == 0 && ref2 == 255 && closed; }

  // The references that keep all values of a range, which must not be empty.
  static StencilReferences of(const TimeRange& values) {
    if (values.last >= 255) return {static_cast<std::uint8_t>(values.first), 255, true};
    return {static_cast<std::uint8_t>(values.first), static_cast<std::uint8_t>(values.last + 1), false};
  }
};

struct StencilCounters {
  std::uint64_t tests = 0;
  std::uint64_t kept = 0;
  std::uint64_t hits = 0;
  std::uint64_t lanes_issued = 0;
};

// Stencil test before visibility (stochastic rasterization by stencil operations, US 9626762): the stencil buffer holds
// the samples' times, and a bounding polygon that covers a piece of the shutter keeps only the samples of its time.
// Another unit does the depth test, after visibility.
//
// It has no settings. Counts tests, kept samples and later hits ("valid rate": hits / kept), and the lanes of a machine
// that runs the inside test in groups of 32 samples: a group is issued when one of its samples is kept.
//
// Invariants (cited by the tests):
//   ST1  References that split 0..255 without gap or overlap keep every sample exactly once: stencil 0 is in the first
//        segment, 255 in the last.
//   ST2  Samples come out in the order of the walk: row by row of the rectangle, natural order within the row.
//   ST3  hits <= kept <= lanes_issued, and kept <= tests.
class StencilUnit {
 public:
  static constexpr std::uint32_t kLanes = 32;  // [spec] warps of 32; Mali-G77 16, Adreno 64 to 128

  // Finds the samples of the pixels (inside the tile) that the references keep, as numbers in natural order. `kept` is
  // overwritten.
  void keep(const TileSamples& samples, const IntRect& pixels, const StencilReferences& references,
            std::vector<std::uint32_t>& kept);

  // Records that `count` of the last kept samples hit a triangle.
  void record_hits(std::uint64_t count) { counters_.hits += count; }

  const StencilCounters& counters() const { return counters_; }
  StencilCounters take_counters();

 private:
  StencilCounters counters_;
};

// All samples of the pixels, for draws without a stencil test.
void all_samples(const TileSamples& samples, const IntRect& pixels, std::vector<std::uint32_t>& out);

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kCounterFields<tilecore::StencilCounters> =
    std::to_array<CounterField<tilecore::StencilCounters>>({
        {"tilecore.stencil_tests", &tilecore::StencilCounters::tests, Combine::kSum, "tests",
         "Samples of bounding polygons whose stencil value was compared with the two references.",
         "MaliFragLZSTestTd (stencil part)"},
        {"tilecore.stencil_kept", &tilecore::StencilCounters::kept, Combine::kSum, "samples",
         "Samples that the stencil test kept.", ""},
        {"tilecore.stencil_hits", &tilecore::StencilCounters::hits, Combine::kSum, "samples",
         "Kept samples that then were inside a triangle of their bounding polygon. Over stencil_kept: the valid rate.",
         ""},
        {"tilecore.stencil_lanes_issued", &tilecore::StencilCounters::lanes_issued, Combine::kSum, "lanes",
         "Lanes of groups of 32 samples, along the walk of the bounding polygon, in which at least one sample was "
         "kept. Under stencil_kept: the occupancy.",
         ""},
    });
TESSERA_COUNTERS_COVER(tilecore::StencilCounters);
template <>
inline constexpr bool kAbsentWhenIdle<tilecore::StencilCounters> = true;

}  // namespace tessera
