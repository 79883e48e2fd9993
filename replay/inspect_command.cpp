#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <set>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "base/text.h"
#include "replay/commands.h"
#include "replay/compare/run_figures.h"
#include "replay/file_kind.h"
#include "replay/progress.h"
#include "replay/statistics.h"
#include "replay/view_options.h"
#include "scene/assembly.h"
#include "scene/light_views.h"
#include "scene/pass_graph.h"
#include "scene/pose.h"
#include "scene/view.h"
#include "scene/view_choices.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
using scene::Capture;

const char* alpha_name(scene::AlphaMode mode) {
  switch (mode) {
    case scene::AlphaMode::kOpaque:
      return "opaque";
    case scene::AlphaMode::kMask:
      return "mask";
    case scene::AlphaMode::kBlend:
      return "blend";
  }
  return "";
}

const char* format_name(scene::TextureFormat format) {
  switch (format) {
    case scene::TextureFormat::kPng:
      return "PNG";
    case scene::TextureFormat::kJpeg:
      return "JPEG";
    case scene::TextureFormat::kWebp:
      return "WebP";
    case scene::TextureFormat::kKtx2Etc1s:
      return "KTX2 ETC1S";
    case scene::TextureFormat::kKtx2Uastc:
      return "KTX2 UASTC";
  }
  return "";
}

json source_json(const scene::TextureSource& source) {
  return {{"format", format_name(source.format)}, {"levels", source.levels}};
}

json meshes_json(const Capture& capture) {
  json rows = json::array();
  for (const scene::Mesh& mesh : capture.meshes) {
    std::size_t triangles = 0, patches = 0, vertices = 0, targets = 0, points = 0, lines = 0;
    bool skinned = false;
    for (const scene::Primitive& p : mesh.primitives) {
      vertices += p.vertices.count();
      targets = p.vertices.morph_targets.size();
      skinned = skinned || !p.vertices.influences.empty();
      if (p.kind == scene::Primitive::Kind::kBezierPatches)
        patches += p.vertices.count() / 16;
      else if (p.wire != scene::Primitive::Wire::kSurface)
        (p.wire == scene::Primitive::Wire::kPoints ? points : lines) += p.vertices.count() / 4;
      else
        triangles += p.indices.size() / 3;
    }
    rows.push_back({{"name", mesh.name},
                    {"primitives", mesh.primitives.size()},
                    {"vertices", vertices},
                    {"triangles", triangles},
                    {"bezier_patches", patches},
                    {"points", points},
                    {"lines", lines},
                    {"morph_targets", targets},
                    {"skinned", skinned}});
  }
  return rows;
}

json materials_json(const Capture& capture) {
  json rows = json::array();
  for (const scene::Material& m : capture.materials) {
    json textures = json::object(), sources = json::object();
    const auto slots = m.slots();
    for (std::size_t slot = 0; slot < slots.size(); ++slot) {
      if (slots[slot]->texture == nullptr) continue;
      const std::string name(scene::kMaterialTextureNames[slot]);
      textures[name] = {slots[slot]->texture->width(), slots[slot]->texture->height()};
      sources[name] = source_json(slots[slot]->source);
    }
    json effects = json::array();
    for (std::size_t effect = 0; effect < scene::kMaterialEffectCount; ++effect)
      if (m.effects[effect]) effects.push_back(scene::kMaterialEffectNames[effect]);
    if (m.displacement) {
      textures["displacement"] = {m.displacement->texture->levels()[0].width,
                                  m.displacement->texture->levels()[0].height};
      sources["displacement"] = source_json(m.displacement->source);
    }
    rows.push_back({{"name", m.name},
                    {"alpha", alpha_name(m.alpha_mode)},
                    {"double_sided", m.double_sided},
                    {"unlit", m.unlit},
                    {"effects", effects},
                    {"textures", textures},
                    {"texture_files", sources}});
  }
  return rows;
}

