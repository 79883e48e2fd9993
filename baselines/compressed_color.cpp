#include "baselines/compressed_color.h"

#include <algorithm>
#include <bit>

#include "base/round_up.h"
#include "baselines/color_code.h"

namespace tessera::baselines {
namespace {

constexpr std::uint64_t kMetadataShare = 16;

// `above` over `below`, by the alpha of what is above.
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
                                             const SampleLayout& layout)
    : burst_bytes_(burst_bytes),
      lines_(static_cast<std::uint32_t>(round_up(layout.line_count(), kBlockLines))),
      line_samples_(layout.samples_per_line()),
      cache_(cache_bytes - cache_bytes / kMetadataShare),
      metadata_(cache_bytes / kMetadataShare),
      depth_in_memory_(lines_, false),
      drawn_(lines_ / kBlockLines, false),
      metadata_in_memory_(lines_ / kBlockLines / burst_bytes + 1, false),
      bursts_(lines_ / kBlockLines, 0),
      colors_(std::size_t{lines_} * line_samples_, 0) {}

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
  const std::uint64_t whole = kBlockLines * std::uint64_t{line_samples_} * 4,
                      bytes = std::min<std::uint64_t>(color_code_bytes(block_colors(block)), whole);
  bursts_[block] = static_cast<std::uint8_t>((bytes + burst_bytes_ - 1) / burst_bytes_);
  bytes_written_ += bursts_[block] * burst_bytes_;
  use_metadata(block, true);
}

void CompressedColorMemory::use(std::uint32_t key, bool change) {
  const bool color = key >= lines_;
  const std::uint64_t in_memory = color ? bursts_[key - lines_] : (depth_in_memory_[key] ? 1u : 0u);
  const std::uint64_t bytes = color ? kBlockLines * std::uint64_t{line_samples_} * 4 : burst_bytes_;
  const bool hit = cache_.use(key, bytes, change, [this](std::uint32_t k) { write_back(k); });
  if (hit) return;
  if (color) use_metadata(key - lines_, false);
  bytes_read_ += in_memory * burst_bytes_;
}

void CompressedColorMemory::draw(const LineTouch& touch, std::span<const ColorWrite> writes,
                                 std::span<const std::uint32_t> colors) {
  use(touch.line, touch.passes && !touch.blends);
  if (!touch.passes) return;
  // Colours change while their block is on chip; one that passes by a cache without room leaves changed.
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

}  // namespace tessera::baselines
