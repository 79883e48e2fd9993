// Supersampled blocks of which some half pixels are made from others.
#include <algorithm>
#include <array>
#include <cmath>

#include "tilecore/pixel_runs.h"
#include "tilecore/resolve/block_pixels.h"
#include "tilecore/resolve/multisample_resolve.h"
#include "tilecore/resolve/resolve_unit.h"

namespace tessera::tilecore {

ResolveUnit::HalfSurface ResolveUnit::surface_of_half(int x, int y, bool right) const {
  const std::size_t pixel = surfaces_.index(x, y), first = pixel * static_cast<std::size_t>(spp_);
  if (surfaces_.layered[pixel] != 0) return {};
  HalfSurface seen;
  bool any = false;
  for (std::size_t s = first; s < first + static_cast<std::size_t>(spp_); ++s) {
    if (in_right_half(samples_->x[s]) != right) continue;
    const std::uint32_t patch = state_->patch[s];
    if (patch == TileState::kNoPatch) return {};
    const std::uint32_t drawable = assembly_->patch_drawable[patch];
    if (!any) {
      seen = {drawable, patch, state_->z[s]};
      any = true;
    } else if (drawable != seen.drawable || (patch != seen.patch && !(std::abs(state_->z[s] - seen.depth) <=
                                                                      PixelSurfaces::kDepthStep * seen.depth))) {
      return {};
    }
  }
  return seen;
}

// Where several drawables meet, each by itself may well be smooth; where one bends, half pixels do not stand for each
// other.
void ResolveUnit::plan_halves(Block& block) {
  if (!block.outline || block.creased) return;
  std::array<HalfSurface, 32> surface;
  HalfMask pure = 0;
  for_each_pixel(block.pixels, [&](int x, int y) {
    for (const int half : {0, 1}) {
      const auto place = static_cast<std::size_t>(8 * (y & 3) + 2 * (x & 3) + half);
      surface[place] = surface_of_half(x, y, half == 1);
      if (surface[place].drawable != kNoSurface) pure |= half_bit(x, y, half);
    }
  });
  block.first_fill = fills_.size();
  for_each_pixel(block.pixels, [&](int x, int y) {
    for (const int half : {0, 1}) {
      const HalfMask bit = half_bit(x, y, half);
      if ((pure & ~half_pattern_ & bit) == 0 || (block.rendered & block_bit(x, y)) == 0) continue;
      const auto place = static_cast<std::size_t>(8 * (y & 3) + 2 * (x & 3) + half);
      const HalfSurface& wanted = surface[place];
      HalfMask usable = 0;
      for (std::size_t other = 0; other < 32; ++other) {
        const HalfSurface& there = surface[other];
        if ((pure & half_pattern_ & 1u << other) != 0 && there.drawable == wanted.drawable &&
            (there.patch == wanted.patch ||
             std::abs(there.depth - wanted.depth) <= PixelSurfaces::kDepthStep * wanted.depth))
          usable |= 1u << other;
      }
      if (!half_is_reconstructible(usable, static_cast<int>(place))) continue;
      fills_.push_back({static_cast<std::uint8_t>(place), usable});
      block.half_made = static_cast<BlockMask>(block.half_made | block_bit(x, y));
      runs_[surfaces_.index(x, y)] = half == 0 ? kRightHalf : kLeftHalf;
    }
  });
  block.fills = fills_.size() - block.first_fill;
}

void ResolveUnit::fill_halves(const Block& block, std::span<const Vec3> color, std::span<const float> coverage) {
  const auto spp = static_cast<std::size_t>(spp_);
  std::array<Vec3, 32> colors{};
  HalfMask known = 0;
  const auto x_of = [&](std::size_t place) { return (block.pixels.x0 & ~3) + static_cast<int>(place % 8 / 2); };
  const auto y_of = [&](std::size_t place) { return (block.pixels.y0 & ~3) + static_cast<int>(place / 8); };
  const auto look = [&](HalfMask places) {
    for (std::size_t place = 0; place < 32; ++place) {
      if ((places & ~known & 1u << place) == 0) continue;
      const std::size_t first = surfaces_.index(x_of(place), y_of(place)) * spp;
      Vec3 sum(0.0f);
      float count = 0.0f;
      for (std::size_t s = first; s < first + spp; ++s)
        if (in_right_half(samples_->x[s]) == (place % 2 == 1)) sum += color[s], count += 1.0f;
      colors[place] = sum / count;
      known |= 1u << place;
    }
  };
  half_colors_.resize(spp), half_coverage_.resize(spp);
  for (std::size_t f = block.first_fill; f < block.first_fill + block.fills; ++f) {
    const auto [place, usable] = fills_[f];
    look(usable);
    const Vec3 made = reconstruct_half(half_pattern_, usable, place, colors.data(), counters_.stencil_taps);
    const std::size_t pixel = surfaces_.index(x_of(place), y_of(place));
    for (std::size_t k = 0; k < spp; ++k) {
      const std::size_t s = pixel * spp + k;
      half_colors_[k] = in_right_half(samples_->x[s]) == (place % 2 == 1) ? made : color[s];
      half_coverage_[k] = coverage[s];
    }
    colors_[pixel] = mean_of_samples(half_colors_.data(), half_coverage_.data(), spp_);
    ++counters_.half_pixels_reconstructed;
  }
}

}  // namespace tessera::tilecore
