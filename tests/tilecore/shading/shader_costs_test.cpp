// Costs of shaders: the table against the compiler, sums of its rows against shaders compiled whole, and the rows
// that shipped captures need.
#include "hardware/shader_costs.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"
#include "tilecore/shading/shader_features.h"

namespace tessera::tilecore::shader_costs_test {
namespace {

using hardware::shader_cost;
using hardware::ShaderCost;
using hardware::ShaderFeatures;
using Surface = ShaderFeatures::Surface;
using Motion = ShaderFeatures::Motion;
using Normals = ShaderFeatures::Normals;
using Stage = ShaderFeatures::Stage;

const char* const kScript = TESSERA_SOURCE_DIR "/tilecore/shading/cost/make_costs.py";
const char* const kTable = TESSERA_SOURCE_DIR "/hardware/shader_costs.csv";
const char* const kClang = "/usr/bin/clang++";

// ---- The table ------------------------------------------------------------------------------------------------------

// "clang version 14", or why there is none that could make the table again.
std::string compiler_or_reason() {
  const test::ProcessResult version = test::run_process({kClang, "--version"});
  if (version.status != 0) return "no clang++";
  const test::ProcessResult targets = test::run_process({kClang, "--print-targets"});
  if (targets.output.find("amdgcn") == std::string::npos) return "clang++ has no amdgcn target";
  const std::string made_with = test::read_text(kTable);
  const std::size_t at = made_with.find("clang version ");
  const std::string major = made_with.substr(at, made_with.find('.', at) - at);
  if (version.output.find(major + ".") == std::string::npos) return "the table was made with " + major;
  return "";
}

std::map<std::string, std::string> rows_by_name(const std::string& csv) {
  std::map<std::string, std::string> rows;
  std::istringstream stream(csv);
  for (std::string line; std::getline(stream, line);)
    if (!line.empty() && line[0] != '#') rows[line.substr(0, line.find(','))] = line;
  return rows;
}

// Rows that are in `made` but not, or otherwise, in `kept`.
std::vector<std::string> rows_that_differ(const std::string& made, const std::string& kept) {
  const std::map<std::string, std::string> all = rows_by_name(kept);
  std::vector<std::string> found;
  for (const auto& [name, row] : rows_by_name(made))
    if (const auto at = all.find(name); at == all.end() || at->second != row) found.push_back(row);
  return found;
}

std::string made_again(const std::string& only) {
  const test::ProcessResult made =
      test::run_process({"/usr/bin/env", "python3", kScript, "--clang", kClang, "--only", only}, {.seconds = 1500});
  EXPECT_EQ(made.status, 0) << made.errors;
  return made.output;
}

// SHADE1, for some rows of each kind.
TEST(ShaderCosts, RowsOfTheTableEqualTheCompilers) {
  if (const std::string reason = compiler_or_reason(); !reason.empty()) GTEST_SKIP() << reason;
  const std::string made = made_again(
      "^(unlit|lit/triangles/still|lit/computed/still|add/base_color/quads|alpha_test/triangles/still/quads|"
      "domain/patch/still|outputs/patch/still|background/studio/still|add/shadow/orthographic/2x2/still|"
      "fill/triangles/still|light/triangles/still|light/packed/still|add/fill/packed)$");
  EXPECT_EQ(rows_by_name(made).size(), 14u) << "thirteen rows and the heading";
  EXPECT_THAT(rows_that_differ(made, test::read_text(kTable)), testing::IsEmpty())
      << "run: tilecore/shading/cost/make_costs.py > hardware/shader_costs.csv";
}

TEST(ShaderCosts, ARowThatTheCompilerDoesNotGiveIsCaught) {
  EXPECT_THAT(rows_that_differ("shader,a\nlit,4\nunlit,2\n", "shader,a\nlit,4\nunlit,3\n"),
              testing::ElementsAre("unlit,2"));
  EXPECT_THAT(rows_that_differ("lit,4\n", "shader,a\n"), testing::ElementsAre("lit,4"));
}

// SHADE1.
TEST(ShaderCostsWhole, TheTableEqualsTheCompilersCode) {
  if (const std::string reason = compiler_or_reason(); !reason.empty()) GTEST_SKIP() << reason;
  EXPECT_EQ(made_again(""), test::read_text(kTable))
      << "run: tilecore/shading/cost/make_costs.py > hardware/shader_costs.csv";
}

TEST(ShaderCosts, TheLibraryHoldsTheTable) {
  std::set<std::string> names;
  for (const auto& row : hardware::shader_cost_rows()) names.emplace(row.name);
  std::set<std::string> in_file;
  for (const auto& [name, row] : rows_by_name(test::read_text(kTable)))
    if (name != "shader") in_file.insert(name);
  EXPECT_EQ(names, in_file);
  EXPECT_GT(names.size(), 90u);
}

// ---- Sums -----------------------------------------------------------------------------------------------------------

std::string surface_name(Surface surface) {
  return std::array{"triangles", "patch", "displaced_patch", "computed"}[static_cast<std::size_t>(surface)];
}

// As make_costs.py --whole reads it; a second coordinate is the emissive texture's, lights are of one kind and cast into as
// many maps each.
std::string whole_shader(const ShaderFeatures& f) {
  std::ostringstream out;
  if (f.stage == Stage::kFill || f.stage == Stage::kLight)
    out << (f.stage == Stage::kFill ? "stage=fill " : "stage=light ") << (f.packed ? "packed=1 " : "");
  out << "surface=" << surface_name(f.surface)
      << " motion=" << std::array{"still", "moving", "deforming"}[static_cast<std::size_t>(f.motion)]
      << " normals=" << std::array{"of_surface", "mapped", "along_tangents"}[static_cast<std::size_t>(f.normals)];
  const auto flag = [&](const char* name, bool set) {
    if (set) out << ' ' << name << "=1";
  };
  flag("quads", f.quads), flag("unlit", f.unlit), flag("colors", f.vertex_colors), flag("base_color", f.base_color);
  flag("metallic_roughness", f.metallic_roughness), flag("occlusion", f.occlusion), flag("emissive", f.emissive);
  flag("apart", f.coordinates > 1), flag("light_moves", f.lights_move);
  flag("environment_image", f.environment_image), flag("height_normals", f.height_normals);
  const std::array kinds = {"directional", "point", "point_in_range", "spot", "spot_in_range"};
  for (std::size_t kind = 0; kind < kinds.size(); ++kind)
    if (f.lights[kind] > 0) out << " lights=" << f.lights[kind] << " light=" << kinds[kind];
  flag("layered", f.layered()), flag("layer_texture", f.layer_textures > 0), flag("coat_normals", f.coat_normals);
  for (const std::string_view layer : f.layers) flag(layer.data(), true);
  for (const ShaderFeatures::ShadowCasters& casters : f.shadows)
    if (casters.lookups > 0)
      out << " shadows=" << casters.lookups << " shadow_layers=" << casters.layers / casters.lookups;
  out << " shadow_filter=" << std::array{"nearest", "2x2", "3x3"}[static_cast<std::size_t>(f.shadow_filter)];
  return out.str();
}

// Within a share of the compiled one; small shaders within some instructions.
bool close(std::int32_t sum, std::int32_t compiled, double share, std::int32_t least) {
  return std::abs(sum - compiled) <= std::max(static_cast<double>(least), share * compiled);
}

// Lights of one kind that cast, each into `layers` maps.
ShaderFeatures casting(ShaderFeatures f, std::size_t kind, std::uint16_t lights, std::uint16_t layers,
                       ShaderFeatures::ShadowFilter filter) {
  f.lights[kind] = lights;
  f.shadows[kind == 0 ? 0 : 1] = {lights, layers > 1 ? lights : std::uint16_t{0},
                                  static_cast<std::uint16_t>(lights * layers)};
  f.shadow_filter = filter;
  return f;
}

// Shaders of every surface that look shadows up.
std::vector<ShaderFeatures> with_shadows() {
  using Filter = ShaderFeatures::ShadowFilter;
  ShaderFeatures plain, textured, patch, displaced, computed, layered;
  textured.base_color = textured.metallic_roughness = true, textured.normals = Normals::kMapped;
  patch.surface = Surface::kPatch, patch.motion = Motion::kMoving, patch.base_color = true;
  displaced.surface = Surface::kDisplacedPatch, displaced.motion = Motion::kDeforming;
  computed.surface = Surface::kComputed, computed.motion = Motion::kMoving;
  layered = textured;
  layered.quads = true, layered.layers = {"clearcoat"};
  ShaderFeatures moving = textured;
  moving.motion = Motion::kMoving, moving.quads = true;
  return {casting(plain, 0, 1, 1, Filter::k2x2),         casting(plain, 0, 2, 4, Filter::kNearest),
          casting(textured, 3, 2, 1, Filter::k3x3),      casting(textured, 1, 1, 3, Filter::k2x2),
          casting(moving, 0, 1, 4, Filter::k3x3),        casting(moving, 3, 2, 1, Filter::k2x2),
          casting(patch, 0, 1, 1, Filter::k2x2),         casting(patch, 0, 1, 2, Filter::k2x2),
          casting(displaced, 4, 1, 1, Filter::kNearest), casting(computed, 0, 1, 4, Filter::k2x2),
          casting(layered, 0, 2, 2, Filter::k2x2)};
}

// Halves of shaders with a G-buffer.
std::vector<ShaderFeatures> halves() {
  using Filter = ShaderFeatures::ShadowFilter;
  ShaderFeatures fill, light;
  fill.stage = Stage::kFill, light.stage = Stage::kLight;
  std::vector<ShaderFeatures> all;
  for (const Surface surface : {Surface::kTriangles, Surface::kPatch})
    for (const bool packed : {false, true}) {
      ShaderFeatures f = fill;
      f.surface = surface, f.packed = packed, f.quads = packed;
      f.base_color = f.metallic_roughness = f.occlusion = f.emissive = true;
      all.push_back(f);
      f.normals = Normals::kMapped, f.vertex_colors = true;
      all.push_back(f);
      ShaderFeatures lit = light;
      lit.surface = packed ? Surface::kTriangles : surface, lit.packed = packed;
      lit.lights[2] = 2;
      all.push_back(lit);
      lit.environment_image = true, lit.motion = Motion::kMoving;
      all.push_back(lit);
      all.push_back(casting(light, 0, 1, 1, Filter::k2x2));
      all.back().surface = lit.surface, all.back().packed = packed;
    }
  return all;
}

// SHADE3.
TEST(ShaderCostsWhole, SumsAreCloseToShadersCompiledAtOnce) {
  if (const std::string reason = compiler_or_reason(); !reason.empty()) GTEST_SKIP() << reason;
  std::vector<ShaderFeatures> all;
  for (const Surface surface : {Surface::kTriangles, Surface::kPatch, Surface::kDisplacedPatch})
    for (const bool quads : {false, true}) {
      ShaderFeatures f;
      f.surface = surface, f.quads = quads;
      f.base_color = f.metallic_roughness = f.occlusion = f.emissive = true;
      all.push_back(f);
      f.normals = Normals::kMapped, f.vertex_colors = true, f.coordinates = 2;
      all.push_back(f);
      f.motion = Motion::kMoving, f.lights[3] = 2;
      all.push_back(f);
    }
  ShaderFeatures f;
  f.normals = Normals::kMappedAlongTangents, f.metallic_roughness = true, f.quads = true, f.lights[1] = 1;
  all.push_back(f);
  ShaderFeatures heights;
  heights.height_normals = heights.base_color = heights.metallic_roughness = true, heights.motion = Motion::kMoving;
  all.push_back(heights);
  heights.quads = true, heights.lights[0] = 1;
  all.push_back(heights);
  ShaderFeatures unlit;
  unlit.unlit = unlit.base_color = unlit.vertex_colors = true;
  all.push_back(unlit);
  const auto with_layers = [&](ShaderFeatures plain, std::vector<std::string_view> layers) {
    plain.layers = std::move(layers);
    all.push_back(plain);
  };
  ShaderFeatures still, textured, lit;
  textured.quads = textured.base_color = textured.metallic_roughness = true, textured.normals = Normals::kMapped;
  lit = textured;
  lit.lights[0] = 2;
  with_layers(still, {"dielectric", "clearcoat"});
  with_layers(still, {"sheen", "iridescence"});
  with_layers(still, {"transmission", "volume", "dispersion"});
  with_layers(textured, {"anisotropy", "clearcoat"});
  with_layers(lit, {"clearcoat", "sheen"});
  lit.metallic_roughness = false;  // the glossiness's texture is one of the layers'
  with_layers(lit, {"specular_glossiness", "diffuse_transmission"});
  textured.surface = Surface::kPatch, textured.layer_textures = 1;
  with_layers(textured, {"clearcoat", "transmission"});
  const std::vector<ShaderFeatures> shadowed = with_shadows();
  all.insert(all.end(), shadowed.begin(), shadowed.end());
  const std::vector<ShaderFeatures> cut = halves();
  all.insert(all.end(), cut.begin(), cut.end());
  std::vector<std::string> command = {"/usr/bin/env", "python3", kScript, "--clang", kClang, "--whole"};
  for (const ShaderFeatures& one : all) command.push_back(whole_shader(one));
  const test::ProcessResult made = test::run_process(command, {.seconds = 1700});
  ASSERT_EQ(made.status, 0) << made.errors;
  std::map<std::string, std::string> rows = rows_by_name(made.output);
  for (const ShaderFeatures& one : all) {
    const std::string name = whole_shader(one);
    ShaderCost compiled;
    ASSERT_EQ(std::sscanf(rows.at(name).c_str() + name.size(), ",%d,%d,%d,%d,%d,%d", &compiled.vector_operations,
                          &compiled.transcendental, &compiled.scalar, &compiled.texture_instructions, &compiled.memory,
                          &compiled.registers),
              6);
    const ShaderCost sum = shader_cost(one);
    const double share = one.stage == Stage::kFill ? 0.07 : 0.05;
    EXPECT_TRUE(close(sum.vector_operations, compiled.vector_operations, share, 6))
        << name << ": " << sum.vector_operations << ", compiled " << compiled.vector_operations;
    EXPECT_EQ(sum.texture_instructions, compiled.texture_instructions) << name;
    EXPECT_TRUE(close(sum.transcendental, compiled.transcendental, 0.15, 4))
        << name << ": " << sum.transcendental << ", compiled " << compiled.transcendental;
    EXPECT_TRUE(close(sum.registers, compiled.registers, 0.35, 16))
        << name << ": " << sum.registers << " registers, compiled " << compiled.registers;
  }
}

// Features that may be added to a shader, one at a time.
std::vector<ShaderFeatures> with_one_more(const ShaderFeatures& f) {
  std::vector<ShaderFeatures> more;
  for (bool ShaderFeatures::*bit :
       {&ShaderFeatures::vertex_colors, &ShaderFeatures::base_color, &ShaderFeatures::metallic_roughness,
        &ShaderFeatures::occlusion, &ShaderFeatures::emissive})
    if (!(f.*bit)) more.push_back(f), more.back().*bit = true;
  if (f.motion == Motion::kStill) more.push_back(f), more.back().motion = Motion::kMoving;
  if (f.motion == Motion::kMoving) more.push_back(f), more.back().motion = Motion::kDeforming;
  if (f.normals == Normals::kOfSurface && !f.unlit) more.push_back(f), more.back().normals = Normals::kMapped;
  if (f.coordinates == 1) more.push_back(f), more.back().coordinates = 2;
  if (f.surface == Surface::kPatch) more.push_back(f), more.back().surface = Surface::kDisplacedPatch;
  if (f.surface == Surface::kTriangles && !f.unlit && !f.height_normals)
    more.push_back(f), more.back().height_normals = true;
  if (f.quads) more.push_back(f), more.back().quads = false;  // the surface's own derivatives are computed
  if (f.unlit) more.push_back(f), more.back().unlit = false;
  for (std::size_t kind = 0; kind < f.lights.size(); ++kind) more.push_back(f), ++more.back().lights[kind];
  for (std::size_t projection = 0; projection < f.shadows.size(); ++projection) {
    more.push_back(f), ++more.back().shadows[projection].lookups, ++more.back().shadows[projection].layers;
    more.push_back(more.back()), ++more.back().shadows[projection].layered, ++more.back().shadows[projection].layers;
    more.push_back(more.back()), ++more.back().shadows[projection].layers;
  }
  for (const auto filter : {ShaderFeatures::ShadowFilter::k2x2, ShaderFeatures::ShadowFilter::k3x3})
    if (f.shadow_filter < filter) more.push_back(f), more.back().shadow_filter = filter;
  // Specular-glossiness comes in place of metalness.
  for (const std::string_view layer : scene::kMaterialEffectNames)
    if (!f.unlit && layer != "specular_glossiness" && !f.has(layer))
      more.push_back(f), more.back().layers.push_back(layer);
  return more;
}

// SHADE2.
TEST(ShaderCosts, AFeatureMoreNeverCostsLess) {
  std::size_t compared = 0;
  for (unsigned bits = 0; bits < 1u << 10; ++bits)
    for (const Surface surface : {Surface::kTriangles, Surface::kPatch, Surface::kDisplacedPatch})
      for (const Motion motion : {Motion::kStill, Motion::kMoving, Motion::kDeforming}) {
        ShaderFeatures f;
        f.surface = surface, f.motion = motion;
        f.quads = bits & 1, f.unlit = bits & 2, f.vertex_colors = bits & 4, f.base_color = bits & 8;
        f.metallic_roughness = bits & 16, f.occlusion = bits & 32, f.emissive = bits & 64;
        f.normals = (bits & 128) != 0 && !f.unlit ? Normals::kMapped : Normals::kOfSurface;
        f.lights_move = bits & 256;
        if ((bits & 512) != 0)
          f.shadows[(bits >> 8) & 1] = {1, 0, 1}, f.shadow_filter = ShaderFeatures::ShadowFilter::kNearest;
        const ShaderCost cost = shader_cost(f);
        for (const ShaderFeatures& more : with_one_more(f)) {
          const ShaderCost then = shader_cost(more);
          EXPECT_GE(then.vector_operations, cost.vector_operations) << whole_shader(f) << " -> " << whole_shader(more);
          EXPECT_GE(then.texture_instructions, cost.texture_instructions) << whole_shader(more);
          ++compared;
        }
      }
  EXPECT_GT(compared, 10000u);
}

// A material pays for no layer that it lacks.
TEST(ShaderCosts, WithoutLayersNothingIsAdded) {
  for (const auto& row : hardware::shader_cost_rows()) {
    if (row.name.find("/layer") == std::string_view::npos) continue;
    EXPECT_TRUE(row.name.starts_with("add/layer")) << row.name;
  }
  ShaderFeatures f;
  const ShaderCost plain = shader_cost(f);
  EXPECT_EQ(
      plain,
      hardware::shader_cost_rows()[static_cast<std::size_t>(
                                       std::find_if(hardware::shader_cost_rows().begin(),
                                                    hardware::shader_cost_rows().end(),
                                                    [](const auto& row) { return row.name == "lit/triangles/still"; }) -
                                       hardware::shader_cost_rows().begin())]
          .cost);
}

TEST(ShaderCosts, LookupsAreCountedOnce) {
  ShaderFeatures f;
  EXPECT_EQ(shader_cost(f).texture_instructions, 0);
  f.occlusion = true;
  EXPECT_EQ(shader_cost(f).texture_instructions, 1);
  f.normals = Normals::kMapped, f.base_color = f.metallic_roughness = f.emissive = true;
  EXPECT_EQ(shader_cost(f).texture_instructions, 5);
  // Heights: two levels of four gathers of 2 x 2 texels.
  f.surface = Surface::kDisplacedPatch;
  EXPECT_EQ(shader_cost(f).texture_instructions, 13);
  ShaderFeatures vertex;
  vertex.stage = Stage::kDomain, vertex.surface = Surface::kDisplacedPatch;
  EXPECT_EQ(shader_cost(vertex).texture_instructions, 8);
}

// A square of four texels is one gather, whichever map it is of; a draw that casts no shadows pays for none.
TEST(ShaderCosts, LookupsOfShadowsAreOneTexelOneSquareOrFour) {
  using Filter = ShaderFeatures::ShadowFilter;
  for (const std::size_t kind : {std::size_t{0}, std::size_t{3}})
    for (const bool moves : {false, true}) {
      ShaderFeatures f;
      f.motion = moves ? Motion::kMoving : Motion::kStill;
      EXPECT_EQ(shader_cost(casting(f, kind, 2, 1, Filter::kNearest)).texture_instructions, 2);
      EXPECT_EQ(shader_cost(casting(f, kind, 2, 4, Filter::k2x2)).texture_instructions, 2);
      EXPECT_EQ(shader_cost(casting(f, kind, 1, 2, Filter::k3x3)).texture_instructions, 4);
      const ShaderCost lit = shader_cost(f);
      f.shadow_filter = Filter::k3x3;
      EXPECT_EQ(shader_cost(f), lit);
    }
}

TEST(ShaderCosts, IssueCyclesOfAWarpFollowItsOperations) {
  ShaderCost cost;
  cost.vector_operations = 100, cost.transcendental = 5, cost.scalar = 30;
  EXPECT_EQ(lane_clocks(cost), 120);
  EXPECT_DOUBLE_EQ(issue_cycles(cost, 32, 32), 120);
  EXPECT_DOUBLE_EQ(issue_cycles(cost, 64, 16), 480);
  EXPECT_DOUBLE_EQ(issue_cycles(cost, 16, 32), 120) << "a warp has the lanes to itself";
  cost.scalar = 200;
  EXPECT_DOUBLE_EQ(issue_cycles(cost, 32, 32), 200);
}

// ---- A driver's compiler --------------------------------------------------------------------------------------------

struct DriverCount {
  std::int32_t vector_instructions = 0, texture_instructions = 0;
};

// Counts of the code that Mesa's compiler makes of glsl/material.frag with the given definitions, or nothing, with
// the reason.
std::optional<DriverCount> counted_by_driver(const std::vector<std::string>& definitions, std::string& reason) {
#ifdef TESSERA_DRIVER_CODE
  const std::string sources = TESSERA_SOURCE_DIR "/tests/tilecore/shading/glsl/material";
  const test::TemporaryFolder folder;
  for (const std::string stage : {"vert", "frag"}) {
    std::vector<std::string> command = {"/usr/bin/env", "glslangValidator", "-V"};
    if (stage == "frag") command.insert(command.end(), definitions.begin(), definitions.end());
    command.insert(command.end(), {sources + "." + stage, "-o", (folder / (stage + ".spv")).string()});
    const test::ProcessResult compiled = test::run_process(command);
    if (compiled.status == 127) reason = "no glslangValidator";
    if (compiled.status == 127) return std::nullopt;
    EXPECT_EQ(compiled.status, 0) << compiled.output << compiled.errors;
  }
  const test::ProcessResult made = test::run_process({"/usr/bin/env", "RADV_FORCE_FAMILY=navi21", TESSERA_DRIVER_CODE,
                                                      (folder / "vert.spv").string(), (folder / "frag.spv").string()});
  if (made.status == 2) reason = made.errors;
  if (made.status == 2) return std::nullopt;
  EXPECT_EQ(made.status, 0) << made.errors;
  DriverCount count;
  std::istringstream stream(made.output);
  for (std::string line; std::getline(stream, line);) {
    count.vector_instructions += line.starts_with("\tv_");
    count.texture_instructions += line.starts_with("\timage_");
  }
  if (count.vector_instructions == 0) reason = "the driver shows no code";
  if (count.vector_instructions == 0) return std::nullopt;
  return count;
#else
  reason = definitions.empty() ? "" : "no Vulkan headers when this was built";
  return std::nullopt;
#endif
}

// The same material in GLSL through another compiler for the same ISA.
TEST(ShaderCostsWhole, ADriversCompilerCountsAboutTheSame) {
  ShaderFeatures lit, patch, mapped, spots, unlit, all;
  patch.surface = Surface::kPatch;
  mapped.quads = mapped.base_color = mapped.metallic_roughness = true, mapped.normals = Normals::kMapped;
  spots.lights[3] = 2;
  unlit.unlit = unlit.base_color = unlit.quads = true;
  all = mapped;
  all.surface = Surface::kPatch, all.vertex_colors = true;
  const std::vector<std::pair<ShaderFeatures, std::vector<std::string>>> variants = {
      {lit, {"-DSTILL"}},
      {patch, {"-DPATCH"}},
      {mapped, {"-DBASE_COLOR", "-DMETALLIC_ROUGHNESS", "-DMAPPED"}},
      {spots, {"-DSPOT=2"}},
      {unlit, {"-DBASE_COLOR", "-DUNLIT"}},
      {all, {"-DPATCH", "-DCOLORS", "-DBASE_COLOR", "-DMETALLIC_ROUGHNESS", "-DMAPPED"}}};
  for (const auto& [features, definitions] : variants) {
    std::string reason;
    const std::optional<DriverCount> driver = counted_by_driver(definitions, reason);
    if (!driver) GTEST_SKIP() << "no code of a driver: " << reason;
    const ShaderCost cost = shader_cost(features);
    const std::int32_t ours = cost.vector_operations + cost.transcendental;
    std::printf("%4d vector instructions, the driver %4d: %s\n", ours, driver->vector_instructions,
                whole_shader(features).c_str());
    // Inputs that this table takes for given the driver interpolates: 8 instructions.
    EXPECT_TRUE(close(ours, driver->vector_instructions, 0.25, 8))
        << whole_shader(features) << ": " << ours << ", the driver " << driver->vector_instructions;
    EXPECT_EQ(cost.texture_instructions, driver->texture_instructions) << whole_shader(features);
  }
}

// ---- Captures -------------------------------------------------------------------------------------------------------

std::string described(const ShaderFeatures& f) {
  std::string text = f.unlit ? "unlit" : "lit";
  const auto flag = [&](const char* name, bool set) {
    if (set) text += std::string(" ") + name;
  };
  flag("base_color", f.base_color), flag("metallic_roughness", f.metallic_roughness), flag("occlusion", f.occlusion);
  flag("emissive", f.emissive), flag("colors", f.vertex_colors), flag("mapped", f.normals == Normals::kMapped);
  flag("tangents", f.normals == Normals::kMappedAlongTangents), flag("apart", f.coordinates > 1);
  return text;
}

// "surface: features" of each drawable of a shipped capture's first frame.
std::set<std::string> features_of(const std::string& name) {
  const scene::Capture capture = scene::read_capture(test::shipped_capture(name));
  const scene::Assembly assembly = scene::assemble(capture);
  scene::FrameRequest request;
  request.width = 64, request.height = 48, request.close_time = 0.02;
  const auto frame = scene::pose_frame(assembly, scene::choose_camera(capture, 64, 48), request);
  std::set<std::string> found;
  for (const scene::PosedDrawable& drawable : frame->drawables) {
    const ShaderFeatures f = draw_features(*frame, drawable, false);
    EXPECT_GT(shader_cost(f).vector_operations, 0);
    found.insert(surface_name(f.surface) + ": " + described(f));
  }
  return found;
}

TEST(ShaderFeatures, MatchTheShippedCapturesMaterials) {
  const std::map<std::string, std::set<std::string>> expected = {
      {"eggs",
       {"displaced_patch: lit base_color", "displaced_patch: lit base_color occlusion apart",
        "displaced_patch: lit emissive"}},
      {"vases", {"patch: lit", "patch: lit base_color", "patch: lit base_color occlusion apart", "triangles: lit"}},
      {"garden",
       {"displaced_patch: lit base_color colors", "patch: lit", "patch: lit base_color colors", "patch: lit colors",
        "triangles: unlit base_color"}},
      {"flyby", {"patch: lit base_color", "triangles: lit", "triangles: lit base_color"}},
      {"serpent", {"triangles: lit", "triangles: lit base_color"}},
      {"workshop", {"computed: lit"}},
      {"city",
       {"displaced_patch: lit base_color colors", "patch: lit", "patch: lit base_color colors", "patch: lit colors",
        "triangles: unlit base_color"}},
      {"city_evening",
       {"displaced_patch: lit base_color", "patch: lit", "patch: lit base_color", "patch: lit base_color colors",
        "patch: lit colors", "triangles: unlit base_color"}},
      {"garden_lamps",
       {"displaced_patch: lit base_color", "displaced_patch: lit base_color colors", "patch: lit",
        "patch: lit base_color", "patch: lit base_color colors", "patch: lit colors", "triangles: unlit base_color"}},
      {"stroll", {"patch: lit", "patch: lit base_color", "patch: lit base_color occlusion apart", "triangles: lit"}}};
  for (const auto& [name, features] : expected) EXPECT_EQ(features_of(name), features) << name;
}

TEST(ShaderFeatures, AreTheReadsOfAMaterialsShader) {
  const auto texture =
      std::make_shared<const shaders::Texture>(std::vector<shaders::Texture::Level>{{1, 1, {255, 255, 255, 255}}},
                                               shaders::ColorSpace::kLinear, shaders::TexelBlocks{});
  scene::Material material;
  for (scene::TextureSlot* slot : material.slots()) slot->texture = texture;
  ShaderFeatures all;
  all.base_color = all.metallic_roughness = all.occlusion = all.emissive = true, all.normals = Normals::kMapped;
  EXPECT_EQ(material_features(material), all);
  material.emissive_texture.texcoord = 1;
  all.coordinates = 2;
  EXPECT_EQ(material_features(material), all);
  material.unlit = true;
  ShaderFeatures base;
  base.unlit = base.base_color = true;
  EXPECT_EQ(material_features(material), base) << "nothing but colour";
  material.glows_unlit = true;
  base.emissive = true, base.coordinates = 2;
  EXPECT_EQ(material_features(material), base);
}

TEST(ShaderFeatures, LayersReadTheirOwnTextures) {
  const auto texture =
      std::make_shared<const shaders::Texture>(std::vector<shaders::Texture::Level>{{1, 1, {255, 255, 255, 255}}},
                                               shaders::ColorSpace::kLinear, shaders::TexelBlocks{});
  scene::Material material;
  for (scene::TextureSlot* slot : material.slots()) slot->texture = texture;
  using Effect = scene::MaterialEffect;
  const auto textures_with = [&](Effect effect) {
    material.effects.reset();
    material.effects.set(static_cast<std::size_t>(effect));
    const ShaderFeatures f = material_features(material);
    EXPECT_TRUE(f.has(scene::kMaterialEffectNames[static_cast<std::size_t>(effect)]));
    EXPECT_TRUE(f.layered());
    return f;
  };
  const ShaderFeatures coat = textures_with(Effect::kClearcoat);
  EXPECT_EQ(coat.layer_textures, 2);
  EXPECT_TRUE(coat.coat_normals);
  EXPECT_EQ(textures_with(Effect::kSheen).layer_textures, 2);
  EXPECT_EQ(textures_with(Effect::kDielectric).layer_textures, 2);
  EXPECT_EQ(textures_with(Effect::kAnisotropy).layer_textures, 1);
  EXPECT_EQ(textures_with(Effect::kTransmission).layer_textures, 1);
  const ShaderFeatures glossy = textures_with(Effect::kSpecularGlossiness);
  EXPECT_EQ(glossy.layer_textures, 1);
  EXPECT_FALSE(glossy.metallic_roughness) << "in place of it";
}

}  // namespace
}  // namespace tessera::tilecore::shader_costs_test
