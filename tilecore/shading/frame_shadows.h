#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "scene/light_views.h"
#include "shaders_cpp/shadow_map.h"
#include "tilecore/shading/depth_maps.h"

namespace tessera::tilecore {

// The shadow maps of a frame's lights as the pixel shader looks them up, for each of its motion segments.
class FrameShadows {
 public:
  // A casting light: its number, the views of its maps at a time, and the maps. `maps` must outlive this object. A
  // light with maps of several times has one caster for each, one after the other.
  struct Caster {
    std::size_t light = 0;  // of FrameGeometry::lights
    std::span<const scene::LightView> views;
    const DepthMaps* maps = nullptr;
    int first_layer = 0;  // of `maps`: the first view's
    double time = 0;      // of the shutter, 0 to 1
  };
  FrameShadows(const scene::FrameGeometry& frame, std::span<const Caster> casters,
               const scene::ShadowSettings& settings);

  // times() views for each light of the frame. `segment`: the frame or one of its segments.
  const shaders::ShadowView* of(const scene::FrameGeometry& segment) const;
  // The maps of a view's light, or nullptr.
  const DepthMaps* maps(std::size_t view) const { return maps_[view / static_cast<std::size_t>(times_)]; }
  std::size_t views() const { return maps_.size() * static_cast<std::size_t>(times_); }
  int times() const { return times_; }

 private:
  struct Segment {
    const scene::FrameGeometry* frame;
    std::vector<shaders::ShadowView> views;                       // by light and time
    std::vector<std::unique_ptr<shaders::ShadowLayer[]>> layers;  // of each caster
  };
  std::vector<Segment> segments_;
  std::vector<const DepthMaps*> maps_;  // by light
  int times_ = 1;
};

}  // namespace tessera::tilecore
