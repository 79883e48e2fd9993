#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/counter.h"
#include "scene/drawable_lookup.h"
#include "tilecore/drawable_counts.h"
#include "tilecore/frame_targets.h"
#include "tilecore/resolve/stored_texels.h"
#include "tilecore/shading/fragment_merger.h"
#include "tilecore/shading/layer_merge.h"
#include "tilecore/shading/pixel_shader.h"
#include "tilecore/shading/shading_cache.h"
#include "tilecore/shading/shading_cells.h"
#include "tilecore/shading/texture_unit.h"
#include "tilecore/shading/view_rays.h"
#include "tilecore/tile_job.h"
#include "tilecore/tile_state.h"
#include "tilecore/visibility/sample_pattern.h"

namespace tessera::tilecore {

struct ShadingCounters {
  std::uint64_t samples_visible = 0;
  std::uint64_t blended_layers = 0;
  std::uint64_t blend_overflows = 0;
  std::uint64_t pixel_shader_invocations = 0;
  std::uint64_t pixel_shader_invocations_saved = 0;
  std::uint64_t fragments_merged = 0;
  std::uint64_t warps = 0;
  std::uint64_t surface_evaluations = 0;
  std::uint64_t surface_warps = 0;
  std::uint64_t height_lookups = 0;
  std::uint64_t vertex_outputs = 0;
  std::uint64_t vertex_output_warps = 0;
  std::uint64_t vertex_output_bytes = 0;
  std::uint64_t places_found = 0;
  std::uint64_t background_samples = 0;
  std::uint64_t background_warps = 0;
  std::uint64_t quads = 0;
  std::uint64_t helper_invocations = 0;
};

// Deferred shading of one tile: runs the pixel shader for the surfaces that samples see, and composes blended layers
// over them. Keeps its scratch memory from tile to tile; one instance per thread.
//
// Invariants (cited by the tests):
//   DS1  Colours follow from the frame, the job's shading rate and blend_layers, and the surfaces at the samples of a pixel:
//        not from the order in which layers arrived, not from the tile, not from the shading cache's capacity or its
//        content.
//   DS2  Pixel-shader invocations, saved invocations and skipped samples add up to visible samples and blended layers.
class DeferredShader {
 public:
  // Colours every sample of the tile. `state` is the state after all entries of the tile; its layers are sorted, and
  // layers behind opaque surfaces are dropped. The shading cache is empty when the tile begins.
  // `rates`, unless empty, has a PixelRate for each pixel: with kHalvesApart each invocation is taken near the middle of
  // its half (with shading.rate=pixel or primitive; per sample and from the cache, this is the same as kTogether).
  void shade(const TileJob& job, const TileSamples& samples, TileState& state, std::span<const std::uint8_t> rates = {},
             shaders::RadianceImage* behind = nullptr);
  // Shades the skipped pixels with `mask` 1, as if they had not been skipped. Call it right after shade(), for the same
  // tile. Their shader invocations are warps of their own.
  void shade_again(const TileJob& job, const TileSamples& samples, TileState& state,
                   std::span<const std::uint8_t> mask);
  // Instead of shade(), with a G-buffer in memory: its two halves, one after the other for a tile. fill() says how many bytes of
  // the light list wait in memory with it.
  std::uint64_t fill(const TileJob& job, const TileSamples& samples, TileState& state);
  void light(const TileJob& job, const TileSamples& samples, TileState& state);
  // Call it after fill() and before light(): codes the filled G-buffer, plane by plane of gbuffer_format().
  void encode_gbuffer(const TileJob& job, const TileSamples& samples, const TileState& state,
                      TexelEncoder& encoder) const;
  // Leaves in `behind` the pixels of opaque surfaces, each the mean of its samples, as shade() does unless it is
  // nullptr.
  void shade_opaque(const TileJob& job, const TileSamples& samples, const TileState& state,
                    shaders::RadianceImage& behind);

  // Also counts the work of shade() for the drawable that causes it, until the next call; every drawable of the frame
  // has its place in `drawables`. Empty: does not count.
  void count_drawables(std::span<DrawableCounts> drawables) { drawables_ = drawables; }

  // Totals of skipped pixels since the last call: their samples that see a surface, and the pixel-shader invocations
  // that these would have taken (with shading.rate=cache: the lookups).
  struct Skipped {
    std::uint64_t samples = 0, invocations = 0;
  };
  Skipped take_skipped() { return std::exchange(skipped_, {}); }

