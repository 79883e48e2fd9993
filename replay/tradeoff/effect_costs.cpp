#include "replay/tradeoff/effect_costs.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/json_text.h"
#include "gpu/counter_list.h"
#include "replay/tradeoff/decisions.h"
#include "scene/material.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

constexpr std::string_view kRightEye = "right_eye.counters.", kPlaces = "effect_places.";

std::vector<EffectCase> make_cases() {
  std::vector<EffectCase> cases = {
      {"motion", {{"effects.motion", "off"}}, {"frontend.sub_patches_moving", "frontend.motion_elided"}},
      {"defocus", {{"effects.defocus", "off"}}, {"frontend.sub_patches_defocused", "frontend.defocus_elided"}},
      {"displacement",
       {{"effects.displacement", "off"}},
       {"frontend.sub_patches_displaced", "frontend.displacement_elided", "tilecore.height_lookups"}},
      {"alpha_test",
       {{"effects.alpha_test", "off"}},
       {"frontend.sub_patches_alpha_tested", "frontend.alpha_test_elided", "tilecore.alpha_tests",
        "tilecore.mask_vertices", "tilecore.mask_vertex_bytes"}},
      {"blending",
       {{"effects.blending", "off"}},
       {"frontend.sub_patches_blended", "tilecore.blended_layers", "tilecore.blend_overflows"}},
      {"procedures", {{"effects.procedures", "off"}}, {}},
      {"environment_image", {}, {}},
      {"shadows", {{"effects.shadows", "off"}}, {"shadows.texels_stored", "shadows.tiles_cleared"}},
      {"frame_buffer_compression", {{"frame_buffer.compression", "none"}}, {"resolve.pixels_compressed"}},
      {"desampling",
       {{"resolve.desampling", "off"}},
       {"resolve.blocks_rate_4", "resolve.blocks_rate_8", "resolve.blocks_rate_16", "resolve.pixels_reconstructed",
        "resolve.stencil_taps", "resolve.samples_skipped", "resolve.invocations_saved"}},
      {"advection",
       {{"resolve.advection", false}},
       {"resolve.blocks_advected", "resolve.pixels_advected", "resolve.advections_disoccluded"}},
      {"foveation", {{"resolve.foveation_r0", 0}}, {"resolve.blocks_foveated"}},
      {"stereo", {{"stereo.eye_separation", 0}}, {"right_eye.counters.tilecore.samples_visible"}}};
  for (EffectCase& one : cases)
    if (one.name == "procedures")
      for (const gpu::CounterInfo& counter : gpu::counter_infos())
        if (counter.name.starts_with("procedures.")) one.counters.push_back(counter.name);
  for (const std::string_view layer : scene::kMaterialEffectNames) {
    EffectCase& one = cases.emplace_back(EffectCase{std::string(layer), {}, {}});
    if (layer == "transmission")
      one.counters = {"transmission.pixels_kept", "transmission.texels_reduced", "transmission.tiles_again"};
  }
  return cases;
}

std::string without_text(const EffectCase& one) {
  if (!one.of_scene()) return as_arguments(one.without);
  return one.name == "environment_image" ? "the scene lit by the studio" : "materials without it";
}

std::string change_text(double less, double all, const char* format) {
  const std::string text = fmt::format(fmt::runtime(format), less);
  return all == 0 ? text : fmt::format("{} ({:+.1f} %)", text, 100 * less / all);
}

std::vector<std::string> names_that(const std::vector<EffectResult>& effects, bool ran) {
  std::vector<std::string> names;
  for (const EffectResult& effect : effects)
    if (effect.ran == ran) names.push_back(effect.name);
  return names;
}

// The sum of the counters of effects that did not run, and their number.
std::pair<std::uint64_t, std::size_t> work_of_absent(const std::vector<EffectResult>& effects) {
  std::pair<std::uint64_t, std::size_t> out{0, 0};
  for (const EffectResult& effect : effects) {
    if (effect.ran) continue;
    for (const auto& [name, value] : effect.counters) out.first += value;
    out.second += effect.counters.size();
  }
  return out;
}

// Names in lines of at most a hundred characters, the later ones indented.
std::string wrapped(const std::vector<std::string>& names) {
  std::string text, line = "   ";
  for (std::size_t k = 0; k < names.size(); ++k) {
    const std::string word = " " + names[k] + (k + 1 < names.size() ? "," : "");
    if (line.size() + word.size() > 100) {
      text += line + "\n";
      line = "   ";
    }
    line += word;
  }
  return text + line + "\n";
}

std::string image_text(const SettingResult& without) {
  return without.measured.error->psnr_db ? fmt::format("{:.1f}", *without.measured.error->psnr_db) : "same";
}

}  // namespace

const std::vector<EffectCase>& effect_cases() {
  static const std::vector<EffectCase> kCases = make_cases();
  return kCases;
}

