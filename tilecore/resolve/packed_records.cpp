#include "tilecore/resolve/packed_records.h"

#include <algorithm>
#include <bit>

#include "base/check.h"
#include "tilecore/resolve/bit_stream.h"

namespace tessera::tilecore {
namespace {

constexpr std::size_t kSizeBits = 8, kKindBits = 2, kMaskBits = 2, kValueWidth = 6, kGradientWidth = 5;
enum RecordKind : std::uint32_t { kNothingSeen, kSameSurface, kOtherSurface, kPixelRecords };
enum MaskKind : std::uint32_t { kNoMask, kMaskAsBefore, kMaskOfOthers, kMaskFollows };

// Floats as integers in the order of their values, one to one.
std::uint32_t ordered_bits(float v) {
  const auto bits = std::bit_cast<std::uint32_t>(v);
  return bits >> 31 != 0 ? ~bits : bits | 0x80000000u;
}
float from_ordered_bits(std::uint32_t code) {
  return std::bit_cast<float>(code >> 31 != 0 ? code & 0x7fffffffu : ~code);
}
std::uint32_t zigzag32(std::uint32_t residual) { return residual << 1 ^ (residual >> 31 != 0 ? ~0u : 0u); }
std::uint32_t unzigzag32(std::uint32_t code) { return code >> 1 ^ ((code & 1) != 0 ? ~0u : 0u); }

// A gradient's 24 bits, and their differences.
constexpr std::uint32_t kGradientMask = 0xffffffu;
std::uint32_t gradient_code(float v) { return ordered_bits(v) >> 8; }
float from_gradient_code(std::uint32_t code) {
  // The lowest bits are 0, of a negative number they are 1 in its code.
  const std::uint32_t high = code << 8;
  return from_ordered_bits(code >> 23 != 0 ? high : high | 0xffu);
}
std::uint32_t zigzag24(std::uint32_t residual) {
  const std::uint32_t r = residual & kGradientMask;
  return (r << 1 ^ (r >> 23 != 0 ? kGradientMask : 0u)) & kGradientMask;
}
std::uint32_t unzigzag24(std::uint32_t code) {
  return (code >> 1 ^ ((code & 1) != 0 ? kGradientMask : 0u)) & kGradientMask;
}

// The prediction from the cell's blocks before block `b`.
struct PlanePrediction {
  float value = 0, by_x = 0, by_y = 0;
};
PlanePrediction predict_plane(std::span<const BlockRecord> blocks, std::size_t columns, std::size_t b) {
  const auto is_plane = [](const BlockRecord& block) { return block.plane && !block.nothing(); };
  if (b % columns != 0 && is_plane(blocks[b - 1])) {
    const BlockRecord& left = blocks[b - 1];
    return {left.value + 4.0f * left.by_x, left.by_x, left.by_y};
  }
  if (b >= columns && is_plane(blocks[b - columns])) {
    const BlockRecord& above = blocks[b - columns];
    return {above.value + 4.0f * above.by_y, above.by_x, above.by_y};
  }
  return {};
}

std::uint32_t last_surface(std::span<const BlockRecord> blocks, std::size_t b) {
  while (b-- > 0)
    if (!blocks[b].nothing()) return blocks[b].surface[0];
  return 0;
}
BlockMask last_mask(std::span<const BlockRecord> blocks, std::size_t b) {
  while (b-- > 0)
    if (!blocks[b].nothing() && blocks[b].reconstructed != 0) return blocks[b].reconstructed;
  return 0;
}

bool pixel_exists(const BlockRecord& block, std::size_t p) { return (block.exists >> p & 1) != 0; }

// The depth of pixel `p` from those before it that show its surface; false: none does.
bool predict_depth(const BlockRecord& block, std::size_t p, std::uint32_t& code) {
  const std::uint32_t surface = block.surface[p];
  const auto shows = [&](std::size_t q) { return pixel_exists(block, q) && block.surface[q] == surface; };
  if (p % 4 != 0 && p >= 4 && shows(p - 1) && shows(p - 4) && shows(p - 5)) {
    code = ordered_bits(block.depth[p - 1]) + ordered_bits(block.depth[p - 4]) - ordered_bits(block.depth[p - 5]);
    return true;
  }
  for (std::size_t q = p; q-- > 0;)
    if (shows(q)) {
      code = ordered_bits(block.depth[q]);
      return true;
    }
  return false;
}

void write_pixels(const BlockRecord& block, BitWriter& out) {
  std::uint32_t before = 0, all = 0;
  for (std::size_t p = 0; p < 16; ++p) {
    if (!pixel_exists(block, p)) continue;
    const std::uint32_t surface = block.surface[p];
    out.write(surface == before, 1);
    if (surface != before) {
      const bool above = p >= 4 && pixel_exists(block, p - 4) && block.surface[p - 4] == surface;
      out.write(above, 1);
      if (!above) out.write(surface, 32);
    }
    before = surface;
    std::uint32_t code = 0;
    if (predict_depth(block, p, code)) all |= zigzag32(ordered_bits(block.depth[p]) - code);
  }
  const auto width = static_cast<std::size_t>(std::bit_width(all));
  out.write(static_cast<std::uint32_t>(width), kValueWidth);
  for (std::size_t p = 0; p < 16; ++p) {
    if (!pixel_exists(block, p)) continue;
    std::uint32_t code = 0;
    if (predict_depth(block, p, code))
      out.write(zigzag32(ordered_bits(block.depth[p]) - code), width);
    else
      out.write(ordered_bits(block.depth[p]), 32);
  }
}

void read_pixels(BitReader& in, BlockRecord& block) {
  std::uint32_t before = 0;
  for (std::size_t p = 0; p < 16; ++p) {
    if (!pixel_exists(block, p)) continue;
    if (in.read(1) == 0) before = in.read(1) != 0 ? block.surface[p - 4] : in.read(32);
    block.surface[p] = before;
  }
  const std::size_t width = in.read(kValueWidth);
  for (std::size_t p = 0; p < 16; ++p) {
    if (!pixel_exists(block, p)) continue;
    std::uint32_t code = 0;
    block.depth[p] = from_ordered_bits(predict_depth(block, p, code) ? code + unzigzag32(in.read(width)) : in.read(32));
  }
}

void write_plane(const BlockRecord& block, const PlanePrediction& predicted, BitWriter& out) {
  const std::uint32_t value = zigzag32(ordered_bits(block.value) - ordered_bits(predicted.value)),
                      by_x = zigzag24(gradient_code(block.by_x) - gradient_code(predicted.by_x)),
                      by_y = zigzag24(gradient_code(block.by_y) - gradient_code(predicted.by_y));
  const auto write = [&](std::uint32_t v, std::size_t width_bits) {
    const auto width = static_cast<std::size_t>(std::bit_width(v));
    out.write(static_cast<std::uint32_t>(width), width_bits);
    out.write(v, width);
  };
  write(value, kValueWidth);
  write(by_x, kGradientWidth);
  write(by_y, kGradientWidth);
}

void read_plane(BitReader& in, const PlanePrediction& predicted, BlockRecord& block) {
  const auto read = [&](std::size_t width_bits) { return in.read(in.read(width_bits)); };
  block.value = from_ordered_bits(ordered_bits(predicted.value) + unzigzag32(read(kValueWidth)));
  block.by_x = from_gradient_code((gradient_code(predicted.by_x) + unzigzag24(read(kGradientWidth))) & kGradientMask);
  block.by_y = from_gradient_code((gradient_code(predicted.by_y) + unzigzag24(read(kGradientWidth))) & kGradientMask);
}

void write_mask(BlockMask mask, BlockMask before, BitWriter& out) {
  const MaskKind kind = mask == 0                                 ? kNoMask
                        : mask == before                          ? kMaskAsBefore
                        : mask == static_cast<BlockMask>(~before) ? kMaskOfOthers
                                                                  : kMaskFollows;
  out.write(kind, kMaskBits);
  if (kind == kMaskFollows) out.write(mask, 16);
}

BlockMask read_mask(BitReader& in, BlockMask before) {
  switch (in.read(kMaskBits)) {
    case kNoMask:
      return 0;
    case kMaskAsBefore:
      return before;
    case kMaskOfOthers:
      return static_cast<BlockMask>(~before);
    default:
      return static_cast<BlockMask>(in.read(16));
  }
}

}  // namespace

std::size_t pack_records(std::span<const BlockRecord> blocks, std::size_t columns, std::span<std::uint8_t> out) {
  if (std::all_of(blocks.begin(), blocks.end(), [](const BlockRecord& b) { return b.nothing(); })) return 0;
  std::fill(out.begin(), out.end(), std::uint8_t{0});
  BitWriter writer(out);
  writer.write(0, kSizeBits);  // only its room matters here
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const BlockRecord& block = blocks[b];
    const bool same = block.plane && block.surface[0] == last_surface(blocks, b);
    const RecordKind kind = block.nothing() ? kNothingSeen
                            : !block.plane  ? kPixelRecords
                            : same          ? kSameSurface
                                            : kOtherSurface;
    writer.write(kind, kKindBits);
    if (kind == kNothingSeen) continue;
    write_mask(block.reconstructed, last_mask(blocks, b), writer);
    if (kind == kPixelRecords) {
      write_pixels(block, writer);
      continue;
    }
    if (kind == kOtherSurface) writer.write(block.surface[0], 32);
    write_plane(block, predict_plane(blocks, columns, b), writer);
  }
  const std::size_t bytes = (writer.bits() + 7) / 8;
  TESSERA_CHECK(bytes <= out.size(), "a cell of records takes no more than its place");
  return bytes;
}

void unpack_records(std::span<const std::uint8_t> bytes, std::size_t columns, std::span<BlockRecord> blocks) {
  BitReader in(bytes);
  if (!bytes.empty()) in.read(kSizeBits);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    BlockRecord& block = blocks[b];
    const std::uint32_t kind = bytes.empty() ? kNothingSeen : in.read(kKindBits);
    block.plane = kind != kPixelRecords;
    block.surface[0] = 0;
    block.reconstructed = 0;
    if (kind == kNothingSeen) continue;
    block.reconstructed = read_mask(in, last_mask(blocks, b));
    if (kind == kPixelRecords) {
      read_pixels(in, block);
      continue;
    }
    block.surface[0] = kind == kSameSurface ? last_surface(blocks, b) : in.read(32);
    read_plane(in, predict_plane(blocks, columns, b), block);
  }
}

}  // namespace tessera::tilecore
