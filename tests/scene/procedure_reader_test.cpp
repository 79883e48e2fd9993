// TESSERA_procedure in captures: what is read, what is refused and where.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "scene/assembly.h"
#include "scene/capture_reader.h"
#include "tests/support/captures.h"
#include "tests/support/temporary_folder.h"

namespace tessera::scene {
namespace {

using nlohmann::json;

Capture read(const json& procedure, const json& more = json::object()) {
  const test::TemporaryFolder folder;
  json document = {{"asset", {{"version", "2.0"}}},
                   {"extensionsUsed", {"TESSERA_procedure"}},
                   {"scenes", json::array({{{"nodes", {0}}}})},
                   {"nodes", json::array({{{"extensions", {{"TESSERA_procedure", procedure}}}}})}};
  document.update(more);
  test::write_text(folder.path() / "a.gltf", document.dump());
  return read_capture(folder.path() / "a.gltf");
}

std::string refusal(const json& procedure, const json& more = json::object()) {
  try {
    read(procedure, more);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(ProcedureReader, ParametersComeInTheOrderOfTheirDeclarationWithDefaults) {
  const Capture capture = read({{"shape", "torus"},
                                {"parameters", {{"minorRadius", 0.5}}},
                                {"texture", {{"pattern", "checker"}, {"repeat", {3, 4}}}},
                                {"shading", {{"model", "phong"}, {"exponent", 64}}}});
  ASSERT_EQ(capture.procedures.size(), 1u);
  const Procedure& p = capture.procedures[0];
  EXPECT_EQ(p.shape, shaders::ShapeId::kTorus);
  EXPECT_EQ(p.pieces[0].input.p[0], 1.0f);
  EXPECT_EQ(p.pieces[0].input.p[1], 0.5f);
  EXPECT_EQ(p.texture_numbers[6], 3.0f);
  EXPECT_EQ(p.texture_numbers[7], 4.0f);
  EXPECT_EQ(p.shading_numbers[3], 64.0f);
  const Assembly assembly = assemble(capture);
  EXPECT_EQ(assembly.drawables.size(), 1u);
  EXPECT_EQ(assembly.patch_count(), 32u);
}

TEST(ProcedureReader, ChainsBecomePieces) {
  const json path = {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, 0}, {6, 0}},
             profile = {{1, 0}, {1, 1}, {0, 1}, {-1, 0}};
  const Capture capture = read({{"shape", "sweptCubic"}, {"parameters", {{"path", path}, {"profile", profile}}}});
  const auto& pieces = capture.procedures[0].pieces;
  ASSERT_EQ(pieces.size(), 2u);
  EXPECT_EQ(pieces[1].input.p[0], 3.0f);  // the second curve begins where the first ends
  EXPECT_EQ(pieces[1].input.p[8], 1.0f);
  EXPECT_EQ(pieces[1].u_first, 0.5f);
  EXPECT_EQ(pieces[1].v_scale, 1.0f);
}

TEST(ProcedureReader, FaultsAreNamedWhereTheyAre) {
  using testing::HasSubstr;
  EXPECT_THAT(refusal(json::object()), HasSubstr("/nodes/0/extensions/TESSERA_procedure"));
  EXPECT_THAT(refusal({{"shape", "cube"}}), HasSubstr("shape"));
  EXPECT_THAT(refusal({{"shape", "sphere"}, {"parameters", {{"radios", 1}}}}), HasSubstr("/parameters/radios"));
  EXPECT_THAT(refusal({{"shape", "sphere"}, {"parameters", {{"radius", -1}}}}), HasSubstr("outside"));
  EXPECT_THAT(refusal({{"shape", "sphere"}, {"parameters", {{"radius", "1"}}}}), HasSubstr("is not a number"));
  EXPECT_THAT(refusal({{"shape", "revolution"}}), HasSubstr("profile"));
  EXPECT_THAT(refusal({{"shape", "revolution"}, {"parameters", {{"profile", {{0, 0}, {1, 1}}}}}}),
              HasSubstr("3 n + 1"));
  EXPECT_THAT(refusal({{"shape", "sphere"}, {"texture", {{"pattern", "paisley"}}}}), HasSubstr("/texture/pattern"));
  EXPECT_THAT(refusal({{"shape", "sphere"}, {"shading", json::object()}}), HasSubstr("model"));
  EXPECT_THAT(refusal({{"shape", "sphere"}, {"material", 0}}), HasSubstr("material"));
  EXPECT_THAT(refusal({{"shape", "geometryImage"}}), HasSubstr("image"));
  EXPECT_THAT(refusal({{"shape", "sphere"}, {"image", {{"positions", 0}, {"width", 2}}}}), HasSubstr("does not read"));
  EXPECT_THAT(refusal(json::array()), HasSubstr("is not an object"));
}

TEST(ProcedureReader, AGeometryImageIsAGridOfWholeRows) {
  const json buffer = {{"accessors", json::array({{{"componentType", 5126}, {"type", "VEC3"}, {"count", 6}}})}};
  const Capture capture = read({{"shape", "geometryImage"}, {"image", {{"positions", 0}, {"width", 3}}}}, buffer);
  EXPECT_EQ(capture.procedures[0].image->height, 2);
  EXPECT_THAT(refusal({{"shape", "geometryImage"}, {"image", {{"positions", 0}, {"width", 4}}}}, buffer),
              testing::HasSubstr("whole rows"));
}

// ---- Programs ---------------------------------------------------------------------------------------------------

constexpr const char* kEgg =
    "shape egg { patches 8, 4; param size = 1 in [0, 10]; let a = sincos(v * 0.5 - 0.25); let b = sincos(u);\n"
    "return vec3(size * a.y * b.y, size * 1.4 * a.x, 0 - size * a.y * b.x); }\n"
    "texture spots { param color: vec3 = 0.5 in [0, 1]; return color * (0.5 + 0.5 * noise(object * 8)); }\n"
    "rates double_rate { param more = 2 in [1, 8]; return 2 * more * reach / spacing; }\n";

json with_programs(std::vector<std::string> programs) {
  return {{"extensions", {{"TESSERA_procedure", {{"programs", programs}}}}}};
}

TEST(ProcedureReader, AProgramsParametersAreItsOwn) {
  const Capture capture = read({{"program", kEgg},
                                {"parameters", {{"size", 2}}},
                                {"texture", {{"color", {0.1, 0.2, 0.3}}}},
                                {"sampling", {{"more", 4}}}});
  const Procedure& p = capture.procedures[0];
  EXPECT_EQ(p.shape, shaders::ShapeId::kProgram);
  EXPECT_EQ(p.texture, shaders::TextureId::kProgram);
  EXPECT_EQ(p.declaration().name, "egg");
  EXPECT_EQ(p.pieces[0].input.p[0], 2.0f);
  ASSERT_EQ(p.pieces[0].input.constants, p.shape_constants->data());
  EXPECT_EQ(p.pieces[0].input.constants[0], 2.0f);
  EXPECT_EQ(p.texture_constants[2], 0.3f);
  EXPECT_EQ(p.rates_constants[0], 4.0f);
  EXPECT_EQ(assemble(capture).patch_count(), 32u);
}

TEST(ProcedureReader, AProgramMayBeListedAndJoinsNamedStages) {
  const std::string texture = "texture red { return vec3(1, 0, 0); }";
  const Capture capture = read({{"shape", "torus"}, {"program", 1}}, with_programs({kEgg, texture}));
  const Procedure& p = capture.procedures[0];
  EXPECT_EQ(p.shape, shaders::ShapeId::kTorus);
  EXPECT_EQ(p.texture_program->declaration.name, "red");
  EXPECT_EQ(p.shape_program, nullptr);
}

TEST(ProcedureReader, ChainsOfAProgramBecomePieces) {
  const std::string text =
      "shape ribbon { param rail: chain u; let s = 1 - u;\n"
      "return vec3(rail[0] * s + rail[6] * u, v, rail[1] * s + rail[7] * u); }";
  const json rail = {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, 0}, {6, 2}};
  const Capture capture = read({{"program", text}, {"parameters", {{"rail", rail}}}});
  const auto& pieces = capture.procedures[0].pieces;
  ASSERT_EQ(pieces.size(), 2u);
  EXPECT_EQ(pieces[1].input.constants[6], 6.0f);
  EXPECT_EQ(pieces[1].input.constants[7], 2.0f);
}

TEST(ProcedureReader, FaultsOfProgramsAreNamedWhereTheyAre) {
  using testing::HasSubstr;
  EXPECT_THAT(refusal({{"program", "shape s {\n  return w;\n}"}}),
              HasSubstr("/nodes/0/extensions/TESSERA_procedure/program: line 2, column 10: 'w' is not known"));
  EXPECT_THAT(refusal({{"program", kEgg}, {"shape", "sphere"}}), HasSubstr("the program has a shape"));
  EXPECT_THAT(refusal({{"program", kEgg}, {"parameters", {{"size", 11}}}}), HasSubstr("outside [0, 10]"));
  EXPECT_THAT(refusal({{"program", kEgg}, {"texture", {{"pattern", "wood"}}}}), HasSubstr("/texture/pattern"));
  EXPECT_THAT(refusal({{"program", kEgg}, {"sampling", {{"less", 1}}}}), HasSubstr("/sampling/less"));
  EXPECT_THAT(refusal({{"shape", "sphere"}, {"sampling", {{"more", 1}}}}), HasSubstr("no program of rates"));
  EXPECT_THAT(refusal({{"program", 0}}), HasSubstr("the document lists none"));
  EXPECT_THAT(refusal({{"program", 1}}, with_programs({kEgg})), HasSubstr("outside [0, 0]"));
  EXPECT_THAT(refusal({{"program", "texture t { return vec3(1); }"}}), HasSubstr("lacks the property 'shape'"));
  EXPECT_THAT(refusal({{"program", "shape s { return image(u, v); }"}}), HasSubstr("lacks the property 'image'"));
  std::vector<std::string> many;
  json nodes = json::array();
  for (int k = 0; k < 65; ++k) {
    many.push_back(fmt::format("{}// {}", kEgg, k));
    nodes.push_back({{"extensions", {{"TESSERA_procedure", {{"program", k}}}}}});
  }
  json document = with_programs(many);
  document["nodes"] = nodes;
  EXPECT_THAT(refusal({}, document), HasSubstr("one more than 64 different programs"));
}

}  // namespace
}  // namespace tessera::scene