  // The tile shaded last, natural order: linear colour with the background in it, and the covered share of each sample.
  std::span<Vec3> color() { return sample_color_; }
  std::span<float> coverage() { return sample_coverage_; }

  // Invocations for each pixel of the tile shaded last, row by row.
  std::span<const std::uint32_t> pixel_invocations() const { return pixel_invocations_; }

  // Writes depth, normal, patch and invocations of the tile shaded last.
  void write_auxiliary(const TileSamples& samples, const TileState& state, FrameTargets& targets) const;

  // Notes that a unit reads a base patch of the frame besides shade().
  void reads_patch(std::uint32_t patch) {
    if (patches_read_.empty() || patches_read_.back() != patch) patches_read_.push_back(patch);
  }
  // Base patches whose attributes were read since the last call, each once, in order of their numbers.
  std::vector<std::uint32_t> take_patches_read();

  // Bytes of vertices that pixels interpolated, since the last call.
  std::uint64_t take_vertex_bytes() { return std::exchange(vertex_bytes_, 0); }

  ShadingCounters take_counters() { return std::exchange(counters_, {}); }
  LightListCounters take_light_counters() { return pixel_shader_.take_light_counters(); }
  GbufferCounters take_gbuffer_counters() { return std::exchange(gbuffer_, {}); }
  // Chooses whether warps and the lines that they ask for are kept from now on.
  void keep_items(bool keep) { pixel_shader_.keep_warps(keep), textures_.keep_requests(keep); }
  std::vector<timing::WarpItem> take_warp_items() { return pixel_shader_.take_warp_items(); }
  // The unit that fetches for shading; its begin_tile() is called before a tile's first entries.
  TextureUnit& textures() { return textures_; }
  const TextureUnit& textures() const { return textures_; }

 private:
  // Layers of one pixel that share an invocation: of one triangle (and of one pixel of the resting image if drawables
  // move). Blended fragments are not merged.
  struct SharedLayer {
    std::uint32_t patch, triangle;
    int segment;  // of motion
    float cell_x, cell_y;
    float time_sum;
    std::uint32_t count;
    std::uint32_t point;  // kNone: not requested yet
  };
  // A fragment of a quad of blended fragments.
  struct LayerQuad {
    std::uint32_t block, patch, triangle, sample;  // the sample's number within its pixel if each sample is shaded
    std::uint32_t point;
    auto operator<=>(const LayerQuad&) const = default;
    bool same_quad(const LayerQuad& o) const {
      return block == o.block && patch == o.patch && triangle == o.triangle && sample == o.sample;
    }
  };
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  static constexpr std::size_t kBackgroundBatch = 256;

