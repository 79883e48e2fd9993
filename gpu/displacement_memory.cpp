#include "gpu/displacement_memory.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "scene/patch_displacement.h"

namespace tessera::gpu {
namespace {

constexpr std::int64_t kHeightBytes = 2;

// Blocks of one direction that hold the texels from `low` to `high`, each once. Coordinates are in texels.
std::vector<std::uint32_t> blocks(shaders::Wrap wrap, float low, float high, int size, int log2) {
  std::vector<std::uint32_t> out;
  if (!std::isfinite(low) || !std::isfinite(high)) return {0};
  const auto first = static_cast<std::int64_t>(std::floor(std::max(low - 0.5f, -1e9f)));
  // A span of more than one period needs all blocks.
  const std::int64_t last =
      std::min(static_cast<std::int64_t>(std::floor(std::min(high - 0.5f, 1e9f))) + 1, first + 2 * std::int64_t{size});
  for (std::int64_t texel = first; texel <= last; ++texel) {
    const auto block = static_cast<std::uint32_t>(shaders::wrap_texel(wrap, texel, size) >> log2);
    if (out.empty() || out.back() != block) out.push_back(block);
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

}  // namespace

DisplacementMemory::DisplacementMemory(std::span<const scene::Material> materials, std::int64_t line_bytes,
                                       std::uint64_t first_line)
    : end_(first_line) {
  const int heights_log2 = std::bit_width(static_cast<std::uint64_t>(line_bytes / kHeightBytes)) - 1;
  width_log2_ = (heights_log2 + 1) / 2;
  height_log2_ = heights_log2 / 2;
  for (const scene::Material& material : materials) {
    if (!material.displacement || material.displacement->texture == nullptr) continue;
    const auto [found, fresh] = maps_.try_emplace(material.displacement->texture.get());
    if (!fresh) continue;
    for (const shaders::ScalarTexture::Level& level : found->first->levels()) {
      const auto count = [](int texels, int log2) {
        return (static_cast<std::uint64_t>(texels) + (std::uint64_t{1} << log2) - 1) >> log2;
      };
      const std::uint64_t across = count(level.width, width_log2_);
      found->second.push_back(
          {static_cast<std::uint32_t>(end_), static_cast<std::uint32_t>(across), level.width, level.height});
      end_ += across * count(level.height, height_log2_);
    }
  }
  if (end_ >= std::numeric_limits<std::uint32_t>::max())
    throw LimitError("the textures have more cache lines than 32 bits can number");
}

void DisplacementMemory::lines_of(const scene::FrameGeometry& frame, std::uint32_t patch, const scene::CellRange& range,
                                  std::vector<std::uint32_t>& lines) const {
  lines.clear();
  const scene::PosedDrawable& drawable = frame.drawable_of(patch);
  if (!drawable.material->displacement || drawable.drawable->kind != scene::Primitive::Kind::kBezierPatches) return;
  const scene::PatchDisplacement displacement = scene::patch_displacement(frame, drawable, patch);
  const auto map = maps_.find(displacement.material->texture.get());
  if (map == maps_.end()) return;
  const auto footprint = displacement.footprint(scene::parameter_range(frame.pattern_of(patch), range));
  const std::vector<Level>& levels = map->second;
  const float level = std::clamp(displacement.lod, 0.0f, static_cast<float>(levels.size() - 1));
  const auto below = static_cast<std::size_t>(level);
  add_level(levels[below], displacement.material->sampler, footprint.low, footprint.high, lines);
  if (level > static_cast<float>(below))
    add_level(levels[below + 1], displacement.material->sampler, footprint.low, footprint.high, lines);
}

void DisplacementMemory::add_level(const Level& level, const shaders::Sampler& sampler, Vec2 low, Vec2 high,
                                   std::vector<std::uint32_t>& lines) const {
  const auto w = static_cast<float>(level.width), h = static_cast<float>(level.height);
  const std::vector<std::uint32_t> columns = blocks(sampler.wrap_s, low.x * w, high.x * w, level.width, width_log2_);
  for (const std::uint32_t row : blocks(sampler.wrap_t, low.y * h, high.y * h, level.height, height_log2_))
    for (const std::uint32_t column : columns) lines.push_back(level.first_line + row * level.blocks_across + column);
}

}  // namespace tessera::gpu
