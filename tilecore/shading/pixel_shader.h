#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <utility>
#include <vector>

#include "scene/frame_geometry.h"
#include "shaders_cpp/environment.h"
#include "shaders_cpp/radiance_image.h"
#include "tilecore/shading/draw_inputs.h"
#include "tilecore/shading/frame_shadows.h"
#include "tilecore/shading/gbuffer.h"
#include "tilecore/shading/light_lists.h"
#include "tilecore/shading/shading_settings.h"
#include "tilecore/shading/surface.h"
#include "tilecore/shading/texture_unit.h"
#include "tilecore/shading/vertex_outputs.h"
#include "timing/items.h"

namespace tessera::tilecore {

// Shares of the lights' rays that arrive at the invocations of a call of PixelShader::shade(), if they are known
// without maps.
struct KnownShadows {
  std::vector<std::vector<float>> by_light;  // invocation by invocation; empty: the light casts no shadows
};

// Light of the whole frame.
struct Lighting {
  shaders::Environment environment;
  // The image behind transmissive surfaces, a texel a pixel of the frame, and smaller levels; nullptr: they show the
  // environment.
  const shaders::RadianceImage* behind = nullptr;
  const FrameShadows* shadows = nullptr;  // nullptr: no light casts any, or they are known
  const KnownShadows* known_shadows = nullptr;
};

struct ShadedPoint {
  Vec3 color{0.0f};  // linear, not multiplied by alpha
  float alpha = 1.0f;
  Vec3 normal{0.0f};  // world, after normal map, facing the viewer
};

// One invocation: a place on a surface, and the time of its light, the mean time if samples share it. `partner_x` and
// `partner_y`: its neighbours in a quad, 1 or -1 pixels away, from which it takes its derivatives; 0: it takes the
// surface's own. `quad`: a number that the invocations of a quad share.
struct Invocation {
  SurfaceLocation at;
  float light_time = 0;
  int partner_x = 0, partner_y = 0;
  std::uint32_t quad = 0;
};

// Time at which a sample at time t sees a patch: a patch at rest is as at shutter open. Mixing two equal poses by the
// time would round, and a still pixel would differ from frame to frame.
inline float time_seen(const scene::FrameGeometry& frame, std::uint32_t patch, float t) {
  return frame.drawable_of(patch).moving ? t : 0.0f;
}

// Filtered colour of a texture; `textures`, unless nullptr, fetches its texels.
Vec4 look_up(const shaders::Texture& texture, const shaders::Sampler& sampler, Vec2 uv, float lod,
             TextureUnit* textures);

// The pixel shader unit: evaluates the surface, fetches the material's textures with derivatives from the surface (not
// from neighbouring pixels) and runs the metallic-roughness or the unlit shader.
//
// This is a single invocation, the scalar twin of PixelShader; known shadows are for one invocation.
ShadedPoint shade_point(const scene::FrameGeometry& frame, const Lighting& lighting, const Invocation& invocation);

// Many invocations, packed into warps. A warp belongs to one draw (a drawable in one segment of its motion, under
// lights of one segment of theirs), patch by patch, or quad by quad. The draw's constants are in scalar registers, as
// in hardware, so the last warp of a draw may not be full. Owns scratch memory; one instance per thread.
//
// Invariants (cited by the tests):
//   WARP1  Each point equals shade_point()'s, bit by bit, for every SIMD target and number of lanes.
//   WARP2  A draw of n invocations takes ceil(n / lanes) warps; of n quads, ceil(4 n / lanes).
class PixelShader {
 public:
  // Shades invocations[i] to points[i]. `textures`, unless nullptr, gets every lookup, warp by warp of `warp_lanes`
  // lanes (at least 4). `axis`, unless nullptr, requests a light list (light_lists.h) of all invocations on lit
  // surfaces except procedures; it is the axis of the list's box.
  void shade(const scene::FrameGeometry& frame, const Lighting& lighting, std::span<const Invocation> invocations,
             std::span<ShadedPoint> points, TextureUnit* textures = nullptr, std::size_t warp_lanes = 32,
             const Vec3* axis = nullptr);