  void begin(const TileJob& job, const TileSamples& samples, std::span<const std::uint8_t> rates);
  void keep_behind(const TileSamples& samples, shaders::RadianceImage& image) const;
  // The steps: find the invocations, run all of them in warps, colour the samples.
  void collect_opaque(const TileJob& job, const TileSamples& samples, const TileState& state);
  // Collects the pixels that are shaded together: one, or the 2x2 of a quad.
  void collect_block(const TileJob& job, const TileSamples& samples, const TileState& state, int x, int y, int side);
  std::uint8_t rate_of(std::size_t pixel) const { return rates_.empty() ? std::uint8_t{kTogether} : rates_[pixel]; }
  // Takes back the skipped counts of a pixel that is shaded after all.
  void unskip(std::size_t samples, std::size_t invocations) {
    skipped_.samples -= samples, skipped_.invocations -= invocations;
  }
  void skip_pixel(const TileJob& job, const TileSamples& samples, const TileState& state, std::size_t pixel);
  void collect_cells(const TileJob& job, const TileSamples& samples, const TileState& state, std::size_t pixel);
  // Colours the samples of behind_ that look through segment `segment` of the shutter.
  void color_background(const TileJob& job, const TileSamples& samples, int segment);
  void collect_layers(const TileJob& job, const TileSamples& samples, TileState& state);
  void run_warps(const TileJob& job, const IntRect& pixels);
  void encode_exact(const TileSamples& samples, const TileState& state, TexelEncoder& encoder) const;
  void encode_packed(const TileJob& job, const TileSamples& samples, TexelEncoder& encoder) const;
  void fill_warps(const TileJob& job, const IntRect& pixels);
  void light_warps(const TileJob& job);
  void count_warps();
  void color_samples(const TileJob& job, const TileSamples& samples);
  void blend_layers(const TileJob& job, const TileState& state);
  // Finds the invocations that the layers of a pixel share, in shared_layers_ and shared_of_.
  void share_layers(const TileJob& job, const TileSamples& samples, std::span<const TileState::Layer> layers);
  void add_layer_quad(const TileJob& job, const TileSamples& samples, const TileState::Layer& layer,
                      std::uint32_t point);
  void number_layer_quads();
  // Returns the number of the layer's point.
  std::uint32_t ask_for_layer(const TileJob& job, const TileSamples& samples, const TileState::Layer& layer,
                              SharedLayer& shared, std::size_t pixel);
  // Adds an invocation, counted but not yet filled.
  Invocation& add_invocation(const TileJob& job, std::uint32_t patch, std::size_t pixel);
  // Returns the number of the point that the invocation will shade.
  std::uint32_t ask_for(const TileJob& job, const Invocation& invocation, std::size_t pixel);
  void set_partners(const TileJob& job, const TileSamples& samples, std::size_t pixel, bool rests,
                    Invocation& out) const;
  void count_visible(const TileJob& job, std::uint32_t patch) {
    if (!drawables_.empty()) ++drawables_[drawable_of(job, patch)].samples_visible;
  }
  std::uint32_t drawable_of(const TileJob& job, std::uint32_t patch) {
    return drawable_lookup_(*job.frame->assembly, patch);
  }
  // Returns the point of the location's shading cell: from the cache, or shaded for the requesting pixel.
  std::uint32_t ask_for_cell(const TileJob& job, const SurfaceLocation& at, std::size_t pixel);

