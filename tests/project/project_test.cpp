// The project's own rules: layout, documents that match the code, captures that their sources make.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>

#include "replay/describe.h"
#include "scene/extensions.h"
#include "tests/project/stability_page.h"
#include "tests/support/captures.h"
#include "tests/support/csv_rows.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;
using test::csv_rows;
using test::number_of;
using test::read_text;

const fs::path kRoot = TESSERA_SOURCE_DIR;
const char* const kFormatter = "/usr/bin/clang-format";
// In the order in which they may include each other.
const std::vector<std::string> kFolders = {"base",      "shaders_cpp", "scene",  "memory",   "hardware",
                                           "timing",    "frontend",    "binner", "tilecore", "gpu",
                                           "baselines", "reference",   "replay"};

bool is_source(const fs::path& file) {
  static const std::set<std::string> kEndings = {".h", ".cpp", ".inc", ".c"};
  return kEndings.contains(file.extension().string());
}

std::vector<fs::path> sources_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && is_source(entry.path())) files.push_back(entry.path());
  return files;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// Folders that a source includes from, of kFolders.
std::set<std::string> included_folders(const std::string& text) {
  static const std::regex kInclude("#include \"([a-z_]+)/");
  std::set<std::string> folders;
  for (auto at = std::sregex_iterator(text.begin(), text.end(), kInclude); at != std::sregex_iterator(); ++at)
    folders.insert((*at)[1]);
  return folders;
}

// Whether a source of a folder may include from another. Scenes know nothing of the machine, timing nothing of scenes and
// shaders; baselines and the reference observe the machine, not each other.
bool may_include(const std::string& folder, const std::string& other) {
  if (folder == other) return true;
  if (folder == "memory" || folder == "hardware" || folder == "timing")
    return other == "base" || (folder != "memory" && other == "memory") || (folder == "timing" && other == "hardware");
  if (folder == "reference" && other == "baselines") return false;
  const auto at = [](const std::string& name) { return std::find(kFolders.begin(), kFolders.end(), name); };
  return at(other) < at(folder);
}

TEST(Layout, FoldersIncludeOnlyThoseAboveThem) {
  for (const std::string& folder : kFolders)
    for (const fs::path& file : sources_in(kRoot / folder))
      for (const std::string& other : included_folders(read_text(file)))
        EXPECT_TRUE(may_include(folder, other)) << file << " includes " << other;
}

TEST(Layout, AnIncludeAgainstTheDirectionIsCaught) {
  EXPECT_EQ(included_folders("#include \"tilecore/tile_core.h\"\n#include <vector>\n"),
            std::set<std::string>{"tilecore"});
  EXPECT_FALSE(may_include("frontend", "tilecore"));
  EXPECT_FALSE(may_include("timing", "scene"));
  EXPECT_FALSE(may_include("gpu", "replay"));
  EXPECT_TRUE(may_include("frontend", "base"));
  EXPECT_TRUE(may_include("baselines", "gpu"));
}

TEST(Layout, ThePublicHeadersAndPythonSeeNoRoom) {
  for (const char* folder : {"include", "python"})
    for (const fs::path& file : sources_in(kRoot / folder))
      for (const std::string& other : included_folders(read_text(file))) EXPECT_EQ(other, "python") << file;
}

TEST(Layout, TopLevelHoldsWhatTheReadmeNames) {
  const std::set<std::string> allowed = {"CMakeLists.txt",
                                         "CMakePresets.json",
                                         "README.md",
                                         "tessera",
                                         "cmake",
                                         "base",
                                         "shaders_cpp",
                                         "scene",
                                         "memory",
                                         "hardware",
                                         "timing",
                                         "frontend",
                                         "binner",
                                         "tilecore",
                                         "gpu",
                                         "baselines",
                                         "reference",
                                         "replay",
                                         "python",
                                         "include",
                                         "tests",
                                         "bench",
                                         "captures",
                                         "docs",
                                         "build",
                                         "out"};
  for (const auto& entry : fs::directory_iterator(kRoot)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(".")) {
      EXPECT_TRUE(allowed.contains(name)) << name;
    }
  }
}

std::vector<fs::path> all_sources() {
  std::vector<fs::path> all;
  std::vector<std::string> folders = kFolders;
  folders.insert(folders.end(), {"include", "python", "tests", "bench", "captures"});
  for (const std::string& folder : folders)
    for (fs::path& file : sources_in(kRoot / folder)) all.push_back(std::move(file));
  return all;
}

