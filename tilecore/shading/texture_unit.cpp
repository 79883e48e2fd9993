#include "tilecore/shading/texture_unit.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "base/check.h"
#include "base/error.h"
#include "base/round_up.h"
#include "tilecore/shading/pixel_shader_kernel.h"

namespace tessera::tilecore {
namespace {

using shaders::Texture;

int log2_of(std::int64_t power) { return std::bit_width(static_cast<std::uint64_t>(power)) - 1; }

}  // namespace

LineSide line_side(int texels) {
  // Odd factors by their reciprocals in 17 bits, rounded up: 3 * 43691 = 2^17 + 1, 5 * 26215 = 2^17 + 3. Their excess
  // does not reach the next line as long as i * 3 is below 2^17.
  const int power = std::countr_zero(static_cast<unsigned>(texels)), odd = texels >> power;
  if (odd == 1) return {texels, 1, power};
  TESSERA_CHECK(odd == 3 || odd == 5, "a block's side is a power of two, three or five times");
  return {texels, odd == 3 ? 43691 : 26215, 17 + power};
}

TextureMemory::TextureMemory(std::span<const scene::Material> materials, std::int64_t line_bytes,
                             std::span<const shaders::RadianceImage* const> images, std::span<const DepthMaps> maps)
    : line_bytes_(line_bytes) {
  for (const scene::Material& m : materials)
    for (const scene::TextureSlot* slot : m.slots())
      if (slot->texture != nullptr) add(*slot->texture, slot->texture.get(), slot->texture->blocks());
  for (const shaders::RadianceImage* image : images) add(*image, image->view().texels, shaders::RadianceImage::kBlocks);
  first_map_line_ = lines_;
  for (const DepthMaps& of : maps) {
    add(of, &of, of.blocks());
    TextureLayoutView& view = layouts_.at(&of).view;
    view.depths = &of;
    view.first_flag = static_cast<std::int32_t>(lines_);
    view.flags_a_line = static_cast<std::int32_t>(8 * line_bytes_);
    lines_ +=
        round_up(of.flag_bytes(), static_cast<std::uint64_t>(line_bytes_)) / static_cast<std::uint64_t>(line_bytes_);
    layouts_.at(&of).range.end = static_cast<std::uint32_t>(lines_);
  }
  if (lines_ >= std::numeric_limits<std::int32_t>::max())
    throw LimitError("the textures have more cache lines than 31 bits can number");
}

template <class Image>
void TextureMemory::add(const Image& image, const void* key, shaders::TexelBlocks blocks) {
  if (image.level_count() == 0) return;
  const auto [found, fresh] = layouts_.try_emplace(key);
  if (!fresh) return;
  TESSERA_CHECK(std::max(image.width(), image.height()) < 1 << 15, "texels are numbered with 15 bits");
  found->second.range.first = static_cast<std::uint32_t>(lines_);
  const int blocks_log2 = log2_of(line_bytes_ / blocks.bytes);
  const LineSide width = line_side(blocks.side << (blocks_log2 + 1) / 2),
                 height = line_side(blocks.side << blocks_log2 / 2);
  for (int level = 0; level < image.level_count(); ++level) {
    const auto lines = [](int texels, const LineSide& side) {
      return static_cast<std::uint64_t>((texels + side.texels - 1) / side.texels);
    };
    const std::uint64_t across = lines(image.width(level), width), down = lines(image.height(level), height);
    found->second.first_line.push_back(static_cast<std::int32_t>(lines_));
    found->second.lines_across.push_back(static_cast<std::int32_t>(across));
    lines_ += across * down;
  }
  found->second.range.end = static_cast<std::uint32_t>(lines_);
  found->second.view = {found->second.first_line.data(),
                        found->second.lines_across.data(),
                        width,
                        height,
                        blocks.side > 1,
                        nullptr,
                        0,
                        1};
}

namespace {

// The tile of a map that a line of it belongs to.
std::size_t tile_of(const TextureLayoutView& layout, std::int32_t line) {
  const DepthMaps& maps = *layout.depths;
  const std::int32_t across = layout.lines_across[0], first = layout.first_line[0],
                     in_layer = maps.layers() > 1 ? layout.first_line[1] - first : layout.first_flag - first,
                     layer = (line - first) / in_layer, in = (line - first) % in_layer;
  const int x = in % across * layout.width.texels, y = in / across * layout.height.texels;
  return static_cast<std::size_t>((layer * maps.tiles_down() + y / maps.tile_height()) * maps.tiles_across() +
                                  x / maps.tile_width());
}

}  // namespace

void TextureUnit::fetch_depths(const TextureLayoutView& layout, const std::array<std::int32_t*, 4>& lines,
                               std::size_t first, std::size_t lanes, std::uint64_t texels) {
  if (candidates_.size() < lanes + 16) candidates_.resize(lanes + 16);
  std::uint64_t reads = 0;
  for (std::size_t lane = 0; lane < lanes; ++lane) reads += lines[0][first + lane] >= 0 ? 1 : 0;
  if (reads == 0) return;
  counters_.texels += reads * texels;
  asked_.clear();
  ++lookup_;
  for (std::size_t corner = 0; corner < lines.size(); ++corner) {
    const std::size_t count = distinct_neighbours(lines[corner] + first, lanes, candidates_.data());
    for (std::size_t k = 0; k < count; ++k) {
      if (!ask_once(candidates_[k])) continue;
      const std::size_t tile = tile_of(layout, candidates_[k]);
      const std::int32_t flags = layout.first_flag + static_cast<std::int32_t>(tile) / layout.flags_a_line;
      if (ask_once(flags)) need_line(static_cast<std::uint32_t>(flags));
      if (layout.depths->cleared()[tile] == 0) need_line(static_cast<std::uint32_t>(candidates_[k]));
    }
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

const TextureLayoutView& TextureUnit::layout_of(const Texture& texture) {
  Known& known = known_[(reinterpret_cast<std::uintptr_t>(&texture) >> 6) % known_.size()];
  if (known.texture != &texture) known = {&texture, &settings_.memory->layout(&texture)};
  return *known.layout;
}

void TextureUnit::fetch(const Texture& texture, const shaders::TexelFootprint& footprint) {
  const TextureLayoutView& layout = layout_of(texture);
  counters_.texels += footprint.count;
  if (layout.compressed) counters_.texels_decoded += footprint.count;
  for (std::size_t k = 0; k < footprint.count; ++k) {
    const shaders::LevelTexels<std::int32_t>& read = footprint.levels[k];
    const auto level = static_cast<std::size_t>(read.level);
    const int across = layout.lines_across[level];
    const auto line = [&](int row, int column) {
      return static_cast<std::uint32_t>(layout.first_line[level] + row * across + column);
    };
    const int column0 = layout.width.line_of(read.column0), column1 = layout.width.line_of(read.column1),
              row0 = layout.height.line_of(read.row0), row1 = layout.height.line_of(read.row1);
    need_line(line(row0, column0));
    if (column1 != column0) need_line(line(row0, column1));
    if (row1 == row0) continue;
    need_line(line(row1, column0));
    if (column1 != column0) need_line(line(row1, column1));
  }
}

void TextureUnit::fetch_lane(const TextureLayoutView& layout, const std::array<std::int32_t*, 8>& lines,
                             std::size_t lane) {
  for (std::size_t level = 0; level < 2; ++level) {
    if (lines[4 * level][lane] < 0) continue;
    ++counters_.texels;
    if (layout.compressed) ++counters_.texels_decoded;
    for (std::size_t corner = 0; corner < 4; ++corner)
      if (const std::int32_t line = lines[4 * level + corner][lane]; line >= 0)
        need_line(static_cast<std::uint32_t>(line));
  }
}

bool TextureUnit::ask_once(std::int32_t line) {
  Asked& place = asked_at_[static_cast<std::uint32_t>(line) % kAskedPlaces];
  if (place.lookup == lookup_) {
    if (place.line == line) return false;
    // Another line has its place.
    if (std::find(asked_.begin(), asked_.end(), line) != asked_.end()) return false;
  } else {
    place = {lookup_, line};
  }
  asked_.push_back(line);
  return true;
}

void TextureUnit::fetch_warp(const TextureLayoutView& layout, const std::array<std::int32_t*, 8>& lines,
                             std::size_t first, std::size_t lanes) {
  if (candidates_.size() < lanes + 16) candidates_.resize(lanes + 16);
  for (std::size_t level = 0; level < 2; ++level) {
    const std::int32_t* any = lines[4 * level] + first;
    std::uint64_t reads = 0;
    for (std::size_t lane = 0; lane < lanes; ++lane) reads += any[lane] >= 0 ? 1 : 0;
    if (reads == 0) continue;
    counters_.texels += reads;
    if (layout.compressed) counters_.texels_decoded += reads;
    asked_.clear();
    ++lookup_;
    for (std::size_t corner = 0; corner < 4; ++corner) {
      const std::size_t count = distinct_neighbours(lines[4 * level + corner] + first, lanes, candidates_.data());
      for (std::size_t k = 0; k < count; ++k)
        if (ask_once(candidates_[k])) need_line(static_cast<std::uint32_t>(candidates_[k]));
    }
  }
}

}  // namespace tessera::tilecore
