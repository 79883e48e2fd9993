// Shading in two halves, with a G-buffer between them.
#include <algorithm>

#include "base/check.h"
#include "base/round_up.h"
#include "tilecore/shading/gbuffer_packing.h"
#include "tilecore/shading/lit_draws.h"
#include "tilecore/shading/pixel_shader.h"
#include "tilecore/shading/shader_features.h"

namespace tessera::tilecore {

using scene::FrameGeometry;
using Planes = GbufferPlanes;

namespace {

timing::WarpItem item_of(const FrameGeometry& frame, const scene::PosedDrawable& drawable,
                         const hardware::ShaderFeatures& features) {
  const hardware::ShaderCost cost = hardware::shader_cost(features);
  timing::WarpItem item;
  item.clocks = static_cast<std::uint32_t>(hardware::lane_clocks(cost));
  item.registers = static_cast<std::uint32_t>(cost.registers);
  item.drawable = static_cast<std::uint32_t>(&drawable - frame.drawables.data()) + 1;
  return item;
}

bool is_blended(const scene::PosedDrawable& drawable) {
  return drawable.material->alpha_mode == scene::AlphaMode::kBlend;
}

// Adds the clocks of a lane to write or read the words that a sample has beyond the packed values, or subtracts the clocks of
// the word that it lacks.
void add_words(const PixelShader::Halves& halves, timing::WarpItem& item) {
  const std::int64_t clocks = item.clocks + std::int64_t{halves.further_words} * kGbufferWordClocks;
  item.clocks = static_cast<std::uint32_t>(std::max<std::int64_t>(clocks, 0));
}

// Rounds the material and the normal of lane `lane` as the packed layout does.
void round_packed(const GbufferArrays& planes, std::size_t lane) {
  std::array<float, Planes::kMaterial> values;
  for (std::size_t p = 0; p < values.size(); ++p) values[p] = planes[p][lane];
  values = unpack_gbuffer(pack_gbuffer(values, 0));
  for (std::size_t p = 0; p < values.size(); ++p) planes[p][lane] = values[p];
}

}  // namespace

bool fills_gbuffer(const scene::PosedDrawable& drawable, const PixelShader::Halves& halves) {
  const scene::Material& material = *drawable.material;
  const bool fits = halves.emission || material.emissive == Vec3(0.0f);
  return fits && drawable.procedure == nullptr && !material.unlit && !material.effects.any() && !is_blended(drawable);
}

timing::WarpItem fill_warp_item(const FrameGeometry& frame, const scene::PosedDrawable& drawable, bool quads,
                                const PixelShader::Halves& halves, bool evaluates) {
  evaluates = evaluates && has_grid(drawable) && !interpolates_surface(frame, drawable);
  hardware::ShaderFeatures features = pixel_features(frame, drawable, quads, evaluates);
  features.stage = hardware::ShaderFeatures::Stage::kFill;
  features.packed = halves.layout == GbufferLayout::kPacked;
  timing::WarpItem item = item_of(frame, drawable, features);
  item.kind = evaluates ? timing::WarpItem::kEvaluating : timing::WarpItem::kPixels;
  add_words(halves, item);
  return item;
}

timing::WarpItem light_warp_item(const FrameGeometry& frame, const scene::PosedDrawable& drawable,
                                 const Lighting& lighting, GbufferLayout layout, bool evaluates,
                                 const std::span<const std::uint32_t>* listed) {
  hardware::ShaderFeatures features = pixel_features(frame, drawable, true, evaluates);
  features.stage = hardware::ShaderFeatures::Stage::kLight;
  features.packed = layout == GbufferLayout::kPacked;
  features.environment_image = looks_around(lighting, *drawable.material);
  if (listed != nullptr) keep_lights(frame, *listed, features);
  if (lighting.shadows != nullptr) add_shadows(*lighting.shadows, frame, listed, features);
  timing::WarpItem item = item_of(frame, drawable, features);
  item.kind = timing::WarpItem::kLight;
  return item;
}

// ---- The fill half ----------------------------------------------------------------------------------------------

void PixelShader::fill(const FrameGeometry& shutter, const Lighting& lighting, std::span<const Invocation> invocations,
                       std::span<ShadedPoint> points, TextureUnit* textures, std::size_t warp_lanes, const Vec3* axis,
                       const Halves& halves) {
  TESSERA_CHECK(lighting.known_shadows == nullptr, "the light half looks shadows up");
  if (textures != nullptr && !textures->active()) textures = nullptr;
  begin(shutter, invocations, axis, textures != nullptr, warp_lanes);
  filled_.assign(invocations.size(), 0);
  planes_.resize(Planes::kAll * invocations.size());
  batch_planes_.resize(Planes::kAll * kBatch);
  for_each_draw(shutter, invocations, warp_lanes, [&](const Draw& draw) {
    if (fills_gbuffer(draw.drawable, halves))
      fill_draw_of(shutter, lighting, invocations, draw, textures, warp_lanes, halves);
    else if (!is_blended(draw.drawable))
      shade_draw_of(shutter, lighting, invocations, draw, points, textures, warp_lanes);
  });
}

void PixelShader::fill_draw_of(const FrameGeometry& shutter, const Lighting& lighting,
                               std::span<const Invocation> invocations, const Draw& of, TextureUnit* textures,
                               std::size_t warp_lanes, const Halves& halves) {
  const std::span<std::uint32_t> order = of.order;
  const std::uint32_t heights = count_surface(of, textures != nullptr);
  timing::WarpItem item = keep_warps_ ? fill_warp_item(of.frame, of.drawable, of.quads, halves) : timing::WarpItem();
  item.texels = heights;  // of a lane
  if (of.interpolates && !listed_) take_vertices(invocations, of, textures != nullptr, warp_lanes);
  DrawConstants draw =
      lit_draw(shutter, of.frame, of.lights_in, of.drawable, lighting, shadows_of(lighting, of.frame), of.quads);
  if (of.interpolates) of.vertices.outputs.set_mesh(draw);
  LookupArrays lookups;
  if (textures != nullptr) tell_material(draw, *textures, lookups);
  const bool receivers = draw.shadows != nullptr, keys = receivers && draw.shadow_keys && of.drawable.moving;
  const std::size_t planes = keys ? Planes::kAll : receivers ? Planes::kKeys : Planes::kPlain;
  GbufferArrays batch;
  for (std::size_t p = 0; p < batch.size(); ++p) batch[p] = &batch_planes_[p * kBatch];
  const LaneArrays in = lane_arrays();
  shade_batches(order.size(), item, lookups, textures, [&](std::size_t first, std::size_t count) {
    fill_lanes(shutter, invocations, of, first, count);
    fill_draw(draw, in, count, lookups, receivers, batch);
    if (halves.layout == GbufferLayout::kPacked)
      for (std::size_t lane = 0; lane < count; ++lane) round_packed(batch, lane);
    for (std::size_t p = 0; p < planes; ++p)
      for (std::size_t lane = 0; lane < count; ++lane)
        planes_[p * invocations.size() + order[first + lane]] = batch[p][lane];
  });
  for (const std::uint32_t i : order) filled_[i] = 1;
}

// ---- The light half ---------------------------------------------------------------------------------------------

void PixelShader::light(const FrameGeometry& shutter, const Lighting& lighting, std::span<const Invocation> invocations,
                        std::span<ShadedPoint> points, TextureUnit* textures, std::size_t warp_lanes,
                        const Halves& halves) {
  if (textures != nullptr && !textures->active()) textures = nullptr;
  std::vector<Stream> streams;
  for_each_draw(shutter, invocations, warp_lanes, [&](const Draw& draw) {
    if (fills_gbuffer(draw.drawable, halves)) add_to_stream(draw, halves, streams);
  });
  const std::uint64_t looked_up = textures != nullptr ? textures->counters().texels : 0;
  for (const Stream& stream : streams)
    light_stream(shutter, lighting, invocations, stream, points, textures, warp_lanes, halves);
  if (textures != nullptr) light_lookups_ += textures->counters().texels - looked_up;
  for_each_draw(shutter, invocations, warp_lanes, [&](const Draw& draw) {
    if (is_blended(draw.drawable)) shade_draw_of(shutter, lighting, invocations, draw, points, textures, warp_lanes);
  });
}

void PixelShader::add_to_stream(const Draw& of, const Halves& halves, std::vector<Stream>& streams) const {
  // A receiver that moves is looked up where it is at both keys.
  const auto joins = [&](const Stream& stream) {
    return halves.layout == GbufferLayout::kPacked && stream.frame == &of.frame && stream.lights_in == of.lights_in &&
           stream.drawable->moving == of.drawable.moving;
  };
  auto stream = std::ranges::find_if(streams, joins);
  if (stream == streams.end()) stream = streams.insert(streams.end(), {&of.frame, &of.drawable, of.lights_in, {}});
  stream->order.insert(stream->order.end(), of.order.begin(), of.order.end());
}

void PixelShader::light_stream(const FrameGeometry& shutter, const Lighting& lighting,
                               std::span<const Invocation> invocations, const Stream& stream,
                               std::span<ShadedPoint> points, TextureUnit* textures, std::size_t warp_lanes,
                               const Halves& halves) {
  const std::span<const std::uint32_t> order = stream.order, numbers = light_list_.numbers();
  const FrameGeometry& frame = *stream.frame;
  const scene::PosedDrawable& drawable = *stream.drawable;
  warp_ends_.clear();
  for (std::size_t i = warp_lanes; i < order.size(); i += warp_lanes) warp_ends_.push_back(i);
  warp_ends_.push_back(order.size());
  light_warps_ += warp_ends_.size();
  const bool interpolates = interpolates_surface(frame, drawable), exact = halves.layout == GbufferLayout::kExact,
             evaluates = exact && has_grid(drawable) && (halves.stored || !interpolates);
  if (evaluates) surface_work_.warps += warp_ends_.size(), surface_work_.evaluations += order.size();
  if (exact && interpolates && !halves.stored)
    surface_work_.vertex_bytes_moved += 3 * order.size() * vertex_output_bytes(frame, drawable);
  if (listed_) light_counters_.tile_bytes += warp_ends_.size() * numbers.size() * light_bytes_of(shutter);
  timing::WarpItem item =
      keep_warps_ ? light_warp_item(frame, drawable, lighting, halves.layout, evaluates, listed_ ? &numbers : nullptr)
                  : timing::WarpItem();
  add_words(halves, item);
  if (evaluates && textures != nullptr) item.texels = height_lookups(drawable);
  surface_work_.height_lookups += order.size() * item.texels;
  DrawConstants draw =
      lit_draw(shutter, frame, stream.lights_in, drawable, lighting, shadows_of(lighting, frame), false);
  if (listed_) take_listed(draw);
  LookupArrays lookups;
  if (textures != nullptr) tell_light(draw, lighting, listed_, *textures, lookups);
  const bool receivers = draw.shadows != nullptr, keys = receivers && draw.shadow_keys && drawable.moving;
  const std::size_t planes = keys ? Planes::kAll : receivers ? Planes::kKeys : Planes::kPlain;
  GbufferArrays batch;
  for (std::size_t p = 0; p < batch.size(); ++p) batch[p] = &batch_planes_[p * kBatch];
  const std::array<float*, 3> color{output_[0].data(), output_[1].data(), output_[2].data()};
  shade_batches(order.size(), item, lookups, textures, [&](std::size_t first, std::size_t count) {
    // Lanes up to the next multiple of the widest vector repeat the last one.
    for (std::size_t lane = 0; lane < round_up(count, std::size_t{16}); ++lane) {
      const std::uint32_t i = order[first + std::min(lane, count - 1)];
      for (std::size_t p = 0; p < planes; ++p) batch[p][lane] = planes_[p * invocations.size() + i];
      input_[3][lane] = light_time(shutter, stream.lights_in, invocations[i].light_time);
    }
    forget_shadows(lookups, count);
    light_draw(draw, batch, input_[3].data(), count, lookups, color);
    for (std::size_t lane = 0; lane < count; ++lane) {
      ShadedPoint& point = points[order[first + lane]];
      point.color = {color[0][lane], color[1][lane], color[2][lane]};
      point.normal = {batch[Planes::kNormal][lane], batch[Planes::kNormal + 1][lane], batch[Planes::kNormal + 2][lane]};
      point.alpha = 1.0f;
    }
  });
}

}  // namespace tessera::tilecore
