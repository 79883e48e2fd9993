#include "tilecore/shading/alpha_test.h"

#include "tilecore/procedural/procedure_surface.h"
#include "tilecore/shading/scalar_lanes.h"

namespace tessera::tilecore {
namespace {

using one_lane::LaneInputs;
using one_lane::LaneSurface;
using one_lane::LaneTexcoord;
using scene::FrameGeometry;
using scene::PosedDrawable;

// The surface as far as a texture coordinate and its derivatives need it.
void set_coordinate_surface(const DrawConstants& draw, LaneInputs<float>& in, LaneSurface<float>& s) {
  if (draw.grid)
    one_lane::fill_patch(draw, in, s);
  else
    one_lane::set_triangle_raster(draw, in, s);
  one_lane::set_derivatives(draw.orthographic, s);
}

// `material`: the drawable's own, for what is drawn may be a mesh of its vertices.
float alpha_of(const DrawConstants& draw, LaneInputs<float> in, const scene::Material& material,
               TextureUnit* textures) {
  LaneSurface<float> s{};
  if (draw.grid) {
    one_lane::set_grid_parameters(in);
    one_lane::set_patch_weights(in, s);
  } else {
    one_lane::set_triangle_weights(in, s);
  }
  float alpha = material.base_color.w;
  if (!draw.drawable->primitive->vertices.colors.empty()) alpha *= one_lane::lane_vertex_color(draw, s).a;
  const scene::TextureSlot& slot = material.base_color_texture;
  if (slot.texture == nullptr || slot.texture->opaque()) return alpha;
  set_coordinate_surface(draw, in, s);
  const LaneTexcoord<float> uv = one_lane::lane_texcoord(draw, s, slot.texcoord, slot.transform);
  const float level = one_lane::level_of_detail<float>(slot.texture->view(), uv);
  return alpha * look_up(*slot.texture, slot.sampler, {uv.u, uv.v}, level, textures).w;
}

}  // namespace

float point_alpha(const FrameGeometry& shutter, const SurfaceLocation& seen, TextureUnit* textures) {
  const auto [frame, at] = in_segment(shutter, seen);
  const PosedDrawable& drawable = frame.drawable_of(at.patch);
  if (drawable.procedure != nullptr) return procedure_alpha(frame, at, textures);
  return alpha_of(draw_constants(frame, drawable), lane_inputs(frame, drawable, at), *drawable.material, textures);
}

void AlphaTest::begin(const FrameGeometry& frame, const PosedDrawable& drawable) {
  frame_ = &frame;
  interpolates_ = interpolates_surface(frame, drawable);
  if (!interpolates_) return;
  vertices_.begin(frame, drawable, VertexOutputs::Use::kAlphaTest);
  counted_ = 0;
  draw_ = draw_constants(frame, drawable);
}

float AlphaTest::alpha(const SurfaceLocation& at, TextureUnit* textures) {
  if (!interpolates_) return point_alpha(*frame_, at, textures);
  const std::array<std::int32_t, 3> corners = vertices_.triangle(at.patch, at.triangle);
  const std::uint64_t made = vertices_.count() - std::exchange(counted_, vertices_.count());
  work_.vertices += made;
  work_.bytes += (made + corners.size()) * kMaskVertexBytes;
  if (made > 0) vertices_.set_mesh(draw_);
  LaneInputs<float> in{};
  for (std::size_t k = 0; k < corners.size(); ++k) in.vertex[k] = corners[k];
  in.p = at.b1, in.q = at.b2, in.t = at.t;
  return alpha_of(draw_, in, *draw_.material, textures);
}

AlphaTest::Work AlphaTest::take_work() { return std::exchange(work_, {}); }

}  // namespace tessera::tilecore
