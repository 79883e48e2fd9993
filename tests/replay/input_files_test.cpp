// No result takes the place of a file that the command reads, whatever the name by which it is reached.
#include "replay/input_files.h"

#include "base/error.h"
#include "base/image_codec.h"
#include "scene/gltf/named_files.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/tests.h"

namespace tessera::replay::input_files_test {
namespace {

// A folder with a capture that names files of every kind, and a copy of all bytes.
class Inputs {
 public:
  Inputs() {
    fs::create_directory(at("in put"));
    write_png(at("in put/albedo.png"), Image8(2, 2, 3));
    for (const char* same : {"in put/alternative.ktx2", "in put/frame_0003.png", "in put/medium.mp4", "heights.png"})
      fs::copy_file(at("in put/albedo.png"), at(same));
    test::GltfAsset asset = test::everything_asset();
    test::write_text(at("in put/data.bin"), std::string(asset.binary.begin(), asset.binary.end()));
    test::write_text(at("in put/sky.hdr"), "#?RADIANCE");
    asset.document["buffers"] = {{{"byteLength", asset.binary.size()}, {"uri", "%64ata.bin"}}};
    asset.document["images"] = {
        {{"uri", "sub/../albedo.png"}}, {{"uri", "alternative.ktx2"}}, {{"uri", "frame_0003.png"}}};
    asset.document["textures"][0]["extensions"] = {{"KHR_texture_basisu", {{"source", 1}}}};
    asset.document["extensions"]["TESSERA_capture"]["environment"] = "sky.hdr";
    asset.document["extensions"]["MPEG_media"] = {{"media", {{{"alternatives", {{{"uri", "medium.mp4"}}}}}}}};
    fs::create_directory(at("in put/sub"));
    capture = at("in put/capture.gltf");
    test::write_text(capture, asset.document.dump());
    program = at("in put/wave.shape");
    test::write_text(program, "shape\n");
    before_ = all();
  }

  fs::path at(const std::string& name) const { return folder_ / name; }
  bool unchanged() const { return all() == before_; }
  void note_state() { before_ = all(); }
  const fs::path& folder() const { return folder_.path(); }

  fs::path capture, program;

 private:
  std::map<std::string, std::string> all() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path()))
      files[entry.path().string()] = entry.is_regular_file() ? test::read_text(entry.path()) : "";
    return files;
  }
  test::TemporaryFolder folder_;
  std::map<std::string, std::string> before_;
};

const std::vector<std::string> kNamed = {"capture.gltf",   "data.bin",   "albedo.png", "alternative.ktx2",
                                         "frame_0003.png", "medium.mp4", "sky.hdr"};

TEST(InputFiles, ACaptureNamesBuffersImagesEnvironmentsAndFilesOfExtensions) {
  const Inputs inputs;
  std::set<std::string> names;
  for (const fs::path& file : scene::gltf::named_files(inputs.capture)) names.insert(file.filename().string());
  EXPECT_EQ(names, std::set<std::string>(kNamed.begin() + 1, kNamed.end()));
}

TEST(InputFiles, ABrokenOrMissingCaptureNamesTheFilesBeforeTheFault) {
  const test::TemporaryFolder folder;
  EXPECT_TRUE(scene::gltf::named_files(folder / "none.gltf").empty());
  const std::string whole =
      R"({"images": [{"uri": "a.png"}, {"uri": "data:,x"}, {"uri": "http://a/b"}, {"uri": "%zz"}, )"
      R"({"uri": "b.png"}]})";
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    for (const bool glb : {false, true}) {
      test::write_text(folder / "f", glb ? test::make_glb(whole.substr(0, size), {}) : whole.substr(0, size));
      const std::vector<fs::path> files = scene::gltf::named_files(folder / "f");
      ASSERT_LE(files.size(), 2u);
      if (size == whole.size()) {
        EXPECT_EQ(files, (std::vector<fs::path>{folder / "a.png", folder / "b.png"})) << glb;
      }
    }
  }
}

TEST(InputFiles, AreKnownByDeviceAndInodeWhateverTheirName) {  // IN1, IN2
  const Inputs inputs;
  InputFiles files;
  files.add_capture(inputs.capture);
  for (const std::string& name : kNamed) {
    SCOPED_TRACE(name);
    const fs::path file = inputs.at("in put/" + name), hard = inputs.at("hard"), soft = inputs.at("soft");
    fs::create_hard_link(file, hard);
    fs::create_symlink(file, soft);
    fs::create_symlink(soft, inputs.at("soft2"));
    for (const fs::path& target : {file, hard, soft, inputs.at("soft2"), inputs.at("in put/sub/..") / name})
      EXPECT_THROW(files.check(target), UsageError) << target;
    for (const fs::path& link : {hard, soft, inputs.at("soft2")}) fs::remove(link);
    EXPECT_NO_THROW(files.check(inputs.at(name + ".other")));
  }
  EXPECT_NO_THROW(files.check(inputs.at("heights.png")));
  EXPECT_NO_THROW(files.check("/dev/null"));
}

// ---- Through the program ----------------------------------------------------------------------------------------

