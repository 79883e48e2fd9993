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
                                             const SampleLayout& layout, std::uint64_t color_bursts, bool loads)
    : burst_bytes_(burst_bytes),
      color_bursts_(color_bursts),
      lines_(static_cast<std::uint32_t>(round_up(layout.line_count(), kBlockLines))),
      line_samples_(layout.samples_per_line()),
      cache_(cache_bytes - cache_bytes / kMetadataShare),
      metadata_(cache_bytes / kMetadataShare),
      depth_in_memory_(lines_, false),
      drawn_(lines_ / kBlockLines, false),
      metadata_in_memory_(lines_ / kBlockLines / burst_bytes + 1, false),
      bursts_(lines_ / kBlockLines, 0),
      colors_(std::size_t{lines_} * line_samples_, 0) {
  if (!loads) return;
  std::fill(bursts_.begin(), bursts_.end(),
            static_cast<std::uint8_t>((whole_block_bytes() + burst_bytes_ - 1) / burst_bytes_));
  metadata_in_memory_.assign(metadata_in_memory_.size(), true);
}

std::span<const std::uint32_t> CompressedColorMemory::block_colors(std::uint32_t block) const {
  const std::size_t samples = std::size_t{kBlockLines} * line_samples_;
  return std::span(colors_).subspan(block * samples, samples);
}

void CompressedColorMemory::use_metadata(std::uint32_t block, bool change) {
  const auto line = static_cast<std::uint32_t>(block / burst_bytes_);
  const bool in_memory = metadata_in_memory_[line];
  const bool hit = metadata_.use(line, burst_bytes_, change, [this](std::uint32_t key) {
    bytes_written_ += burst_bytes_;
    metadata_in_memory_[key] = true;
  });
  if (!hit && in_memory) bytes_read_ += burst_bytes_;
}

void CompressedColorMemory::write_back(std::uint32_t key) {
  if (key < lines_) {
    bytes_written_ += burst_bytes_;
    depth_in_memory_[key] = true;
    return;
  }
  const std::uint32_t block = key - lines_;
  const std::uint64_t bytes =
      std::min<std::uint64_t>(color_code_bytes(block_colors(block)) * color_bursts_, whole_block_bytes());
  bursts_[block] = static_cast<std::uint8_t>((bytes + burst_bytes_ - 1) / burst_bytes_);
  bytes_written_ += bursts_[block] * burst_bytes_;
  use_metadata(block, true);
}

void CompressedColorMemory::use(std::uint32_t key, bool change) {
  const bool color = key >= lines_;
  const std::uint64_t in_memory = color ? bursts_[key - lines_] : (depth_in_memory_[key] ? 1u : 0u);
  const std::uint64_t bytes = color ? whole_block_bytes() : burst_bytes_;
  const bool hit = cache_.use(key, bytes, change, [this](std::uint32_t k) { write_back(k); });
  if (hit) return;
  if (color) use_metadata(key - lines_, false);
  bytes_read_ += in_memory * burst_bytes_;
}

void CompressedColorMemory::draw(const LineTouch& touch, std::span<const ColorWrite> writes,
                                 std::span<const std::uint32_t> colors) {
  use(touch.line, touch.passes && !touch.blends);
  if (!touch.passes) return;
  // Colours change while their block is on chip; a block that bypasses a cache without room leaves with the change.
  for (const ColorWrite& write : writes)
    for (std::uint64_t left = write.samples; left != 0; left &= left - 1) {
      std::uint32_t& color =
          colors_[std::size_t{touch.line} * line_samples_ + static_cast<std::size_t>(std::countr_zero(left))];
      color = touch.blends ? mixed(color, colors[write.point]) : colors[write.point];
    }
  drawn_[touch.line / kBlockLines] = true;
  use(key_of_block(touch.line / kBlockLines), true);
}

void CompressedColorMemory::finish(bool resolve) {
  for (std::uint32_t block = 0; resolve && block < drawn_.size(); ++block)
    if (drawn_[block]) use(key_of_block(block), false);
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
