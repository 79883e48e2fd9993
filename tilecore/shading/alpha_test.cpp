#include "tilecore/shading/alpha_test.h"

#include <algorithm>

#include "base/check.h"
#include "tilecore/procedural/procedure_surface.h"
#include "tilecore/shading/alpha_test_kernel.h"
#include "tilecore/shading/scalar_lanes.h"

namespace tessera::tilecore {
namespace one_lane {

#include "tilecore/shading/lane_alpha.inc"

}  // namespace one_lane

namespace {

using scene::FrameGeometry;
using scene::PosedDrawable;

constexpr auto kColorSlot = static_cast<std::size_t>(scene::MaterialTexture::kBaseColor);

}  // namespace

float point_alpha(const FrameGeometry& shutter, const SurfaceLocation& seen) {
  const auto [frame, at] = in_segment(shutter, seen);
  const PosedDrawable& drawable = frame.drawable_of(at.patch);
  if (drawable.procedure != nullptr) return procedure_alpha(frame, at, nullptr);
  one_lane::LaneInputs<float> in = lane_inputs(frame, drawable, at);
  return one_lane::lane_alpha(draw_constants(frame, drawable), in, LookupArrays(), 0);
}

float finest_alpha(const FrameGeometry& shutter, const SurfaceLocation& seen) {
  const auto [frame, at] = in_segment(shutter, seen);
  const PosedDrawable& drawable = frame.drawable_of(at.patch);
  if (drawable.procedure != nullptr) return procedure_alpha(frame, at, nullptr);
  const DrawConstants draw = draw_constants(frame, drawable);
  one_lane::LaneInputs<float> in = lane_inputs(frame, drawable, at);
  one_lane::LaneSurface<float> s{};
  const float alpha = one_lane::untextured_alpha(draw, in, s);
  const scene::TextureSlot& slot = drawable.material->base_color_texture;
  if (slot.texture == nullptr || slot.texture->opaque()) return alpha;
  const one_lane::LaneTexcoord<float> uv = one_lane::lane_texcoord(draw, s, slot.texcoord, slot.transform);
  return alpha * slot.texture->sample(slot.sampler, {uv.u, uv.v}, 0.0f).w;
}

void AlphaTest::begin(const FrameGeometry& frame, const PosedDrawable& drawable) {
  frame_ = &frame;
  computed_ = drawable.procedure != nullptr;
  interpolates_ = interpolates_surface(frame, drawable);
  last_triangle_ = SurfaceLocation::kWholePatch;
  if (computed_) return;
  draw_ = draw_constants(frame, drawable);
  if (!interpolates_) return;
  vertices_.begin(frame, drawable, VertexOutputs::Use::kAlphaTest);
  counted_ = 0;
}

float AlphaTest::alpha(const SurfaceLocation& at, TextureUnit* textures) {
  std::array<float, kBatch> out;
  alphas({&at, 1}, textures, out);
  return out[0];
}

std::array<std::int32_t, 3> AlphaTest::corners_of(const SurfaceLocation& at) {
  // Hits of a triangle come together.
  if (at.triangle != last_triangle_ || at.patch != last_patch_) {
    last_corners_ = vertices_.triangle(at.patch, at.triangle);
    last_patch_ = at.patch, last_triangle_ = at.triangle;
  }
  return last_corners_;
}

void AlphaTest::alphas(std::span<const SurfaceLocation> at, TextureUnit* textures, std::span<float, kBatch> out) {
  TESSERA_CHECK(at.size() <= kBatch, "no more than a batch");
  if (at.empty()) return;
  if (computed_) {
    for (std::size_t i = 0; i < at.size(); ++i) out[i] = procedure_alpha(*frame_, at[i], textures);
    return;
  }
  const PosedDrawable& drawable = frame_->drawable_of(at[0].patch);
  for (std::size_t i = 0; i < at.size(); ++i) {
    one_lane::LaneInputs<float> in{};
    if (interpolates_) {
      const std::array<std::int32_t, 3> corners = corners_of(at[i]);
      std::copy(corners.begin(), corners.end(), in.vertex);
      in.p = at[i].b1, in.q = at[i].b2, in.t = at[i].t;
    } else {
      in = lane_inputs(*frame_, drawable, at[i]);
    }
    for (std::size_t k = 0; k < 3; ++k) vertex_[k][i] = in.vertex[k];
    vertex_[3][i] = in.triangle;
    input_[0][i] = in.p, input_[1][i] = in.q, input_[2][i] = in.t, input_[3][i] = in.lod;
  }
  // Lanes up to the next multiple of the widest vector.
  for (std::size_t i = at.size(); i % 16 != 0; ++i) {
    for (auto& values : vertex_) values[i] = values[at.size() - 1];
    for (auto& values : input_) values[i] = values[at.size() - 1];
  }
  if (interpolates_) {
    const std::uint64_t made = vertices_.count() - std::exchange(counted_, vertices_.count());
    work_.vertices += made;
    work_.bytes += (made + 3 * at.size()) * kMaskVertexBytes;
    if (made > 0) vertices_.set_mesh(draw_);
  }
  LaneArrays in;
  for (std::size_t k = 0; k < 3; ++k) in.vertex[k] = vertex_[k].data();
  in.triangle = vertex_[3].data();
  in.p = input_[0].data(), in.q = input_[1].data(), in.t = input_[2].data(), in.lod = input_[3].data();
  LookupArrays lookups;
  const scene::TextureSlot& slot = draw_.material->base_color_texture;
  const bool told = textures != nullptr && textures->active() && slot.texture != nullptr && !slot.texture->opaque();
  if (told) {
    lookups.layout[kColorSlot] = &textures->memory()->layout(slot.texture.get());
    for (std::size_t line = 0; line < kLookupLines; ++line) lookups.line[kColorSlot][line] = lines_[line].data();
  }
  alpha_draw(draw_, in, at.size(), lookups, out.data());
  if (!told) return;
  for (std::size_t i = 0; i < at.size(); ++i)
    textures->fetch_lane(*lookups.layout[kColorSlot], lookups.line[kColorSlot], i);
}

AlphaTest::Work AlphaTest::take_work() { return std::exchange(work_, {}); }

}  // namespace tessera::tilecore