  // The same in two halves (gbuffer.h), with the arguments of shade() but for the axis, which fill() takes. fill() fills the
  // G-buffer and shades other opaque surfaces; light(), right after it, lights the G-buffer and shades blended surfaces.
  // `stored`: the G-buffer is in memory between them. Shadows are looked up in maps.
  struct Halves {
    GbufferLayout layout = GbufferLayout::kExact;
    bool stored = false;
    int further_words = 0;  // ShadingSettings::further_words()
    bool emission = true;   // ShadingSettings::keeps_emission()
  };
  void fill(const scene::FrameGeometry& frame, const Lighting& lighting, std::span<const Invocation> invocations,
            std::span<ShadedPoint> points, TextureUnit* textures, std::size_t warp_lanes, const Vec3* axis,
            const Halves& halves);
  void light(const scene::FrameGeometry& frame, const Lighting& lighting, std::span<const Invocation> invocations,
             std::span<ShadedPoint> points, TextureUnit* textures, std::size_t warp_lanes, const Halves& halves);
  // For each invocation of the last fill(), whether it filled the G-buffer.
  std::span<const std::uint8_t> filled() const { return filled_; }
  // A value that fill() left for an invocation; `plane`: of GbufferPlanes.
  float filled_value(std::size_t plane, std::size_t invocation) const {
    return planes_[plane * filled_.size() + invocation];
  }
  // Lights of the list that the last fill() made; 0: none was made.
  std::size_t listed_lights() const { return listed_ ? light_list_.numbers().size() : 0; }
  // Warps of light halves since the last call; take_warps() does not include them.
  std::uint64_t take_light_warps() { return std::exchange(light_warps_, 0); }
  // Their lookups since the last call, with a texture unit.
  std::uint64_t take_light_lookups() { return std::exchange(light_lookups_, 0); }

  // Packs `count` samples of the environment into warps, which are copies of `item`, and sends their lookups in the
  // slot kMirrored, if any, to `textures`; returns the number of warps.
  std::uint64_t pack_background(std::size_t count, const timing::WarpItem& item, const LookupArrays& lookups,
                                TextureUnit& textures, std::size_t warp_lanes);

  // Chooses whether the work of each warp is kept from now on.
  void keep_warps(bool keep) { keep_warps_ = keep, warp_items_.clear(); }
  std::vector<timing::WarpItem> take_warp_items() { return std::exchange(warp_items_, {}); }

  // Warps that shade() took since the last call.
  std::uint64_t take_warps() { return std::exchange(warps_, 0); }
  // Number of these warps whose invocations evaluate a patch again, and of those invocations; vertices evaluated for
  // pixels to interpolate, their warps (beside the others), the bytes of them and of listed lights, and bytes of
  // vertices written and read.
  struct SurfaceWork {
    std::uint64_t warps = 0, evaluations = 0, height_lookups = 0;
    std::uint64_t vertices = 0, vertex_warps = 0, vertex_bytes = 0, vertex_bytes_moved = 0;
  };
  SurfaceWork take_surface_work() { return std::exchange(surface_work_, {}); }
  // Counters of light lists since the last call.
  LightListCounters take_light_counters() { return std::exchange(light_counters_, {}); }

 private:
  // The invocations of a patch of a draw: in order_[first ... first + count).
  struct Bucket {
    std::uint64_t draw;
    std::uint32_t patch, first, count;
  };
  // Lanes processed at a time: at least as many as a warp has.
  static constexpr std::size_t kBatch = 256;

