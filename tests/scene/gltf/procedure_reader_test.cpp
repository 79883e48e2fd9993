// TESSERA_procedure in captures: values that are read, and refusals with their places.
#include "base/error.h"
#include "scene/animation.h"
#include "scene/assembly.h"
#include "shaders_cpp/procedures/procedures.h"
#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::procedure_reader_test {
namespace {

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

TEST(ProcedureReader, LimitsOfTessellationAreWholeNumbersInOrder) {
  const Capture capture = read({{"shape", "sphere"}, {"tessellation", {{"min", 2}, {"max", 16}}}});
  EXPECT_EQ(capture.procedures[0].min_segments, 2);
  EXPECT_EQ(capture.procedures[0].max_segments, 16);
  EXPECT_EQ(read({{"shape", "sphere"}}).procedures[0].max_segments, 64);
  const auto refused = [](const json& limits) { return refusal({{"shape", "sphere"}, {"tessellation", limits}}); };
  EXPECT_THAT(refused({{"min", 8}, {"max", 4}}), HasSubstr("/tessellation/min"));
  EXPECT_THAT(refused({{"max", 65}}), HasSubstr("outside [1, 64]"));
  EXPECT_THAT(refused({{"min", 0}}), HasSubstr("outside [1, 64]"));
  EXPECT_THAT(refused({{"min", 1.5}}), HasSubstr("whole number"));
  EXPECT_THAT(refused({{"most", 4}}), HasSubstr("/tessellation/most"));
  EXPECT_THAT(refused(4), HasSubstr("is not an object"));
}

TEST(ProcedureReader, ChainsAlongOneParameterHaveOneLength) {
  const std::string text =
      "shape s { param a: chain u; param b: chain u; return vec3(a[0] * u + b[7] * v, a[1] * v, 0); }";
  const json four = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, seven = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {1, 2}, {2, 2}, {3, 3}};
  EXPECT_EQ(read({{"program", text}, {"parameters", {{"a", seven}, {"b", seven}}}}).procedures[0].pieces.size(), 2u);
  EXPECT_THAT(refusal({{"program", text}, {"parameters", {{"a", seven}, {"b", four}}}}),
              testing::HasSubstr("/parameters/b"));
}

// ---- Animation --------------------------------------------------------------------------------------------------

// A procedure and a channel that moves the value at `pointer` from the first half of `values` to the second.
test::GltfAsset animated(const json& procedure, const std::string& pointer, const char* type,
                         const std::vector<float>& values) {
  test::GltfAsset asset;
  asset.document["extensionsUsed"] = {"TESSERA_procedure", "KHR_animation_pointer"};
  asset.document["scenes"] = json::array({{{"nodes", {0}}}});
  asset.document["nodes"] = json::array({{{"extensions", {{"TESSERA_procedure", procedure}}}}});
  const int times = asset.add_accessor<float>("SCALAR", {0, 1});
  const json sampler = {{"input", times}, {"output", asset.add_accessor(type, values)}};
  const json target = {
      {"path", "pointer"},
      {"extensions", {{"KHR_animation_pointer", {{"pointer", "/nodes/0/extensions/TESSERA_procedure/" + pointer}}}}}};
  asset.add("animations", {{"channels", {{{"sampler", 0}, {"target", target}}}}, {"samplers", {sampler}}});
  return asset;
}

Procedure at_half(const json& procedure, const std::string& pointer, const char* type,
                  const std::vector<float>& values) {
  const Capture capture = test::read_asset(animated(procedure, pointer, type, values));
  EXPECT_TRUE(capture.notices.empty()) << pointer;
  const PosedProcedures posed = pose_procedures(capture, 0.5, 0.5);
  return posed.at(capture, 0, 0);
}

TEST(AnimatedProcedureReader, MovesTheParametersOfEveryStage) {  // AP1
  const json torus = {{"shape", "torus"},
                      {"parameters", {{"majorRadius", 2}}},
                      {"texture", {{"pattern", "checker"}}},
                      {"shading", {{"model", "phong"}}}};
  EXPECT_EQ(at_half(torus, "parameters/minorRadius", "SCALAR", {0.25f, 0.75f}).pieces[0].input.p[1], 0.5f);
  EXPECT_EQ(at_half(torus, "parameters/minorRadius", "SCALAR", {0.25f, 0.75f}).pieces[0].input.p[0], 2.0f);
  EXPECT_EQ(at_half(torus, "parameters/minorRadius", "SCALAR", {-3, -1}).pieces[0].input.p[1], 0.0f) << "its range";
  EXPECT_EQ(at_half(torus, "texture/repeat", "VEC2", {1, 2, 3, 6}).texture_numbers[7], 4.0f);
  EXPECT_EQ(at_half(torus, "shading/exponent", "SCALAR", {8, 24}).shading_numbers[3], 16.0f);
}

TEST(AnimatedProcedureReader, MovesTheCurvesOfEachPiece) {
  const json path = {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, 0}, {6, 0}},
             profile = {{1, 0}, {1, 1}, {0, 1}, {-1, 0}};
  std::vector<float> values;
  for (const float x : {0.0f, 2.0f})
    for (int k = 0; k < 7; ++k) values.insert(values.end(), {x + static_cast<float>(k), x});
  const Procedure moved = at_half({{"shape", "sweptCubic"}, {"parameters", {{"path", path}, {"profile", profile}}}},
                                  "parameters/path", "VEC2", values);
  ASSERT_EQ(moved.pieces.size(), 2u);
  const auto& names = moved.declaration().parameters;
  const std::size_t first = names[0].name == "path" ? 0 : 8;
  EXPECT_EQ(moved.pieces[1].input.p[first], 4.0f);
  EXPECT_EQ(moved.pieces[1].input.p[first + 7], 1.0f);
  EXPECT_EQ(moved.pieces[0].input.p[first], 1.0f);
  EXPECT_EQ(moved.pieces[1].input.p[8 - first], 1.0f) << "the profile stays";
}

TEST(AnimatedProcedureReader, MovesTheUniformsOfPrograms) {
  const std::string text =
      "shape s { param size = 1 in [0, 9]; uniform twice = 2 * size; return vec3(twice * u, twice * v, 0); }";
  const Procedure moved = at_half({{"program", text}}, "parameters/size", "SCALAR", {2, 4});
  const auto p = shaders::shape_point(moved.shape, moved.pieces[0].input, 1.0f, 0.5f);
  EXPECT_EQ(p.x, 6.0f);
  EXPECT_EQ(p.y, 3.0f);
}

TEST(AnimatedProcedureReader, MissingTargetsAreSkippedAndAWrongCountIsRefused) {
  const json sphere = {{"shape", "sphere"}};
  for (const char* pointer : {"parameters/radios", "texture/color", "shape", "sampling/more", "parameters"})
    EXPECT_EQ(test::read_asset(animated(sphere, pointer, "SCALAR", {1, 2})).animations[0].channels.size(), 0u)
        << pointer;
  EXPECT_THROW(test::read_asset(animated(sphere, "parameters/radius", "VEC2", {1, 2, 3, 4})), InputError);
  EXPECT_THROW(test::read_asset(animated(sphere, "parameters/radius", "SCALAR", {1, 2, 3})), InputError);
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
}  // namespace tessera::scene::procedure_reader_test
