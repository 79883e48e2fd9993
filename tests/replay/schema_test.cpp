// JSON schemas: they accept the documents that the program writes and reads, and nothing else.
#include "base/error.h"
#include "base/json_text.h"
#include "gpu/configuration.h"
#include "replay/schema/schemas.h"
#include "tests/support/tests.h"

namespace tessera::replay::schema_test {
namespace {

const fs::path kRoot = TESSERA_SOURCE_DIR;

// ---- The schemas themselves -------------------------------------------------------------------------------------

TEST(Schemas, TheProgramPrintsEachOfThem) {
  std::string names;
  for (const std::string& name : schema_names()) {
    names += name + "\n";
    EXPECT_EQ(json::parse(run_tessera({"describe", "schema", name}).output), schema_json(name));
  }
  EXPECT_EQ(run_tessera({"describe", "schema"}).output, names);
}

TEST(Schemas, AnUnknownNameIsRefusedWithTheNearest) {
  const ProcessResult done = run_tessera({"describe", "schema", "stat"});
  EXPECT_EQ(done.status, 2);
  EXPECT_THAT(done.errors, HasSubstr("did you mean 'stats'?"));
  EXPECT_EQ(run_tessera({"describe", "counters", "stats"}).status, 2);
}

// Calls visit(place, schema) for each schema in a schema.
void visit_schemas(const json& value, const std::string& place,
                   const std::function<void(const std::string&, const json&)>& visit) {
  if (value.is_array())
    for (std::size_t k = 0; k < value.size(); ++k) visit_schemas(value[k], fmt::format("{}/{}", place, k), visit);
  if (!value.is_object()) return;
  visit(place, value);
  for (const auto& [name, member] : value.items()) visit_schemas(member, place + "/" + name, visit);
}

// Invariants JS1 and JS2.
TEST(Schemas, ObjectsAreClosedAndEachMemberIsDescribed) {
  for (const std::string& name : schema_names()) {
    const json schema = schema_json(name);
    EXPECT_EQ(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
    EXPECT_THAT(schema["$id"].get<std::string>(), testing::MatchesRegex("urn:tessera:schema:" + name + ":[0-9]+"));
    if (schema["properties"].contains("schema")) {
      EXPECT_THAT(schema["properties"]["schema"]["const"].get<std::string>(),
                  testing::MatchesRegex("tessera\\." + name + "/[0-9]+"));
    }
    std::size_t members = 0;
    visit_schemas(schema, name, [&](const std::string& place, const json& value) {
      if (!value.contains("type") || value["type"] != "object") return;
      EXPECT_TRUE(value.contains("additionalProperties")) << place;
      if (!value.contains("properties")) return;
      EXPECT_EQ(value["additionalProperties"], false) << place;
      for (const auto& [member, of] : value["properties"].items()) {
        EXPECT_TRUE(of.contains("description") && of["description"] != "") << place << "/" << member;
        ++members;
      }
      if (value.contains("required")) {
        for (const json& required : value["required"])
          EXPECT_TRUE(value["properties"].contains(required.get<std::string>())) << place << ": " << required;
      }
    });
    EXPECT_GT(members, 5u) << name;
  }
}

// ---- Against documents of the program --------------------------------------------------------------------------

// Checks documents against the output of `tessera describe schema`.
class SchemaFiles : public testing::Test {
 protected:
  void SetUp() override {
    for (const std::string& name : schema_names())
      test::write_text(schema_file(name), run_tessera({"describe", "schema", name}).output);
  }
  fs::path schema_file(const std::string& name) const { return folder_ / (name + ".schema.json"); }
  void run(std::vector<std::string> arguments) {
    const ProcessResult done = run_tessera(arguments);
    ASSERT_EQ(done.status, 0) << arguments[0] << ": " << done.errors;
  }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void add(const std::string& schema, const json& document, bool valid, const std::string& name) {
    const std::string file = path(fmt::format("case{}.json", cases_.size()));
    test::write_text(file, document.dump());
    cases_.push_back({{"name", schema + ": " + name},
                      {"schema", schema_file(schema).string()},
                      {"document", file},
                      {"valid", valid}});
  }
  // The document, and twins that are each broken in one place.
  void add_with_twins(const std::string& schema, const json& document) {
    add(schema, document, true, "as written");
    json twin = document;
    twin["no_such_member"] = 1;
    add(schema, twin, false, "with an unknown member");
    for (const auto& [member, value] : document.items()) {
      twin = document;
      twin[member] = value.is_object() ? json(json::array()) : json(json::object());
      add(schema, twin, false, "with another type of " + member);
    }
    const json required = schema_json(schema).value("required", json::array());
    for (const json& member : required) {
      twin = document;
      twin.erase(member.get<std::string>());
      add(schema, twin, false, "without " + member.get<std::string>());
    }
  }
  json read(const std::string& name) const { return json::parse(test::read_text(folder_ / name)); }

  void check() {
    test::write_text(folder_ / "cases.json", cases_.dump());
    const ProcessResult done = test::run_process(
        {"/usr/bin/python3", (kRoot / "tests" / "replay" / "check_schemas.py").string(), path("cases.json")});
    if (done.status == 77) GTEST_SKIP() << done.output;
    EXPECT_EQ(done.status, 0) << done.output << done.errors;
  }

  test::TemporaryFolder folder_;
  json cases_ = json::array();
};

// The head of a record (gpu/record_file.h).
json record_head_of(const std::string& bytes) {
  const std::size_t begin = bytes.find('\n') + 1;
  std::uint64_t length = 0;
  std::memcpy(&length, bytes.data() + begin, sizeof(length));
  return json::parse(bytes.substr(begin + sizeof(length), length));
}

TEST_F(SchemaFiles, OfReplays) {
  const auto replay = [&](const std::string& name, const std::string& capture, std::vector<std::string> more) {
    std::vector<std::string> arguments = {"replay",   test::shipped_capture(capture).string(),
                                          "--size",   "64x48",
                                          "--frames", "2:4",
                                          "--quiet",  "--no-report",
                                          "--out",    path(name)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    run(arguments);
  };
  replay("plain", "eggs", {"--record", path("record"), "--sensitivity"});
  replay("phases", "garden", {"--set", "machine.timing=phases", "--baselines"});
  replay("graph", "corridor", {"--baselines"});
  replay("eyes", "vases",
         {"--set", "stereo.eye_separation=0.06", "--set", "resolve.desampling=adaptive", "--set",
          "frame_buffer.compression=lossless"});
  replay("unmodelled", "workshop", {"--set", "output.machine_model=false", "--spp", "16", "--gpu", "entry-mobile"});
  add_with_twins("stats", read("plain/stats.json"));
  json no_counter = read("plain/stats.json");
  no_counter["frames"][0]["counters"]["binner.entrys"] = 1;
  add("stats", no_counter, false, "with an undeclared counter");
  json no_key = read("plain/stats.json");
  no_key["gpu"]["tile"].erase("width");
  add("stats", no_key, false, "without a key of the machine");
  for (const char* name : {"phases", "eyes", "unmodelled", "graph"})
    add("stats", read(fmt::format("{}/stats.json", name)), true, name);
  add_with_twins("tiles", read("eyes/tiles_0003.json"));
  for (const char* name : {"plain", "phases", "unmodelled"})
    add("tiles", read(fmt::format("{}/tiles_0002.json", name)), true, name);
  add_with_twins("record", record_head_of(test::read_text(folder_ / "record")));
  check();
}

TEST_F(SchemaFiles, OfSweeps) {
  const json grid = {{"$schema", "sweep.schema.json"},
                     {"title", "all members"},
                     {"captures", {test::shipped_capture("eggs").string()}},
                     {"frames", "1:2"},
                     {"size", "32x32"},
                     {"gpu", "v3d"},
                     {"settings", {{"sampling.seed", 3}, {"effects.motion", "off"}, {"memory.model", "fluid"}}},
                     {"axes",
                      {{{"key", "memory.gb_per_s"}, {"values", {"x0.5", 10}}},
                       {{"keys", {"tile.width", "tile.height"}}, {"values", {16, {32, 64}}}},
                       {{"key", "clock.mhz"}, {"range", {{"from", 100}, {"to", 200}, {"step", 100}}}}}},
                     {"columns", {"timing.*", "energy.total_nj"}},
                     {"zero_columns", true},
                     {"pictures", true},
                     {"records", true},
                     {"split", {"tiles", "drawables"}}};
  json sampled = grid, searched = grid;
  for (json* study : {&sampled, &searched}) {
    (*study)["axes"] = {{{"key", "clock.mhz"}, {"range", {{"from", 100}, {"to", 200}, {"scale", "log"}}}}};
    (*study)["pictures"] = (*study)["records"] = false;
  }
  sampled["sample"] = {{"method", "random"}, {"points", 3}, {"seed", 1}};
  searched["goal"] = {{"minimise", "energy.total_nj"},
                      {"subject_to", {{"timing.cycles", {{"at_most", 1e7}}}}},
                      {"points", 6},
                      {"population", 4},
                      {"seed", 2}};
  for (const auto& [name, study] :
       {std::pair("grid", grid), std::pair("sampled", sampled), std::pair("searched", searched)}) {
    test::write_text(folder_ / (std::string(name) + ".json"), study.dump());
    run({"sweep", path(std::string(name) + ".json"), "--quiet", "--out", path(name)});
    add("study", study, true, name);
    add_with_twins("sweep", read(std::string(name) + "/sweep.json"));
  }
  add_with_twins("study", grid);
  for (const char* shipped : {"binning", "when_it_pays"})
    add("study", json::parse(test::read_text(kRoot / "captures" / "studies" / (std::string(shipped) + ".json"))), true,
        shipped);
  json both = sampled;
  both["goal"] = searched["goal"];
  add("study", both, false, "with a sample and a goal");
  json axis = grid;
  axis["axes"][0]["range"] = {{"from", 1}, {"to", 2}};
  add("study", axis, false, "with an axis of values and a range");
  axis = grid;
  axis["axes"][0]["key"] = "memory.gb_per_se";
  add("study", axis, false, "with an unknown key");
  for (const auto& entry : fs::directory_iterator(folder_ / "grid" / "records"))
    add("record", record_head_of(test::read_text(entry.path())), true, "of a sweep");
  for (const auto& entry : fs::directory_iterator(folder_ / "grid" / "points"))
    if (entry.path().filename().string().find("_tiles_") != std::string::npos)
      add("tiles", json::parse(test::read_text(entry.path())), true, "of a sweep");
  check();
}

TEST_F(SchemaFiles, OfTradeoffs) {
  run({"tradeoff", test::shipped_capture("eggs").string(), "--size", "32x32", "--knobs", "samples,timing", "--rounds",
       "1", "--run", "2", "--reference-samples", "4", "--max-flip", "1", "--quiet", "--out", path("images")});
  run({"tradeoff", test::shipped_capture("eggs").string(), "--size", "32x32", "--knobs", "timing", "--rounds", "1",
       "--run", "1", "--quiet", "--out", path("timed")});
  run({"tradeoff", test::shipped_capture("eggs").string(), "--size", "32x32", "--effects", "--rounds", "1", "--quiet",
       "--out", path("effects")});
  add_with_twins("tradeoff", read("images/tradeoff.json"));
  add("tradeoff", read("effects/tradeoff.json"), true, "effects");
  add("tradeoff", read("timed/tradeoff.json"), true, "timed");
  check();
}

TEST_F(SchemaFiles, OfMachines) {
  for (const std::string& preset : gpu::preset_names())
    add("machine", gpu::gpu_json(gpu::load_gpu(preset)), true, preset);
  const json machine = {{"$schema", "machine.schema.json"},
                        {"preset", "v3d"},
                        {"name", "mine"},
                        {"description", "What it is."},
                        {"sources", {{"clock.mhz", "data sheet"}}},
                        {"memory", {{"gb_per_s", "x1.3"}, {"latency_clk", 80}}},
                        {"tile", {{"width", 16}}}};
  test::write_text(folder_ / "mine.json", machine.dump());
  const gpu::GpuConfiguration read = gpu::load_gpu(path("mine.json")), base = gpu::load_gpu("v3d");
  EXPECT_EQ(read.memory.gb_per_s, base.memory.gb_per_s * 1.3);
  add_with_twins("machine", machine);
  json wrong = machine;
  wrong["tile"]["width"] = 4000;
  add("machine", wrong, false, "with a number out of range");
  wrong = machine;
  wrong["memory"]["gb_per_s"] = "twice";
  add("machine", wrong, false, "with a multiple that is none");
  check();
}

}  // namespace
}  // namespace tessera::replay::schema_test
