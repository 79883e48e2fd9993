#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace tessera::hardware {

// Units of the machine that have a throughput, in the order in which work passes them. The front end and the binner
// exist once, the others once in each tile core; all share the memory (kDram).
enum class Stage : std::uint8_t {
  kFrontend,
  kBinner,  // geometry
  kFetch,
  kTessellator,
  kBoxes,
  kBoxTests,
  kStencil,
  kSampling,
  kTriangleTests,
  kAlphaTests,
  kCoarseDepth,  // visibility of a tile
  kCompaction,
  kShader,
  kTexture,
  kBlend,    // shading of a tile
  kResolve,  // its pixels
  kDram
};
inline constexpr std::size_t kStageCount = 17;

constexpr std::string_view name(Stage stage) {
  constexpr std::array<std::string_view, kStageCount> kNames = {
      "frontend", "binner",   "entry_fetch",    "tessellator", "box_builder",  "box_tests",
      "stencil",  "sampling", "triangle_tests", "alpha_tests", "coarse_depth", "compaction",
      "shader",   "texture",  "blend",          "resolve",     "dram"};
  return kNames[static_cast<std::size_t>(stage)];
}

}  // namespace tessera::hardware
