#include "baselines/compressed_color.h"

#include <algorithm>
#include <array>
#include <bit>

#include "base/bit_stream.h"
#include "base/check.h"
#include "base/round_up.h"

namespace tessera::baselines {
namespace {

constexpr std::uint64_t kMetadataShare = 16;

// Blends `above` over `below` by the alpha of `above`.
std::uint32_t mixed(std::uint32_t below, std::uint32_t above) {
  const std::uint32_t alpha = above >> 24;
  std::uint32_t out = 0;
  for (unsigned c = 0; c < 32; c += 8) {
    const std::uint32_t a = above >> c & 255u, b = below >> c & 255u;
    out |= (a * alpha + b * (255 - alpha) + 127) / 255 << c;
  }
  return out;
}

}  // namespace

CompressedColorMemory::CompressedColorMemory(std::uint64_t cache_bytes, std::uint64_t burst_bytes,
                                             const SampleLayout& layout, const LineData& data, bool loads)
    : burst_bytes_(burst_bytes),
      lights_(data.gbuffer_words > 0),
      lines_(static_cast<std::uint32_t>(round_up(layout.line_count(), kBlockLines))),
      line_samples_(layout.samples_per_line()),
      cache_(cache_bytes - cache_bytes / kMetadataShare),
      metadata_(cache_bytes / kMetadataShare),
      depth_in_memory_(lines_, false) {
  Surface &colors = surfaces_[kColors], &layers = surfaces_[kLayers];
  colors.line_bursts = data.color_bursts, layers.line_bursts = data.layer_bursts;
  colors.known = data.words(), layers.known = 1;
  if (lights_)
    colors.raw = data.color_bursts - colors.known;
  else
    colors.copies = data.color_bursts;
  layers.copies = data.layer_bursts;
  for (Surface& surface : surfaces_) {
    if (&surface == &layers && data.layer_bursts == 0) continue;
    surface.drawn.assign(blocks(), false);
    surface.bursts.assign(blocks(), 0);
    surface.words.assign(surface.known * lines_ * line_samples_, 0);
  }
  metadata_in_memory_.assign(surfaces_.size() * blocks() / burst_bytes + 1, loads);
  if (loads)
    std::ranges::fill(colors.bursts,
                      static_cast<std::uint8_t>((whole_block_bytes(colors) + burst_bytes_ - 1) / burst_bytes_));
}

void CompressedColorMemory::know_depths(const std::vector<bool>& lines) {
  depths_known_ = true;
  std::copy(lines.begin(), lines.end(), depth_in_memory_.begin());
}

std::uint64_t CompressedColorMemory::coded_bytes(const Surface& surface, std::uint32_t block) const {
  const std::size_t samples = std::size_t{kBlockLines} * line_samples_;
  std::uint64_t bytes = 4 * samples * surface.raw;
  for (std::size_t word = 0; word < surface.known; ++word)
    bytes +=
        surface.copies *
        color_code_bytes(std::span(surface.words).subspan(word * lines_ * line_samples_ + block * samples, samples));
  return std::min(bytes, whole_block_bytes(surface));
}

void CompressedColorMemory::use_metadata(std::uint32_t key, bool change) {
  const auto line = static_cast<std::uint32_t>((key - lines_) / burst_bytes_);
  const bool in_memory = metadata_in_memory_[line];
  const bool hit = metadata_.use(line, burst_bytes_, change, [this](std::uint32_t k) {
    bytes_written_ += burst_bytes_;
    metadata_in_memory_[k] = true;
  });
  if (!hit && in_memory) bytes_read_ += burst_bytes_;
}

void CompressedColorMemory::write_back(std::uint32_t key) {
  if (key < lines_) {
    bytes_written_ += burst_bytes_;
    depth_in_memory_[key] = true;
    return;
  }
  Surface& surface = surfaces_[(key - lines_) / blocks()];
  const std::uint32_t block = (key - lines_) % blocks();
  surface.bursts[block] = static_cast<std::uint8_t>((coded_bytes(surface, block) + burst_bytes_ - 1) / burst_bytes_);
  bytes_written_ += surface.bursts[block] * burst_bytes_;
  use_metadata(key, true);
}

void CompressedColorMemory::use(std::uint32_t key, bool change) {
  const bool color = key >= lines_;
  std::uint64_t in_memory = 0, bytes = burst_bytes_;
  if (color) {
    const Surface& surface = surfaces_[(key - lines_) / blocks()];
    in_memory = surface.bursts[(key - lines_) % blocks()], bytes = whole_block_bytes(surface);
  } else {
    in_memory = depth_in_memory_[key] ? 1 : 0;
  }
  const bool hit = cache_.use(key, bytes, change, [this](std::uint32_t k) { write_back(k); });
  if (hit) return;
  if (color) use_metadata(key, false);
  bytes_read_ += in_memory * burst_bytes_;
}

void CompressedColorMemory::draw(const LineTouch& touch, std::span<const ColorWrite> writes,
                                 std::span<const std::uint32_t> colors) {
  use(touch.line, touch.passes && !touch.blends && !depths_known_);
  if (!touch.passes) return;
  const std::size_t target = touch.blends && lights_ ? kLayers : kColors, of_point = surfaces_[kColors].known;
  Surface& surface = surfaces_[target];
  // Colours change while their block is on chip; a block that bypasses a cache without room leaves with the change.
  for (const ColorWrite& write : writes)
    for (std::uint64_t left = write.samples; left != 0; left &= left - 1)
      for (std::size_t word = 0; word < surface.known; ++word) {
        const std::uint32_t value = colors[of_point * write.point + word];
        std::uint32_t& kept =
            surface
                .words[(word * lines_ + touch.line) * line_samples_ + static_cast<std::size_t>(std::countr_zero(left))];
        kept = touch.blends ? mixed(kept, value) : value;
      }
  const std::uint32_t block = touch.line / kBlockLines;
  surface.drawn[block] = true;
  use(key_of_block(target, block), true);
}

void CompressedColorMemory::finish(bool resolve) {
  const auto drawn = [&](std::size_t surface, std::uint32_t block) {
    return !surfaces_[surface].drawn.empty() && surfaces_[surface].drawn[block];
  };
  for (std::uint32_t block = 0; resolve && block < blocks(); ++block) {
    for (std::uint32_t line = 0; line < kBlockLines && lights_ && drawn(kColors, block); ++line)
      use(block * kBlockLines + line, false);
    for (const std::size_t surface : {kColors, kLayers})
      if (drawn(surface, block)) use(key_of_block(surface, block), false);
  }
  cache_.flush([this](std::uint32_t key) { write_back(key); });
  metadata_.flush([this](std::uint32_t) { bytes_written_ += burst_bytes_; });
}

namespace {

constexpr std::uint8_t kConstant = 0, kDeltas = 1, kRaw = 2;

std::uint32_t channel_of(std::uint32_t color, std::size_t c) { return color >> (8 * c) & 255u; }

struct Ranges {
  std::array<std::uint32_t, 4> least, width;
  std::size_t bytes;  // length of a block of deltas
};

Ranges ranges_of(std::span<const std::uint32_t> colors) {
  Ranges out{};
  std::size_t bits = 0;
  for (std::size_t c = 0; c < 4; ++c) {
    std::uint32_t least = 255, greatest = 0;
    for (const std::uint32_t color : colors) {
      least = std::min(least, channel_of(color, c));
      greatest = std::max(greatest, channel_of(color, c));
    }
    out.least[c] = least;
    out.width[c] = static_cast<std::uint32_t>(std::bit_width(greatest - least));
    bits += out.width[c];
  }
  out.bytes = 1 + 8 + (bits * colors.size() + 7) / 8;
  return out;
}

std::uint32_t word_at(std::span<const std::uint8_t> bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t c = 0; c < 4; ++c) word |= static_cast<std::uint32_t>(bytes[at + c]) << (8 * c);
  return word;
}

bool is_constant(std::span<const std::uint32_t> colors) {
  return std::all_of(colors.begin(), colors.end(), [&](std::uint32_t color) { return color == colors[0]; });
}

}  // namespace

