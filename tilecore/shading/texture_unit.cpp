#include "tilecore/shading/texture_unit.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "base/check.h"
#include "base/error.h"

namespace tessera::tilecore {
namespace {

using shaders::Texture;

int log2_of(std::int64_t power) { return std::bit_width(static_cast<std::uint64_t>(power)) - 1; }

}  // namespace

TextureMemory::TextureMemory(std::span<const scene::Material> materials, std::int64_t line_bytes)
    : line_bytes_(line_bytes) {
  for (const scene::Material& m : materials)
    for (const scene::TextureSlot* slot : {&m.base_color_texture, &m.metallic_roughness_texture, &m.normal_texture,
                                           &m.occlusion_texture, &m.emissive_texture})
      add(*slot);
  if (lines_ >= std::numeric_limits<std::uint32_t>::max())
    throw LimitError("the textures have more cache lines than 32 bits can number");
}

void TextureMemory::add(const scene::TextureSlot& slot) {
  if (slot.texture == nullptr) return;
  const auto [found, fresh] = layouts_.try_emplace(slot.texture.get());
  if (!fresh) return;
  const shaders::TexelBlocks blocks = slot.texture->blocks();
  const int blocks_log2 = log2_of(line_bytes_ / blocks.bytes), side_log2 = log2_of(blocks.side);
  const int width_log2 = (blocks_log2 + 1) / 2 + side_log2, height_log2 = blocks_log2 / 2 + side_log2;
  for (int level = 0; level < slot.texture->level_count(); ++level) {
    const auto lines = [](int texels, int log2) {
      return (static_cast<std::uint64_t>(texels) + (std::uint64_t{1} << log2) - 1) >> log2;
    };
    const std::uint64_t across = lines(slot.texture->width(level), width_log2),
                        down = lines(slot.texture->height(level), height_log2);
    found->second.push_back({static_cast<std::uint32_t>(lines_), static_cast<std::uint32_t>(across),
                             static_cast<std::uint8_t>(width_log2), static_cast<std::uint8_t>(height_log2)});
    lines_ += across * down;
  }
}

void TextureUnit::begin_tile(const Settings& settings) {
  if (settings == settings_) {
    cache_.empty();
  } else {
    settings_ = settings;
    cache_ = memory::LineCache(settings.cache_bytes, settings.cache_ways, settings.line_bytes);
    known_ = {};
  }
  misses_.clear();
}

const TextureMemory::Layout& TextureUnit::layout_of(const Texture& texture) {
  Known& known = known_[(reinterpret_cast<std::uintptr_t>(&texture) >> 6) % known_.size()];
  if (known.texture != &texture) known = {&texture, &settings_.memory->layout(&texture)};
  return *known.layout;
}

void TextureUnit::fetch(const Texture& texture, const shaders::TexelFootprint& footprint) {
  const TextureMemory::Layout& layout = layout_of(texture);
  counters_.texels += footprint.count;
  for (std::size_t k = 0; k < footprint.count; ++k) {
    const auto& [level, s, t] = footprint.levels[k];
    const TextureMemory::Level& l = layout[static_cast<std::size_t>(level)];
    const int w = l.width_log2, h = l.height_log2;
    const auto column0 = static_cast<std::uint32_t>(s.first >> w), column1 = static_cast<std::uint32_t>(s.second >> w);
    const std::uint32_t row0 = l.first_line + static_cast<std::uint32_t>(t.first >> h) * l.lines_across,
                        row1 = l.first_line + static_cast<std::uint32_t>(t.second >> h) * l.lines_across;
    need_line(row0 + column0);
    if (column1 != column0) need_line(row0 + column1);
    if (row1 == row0) continue;
    need_line(row1 + column0);
    if (column1 != column0) need_line(row1 + column1);
  }
}

}  // namespace tessera::tilecore