TEST(Layout, NoSourceOutgrowsItsUnit) {
  for (const fs::path& file : all_sources()) EXPECT_LE(lines_of(read_text(file)).size(), 800u) << file;
}

// Lines of each function's body and its first line; by the braces that the formatter puts at the margin.
std::vector<std::pair<std::size_t, std::string>> function_lengths(const std::vector<std::string>& lines) {
  std::vector<std::pair<std::size_t, std::string>> found;
  std::size_t begin = 0;
  std::string head;
  for (std::size_t l = 0; l < lines.size(); ++l) {
    const std::string& line = lines[l];
    if (line.empty() || line[0] == ' ' || line[0] == '#' || line[0] == '/') continue;
    if (line[0] == '}') {
      if (!head.empty()) found.emplace_back(l - begin, head);
      head.clear();
    } else {
      const bool scope = line.starts_with("namespace") || line.starts_with("class ") || line.starts_with("struct ") ||
                         line.starts_with("enum ");
      head = scope ? "" : line;
      begin = l;
    }
  }
  return found;
}

TEST(Layout, NoFunctionOutgrowsTwoScreens) {
  std::size_t functions = 0;
  for (const fs::path& file : all_sources())
    for (const auto& [length, head] : function_lengths(lines_of(read_text(file)))) {
      EXPECT_LE(length, 100u) << file << ": " << head;
      ++functions;
    }
  EXPECT_GT(functions, 2000u);
}

TEST(Layout, AFunctionThatIsTooLongIsCaught) {
  std::string text = "namespace a {\nint f() {\n";
  for (int line = 0; line < 120; ++line) text += "  ++x;\n";
  const auto found = function_lengths(lines_of(text + "}\n}  // namespace a\n"));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0], std::pair(std::size_t{121}, std::string("int f() {")));
}

// What clang-format would change of the given files; its exit status is 1 when that is anything.
test::ProcessResult formatter(const std::vector<fs::path>& files) {
  std::vector<std::string> arguments = {kFormatter, "--dry-run", "--Werror", "--ferror-limit=1", "--style=file"};
  for (const fs::path& file : files) arguments.push_back(file.string());
  return test::run_process(arguments);
}

// Other versions break lines elsewhere.
bool has_formatter() {
  return test::run_process({kFormatter, "--version"}).output.find("version 14.") != std::string::npos;
}

TEST(Layout, SourcesAreFormatted) {
  if (!has_formatter()) GTEST_SKIP() << "no clang-format 14";
  const test::ProcessResult result = formatter(all_sources());
  EXPECT_EQ(result.status, 0) << result.errors << "fixed by: clang-format -i FILE";
}

TEST(Layout, ASourceThatIsNotFormattedIsCaught) {
  if (!has_formatter()) GTEST_SKIP() << "no clang-format 14";
  const test::TemporaryFolder folder;
  fs::copy_file(kRoot / ".clang-format", folder / ".clang-format");
  test::write_text(folder / "a.cpp", "int  main( ){return 0;}\n");
  EXPECT_NE(formatter({folder / "a.cpp"}).status, 0);
}

TEST(Layout, EveryFolderHasAReadme) {
  for (const char* folder : {"base", "hardware", "shaders_cpp", "frontend", "binner", "tilecore", "replay", "python",
                             "tests", "bench", "captures"})
    EXPECT_TRUE(fs::exists(kRoot / folder / "README.md")) << folder;
}

std::vector<fs::path> documents() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot)) {
    const std::string path = fs::relative(entry.path(), kRoot).string();
    if (entry.path().extension() == ".md" && !path.starts_with("build") && !path.starts_with("out") &&
        !path.starts_with("."))
      files.push_back(entry.path());
  }
  return files;
}

TEST(Documents, GeneratedPagesAreCurrent) {
  for (const std::string& topic : replay::describe_topics()) {
    const std::string generated = replay::describe_markdown(topic);
    std::string page = read_text(kRoot / "docs" / (topic + ".md"));
    // The page of effects goes on behind what is generated.
    if (topic == "effects") page.resize(std::min(page.size(), generated.size()));
    EXPECT_EQ(page, generated) << "run: tessera describe " << topic << " --markdown, for "
                               << (topic == "effects" ? "the beginning of " : "") << "docs/" << topic << ".md";
  }
}

