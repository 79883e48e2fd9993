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
  // A light that casts: which, what its maps see, and what they hold. `maps` must outlive this.
  struct Caster {
    std::size_t light = 0;  // of FrameGeometry::lights
    std::span<const scene::LightView> views;
    const DepthMaps* maps = nullptr;
  };
  FrameShadows(const scene::FrameGeometry& frame, std::span<const Caster> casters,
               const scene::ShadowSettings& settings);

  // As the lights of the frame; null: none casts. `segment`: the frame or one of its segments.
  const shaders::ShadowView* of(const scene::FrameGeometry& segment) const;
  // The maps of a light, or null.
  const DepthMaps* maps(std::size_t light) const { return maps_[light]; }
  std::size_t lights() const { return maps_.size(); }

 private:
  struct Segment {
    const scene::FrameGeometry* frame;
    std::vector<shaders::ShadowView> views;                       // by light
    std::vector<std::unique_ptr<shaders::ShadowLayer[]>> layers;  // of those that cast
  };
  std::vector<Segment> segments_;
  std::vector<const DepthMaps*> maps_;
};

// Whether receivers that move are looked up where they are at both motion keys of a frame or of one of its segments: its
// camera moves.
bool has_receiver_keys(const scene::FrameGeometry& segment);

}  // namespace tessera::tilecore