json animations_json(const Capture& capture) {
  json rows = json::array();
  for (std::size_t a = 0; a < capture.animations.size(); ++a) {
    const auto& played = capture.played_animations;
    rows.push_back({{"name", capture.animations[a].name},
                    {"channels", capture.animations[a].channels.size()},
                    {"seconds", capture.animations[a].duration()},
                    {"played", std::find(played.begin(), played.end(), static_cast<int>(a)) != played.end()}});
  }
  return rows;
}

json scenes_json(const scene::SceneList& scenes) {
  json rows = json::array();
  for (std::size_t s = 0; s < scenes.names.size(); ++s)
    rows.push_back({{"name", scenes.names[s]}, {"drawn", static_cast<int>(s) == scenes.drawn}});
  return rows;
}

json cameras_json(const Capture& capture) {
  json rows = json::array();
  for (std::size_t c = 0; c < capture.cameras.size(); ++c) {
    const scene::Camera& camera = capture.cameras[c];
    const bool perspective = camera.type == scene::Camera::Type::kPerspective;
    json nodes = json::array();
    for (const scene::Node& node : capture.nodes)
      if (node.camera == static_cast<int>(c)) nodes.push_back(node.name);
    json row = {
        {"name", camera.name}, {"type", perspective ? "perspective" : "orthographic"}, {"nodes", std::move(nodes)}};
    if (camera.lens.aperture_radius > 0)
      row["aperture_radius"] = camera.lens.aperture_radius, row["focus_distance"] = camera.lens.focus_distance;
    rows.push_back(std::move(row));
  }
  return rows;
}

const char* type_name(shaders::Light::Type type) {
  switch (type) {
    case shaders::Light::Type::kDirectional:
      return "directional";
    case shaders::Light::Type::kPoint:
      return "point";
    case shaders::Light::Type::kSpot:
      return "spot";
  }
  return "";
}

// The most maps that one node of a light has; a cube draws only the faces that receivers touch.
int max_maps(const Capture& capture, const scene::ShadowRequest& shadow) {
  const shaders::Light& light = capture.lights[static_cast<std::size_t>(shadow.light)];
  if (light.type == shaders::Light::Type::kDirectional) return shadow.cascades;
  return scene::needs_cube(light) ? 6 : 1;
}

json shadows_json(const Capture& capture) {
  json rows = json::array();
  if (capture.settings.shadows.empty()) return rows;
  const std::vector<bool> in_scene = scene::pose_at(capture, 0).in_scene;
  for (const scene::ShadowRequest& shadow : capture.settings.shadows) {
    int nodes = 0;
    for (std::size_t n = 0; n < capture.nodes.size(); ++n)
      nodes += in_scene[n] && capture.nodes[n].light == shadow.light;
    const auto maps = static_cast<std::uint64_t>(nodes) * static_cast<std::uint64_t>(max_maps(capture, shadow));
    constexpr std::uint64_t kTexelBytes = 4;
    const auto size = static_cast<std::uint64_t>(shadow.size);
    rows.push_back({{"light", shadow.light},
                    {"type", type_name(capture.lights[static_cast<std::size_t>(shadow.light)].type)},
                    {"nodes", nodes},
                    {"size", shadow.size},
                    {"cascades", shadow.cascades},
                    {"distance", shadow.distance},
                    {"max_maps", maps},
                    {"max_bytes", maps * size * size * kTexelBytes}});
  }
  return rows;
}

template <class Enum, std::size_t kCount>
std::string name_in(const std::array<std::string_view, kCount>& names, Enum value) {
  return std::string(names[static_cast<std::size_t>(value)]);
}

json attachment_json(const scene::Attachment& a) {
  return {{"name", a.name},
          {"format", name_in(scene::kAttachmentFormatNames, a.format)},
          {"sample_bits", scene::sample_bits(a.format)},
          {"size", a.size ? json(*a.size) : json()},
          {"scale", a.size ? json() : json(a.scale)},
          {"samples", a.samples == 0 ? json() : json(a.samples)},
          {"layers", a.layers},
          {"levels", a.levels},
          {"life", name_in(scene::kAttachmentLifeNames, a.life)}};
}

