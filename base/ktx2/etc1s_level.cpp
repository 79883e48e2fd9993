#include <algorithm>
#include <bit>
#include <limits>
#include <optional>
#include <vector>

#include "base/check.h"
#include "base/ktx2/astc_block.h"
#include "base/ktx2/astc_fit.h"
#include "base/ktx2/level_writer.h"

namespace tessera::ktx2 {
namespace {

using EndpointColors = std::array<std::array<std::uint8_t, 3>, 4>;

// The selectors that occur in a block, a bit each.
unsigned used_selectors(const Etc1sSelector& selector) {
  unsigned used = 0;
  for (unsigned texel = 0; texel < 16; ++texel) used |= 1u << selector.at(texel % 4, texel / 4);
  return used;
}

// An endpoint, a set of selectors and a kind of fit.
using FitKey = std::uint32_t;
constexpr FitKey fit_key(unsigned endpoint, unsigned used, unsigned kind) {
  return (kind << 20) | (endpoint << 4) | used;
}
constexpr unsigned used_of(FitKey key) { return key & 15u; }
constexpr std::size_t endpoint_of(FitKey key) { return (key >> 4) & 0xFFFFu; }
constexpr std::size_t kind_of(FitKey key) { return key >> 20; }

// A block of one slice with the entries of the codebooks that it refers to.
struct SliceBlock {
  unsigned endpoint, used;
  const Etc1sEndpoint* colors;
  const Etc1sSelector* selector;

  bool solid() const { return std::has_single_bit(used); }
  // The selector of a solid block.
  std::size_t only() const { return static_cast<std::size_t>(std::countr_zero(used)); }
  bool grey() const { return colors->red == colors->green && colors->green == colors->blue; }
};
SliceBlock slice_block(const Etc1sCodebooks& books, const Etc1sBlock& block) {
  const Etc1sSelector& selector = books.selectors[block.selector];
  return {block.endpoint, used_selectors(selector), &books.endpoints[block.endpoint], &selector};
}

// ---- RGBA -------------------------------------------------------------------------------------------------------

// The alpha of a texel is the green of the alpha slice.
void slice_texels(const Etc1sCodebooks& books, const Etc1sLevel& blocks, std::size_t index, TexelBlock& texels) {
  const SliceBlock color = slice_block(books, blocks.color[index]);
  const EndpointColors colors = etc1s_colors(*color.colors);
  for (unsigned t = 0; t < 16; ++t) {
    const auto& [red, green, blue] = colors[color.selector->at(t % 4, t / 4)];
    texels[t] = {red, green, blue, 255};
  }
  if (blocks.alpha.empty()) return;
  const SliceBlock alpha = slice_block(books, blocks.alpha[index]);
  const EndpointColors alphas = etc1s_colors(*alpha.colors);
  for (unsigned t = 0; t < 16; ++t) texels[t][3] = alphas[alpha.selector->at(t % 4, t / 4)][1];
}

// ---- ASTC -------------------------------------------------------------------------------------------------------

// How the colour or the alpha of a block is fitted.
struct FitKind {
  AstcFitRanges ranges;
  bool green;  // green alone, which is the luminance of grey and the value of alpha
};
enum Kind : unsigned {
  kRgb,
  kGrey,
  kGreyTwoPlanes,
  kRgbBesideAlpha,
  kAlphaBesideRgb,
  kRgbTwoPlanes4,
  kAlphaTwoPlanes4,
  kRgbTwoPlanes3,
  kAlphaTwoPlanes3,
  kRgbTwoPlanes2,
  kAlphaTwoPlanes2
};
constexpr std::array<FitKind, 11> kKinds = {{{kRgbFit, false},
                                             {kRgbFit, true},
                                             {kGreyAlphaFit, true},
                                             {kRgbaFit, false},
                                             {kRgbaFit, true},
                                             {kTwoPlaneFit4, false},
                                             {kTwoPlaneFit4, true},
                                             {kTwoPlaneFit3, false},
                                             {kTwoPlaneFit3, true},
                                             {kTwoPlaneFit2, false},
                                             {kTwoPlaneFit2, true}}};

AstcFit astc_fit_of(const Etc1sCodebooks& books, FitKey key) {
  const FitKind& kind = kKinds[kind_of(key)];
  EndpointColors colors = etc1s_colors(books.endpoints[endpoint_of(key)]);
  if (kind.green)
    for (auto& color : colors) color[0] = color[1];
  return fit_astc(colors, used_of(key), kind.green ? 1 : 3, kind.ranges);
}

// Fits that were made once for all blocks that need them.
class FitTable {
 public:
  FitTable(const Etc1sCodebooks& books, std::vector<FitKey> keys) : keys_(std::move(keys)) {
    std::sort(keys_.begin(), keys_.end());
    keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
    fits_.resize(keys_.size());
    parallel_for(keys_.size(), [&](std::size_t i) { fits_[i] = astc_fit_of(books, keys_[i]); });
  }
  const AstcFit& at(FitKey key) const {
    return fits_[static_cast<std::size_t>(std::lower_bound(keys_.begin(), keys_.end(), key) - keys_.begin())];
  }