TEST(Documents, TheStabilityPageIsCurrent) {
  EXPECT_EQ(read_text(kRoot / "docs" / "stability.md"), stability_page())
      << "run: build/release/tests/tessera_stability_page > docs/stability.md";
}

// Names of the tests that a gtest program would run, as ctest names them: "Suite.Law", parameters by their names.
std::vector<std::string> listed_tests(std::vector<std::string> command) {
  command.push_back("--gtest_list_tests");
  std::vector<std::string> names;
  std::string suite;
  for (const std::string& line : lines_of(test::run_process(command).output)) {
    const std::string name = line.substr(0, line.find("  #"));
    if (!name.starts_with("  "))
      suite = name;
    else
      names.push_back(suite + name.substr(2));
  }
  return names;
}

// Names of all tests of ctest. An entry that runs several of a program's is all of these.
std::vector<std::string> ctest_names() {
  const test::ProcessResult listed =
      test::run_process({"/usr/bin/env", "ctest", "--show-only=json-v1", "--test-dir", TESSERA_BINARY_DIR});
  EXPECT_EQ(listed.status, 0) << listed.errors;
  std::vector<std::string> names;
  const nlohmann::json all = nlohmann::json::parse(listed.output);
  for (const nlohmann::json& entry : all.at("tests")) {
    std::string name = entry["name"];
    // ctest drops the space between the folder and the suite.
    if (const std::size_t colon = name.find(':'); colon != std::string::npos && name[colon + 1] != ' ')
      name.insert(colon + 1, " ");
    names.push_back(name);
    const std::vector<std::string> command = entry.value("command", std::vector<std::string>{});
    const bool several = std::find(command.begin(), command.end(), "--gtest_brief=1") != command.end() &&
                         !name.starts_with("sanitizers: ");
    if (several)
      for (const std::string& one : listed_tests(command)) names.push_back(name.substr(0, name.find(':') + 2) + one);
  }
  return names;
}

TEST(Documents, EveryTestOfTheStabilityPageExists) {
  const std::vector<std::string> names = ctest_names();
  ASSERT_GT(names.size(), 100u);
  std::vector<std::string> missing = missing_tests(stability_topics(), names);
  // Fuzz targets are tests of builds that have a sanitized one beside them, as ./tessera test makes it.
  if (std::none_of(names.begin(), names.end(), [](const std::string& name) { return name.starts_with("fuzz: "); }))
    std::erase_if(missing, [](const std::string& text) { return text.find(": fuzz: ") != std::string::npos; });
  EXPECT_THAT(missing, testing::IsEmpty());
}

TEST(Documents, EveryTestOfTheFormatsPageExists) {
  const std::vector<std::string> names = ctest_names();
  const auto there = [&](const std::string& suite) {
    return std::any_of(names.begin(), names.end(),
                       [&](const std::string& name) { return name.find(": " + suite + ".") != std::string::npos; });
  };
  for (const nlohmann::json& row : replay::describe_json("formats")) {
    EXPECT_TRUE(there(row["test"].get<std::string>())) << row;
  }
  EXPECT_FALSE(there("NoSuchSuite"));
}

TEST(Documents, TestsThatRunTogetherAreEachThere) {
  const std::vector<std::string> names = ctest_names();
  EXPECT_THAT(names, testing::Contains("replay: TradeoffReport.AResultThatLacksWhatThePageShowsEndsWithStatus3"));
  EXPECT_THAT(names, testing::Not(testing::Contains("replay: TradeoffReport.NoSuchTest")));
}

TEST(Documents, ATestThatIsNotThereIsCaught) {
  const std::vector<StabilityTopic> topics = {
      {"topic", "", {{"case", "", "", {"base: Suite.Law", "base: Case/Suite.Law/Pole_"}}, {"bare", "", "", {}}}}};
  EXPECT_THAT(missing_tests(topics, {"base: Suite.Law/0", "base: Case/Suite.Law/Pole_obb"}),
              testing::ElementsAre("bare: no test"));
  EXPECT_THAT(missing_tests(topics, {"base: Suite.LawAndMore", "base: Case/Suite.Law/Point_obb"}),
              testing::ElementsAre("case: base: Suite.Law", "case: base: Case/Suite.Law/Pole_", "bare: no test"));
}

