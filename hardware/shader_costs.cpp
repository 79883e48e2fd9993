#include "hardware/shader_costs.h"

#include <algorithm>
#include <charconv>
#include <initializer_list>
#include <numeric>
#include <utility>
#include <vector>

#include "base/check.h"
#include "hardware/shader_cost_table.h"

namespace tessera::hardware {

namespace {

using Features = ShaderFeatures;

constexpr std::array<std::string_view, 4> kSurfaceNames = {"triangles", "patch", "displaced_patch", "computed"};
constexpr std::array<std::string_view, 3> kMotionNames = {"still", "moving", "deforming"};
constexpr std::array<std::string_view, Features::kLightKinds> kLightNames = {"directional", "point", "point_in_range",
                                                                             "spot", "spot_in_range"};
constexpr std::array<std::string_view, Features::kShadowProjections> kShadowNames = {"orthographic", "perspective"};
constexpr std::array<std::string_view, 3> kShadowFilterNames = {"nearest", "2x2", "3x3"};

std::string_view take(std::string_view& text, char end) {
  const std::size_t at = std::min(text.find(end), text.size());
  const std::string_view part = text.substr(0, at);
  text.remove_prefix(std::min(at + 1, text.size()));
  return part;
}

std::int32_t whole_number(std::string_view text) {
  std::int32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  TESSERA_CHECK(error == std::errc() && end == text.data() + text.size(), "shader_costs.csv holds whole numbers");
  return value;
}

// Reads the table; rows are sorted by name.
std::vector<ShaderCostRow> read_table(std::string_view text) {
  std::vector<ShaderCostRow> rows;
  bool heading = true;
  while (!text.empty()) {
    std::string_view line = take(text, '\n');
    if (line.empty() || line.front() == '#') continue;
    if (std::exchange(heading, false)) continue;
    ShaderCostRow row;
    row.name = take(line, ',');
    for (std::int32_t* number : {&row.cost.vector_operations, &row.cost.transcendental, &row.cost.scalar,
                                 &row.cost.texture_instructions, &row.cost.memory, &row.cost.registers})
      *number = whole_number(take(line, ','));
    rows.push_back(row);
  }
  std::sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return rows;
}

const ShaderCost& row_of(std::string_view name) {
  const std::span<const ShaderCostRow> rows = shader_cost_rows();
  const auto at =
      std::lower_bound(rows.begin(), rows.end(), name, [](const auto& row, auto wanted) { return row.name < wanted; });
  TESSERA_CHECK(at != rows.end() && at->name == name, "every feature of a shader has its row");
  return at->cost;
}

// A sum of rows. Its registers are the whole shader's plus the largest increment of a feature: features need their
// registers at different places.
struct Sum {
  ShaderCost cost;
  std::int32_t added_registers = 0;

