// First half of the resolve unit: the decisions before shading.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "tilecore/resolve/block_contrast.h"
#include "tilecore/resolve/block_pixels.h"
#include "tilecore/resolve/resolve_unit.h"
#include "tilecore/resolve/tile_border.h"
#include "tilecore/tile_state.h"

namespace tessera::tilecore {
namespace {

// Rounds up a usable motion, which fits an int.
int ceiling(float v) {
  const int whole = static_cast<int>(v);
  return whole + (static_cast<float>(whole) < v ? 1 : 0);
}

// Operations on four channels for the distance of a pixel's samples from where they rest [by hand].
constexpr std::uint64_t kBlurOperations = 4;

std::uint32_t dither_number(const ResolveFrame& resolve) {
  return resolve.settings.dither.order != DitherOrder::kOff ? resolve.number : 0;
}

float in_24_bits(float v) { return std::bit_cast<float>(std::bit_cast<std::uint32_t>(v) & 0xffffff00u); }

}  // namespace

void ResolveUnit::plan(const ResolveFrame& resolve, const scene::FrameGeometry& frame, const TileSamples& samples,
                       TileState& state) {
  spp_ = samples.spp;
  samples_ = &samples, state_ = &state;
  surfaces_.gather(frame, samples, state, resolve.previous.motion);
  velocity_.start(frame, samples, state, surfaces_, resolve.previous.motion);
  if (resolve.other_eye.motion != nullptr)
    eye_velocity_.start(frame, samples, state, surfaces_, resolve.other_eye.motion);
  pixel_rates_.assign(surfaces_.depth.size(), kTogether);
  colors_.resize(surfaces_.depth.size());
  records_.resize(surfaces_.depth.size());
  fetched_.clear(), eye_fetched_.clear(), looked_at_.clear(), eye_looked_at_.clear(), contrast_rects_.clear();
  vertex_bytes_ = 0;
  blocks_.clear();
  const IntRect& tile = surfaces_.pixels;
  for (int y = tile.y0 & ~3; y < tile.y1; y += 4)
    for (int x = tile.x0 & ~3; x < tile.x1; x += 4) {
      Block block;
      block.pixels = tile.intersect({x, y, x + 4, y + 4});
      record(frame.projection.orthographic, block);
      decide(resolve, block);
      fetch_ahead(resolve, block);
      blocks_.push_back(block);
    }
  // Once all velocities of the tile are there.
  for (Block& block : blocks_) plan_block(resolve, block);
  for (VelocityBuffer* velocity : {&velocity_, &eye_velocity_}) {
    const VelocityBuffer::Work work = velocity->take_work();
    counters_.velocity_operations += work.operations;
    vertex_bytes_ += work.vertex_bytes;
    places_ += work.places;
  }
}

bool ResolveUnit::is_outline(const Block& block) const {
  const std::size_t first = surfaces_.index(block.pixels.x0, block.pixels.y0);
  return !block.uniform || ((surfaces_.surface[first] & PixelSurfaces::kMixed) != 0 && surfaces_.layered[first] == 0);
}

bool ResolveUnit::is_edge(const ResolveFrame& resolve, Block& block) {
  const ResolveSettings& settings = resolve.settings;
  if (block.outline) return true;
  const std::size_t first = surfaces_.index(block.pixels.x0, block.pixels.y0),
                    stride = static_cast<std::size_t>(surfaces_.pixels.width());
  if (detect_edge(settings.edges, &surfaces_.depth[first], stride, block.pixels.width(), block.pixels.height()))
    return true;
  if (!resolve.creases.on() || block.exists != kFullBlock || !std::isfinite(surfaces_.depth[first]) ||
      !resolve.creases.detect(&surfaces_.depth[first], stride, block.pixels.x0, block.pixels.y0))
    return false;
  block.creased = true;
  return true;
}

// Blur by lens and motion, in pixels: the distance of a pixel of the block from the places at shutter open, through a
// pinhole, of the surfaces that its samples see. Takes the mean over all samples of an opaque surface, and the least of
// the pixels.
float ResolveUnit::blur_of(const Block& block) const {
  const TileSamples& samples = *samples_;
  const TileState& state = *state_;
  const auto n = static_cast<std::size_t>(spp_);
  float least = std::numeric_limits<float>::infinity();
  for_each_pixel(block.pixels, [&](int x, int y) {
    const std::size_t first = surfaces_.index(x, y) * n;
    float sum = 0.0f;
    int seen = 0;
    for (std::size_t s = first; s < first + n; ++s) {
      if (state.patch[s] == TileState::kNoPatch) continue;
      const float dx = state.rest_x[s] - samples.x[s], dy = state.rest_y[s] - samples.y[s];
      sum += std::sqrt(dx * dx + dy * dy), ++seen;
    }
    if (seen > 0) least = std::min(least, sum / static_cast<float>(seen));
  });
  return std::isfinite(least) ? least : 0.0f;
}

// Finds the block's surfaces, and whether they are one surface, at rest; computes the nearest depth only if there is
// another eye.
void ResolveUnit::look_at_pixels(const ResolveFrame& resolve, Block& block, float& nearest) const {
  const std::size_t first = surfaces_.index(block.pixels.x0, block.pixels.y0);
  const std::uint32_t surface = surfaces_.surface[first];
  if (block.pixels.width() == 4 && block.pixels.height() == 4 && resolve.other_eye.history == nullptr) {
    block.uniform = true;
    constexpr std::uint32_t kAllBits = row_bytes(15) * (PixelSurfaces::kAtRest | PixelSurfaces::kSameShading);
    std::uint32_t bits = kAllBits;
    for (std::size_t j = 0; j < 4; ++j) {
      const std::size_t row = first + j * static_cast<std::size_t>(surfaces_.pixels.width());
      std::uint32_t still = 0;
      std::memcpy(&still, &surfaces_.still[row], sizeof still);
      bits &= still;
      block.uniform = block.uniform && all_are(&surfaces_.surface[row], surface);
    }
    if (block.uniform) {
      block.exists = kFullBlock;
      block.seen = surface != 0 ? kFullBlock : BlockMask{0};
      block.still = (bits & row_bytes(15)) == row_bytes(15);
      block.same_shading = (bits >> 1 & row_bytes(15)) == row_bytes(15);
      return;
    }
  }
  std::uint32_t other = 0;
  std::uint8_t still = PixelSurfaces::kAtRest | PixelSurfaces::kSameShading;
  for (int y = block.pixels.y0; y < block.pixels.y1; ++y) {
    const std::size_t row = surfaces_.index(block.pixels.x0, y);
    for (int x = block.pixels.x0; x < block.pixels.x1; ++x) {
      const std::size_t pixel = row + static_cast<std::size_t>(x - block.pixels.x0);
      const BlockMask bit = block_bit(x, y);
      block.exists = static_cast<BlockMask>(block.exists | bit);
      if (surfaces_.surface[pixel] != 0) block.seen = static_cast<BlockMask>(block.seen | bit);
      other |= surfaces_.surface[pixel] ^ surface;
      still &= surfaces_.still[pixel];
      if (resolve.other_eye.history != nullptr) nearest = std::min(nearest, surfaces_.depth[pixel]);
    }
  }
  block.uniform = other == 0;
  block.still = (still & PixelSurfaces::kAtRest) != 0;
  block.same_shading = (still & PixelSurfaces::kSameShading) != 0;
}

// Prefetches on the host the history that plan_block() will read and complete() will write.
void ResolveUnit::fetch_ahead(const ResolveFrame& resolve, const Block& block) const {
  const History& next = *resolve.next;
  for (int y = block.pixels.y0; y < block.pixels.y1; ++y) {
    const std::size_t first = next.pixel(block.pixels.x0, y);
    __builtin_prefetch(&next.color[first], 1);
    if (block.pixels.x0 % 16 >= 4) continue;  // a line of the host's cache holds sixteen of each
    __builtin_prefetch(&next.depth[first], 1);
    __builtin_prefetch(&next.surface[first], 1);
  }
  if (!block.decision.advect) return;
  const History& history = block.from_other_eye ? *resolve.other_eye.history : *resolve.previous.history;
  const VelocityBuffer& velocity = block.from_other_eye ? eye_velocity_ : velocity_;
  constexpr float kFarthest = 1024;
  const Vec2 motion = glm::clamp(velocity.velocity()[surfaces_.index(block.pixels.x0, block.pixels.y0)],
                                 Vec2(-kFarthest), Vec2(kFarthest));
  const IntRect& region = history.region;
  const int x0 = std::clamp(block.pixels.x0 - ceiling(motion.x), region.x0, region.x1 - 1),
            x1 = std::min(x0 + 4, region.x1 - 1), y0 = block.pixels.y0 - ceiling(motion.y);
  for (int y = std::max(y0, region.y0); y < std::min(y0 + 5, region.y1); ++y) {
    const std::size_t first = history.pixel(x0, y), last = history.pixel(x1, y);
    __builtin_prefetch(&history.surface[first]);
    __builtin_prefetch(&history.depth[first]);
    __builtin_prefetch(&history.color[first]);
    __builtin_prefetch(&history.color[last]);
  }
}

// By how much depth changes from pixel to pixel along both axes: of two rows and two columns the one that changes less,
// so that a step that cuts one of them is none of it. 0 where that is not known.
float ResolveUnit::slope_of(const Block& block) const {
  if (block.exists != kFullBlock) return 0.0f;
  const std::size_t first = surfaces_.index(block.pixels.x0, block.pixels.y0),
                    last = first + 3 * static_cast<std::size_t>(surfaces_.pixels.width());
  const float* const z = surfaces_.depth.data();
  const float a = z[first], b = z[first + 3], c = z[last], d = z[last + 3];
  const float slope = (std::min(std::abs(b - a), std::abs(d - c)) + std::min(std::abs(c - a), std::abs(d - b))) / 3.0f;
  return std::isfinite(slope) ? slope : 0.0f;
}

// Records a plane, three numbers, if a block sees one surface that is plane enough.
void ResolveUnit::record(bool orthographic, Block& block) {
  for_each_pixel(block.pixels, [&](int x, int y) {
    const std::size_t pixel = surfaces_.index(x, y);
    records_[pixel] = surfaces_.depth[pixel];
  });
  const std::size_t first = surfaces_.index(block.pixels.x0, block.pixels.y0),
                    stride = static_cast<std::size_t>(surfaces_.pixels.width());
  if (block.pixels.width() != 4 || block.pixels.height() != 4) return;
  float value[16], plane[16];
  bool one = true;
  for (std::size_t i = 0; i < 16; ++i) {
    const std::size_t pixel = first + i / 4 * stride + i % 4;
    one = one && surfaces_.surface[pixel] == surfaces_.surface[first];
    value[i] = orthographic ? surfaces_.depth[pixel] : 1.0f / surfaces_.depth[pixel];
  }
  if (!one) return;
  if (surfaces_.surface[first] == 0) {
    block.plane = true;
    return;
  }
  const float by_x = in_24_bits((value[3] - value[0]) * (1.0f / 3.0f)),
              by_y = in_24_bits((value[12] - value[0]) * (1.0f / 3.0f));
  float worst = 0.0f;  // relative
  for (std::size_t i = 0; i < 16; ++i) {
    plane[i] = value[0] + by_x * static_cast<float>(i % 4) + by_y * static_cast<float>(i / 4);
    worst = std::max(worst, std::abs(plane[i] - value[i]) / std::abs(value[i]));
  }
  if (!(worst <= History::kPlaneError)) return;  // nor where nothing opaque is seen
  block.plane = true;
  block.plane_value = value[0], block.plane_by_x = by_x, block.plane_by_y = by_y;
  for (std::size_t i = 0; i < 16; ++i)
    records_[first + i / 4 * stride + i % 4] = orthographic ? plane[i] : 1.0f / plane[i];
}

bool ResolveUnit::is_relit(const MotionField& motion, const Block& block) {
  const LightReach& lights = motion.lights();
  if (lights.none() || lights.everywhere()) return lights.everywhere();
  // A ball around the surfaces of the block's pixels.
  Vec3 low(std::numeric_limits<float>::infinity()), high(-low);
  for_each_pixel(block.pixels, [&](int x, int y) {
    const float z = surfaces_.depth[surfaces_.index(x, y)];
    if (!std::isfinite(z)) return;
    const Vec3 point = lights.point(Vec2(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f), z);
    low = glm::min(low, point), high = glm::max(high, point);
  });
  if (!(low.x <= high.x)) return true;  // blended surfaces before nothing
  counters_.light_tests += lights.volumes();
  return lights.reaches(0.5f * (low + high), 0.5f * glm::length(high - low));
}

void ResolveUnit::decide(const ResolveFrame& resolve, Block& block) {
  const ResolveSettings& settings = resolve.settings;
  float nearest = std::numeric_limits<float>::infinity();
  look_at_pixels(resolve, block, nearest);
  block.still = block.still && resolve.previous.motion != nullptr;
  if (block.seen == 0) return;
  if (settings.desampling != Desampling::kAdaptive) {
    block.decision = {settings.desampling == Desampling::kFixed4 ? 4 : 8, false};
    if (resolve.auxiliary) velocity_.evaluate(block.pixels, settings.block_speed, false);
    return;
  }
  BlockEvidence evidence;
  evidence.still = block.still;
  evidence.cut = resolve.cut;
  const History* history = resolve.previous.history;
  if (history != nullptr && reads_blocks(settings))
    evidence.last_samples = history->memory[history->block(block.pixels.x0, block.pixels.y0)] & History::kRegime;
  if (history != nullptr && advects(settings)) {
    const bool rejected = history->rejected_around(block.pixels.x0, block.pixels.y0);
    counters_.history_rejected += rejected;
    evidence.advection_allowed = !rejected && block.same_shading && !is_relit(*resolve.previous.motion, block);
  }
  // If all is still, edges do not decide.
  const bool copies = block.still && evidence.advection_allowed;
  if (!copies || resolve.auxiliary) {
    block.outline = is_outline(block);
    block.edge = is_edge(resolve, block);
  }
  evidence.edge = block.edge && !copies;
  evidence.outline = block.outline && evidence.advection_allowed;
  const bool needed = !evidence.edge || evidence.outline;
  if (needed || resolve.auxiliary) {
    const VelocityBuffer::Block motion = velocity_.evaluate(block.pixels, settings.block_speed, needed);
    evidence.velocity_usable = motion.usable;
    evidence.speed = motion.speed;
    const bool may_be_fast = needed && motion.usable && motion.speed > settings.rates.thresholds.reuse;
    if (const float shutter = may_be_fast ? resolve.previous.motion->shutter() : 0.0f; shutter > 0) {
      // On average, samples see a surface displaced by half of its way during the shutter.
      evidence.blurred_speed = state_->keeps_rest ? 2.0f * blur_of(block) / shutter : 0.0f;
      counters_.velocity_operations += 16 * kBlurOperations;
      if (state_->keeps_rest) places_ += 16 * static_cast<std::uint64_t>(spp_);
      block.left_by_blur = left_by_blur(std::min(motion.speed, evidence.blurred_speed) * shutter);
    }
    if (reads_contrast(settings) && !evidence.edge) {
      const float least = 0.5f * settings.rates.thresholds.half_rate;  // slower blocks will hardly be fast soon
      block.leaves_contrast = !motion.usable || motion.speed >= least;
      if (motion.usable && motion.speed >= least && history != nullptr)
        evidence.contrast = contrast_before(*history, block) * block.left_by_blur;
    }
  }
  const Vec2 middle(static_cast<float>(block.pixels.x0 & ~3) + 2.0f, static_cast<float>(block.pixels.y0 & ~3) + 2.0f);
  evidence.max_samples = resolve.foveation.max_samples(middle);
  counters_.blocks_foveated += evidence.max_samples < 16 ? 1 : 0;
  settle(resolve, block, evidence, nearest);
}

void ResolveUnit::settle(const ResolveFrame& resolve, Block& block, const BlockEvidence& evidence, float nearest) {
  const ResolveSettings& settings = resolve.settings;
  block.decision = select_rate(settings.rates, evidence);
  if (block.decision.advect) block.slope = slope_of(block);
  // The other eye sees far surfaces at the same place. Velocities of surfaces at rest are since the last frame, and
  // zero.
  const bool smooth = !block.edge || block.creased || block.outline;
  if (resolve.other_eye.history != nullptr && smooth && !block.still && nearest > resolve.other_eye_depth &&
      !block.decision.advect) {
    eye_velocity_.evaluate(block.pixels, settings.block_speed, true);
    block.from_other_eye = true;
    block.decision = {std::min(8, evidence.max_samples), true};
    block.slope = slope_of(block);
  }
}

void ResolveUnit::plan_block(const ResolveFrame& resolve, Block& block) {
  const ResolveSettings& settings = resolve.settings;
  if (block.seen == 0) {
    block.rendered = block.exists;
    return;
  }
  const std::uint32_t number = dither_number(resolve);
  const int rate = std::min(16, block.decision.samples);
  BlockMask pattern = settings.desampling == Desampling::kCheckerboard
                          ? checkerboard_mask(number)
                          : dither_mask(rate, number, settings.dither, block.decision.advect && !block.still);
  if (rate < 16 && !block.decision.advect && settings.desampling != Desampling::kCheckerboard &&
      settings.reach == StencilReach::kTile) {
    const int x = block.pixels.x0 & 3, y = block.pixels.y0 & 3;
    const BlockMask lines = border_line(pattern, tile_borders(surfaces_.pixels, block.pixels), x, y,
                                        x + block.pixels.width(), y + block.pixels.height());
    pattern = static_cast<BlockMask>(pattern | lines);
  }
  const auto missing = static_cast<BlockMask>(block.seen & ~pattern);
  block.rendered = static_cast<BlockMask>(block.exists & ~missing);
  if (block.decision.advect) {
    if (block.still)
      copy_still(resolve, block, missing);
    else
      try_advection(resolve, block, missing);
  } else if (missing != 0) {
    block.reconstructed = reconstructible(settings, block, missing);
    block.rendered = static_cast<BlockMask>(block.exists & ~block.reconstructed);
  }
  switch (block.decision.samples) {
    case 4:
      ++counters_.blocks_rate_4;
      break;
    case 8:
      ++counters_.blocks_rate_8;
      break;
    case 32:
      ++counters_.blocks_rate_32;
      break;
    default:
      ++counters_.blocks_rate_16;
      break;
  }
  counters_.blocks_advected += block.decision.advect;
  counters_.blocks_edge += block.edge && !block.decision.advect;
  if (block.rendered == block.exists && block.decision.samples != 32) return;  // all are kTogether already
  const PixelRate rate_of_rendered = block.decision.samples == 32 ? kHalvesApart : kTogether;
  if (block.exists == kFullBlock) {
    for (int j = 0; j < 4; ++j) {
      const std::uint32_t row = row_bytes(block.rendered >> (4 * j) & 15u) * rate_of_rendered;
      std::memcpy(&pixel_rates_[surfaces_.index(block.pixels.x0, block.pixels.y0 + j)], &row, sizeof row);
    }
  } else {
    for_each_pixel(block.pixels, [&](int x, int y) {
      pixel_rates_[surfaces_.index(x, y)] = (block.rendered & block_bit(x, y)) != 0 ? rate_of_rendered : kSkipped;
    });
  }
}

BlockMask ResolveUnit::reconstructible(const ResolveSettings& settings, const Block& block, BlockMask missing) const {
  if (block.uniform && block.exists == kFullBlock) return block.rendered != 0 ? missing : BlockMask{0};
  BlockMask found = 0;
  for_each_pixel(block.pixels, [&](int x, int y) {
    if ((missing & block_bit(x, y)) == 0) return;
    for_each_pixel(block.pixels, [&](int nx, int ny) {
      if ((block.rendered & block_bit(nx, ny)) == 0) return;
      if (settings.desampling == Desampling::kCheckerboard
              ? std::abs(nx - x) + std::abs(ny - y) == 1
              : surfaces_.surface[surfaces_.index(nx, ny)] == surfaces_.surface[surfaces_.index(x, y)])
        found = static_cast<BlockMask>(found | block_bit(x, y));
    });
  });
  return found;
}

BlockMask ResolveUnit::advect_plain(const ResolveFrame& resolve, const Block& block, const VelocityBuffer& velocity,
                                    BlockMask wanted, Vec4* out, std::ptrdiff_t out_stride) {
  const AdvectionSettings& settings = resolve.settings.advection;
  if (block.exists != kFullBlock || settings.fetch != Fetch::kBilinear || settings.bfecc) return 0;
  const std::size_t first = surfaces_.index(block.pixels.x0, block.pixels.y0);
  if (block.from_other_eye)
    for_each_pixel(block.pixels, [&](int x, int y) {
      if (!(velocity.then_depth()[surfaces_.index(x, y)] > resolve.other_eye_depth))
        wanted = static_cast<BlockMask>(wanted & ~block_bit(x, y));
    });
  const History& history = block.from_other_eye ? *resolve.other_eye.history : *resolve.previous.history;
  const HistoryView view{history.between_pixels(), history.depth.data(), history.surface.data(), history.region,
                         history.region.width()};
  const BlockOfPixels pixels{block.pixels.x0,
                             block.pixels.y0,
                             &velocity.then_depth()[first],
                             &surfaces_.surface[first],
                             &velocity.velocity()[first],
                             &velocity.usable()[first],
                             surfaces_.pixels.width()};
  const PlainAdvection plain = advect_plain_pixels(pixels, wanted, view, block.slope, out, out_stride, advection_work_);
  if (plain.taken != 0) {
    (block.from_other_eye ? eye_fetched_ : fetched_).push_back(plain.texels);
    (block.from_other_eye ? eye_looked_at_ : looked_at_).push_back(plain.texels);
  }
  return plain.taken;
}

void ResolveUnit::try_advection(const ResolveFrame& resolve, Block& block, BlockMask missing) {
  const VelocityBuffer& velocity = block.from_other_eye ? eye_velocity_ : velocity_;
  block.advected = advect_plain(resolve, block, velocity, missing,
                                &colors_[surfaces_.index(block.pixels.x0, block.pixels.y0)], surfaces_.pixels.width());
  missing = static_cast<BlockMask>(missing & ~block.advected);
  if (missing == 0) return;
  for_each_pixel(block.pixels, [&](int x, int y) {
    if ((missing & block_bit(x, y)) == 0) return;
    if (advect(resolve, block, velocity, x, y, colors_[surfaces_.index(x, y)], true))
      block.advected = static_cast<BlockMask>(block.advected | block_bit(x, y));
    else
      block.rendered = static_cast<BlockMask>(block.rendered | block_bit(x, y));
  });
}

// Returns the pixels of `wanted`, of a block at rest, whose colours in the history equal the shaded ones (ADV1 of
// advection.h): their samples saw the same surfaces in the same places, and the history did not reconstruct them.
BlockMask ResolveUnit::kept_pixels(const History& history, const Block& block, BlockMask wanted, Vec4* out16) const {
  BlockMask kept = 0;
  for_each_pixel(block.pixels, [&](int x, int y) {
    const BlockMask bit = block_bit(x, y);
    if ((wanted & bit) == 0) return;
    const std::size_t here = surfaces_.index(x, y), there = history.pixel(x, y);
    const Vec4& color = history.color[there];
    if (history.surface[there] != surfaces_.surface[here] || history.depth[there] != records_[here] ||
        !is_finite(color))
      return;
    out16[4 * (y & 3) + (x & 3)] = color;
    kept = static_cast<BlockMask>(kept | bit);
  });
  return kept;
}

void ResolveUnit::copy_still(const ResolveFrame& resolve, Block& block, BlockMask missing) {
  Vec4 colors[16];
  block.advected = kept_pixels(*resolve.previous.history, block, missing, colors);
  const auto lost = static_cast<BlockMask>(missing & ~block.advected);
  block.rendered = static_cast<BlockMask>(block.rendered | lost);
  block.copied = true, block.lost = lost;
  counters_.advections_disoccluded += pixel_count(lost);
  if (block.advected == 0) return;
  for_each_pixel(block.pixels, [&](int x, int y) {
    if ((block.advected & block_bit(x, y)) != 0) colors_[surfaces_.index(x, y)] = colors[4 * (y & 3) + (x & 3)];
  });
}

bool ResolveUnit::advect(const ResolveFrame& resolve, const Block& block, const VelocityBuffer& velocity, int x, int y,
                         Vec4& out, bool count) {
  const std::size_t pixel = surfaces_.index(x, y);
  const History& history = block.from_other_eye ? *resolve.other_eye.history : *resolve.previous.history;
  const HistoryView view{history.between_pixels(), history.depth.data(), history.surface.data(), history.region,
                         history.region.width()};
  const AdvectedPixel result =
      advect_pixel(x, y, velocity.then_depth()[pixel], surfaces_.surface[pixel], view, velocity.view(block.pixels),
                   resolve.settings.advection, block.slope, advection_work_);
  // Records that were looked at were read, whatever they showed; colours only where records agree.
  if (result.outcome != Advection::kUnusableVelocity && result.outcome != Advection::kOutsideFrame) {
    const Vec2 v = velocity.velocity()[pixel];
    const int left = x - ceiling(v.x), top = y - ceiling(v.y),
              ring = resolve.settings.advection.fetch == Fetch::kBicubic ? 1 : 0;
    const IntRect texels = history.region.intersect({left - ring, top - ring, left + 2 + ring, top + 2 + ring});
    (block.from_other_eye ? eye_looked_at_ : looked_at_).push_back(texels);
    if (result.outcome == Advection::kTaken || result.outcome == Advection::kNonFinite)
      (block.from_other_eye ? eye_fetched_ : fetched_).push_back(texels);
  }
  if (result.outcome == Advection::kTaken &&
      (!block.from_other_eye || velocity.then_depth()[pixel] > resolve.other_eye_depth)) {
    out = result.color;
    return true;
  }
  counters_.advections_disoccluded +=
      count && result.outcome != Advection::kOutsideFrame && result.outcome != Advection::kUnusableVelocity;
  return false;
}

}  // namespace tessera::tilecore