TEST(Documents, LinksLeadSomewhere) {
  static const std::regex kLink("\\]\\(([^)#]+)(#[^)]*)?\\)");
  for (const fs::path& file : documents()) {
    const std::string text = read_text(file);
    for (auto at = std::sregex_iterator(text.begin(), text.end(), kLink); at != std::sregex_iterator(); ++at) {
      const std::string target = (*at)[1];
      if (target.find("://") == std::string::npos) {
        EXPECT_TRUE(fs::exists(file.parent_path() / target)) << file << " links to " << target;
      }
    }
  }
}

TEST(Documents, PathsInCodeMarksExist) {
  // `folder/file.ext` and `folder/`: a document that names a file names one that is there.
  static const std::regex kPath(
      "`((base|shaders_cpp|scene|memory|hardware|timing|frontend|binner|tilecore|gpu|baselines|reference|replay|python|"
      "include|cmake|tests|bench|captures|docs)/[A-Za-z0-9_./-]*)`");
  for (const fs::path& file : documents()) {
    const std::string text = read_text(file);
    for (auto at = std::sregex_iterator(text.begin(), text.end(), kPath); at != std::sregex_iterator(); ++at)
      EXPECT_TRUE(fs::exists(kRoot / std::string((*at)[1]))) << file << " names " << (*at)[1];
  }
}

TEST(Documents, TesserasExtensionsHaveAPageAndASchemaThatNameEveryMember) {
  const auto json_of = [](const fs::path& file) { return nlohmann::json::parse(read_text(file)); };
  for (const scene::Extension& extension : scene::supported_extensions()) {
    if (!extension.name.starts_with("TESSERA_")) continue;
    const fs::path base = kRoot / "docs" / "extensions" / std::string(extension.name);
    const std::string page = read_text(base.string() + ".md");
    const nlohmann::json schema = json_of(base.string() + ".schema.json");
    std::set<std::string> members, in_schema;
    for (const scene::ExtensionMember& member : extension.members) {
      members.insert(std::string(member.name));
      EXPECT_THAT(page, testing::HasSubstr(std::string(member.name)));
    }
    for (const auto& [name, value] : schema["properties"].items())
      if (name != "extensions" && name != "extras") in_schema.insert(name);
    EXPECT_EQ(in_schema, members) << extension.name;
  }
}

// Lines of the README's shell blocks.
std::vector<std::string> readme_commands() {
  std::vector<std::string> commands;
  bool shell = false;
  for (const std::string& line : lines_of(read_text(kRoot / "README.md"))) {
    if (line.starts_with("```"))
      shell = line == "```sh";
    else if (shell)
      commands.push_back(line.substr(0, line.find(" #")));
  }
  return commands;
}

TEST(Readme, ItsCommandsWork) {
  const test::TemporaryFolder out;
  int run = 0;
  for (const std::string& command : readme_commands()) {
    std::istringstream words(command);
    std::vector<std::string> arguments{std::istream_iterator<std::string>(words), {}};
    if (arguments.empty() || arguments[0] != "./tessera" || arguments[1] == "test") continue;
    arguments.erase(arguments.begin());
    for (std::size_t i = 0; i < arguments.size(); ++i) {
      if (arguments[i].starts_with("captures/")) arguments[i] = (kRoot / arguments[i]).string();
      if (arguments[i] == "out" || arguments[i].starts_with("out/")) arguments[i] = (out / arguments[i]).string();
    }
    const test::ProcessResult r = test::run_tessera(arguments);
    EXPECT_EQ(r.status, 0) << command << "\n" << r.errors;
    ++run;
  }
  EXPECT_GE(run, 3);
}

TEST(Readme, ItsProgramsAreThoseThatAreTested) {
  const std::string page = read_text(kRoot / "README.md");
  for (const char* program : {"consumer/main.cpp", "counters.py"})
    EXPECT_THAT(page, testing::HasSubstr(read_text(kRoot / "tests" / "package" / program) + "```")) << program;
}

// Statistics of the frame that the README's tables are about.
const nlohmann::json& readme_statistics() {
  static const nlohmann::json kTotal = [] {
    const test::TemporaryFolder out;
    EXPECT_EQ(test::run_tessera({"replay", test::shipped_capture("eggs").string(), "--baselines", "--quiet", "--out",
                                 out.path().string()})
                  .status,
              0);
    return nlohmann::json::parse(read_text(out / "stats.json"))["total"];
  }();
  return kTotal;
}

