#include "replay/describe.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/key_table.h"
#include "base/text.h"
#include "gpu/configuration.h"
#include "gpu/counter_list.h"
#include "gpu/settings.h"
#include "replay/calibration.h"
#include "replay/statistics.h"
#include "scene/extensions.h"
#include "scene/gltf/audit.h"
#include "scene/material.h"
#include "shaders_cpp/procedures/declarations.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

struct Column {
  const char* key;
  const char* title;
};

// A page's title, text and columns.
struct Topic {
  const char* name;
  const char* title;
  std::string introduction;
  std::vector<Column> columns;
};

std::vector<Column> calibration_columns() {
  return {{"key", "key"},          {"preset", "preset"}, {"value", "value"}, {"unit", "unit"},
          {"ends", "low to high"}, {"source", "source"}, {"date", "date"}};
}

const std::vector<Topic>& topics() {
  static const std::vector<Topic> kTopics = {
      {"counters",
       "Counters",
       "Every counter of stats.json and stats.csv, generated from the declarations beside the code "
       "that counts. Counters are raw events, exact, and\n"
       "the same for any number of host threads and any host instruction set. A counter whose unit "
       "did not run is absent, not zero. Over several\n"
       "frames a counter is summed, or its peak is kept. Counters of `baseline` are in the member "
       "`baselines`, once per scheme, and in baselines.csv, when a\n"
       "replay ran with `--baselines`. The last column names counters of real GPUs for a comparable "
       "quantity; their numbers\n"
       "need not agree.",
       {{"name", "counter"},
        {"unit", "unit"},
        {"over_frames", "over frames"},
        {"meaning", "meaning"},
        {"vendor", "comparable to"}}},
      {"settings",
       "Settings",
       "Keys of a replay for `--set KEY=VALUE`, generated from the declarations. The numbers of the "
       "described machine are keys as well: see\n"
       "[gpu.md](gpu.md).",
       {{"key", "key"},
        {"type", "type"},
        {"unit", "unit"},
        {"default", "default"},
        {"range", "range"},
        {"meaning", "meaning"}}},
      {"gpu",
       "The described machine",
       "Keys of a `--gpu` file and of `--set`, generated from the declarations; defaults are the "
       "values of the preset `mid-mobile`. In a file the dots nest:\n"
       "`{\"preset\": \"mid-mobile\", \"tile\": {\"width\": 16, \"height\": 16}}`. [spec] marks "
       "published figures, [measured] our own\n"
       "measurements, [assumed] our own choice; the source of a number covers its values in all "
       "presets. Presets: `hardware/presets/`, with the source of each of their numbers. A change "
       "of a key of pass `timing` needs a timing of the same record (`tessera time`), a change of a "
       "key of pass `function` needs another record. Low and high are the plausible ends of an "
       "assumed number (`--sensitivity`); they scale with a preset's value. "
       "[timing_model.md](timing_model.md)\n"
       "explains how cycles and energies are computed from these numbers.",
       {{"key", "key"},
        {"type", "type"},
        {"unit", "unit"},
        {"default", "default"},
        {"other_presets", "other presets"},
        {"range", "range"},
        {"ends", "low to high"},
        {"pass", "pass"},
        {"meaning", "meaning"},
        {"source", "source"}}},
      {"calibration", "Where the numbers of the machine come from", calibration_introduction(), calibration_columns()},
      {"extensions",
       "glTF extensions",
       "Extensions that Tessera reads, generated from the declarations. Other extensions are ignored unless the asset "
       "requires them; then it is\n"
       "refused, naming them. Tessera's own have a page and a JSON schema each in `docs/extensions/`.",
       {{"name", "extension"}, {"extends", "carried by"}, {"meaning", "meaning"}, {"member_names", "members"}}},
      {"formats",
       "Supported contents of glTF files",
       "glTF 2.0, text or binary, in whole: triangles, strips, fans, points and lines, sparse and "
       "quantised accessors, skins, morph targets,\n"
       "animations, cameras; PNG, JPEG (also CMYK), WebP and KTX2 images. The eight heaviest joints "
       "of a vertex, over all sets, count. Morph targets\n"
       "move positions, normals and tangents; a note names targets that move colours or coordinates "
       "as well. A violation of the specification\n"
       "with only one meaning is read with a note, and refused with `--strict`; an image that no "
       "texture samples may be missing. The table lists the extensions of the Khronos registry. "
       "`inspect` and a note name the unread ones that a file uses,\n"
       "and a file that requires an unread one is refused (status 3). Tessera's own: "
       "[extensions.md](extensions.md).",
       {{"name", "extension"},
        {"status", "status"},
        {"treatment", "Tessera"},
        {"meaning", "read of it, or missing from the image"},
        {"test", "tests"}}},
      {"procedures",
       "Procedures",
       "Stages that a capture's `TESSERA_procedure` can name "
       "([extensions/TESSERA_procedure.md](extensions/TESSERA_procedure.md)), generated from their declarations in\n"
       "`shaders_cpp/procedures/`, and the language of its `program`, in which the built-in shapes and textures are "
       "written\n"
       "once more: `shaders_cpp/procedures/builtin_stages.txt`. How they are drawn: [procedures.md](procedures.md).",
       {{"name", "stage"}, {"kind", "kind"}, {"meaning", "meaning"}, {"parameters", "parameters"}}},
      {"effects",
       "Effects",
       "Tessera simulates only the effects that a scene calls for; an absent one costs less than "
       "0.5 % of the host's instructions. `tessera tradeoff CAPTURE --out DIR --effects` prices "
       "them.\n"
       "`stats.json` says which ran (`effects`), why (`effect_reasons`) and where "
       "(`effect_places`).",
       {{"name", "effect"},
        {"meaning", "meaning"},
        {"decided", "decided for each"},
        {"when", "runs when"},
        {"setting", "forced by"}}},
  };
  return kTopics;
}

