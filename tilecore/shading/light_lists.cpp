#include "tilecore/shading/light_lists.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace tessera::tilecore {
namespace {

using scene::FrameGeometry;
using shaders::Light;

// The shader's distance to a light has the error of some roundings of floats: of the light's place, interpolated
// between two times, of the difference and of the squares. A reach is larger by more than that.
constexpr double kRangeMargin = 1e-5, kPlaceMargin = 1e-6, kCosineMargin = 4e-6;

bool is_finite(const Vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

double largest(const DVec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

// Calls visit(light) with a light as it is at both ends of the shutter and of its segments.
template <class Visit>
void each_state(const FrameGeometry& frame, std::size_t light, const Visit& visit) {
  for (int s = 0; s <= static_cast<int>(frame.segments.size()); ++s)
    for (const std::vector<Light>& lights : frame.segment(s).lights) visit(lights[light]);
}

bool reaches_some(const Light& light, LightLists setting) {
  if (light.type == Light::Type::kDirectional || setting == LightLists::kOff) return false;
  return setting == LightLists::kAll || light.range > 0.0f;
}

// Whether lists are made where so many lights reach some places only.
bool are_enough(std::ptrdiff_t lights, LightLists setting) {
  return lights >= (setting == LightLists::kAll ? 1 : kFewestRangedLights);
}

}  // namespace

bool has_light_lists(const FrameGeometry& frame, LightLists setting) {
  return are_enough(
      std::ranges::count_if(frame.lights[0], [&](const Light& light) { return reaches_some(light, setting); }),
      setting);
}

std::uint64_t light_record_bytes(const FrameGeometry& frame) {
  return frame.lights[0].size() * kLightRecordBytes * (frame.moving_lights ? 2 : 1);
}

std::uint64_t light_table_bytes(const scene::Assembly& assembly, LightLists setting) {
  if (setting == LightLists::kOff) return 0;
  const scene::Capture& capture = *assembly.capture;
  const bool ranges_move = std::ranges::any_of(capture.animations, [](const scene::Animation& animation) {
    return std::ranges::any_of(animation.channels, [](const scene::AnimationChannel& channel) {
      return channel.path == scene::AnimatedPath::kLightRange;
    });
  });
  std::uint64_t lights = 0;
  std::ptrdiff_t reaching = 0;
  for (const scene::Node& node : capture.nodes) {
    if (node.light == scene::kNone) continue;
    ++lights;
    const Light& light = capture.lights[static_cast<std::size_t>(node.light)];
    if (reaches_some(light, setting) || (ranges_move && light.type != Light::Type::kDirectional)) ++reaching;
  }
  return are_enough(reaching, setting) ? lights * 2 * kLightRecordBytes : 0;
}

LightBound LightBound::of(const FrameGeometry& frame, std::size_t light) {
  const Light& first = frame.lights[0][light];
  LightBound out;
  if (first.type == Light::Type::kDirectional) return out;
  DVec3 low(first.position), high = low;
  double range = 0;
  bool finite = true, limited = true, still = true;
  each_state(frame, light, [&](const Light& state) {
    low = glm::min(low, DVec3(state.position)), high = glm::max(high, DVec3(state.position));
    // An infinite colour times nothing is no number, and shows.
    finite = finite && is_finite(state.position) && is_finite(state.color);
    limited = limited && state.range > 0.0f;
    range = std::max(range, static_cast<double>(state.range));
    still = still && state.position == first.position && state.direction == first.direction &&
            state.cos_inner == first.cos_inner && state.cos_outer == first.cos_outer;
  });
  if (!finite) return out;
  out.center = 0.5 * (low + high);
  if (limited)
    out.radius =
        0.5 * glm::length(high - low) + range * (1 + kRangeMargin) + kPlaceMargin * (largest(low) + largest(high));
  const DVec3 direction(first.direction);
  const double length = glm::length(direction);
  if (first.type != Light::Type::kSpot || !still || !(std::abs(length - 1) < 1e-3)) return out;
  out.has_cone = true;
  out.direction = direction / length;
  out.cosine = std::clamp(static_cast<double>(first.cos_outer) - kCosineMargin, -1.0, 1.0);
  out.sine = std::sqrt(1 - out.cosine * out.cosine);
  return out;
}

PlaceBox::PlaceBox(const Vec3& axis) {
  axes_[2] = glm::normalize(DVec3(axis));
  // Any two others at right angles to it: the most different axis of the world gives the first.
  const DVec3 size = glm::abs(axes_[2]);
  const DVec3 other = size.x <= size.y && size.x <= size.z ? DVec3(1, 0, 0)
                      : size.y <= size.z                   ? DVec3(0, 1, 0)
                                                           : DVec3(0, 0, 1);
  axes_[0] = glm::normalize(glm::cross(other, axes_[2]));
  axes_[1] = glm::cross(axes_[2], axes_[0]);
}

void PlaceBox::add(const Vec3& place) {
  if (!is_finite(place)) {
    everywhere_ = true;
    return;
  }
  const DVec3 p(place), along(glm::dot(axes_[0], p), glm::dot(axes_[1], p), glm::dot(axes_[2], p));
  low_ = glm::min(low_, along), high_ = glm::max(high_, along);
}

bool PlaceBox::meets(const LightBound& bound) const {
  if (everywhere_) return true;
  const DVec3 center(glm::dot(axes_[0], bound.center), glm::dot(axes_[1], bound.center),
                     glm::dot(axes_[2], bound.center));
  const double coarse = kPlaceMargin * (largest(low_) + largest(high_));
  const DVec3 beside = glm::max(glm::max(low_ - center, center - high_), DVec3(0.0));
  // NaN never compares greater, so such a light is kept.
  if (glm::length(beside) > bound.radius + coarse) return false;
  if (!bound.has_cone) return true;
  const DVec3 way = 0.5 * (low_ + high_) - center;
  const DVec3 world = axes_[0] * way.x + axes_[1] * way.y + axes_[2] * way.z;
  const double along = glm::dot(world, bound.direction),
               across = std::sqrt(std::max(glm::dot(world, world) - along * along, 0.0)),
               ball = 0.5 * glm::length(high_ - low_) + coarse + kPlaceMargin * largest(bound.center);
  // The distance of the middle of a ball around the box from the cone, or less.
  return !(bound.cosine * across - bound.sine * along > ball);
}

void LightList::find(const FrameGeometry& frame) {
  numbers_.clear();
  for (std::size_t light = 0; light < frame.lights[0].size(); ++light)
    if (box_.meets(LightBound::of(frame, light))) numbers_.push_back(static_cast<std::uint32_t>(light));
}

timing::WarpItem place_warp(bool moving) {
  timing::WarpItem item;
  item.kind = timing::WarpItem::kPlaces;
  // A place between three corners: 9 multiplications and additions, at each key, and 3 mixing them; 9 turn it; 6 minima and
  // maxima, over 32 lanes in five steps.
  item.clocks = (moving ? 2 * 9 + 6 : 9) + 9 + 6 * 5;
  item.registers = 16;
  return item;
}

timing::WarpItem light_test_warp() {
  timing::WarpItem item;
  item.kind = timing::WarpItem::kLightTests;
  // 9 turn a light's place, 9 find what lies beside the box, 4 compare it with the range; of cones 3 find the way, 6 and a
  // root (4) what lies along and across, 3 compare; 4 give a light its place in the list.
  item.clocks = 9 + 9 + 4 + 3 + 6 + 4 + 3 + 4;
  item.registers = 24;
  return item;
}

}  // namespace tessera::tilecore