std::vector<EffectResult> effects_of(const gpu::FrameResult& frame) {
  const auto counted = gpu::counter_values(frame.counters);
  const auto right = frame.right ? gpu::counter_values(frame.right->counters) : decltype(counted)();
  const auto value_of = [](const auto& values, std::string_view name) {
    const auto found = values.find(name);
    return found == values.end() ? std::uint64_t{0} : found->second;
  };
  std::vector<EffectResult> out;
  for (const EffectCase& one : effect_cases()) {
    EffectResult& effect = out.emplace_back();
    effect.name = one.name;
    const auto reason = frame.effect_reasons.find(one.name);
    effect.reason = reason != frame.effect_reasons.end() ? reason->second
                    : one.name == "environment_image"    ? "no image lights the scene"
                                                         : "no material has it";
    if (const auto places = frame.effect_places.find(one.name); places != frame.effect_places.end()) {
      effect.sub_patches = places->second.sub_patches;
      effect.tiles = places->second.tiles;
    }
    const auto ran = frame.effects.find(one.name);
    effect.ran = (ran != frame.effects.end() && ran->second) || effect.sub_patches > 0;
    for (const std::string_view name : one.counters)
      effect.counters[std::string(name)] =
          name.starts_with(kRightEye) ? value_of(right, name.substr(kRightEye.size())) : value_of(counted, name);
    // The only counters of a layer of materials are the sub-patches in which it is drawn.
    if (one.of_scene() && one.name != "environment_image")
      effect.counters[fmt::format("{}{}.sub_patches", kPlaces, one.name)] = effect.sub_patches;
    if (effect.ran) effect.without = without_text(one);
  }
  return out;
}

std::string effects_table(const std::vector<EffectResult>& effects, const KnobResult& knob) {
  const Measurement& all = knob.settings[0].measured;
  std::string text = fmt::format("{} of {} effects run; each costs the frame less the frame without it:\n",
                                 names_that(effects, true).size(), effects.size());
  const auto row = [](const std::string& name, const std::string& ms, const std::string& mj, const std::string& bytes,
                      const std::string& seconds, const std::string& db, const std::string& tiles) {
    return fmt::format("  {:<25} {:>17} {:>17} {:>20} {:>16} {:>9} {:>6}\n", name, ms, mj, bytes, seconds, db, tiles);
  };
  text += row("effect", "ms", "mJ", "DRAM bytes", "CPU s", "image dB", "tiles");
  const double ms = all.ms.value_or(0), mj = cost_of(all, Cost::kMj).value_or(0),
               bytes = static_cast<double>(all.dram_bytes.value_or(0)), seconds = all.processor_seconds.median;
  text += row("the frame", fmt::format("{:.3f}", ms), fmt::format("{:.3f}", mj), fmt::format("{:.0f}", bytes),
              fmt::format("{:.3f}", seconds), "", "");
  for (const EffectResult& effect : effects) {
    if (!effect.ran) continue;
    if (!effect.setting) {
      text += fmt::format("  {:<25} {}\n", effect.name, effect.stays);
      continue;
    }
    const SettingResult& without = knob.settings[*effect.setting];
    const Measurement& m = without.measured;
    text += row(effect.name, change_text(ms - m.ms.value_or(0), ms, "{:.3f}"),
                change_text(mj - cost_of(m, Cost::kMj).value_or(0), mj, "{:.3f}"),
                change_text(bytes - static_cast<double>(m.dram_bytes.value_or(0)), bytes, "{:.0f}"),
                change_text(seconds - m.processor_seconds.median, seconds, "{:.3f}"), image_text(without),
                std::to_string(effect.tiles));
  }
  const auto [work, counters] = work_of_absent(effects);
  text += fmt::format("absent, cost 0 (sum of the {} counters of their work: {}):\n", counters, work);
  return text + wrapped(names_that(effects, false));
}

std::string effects_csv(const std::string& capture, const std::vector<EffectResult>& effects, const KnobResult& knob) {
  std::string text =
      "capture,effect,ran,tiles,sub_patches,work,ms,mj,dram_bytes,processor_seconds,frame_ms,frame_mj,frame_dram_bytes,"
      "frame_processor_seconds,psnr_db,flip,without,reason\n";
  const Measurement& all = knob.settings[0].measured;
  const auto less = [](const auto& a, const auto& b) { return a && b ? json(*a - *b) : json(); };
  const auto less_bytes = [](const auto& a, const auto& b) {
    return a && b ? json(static_cast<std::int64_t>(*a) - static_cast<std::int64_t>(*b)) : json();
  };
  for (const EffectResult& effect : effects) {
    std::uint64_t work = 0;
    for (const auto& [name, value] : effect.counters) work += value;
    std::vector<json> cells = {capture, effect.name, effect.ran, effect.tiles, effect.sub_patches, work};
    const SettingResult* const without = effect.setting ? &knob.settings[*effect.setting] : nullptr;
    if (without != nullptr) {
      const Measurement& m = without->measured;
      cells.insert(cells.end(), {less(all.ms, m.ms), less(cost_of(all, Cost::kMj), cost_of(m, Cost::kMj)),
                                 less_bytes(all.dram_bytes, m.dram_bytes),
                                 json(all.processor_seconds.median - m.processor_seconds.median)});
    } else {
      // An absent effect costs nothing; the cost of an effect that could not be left out is unknown.
      for (int k = 0; k < 4; ++k) cells.push_back(effect.ran ? json() : json(0));
    }
    cells.insert(cells.end(), {all.ms ? json(*all.ms) : json(), json(cost_of(all, Cost::kMj).value_or(0)),
                               all.dram_bytes ? json(*all.dram_bytes) : json(), json(all.processor_seconds.median)});
    cells.push_back(without != nullptr && without->measured.error->psnr_db ? json(*without->measured.error->psnr_db)
                                                                           : json());
    cells.push_back(without != nullptr ? json(without->measured.error->flip) : json());
    cells.emplace_back(effect.stays.empty() ? effect.without : effect.stays);
    cells.emplace_back(effect.reason);
    std::vector<std::string> texts;
    texts.reserve(cells.size());
    for (const json& cell : cells) texts.push_back(csv_cell(cell));
    text += fmt::format("{}\n", fmt::join(texts, ","));
  }
  return text;
}

}  // namespace tessera::replay
