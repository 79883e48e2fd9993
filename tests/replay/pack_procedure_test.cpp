// tessera pack --procedure: programs of users in captures.
#include "base/error.h"
#include "replay/pack/procedures.h"
#include "shaders_cpp/procedures/program.h"
#include "tests/replay/pack_sources.h"

namespace tessera::replay::pack_procedure_test {
namespace {

constexpr const char* kProcedure = "TESSERA_procedure";
constexpr const char* kBowl =
    "// A bowl, open at the top.\n"
    "shape bowl \"A bowl.\" { param depth = 0.5 in [0, 4]; let a = sincos(u);\n"
    "  return vec3(a.y * v, depth * v * v, 0 - a.x * v); }\n";
constexpr const char* kStripes = "texture stripes { return vec3(fract(object.y * 8), 0.5, 0.5); }\n";

// A text file in a folder of its own.
struct TextFile {
  explicit TextFile(std::string_view text) : file(folder / "p.txt") { write_text(file, std::string(text)); }
  TemporaryFolder folder;
  fs::path file;
};

PackOptions with_procedures(std::vector<ProcedureFile> procedures) {
  PackOptions options;
  options.procedures = std::move(procedures);
  return options;
}

TEST(PackProcedure, AProgramStandsInTheSceneAndSurvivesPackingAgain) {
  const TextFile bowl(kBowl);
  const Packed p(grid(), with_procedures({{"", bowl.file}, {"", bowl.file}}));
  const scene::Capture capture = p.after();
  ASSERT_EQ(capture.procedures.size(), 2u);
  const scene::Procedure& procedure = capture.procedures[0];
  EXPECT_EQ(procedure.shape, shaders::ShapeId::kProgram);
  EXPECT_EQ(*procedure.shape_program->source, kBowl);  // word for word
  EXPECT_EQ(p.parts.document["extensions"][kProcedure]["programs"], json::array({kBowl}));
  const std::size_t node = capture.nodes.size() - 2;
  EXPECT_EQ(capture.nodes[node].name, "bowl");
  for (const std::size_t n : {node, node + 1}) EXPECT_THAT(capture.roots, testing::Contains(static_cast<int>(n)));
  pack_capture(p.target, p.folder / "again.glb", {});
  EXPECT_EQ(read_text(p.folder / "again.glb"), p.bytes);
}

TEST(PackProcedure, ANodesOtherStagesStay) {
  const TextFile stripes(kStripes), bowl(kBowl);
  GltfSource source = grid();
  source.document["nodes"].push_back(
      {{"name", "ring"},
       {"extensions",
        {{kProcedure,
          {{"shape", "torus"}, {"parameters", {{"minorRadius", 0.5}}}, {"texture", {{"pattern", "plain"}}}}}}}});
  const int node = static_cast<int>(source.document["nodes"].size()) - 1;
  source.document["scenes"][0]["nodes"].push_back(node);
  source.document["extensionsUsed"].push_back(kProcedure);
  const Packed by_name(source, with_procedures({{"ring", stripes.file}})),
      by_number(source, with_procedures({{std::to_string(node), stripes.file}}));
  EXPECT_EQ(by_name.bytes, by_number.bytes);
  const scene::Capture capture = by_name.after();
  const scene::Procedure& procedure = capture.procedures[0];
  EXPECT_EQ(procedure.shape, shaders::ShapeId::kTorus);
  EXPECT_EQ(procedure.pieces[0].input.p[1], 0.5f);
  EXPECT_EQ(procedure.texture_program->declaration.name, "stripes");
  // A parameter that the new shape does not know is not dropped silently.
  EXPECT_THROW(Packed(source, with_procedures({{"ring", bowl.file}})), InputError);
}

std::string refusal(const std::vector<ProcedureFile>& procedures) {
  const TemporaryFolder folder;
  try {
    pack_capture(grid().write(folder.path()), folder / "x.glb", with_procedures(procedures));
  } catch (const Error& error) {
    EXPECT_FALSE(fs::exists(folder / "x.glb"));
    return error.what();
  }
  return "";
}

TEST(PackProcedure, FaultsNameFileLineAndColumn) {
  const TextFile wrong("shape s {\n  return vec3(u, v);\n}\n"), name("shape s {\n  let a = 1;\n  return vec3(b);\n}\n"),
      texture(kStripes);
  EXPECT_EQ(refusal({{"", wrong.file}}), wrong.file.string() + ":2:10: 'vec3' takes 3 numbers, not 2");
  EXPECT_EQ(refusal({{"", name.file}}), name.file.string() + ":3:15: 'b' is not known");
  EXPECT_THAT(refusal({{"nobody", texture.file}}), HasSubstr("--procedure nobody: there is no such node"));
  EXPECT_THAT(refusal({{"99", texture.file}}), HasSubstr("--procedure 99: there is no such node"));
  EXPECT_THAT(refusal({{"", texture.file}}), HasSubstr("lacks the property 'shape'"));
  EXPECT_THAT(refusal({{"", "/nowhere/p.txt"}}), HasSubstr("/nowhere/p.txt"));
  const TextFile large(std::string(shaders::ProgramLimits::kSourceBytes + 1, ' '));
  EXPECT_THAT(refusal({{"", large.file}}), HasSubstr(large.file.string()));
}

TEST(PackProcedure, OptionsAreANodeAndAFile) {
  EXPECT_EQ(parse_procedure("bowl.txt").node, "");
  EXPECT_EQ(parse_procedure("bowl.txt").file, "bowl.txt");
  EXPECT_EQ(parse_procedure("ring=a=b.txt").node, "ring");
  EXPECT_EQ(parse_procedure("ring=a=b.txt").file, "a=b.txt");
  for (const char* text : {"", "=", "=a.txt", "ring="}) EXPECT_THROW(parse_procedure(text), UsageError) << text;
}

}  // namespace
}  // namespace tessera::replay::pack_procedure_test
