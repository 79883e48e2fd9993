#include "tilecore/resolve/resolve_unit.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>

#include "tilecore/resolve/block_pixels.h"
#include "tilecore/resolve/bright_window.h"
#include "tilecore/resolve/cubic_stencil.h"
#include "tilecore/resolve/cubic_weights.h"
#include "tilecore/resolve/frame_compression.h"
#include "tilecore/resolve/multisample_resolve.h"

namespace tessera::tilecore {
namespace {

// Charges the rows of a rectangle of an array.
struct RectTransfer {
  IntRect rect;
  TouchedBursts::Array array;
  std::uint64_t burst;

  template <class Move>
  void each_row(const Move& move) const {
    for (int y = rect.y0; y < rect.y1; ++y)
      move(array.at(rect.x0, y), static_cast<std::uint64_t>(rect.width()) * array.bytes);
  }
  void read(memory::Ledger& ledger, memory::Purpose purpose) const {
    each_row([&](std::uint64_t offset, std::uint64_t size) {
      ledger.read_at(memory::Unit::kResolve, purpose, offset, size, burst);
    });
  }
  void write(memory::Ledger& ledger, memory::Purpose purpose) const {
    each_row([&](std::uint64_t offset, std::uint64_t size) {
      ledger.write_at(memory::Unit::kResolve, purpose, offset, size, burst);
    });
  }
};

// Largest distance of a stencil's taps from a missing pixel, in pixels.
int stencil_reach(const ResolveSettings& settings) {
  if (settings.desampling == Desampling::kCheckerboard) return 1;
  // If a kernel finds no usable pixel within its reach, the nearest one is used: at the latest one of the block's own.
  return settings.reconstruction == Reconstruction::kNearest ? kWindowMargin : kernel_reach(settings.reconstruction);
}

Vec4 not_negative(const Vec4& v) {
  const auto part = [](float c) { return c < 0.0f ? 0.0f : c; };
  return {part(v.x), part(v.y), part(v.z), part(v.w)};
}

}  // namespace

void ResolveUnit::count_skipped(std::uint64_t samples, std::uint64_t invocations) {
  counters_.samples_skipped += samples;
  counters_.invocations_saved += invocations;
}

// ---- Colours ----------------------------------------------------------------------------------------------------

bool ResolveUnit::check(ResolveFrame& resolve, std::span<const Vec3> color, std::span<const float> coverage) {
  History& next = *resolve.next;
  const History* previous = resolve.previous.history;
  const DiscrepancySettings& settings = resolve.settings.discrepancy;
  bool again = false;
  for (Block& block : blocks_) {
    average_samples(block, block.rendered, color, coverage);
    const std::size_t b = next.block(block.pixels.x0, block.pixels.y0);
    next.memory[b] = static_cast<std::uint8_t>(block.decision.memory() | (block.seen == 0 ? History::kNothingSeen : 0));
    const std::uint8_t before = previous != nullptr ? previous->reject[b] : std::uint8_t{0};
    next.reject[b] = before > 0 ? static_cast<std::uint8_t>(before - 1) : std::uint8_t{0};
    const bool discrepant = block.advected != 0 && !block.from_other_eye && is_discrepant(resolve, block);
    if (discrepant) {
      ++counters_.blocks_discrepant;
      block.discrepant = true;
      next.reject[b] = static_cast<std::uint8_t>(settings.frames);
    }
    const bool highlight = resolve.settings.desampling == Desampling::kAdaptive && block.reconstructed != 0 &&
                           settings.check != DiscrepancyCheck::kOff && shows_highlight(block);
    if (highlight) ++counters_.blocks_highlight;
    if (!discrepant && !highlight) continue;
    if (!again) reshade_mask_.assign(pixel_rates_.size(), 0);
    again = true;
    if (discrepant) block.again = std::exchange(block.advected, BlockMask{0});
    if (highlight) block.again = static_cast<BlockMask>(block.again | std::exchange(block.reconstructed, BlockMask{0}));
    shade_again(block);
  }
  return again;
}

bool ResolveUnit::shows_highlight(const Block& block) {
  float low = std::numeric_limits<float>::infinity(), high = 0;
  for_each_pixel(block.pixels, [&](int x, int y) {
    if ((block.rendered & block.exists & block.seen & block_bit(x, y)) == 0) return;
    ++counters_.highlight_tests;
    const Vec4& c = colors_[surfaces_.index(x, y)];
    const float most = std::max({c.x, c.y, c.z});
    low = std::min(low, most), high = std::max(high, most);
  });
  return high > 1.0f && high / (1.0f + high) - low / (1.0f + low) > kHighlightContrast;
}

void ResolveUnit::shade_again(Block& block) {
  block.rendered = static_cast<BlockMask>(block.rendered | block.again);
  for_each_pixel(block.pixels,
                 [&](int x, int y) { reshade_mask_[surfaces_.index(x, y)] = (block.again & block_bit(x, y)) != 0; });
}

bool ResolveUnit::complete(ResolveFrame& resolve, std::span<const Vec3> color, std::span<const float> coverage,
                           const Memory& memory, FrameTargets& targets) {
  History& next = *resolve.next;
  const IntRect& tile = surfaces_.pixels;
  for (const Block& block : blocks_)
    if (block.again != 0) average_samples(block, block.again, color, coverage);
  keep_records(resolve);
  resolve_pixels(resolve, targets);
  // Stencils, when every rendered pixel of the tile is there.
  bool open = false;
  const int margin = stencil_reach(resolve.settings);
  for (const Block& block : blocks_) {
    const std::size_t b = next.block(block.pixels.x0, block.pixels.y0);
    resolve.deferred[b] = 0;
    if (block.reconstructed == 0) continue;
    const IntRect wanted = next.region.intersect(
        {block.pixels.x0 - margin, block.pixels.y0 - margin, block.pixels.x1 + margin, block.pixels.y1 + margin});
    if (resolve.settings.reach == StencilReach::kNeighbours && wanted.intersect(tile) != wanted) {
      resolve.deferred[b] = block.edge ? 2 : 1;
      open = true;
    } else {
      reconstruct(resolve, block, {colors_.data(), records_.data(), surfaces_.surface.data(), tile});
    }
  }
  find_unchanged_blocks(resolve, memory, open);
  for (int y = tile.y0; y < tile.y1; ++y) {
    const Vec4* row = &colors_[surfaces_.index(tile.x0, y)];
    const auto pixels = static_cast<std::size_t>(tile.width());
    const std::size_t bytes = pixels * sizeof(Vec4);
    std::memcpy(&next.color[next.pixel(tile.x0, y)].x, &row->x, bytes);
    if (!next.rounded.empty()) memory.coder.stored({row, pixels}, &next.rounded[next.pixel(tile.x0, y)]);
    std::memcpy(targets.color.at(tile.x0 - targets.region.x0, y - targets.region.y0).data(), &row->x, bytes);
  }
  keep_contrast(resolve);
  if (targets.resolve_auxiliary) write_auxiliary(resolve, targets);
  charge(resolve, memory);
  return open;
}

void ResolveUnit::keep_stored(ResolveFrame& resolve, const FrameTargets& targets) const {
  const IntRect& tile = surfaces_.pixels;
  for (int y = tile.y0; y < tile.y1; ++y)
    std::memcpy(&resolve.next->color[resolve.next->pixel(tile.x0, y)].x,
                targets.color.at(tile.x0 - targets.region.x0, y - targets.region.y0).data(),
                static_cast<std::size_t>(tile.width()) * sizeof(Vec4));
}

void ResolveUnit::average_samples(const Block& block, BlockMask pixels, std::span<const Vec3> color,
                                  std::span<const float> coverage) {
  if (spp_ == 4 && block.exists == kFullBlock) {
    const std::size_t first = surfaces_.index(block.pixels.x0, block.pixels.y0);
    means_of_block(&color[4 * first], &coverage[4 * first], surfaces_.pixels.width(), pixels, &colors_[first]);
    return;
  }
  const auto n = static_cast<std::size_t>(spp_);
  for_each_pixel(block.pixels, [&](int x, int y) {
    if ((pixels & block_bit(x, y)) == 0) return;
    const std::size_t pixel = surfaces_.index(x, y);
    colors_[pixel] = mean_of_samples(&color[n * pixel], &coverage[n * pixel], spp_);
  });
}

// Depth and surface of each pixel, for the next frame and for the second pass.
void ResolveUnit::keep_records(ResolveFrame& resolve) const {
  if (!resolve.keeps_records && resolve.settings.reach != StencilReach::kNeighbours) return;
  History& next = *resolve.next;
  const IntRect& tile = surfaces_.pixels;
  for (int y = tile.y0; y < tile.y1; ++y) {
    const std::size_t from = surfaces_.index(tile.x0, y), to = next.pixel(tile.x0, y),
                      n = static_cast<std::size_t>(tile.width());
    std::copy_n(&records_[from], n, &next.depth[to]);
    std::copy_n(&surfaces_.surface[from], n, &next.surface[to]);
  }
  for (const Block& block : blocks_) {
    if (block.reconstructed == 0) continue;
    for_each_pixel(block.pixels, [&](int x, int y) {
      float& depth = next.depth[next.pixel(x, y)];
      if ((block.reconstructed & block_bit(x, y)) != 0) depth = -depth;
    });
  }
}

void ResolveUnit::resolve_pixels(ResolveFrame& resolve, const FrameTargets& targets) {
  const History& next = *resolve.next;
  for (const Block& block : blocks_) {
    const int shift = block.pixels.x0 & 3, width = block.pixels.width();
    // Prefetches the rows of the image that will be written.
    for (int y = block.pixels.y0; y < block.pixels.y1; ++y)
      __builtin_prefetch(targets.color.at(block.pixels.x0 - targets.region.x0, y - targets.region.y0).data(), 1);
    for (int y = block.pixels.y0; y < block.pixels.y1; ++y) {
      const std::size_t to = next.pixel(block.pixels.x0, y);
      const unsigned row = static_cast<unsigned>(4 * (y & 3) + shift);
      const unsigned advected = block.advected >> row, reconstructed = block.reconstructed >> row;
      const std::uint32_t origin = row_bytes(advected) * static_cast<std::uint32_t>(PixelOrigin::kAdvected) +
                                   row_bytes(reconstructed) * static_cast<std::uint32_t>(PixelOrigin::kReconstructed);
      std::memcpy(&resolve.origin[to], &origin, static_cast<std::size_t>(width));
    }
    pixels_shaded_ += pixel_count(block.rendered);
    counters_.pixels_advected += pixel_count(block.advected);
    counters_.pixels_reconstructed += pixel_count(block.reconstructed);
  }
}

bool ResolveUnit::is_discrepant(const ResolveFrame& resolve, const Block& block) {
  const DiscrepancySettings& settings = resolve.settings.discrepancy;
  if (settings.check == DiscrepancyCheck::kOff) return false;
  const auto looked_at = static_cast<BlockMask>(block.rendered & block.exists);
  Vec4 there[16];
  const BlockMask taken = block.still ? kept_pixels(*resolve.previous.history, block, looked_at, there)
                                      : advectable(resolve, block, looked_at, there);
  if (taken == 0) return false;
  const Vec4* rendered = &colors_[surfaces_.index(block.pixels.x0, block.pixels.y0)];
  std::ptrdiff_t stride = surfaces_.pixels.width();
  Vec4 cut[16];
  if (block.exists != kFullBlock) {
    for_each_pixel(block.pixels, [&](int x, int y) { cut[4 * (y & 3) + (x & 3)] = colors_[surfaces_.index(x, y)]; });
    rendered = cut, stride = 4;
  }
  return largest_difference(there, rendered, stride, taken) > settings.tolerance;
}

// Computes the reprojected colours of `wanted`, which are rendered; returns the pixels that have one.
BlockMask ResolveUnit::advectable(const ResolveFrame& resolve, const Block& block, BlockMask wanted, Vec4* there) {
  BlockMask taken = advect_plain(resolve, block, velocity_, wanted, there, 4);
  if (taken == wanted) return taken;
  for_each_pixel(block.pixels, [&](int x, int y) {
    const BlockMask bit = block_bit(x, y);
    if ((wanted & ~taken & bit) != 0 && advect(resolve, block, velocity_, x, y, there[4 * (y & 3) + (x & 3)], false))
      taken = static_cast<BlockMask>(taken | bit);
  });
  return taken;
}

// ---- Stencils ---------------------------------------------------------------------------------------------------

std::array<std::uint16_t, kWindowSide> ResolveUnit::usable_window(const ResolveFrame& resolve, const Block& block,
                                                                  std::uint32_t surface, const Records& records) const {
  const History& next = *resolve.next;
  const IntRect& reach = records.region;
  const int x0 = block.pixels.x0 & ~3, y0 = block.pixels.y0 & ~3;
  // Inverse depth continues the block's plane: pixels off the plane show another surface of the same drawable. A block
  // with an edge has no such plane. Nor has a blended surface in front of no other, whose depth is infinite.
  const bool whole = block.pixels.width() == 4 && block.pixels.height() == 4;
  const bool plane = whole && !block.edge && resolve.settings.desampling == Desampling::kAdaptive &&
                     std::isfinite(records.depth_at(x0, y0));
  float inverse = 0.0f, by_x = 0.0f, by_y = 0.0f;
  if (plane) {
    inverse = 1.0f / records.depth_at(x0, y0);
    by_x = (1.0f / records.depth_at(x0 + 3, y0) - inverse) * (1.0f / 3.0f);
    by_y = (1.0f / records.depth_at(x0, y0 + 3) - inverse) * (1.0f / 3.0f);
  }
  const float tolerance = std::abs(inverse) * 4.0f * resolve.settings.edges.threshold;
  const bool any_surface = resolve.settings.desampling == Desampling::kCheckerboard;
  const int margin = stencil_reach(resolve.settings);
  std::array<std::uint16_t, kWindowSide> usable{};
  const int left = std::max(reach.x0, x0 - margin), right = std::min(reach.x1, x0 + 4 + margin);
  for (int y = std::max(reach.y0, y0 - margin); y < std::min(reach.y1, y0 + 4 + margin); ++y) {
    std::uint32_t row = 0;
    const std::size_t first = next.pixel(left, y), first_record = records.index(left, y);
    for (int x = left; x < right; ++x) {
      const std::size_t pixel = first + static_cast<std::size_t>(x - left),
                        record = first_record + static_cast<std::size_t>(x - left);
      bool use = resolve.origin[pixel] == static_cast<std::uint8_t>(PixelOrigin::kShaded) &&
                 (any_surface || records.surface[record] == surface);
      if (plane && use && !any_surface) {
        const float z = std::abs(records.depth[record]),
                    expected = inverse + by_x * static_cast<float>(x - x0) + by_y * static_cast<float>(y - y0);
        use = std::isfinite(z) && std::abs(1.0f - expected * z) <= tolerance * z;
      }
      row |= static_cast<std::uint32_t>(use) << (x - x0 + kWindowMargin);
    }
    usable[static_cast<std::size_t>(y - y0 + kWindowMargin)] = static_cast<std::uint16_t>(row);
  }
  return usable;
}

void ResolveUnit::reconstruct(ResolveFrame& resolve, const Block& block, const Records& records) {
  const ResolveSettings& settings = resolve.settings;
  const int x0 = block.pixels.x0 & ~3, y0 = block.pixels.y0 & ~3;
  const std::ptrdiff_t stride = records.region.width();
  const Vec4* first = records.color + (std::ptrdiff_t{y0} - kWindowMargin - records.region.y0) * stride +
                      (x0 - kWindowMargin - records.region.x0);
  // One surface of the block after the other.
  for (BlockMask left = block.reconstructed; left != 0;) {
    const int number = std::countr_zero(left);
    const std::uint32_t surface = records.surface[records.index(x0 + (number & 3), y0 + (number >> 2))];
    BlockMask missing = 0;
    for_each_pixel(block.pixels, [&](int x, int y) {
      if ((left & block_bit(x, y)) != 0 &&
          (settings.desampling == Desampling::kCheckerboard || records.surface[records.index(x, y)] == surface))
        missing = static_cast<BlockMask>(missing | block_bit(x, y));
    });
    left = static_cast<BlockMask>(left & ~missing);
    const BlockWindow light{first, stride, usable_window(resolve, block, surface, records)};
    std::optional<BrightWindow> bright;
    if (BrightWindow::is_bright(light)) bright.emplace(light);
    const BlockWindow& window = bright ? bright->window() : light;
    if (bright) reconstruction_work_.taps += bright->count();
    Vec4 out[16];
    const BlockMask unfilled =
        settings.desampling == Desampling::kCheckerboard
            ? reconstruct_checkerboard(window, missing, out, reconstruction_work_)
            : reconstruct_block(settings.reconstruction, window, missing, out, reconstruction_work_);
    for_each_pixel(block.pixels, [&](int x, int y) {
      const BlockMask bit = block_bit(x, y);
      // Black where nothing finite is around, not another NaN; and where a stencil falls below it.
      if ((missing & bit) == 0) return;
      Vec4& filled = out[4 * (y & 3) + (x & 3)];
      if (bright) filled = bright->light(filled);
      records.color[records.index(x, y)] = (unfilled & bit) != 0 ? Vec4(0.0f, 0.0f, 0.0f, 1.0f) : not_negative(filled);
    });
  }
  counters_.stencil_taps += std::exchange(reconstruction_work_.taps, 0);
}

void ResolveUnit::finish_deferred(ResolveFrame& resolve, IntRect tile, const Memory& memory, FrameTargets& targets) {
  History& next = *resolve.next;
  for (int by = tile.y0 & ~3; by < tile.y1; by += 4)
    for (int bx = tile.x0 & ~3; bx < tile.x1; bx += 4) {
      Block block;
      block.pixels = tile.intersect({bx, by, bx + 4, by + 4});
      const std::size_t b = next.block(block.pixels.x0, block.pixels.y0);
      if (resolve.deferred[b] == 0) continue;
      block.edge = resolve.deferred[b] == 2;
      for_each_pixel(block.pixels, [&](int x, int y) {
        if (resolve.origin[next.pixel(x, y)] == static_cast<std::uint8_t>(PixelOrigin::kReconstructed))
          block.reconstructed = static_cast<BlockMask>(block.reconstructed | block_bit(x, y));
      });
      reconstruct(resolve, block, {next.color.data(), next.depth.data(), next.surface.data(), next.region});
      for_each_pixel(block.pixels, [&](int x, int y) {
        const Vec4& color = next.color[next.pixel(x, y)];
        if (!next.rounded.empty()) memory.coder.stored({&color, 1}, &next.rounded[next.pixel(x, y)]);
        std::memcpy(targets.color.at(x - targets.region.x0, y - targets.region.y0).data(), &color.x, sizeof(Vec4));
      });
      // Colours and records of the window are read again, the block is written again.
      const int margin = stencil_reach(resolve.settings);
      const IntRect window = next.region.intersect({bx - margin, by - margin, bx + 4 + margin, by + 4 + margin});
      const TouchedBursts::Array colors = frame_rows(memory.coder.pixel_bytes(), next.region, memory.burst_bytes),
                                 surfaces{next.region, History::kSurfaceBytes};
      RectTransfer{window, colors, memory.burst_bytes}.read(ledger_, memory::Purpose::kNeighbours);
      RectTransfer{window, surfaces, memory.burst_bytes}.read(ledger_, memory::Purpose::kNeighbours);
      RectTransfer{block.pixels, colors, memory.burst_bytes}.write(ledger_, memory::Purpose::kFrameBuffer);
    }
}

void ResolveUnit::write_auxiliary(const ResolveFrame& resolve, FrameTargets& targets) const {
  const History& next = *resolve.next;
  for (const Block& block : blocks_) {
    const std::size_t b = next.block(block.pixels.x0, block.pixels.y0);
    for_each_pixel(block.pixels, [&](int x, int y) {
      const int tx = x - targets.region.x0, ty = y - targets.region.y0;
      targets.rate.at(tx, ty)[0] = block.seen == 0 ? 0.0f : static_cast<float>(block.decision.samples);
      targets.edges.at(tx, ty)[0] = block.edge ? 1.0f : 0.0f;
      targets.discrepancy.at(tx, ty)[0] = static_cast<float>(next.reject[b]);
      targets.origin.at(tx, ty)[0] = static_cast<float>(resolve.origin[next.pixel(x, y)]);
      const Vec2 v = velocity_.velocity()[surfaces_.index(x, y)];
      targets.velocity.at(tx, ty)[0] = v.x;
      targets.velocity.at(tx, ty)[1] = v.y;
    });
  }
}

}  // namespace tessera::tilecore