json pass_json(const scene::PassGraph& graph, const scene::Pass& pass) {
  json subpasses = json::array(), load = json::object(), store = json::object();
  for (const scene::Subpass& s : pass.subpasses)
    subpasses.push_back({{"draw", name_in(scene::kDrawFilterNames, s.draw)},
                         {"shader", name_in(scene::kPassShaderNames, s.shader)},
                         {"input", s.input},
                         {"write", s.write},
                         {"sample", s.sample}});
  for (const auto& [name, action] : pass.load) load[name] = name_in(scene::kLoadActionNames, action);
  for (const auto& [name, action] : pass.store) store[name] = name_in(scene::kStoreActionNames, action);
  return {{"name", pass.name},
          {"view", name_in(scene::kPassViewNames, pass.view)},
          {"subpasses", std::move(subpasses)},
          {"depth", scene::depth_attachment(graph, pass)},
          {"load", std::move(load)},
          {"store", std::move(store)},
          {"tile_bytes_per_sample", scene::tile_bytes_per_sample(graph, pass)}};
}

// The attachments and the passes in the order in which they run; null where the file describes none.
json graph_json(const Capture& capture) {
  if (!capture.settings.graph) return {};
  const scene::PassGraph& graph = *capture.settings.graph;
  json attachments = json::array(), passes = json::array();
  for (const scene::Attachment& attachment : graph.attachments) attachments.push_back(attachment_json(attachment));
  for (const int pass : scene::pass_order(graph))
    passes.push_back(pass_json(graph, graph.passes[static_cast<std::size_t>(pass)]));
  return {{"attachments", std::move(attachments)}, {"passes", std::move(passes)}};
}

// The camera that takes the image at the capture's size: as a glTF node's matrix and camera have it; `whole`: also where,
// for which the scene may have to be framed.
json view_json(const Capture& capture, bool whole) {
  const scene::CaptureSettings& s = capture.settings;
  const int node = scene::camera_node(capture);
  json out = {{"automatic", node == scene::kNone}};
  if (node != scene::kNone) out["camera"] = capture.nodes[static_cast<std::size_t>(node)].camera;
  if (!whole) return out;
  const scene::CameraChoice choice = scene::choose_camera(capture, s.width, s.height);
  const DMat4 world = choice.view(scene::pose_at(capture, s.first_frame / s.frame_rate)).camera_to_world;
  json matrix = json::array();
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row) matrix.push_back(world[column][row]);
  out["matrix"] = std::move(matrix);
  if (choice.camera.type == scene::Camera::Type::kPerspective) out["yfov"] = choice.camera.vertical_fov;
  if (choice.camera.lens.aperture_radius > 0)
    out["lens"] = {choice.camera.lens.aperture_radius, choice.camera.lens.focus_distance};
  return out;
}

// The extensions that the file lists and the ones that it contains, once each.
json extensions_json(const Capture& capture) {
  const std::set<std::string> unread(capture.extensions_unread.begin(), capture.extensions_unread.end());
  std::set<std::string> all = unread;
  all.insert(capture.extensions_used.begin(), capture.extensions_used.end());
  json rows = json::array();
  for (const std::string& name : all) rows.push_back({{"name", name}, {"read", !unread.contains(name)}});
  return rows;
}