TEST(Readme, ItsFiguresAreThoseOfAReplay) {
  const nlohmann::json& counters = readme_statistics()["counters"];
  static const std::regex kRow("^\\| `([a-z_.]+)` \\| ([0-9 ]+) \\|$");
  int rows = 0;
  for (const std::string& line : lines_of(read_text(kRoot / "README.md"))) {
    std::smatch match;
    if (!std::regex_match(line, match, kRow) || !counters.contains(match[1])) continue;
    EXPECT_EQ(number_of(match[2]), counters[std::string(match[1])].get<std::uint64_t>()) << match[1];
    ++rows;
  }
  EXPECT_GE(rows, 5);
}

TEST(Readme, ItsComparisonIsThatOfAReplay) {
  const nlohmann::json& schemes = readme_statistics()["baselines"];
  const std::vector<std::string> columns = {"queue_bytes_written",  "queue_bytes_read",          "queue_bytes_peak",
                                            "position_evaluations", "domain_evaluations_cached", "dram_bytes"};
  static const std::regex kRow(
      "^\\| `([a-z-]+)` \\| ([0-9 ]+) \\| ([0-9 ]+) \\| ([0-9 ]+) \\| ([0-9 ]+) \\| ([0-9 ]+) \\| ([0-9 ]+) \\|$");
  std::set<std::string> rows;
  for (const std::string& line : lines_of(read_text(kRoot / "README.md"))) {
    std::smatch match;
    if (!std::regex_match(line, match, kRow)) continue;
    const std::string scheme = match[1];
    ASSERT_TRUE(schemes.contains(scheme)) << scheme;
    rows.insert(scheme);
    for (std::size_t c = 0; c < columns.size(); ++c)
      EXPECT_EQ(number_of(match[c + 2]), schemes[scheme]["baseline." + columns[c]].get<std::uint64_t>())
          << columns[c] << " of " << scheme;
  }
  EXPECT_EQ(rows.size(), schemes.size()) << "every scheme";
  EXPECT_THAT(
      read_text(kRoot / "README.md"),
      testing::HasSubstr("| machine | lists written | read | peak | positions alone | evaluations | all traffic |"));
}

TEST(ShadingPage, ItsInvocationsAreThoseOfReplays) {
  int rows = 0;
  for (const auto& row : csv_rows(kRoot / "docs" / "images" / "shading" / "rates.csv")) {
    if (row.at("rate") != "cache") continue;
    const test::TemporaryFolder out;
    ASSERT_EQ(test::run_tessera({"replay", test::shipped_capture(row.at("capture")).string(), "--set",
                                 "shading.rate=cache", "--quiet", "--out", out.path().string()})
                  .status,
              0);
    const nlohmann::json counters = nlohmann::json::parse(read_text(out / "stats.json"))["total"]["counters"];
    for (const auto& [column, counter] : {std::pair{"samples_visible", "tilecore.samples_visible"},
                                          {"invocations", "tilecore.pixel_shader_invocations"},
                                          {"invocations_saved", "tilecore.pixel_shader_invocations_saved"}})
      EXPECT_EQ(number_of(row.at(column)), counters[counter].get<std::uint64_t>())
          << row.at("capture") << ", " << column << ": run docs/images/shading/make.sh";
    ++rows;
  }
  EXPECT_EQ(rows, 4);
}

nlohmann::json study_replay(int tile, int depth, bool baselines) {
  const test::TemporaryFolder out;
  const std::string side = std::to_string(tile);
  std::vector<std::string> arguments = {"replay",  test::shipped_capture("eggs").string(),
                                        "--size",  "640x360",
                                        "--quiet", "--no-report",
                                        "--set",   "frontend.split_pixels=16",
                                        "--set",   "tile.width=" + side,
                                        "--set",   "tile.height=" + side,
                                        "--set",   "frontend.split_depth=" + std::to_string(depth),
                                        "--set",   "parameter_buffer.bytes=16777216",
                                        "--out",   out.path().string()};
  if (baselines) arguments.push_back("--baselines");
  EXPECT_EQ(test::run_tessera(arguments).status, 0);
  return nlohmann::json::parse(read_text(out / "stats.json"))["frames"][0];
}