const Topic& topic_named(const std::string& name) {
  for (const Topic& topic : topics())
    if (topic.name == name) return topic;
  std::vector<std::string> known;
  for (const Topic& topic : topics()) known.emplace_back(topic.name);
  const std::string nearest = nearest_name(name, known);
  throw UsageError(fmt::format("describe {}: topics are {}, completion, man{}", escape_control(name, 80),
                               fmt::join(known, ", "),
                               nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest)));
}

template <class S>
json describe_keys(const KeyTable<S>& table) {
  json rows = json::array();
  for (const auto& key : table.keys()) rows.push_back(describe_key(key, table.default_value(key)));
  return rows;
}

// The rows of gpu_keys() with the values of the presets that differ from the default.
json describe_gpu() {
  json rows = describe_keys(gpu::gpu_keys());
  for (const std::string& preset : gpu::preset_names()) {
    const gpu::GpuConfiguration gpu = gpu::load_gpu(preset);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const json value = key_value_json(gpu::gpu_keys().value(gpu, gpu::gpu_keys().keys()[k]));
      if (value != rows[k]["default"]) rows[k]["presets"][preset] = value;
    }
  }
  for (json& row : rows) {
    std::string text;
    if (row.contains("presets"))
      for (const auto& [preset, value] : row["presets"].items())
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", preset, value.dump());
    row["other_presets"] = text;
    row["pass"] = row.contains("timing") ? "timing" : "function";
  }
  return rows;
}

json describe_extensions() {
  json rows = json::array();
  for (const scene::Extension& extension : scene::supported_extensions()) {
    json members = json::array();
    for (const scene::ExtensionMember& m : extension.members)
      members.push_back(
          {{"name", m.name}, {"type", m.type}, {"unit", m.unit}, {"default", m.default_value}, {"meaning", m.meaning}});
    rows.push_back({{"name", extension.name},
                    {"extends", extension.extends},
                    {"meaning", extension.meaning},
                    {"members", members}});
  }
  return rows;
}

json describe_formats() {
  json rows = json::array();
  for (const scene::Extension& extension : scene::extension_registry())
    rows.push_back({{"name", extension.name},
                    {"status", extension.status},
                    {"treatment", extension.read() ? "read" : "noted; refused if required"},
                    {"meaning", extension.treatment},
                    {"test", extension.read() ? extension.test : "RegisteredExtensions"}});
  return rows;
}