json inspect(const Capture& capture, const scene::SceneList& scenes, bool whole) {
  const scene::Assembly assembly = scene::assemble(capture);
  std::size_t triangles = 0, bezier = 0, clusters = 0, procedures = 0, instances = 0;
  for (const scene::InstancedNode& node : assembly.instanced_nodes) instances += node.order.size();
  for (const scene::Drawable& d : assembly.drawables) {
    if (d.kind == scene::Primitive::Kind::kBezierPatches) {
      bezier += d.patch_count;
    } else if (d.kind == scene::Primitive::Kind::kProcedure) {
      procedures += 1;
    } else {
      clusters += d.patch_count;
      triangles += capture.meshes[static_cast<std::size_t>(d.mesh)]
                       .primitives[static_cast<std::size_t>(d.primitive)]
                       .indices.size() /
                   3;
    }
  }
  const scene::CaptureSettings& s = capture.settings;
  return {{"file", capture.file.string()},
          {"bytes", capture.file_bytes},
          {"drawn",
           {{"nodes", assembly.drawn.size()},
            {"instances", instances},
            {"base_patches", assembly.patch_count()},
            {"bezier_patches", bezier},
            {"clusters", clusters},
            {"triangles", triangles},
            {"procedures", procedures}}},
          {"meshes", meshes_json(capture)},
          {"materials", materials_json(capture)},
          {"animations", animations_json(capture)},
          {"skins", capture.skins.size()},
          {"scenes", scenes_json(scenes)},
          {"cameras", cameras_json(capture)},
          {"view", view_json(capture, whole)},
          {"lights", capture.lights.size()},
          {"shadows", shadows_json(capture)},
          {"graph", graph_json(capture)},
          {"variants", capture.variants},
          {"settings",
           {{"declared", s.declared},
            {"resolution", {s.width, s.height}},
            {"frame_rate", s.frame_rate},
            {"shutter", {s.shutter_open, s.shutter_close}},
            {"first_frame", s.first_frame},
            {"frames", s.frame_count}}},
          {"extensions", extensions_json(capture)},
          {"notices", capture.notices}};
}

std::string quoted(const json& name) {
  return name.get<std::string>().empty() ? "(no name)" : escape_control(name.get<std::string>(), 40);
}

void print_cameras(const json& j) {
  const json& view = j["view"];
  for (std::size_t n = 0; n < j["cameras"].size(); ++n) {
    const json& c = j["cameras"][n];
    fmt::print("  camera {:<4} {}, {}", n, quoted(c["name"]), c["type"].get<std::string>());
    std::vector<std::string> nodes;
    for (const json& name : c["nodes"]) nodes.push_back(quoted(name));
    if (nodes.empty()) fmt::print(", in no node");
    if (!nodes.empty() && nodes != std::vector{quoted(c["name"])}) fmt::print(", node {}", fmt::join(nodes, ", "));
    if (c.contains("aperture_radius"))
      fmt::print(", lens of radius {:g} focused at {:g}", c["aperture_radius"].get<double>(),
                 c["focus_distance"].get<double>());
    fmt::print("{}\n", view.value("camera", json()) == n ? "" : ", not used");
  }
  if (view["automatic"].get<bool>())
    fmt::print("  camera auto {}the scene is framed automatically\n", j["cameras"].empty() ? "none: " : "");
}

void print_shadows(const json& j) {
  for (const json& s : j["shadows"]) {
    const auto maps = s["max_maps"].get<std::uint64_t>();
    fmt::print("  shadows     light {}, {}: {}{} map{} of {}x{}", s["light"].dump(), s["type"].get<std::string>(),
               s["type"] == "directional" || maps <= 1 ? "" : "at most ", maps, maps == 1 ? "" : "s", s["size"].dump(),
               s["size"].dump());
    if (s["distance"] != 0) fmt::print(" up to {:g} from the camera", s["distance"].get<double>());
    fmt::print(", {}", human_bytes(s["max_bytes"].get<std::uint64_t>()));
    if (s["nodes"] != 1) fmt::print(", in {} nodes", s["nodes"].dump());
    fmt::print("\n");
  }
}

// Names of attachments behind a word; nothing where there are none.
std::string listed(const char* word, const json& names) {
  if (names.empty()) return "";
  std::vector<std::string> texts;
  for (const json& name : names) texts.push_back(quoted(name));
  return fmt::format(" {} {}", word, fmt::join(texts, " "));
}

