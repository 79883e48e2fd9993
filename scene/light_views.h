#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "scene/frame_geometry.h"
#include "scene/shadow_settings.h"

namespace tessera::scene {

// A light of a frame that casts shadows.
struct ShadowLight {
  std::uint32_t light = 0;  // of FrameGeometry::lights
  ShadowRequest request;    // with the sizes from the settings
};

// Whether surfaces of a material cast shadows.
bool casts(const Material& material, BlendedCasters blended);

// The request for the maps of a light, from the capture or, where all lights cast, by default; none where the light
// does not cast.
std::optional<ShadowRequest> shadow_request(const Capture& capture, int light, ShadowCasters casters);
// The same with the sizes from the settings.
ShadowRequest sized_request(const Capture& capture, ShadowRequest request, const ShadowSettings& settings);

// The lights of a frame that cast, in the order of FrameGeometry::lights.
std::vector<ShadowLight> shadow_lights(const FrameGeometry& frame, const ShadowSettings& settings);

// One map of a light and its view: a spot light's cone, a face of a cube around a point light (and around a spot whose
// cone is wider than 120 degrees), or a cascade of a directional light.
struct LightView {
  int layer = 0;        // index among the light's maps; cascades nearer to the camera come first
  int size = 0;         // texels along a side
  CameraChoice camera;  // fixed
};

// The maps of each of a frame's lights at shutter open. Depth begins before all casters. A border of kShadowBorder
// texels surrounds the area of a map, so that filters find their texels in it. Cascades are split at 0.85 of a
// logarithmic and 0.15 of an even division of the view's depth (Zhang et al. 2006, "Parallel-split shadow maps").
// A light whose node is scaled to nothing looks along -z.
std::vector<std::vector<LightView>> light_views(const FrameGeometry& frame, std::span<const ShadowLight> lights,
                                                const ShadowSettings& settings);
inline constexpr int kShadowBorder = 2;
// Whether a light needs the faces of a cube.
bool needs_cube(const shaders::Light& light);

// The frame's scene at shutter open, as a map of a light sees it: drawables that cast, without lights. Runs on all threads.
std::unique_ptr<FrameGeometry> pose_for_light(const FrameGeometry& frame, const LightView& view,
                                              const ShadowSettings& settings);

// Matrix from the raster space of a frame's key to the raster space of a light's view, on (xh, yh, depth, 1). Made in
// double precision without passing through world space, whose coordinates are coarse at far places.
DMat4 raster_to_light(const FrameGeometry& frame, std::size_t key, const LightView& view);

// The times of a frame's shutter for which lights have maps: the middles of equal parts of it. Empty where only the
// camera moves: one map shows all times.
std::vector<double> shadow_times(const FrameGeometry& frame, const ShadowSettings& settings);

// The raster projection of a map's view.
Projection light_projection(const LightView& view);

}  // namespace tessera::scene
