#include "tilecore/shading/frame_shadows.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace tessera::tilecore {
namespace {

using scene::FrameGeometry;
using scene::LightView;
using scene::ShadowSettings;
using shaders::ShadowLayer;
using shaders::ShadowView;

// The share of the receiver's slope in the bias: half a texel lies between the point of a lookup and the middle of a
// texel, and rounding vertices to sub-pixels moves casters by at most half a step along both axes, in each view.
float slope_share(const FrameGeometry& frame, const ShadowSettings& settings) {
  return static_cast<float>(settings.bias * (0.5 + 1.0 / static_cast<double>(frame.request.subpixels())));
}

// Half a step of the format, and the rounding of a depth in single precision.
float constant_bias(const LightView& view, double step, const ShadowSettings& settings) {
  const double far = static_cast<double>(view.camera.camera.far);
  return static_cast<float>(settings.offset + settings.bias * (0.5 * step + far * 0x1p-21));
}

ShadowView view_of(const FrameGeometry& frame, const FrameShadows::Caster& caster, const ShadowSettings& settings,
                   ShadowLayer* layers) {
  const LightView& first = caster.views.front();
  const scene::Projection projection = light_projection(first);
  const double t = (caster.time - frame.part.at(0)) / (frame.part.at(1) - frame.part.at(0));
  for (std::size_t k = 0; k < caster.views.size(); ++k) {
    const LightView& view = caster.views[k];
    const DMat4 open = raster_to_light(frame, 0, view), close = raster_to_light(frame, 1, view);
    layers[k].from_raster = {Mat4(open), Mat4(close)};
    layers[k].from_resting = Mat4(open == close ? open : open * (1.0 - t) + close * t);
    layers[k].bias = constant_bias(view, caster.maps->step(caster.first_layer + static_cast<int>(k)), settings);
  }
  ShadowView out;
  out.texels = caster.maps->layer_texels(caster.first_layer);
  out.size = first.size, out.layers = static_cast<int>(caster.views.size());
  out.first_layer = caster.first_layer;
  out.t = static_cast<float>(t);
  out.perspective = !projection.orthographic;
  out.filter = settings.filter;
  out.slope_bias = slope_share(frame, settings);
  out.max_slope = static_cast<float>(settings.max_slope / projection.scale);
  out.layer = layers;
  return out;
}

}  // namespace

FrameShadows::FrameShadows(const FrameGeometry& frame, std::span<const Caster> casters, const ShadowSettings& settings)
    : maps_(frame.lights[0].size(), nullptr) {
  std::vector<int> times_of(maps_.size(), 0);
  for (const Caster& caster : casters) {
    TESSERA_CHECK(!caster.views.empty() && caster.first_layer >= 0 &&
                      caster.first_layer + static_cast<int>(caster.views.size()) <= caster.maps->layers(),
                  "a caster has a view for each of its maps");
    maps_[caster.light] = caster.maps;
    times_ = std::max(times_, ++times_of[caster.light]);
  }
  for (int number = 0; number <= static_cast<int>(frame.segments.size()); ++number) {
    const FrameGeometry& of = frame.segment(number);
    Segment& segment = segments_.emplace_back(Segment{&of, std::vector<ShadowView>(views()), {}});
    std::vector<int> seen(maps_.size(), 0);
    for (const Caster& caster : casters) {
      segment.layers.push_back(std::make_unique<ShadowLayer[]>(caster.views.size()));
      const std::size_t first = caster.light * static_cast<std::size_t>(times_);
      ShadowView& view = segment.views[first + static_cast<std::size_t>(seen[caster.light]++)];
      view = view_of(of, caster, settings, segment.layers.back().get());
      view.times = times_of[caster.light];
    }
  }
}

const ShadowView* FrameShadows::of(const FrameGeometry& segment) const {
  const auto found = std::ranges::find(segments_, &segment, &Segment::frame);
  TESSERA_CHECK(found != segments_.end(), "shadows belong to the frame that is drawn");
  return found->views.data();
}

}  // namespace tessera::tilecore