void print_graph(const json& j) {
  const json& graph = j["graph"];
  if (graph.is_null()) return;
  for (const json& a : graph["attachments"]) {
    fmt::print("  attachment  {}: {}", quoted(a["name"]), a["format"].get<std::string>());
    if (!a["size"].is_null()) fmt::print(", {}x{}", a["size"][0].dump(), a["size"][1].dump());
    if (!a["scale"].is_null() && a["scale"] != 1) fmt::print(", {:g} of the frame", a["scale"].get<double>());
    if (!a["samples"].is_null()) fmt::print(", {} samples", a["samples"].dump());
    if (a["layers"] != 1) fmt::print(", {} layers", a["layers"].dump());
    if (a["levels"] != 1) fmt::print(", {} levels", a["levels"].dump());
    fmt::print(", {}\n", a["life"].get<std::string>());
  }
  for (const json& p : graph["passes"]) {
    fmt::print("  pass        {}: ", quoted(p["name"]));
    for (std::size_t s = 0; s < p["subpasses"].size(); ++s) {
      const json& subpass = p["subpasses"][s];
      fmt::print("{}{}", s == 0 ? "" : "; ", subpass["shader"].get<std::string>());
      if (subpass["draw"] != "nothing") fmt::print(" draws {}", subpass["draw"].get<std::string>());
      fmt::print("{}{}{}", listed("inputs", subpass["input"]), listed("samples", subpass["sample"]),
                 listed("writes", subpass["write"]));
    }
    fmt::print(", {} B of tile memory a sample\n", p["tile_bytes_per_sample"].dump());
  }
}

void print_animations(const json& j) {
  for (std::size_t n = 0; n < j["animations"].size(); ++n) {
    const json& a = j["animations"][n];
    const double seconds = a["seconds"].get<double>(), rate = j["settings"]["frame_rate"].get<double>();
    fmt::print("  anim. {:<5} {}: {} channels, {:g} s, frames 0:{:.0f}{}\n", n, quoted(a["name"]), a["channels"].dump(),
               seconds, std::floor(seconds * rate) + 1, a["played"].get<bool>() ? "" : ", not played");
  }
}

void print_table(const json& j) {
  fmt::print("{}  {}\n", escape_control(j["file"].get<std::string>()), human_bytes(j["bytes"].get<std::uint64_t>()));
  const json &drawn = j["drawn"], &s = j["settings"];
  fmt::print("  drawn       {} nodes, {} base patches: {} Bezier patches, {} clusters of {} triangles\n",
             drawn["nodes"].dump(), drawn["base_patches"].dump(), drawn["bezier_patches"].dump(),
             drawn["clusters"].dump(), drawn["triangles"].dump());
  if (drawn["instances"] != 0) fmt::print("  instances   {}\n", drawn["instances"].dump());
  if (drawn["procedures"] != 0) fmt::print("  procedures  {}\n", drawn["procedures"].dump());
  fmt::print("  settings    {}x{}, {} frames/s, shutter {} to {}, frames {}:{}{}\n", s["resolution"][0].dump(),
             s["resolution"][1].dump(), s["frame_rate"].dump(), s["shutter"][0].dump(), s["shutter"][1].dump(),
             s["first_frame"].dump(), s["first_frame"].get<int>() + s["frames"].get<int>(),
             s["declared"].get<bool>() ? "" : " (defaults: the capture says nothing)");
  if (j["scenes"].size() > 1)
    for (std::size_t n = 0; n < j["scenes"].size(); ++n)
      fmt::print("  scene {:<5} {}{}\n", n, quoted(j["scenes"][n]["name"]),
                 j["scenes"][n]["drawn"].get<bool>() ? "" : ", not drawn");
  print_cameras(j);
  fmt::print("  lights      {}\n", j["lights"].dump());
  print_shadows(j);
  print_graph(j);
  if (!j["variants"].empty()) {
    std::vector<std::string> names;
    for (const json& name : j["variants"]) names.push_back(quoted(name));
    fmt::print("  variants    {}\n", fmt::join(names, ", "));
  }
  for (const json& m : j["meshes"]) {
    fmt::print("  mesh        {}: {} vertices", quoted(m["name"]), m["vertices"].dump());
    if (m["triangles"] != 0) fmt::print(", {} triangles", m["triangles"].dump());
    if (m["bezier_patches"] != 0) fmt::print(", {} Bezier patches", m["bezier_patches"].dump());
    if (m["points"] != 0) fmt::print(", {} points", m["points"].dump());
    if (m["lines"] != 0) fmt::print(", {} lines", m["lines"].dump());
    if (m["morph_targets"] != 0) fmt::print(", {} morph targets", m["morph_targets"].dump());
    if (m["skinned"].get<bool>()) fmt::print(", skinned");
    fmt::print("\n");
  }
  for (const json& m : j["materials"]) {
    fmt::print("  material    {}: {}", quoted(m["name"]), m["alpha"].get<std::string>());
    if (m["double_sided"].get<bool>()) fmt::print(", double sided");
    if (m["unlit"].get<bool>()) fmt::print(", unlit");
    for (const auto& [name, size] : m["textures"].items()) {
      const json& file = m["texture_files"][name];
      fmt::print(", {} {}x{} {}", name, size[0].dump(), size[1].dump(), file["format"].get<std::string>());
      if (file["levels"] != 1) fmt::print(" of {} levels", file["levels"].dump());
    }
    fmt::print("\n");
  }
  print_animations(j);
  for (const bool read : {true, false}) {
    std::vector<std::string> names;
    for (const json& e : j["extensions"])
      if (e["read"].get<bool>() == read) names.push_back(escape_control(e["name"].get<std::string>(), 60));
    if (!names.empty()) fmt::print("  extensions  {}: {}\n", read ? "read" : "not read", fmt::join(names, ", "));
  }
  for (const json& notice : j["notices"]) fmt::print("  note        {}\n", notice.get<std::string>());
}