 private:
  std::vector<FitKey> keys_;
  std::vector<AstcFit> fits_;
};

// Most fits of a slice's block that are compared.
constexpr std::size_t kMaxFits = 3;

// A way to make an ASTC block: its components and planes, and the kinds of the fits of colour and alpha. One plane has
// room for one of the two fits; the other one is solid.
struct Plan {
  int components, planes;
  Kind color, alpha;
};
constexpr std::array<Plan, 1> kOpaquePlan = {{{3, 1, kRgb, kRgb}}}, kGreyPlan = {{{2, 1, kGrey, kGrey}}},
                              kGreyAlphaPlan = {{{2, 2, kGreyTwoPlanes, kGreyTwoPlanes}}},
                              kOneOfTwoPlan = {{{4, 1, kRgbBesideAlpha, kAlphaBesideRgb}}};
constexpr std::array<Plan, 3> kBothPlans = {{{4, 2, kRgbTwoPlanes4, kAlphaTwoPlanes4},
                                             {4, 2, kRgbTwoPlanes3, kAlphaTwoPlanes3},
                                             {4, 2, kRgbTwoPlanes2, kAlphaTwoPlanes2}}};

// The plans to try for a block, of which the one with the least error is taken; none for a solid block. `alpha` may be
// null.
std::span<const Plan> plans_of(const SliceBlock& color, const SliceBlock* alpha) {
  if (alpha == nullptr) return std::span(kOpaquePlan).first(color.solid() ? 0 : 1);
  if (color.solid() && alpha->solid()) return {};
  if (alpha->solid() && etc1s_colors(*alpha->colors)[alpha->only()][1] == 255) return kOpaquePlan;
  if (color.grey()) return color.solid() || alpha->solid() ? kGreyPlan : kGreyAlphaPlan;
  if (color.solid() || alpha->solid()) return kOneOfTwoPlan;
  return kBothPlans;
}

class AstcLevel {
 public:
  AstcLevel(const Etc1sCodebooks& books, const Etc1sLevel& blocks)
      : books_(books), blocks_(blocks), fits_(books, all_keys()) {}

  AstcBlock block(std::size_t index) const {
    const SliceBlock color = slice_block(books_, blocks_.color[index]);
    const std::optional<SliceBlock> alpha = alpha_of(index);
    const std::span<const Plan> plans = plans_of(color, alpha ? &*alpha : nullptr);
    AstcBlock out;
    if (plans.empty()) {
      const auto [red, green, blue] = etc1s_colors(*color.colors)[color.only()];
      out.solid = true;
      out.color = {red, green, blue, 255};
      if (alpha) out.color[3] = etc1s_colors(*alpha->colors)[alpha->only()][1];
      return out;
    }
    const Plan* plan = &plans[0];
    std::int64_t least = std::numeric_limits<std::int64_t>::max();
    for (const Plan& other : plans.subspan(plans.size() == 1 ? 1 : 0))
      if (const std::int64_t error = error_of(color, other.color) + error_of(*alpha, other.alpha); error < least)
        plan = &other, least = error;
    out.components = plan->components;
    out.planes = plan->planes;
    out.plane_channel = 3;
    out.weight_range = kKinds[plan->color].ranges.weights;
    out.endpoint_range = kKinds[plan->color].ranges.endpoints;
    const auto colors = static_cast<std::size_t>(plan->components == 2 ? 1 : 3);
    place(color, plan->color, 0, colors, 0, out);
    if (plan->components != 3) place(*alpha, plan->alpha, colors, 1, static_cast<std::size_t>(plan->planes) - 1, out);
    return out;
  }

