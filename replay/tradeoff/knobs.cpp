#include "replay/tradeoff/knobs.h"

#include <algorithm>
#include <initializer_list>

#include <fmt/format.h>

#include "base/error.h"
#include "base/key_table.h"
#include "scene/light_views.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

std::string text_of(const json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

// Settings of one key, labelled by their values.
std::vector<KnobSetting> values_of(const std::string& key, std::initializer_list<json> values,
                                   const std::string& unit = "") {
  std::vector<KnobSetting> settings;
  for (const json& value : values) settings.push_back({text_of(value) + unit, {{key, value}}});
  return settings;
}

std::size_t position(std::vector<KnobSetting>& settings, const std::string& label) {
  const auto at =
      std::find_if(settings.begin(), settings.end(), [&](const KnobSetting& s) { return s.label == label; });
  return static_cast<std::size_t>(at - settings.begin());
}

Knob knob(std::string name, std::string title, std::vector<KnobSetting> settings, const std::string& against,
          KnobNeed need = KnobNeed::kNothing) {
  Knob out;
  out.name = std::move(name);
  out.title = std::move(title);
  out.need = need;
  out.against = position(settings, against);
  out.settings = std::move(settings);
  return out;
}

Knob without_image(Knob knob, std::string watched, std::string watched_as) {
  knob.visual = false;
  knob.watched = std::move(watched);
  knob.watched_as = std::move(watched_as);
  return knob;
}

Knob watching(Knob knob, std::string watched, std::string watched_as) {
  knob.watched = std::move(watched);
  knob.watched_as = std::move(watched_as);
  return knob;
}

Knob over_frames(Knob knob, KeyValues context) {
  knob.context = std::move(context);
  for (KnobSetting& setting : knob.settings) setting.goes_on = true;
  knob.watched = "tilecore.pixel_shader_invocations";
  knob.watched_as = "pixel-shader invocations";
  return knob;
}

std::vector<Knob> sampling_knobs() {
  // The small pattern has no more times than 8 bits tell apart.
  Knob time_bits = knob("time_bits", "bits of a sample's time", values_of("sampling.time_bits", {"8", "16"}, " bits"),
                        "8 bits", KnobNeed::kMotion);
  time_bits.context = {{"sampling.temporal_pattern", "32x32"}};
  return {
      knob("samples", "samples per pixel", values_of("sampling.samples_per_pixel", {1, 2, 4, 8, 16, 32, 64}), "4"),
      knob("temporal_pattern", "temporal pattern", values_of("sampling.temporal_pattern", {"8x8", "32x32"}), "8x8",
           KnobNeed::kMotion),
      time_bits,
      knob("motion_segments", "motion segments",
           {{"1", {{"sampling.motion_segments", 1}}},
            {"2", {{"sampling.motion_segments", 2}}},
            {"4", {{"sampling.motion_segments", 4}}},
            {"8", {{"sampling.motion_segments", 8}}},
            {"16", {{"sampling.motion_segments", 16}}},
            {"a quarter of a pixel off", {{"sampling.motion_segments", 0}}}},
           "a quarter of a pixel off", KnobNeed::kCurves),
  };
}

std::vector<Knob> geometry_knobs() {
  return {
      watching(knob("edge", "target edge length",
                    values_of("tessellation.target_edge_pixels", {1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 16.0}, " px"), "3.0 px",
                    KnobNeed::kGrids),
               "tilecore.triangles", "triangles"),
      knob("displacement", "displacement filter",
           values_of("tessellation.displacement_bias", {-2, -1, 0, 1, 2, 3}, " levels"), "0 levels",
           KnobNeed::kDisplacement),
      knob("geometry", "geometry in memory",
           {{"raw", {{"geometry.encoding", "raw"}}},
            {"quantised, 16 bits", {{"geometry.encoding", "quantised"}, {"geometry.bits", 16}}},
            {"quantised, 12 bits", {{"geometry.encoding", "quantised"}, {"geometry.bits", 12}}},
            {"meshlet, 16 bits", {{"geometry.encoding", "meshlet"}, {"geometry.bits", 16}}},
            {"meshlet, 12 bits", {{"geometry.encoding", "meshlet"}, {"geometry.bits", 12}}},
            {"meshlet, 10 bits", {{"geometry.encoding", "meshlet"}, {"geometry.bits", 10}}},
            {"meshlet, 8 bits", {{"geometry.encoding", "meshlet"}, {"geometry.bits", 8}}},
            {"dgf, 16 bits", {{"geometry.encoding", "dgf"}, {"geometry.bits", 16}}},
            {"dgf, 12 bits", {{"geometry.encoding", "dgf"}, {"geometry.bits", 12}}}},
           "raw", KnobNeed::kMeshes),
      without_image(knob("bound_method", "bounding method",
                         values_of("frontend.bound_method", {"aabb", "obb", "tpatch", "npatch", "interval"}), "npatch",
                         KnobNeed::kGrids),
                    "binner.queue_bytes_peak", "bytes of tile lists"),
      without_image(knob("split_depth", "split depth", values_of("frontend.split_depth", {0, 2, 4, 8, 12}), "8"),
                    "binner.queue_bytes_peak", "bytes of tile lists"),
  };
}

// Attributes that lose bits when a capture is packed. The machine's memory holds decoded vertices: its costs stay.
Knob packing_knob(const char* name, const char* title, bool meshopt, std::initializer_list<int> bits) {
  std::vector<KnobSetting> settings = {{"as the file is", {}}};
  for (const int b : bits) settings.push_back({fmt::format("{} bits", b), {}, false, {meshopt, b}});
  return watching(knob(name, title, settings, "as the file is", KnobNeed::kMeshes), "capture.file_bytes",
                  "bytes of the capture's files");
}
std::vector<Knob> packing_knobs() {
  return {packing_knob("draco_bits", "bits of attributes, by Draco", false, {8, 10, 11, 12, 14, 16}),
          packing_knob("meshopt_bits", "bits of attributes, by meshoptimizer", true, {8, 10, 12, 14, 16})};
}

std::vector<Knob> procedure_knobs() {
  return {
      knob("procedure_path", "how procedures are drawn", values_of("procedures.path", {"sampled", "tessellated"}),
           "sampled", KnobNeed::kProcedures),
      watching(knob("procedure_spacing", "spacing of procedures' samples",
                    values_of("procedures.spacing", {0.5, 1.0, 2.0, 4.0, 8.0}, " sub-pixels"), "4.0 sub-pixels",
                    KnobNeed::kProcedures),
               "procedures.samples", "samples of procedures"),
      watching(knob("procedure_flatness", "flatness of procedures' footprints",
                    values_of("procedures.flatness", {0.015625, 0.03125, 0.0625, 0.125, 0.25}, " px"), "0.0625 px",
                    KnobNeed::kProcedures),
               "procedures.samples", "samples of procedures"),
      watching(knob("procedure_cells", "cells of procedures' maps",
                    values_of("procedures.cell_pixels", {7.0, 14.0, 20.0, 28.0, 56.0}, " px"), "28.0 px",
                    KnobNeed::kProcedures),
               "procedures.cells", "cells"),
  };
}

std::vector<Knob> shading_knobs() {
  std::vector<KnobSetting> shading = values_of("shading.rate", {"sample", "pixel"});
  for (const double cell : {0.5, 1.0, 2.0})
    shading.push_back(
        {fmt::format("cache, cells of {} px", cell), {{"shading.rate", "cache"}, {"shading.cell_pixels", cell}}});
  Knob arithmetic =
      knob("arithmetic", "arithmetic of the datapath",
           {{"double", {}, true},
            {"float, 8 sub-pixel bits", {{"tessellator.subpixel_bits", 8}, {"shading.attributes", "float"}}},
            {"half-precision attributes", {{"shading.attributes", "half"}}},
            {"6 sub-pixel bits", {{"tessellator.subpixel_bits", 6}}},
            {"5 sub-pixel bits", {{"tessellator.subpixel_bits", 5}}},
            {"4 sub-pixel bits", {{"tessellator.subpixel_bits", 4}}},
            {"half attributes, 4 sub-pixel bits", {{"shading.attributes", "half"}, {"tessellator.subpixel_bits", 4}}}},
           "float, 8 sub-pixel bits");
  // The settings with which the renderer in double precision shades and draws procedures.
  arithmetic.context = {
      {"shading.rate", "sample"}, {"shading.surface", "evaluated"}, {"procedures.path", "tessellated"}};
  return {arithmetic,
          watching(knob("shading", "shading mode", shading, "pixel"), "tilecore.pixel_shader_invocations",
                   "pixel-shader invocations"),
          watching(knob("surface", "surface that pixels shade",
                        values_of("shading.surface", {"evaluated", "interpolated", "frame"}), "interpolated",
                        KnobNeed::kGrids),
                   "tilecore.surface_evaluations", "evaluations of patches by pixels"),
          knob("weight_bits", "bits of a sample's weights",
               values_of("tilecore.weight_bits", {8, 10, 12, 16, 24}, " bits"), "16 bits")};
}

// Knobs of the lights' shadow maps.
std::vector<Knob> shadow_knobs() {
  const auto maps = [](const char* name, const char* title, const std::string& key,
                       std::initializer_list<json> values) {
    std::vector<KnobSetting> settings = {{"as the capture says", {{key, 0}}}};
    for (KnobSetting& setting : values_of(key, values)) settings.push_back(std::move(setting));
    return watching(knob(name, title, std::move(settings), "as the capture says", KnobNeed::kShadows),
                    "shadows.texels_stored", "texels of maps");
  };
  return {
      maps("shadow_size", "texels along the sides of maps", "shadows.size", {256, 512, 1024, 2048, 4096}),
      maps("shadow_cascades", "maps of a directional light", "shadows.cascades", {1, 2, 3, 4, 6}),
      knob("shadow_filter", "filter of shadows", values_of("shadows.filter", {"nearest", "2x2", "3x3"}), "2x2",
           KnobNeed::kShadows),
      watching(knob("shadow_times", "times of maps", values_of("shadows.times", {1, 2, 4, 8, 16}), "1",
                    KnobNeed::kMovingShadows),
               "shadows.texels_stored", "texels of maps"),
      knob("shadow_grids", "grids in maps", values_of("shadows.grids", {"light", "camera"}), "camera",
           KnobNeed::kShadows),
      knob("shadow_format", "format of maps", values_of("shadows.format", {"d16", "d24", "d32f"}), "d32f",
           KnobNeed::kShadows),
  };
}

std::vector<Knob> texture_knobs() {
  return {watching(knob("texture_format", "blocks of textures",
                        values_of("texture.format", {"stored", "etc2", "astc-4x4", "astc-5x5", "astc-6x6", "astc-8x8",
                                                     "astc-10x10", "astc-12x12"}),
                        "stored", KnobNeed::kTextures),
                   "texture.cache_misses", "lines that missed the texture cache")};
}

std::vector<Knob> frame_buffer_knobs() {
  const auto held_as = [](const char* format) {
    return KnobSetting{fmt::format("{}, lossless", format),
                       {{"frame_buffer.format", format}, {"frame_buffer.compression", "lossless"}}};
  };
  Knob formats =
      watching(knob("frame_buffer", "frame buffer",
                    {held_as("rgba8"),
                     {"rgba8", {{"frame_buffer.format", "rgba8"}, {"frame_buffer.compression", "none"}}},
                     held_as("rgb10a2"),
                     held_as("rgba16f"),
                     {"rgba16f", {{"frame_buffer.format", "rgba16f"}, {"frame_buffer.compression", "none"}}}},
                    "rgba8, lossless"),
               "dram.resolve.frame_buffer.written_bytes", "bytes of the frame buffer");
  formats.stored = true;
  return {formats};
}

std::vector<Knob> resolve_knobs() {
  const KeyValues adaptive = {{"resolve.desampling", "adaptive"}};
  std::vector<KnobSetting> speeds;
  for (const double slow : {0.0, 0.25, 0.5, 1.0, 2.0})
    speeds.push_back({fmt::format("below {} px", slow), {{"resolve.reuse_speed", slow}}});
  std::vector<KnobSetting> fast = {
      {"8 of 16 from 2 px, 4 from 8 px", {{"resolve.half_rate_speed", 2}, {"resolve.quarter_rate_speed", 8}}},
      {"8 of 16 from 4 px, 4 from 16 px", {{"resolve.half_rate_speed", 4}, {"resolve.quarter_rate_speed", 16}}},
      {"8 of 16 from 8 px, 4 from 32 px", {{"resolve.half_rate_speed", 8}, {"resolve.quarter_rate_speed", 32}}},
      {"never", {{"resolve.half_rate_speed", 1000000}, {"resolve.quarter_rate_speed", 1000000}}}};
  std::vector<KnobSetting> advection = {
      {"no advection", {{"resolve.advection", false}}},
      {"bilinear", {{"resolve.advection_fetch", "bilinear"}, {"resolve.bfecc", false}}},
      {"bicubic", {{"resolve.advection_fetch", "bicubic"}, {"resolve.bfecc", false}}},
      {"bilinear, BFECC", {{"resolve.advection_fetch", "bilinear"}, {"resolve.bfecc", true}}},
      {"bicubic, BFECC", {{"resolve.advection_fetch", "bicubic"}, {"resolve.bfecc", true}}}};
  const std::vector<KnobSetting> filters = values_of("resolve.reconstruction", {"nearest", "bilinear", "cubic"});
  Knob half = watching(knob("reconstruction", "reconstruction of 8 of 16", filters, "cubic"),
                       "timing.units.resolve.busy_cycles", "resolve cycles");
  half.context = {{"resolve.desampling", "fixed_8"}};
  Knob quarter = watching(knob("reconstruction_4", "reconstruction of 4 of 16", filters, "cubic"),
                          "timing.units.resolve.busy_cycles", "resolve cycles");
  quarter.context = {{"resolve.desampling", "fixed_4"}};
  Knob desampling =
      watching(knob("desampling", "desampling",
                    values_of("resolve.desampling", {"off", "adaptive", "fixed_8", "checkerboard", "fixed_4"}), "off"),
               "tilecore.pixel_shader_invocations", "pixel-shader invocations");
  desampling.settings[position(desampling.settings, "adaptive")].goes_on = true;
  return {
      desampling,
      over_frames(knob("still_threshold", "threshold of slow blocks", speeds, "below 2 px"), adaptive),
      over_frames(
          knob("fast_thresholds", "rates of fast blocks", fast, "8 of 16 from 2 px, 4 from 8 px", KnobNeed::kNothing),
          adaptive),
      over_frames(knob("edge_threshold", "threshold of edges",
                       values_of("resolve.edge_threshold", {0.001, 0.01, 0.1, 1.0}), "0.01"),
                  adaptive),
      over_frames(knob("advection", "advection", advection, "bilinear"), adaptive),
      half,
      quarter,
  };
}

// Models of the same machine, the finest first: they read different parts of a record.
Knob timing_knob(const char* name, const char* title, std::vector<KnobSetting> settings) {
  Knob out = knob(name, title, std::move(settings), "");
  out.against = 0;
  out.visual = false;
  out.timed = true;
  out.context = {{"machine.timing", "events"}, {"memory.model", "banks"}, {"shader.costs", "compiled"}};
  return out;
}

// Registers for any number of warps are an idealisation of the model: they take no silicon, so they do not leak.
KnobSetting with_registers_for_all(const char* label, KeyValues more) {
  KnobSetting setting{label, {{"shader.register_bytes", 67108864}}};
  setting.values.insert(setting.values.end(), more.begin(), more.end());
  setting.ideal_registers = true;
  return setting;
}

std::vector<Knob> timing_knobs() {
  return {
      timing_knob("timing", "timing of a frame",
                  {{"every item an event", {{"machine.timing", "events"}}},
                   {"fluid memory", {{"memory.model", "fluid"}}},
                   {"fluid memory, constant shaders", {{"memory.model", "fluid"}, {"shader.costs", "constant"}}},
                   {"phases of tiles", {{"machine.timing", "phases"}}}}),
      timing_knob("memory_model", "model of the memory", values_of("memory.model", {"banks", "fluid"})),
      timing_knob("shader_costs", "costs of shaders", values_of("shader.costs", {"compiled", "constant"})),
      timing_knob("warps", "warps in flight, where registers beyond the machine's take no silicon",
                  {{"as registers and slots allow", {}},
                   with_registers_for_all("as slots allow", {}),
                   with_registers_for_all("any number", {{"shader.max_warps", 4096}})}),
      timing_knob(
          "requests", "requests under way",
          {{"bounded", {}},
           {"any number", {{"texture.requests", 4096}, {"l2.requests", 65536}, {"tilecore.fetched_lines", 65536}}},
           {"any number, caches without latency",
            {{"texture.requests", 4096},
             {"l2.requests", 65536},
             {"tilecore.fetched_lines", 65536},
             {"texture.latency_clk", 0},
             {"l2.latency_clk", 0}}}}),
  };
}

bool any_drawable(const scene::FrameGeometry& frame, bool (*has)(const scene::PosedDrawable&)) {
  return std::any_of(frame.drawables.begin(), frame.drawables.end(), has);
}

bool has_texture(const scene::Material& m) {
  const auto slots = m.slots();
  return std::any_of(slots.begin(), slots.end(), [](const auto* slot) { return slot->texture != nullptr; });
}

}  // namespace