// Whether a path is the folder or the statistics of a replay, rather than a capture.
bool names_run(const std::filesystem::path& path) {
  std::error_code ignored;
  const FileKind kind = kind_of(path);
  return kind == FileKind::kStatistics ||
         (kind == FileKind::kFolder && std::filesystem::is_regular_file(path / "stats.json", ignored));
}

// Says time, bound, traffic and energy of a replay again.
void print_run(const std::filesystem::path& path, bool as_json) {
  const RunStatistics run = read_run(path);
  try {
    const json& total = run.root.at("total");
    const auto frames = total.at("frames").get<std::uint64_t>();
    if (frames == 0) throw InputError(run.file.string(), "/total/frames", "is not positive");
    if (as_json) {
      fmt::print("{}\n", json_text(total, 2));
      return;
    }
    fmt::print("{}: {} frame{} of {}\n{}", escape_control(path.string()), frames, frames == 1 ? "" : "s",
               escape_control(run.root.at("capture").at("file").get<std::string>()),
               replay_summary(run.root, escape_control(run.file.string())));
  } catch (const json::exception&) {
    throw InputError(run.file.string(), "", "holds no sum of a replay's frames: replay the capture again");
  }
}

class InspectCommand final : public Command {
 public:
  explicit InspectCommand(CLI::App& app) {
    add_capture_argument(app, capture_);
    app.add_flag("--json", json_, "As JSON");
    add_strict_flag(app, strict_);
    add_view_options(app, view_, kViewGroup);
    add_shutter_option(app, view_.shutter, kViewGroup);
    app.footer(
        "Given the folder of a replay, or its stats.json, prints time, bound, traffic, energy and "
        "power of its frames.\n"
        "Lists the scenes, cameras and animations for --scene, --camera and --animation of a replay, "
        "each with its number; with these options, describes the drawn part.");
  }
  void run() override {
    if (names_run(capture_)) {
      print_run(capture_, json_);
      return;
    }
    json report;
    {
      const LongStep step("reading " + escape_control(capture_), LongStep::quiet_without_terminal());
      scene::SceneList scenes;
      const Capture capture = read_capture(capture_, {.strict = strict_, .audit = true}, view_, std::nullopt, &scenes);
      report = inspect(capture, scenes, json_);
    }
    if (json_)
      fmt::print("{}\n", json_text(report, 2));
    else
      print_table(report);
  }

 private:
  std::string capture_;
  ViewChoices view_;
  bool json_ = false, strict_ = false;
};

}  // namespace

std::unique_ptr<Command> make_inspect_command(CLI::App& app) { return std::make_unique<InspectCommand>(app); }

}  // namespace tessera::replay
