#pragma once

#include <cstddef>

namespace tessera {

// A part of the shutter: codes first..end - 1 of the 256 that its times are counted in (a sample's stencil value).
struct ShutterSegment {
  int first = 0, end = 256;

  bool whole() const { return first == 0 && end == 256; }
  bool operator==(const ShutterSegment&) const = default;

  // Time within the part of a time of the shutter: scale() * t + offset(). Exact for the whole shutter.
  float scale() const { return 256.0f / static_cast<float>(end - first); }
  float offset() const { return -static_cast<float>(first) / static_cast<float>(end - first); }
  float local(float t) const { return t * scale() + offset(); }
  // Time of the shutter at which it begins (0) or ends (1).
  double at(std::size_t key) const { return static_cast<double>(key == 0 ? first : end) / 256.0; }
};

inline constexpr int kMaxMotionSegments = 16;

// Part `number` of `count` nearly equal ones, 1 to kMaxMotionSegments.
inline ShutterSegment shutter_segment(int number, int count) {
  return {256 * number / count, 256 * (number + 1) / count};
}

// Which of the parts holds time t, 0 to 1.
inline int part_of_time(float t, int count) {
  const float scaled = t * 256.0f;
  const int code = scaled < 0.0f ? 0 : scaled > 255.0f ? 255 : static_cast<int>(scaled), guess = code * count / 256;
  return guess + 1 < count && code >= shutter_segment(guess, count).end ? guess + 1 : guess;
}

}  // namespace tessera