std::vector<std::uint8_t> encode_colors(std::span<const std::uint32_t> colors) {
  TESSERA_CHECK(!colors.empty(), "a block has colours");
  std::vector<std::uint8_t> out;
  if (is_constant(colors)) {
    out.push_back(kConstant);
    put_word(colors[0], out);
    return out;
  }
  const Ranges ranges = ranges_of(colors);
  if (ranges.bytes >= 1 + 4 * colors.size()) {
    out.push_back(kRaw);
    for (const std::uint32_t color : colors) put_word(color, out);
    return out;
  }
  out.push_back(kDeltas);
  for (const std::uint32_t least : ranges.least) out.push_back(static_cast<std::uint8_t>(least));
  for (const std::uint32_t width : ranges.width) out.push_back(static_cast<std::uint8_t>(width));
  BitWriter bits;
  for (const std::uint32_t color : colors)
    for (std::size_t c = 0; c < 4; ++c) bits.put(channel_of(color, c) - ranges.least[c], ranges.width[c]);
  out.insert(out.end(), bits.bytes().begin(), bits.bytes().end());
  return out;
}

std::size_t color_code_bytes(std::span<const std::uint32_t> colors) {
  if (is_constant(colors)) return 5;
  return std::min(ranges_of(colors).bytes, 1 + 4 * colors.size());
}

std::vector<std::uint32_t> decode_colors(std::span<const std::uint8_t> bytes, std::size_t count) {
  if (bytes[0] == kConstant) return std::vector<std::uint32_t>(count, word_at(bytes, 1));
  std::vector<std::uint32_t> colors(count, 0);
  if (bytes[0] == kRaw) {
    for (std::size_t k = 0; k < count; ++k) colors[k] = word_at(bytes, 1 + 4 * k);
    return colors;
  }
  BitReader bits(bytes.subspan(9));
  for (std::uint32_t& color : colors)
    for (std::size_t c = 0; c < 4; ++c) color |= (bytes[1 + c] + bits.get(bytes[5 + c])) << (8 * c);
  return colors;
}

}  // namespace tessera::baselines