json describe_effects() {
  struct Effect {
    const char *name, *meaning, *decided, *when, *setting;
  };
  constexpr const char* kSubPatch = "frame, drawable, sub-patch, tile";
  const std::string layers = fmt::format("{}", fmt::join(scene::kMaterialEffectNames, ", "));
  const Effect effects[] = {
      {"advection", "Slow blocks take most of their pixels from the previous frame, or from the other eye.",
       "frame, block", "resolve.desampling is adaptive, the frame before was rendered with the same lights",
       "resolve.advection"},
      {"alpha_test", "Hits count only where the material's alpha reaches its cutoff.", kSubPatch,
       "the material has alpha mode MASK, and its texture or vertex colours may fall below the cutoff somewhere on the "
       "sub-patch",
       "effects.alpha_test"},
      {"blending", "Surfaces are kept as layers per sample and composed far to near.", "drawable, tile",
       "the material has alpha mode BLEND", "effects.blending (off only)"},
      {"defocus", "Samples look through points of a thin lens.", kSubPatch,
       "the camera has an aperture, and not all of the sub-patch is certainly in focus", "effects.defocus"},
      {"desampling", "Not all pixels are shaded; the others are advected or reconstructed.", "frame, block",
       "resolve.desampling asks for it", "resolve.desampling"},
      {"displacement", "Vertices of Bezier patches move along the normal by a texture.", kSubPatch,
       "the material has TESSERA_displacement, and its offset is not zero all over the sub-patch",
       "effects.displacement"},
      {"environment_image", "An image lights the scene from all around.", "frame",
       "TESSERA_capture.environment names one", ""},
      {"foveation", "Blocks far from the focus get fewer samples.", "frame, block",
       "resolve.desampling is adaptive and resolve.foveation_r0 is not 0", "resolve.foveation_r0"},
      {"frame_buffer_compression", "Finished pixels are compressed on their way to memory.", "frame",
       "the machine does", "frame_buffer.compression"},
      {layers.c_str(), "Extensions of materials.", "drawable", "the material has it", ""},
      {"motion", "Samples see the scene at different times of the shutter.", kSubPatch,
       "the drawable moves on screen between shutter open and close, by the camera's motion or its own, and a vertex "
       "of the sub-patch may move by more than 1/256 pixel or 2^-16 of its depth",
       "effects.motion"},
      {"procedures", "Surfaces that are formulas are sampled by the sampling controller.", "frame, tile",
       "the capture has TESSERA_procedure", "effects.procedures (off only), procedures.path"},
      {"shadows", "Passes draw maps of depths from lights, and the pixel shader looks up whether light is kept off.",
       "frame, light", "TESSERA_capture.shadows names the light", "effects.shadows"},
      {"stereo", "A second image for a right eye.", "frame", "stereo.eye_separation is not 0", "stereo.eye_separation"},
  };
  json rows = json::array();
  for (const Effect& e : effects)
    rows.push_back(
        {{"name", e.name}, {"meaning", e.meaning}, {"decided", e.decided}, {"when", e.when}, {"setting", e.setting}});
  return rows;
}

std::string parameter_text(const shaders::ParameterDeclaration& p) {
  using shaders::ParameterLayout;
  std::string text = fmt::format("{}", p.name);
  if (p.layout != ParameterLayout::kNumbers)
    text += p.layout == ParameterLayout::kChainU ? " (curves along u)" : " (curves along v)";
  else if (p.size > 1)
    text += fmt::format(" ({} numbers)", p.size);
  text += p.required() ? ", required" : fmt::format(" = {:g}", p.default_value);
  return text + fmt::format(": {}", p.meaning);
}

json describe_stages() {
  json rows = json::array();
  const auto add = [&](std::string_view kind, std::span<const shaders::StageDeclaration> stages) {
    for (const shaders::StageDeclaration& stage : stages) {
      std::string parameters;
      for (const shaders::ParameterDeclaration& p : stage.parameters)
        parameters += (parameters.empty() ? "" : "<br>") + parameter_text(p);
      rows.push_back({{"name", stage.name}, {"kind", kind}, {"meaning", stage.meaning}, {"parameters", parameters}});
    }
  };
  add("shape", shaders::shape_declarations());
  add("texture", shaders::texture_declarations());
  add("shading", shaders::shading_declarations());
  for (const shaders::LanguageRow& row : shaders::program_language())
    rows.push_back({{"name", row.name}, {"kind", row.kind}, {"meaning", row.meaning}, {"parameters", ""}});
  return rows;
}

std::string range_of(const json& row) {
  if (row.contains("choices")) {
    std::string text;
    for (const json& choice : row["choices"]) text += (text.empty() ? "" : ", ") + choice.get<std::string>();
    return text;
  }
  if (row.contains("min")) return fmt::format("{:.15g} to {:.15g}", row["min"].get<double>(), row["max"].get<double>());
  if (!row.contains("type")) return "";
  return row["type"] == "boolean" ? "true, false" : row["type"] == "text" ? "any text" : "";
}

std::string number_text(double number) {
  return number == std::floor(number) && std::abs(number) < 1e15 ? fmt::format("{:.0f}", number)
                                                                 : fmt::format("{:.6g}", number);
}