const std::vector<Knob>& knobs() {
  static const std::vector<Knob> kKnobs = [] {
    std::vector<Knob> all;
    for (auto make : {sampling_knobs, geometry_knobs, packing_knobs, procedure_knobs, shading_knobs, shadow_knobs,
                      texture_knobs, frame_buffer_knobs, resolve_knobs, timing_knobs})
      for (Knob& k : make()) all.push_back(std::move(k));
    return all;
  }();
  return kKnobs;
}

const Knob& knob_named(const std::string& name) {
  std::vector<std::string> names;
  for (const Knob& knob : knobs()) {
    if (knob.name == name) return knob;
    names.push_back(knob.name);
  }
  throw UsageError(unknown_key_message(name, names));
}

bool uses_history(const Knob& knob) {
  return std::any_of(knob.settings.begin(), knob.settings.end(), [](const KnobSetting& s) { return s.goes_on; });
}

std::string why_without_effect(const Knob& knob, const scene::FrameGeometry& frame, bool history) {
  const auto displaces = [](const scene::PosedDrawable& d) {
    return d.material->displacement.has_value() && d.drawable->kind == scene::Primitive::Kind::kBezierPatches;
  };
  const bool casts = std::ranges::count(frame.light_casts, true) > 0;
  switch (knob.need) {
    case KnobNeed::kMotion:
      if (!frame.any_motion) return "nothing moves while the shutter is open";
      break;
    case KnobNeed::kCurves:
      if (frame.segments.empty()) return "nothing moves along a curve while the shutter is open";
      break;
    case KnobNeed::kDisplacement:
      if (!any_drawable(frame, displaces)) return "nothing is displaced";
      break;
    case KnobNeed::kGrids:
      if (!any_drawable(frame, [](const scene::PosedDrawable& d) { return scene::has_grid(*d.drawable); }))
        return "nothing is tessellated: the capture has triangle meshes only";
      break;
    case KnobNeed::kProcedures:
      if (!any_drawable(frame, [](const scene::PosedDrawable& d) { return d.procedure != nullptr; }))
        return "the capture has no procedures";
      break;
    case KnobNeed::kTextures:
      if (!any_drawable(frame, [](const scene::PosedDrawable& d) { return has_texture(*d.material); }))
        return "the capture has no textures";
      break;
    case KnobNeed::kMeshes:
      if (!any_drawable(frame, [](const scene::PosedDrawable& d) { return d.procedure == nullptr; }))
        return "the capture has no meshes";
      break;
    case KnobNeed::kShadows:
      if (!casts) return "no light casts shadows";
      break;
    case KnobNeed::kMovingShadows:
      if (!casts) return "no light casts shadows";
      if (scene::shadow_times(frame, {}).empty()) return "nothing but the camera moves while the shutter is open";
      break;
    case KnobNeed::kNothing:
      break;
  }
  const auto goes_on = [](const KnobSetting& setting) { return setting.goes_on; };
  if (!history && std::all_of(knob.settings.begin(), knob.settings.end(), goes_on))
    return "there is no frame before this one to go on from";
  return "";
}

void apply(const KeyValues& values, gpu::RunSettings& settings, gpu::GpuConfiguration& gpu) {
  // The context of a knob holds keys that some of its settings do not read.
  const std::vector<std::string> set_by_people = gpu.set_keys;
  for (const auto& [key, value] : values) gpu::set_key(key, value, settings, gpu);
  gpu.set_keys = set_by_people;
}

void keep_register_silicon(const gpu::GpuConfiguration& gpu, KeyValues& values) {
  gpu::RunSettings settings;
  gpu::GpuConfiguration changed = gpu;
  apply(values, settings, changed);
  values.emplace_back("area.register_mm2_per_kib", gpu.silicon.register_mm2_per_kib *
                                                       static_cast<double>(gpu.queues.register_bytes) /
                                                       static_cast<double>(changed.queues.register_bytes));
}

std::string as_arguments(const KeyValues& values) {
  std::string text;
  for (const auto& [key, value] : values)
    text += fmt::format("{}--set {}={}", text.empty() ? "" : " ", key, text_of(value));
  return text;
}

}  // namespace tessera::replay