  explicit Sum(const ShaderCost& whole) : cost(whole) {}
  void add(const ShaderCost& row, std::int32_t times = 1) {
    cost.vector_operations += times * row.vector_operations;
    cost.transcendental += times * row.transcendental;
    cost.scalar += times * row.scalar;
    cost.texture_instructions += times * row.texture_instructions;
    cost.memory += times * row.memory;
    if (times > 0) added_registers = std::max(added_registers, row.registers);
  }
  ShaderCost total() const {
    ShaderCost all = cost;
    all.registers += added_registers;
    return all;
  }
};

std::string joined(std::initializer_list<std::string_view> parts) {
  std::string name;
  for (const std::string_view part : parts) name.append(name.empty() ? "" : "/").append(part);
  return name;
}

// Whether textures are read at texture coordinates, whose derivatives the shader then has.
bool has_coordinates(const Features& f) {
  return f.base_color || f.metallic_roughness || f.occlusion || f.emissive || f.height_normals ||
         f.normals != Features::Normals::kOfSurface;
}

// Adds the textures and vertex colours of a pixel shader.
void add_textures(const Features& f, std::string_view surface, std::string_view motion, std::string_view derivatives,
                  Sum& sum) {
  const std::string_view corners = f.surface == Features::Surface::kTriangles ? "triangles" : "patch";
  if (f.vertex_colors) sum.add(row_of(joined({"add/vertex_colors", corners})));
  const bool mapped = f.normals != Features::Normals::kOfSurface;
  const std::array<std::pair<bool, std::string_view>, 4> slots = {{{f.base_color, "add/base_color"},
                                                                   {f.metallic_roughness, "add/metallic_roughness"},
                                                                   {f.occlusion, "add/occlusion"},
                                                                   {f.emissive, "add/emissive"}}};
  for (const auto& [there, name] : slots)
    if (there) {
      // The fill half does not look at the environment's table, whose rows a texture of roughness sets apart.
      const bool fills = f.stage == Features::Stage::kFill && name == "add/metallic_roughness";
      sum.add(row_of(joined({fills ? std::string_view("add/fill/metallic_roughness") : name, derivatives})));
    }
  if (f.height_normals) sum.add(row_of(joined({"add/height_normals", motion, derivatives})));
  if (has_coordinates(f)) {
    // The row also includes the first texture, the base colour's.
    sum.add(row_of(joined({"add/coordinate", f.unlit ? "unlit" : "lit", surface, motion, derivatives})));
    sum.add(row_of(joined({"add/base_color", derivatives})), -1);
    if (f.coordinates > 1) sum.add(row_of(joined({"add/coordinate_apart", corners, derivatives})), f.coordinates - 1);
  }
  if (!mapped) return;
  const bool given = f.normals == Features::Normals::kMappedAlongTangents;
  sum.add(row_of(joined({"add/normal", surface, motion, given ? "along_tangents" : "mapped"})));
  if (!f.quads) {  // the row is for quads; its lookup's level of detail costs as much as any other texture's
    sum.add(row_of("add/base_color/surface"));
    sum.add(row_of("add/base_color/quads"), -1);
  }
}

}  // namespace

std::span<const ShaderCostRow> shader_cost_rows() {
  static const std::vector<ShaderCostRow> kRows = read_table(shader_cost_table().at("shader_costs.csv"));
  return kRows;
}

namespace {

// Adds the material extensions of a lit pixel shader.
void add_layers(const Features& f, std::string_view surface, std::string_view motion, std::string_view derivatives,
                Sum& sum) {
  if (!f.layered()) return;
  const std::int32_t lights = std::accumulate(f.lights.begin(), f.lights.end(), 0);
  const bool apart = f.normals != Features::Normals::kOfSurface || f.coat_normals;  // coat and base have two normals
  const std::string coat = joined({"clearcoat", apart ? "mapped" : "of_surface",
                                   f.metallic_roughness ? "roughness_of_texture" : "roughness_of_factor"});
  const auto add = [&](std::string_view layer) {
    const std::string_view name = layer == "clearcoat" ? std::string_view(coat) : layer;
    sum.add(row_of(joined({"add/layer_light", name})), lights);
    if (name != "anisotropy") sum.add(row_of(joined({"add/layer", name})));
  };
  add("base");
  for (const std::string_view layer : f.layers) add(layer);
  if (f.layer_textures > 0) sum.add(row_of(joined({"add/layer_texture", derivatives})), f.layer_textures);
  const bool of_triangles = f.surface == Features::Surface::kTriangles;
  const auto needed = f.surface == Features::Surface::kComputed ? std::string_view("triangles") : surface;
  if (f.coat_normals)
    sum.add(row_of(
        joined({"add/normal", needed, motion,
                of_triangles && f.normals == Features::Normals::kMappedAlongTangents ? "along_tangents" : "mapped"})));
  if (f.has("anisotropy"))
    sum.add(row_of(joined({"add/layer/anisotropy", needed, motion,
                           f.normals == Features::Normals::kOfSurface ? "of_surface" : "mapped"})));
}

// Adds an image of the environment to a lit pixel shader, and subtracts the built-in environment.
void add_environment(const Features& f, Sum& sum) {
  if (!f.environment_image) return;
  sum.add(
      row_of(f.metallic_roughness ? "add/environment/roughness_of_texture" : "add/environment/roughness_of_factor"));
  if (f.has("clearcoat")) sum.add(row_of("add/environment/clearcoat"));
  if (f.has("diffuse_transmission")) sum.add(row_of("add/environment/diffuse_transmission"));
}

// Adds to a lit pixel shader the cost of lights that cast shadows. Moving surfaces go into maps at both motion keys.
void add_shadows(const Features& f, std::string_view surface, std::string_view motion, Sum& sum) {
  const bool computed = f.surface == Features::Surface::kComputed;
  const std::string_view receiver = f.motion == Features::Motion::kStill || computed ? "still" : "moving";
  bool any = false;
  for (std::size_t projection = 0; projection < f.shadows.size(); ++projection) {
    const Features::ShadowCasters& casters = f.shadows[projection];
    if (casters.lookups == 0) continue;
    any = true;
    const std::string_view name = kShadowNames[projection];
    const std::string_view filter = kShadowFilterNames[static_cast<std::size_t>(f.shadow_filter)];
    sum.add(row_of(joined({"add/shadow", name, filter, receiver})), casters.lookups);
    if (casters.layered == 0) continue;
    sum.add(row_of(joined({"add/shadow_layers", name, receiver})), casters.layered);
    sum.add(row_of(joined({"add/shadow_layer", name, receiver})), casters.layers - casters.lookups);
  }
  if (!any || f.packed) return;
  if (f.stage == Features::Stage::kLight) return sum.add(row_of(joined({"add/shadows/light", surface, motion})));
  if (computed) return sum.add(row_of(joined({"add/shadows", surface, motion})));
  const bool has_derivatives = has_coordinates(f) && !f.quads;  // the surface's own
  sum.add(row_of(joined({"add/shadows", surface, motion, has_derivatives ? "surface" : "quads"})));
}

ShaderCost fill_cost(const Features& f, std::string_view surface, std::string_view motion,
                     std::string_view derivatives) {
  Sum sum(row_of(joined({"fill", surface, motion})));
  add_textures(f, surface, motion, derivatives, sum);
  if (f.packed) sum.add(row_of("add/fill/packed"));
  ShaderCost cost = sum.total();
  // Rows of textures are measured where the code of lights decides how many registers a shader needs.
  if (has_coordinates(f)) {
    const ShaderCost& textures = row_of(joined({"add/fill/textures", surface, motion, derivatives}));
    cost.registers = std::max(cost.registers, row_of(joined({"fill", surface, motion})).registers + textures.registers);
  }
  return cost;
}

void add_lights(const Features& f, Sum& sum) {
  bool any_light = false;
  for (std::size_t kind = 0; kind < f.lights.size(); ++kind)
    if (f.lights[kind] > 0) {
      any_light = true;
      sum.add(row_of(joined({"add/light", kLightNames[kind], f.lights_move ? "moving" : "still"})), f.lights[kind]);
    }
  if (any_light) sum.add(row_of("add/lights"));
}

// Every lane has a roughness of its own, as with a texture of it.
ShaderCost light_cost(Features f, std::string_view surface, std::string_view motion) {
  Sum sum(row_of(f.packed ? joined({"light/packed", f.motion == Features::Motion::kStill ? "still" : "moving"})
                          : joined({"light", surface, motion})));
  add_lights(f, sum);
  const bool placed = std::any_of(f.lights.begin() + 1, f.lights.end(), [](auto count) { return count > 0; });
  if (placed && !f.packed) {
    ShaderCost first = row_of(joined({"add/lights/light", surface, motion}));
    if (f.environment_image)
      first.registers = 0;  // it adds them to the built-in environment's, which an image replaces
    sum.add(first);
    sum.add(row_of("add/lights"), -1);
    sum.add(row_of("add/light/point_in_range/still"), -1);
  }
  f.metallic_roughness = true;
  add_environment(f, sum);
  f.base_color = f.occlusion = f.emissive = f.metallic_roughness = f.height_normals = false;
  f.normals = Features::Normals::kOfSurface;
  if (f.packed) {
    const bool casts = std::ranges::any_of(f.shadows, [](const auto& casters) { return casters.lookups > 0; });
    if (casts) sum.add(row_of("add/shadows/packed"));
    f.surface = Features::Surface::kComputed;
  }
  f.quads = true;
  add_shadows(f, surface, motion, sum);
  return sum.total();
}

}  // namespace

ShaderCost shader_cost(const ShaderFeatures& f) {
  const std::string_view surface = kSurfaceNames[static_cast<std::size_t>(f.surface)];
  const bool patch = f.surface == Features::Surface::kPatch || f.surface == Features::Surface::kDisplacedPatch;
  // Pixel shaders receive posed vertices, so only patches are evaluated at both keys.
  const bool evaluates = patch || f.stage == Features::Stage::kDomain;
  const Features::Motion motion_taken = evaluates ? f.motion : std::min(f.motion, Features::Motion::kMoving);
  const std::string_view motion = kMotionNames[static_cast<std::size_t>(motion_taken)];
  const std::string_view derivatives = f.quads ? "quads" : "surface";
  if (f.stage == Features::Stage::kBackground)
    return row_of(joined({"background", f.environment_image ? "image" : "studio", motion}));
  if (f.stage == Features::Stage::kOutputs) {
    TESSERA_CHECK(patch, "vertices of meshes have their attributes");
    Sum sum(row_of(joined({f.height_normals ? "outputs_under_heights" : "outputs", surface, motion})));
    if (f.coordinates > 0) sum.add(row_of("add/outputs/coordinate"), f.coordinates);
    if (f.vertex_colors) sum.add(row_of("add/outputs/vertex_colors"));
    if (f.normals == Features::Normals::kMappedAlongTangents) sum.add(row_of(joined({"add/outputs/tangent", motion})));
    return sum.total();
  }
  if (f.stage == Features::Stage::kDomain) {
    TESSERA_CHECK(f.surface != Features::Surface::kComputed, "procedures have no vertices");
    return row_of(joined({"domain", surface, motion}));
  }
  if (f.stage == Features::Stage::kAlphaTest) {
    TESSERA_CHECK(f.surface != Features::Surface::kComputed, "procedures have no alpha test");
    Sum sum(row_of(joined({"alpha_test", surface, motion, derivatives})));
    if (f.vertex_colors) sum.add(row_of(joined({"add/vertex_colors", patch ? "patch" : "triangles"})));
    return sum.total();
  }
  if (f.stage == Features::Stage::kFill) return fill_cost(f, surface, motion, derivatives);
  if (f.stage == Features::Stage::kLight) return light_cost(f, surface, motion);
  Sum sum(f.unlit ? row_of("unlit") : row_of(joined({"lit", surface, motion})));
  if (f.surface != Features::Surface::kComputed) add_textures(f, surface, motion, derivatives, sum);
  if (f.unlit) return sum.total();
  add_lights(f, sum);
  add_layers(f, surface, motion, derivatives, sum);
  add_environment(f, sum);
  add_shadows(f, surface, motion, sum);
  return sum.total();
}

double issue_cycles(const ShaderCost& cost, std::int64_t warp_lanes, std::int64_t lanes) {
  const double passes = std::max(1.0, static_cast<double>(warp_lanes) / static_cast<double>(lanes));
  return std::max(static_cast<double>(lane_clocks(cost)) * passes, static_cast<double>(cost.scalar));
}

}  // namespace tessera::hardware