TEST(BinningStudy, ItsTablesAreThoseOfReplays) {
  const fs::path folder = kRoot / "docs" / "images" / "studies";
  int tiles = 0, depths = 0;
  for (const auto& row : csv_rows(folder / "tiles.csv")) {
    const auto said = [&](const char* column) { return std::stod(row.at(column)); };
    const nlohmann::json of = study_replay(static_cast<int>(said("tile")), 0, true)["baselines"];
    const auto value = [&](const char* scheme, const char* counter) { return of[scheme][counter].get<double>(); };
    const double pre = value("tessera", "baseline.queue_bytes_peak"),
                 post = value("post-tessellation", "baseline.queue_bytes_peak");
    EXPECT_EQ(said("pre_queue_bytes"), pre);
    EXPECT_EQ(said("patch_whole_queue_bytes"), value("patch-whole", "baseline.queue_bytes_peak"));
    EXPECT_EQ(said("post_queue_bytes"), post);
    EXPECT_NEAR(said("post_over_pre_queues"), post / pre, 0.051);
    EXPECT_EQ(said("pre_traffic_bytes"), value("tessera", "baseline.dram_bytes"));
    EXPECT_EQ(said("patch_whole_traffic_bytes"), value("patch-whole", "baseline.dram_bytes"));
    EXPECT_EQ(said("post_traffic_bytes"), value("post-tessellation", "baseline.dram_bytes"));
    EXPECT_NEAR(said("post_over_pre_traffic"), said("post_traffic_bytes") / said("pre_traffic_bytes"), 0.0051);
    ++tiles;
  }
  for (const auto& row : csv_rows(folder / "depths.csv")) {
    const auto said = [&](const char* column) { return std::stod(row.at(column)); };
    const nlohmann::json frame = study_replay(32, static_cast<int>(said("depth")), false);
    const nlohmann::json& counters = frame["counters"];
    for (const auto& [column, counter] : {std::pair{"sub_patches", "frontend.sub_patches"},
                                          {"entries", "binner.entries"},
                                          {"queue_bytes_peak", "binner.queue_bytes_peak"},
                                          {"domain_evaluations", "tilecore.domain_evaluations"}})
      EXPECT_EQ(said(column), counters[counter].get<double>()) << column << ": run docs/images/studies/make.sh";
    double bytes = 0;
    for (const nlohmann::json& part : frame["dram"])
      if (part["purpose"] != "texture" || part["unit"] == "frontend")  // tables of heights by which it bounds
        bytes += part["read_bytes"].get<double>() + part["written_bytes"].get<double>();
    EXPECT_EQ(said("traffic_bytes"), bytes);
    ++depths;
  }
  EXPECT_EQ(tiles, 4);
  EXPECT_EQ(depths, 5);
}

// What the project is for: one to two orders of magnitude less queue memory. Less is a fault of the binner, more means
// that a cost was forgotten.
TEST(Readme, QueuesAreOneToTwoOrdersOfMagnitudeSmallerThanThoseOfTriangles) {
  const nlohmann::json& schemes = readme_statistics()["baselines"];
  for (const char* counter :
       {"baseline.queue_bytes_written", "baseline.queue_bytes_read", "baseline.queue_bytes_peak"}) {
    const double ratio =
        schemes["post-tessellation"][counter].get<double>() / schemes["tessera"][counter].get<double>();
    EXPECT_GE(ratio, 10) << counter;
    EXPECT_LE(ratio, 1000) << counter;
  }
}

TEST(ShippedCaptures, AreWhatTheirSourcesMakeAndSmall) {
  const test::TemporaryFolder out;
  const test::ProcessResult r =
      test::run_process({"/usr/bin/env", "TESSERA_BUILD=" + fs::path(TESSERA_PROGRAM).parent_path().string(),
                         (kRoot / "captures" / "make.sh").string(), out.path().string()});
  ASSERT_EQ(r.status, 0) << r.errors;
  std::uintmax_t bytes = 0;
  for (const char* name : {"eggs", "vases", "serpent", "flyby", "stroll", "workshop", "city", "garden"}) {
    EXPECT_TRUE(read_text(out / (std::string(name) + ".glb")) == read_text(test::shipped_capture(name)))
        << name << " differs: run captures/make.sh";
    bytes += fs::file_size(test::shipped_capture(name));
  }
  EXPECT_LE(bytes, 3u << 20);
  for (const char* name : {"wall_1", "wall_4", "wall_16", "wall_4_plain"}) {
    const fs::path wall = fs::path("studies") / (std::string(name) + ".glb");
    EXPECT_TRUE(read_text(out / wall.string()) == read_text(kRoot / "captures" / wall))
        << name << " differs: run captures/make.sh";
    EXPECT_LE(fs::file_size(kRoot / "captures" / wall), 32u << 10);
  }
}

}  // namespace
}  // namespace tessera
