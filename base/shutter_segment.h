#pragma once

#include <cstddef>

namespace tessera {

// A part of the shutter: codes first..end - 1 of the 65536 that its times are counted in (a sample's time).
struct ShutterSegment {
  static constexpr int kCodes = 65536;
  int first = 0, end = kCodes;

  bool whole() const { return first == 0 && end == kCodes; }
  bool operator==(const ShutterSegment&) const = default;

  // Time within the part of a time of the shutter: scale() * t + offset(). Exact for the whole shutter.
  float scale() const { return static_cast<float>(kCodes) / static_cast<float>(end - first); }
  float offset() const { return -static_cast<float>(first) / static_cast<float>(end - first); }
  float local(float t) const { return t * scale() + offset(); }
  // Time of the shutter at which it begins (0) or ends (1).
  double at(std::size_t key) const { return static_cast<double>(key == 0 ? first : end) / kCodes; }
  // The code of time t. Times before 0 have the first code, times after 1 the last.
  static int code_of(float t) {
    const float scaled = t * static_cast<float>(kCodes);
    return scaled < 0.0f ? 0 : scaled > static_cast<float>(kCodes - 1) ? kCodes - 1 : static_cast<int>(scaled);
  }
};

inline constexpr int kMaxMotionSegments = 2048;

}  // namespace tessera
