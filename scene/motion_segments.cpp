#include "scene/motion_segments.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "scene/motion_curves.h"
#include "scene/subpixel.h"

namespace tessera::scene {
namespace {

constexpr double kCodes = ShutterSegment::kCodes;
constexpr int kHalvings = 30;
constexpr double kSnap = 0.15;  // of a piece: it ends at a kink that is so near to its end
// Where the error exceeds the requested one by more than this factor, pieces get uneven lengths: at such errors a
// periodic motion could hide between the ends of even pieces. Uneven pieces have longer chords among them, which cost
// area, so a requested number of segments stays even for longer.
constexpr double kUneven = 4, kUnevenOnRequest = 32;
constexpr double kGolden = 0.6180339887498949;

// Distance of chords from a curve of which is known how it bends: the second derivative, piece by piece, and changes of
// velocity in between. A chord from a to b is off at t by the integral of G(t, s) |f''(s)|, G being Green's function
// (s - a)(b - t) / (b - a) for s < t, and so on.
class ChordError {
 public:
  ChordError(const std::vector<CurveTime>& times, std::size_t pieces)
      : times_(times), density_(pieces, 0.0), kink_(pieces + 1, 0.0) {
    add_up();
  }

  void add(const Bend& bend) {
    for (std::size_t k = 0; k < density_.size(); ++k)
      density_[k] = std::max(density_[k], static_cast<double>(bend.acceleration[k]));
    for (std::size_t k = 0; k < kink_.size(); ++k) kink_[k] = std::max(kink_[k], static_cast<double>(bend.kink[k]));
    add_up();
  }

  // Most pixels between the curve and the chord from a to b. The bound is concave along the chord, its second derivative
  // being -|f''|: it is largest where its slope, (after - before) / (b - a), falls through zero.
  double of(double a, double b) const {
    const Sums at_a = sums(a, true), at_b = sums(b, false);
    const auto before = [&](const Sums& at) { return at.first - at_a.first - a * (at.zeroth - at_a.zeroth); };
    const auto after = [&](const Sums& at) { return b * (at_b.zeroth - at.zeroth) - (at_b.first - at.first); };
    const auto slope = [&](const Sums& at) { return (after(at) - before(at)) / (b - a); };
    // The first piece at whose end it falls.
    std::size_t low = piece_of(a), high = piece_of(b);
    while (low < high) {
      const std::size_t middle = low + (high - low) / 2;
      if (slope(sums(times_[middle + 1].at, false)) > 0)
        low = middle + 1;
      else
        high = middle;
    }
    double t = std::max(a, times_[low].at);
    if (const double rise = slope(sums(t, true)); rise > 0 && density_[low] > 0)
      t = std::clamp(t + rise / density_[low], t, std::min(b, times_[low + 1].at));
    const Sums at_t = sums(t, true);
    const double worst = ((b - t) * before(at_t) + (t - a) * after(at_t)) / (b - a);
    return std::isfinite(worst) ? std::max(worst, 0.0) : 1e30;
  }

  // The last kink inside of (a, b).
  std::optional<double> last_kink(double a, double b) const {
    for (std::size_t k = std::min(piece_of(b) + 1, kink_.size() - 1); k-- > 0;)
      if (times_[k].at <= a)
        break;
      else if (times_[k].at < b && kink_[k] > 0)
        return times_[k].at;
    return std::nullopt;
  }

 private:
  // Integrals of |f''| and of s |f''| from 0.
  struct Sums {
    double zeroth = 0, first = 0;
  };
  void add_up() {
    sums_.assign(times_.size(), {});
    for (std::size_t k = 0; k + 1 < times_.size(); ++k) {
      const Sums from = with_kink(sums_[k], k);
      sums_[k + 1] = in_piece(from, k, times_[k + 1].at);
    }
  }
  Sums with_kink(const Sums& sums, std::size_t k) const {
    return {sums.zeroth + kink_[k], sums.first + kink_[k] * times_[k].at};
  }
  Sums in_piece(const Sums& from, std::size_t k, double t) const {
    const double begin = times_[k].at;
    return {from.zeroth + density_[k] * (t - begin), from.first + density_[k] * 0.5 * (t * t - begin * begin)};
  }
  std::size_t piece_of(double t) const {
    const auto after = std::upper_bound(times_.begin(), times_.end(), t,
                                        [](double at, const CurveTime& time) { return at < time.at; });
    const auto k = static_cast<std::size_t>(after - times_.begin());
    return std::min(k == 0 ? 0 : k - 1, density_.size() - 1);
  }
  // Up to t; with the kink that is at t itself, or without.
  Sums sums(double t, bool with) const {
    const std::size_t k = piece_of(t);
    if (t == times_[k].at) return with ? with_kink(sums_[k], k) : sums_[k];
    if (k + 1 < times_.size() && t == times_[k + 1].at && k + 1 == density_.size()) return sums_[k + 1];
    return in_piece(with_kink(sums_[k], k), k, t);
  }