 private:
  std::optional<SliceBlock> alpha_of(std::size_t index) const {
    if (blocks_.alpha.empty()) return std::nullopt;
    return slice_block(books_, blocks_.alpha[index]);
  }

  // Keys of the fits that the blocks need; solid blocks need none.
  std::vector<FitKey> all_keys() const {
    std::vector<FitKey> keys;
    keys.reserve(blocks_.alpha.empty() ? blocks_.color.size() : 2 * kMaxFits * blocks_.color.size());
    for (std::size_t i = 0; i < blocks_.color.size(); ++i) {
      const SliceBlock color = slice_block(books_, blocks_.color[i]);
      const std::optional<SliceBlock> alpha = alpha_of(i);
      for (const Plan& plan : plans_of(color, alpha ? &*alpha : nullptr)) {
        if (!color.solid()) keys.push_back(fit_key(color.endpoint, color.used, plan.color));
        if (plan.components != 3 && !alpha->solid()) keys.push_back(fit_key(alpha->endpoint, alpha->used, plan.alpha));
      }
    }
    return keys;
  }

  // Sum of squares over a block of a slice that is not solid.
  std::int64_t error_of(const SliceBlock& slice, Kind kind) const {
    const AstcFit& fit = fits_.at(fit_key(slice.endpoint, slice.used, kind));
    std::int64_t error = 0;
    for (unsigned t = 0; t < 16; ++t) error += fit.errors[slice.selector->at(t % 4, t / 4)];
    return error;
  }

  // Endpoints of `count` components from `first` on, and weights of a plane where the slice's block is not solid.
  void place(const SliceBlock& slice, Kind kind, std::size_t first, std::size_t count, std::size_t plane,
             AstcBlock& out) const {
    if (slice.solid()) {
      const auto color = etc1s_colors(*slice.colors)[slice.only()];
      for (std::size_t c = 0; c < count; ++c) {
        const int number = count == 1 ? color[1] : color[c];
        const auto value = static_cast<std::uint8_t>(nearest_astc_endpoint(out.endpoint_range, number));
        out.endpoints[2 * (first + c)] = out.endpoints[2 * (first + c) + 1] = value;
      }
      return;
    }
    const AstcFit& fit = fits_.at(fit_key(slice.endpoint, slice.used, kind));
    for (std::size_t c = 0; c < count; ++c)
      for (std::size_t side = 0; side < 2; ++side) out.endpoints[2 * (first + c) + side] = fit.endpoints[c][side];
    for (unsigned t = 0; t < 16; ++t)
      out.weights[static_cast<std::size_t>(out.planes) * t + plane] = fit.weights[slice.selector->at(t % 4, t / 4)];
  }

  const Etc1sCodebooks& books_;
  const Etc1sLevel& blocks_;
  FitTable fits_;
};

}  // namespace

void write_etc1s_level(const Etc1sCodebooks& books, const Etc1sLevel& blocks, const ContainerLevel& source,
                       BasisTarget target, bool srgb, BasisLevel& level) {
  if (target == BasisTarget::kRgba32) {
    write_level(source, 0, level, [&](std::size_t index, std::span<std::uint8_t>, TexelBlock& texels) {
      slice_texels(books, blocks, index, texels);
    });
    return;
  }
  const AstcLevel astc(books, blocks);
  write_level(source, 16, level, [&](std::size_t index, std::span<std::uint8_t> bytes, TexelBlock& texels) {
    const AstcBytes packed = pack_astc(astc.block(index));
    std::copy(packed.begin(), packed.end(), bytes.begin());
    TESSERA_CHECK(decode_astc(packed, srgb, texels), "a block that was packed is read");
  });
}

std::uint64_t etc1s_working_bytes(BasisTarget target, bool alpha, std::uint64_t block_count) {
  if (target == BasisTarget::kRgba32) return 0;
  return (alpha ? 2 * kMaxFits : 1) * block_count * (sizeof(FitKey) + sizeof(AstcFit));
}

}  // namespace tessera::ktx2
