#include "gpu/settings.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/text.h"

namespace tessera::gpu {

namespace {

using Keys = std::vector<Key<RunSettings>>;

Keys accuracy_keys() {
  using S = RunSettings;
  return {
      {"sampling.samples_per_pixel", &S::samples_per_pixel, "samples", 1, 64,
       "Visibility samples per pixel; the same as --spp."},
      {"sampling.seed", &S::seed, "", 0, 4294967295.0,
       "Chooses among equally good sample patterns; the same as --seed."},
      {"sampling.temporal_pattern",
       &S::temporal_pattern,
       {"8x8", "32x32"},
       "Pixels after which the pattern of sample times repeats; the larger one shows less of itself and is slower to "
       "replay."},
      {"sampling.time_bits",
       &S::time_bits,
       {"8", "16"},
       "Precision of a sample's time; the stencil unit sees the upper 8 bits."},
      {"sampling.lens_points", &S::lens_points, "points", 0, 65536,
       "Distinct points of the lens that a frame is seen through; few of them show as overlaid sharp images. 0: a "
       "point of its own for every sample of the pattern, "
       "moved from block to block."},
      {"tessellation.target_edge_pixels", &S::target_edge_pixels, "pixels", 0.25, 64,
       "Wanted length on screen of the sides of tessellated cells; smaller is more exact and slower."},
      {"tessellation.displacement_bias", &S::displacement_bias, "levels", -16, 16,
       "Added to the level of the height map that vertices and normals are made from; 0 fits it to the tessellated "
       "cells, more is smoother, less aliases."},
      {"shading.rate",
       &S::shading_rate,
       {"pixel", "sample", "cache"},
       "Pixel-shader invocations: once per pixel and surface (multisampling), once per visible sample, or once per "
       "cell of the surface about a pixel wide, "
       "while the shading cache holds it."},
      {"shading.cell_pixels", &S::shading_cell_pixels, "pixels", 0.125, 16,
       "With shading.rate=cache: wanted width of a shading cell on screen; smaller is sharper and slower."},
      {"shading.attributes",
       &S::shading_attributes,
       {"float", "half"},
       "Precision of interpolated attributes (texture coordinates, colours, normals) on their way to the pixel shader: "
       "single, or half as in GLSL's mediump."},
  };
}

Keys effect_keys() {
  using S = RunSettings;
  return {
      {"effects.motion",
       &S::motion,
       {"auto", "on", "off"},
       "Motion blur: what the capture asks for; the general kernels everywhere (same image); none."},
      {"effects.defocus",
       &S::defocus,
       {"auto", "on", "off"},
       "Defocus blur: what the capture's lens asks for; the general kernels everywhere (same image); none."},
      {"effects.displacement",
       &S::displacement,
       {"auto", "on", "off"},
       "Displacement: where the capture's maps are not zero; wherever it has maps (same image); none."},
      {"effects.alpha_test",
       &S::alpha_test,
       {"auto", "on", "off"},
       "Alpha test: where a masked material may be transparent; all over it (same image); none, masked surfaces are "
       "opaque."},
      {"effects.blending",
       &S::blending,
       {"auto", "off"},
       "Blending: what the capture asks for; none, blended surfaces are opaque."},
      {"effects.procedures", &S::procedures, {"auto", "off"}, "Procedures: what the capture has; none."},
  };
}

Keys procedure_keys() {
  using S = RunSettings;
  return {
      {"procedures.path",
       &S::procedures_path,
       {"sampled", "tessellated"},
       "How procedures are drawn: by the sampling controller, or as ordinary patches whose vertices the procedure "
       "evaluates."},
      {"procedures.maps",
       &S::procedures_maps,
       {"interval", "published"},
       "Sparse pass of the sampling controller: cells bounded by interval evaluation, or one tuple per cell and a "
       "padded radius."},
      {"procedures.scatter",
       &S::procedures_scatter,
       {"footprint", "point"},
       "What a sample writes: the sample points inside its footprint, or, as published, the sub-pixel it falls into "
       "(still objects only)."},
      {"procedures.style",
       &S::procedures_style,
       {"surface", "lines"},
       "Shaded surfaces, or a drawing with lines along the parameters."},
      {"procedures.spacing", &S::procedures_spacing, "sub-pixels", 0.125, 64,
       "Samples are so dense that no footprint reaches farther than this from its middle; smaller is more exact and "
       "slower."},
      {"procedures.cell_pixels", &S::procedures_cell_pixels, "pixels", 1, 512,
       "Interval maps: cells of the parameter domain larger than this on screen are halved."},
      {"procedures.padding", &S::procedures_padding, "", 0, 16,
       "Published maps: padding of a cell's place on screen, in its radius."},
      {"procedures.sparse_spacing", &S::procedures_sparse_spacing, "sub-pixels", 0.5, 256,
       "Published maps: distance of the tuples of the sparse pass."},
      {"procedures.refill", &S::procedures_refill,
       "Look for holes between samples, tile by tile, and sample them again; for spacings too wide for the scatter."},
      {"procedures.lanes", &S::procedures_lanes, "lanes", 1, 1024, "Lanes of the emulated SIMD array."},
  };
}

Keys resolve_keys() {
  using S = RunSettings;
  return {
      {"resolve.desampling",
       &S::desampling,
       {"off", "adaptive", "fixed_8", "fixed_4", "checkerboard"},
       "Which pixels are shaded: all; by motion, edges and history; half or a quarter of every block; half, "
       "alternating, filled from four neighbours. "
       "The others are advected or reconstructed."},
      {"resolve.k_stat", &S::k_stat, "pixels/frame", 0, 64,
       "Blocks slower than this take half of their pixels from the previous frame."},
      {"resolve.k_fast1", &S::k_fast1, "pixels/frame", 0, 1e6, "Blocks faster than this are shaded at 8 of 16 pixels."},
      {"resolve.k_fast2", &S::k_fast2, "pixels/frame", 0, 1e6, "Blocks faster than this are shaded at 4 of 16 pixels."},
      {"resolve.hysteresis", &S::hysteresis, "", 0, 0.5,
       "Share of a threshold by which a speed must pass it before a block changes its regime."},
      {"resolve.block_speed",
       &S::block_speed,
       {"mean", "max", "median", "min"},
       "Which of its pixels' speeds a block goes by; max does not overlook a small fast object."},
      {"resolve.edges",
       &S::edges,
       {"inverse_depth", "depth"},
       "What the edge detector takes the Laplacian of; that of 1/z is zero on any plane."},
      {"resolve.edge_threshold", &S::edge_threshold, "", 0, 10,
       "An edge where the Laplacian is larger than this share of the value."},
      {"resolve.edge_evidence",
       &S::edge_evidence,
       {"surface", "patch", "depth"},
       "What makes an edge besides the Laplacian: samples of a block that see several drawables; or several base "
       "patches; or nothing."},
      {"resolve.supersampling", &S::supersampling,
       "Blocks with an edge are shaded at 32 instead of 16: the left and the right half of a pixel's samples do not "
       "share pixel-shader invocations (shading.rate=pixel)."},
      {"resolve.advect_still_edges", &S::advect_still_edges,
       "Blocks with an edge of which every sample is at rest may be advected: the copies are exact."},
      {"resolve.dither",
       &S::dither,
       {"counter", "seeded", "off"},
       "How the pattern of a block changes from frame to frame: in turn, by a hash, not at all."},
      {"resolve.dither_per_block", &S::dither_per_block, "Every block begins elsewhere in the order of patterns."},
      {"resolve.advection", &S::advection, "Slow blocks take pixels from the previous frame."},
      {"resolve.advection_fetch",
       &S::advection_fetch,
       {"bilinear", "bicubic"},
       "How the previous frame is read between its pixels."},
      {"resolve.bfecc", &S::bfecc, "Back and forth error compensation of advection."},
      {"resolve.depth_tolerance", &S::depth_tolerance, "", 0, 1,
       "Share of its depth by which a point may differ from what the previous frame shows in its place."},
      {"resolve.discrepancy",
       &S::discrepancy,
       {"rendered", "neighbours", "off"},
       "How a block finds out that advection went wrong: what it would have given for rendered pixels, or advected "
       "pixels against their rendered neighbours."},
      {"resolve.discrepancy_tolerance", &S::discrepancy_tolerance, "", 0, 1,
       "Mean relative difference from which on it did."},
      {"resolve.discrepancy_frames", &S::discrepancy_frames, "frames", 1, 15,
       "For which its neighbourhood is then rendered fully."},
      {"resolve.reconstruction",
       &S::reconstruction,
       {"cubic", "cubic_interpolating", "cubic_unscaled", "bilinear", "nearest"},
       "How missing pixels are made from rendered ones: cubic stencils of 5x5 scaled to the samples, of 7x7 "
       "interpolating, unscaled; a tent; the nearest."},
      {"resolve.stencil_weights",
       &S::stencil_weights,
       {"packed", "float"},
       "Weights from packed tables of 8 bits, or computed in single precision."},
      {"resolve.stencil_clamp", &S::stencil_clamp,
       "Reconstructed pixels stay within the range of the pixels that they are made from."},
      {"resolve.stencil_reach",
       &S::stencil_reach,
       {"tile", "neighbours"},
       "Whether stencils stop at the tile's border, or read neighbouring tiles in a second pass."},
      {"resolve.foveation_r0", &S::foveation_r0, "pixels", 0, 1e6,
       "Foveation: blocks farther than this from the focus get at most 8 samples; 0 is off."},
      {"resolve.foveation_r1", &S::foveation_r1, "pixels", 0, 1e6,
       "Foveation: blocks farther than this get at most 4; at least foveation_r0."},
      {"resolve.focus_x", &S::focus_x, "frame widths", 0, 1, "Where the eye looks, from the left."},
      {"resolve.focus_y", &S::focus_y, "frame heights", 0, 1, "Where the eye looks, from the top."},
  };
}

Keys output_keys() {
  using S = RunSettings;
  return {
      {"stereo.eye_separation", &S::eye_separation, "scene units", 0, 1e6,
       "Renders a second image for a right eye this far to the right of the camera, which is the left eye; 0 is one "
       "eye."},
      {"stereo.far_depth", &S::far_depth, "scene units", 0, 1e9,
       "With desampling the right eye takes pixels from the left where both see farther than this."},
      {"output.machine_model", &S::machine_model,
       "Whether texture caches, cycles and energy are modelled; without, their counters and the members timing and "
       "energy are absent."},
      {"output.exposure", &S::exposure, "", 0, 1e6,
       "Factor on light before the PNG's tone map; 0 takes the capture's."},
  };
}

}  // namespace

const KeyTable<RunSettings>& settings_keys() {
  static const KeyTable<RunSettings> table([] {
    Keys all;
    for (const Keys& group : {accuracy_keys(), effect_keys(), procedure_keys(), resolve_keys(), output_keys()})
      all.insert(all.end(), group.begin(), group.end());
    return all;
  }());
  return table;
}

nlohmann::json settings_json(const RunSettings& settings) {
  nlohmann::json out = nlohmann::json::object();
  for (const auto& key : settings_keys().keys())
    out[std::string(key.name)] = key_value_json(settings_keys().value(settings, key));
  return out;
}

tilecore::ProcedureSettings procedure_settings(const RunSettings& settings) {
  using S = tilecore::ProcedureSettings;
  S out;
  out.maps = settings.procedures_maps == "published" ? S::Maps::kPublished : S::Maps::kInterval;
  out.scatter = settings.procedures_scatter == "point" ? S::Scatter::kPoint : S::Scatter::kFootprint;
  out.style = settings.procedures_style == "lines" ? S::Style::kLines : S::Style::kSurface;
  out.spacing = settings.procedures_spacing;
  out.cell_pixels = settings.procedures_cell_pixels;
  out.padding = settings.procedures_padding;
  out.sparse_spacing = settings.procedures_sparse_spacing;
  out.refill = settings.procedures_refill;
  out.lanes = static_cast<int>(settings.procedures_lanes);
  return out;
}

const std::vector<std::string>& known_keys() {
  static const std::vector<std::string> kKnown = [] {
    std::vector<std::string> known;
    for (const auto& k : settings_keys().keys()) known.emplace_back(k.name);
    for (const auto& k : hardware::gpu_keys().keys()) known.emplace_back(k.name);
    return known;
  }();
  return kKnown;
}

void set_key(const std::string& name, const nlohmann::json& value, RunSettings& settings,
             hardware::GpuConfiguration& gpu) {
  if (const auto* key = settings_keys().find(name))
    settings_keys().set(settings, *key, value);
  else if (const auto* gpu_key = hardware::gpu_keys().find(name))
    hardware::gpu_keys().set(gpu, *gpu_key, value);
  else
    throw UsageError(unknown_key_message(name, known_keys()));
}

void apply_setting(const std::string& text, RunSettings& settings, hardware::GpuConfiguration& gpu) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    throw UsageError(fmt::format("--set {}: expected KEY=VALUE", escape_control(text, 80)));
  set_key(text.substr(0, equals), text.substr(equals + 1), settings, gpu);
}

}  // namespace tessera::gpu