  const std::vector<CurveTime>& times_;
  std::vector<double> density_, kink_;
  std::vector<Sums> sums_;  // at the times, their kinks not included
};

// Ends of pieces between ends that are given, as long as `limit` pixels allow: each in turn. Empty where that takes more
// than `most` of them.
std::vector<double> cut(const ChordError& error, const std::vector<double>& given, double limit, std::size_t most) {
  std::vector<double> ends = {0.0};
  for (std::size_t g = 0; g + 1 < given.size(); ++g) {
    double a = given[g];
    const double end = given[g + 1];
    while (error.of(a, end) > limit) {
      double low = a + 1 / kCodes, high = end;
      for (int step = 0; step < kHalvings && high - low > 0.25 / kCodes; ++step) {
        const double middle = 0.5 * (low + high);
        (error.of(a, middle) > limit ? high : low) = middle;
      }
      if (const auto kink = error.last_kink(a, low); kink && low - *kink < kSnap * (low - a)) low = *kink;
      if (low >= end || ends.size() >= most) break;
      ends.push_back(a = low);
    }
    ends.push_back(end);
    if (ends.size() > most + 1 || error.of(a, end) > limit * (1 + 1e-9)) return {};
  }
  return ends;
}

// The least error with which `most` pieces do, between two bounds of it.
double least_limit(const ChordError& error, const std::vector<double>& given, double low, double high,
                   std::size_t most) {
  for (int step = 0; step < kHalvings; ++step) {
    const double middle = std::sqrt(low * high);
    (cut(error, given, middle, most).empty() ? low : high) = middle;
  }
  return high;
}

// Moves all ends but the given ones, each by a different share of the shorter adjacent piece.
void make_uneven(const std::vector<double>& given, std::vector<double>& ends) {
  const std::vector<double> even = ends;
  for (std::size_t k = 1; k + 1 < ends.size(); ++k) {
    if (std::ranges::find(given, even[k]) != given.end()) continue;
    const double whole = static_cast<double>(k) * kGolden, share = whole - std::floor(whole) - 0.5;
    ends[k] += 0.9 * share * std::min(even[k] - even[k - 1], even[k + 1] - even[k]);
  }
}

}  // namespace

SegmentPlan plan_segments(const FrameGeometry& frame, const CameraChoice& camera) {
  const FrameRequest& request = frame.request;
  const Assembly& assembly = *frame.assembly;
  if (request.motion_segments == 1 || request.open_time == request.close_time ||
      assembly.capture->played_animations.empty())
    return {};
  const MotionCurves curves = measure_motion(frame, camera);
  const std::size_t pieces = curves.times.size() - 1;
  const bool automatic = request.motion_segments == 0;
  const double limit = automatic ? request.motion_error : static_cast<double>(kStillPixels);
  ChordError error(curves.times, pieces);
  SegmentPlan plan;
  plan.curved.resize(curves.drawables.size());
  std::vector<bool> jumps(pieces + 1, false);
  bool cuts = false, zooms = false;
  const auto is_curved = [&](const Bend& bend) {
    if (bend.off != 0) return false;
    ChordError own(curves.times, pieces);
    own.add(bend);
    bool jumping = false;
    for (std::size_t k = 1; k < pieces; ++k)
      if (static_cast<double>(bend.jump[k]) > limit) jumping = jumps[k] = true;
    const bool zooming = static_cast<double>(bend.zoom) > limit;
    if (!jumping && !zooming && !(own.of(0, 1) > limit)) return false;
    error.add(bend);
    zooms = zooms || zooming;
    return cuts = true;
  };
  for (std::size_t d = 0; d < curves.drawables.size(); ++d) {
    // The sampling controller draws procedures with footprints on the whole shutter's motion.
    const bool sampled = frame.drawables[d].procedure != nullptr && request.sample_procedures;
    plan.curved[d] = !sampled && frame.drawables[d].visible && is_curved(curves.drawables[d]);
  }
  is_curved(curves.background);

  std::vector<double> given = {0.0, 1.0};
  for (const WindingFlip& flip : curves.flips)
    for (std::size_t d = 0; d < plan.curved.size(); ++d)
      if (assembly.drawables[d].node == flip.node && frame.drawables[d].visible && curves.drawables[d].off == 0) {
        plan.curved[d] = cuts = true;
        given.push_back(flip.at);
      }
  if (!cuts) return {};
  for (std::size_t k = 1; k < pieces; ++k)
    if (jumps[k]) given.push_back(curves.times[k].at);
  std::sort(given.begin(), given.end());
  given.erase(std::unique(given.begin(), given.end()), given.end());

  const auto most = static_cast<std::size_t>(
      std::max(automatic ? request.motion_segments_max : request.motion_segments, static_cast<int>(given.size()) - 1));
  std::vector<double> ends = automatic ? cut(error, given, limit, most) : std::vector<double>();
  plan.error = limit;
  bool uneven = false;
  if (ends.empty()) {
    plan.error = least_limit(error, given, 1e-6, 1e9, most);
    uneven = plan.error > (automatic ? kUneven : kUnevenOnRequest) * request.motion_error;
  } else if (ends.size() > 2) {
    plan.error = least_limit(error, given, limit / 16, limit, ends.size() - 1);  // as many, but of even errors
  }
  ends = cut(error, given, plan.error, most);
  if (uneven) make_uneven(given, ends);
  if (ends.size() == 2 && zooms) ends.insert(ends.begin() + 1, 0.5);
  if (ends.size() <= 2) return {};

  std::vector<int> codes;
  for (const double end : ends) {
    const int code = static_cast<int>(std::lround(end * kCodes));
    if (codes.empty() || code > codes.back()) codes.push_back(code);
  }
  for (std::size_t k = 0; k + 1 < codes.size(); ++k) {
    plan.parts.push_back({codes[k], codes[k + 1]});
    bool jump = false;
    for (std::size_t t = 1; t < pieces; ++t)
      jump = jump || (jumps[t] && std::lround(curves.times[t].at * kCodes) == codes[k]);
    plan.jumps.push_back(jump);
  }
  return plan;
}

}  // namespace tessera::scene