  scene::DrawableLookup drawable_lookup_;
  std::vector<Vec3> sample_color_;  // natural order, opaque then blended
  std::vector<float> sample_coverage_;
  std::vector<Vec3> pixel_normal_;  // sums over the pixel's shaded points, or over its samples' cells
  std::vector<std::uint32_t> pixel_invocations_;
  std::span<const std::uint8_t> rates_;  // of the current tile
  bool again_ = false;                   // in shade_again(): the other pixels have been counted
  Skipped skipped_;
  std::vector<Vec3> first_color_, first_normal_;  // of shade(), for shade_again()
  std::vector<float> first_coverage_;
  std::vector<std::uint32_t> first_invocations_;
  std::vector<std::uint32_t> patches_read_;
  FragmentMerger merger_of_fragments_;
  PixelShader pixel_shader_;
  // The points of the tile's invocations: points_[kept_ + i], behind the points of cells that the cache may still hold.
  std::vector<Invocation> invocations_;
  std::vector<std::uint32_t> pixel_of_invocation_;
  std::vector<ShadedPoint> points_;
  std::size_t kept_ = 0, opaque_ = 0;
  std::uint32_t quads_ = 0;                  // of the tile
  std::vector<std::uint32_t> sample_point_;  // number of the opaque point that a sample sees; kNone
  std::vector<std::uint32_t> layer_point_;   // as state.layers; kNone if the pixel is skipped
  std::vector<ViewRays> view_rays_;          // of the whole shutter, of its segments
  std::vector<std::uint32_t> behind_;        // samples that see no opaque surface
  std::uint64_t vertex_bytes_ = 0;
  std::array<std::array<float, kBackgroundBatch>, 5> view_points_;  // as ViewRays::Points
  std::array<std::array<std::int32_t, kBackgroundBatch>, kLookupLines> background_lines_;
  std::vector<SharedLayer> shared_layers_;
  std::uint64_t layer_places_ = 0;  // places of shared_layers_
  std::vector<std::uint32_t> shared_of_;
  std::vector<LayerQuad> layer_quads_;
  std::vector<BlendedLayer> blended_;
  LayerMerger merger_;
  ShadingCells cells_;
  ShadingCache cache_;
  TextureUnit textures_;
  ShadingCounters counters_;
  GbufferCounters gbuffer_;
  std::span<DrawableCounts> drawables_;
};

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kCounterFields<tilecore::ShadingCounters> = std::to_array<
    CounterField<tilecore::ShadingCounters>>({
    {"tilecore.samples_visible", &tilecore::ShadingCounters::samples_visible, Combine::kSum, "samples",
     "Samples that see an opaque surface when the tile is finished.", ""},
    {"tilecore.blended_layers", &tilecore::ShadingCounters::blended_layers, Combine::kSum, "layers",
     "Blended surfaces that samples see in front of opaque ones.", ""},
    {"tilecore.blend_overflows", &tilecore::ShadingCounters::blend_overflows, Combine::kSum, "layers",
     "Blended surfaces merged with another because their sample had no room for them.", ""},
    {"tilecore.pixel_shader_invocations", &tilecore::ShadingCounters::pixel_shader_invocations, Combine::kSum,
     "invocations", "Pixel-shader invocations.",
     "MaliFragThread; Adreno fragments shaded; Apple and Vulkan fragment invocations"},
    {"tilecore.pixel_shader_invocations_saved", &tilecore::ShadingCounters::pixel_shader_invocations_saved,
     Combine::kSum, "invocations",
     "Visible samples and blended layers that took the result of another's pixel-shader invocation.", ""},
    {"tilecore.fragments_merged", &tilecore::ShadingCounters::fragments_merged, Combine::kSum, "fragments",
     "With shading.rate=pixel: fragments that take the result of an adjacent triangle's, in the same pixel.", ""},
    {"tilecore.warps", &tilecore::ShadingCounters::warps, Combine::kSum, "warps",
     "Warps of the pixel shader. Their lanes (shader.warp_lanes) without invocation are idle: the last ones of a "
     "tile's draw.",
     "MaliFragWarps; Adreno wave count"},
    {"tilecore.surface_evaluations", &tilecore::ShadingCounters::surface_evaluations, Combine::kSum, "invocations",
     "Pixel-shader invocations that evaluate their Bezier patch (displaced or not) or procedure again, for position "
     "and normal. The attributes that vertices would hand over follow from the patch.",
     ""},
    {"tilecore.surface_warps", &tilecore::ShadingCounters::surface_warps, Combine::kSum, "warps",
     "Warps of such invocations.", ""},
    {"tilecore.height_lookups", &tilecore::ShadingCounters::height_lookups, Combine::kSum, "lookups",
     "Bilinear lookups of heights by pixel-shader invocations that evaluate a displaced patch again, or for vertices "
     "that they interpolate.",
     ""},
    {"tilecore.vertex_outputs", &tilecore::ShadingCounters::vertex_outputs, Combine::kSum, "vertices",
     "With shading.surface=interpolated: vertices that cores evaluated for pixels to interpolate, each once for every "
     "tile that sees one of its triangles.",
     ""},
    {"tilecore.vertex_output_warps", &tilecore::ShadingCounters::vertex_output_warps, Combine::kSum, "warps",
     "Warps of such vertices.", ""},
    {"tilecore.vertex_output_bytes", &tilecore::ShadingCounters::vertex_output_bytes, Combine::kSum, "bytes",
     "Bytes of such vertices that were written to the tile memory, and read there for each of the three of an "
     "invocation.",
     ""},
    {"tilecore.places_found", &tilecore::ShadingCounters::places_found, Combine::kSum, "places",
     "Places on screen at shutter open that a core finds from the corners and weights of triangles, for samples and "
     "layers that see a moving or defocused surface.",
     ""},
    {"tilecore.background_samples", &tilecore::ShadingCounters::background_samples, Combine::kSum, "samples",
     "Samples that see the environment, which the shader computes for each. A uniform one, or a background of the "
     "capture's own, is no computation.",
     ""},
    {"tilecore.background_warps", &tilecore::ShadingCounters::background_warps, Combine::kSum, "warps",
     "Warps of such samples.", ""},
    {"tilecore.quads", &tilecore::ShadingCounters::quads, Combine::kSum, "quads",
     "With shading.derivatives=quad: quads of 2x2 pixel-shader invocations.",
     "MaliFragQuads; Adreno and Mesa fragment quads"},
    {"tilecore.helper_invocations", &tilecore::ShadingCounters::helper_invocations, Combine::kSum, "invocations",
     "With shading.derivatives=quad: invocations of quads for pixels that the surface does not cover. They take as "
     "much time of the shader core as others.",
     "Vulkan helper invocations"},
});
TESSERA_COUNTERS_COVER(tilecore::ShadingCounters);

}  // namespace tessera