  // Fills draws_, and the light list where `axis` asks for one.
  void begin(const scene::FrameGeometry& frame, std::span<const Invocation> invocations, const Vec3* axis, bool heights,
             std::size_t warp_lanes);
  // Fills buckets_, and order_ and rank_, sorted by draw and patch.
  void sort_invocations(const scene::FrameGeometry& frame, std::span<const Invocation> invocations);
  std::uint32_t bucket_of(std::uint64_t draw, std::uint32_t patch);
  // Puts quads together in the `order` of a draw and sets warp_ends_ to the ends of the warps.
  void cut_warps(std::span<const Invocation> invocations, std::span<std::uint32_t> order, bool quads,
                 std::size_t warp_lanes);
  // Vertices of a draw, and the corners of each of its invocations, by place in its `order`.
  struct DrawVertices {
    VertexOutputs outputs;
    std::vector<std::array<std::int32_t, 3>> corners;
  };
  // Invocations of one draw: a drawable in one segment of its motion, lit by one segment of the lights' motion.
  struct Draw {
    const scene::FrameGeometry& frame;
    const scene::PosedDrawable& drawable;
    int lights_in;
    bool quads, interpolates;
    std::span<std::uint32_t> order;  // of the invocations
    DrawVertices& vertices;          // if it interpolates
  };
  Draw draw_of(const scene::FrameGeometry& shutter, std::span<const Invocation> invocations,
               std::span<std::uint32_t> order, std::size_t number, std::size_t warp_lanes);
  void shade_draw_of(const scene::FrameGeometry& frame, const Lighting& lighting,
                     std::span<const Invocation> invocations, const Draw& of, std::span<ShadedPoint> points,
                     TextureUnit* textures, std::size_t warp_lanes);
  // Calls visit(draw) for each of draws_.
  template <class Visit>
  void for_each_draw(const scene::FrameGeometry& shutter, std::span<const Invocation> invocations,
                     std::size_t warp_lanes, const Visit& visit) {
    for (std::size_t d = 0; d < draws_.size(); ++d)
      visit(draw_of(shutter, invocations, std::span(order_).subspan(draws_[d].first, draws_[d].count), listed_ ? d : 0,
                    warp_lanes));
  }
  // Counts the warps of a draw and what evaluating its surface takes; bilinear lookups of heights for a lane.
  std::uint32_t count_surface(const Draw& of, bool textured);
  void fill_draw_of(const scene::FrameGeometry& frame, const Lighting& lighting,
                    std::span<const Invocation> invocations, const Draw& of, TextureUnit* textures,
                    std::size_t warp_lanes, const Halves& halves);
  // Invocations that one light half lights together: the invocations of a draw or, packed, of all draws in one segment of the motion
  // and of the lights'.
  struct Stream {
    const scene::FrameGeometry* frame;
    const scene::PosedDrawable* drawable;  // of the first
    int lights_in;
    std::vector<std::uint32_t> order;
  };
  void add_to_stream(const Draw& of, const Halves& halves, std::vector<Stream>& streams) const;
  void light_stream(const scene::FrameGeometry& frame, const Lighting& lighting,
                    std::span<const Invocation> invocations, const Stream& stream, std::span<ShadedPoint> points,
                    TextureUnit* textures, std::size_t warp_lanes, const Halves& halves);
  // Fills the inputs of lanes with invocations [first, first + count) of a draw.
  void fill_lanes(const scene::FrameGeometry& frame, std::span<const Invocation> invocations, const Draw& of,
                  std::size_t first, std::size_t count);
  LaneArrays lane_arrays() const;
  // Makes the list of the lights that reach the invocations of all draws.
  void list_lights(const scene::FrameGeometry& frame, std::span<const Invocation> invocations, const Vec3& axis,
                   bool heights, std::size_t warp_lanes);
  void add_places(const scene::FrameGeometry& frame, std::span<const Invocation> invocations, const Draw& of);
  // Adds warps that are copies of `item`; the lanes are distributed over them.
  void keep_light_warps(timing::WarpItem item, std::uint64_t lanes, std::size_t warps);
  // Sets the lights of a draw's constants to the lights of the list.
  void take_listed(DrawConstants& draw);
  // Evaluates the vertices that the invocations interpolate between, in warps of their own.
  void take_vertices(std::span<const Invocation> invocations, const Draw& of, bool heights, std::size_t warp_lanes);
  // The shadows of a draw: the frame's maps, or shares that take_shares() fills; nullptr if no light casts any.
  const shaders::ShadowView* shadows_of(const Lighting& lighting, const scene::FrameGeometry& segment);
  void take_shares(const KnownShadows& known, std::span<const std::uint32_t> invocations);
  // Sets the destinations of the lines of lanes' shadow lookups; `views`: the frame's or, if `listed`, the views of the
  // list's lights. Lanes that a light does not reach write nothing, so earlier lines must be forgotten first.
  void tell_shadows(const shaders::ShadowView* views, const FrameShadows& shadows, bool listed,
                    const TextureUnit& textures, LookupArrays& lookups);
  static void forget_shadows(const LookupArrays& lookups, std::size_t count);
  // Sets the destination of the lines of lanes' lookups in a slot.
  void tell(std::size_t slot, const TextureLayoutView& layout, LookupArrays& lookups);
  // Sets the destinations for the textures that shade_procedure() reads.
  void tell_procedure_textures(const scene::Material& material, const TextureUnit& textures, LookupArrays& lookups);
  void tell_material(const DrawConstants& draw, const TextureUnit& textures, LookupArrays& lookups);
  void tell_light(const DrawConstants& draw, const Lighting& lighting, bool listed, const TextureUnit& textures,
                  LookupArrays& lookups);
  // Calls shade_batch(first, count) for whole warps of the draw, as many as there is room for, and finishes them.
  template <class Shade>
  void shade_batches(std::size_t count_of_draw, const timing::WarpItem& item, const LookupArrays& lookups,
                     TextureUnit* textures, const Shade& shade_batch) {
    std::size_t warp = 0;
    for (std::size_t first = 0; first < count_of_draw;) {
      const std::size_t first_warp = warp;
      while (warp < warp_ends_.size() && warp_ends_[warp] - first <= kBatch) ++warp;
      const std::size_t count = warp_ends_[warp - 1] - first;
      shade_batch(first, count);
      finish_warps(first_warp, warp, first, item, lookups, textures);
      first += count;
    }
  }
  // Sends the lookups of warps [first_warp, end) to `textures` and keeps their work; invocation `first` of the draw is
  // lane 0 of `lookups`.
  void finish_warps(std::size_t first_warp, std::size_t end, std::size_t first, const timing::WarpItem& of_draw,
                    const LookupArrays& lookups, TextureUnit* textures);

