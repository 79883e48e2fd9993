#include "gpu/effect_report.h"

#include <algorithm>

#include <fmt/format.h>

#include "gpu/frame_counters.h"
#include "shaders_cpp/environment_image.h"

namespace tessera::gpu {
namespace {

using scene::AlphaMode;
using scene::PosedDrawable;

template <class Asks>
std::size_t count_drawables(const scene::FrameGeometry& frame, const Asks& asks) {
  return static_cast<std::size_t>(std::count_if(frame.drawables.begin(), frame.drawables.end(), asks));
}

std::uint64_t tiles_with(const TileMaps& maps, std::uint64_t TileCounts::*member) {
  return static_cast<std::uint64_t>(
      std::count_if(maps.tiles.begin(), maps.tiles.end(), [&](const TileCounts& tile) { return tile.*member > 0; }));
}

// Says why code for an effect of sub-patches ran or did not. `asked`: the part of the scene that asks for it; "" if no
// part does.
std::string sub_patch_reason(const std::string& setting, EffectMode value, const std::string& asked,
                             const std::string& none, const EffectPlaces& places, const char* spared) {
  if (value == EffectMode::kOff) return setting + "=off";
  if (value == EffectMode::kOn) return setting + "=on: everywhere" + (asked.empty() ? "; " + none : "; " + asked);
  if (asked.empty()) return none;
  if (places.sub_patches_elided == 0) return asked;
  if (places.sub_patches == 0) return fmt::format("{}, but {}", asked, spared);
  return fmt::format("{}; of {} of their sub-patches, {}", asked, places.sub_patches_elided, spared);
}

std::string who_moves(const scene::FrameGeometry& frame) {
  if (frame.request.open_time == frame.request.close_time) return "";
  const std::size_t moving = count_drawables(frame, [](const PosedDrawable& d) { return d.moving; });
  if (moving == 0) return "";
  const bool camera = frame.views[0].world_to_camera != frame.views[1].world_to_camera;
  std::string text = fmt::format("{}{} of {} drawables move on screen", camera ? "the camera moves, " : "", moving,
                                 frame.drawables.size());
  if (!frame.segments.empty())
    text += fmt::format(", {} along curves, in {} motion segments",
                        count_drawables(frame, [](const PosedDrawable& d) { return d.curved; }), frame.segments.size());
  return text;
}

std::string who_has(std::size_t drawables, const scene::FrameGeometry& frame, const char* what) {
  return drawables == 0 ? "" : fmt::format("{} of {} drawables {}", drawables, frame.drawables.size(), what);
}

}  // namespace

void MaterialPlaces::add(const MaterialPlaces& view) {
  for (std::size_t effect = 0; effect < sub_patches.size(); ++effect) sub_patches[effect] += view.sub_patches[effect];
  if (tiles.empty()) tiles.resize(view.tiles.size());
  for (std::size_t t = 0; t < view.tiles.size(); ++t) tiles[t] |= view.tiles[t];
}

void report_effects(const EffectSources& from, FrameEffects& effects, EffectReasons& reasons,
                    FrameEffectPlaces& places) {
  const scene::FrameGeometry& frame = from.frame;
  const EffectSettings& settings = from.settings.effects;
  const tilecore::ResolveSettings& resolve = from.settings.resolve;
  const frontend::FrontendCounters& counted = from.counters.frontend;
  const auto sub_patches = [&](const char* name, std::uint64_t with, std::uint64_t without,
                               std::uint64_t TileCounts::*map, const std::string& reason_none, EffectMode value,
                               const std::string& asked, const char* spared) {
    const EffectPlaces at{with, without, tiles_with(from.maps, map)};
    places[name] = at;
    effects[name] = at.tiles > 0;
    reasons[name] = sub_patch_reason(fmt::format("effects.{}", name), value, asked, reason_none, at, spared);
  };
  sub_patches("motion", counted.sub_patches_moving, counted.motion_elided, &TileCounts::moving_sub_patches,
              "nothing moves between shutter open and close", settings.motion, who_moves(frame),
              "no vertex moves by more than a sub-pixel");
  sub_patches("defocus", counted.sub_patches_defocused, counted.defocus_elided, &TileCounts::defocused_sub_patches,
              "the camera is a pinhole", settings.defocus,
              frame.projection.lens_scale != 0 ? "the camera has a lens" : "", "all points are in focus");
  const std::size_t displacing = count_drawables(frame, [](const PosedDrawable& d) {
    return d.material->displacement && d.drawable->kind == scene::Primitive::Kind::kBezierPatches;
  });
  sub_patches("displacement", counted.sub_patches_displaced, counted.displacement_elided,
              &TileCounts::displaced_sub_patches, "no Bezier patch has a displacement map", settings.displacement,
              who_has(displacing, frame, "have a displacement map"), "the map is zero wherever it is read");
  const std::size_t masking =
      count_drawables(frame, [](const PosedDrawable& d) { return d.material->alpha_mode == AlphaMode::kMask; });
  sub_patches("alpha_test", counted.sub_patches_alpha_tested, counted.alpha_test_elided,
              &TileCounts::alpha_tested_sub_patches, "no material masks", settings.alpha_test,
              who_has(masking, frame, "have a material that masks"), "no alpha is below the cutoff");
  const std::size_t blending =
      count_drawables(frame, [](const PosedDrawable& d) { return d.material->alpha_mode == AlphaMode::kBlend; });
  sub_patches("blending", counted.sub_patches_blended, 0, &TileCounts::blended_sub_patches, "no material blends",
              settings.blending == EffectSwitch::kOff ? EffectMode::kOff : EffectMode::kAuto,
              who_has(blending, frame, "have a material that blends"), "");

  for (std::size_t effect = 0; effect < scene::kMaterialEffectCount; ++effect) {
    const std::string name(scene::kMaterialEffectNames[effect]);
    const std::size_t asking =
        count_drawables(frame, [&](const PosedDrawable& d) { return d.material->effects[effect]; });
    if (asking == 0) continue;
    const auto tiles =
        static_cast<std::uint64_t>(std::count_if(from.materials.tiles.begin(), from.materials.tiles.end(),
                                                 [&](const scene::MaterialEffects& drawn) { return drawn[effect]; }));
    places[name] = {from.materials.sub_patches[effect], 0, tiles};
    effects[name] = tiles > 0;
    reasons[name] = who_has(asking, frame, "have a material with it");
  }

  const std::size_t procedures = count_drawables(frame, [](const PosedDrawable& d) { return d.procedure != nullptr; });
  const bool sampled = procedures > 0 && frame.request.procedures;
  const auto everywhere = [&](const char* name, bool runs, std::uint64_t tiles, const std::string& reason) {
    places[name] = {0, 0, runs ? tiles : 0};
    effects[name] = runs;
    reasons[name] = reason;
  };
  const std::uint64_t all = from.maps.tiles.size();
  everywhere("procedures", sampled,
             frame.request.sample_procedures ? tiles_with(from.maps, &TileCounts::procedure_samples) : all,
             procedures == 0 ? "the capture has no procedure"
             : !sampled      ? "effects.procedures=off"
                             : who_has(procedures, frame, "are procedures"));
  if (from.environment != nullptr)
    everywhere("environment_image", true, all,
               fmt::format("TESSERA_capture.environment is an image {} pixels wide", from.environment->source_width()));
  const auto casting = std::ranges::count(frame.light_casts, true);
  everywhere("shadows", casting > 0, all,
             settings.shadows == scene::ShadowCasters::kOff ? "effects.shadows=off"
             : casting == 0                                 ? "no light casts: TESSERA_capture.shadows names none"
                            : fmt::format("{} of {} lights cast", casting, frame.light_casts.size()));
  everywhere("stereo", from.stereo, all, from.stereo ? "stereo.eye_separation is not 0" : "stereo.eye_separation is 0");
  everywhere("frame_buffer_compression", from.compressed, all,
             from.compressed ? "the machine compresses its frame buffer" : "frame_buffer.compression=none");

  // Effects that the resolve unit has reported already.
  const auto resolved = [&](const char* name, std::uint64_t TileCounts::*map, const char* none) {
    effects.try_emplace(name, false);
    reasons.try_emplace(name, none);
    places[name] = {0, 0, tiles_with(from.maps, map)};
  };
  resolved("desampling", &TileCounts::desampled_blocks, "resolve.desampling=off");
  resolved("advection", &TileCounts::advected_pixels, "resolve.desampling=off");
  resolved("foveation", &TileCounts::foveated_blocks,
           resolve.desampling == tilecore::Desampling::kAdaptive
               ? (resolve.foveation.on() ? "blocks farther than resolve.foveation_r0 from the focus"
                                         : "resolve.foveation_r0 is 0")
               : "resolve.desampling is not adaptive");
}

}  // namespace tessera::gpu
