#pragma once

#include "gpu/device.h"
#include "replay/statistics.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"

// Replays with and without desampling, for tests of the resolve unit.
namespace tessera::replay {

using scene::Capture;
using tilecore::History;

struct Machine {
  gpu::RunSettings settings;
  gpu::GpuConfiguration gpu;
  gpu::RenderRequest request{160, 90, {0, 0, 160, 90}};

  Machine() { settings.resolve.desampling = tilecore::Desampling::kAdaptive; }
  Machine& set(const std::string& text) {
    gpu::apply_setting(text, settings, gpu);
    return *this;
  }
  // The three together: none may be above the next.
  Machine& thresholds(const char* still, const char* fast1, const char* fast2) {
    return set(std::string("resolve.reuse_speed=") + still)
        .set(std::string("resolve.half_rate_speed=") + fast1)
        .set(std::string("resolve.quarter_rate_speed=") + fast2);
  }
  gpu::Device renderer(const Capture& capture) const { return {capture, gpu, settings, request}; }
  std::vector<gpu::FrameResult> frames(const Capture& capture, int first, int last) const {
    gpu::Device r = renderer(capture);
    std::vector<gpu::FrameResult> out;
    for (int f = first; f < last; ++f) out.push_back(r.render(f));
    return out;
  }
};

inline Machine plain() { return Machine().set("resolve.desampling=off"); }

// Error of linear light, clamped at the display's maximum: highlights beyond it are equally white.
inline double rmse(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    const double d =
        static_cast<double>(std::min(a.values[i], 1.0f)) - static_cast<double>(std::min(b.values[i], 1.0f));
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(a.values.size()));
}

inline Capture shipped(const char* name) { return scene::read_capture(test::shipped_capture(name)); }

inline const tilecore::DesamplingCounters& counters(const gpu::FrameResult& r) { return r.counters.desampling; }

}  // namespace tessera::replay
