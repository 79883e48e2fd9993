#include "bench/support/shader_trace.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <stdexcept>

#include "bench/support/traced_lanes.h"
#include "shaders_cpp/environment_map.h"
#include "tilecore/shading/scalar_lanes.h"

namespace tessera::bench::traced {

// The shaders on these lanes, and then their callers.
namespace stage {
using shaders::EnvironmentLobes;
using shaders::EnvironmentMap;
using shaders::HeightView;
using shaders::kCeiling;
using shaders::kDiffuseRow;
using shaders::kFirstMapRoughness;
using shaders::kFloor;
using shaders::kHorizonWidths;
using shaders::kLobeFloats;
using shaders::kMapInside;
using shaders::kMapLevels;
using shaders::kMinRoughness;
using shaders::kMinSheenRoughness;
using shaders::kPi;
using shaders::kSoftBoxes;
using shaders::LayerConstants;
using shaders::Light;
using shaders::Lights;
using shaders::lobe_numbers;
using shaders::MipFilter;
using shaders::RadianceView;
using shaders::Sampler;
using shaders::ShadowFilter;
using shaders::ShadowLayer;
using shaders::ShadowView;
using shaders::soft_box_axes;
using shaders::SoftBox;
using shaders::Surroundings;
using shaders::TextureView;
using shaders::Wrap;
// Each file needs the files before it.
// clang-format off
#include "shaders_cpp/bicubic.inc"
#include "shaders_cpp/elementary.inc"
#include "shaders_cpp/texture_sampling.inc"
#include "shaders_cpp/radiance_image.inc"
#include "shaders_cpp/studio_light.inc"
#include "shaders_cpp/surroundings.inc"
#include "shaders_cpp/environment_map.inc"
#include "shaders_cpp/metallic_roughness.inc"
#include "shaders_cpp/layered_material.inc"
#include "shaders_cpp/shadow_texels.inc"
#include "shaders_cpp/shadow_map.inc"
// clang-format on
}  // namespace stage

namespace pipeline {
using namespace tilecore;
#include "tilecore/shading/lane_shader.inc"
}  // namespace pipeline

namespace {

// Constants of the draw of these invocations.
tilecore::DrawConstants lit_draw(const CaptureInvocations& of, const scene::PosedDrawable& drawable) {
  tilecore::DrawConstants draw = tilecore::draw_constants(*of.frame, drawable);
  draw.lights.open = of.frame->lights[0];
  if (of.frame->moving_lights) draw.lights.close = of.frame->lights[1];
  draw.surroundings = of.lighting.environment.surroundings();
  return draw;
}

pipeline::LaneInputs<Real> group_inputs(const CaptureInvocations& of, const scene::PosedDrawable& drawable, bool grid,
                                        std::span<const std::uint32_t> group) {
  pipeline::LaneInputs<Real> in;
  for (std::size_t k = 0; k < kLanes; ++k) {
    const tilecore::Invocation& v = of.invocations[group[std::min(k, group.size() - 1)]];
    const auto lane = tilecore::lane_inputs(*of.frame, drawable, v.at);
    for (std::size_t c = 0; c < 3; ++c) in.vertex[c].value[k] = lane.vertex[c];
    in.triangle.value[k] = lane.triangle;
    in.p.value[k] = lane.p, in.q.value[k] = lane.q, in.t.value[k] = v.at.t, in.light_t.value[k] = v.light_time;
    in.lod.value[k] = lane.lod;
  }
  for (Int* input : {&in.vertex[0], &in.vertex[1], &in.vertex[2], &in.triangle}) input->node = current->note_input();
  for (Real* input : {&in.p, &in.q, &in.t, &in.light_t, &in.lod}) input->node = current->note_input();
  const auto& first = in.vertex[0].value;
  in.one_patch = grid && std::count(first.begin(), first.end(), first[0]) == static_cast<std::ptrdiff_t>(kLanes);
  return in;
}

void add_needed(const Trace& trace, ShaderWork& work) {
  std::vector<bool> needed(trace.nodes().size(), false);
  for (const std::uint32_t n : trace.needed()) needed[n] = true;
  // Operands come before the operations that use them.
  for (std::size_t n = needed.size(); n-- > 0;) {
    if (!needed[n]) continue;
    const Trace::Node& node = trace.nodes()[n];
    for (const std::uint32_t operand : node.operands) needed[operand] = true;
    work.arithmetic += node.operation == Operation::kArithmetic;
    work.divisions += node.operation == Operation::kDivision;
    work.roots += node.operation == Operation::kRoot;
    work.texel_gathers += node.operation == Operation::kTexelGather;
    work.other_gathers += node.operation == Operation::kOtherGather;
  }
}

void trace_group(const CaptureInvocations& of, const scene::PosedDrawable& drawable,
                 std::span<const std::uint32_t> group, ShaderWork& work) {
  Trace trace;
  current = &trace;
  const tilecore::DrawConstants draw = lit_draw(of, drawable);
  for (const scene::TextureSlot* slot : draw.material->slots())
    if (slot->texture != nullptr)
      trace.texels.push_back(slot->texture->view().texels), trace.texels.push_back(slot->texture->view().linear);
  if (draw.material->displacement) trace.texels.push_back(draw.material->displacement->texture->view().values);
  trace.note({Operation::kGiven, 0, {}});  // the node that missing operands name
  pipeline::LaneInputs<Real> in = group_inputs(of, drawable, draw.grid, group);
  const pipeline::LaneShaded<Real> out = pipeline::shade_lanes<Real>(draw, in, tilecore::LookupArrays(), 0);
  for (const Real* result :
       {&out.color.x, &out.color.y, &out.color.z, &out.normal.x, &out.normal.y, &out.normal.z, &out.alpha})
    trace.need(result->node);
  current = nullptr;
  add_needed(trace, work);
  for (std::size_t k = 0; k < group.size(); ++k) {
    const Vec3 expected = tilecore::shade_point(*of.frame, of.lighting, of.invocations[group[k]]).color;
    if (expected != Vec3(out.color.x.value[k], out.color.y.value[k], out.color.z.value[k]))
      throw std::runtime_error("traced lanes shade differently");
  }
}

}  // namespace
}  // namespace tessera::bench::traced

namespace tessera::bench {

ShaderWork trace_shader(const CaptureInvocations& of, std::size_t lanes, std::size_t stride) {
  std::vector<std::uint32_t> order(of.invocations.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto draw_of = [&](std::uint32_t i) { return of.assembly.patch_drawable[of.invocations[i].at.patch]; };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return draw_of(a) < draw_of(b); });
  ShaderWork sum;
  std::size_t group = 0, traced = 0;
  for (std::size_t first = 0; first < order.size();) {
    std::size_t end = first + 1;
    while (end < order.size() && end < first + lanes && draw_of(order[end]) == draw_of(order[first])) ++end;
    if (group++ % stride == 0) {
      const scene::PosedDrawable& drawable = of.frame->drawable_of(of.invocations[order[first]].at.patch);
      traced::trace_group(of, drawable, std::span(order).subspan(first, end - first), sum);
      ++traced;
    }
    first = end;
  }
  const auto groups = static_cast<double>(traced);
  return {sum.arithmetic / groups, sum.divisions / groups, sum.roots / groups, sum.texel_gathers / groups,
          sum.other_gathers / groups};
}

}  // namespace tessera::bench
