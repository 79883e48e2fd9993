#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "tilecore/drawable_counts.h"

namespace tessera::gpu {

// Declaration of one cost. `counter` is the frame's counter to which the cost of all drawables adds up; "" if there is
// none.
struct DrawableCost {
  std::string_view name;
  std::uint64_t tilecore::DrawableCounts::*member;
  std::string_view unit;
  std::string_view meaning;
  std::string_view counter;
};
inline constexpr auto kDrawableCosts = std::to_array<DrawableCost>({
    {"entries", &tilecore::DrawableCounts::entries, "entries", "List entries of it that tiles read.",
     "tilecore.entries_fetched"},
    {"sub_patches", &tilecore::DrawableCounts::sub_patches, "sub-patches",
     "Tessellated sub-patches that tiles tested, from the cache or made anew.", "tilecore.tessellation_requests"},
    {"triangles", &tilecore::DrawableCounts::triangles, "triangles", "Triangles of these sub-patches.", ""},
    {"procedure_samples", &tilecore::DrawableCounts::procedure_samples, "samples",
     "Samples of it that the arrays of tiles took.", "procedures.samples"},
    {"box_tests", &tilecore::DrawableCounts::box_tests, "tests", "Samples or tiles tested against its boxes.",
     "tilecore.box_tests"},
    {"triangle_tests", &tilecore::DrawableCounts::triangle_tests, "tests", "Samples tested against its triangles.",
     "tilecore.triangle_tests"},
    {"sample_hits", &tilecore::DrawableCounts::sample_hits, "samples", "Triangle tests that hit.",
     "tilecore.sample_hits"},
    {"samples_visible", &tilecore::DrawableCounts::samples_visible, "samples", "Samples that see it as opaque.",
     "tilecore.samples_visible"},
    {"pixel_shader_invocations", &tilecore::DrawableCounts::pixel_shader_invocations, "invocations",
     "Pixel-shader invocations for it.", "tilecore.pixel_shader_invocations"},
});
static_assert(sizeof(tilecore::DrawableCounts) == sizeof(std::uint64_t) * kDrawableCosts.size(),
              "each cost needs exactly one declaration");

// By the number of the drawable in scene::Assembly, instance by instance; the library adds up the instances of a node.
// Like counters, costs follow from the frame alone.
using DrawableCosts = std::vector<tilecore::DrawableCounts>;

// Adds the costs of another core or view, drawable by drawable; `into` grows where it is shorter.
inline void merge(DrawableCosts& into, const DrawableCosts& from) {
  if (into.size() < from.size()) into.resize(from.size());
  for (std::size_t d = 0; d < from.size(); ++d)
    for (const DrawableCost& cost : kDrawableCosts) into[d].*cost.member += from[d].*cost.member;
}

}  // namespace tessera::gpu