std::string cell_text(const json& row, const std::string& key) {
  if (key == "range") return range_of(row);
  if (key == "ends")
    return row.contains("low")
               ? fmt::format("{} to {}", number_text(row["low"].get<double>()), number_text(row["high"].get<double>()))
               : "";
  if (key == "member_names") {
    std::string text;
    for (const json& member : row["members"]) text += (text.empty() ? "" : ", ") + member["name"].get<std::string>();
    return text;
  }
  if (!row.contains(key)) return "";
  if (key == "value" && row[key].is_number()) return number_text(row[key].get<double>());
  return row[key].is_string() ? row[key].get<std::string>() : row[key].dump();
}

}  // namespace

const std::vector<std::string>& describe_topics() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    for (const Topic& topic : topics()) names.emplace_back(topic.name);
    return names;
  }();
  return kNames;
}

json describe_json(const std::string& name) {
  topic_named(name);
  if (name == "counters") return describe_counters();
  if (name == "settings") return describe_keys(gpu::settings_keys());
  if (name == "gpu") return describe_gpu();
  if (name == "calibration") return calibration_rows();
  if (name == "extensions") return describe_extensions();
  if (name == "formats") return describe_formats();
  if (name == "procedures") return describe_stages();
  return describe_effects();
}

std::string describe_text(const std::string& name) {
  const Topic& topic = topic_named(name);
  std::string text;
  for (const json& row : describe_json(name)) {
    text += cell_text(row, topic.columns[0].key) + "\n";
    for (std::size_t c = 1; c < topic.columns.size(); ++c) {
      const std::string value = cell_text(row, topic.columns[c].key);
      if (!value.empty()) text += fmt::format("    {:<14}{}\n", topic.columns[c].title, value);
    }
    if (row.contains("members"))
      for (const json& member : row["members"])
        text += fmt::format(
            "      {} ({}{}{}, default {}): {}\n", member["name"].get<std::string>(), member["type"].get<std::string>(),
            member["unit"].get_ref<const std::string&>().empty() ? "" : ", ", member["unit"].get<std::string>(),
            member["default"].get<std::string>(), member["meaning"].get<std::string>());
  }
  return text;
}

namespace {

std::string former_counters_markdown() {
  std::string text = "\n## Former names\n\n| counter | now |\n|---|---|\n";
  for (const gpu::FormerCounter& counter : gpu::former_counters())
    text += fmt::format("| `{}` | {} |\n", counter.name,
                        counter.now.empty() ? std::string("removed") : fmt::format("`{}`", counter.now));
  return text;
}

// A table of the reader's answer to each error of the Khronos validator.
std::string validator_codes_markdown() {
  std::string text =
      "\n"
      "## The validator's errors\n"
      "\n"
      "The Khronos glTF validator and `--strict` agree about errors, except for the ones that are "
      "not checked. Without `--strict`, only violations without a clear meaning\n"
      "are refused; all others are read, and `inspect` names them in a note.\n"
      "\n"
      "| code | without `--strict` | with `--strict` |\n"
      "|---|---|---|\n";
  for (const scene::gltf::ValidatorCode& code : scene::gltf::validator_codes())
    text += fmt::format("| `{}` | {} | {} |\n", code.code,
                        code.answer == scene::gltf::Answer::kRefused      ? "refused"
                        : code.answer == scene::gltf::Answer::kNotChecked ? "not checked"
                                                                          : "a note",
                        code.answer == scene::gltf::Answer::kNotChecked ? "not checked" : "refused");
  return text;
}

}  // namespace

std::string describe_markdown(const std::string& name) {
  const Topic& topic = topic_named(name);
  std::string text = fmt::format("# {}\n\n{}\n\nMade by `tessera describe {} --markdown`.\n\n|", topic.title,
                                 topic.introduction, name);
  for (const Column& column : topic.columns) text += fmt::format(" {} |", column.title);
  text += "\n|";
  for (std::size_t c = 0; c < topic.columns.size(); ++c) text += "---|";
  text += "\n";
  for (const json& row : describe_json(name)) {
    text += "|";
    for (std::size_t c = 0; c < topic.columns.size(); ++c) {
      std::string value = cell_text(row, topic.columns[c].key);
      for (std::size_t at = 0; (at = value.find('|', at)) != std::string::npos; at += 2) value.insert(at, "\\");
      text += c == 0 ? fmt::format(" `{}` |", value) : fmt::format(" {} |", value);
    }
    text += "\n";
  }
  if (name == "counters") return text + former_counters_markdown();
  return name == "formats" ? text + validator_codes_markdown() : text;
}

}  // namespace tessera::replay