  std::vector<Bucket> buckets_;
  std::vector<std::uint32_t> table_;          // of bucket numbers, by patch; a power of two of them
  std::vector<std::uint32_t> bucket_, rank_;  // of each invocation; sorted buckets
  std::vector<std::uint32_t> order_;
  std::vector<std::size_t> warp_ends_;
  std::deque<DrawVertices> draw_vertices_;  // by draw, if a light list needs all of them; else the first alone
  struct DrawRange {
    std::size_t first, count;  // of order_
  };
  std::vector<DrawRange> draws_;
  LightList light_list_;
  bool listed_ = false;  // the current invocations have a light list
  std::vector<shaders::Light> listed_open_, listed_close_;
  std::vector<shaders::ShadowView> listed_views_;
  LightListCounters light_counters_;
  std::array<std::array<std::int32_t, kBatch>, 4> vertex_;
  std::array<std::array<float, kBatch>, 7> input_;
  std::array<std::array<float, kBatch>, 7> output_;
  std::array<std::array<std::array<std::int32_t, kBatch>, kLookupLines>, kLookupSlots> lines_;
  std::vector<std::array<std::array<std::int32_t, kBatch>, kShadowLines>> shadow_lines_;  // by light and time
  std::vector<ShadowLookups> shadow_lookups_;
  // By light: known shares of a batch's lanes, and views of them.
  std::vector<std::array<float, kBatch>> shares_;
  std::vector<shaders::ShadowView> share_views_;
  // Results of the last fill(): values of GbufferPlanes by plane and invocation, and a batch of them by plane and lane.
  std::vector<float> planes_, batch_planes_;
  std::vector<std::uint8_t> filled_;
  std::uint64_t warps_ = 0, light_warps_ = 0, light_lookups_ = 0;
  SurfaceWork surface_work_;
  bool keep_warps_ = false;
  std::vector<timing::WarpItem> warp_items_;
};

// Bilinear lookups of heights by an invocation that evaluates its patch again: at four places around, in two levels
// each, and at both poses of a deforming drawable.
std::uint32_t height_lookups(const scene::PosedDrawable& drawable);

// The warp that every warp of a draw copies (hardware/shader_costs.h). `evaluates`: each invocation evaluates its patch
// again; otherwise vertices have attributes, which are interpolated. `listed`: the lights that it loops over; nullptr:
// all.
timing::WarpItem warp_item(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable,
                           const Lighting& lighting, bool quads, bool evaluates = true,
                           const std::span<const std::uint32_t>* listed = nullptr);

// The same for the halves of a shader with a G-buffer, whose sample has words as `halves` say. `evaluates`: as above; the light half
// finds a place on a patch by evaluating it.
timing::WarpItem fill_warp_item(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable, bool quads,
                                const PixelShader::Halves& halves, bool evaluates = true);
timing::WarpItem light_warp_item(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable,
                                 const Lighting& lighting, GbufferLayout layout, bool evaluates,
                                 const std::span<const std::uint32_t>* listed);

inline PixelShader::Halves halves_of(const ShadingSettings& settings) {
  return {settings.layout, settings.path == ShadingPath::kGbufferExternal, settings.further_words(),
          settings.keeps_emission()};
}

// Whether invocations on a drawable fill the G-buffer: all others have one shader.
bool fills_gbuffer(const scene::PosedDrawable& drawable, const PixelShader::Halves& halves);

// The same for vertices that pixels of the drawable interpolate.
timing::WarpItem vertex_warp_item(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable);

// The same for samples that see the environment: its image, or the built-in one. `turning`: the camera turns.
timing::WarpItem background_item(bool image, bool turning);

}  // namespace tessera::tilecore