// Arguments that would write to a target; "$IN" is the capture, "$TARGET" the target or, of --out, its folder.
struct Writer {
  const char* name;
  std::vector<std::string> arguments;
  bool folder = false;
};
std::vector<Writer> writers() {
  return {
      {"pack", {"pack", "$IN", "$TARGET"}},
      {"pack_displace", {"pack", "$IN", "$TARGET", "--displace", "normal"}},
      {"replay_record", {"replay", "$IN", "--size", "16x16", "--out", "$OUT", "--record", "$TARGET"}},
      {"replay_trace", {"replay", "$IN", "--size", "16x16", "--out", "$OUT", "--trace", "$TARGET"}},
      {"replay_dram",
       {"replay", "$IN", "--size", "16x16", "--out", "$OUT", "--set", "memory.model=banks", "--dram-trace", "$TARGET"}},
      {"replay_history",
       {"replay", "$IN", "--size", "16x16", "--out", "$OUT", "--set", "resolve.desampling=adaptive", "--save-history",
        "$TARGET"}}};
}

void expect_refused(const Inputs& inputs, std::vector<std::string> arguments, const fs::path& target) {
  for (std::string& argument : arguments) {
    if (argument == "$IN") argument = inputs.capture.string();
    if (argument == "$OUT") argument = inputs.at("out").string();
    if (argument == "$TARGET") argument = target.string();
  }
  const ProcessResult r = run_tessera(arguments);
  EXPECT_EQ(r.status, 2) << r.errors;
  EXPECT_THAT(r.errors, HasSubstr("which would be lost; choose another name"));
  EXPECT_TRUE(inputs.unchanged());
}

TEST(InputFiles, NoCommandWritesOverAFileThatTheCaptureNames) {  // IN1
  const Inputs inputs;
  for (const Writer& writer : writers())
    for (const std::string& name : kNamed) {
      SCOPED_TRACE(writer.name + (" onto " + name));
      expect_refused(inputs, writer.arguments, inputs.at("in put/" + name));
    }
}

TEST(InputFiles, NoFolderOfResultsIsOneWhereAResultReplacesAnInput) {  // IN1
  Inputs inputs;
  const fs::path in = inputs.at("in put");
  expect_refused(inputs, {"replay", "$IN", "--size", "16x16", "--out", "$TARGET"}, in);
  fs::create_directory_symlink(in, inputs.at("link"));
  inputs.note_state();
  expect_refused(inputs, {"replay", "$IN", "--size", "16x16", "--out", "$TARGET"}, inputs.at("link"));
  // Other results, each a name of an input.
  for (const auto& [command, result] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"replay", "$IN", "--out", "$TARGET"}, "stats.json"},
           {{"replay", "$IN", "--out", "$TARGET"}, "report.html"},
           {{"replay", "$IN", "--out", "$TARGET"}, "tiles_0001.json"},
           {{"tradeoff", "$IN", "--out", "$TARGET"}, "tradeoff.csv"},
           {{"tradeoff", "$IN", "--out", "$TARGET"}, "reference/a.exr"},
           {{"view", "$IN", "--out", "$TARGET"}, "view_0001.png"},
           {{"sweep", "study.json", "--out", "$TARGET"}, "sweep.csv"},
           {{"sweep", "study.json", "--out", "$TARGET"}, "points/a.png"}}) {
    SCOPED_TRACE(command[0] + " " + result);
    const fs::path out = inputs.at("results");
    fs::create_directories((out / result).parent_path());
    fs::create_hard_link(in / "albedo.png", out / result);
    test::write_text(inputs.at("study.json"), json{{"captures", {inputs.capture.string()}}}.dump());
    inputs.note_state();
    std::vector<std::string> arguments = command;
    std::replace(arguments.begin(), arguments.end(), std::string("study.json"), inputs.at("study.json").string());
    expect_refused(inputs, arguments, out);
    fs::remove_all(out);
  }
}

TEST(InputFiles, FilesOfOptionsAreInputsToo) {  // IN1
  Inputs inputs;
  const std::string heights = inputs.at("heights.png").string();
  expect_refused(inputs, {"pack", "$IN", "$TARGET", "--displace", heights}, heights);
  expect_refused(inputs, {"pack", "$IN", "$TARGET", "--procedure", inputs.program.string()}, inputs.program);
  test::write_text(inputs.at("machine.json"), R"({"base": "mid-mobile"})");
  inputs.note_state();
  const std::string machine = inputs.at("machine.json").string();
  expect_refused(inputs, {"replay", "$IN", "--gpu", machine, "--out", "$OUT", "--record", "$TARGET"}, machine);
  test::write_text(inputs.at("study.json"),
                   json{{"captures", {inputs.capture.string()}}, {"gpu", "machine.json"}}.dump());
  fs::create_directory(inputs.at("out"));
  fs::create_hard_link(machine, inputs.at("out/sweep.json"));
  inputs.note_state();
  expect_refused(inputs, {"sweep", inputs.at("study.json").string(), "--out", "$OUT"}, "");
}

TEST(InputFiles, AResultBesideTheInputsIsWritten) {  // IN2
  const Inputs inputs;
  test::GltfAsset asset = test::everything_asset();
  test::write_text(inputs.at("in put/plain.gltf"), asset.gltf());
  const ProcessResult packed =
      run_tessera({"pack", inputs.at("in put/plain.gltf").string(), inputs.at("in put/albedo.png").string()});
  EXPECT_EQ(packed.status, 0) << packed.errors;  // another capture's image is nothing to this one
}

}  // namespace
}  // namespace tessera::replay::input_files_test
