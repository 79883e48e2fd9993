// Mistakes of users: each is answered by one line that names the remedy, and nothing is destroyed.
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <csignal>

#include "base/image_codec.h"
#include "tests/support/tests.h"

namespace tessera::replay::mistakes_test {
namespace {

using test::run_process;

bool one_line(const std::string& text) { return std::count(text.begin(), text.end(), '\n') == 1; }

// Every file below a folder with its bytes; of links where they lead, of folders nothing.
std::map<std::string, std::string> contents(const fs::path& folder) {
  std::map<std::string, std::string> all;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = fs::relative(entry.path(), folder).string();
    if (entry.is_symlink())
      all[name] = "-> " + fs::read_symlink(entry.path()).string();
    else
      all[name] = entry.is_regular_file() ? test::read_text(entry.path()) : "";
  }
  return all;
}

json stats_of(const fs::path& folder) { return json::parse(test::read_text(folder / "stats.json")); }

// ---- Mistakes ---------------------------------------------------------------------------------------------------

struct Mistake {
  const char* name;
  std::vector<std::string> arguments;  // files lie in the fixture's folder
  int status;
  const char* remedy;
};

std::ostream& operator<<(std::ostream& out, const Mistake& mistake) { return out << mistake.name; }

// The folder of a user: a capture, and other files.
class Mistakes : public testing::TestWithParam<Mistake> {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TemporaryFolder;
    const fs::path& folder = folder_->path();
    fs::copy_file(test::shipped_capture("vases"), folder / "vases.glb");
    fs::create_directory(folder / "models");
    fs::copy_file(test::shipped_capture("eggs"), folder / "models" / "eggs.glb");
    fs::create_directory(folder / "empty");
    fs::create_symlink("vases.glb", folder / "link.glb");
    Image8 image(8, 8, 3);
    write_png(folder / "a.png", image);
    const std::map<std::string, std::string> texts = {
        {"scene.blend", "BLENDER-v300RENDH"},
        {"scene.fbx", std::string("Kaydara FBX Binary  \0\x1a", 22)},
        {"scene.obj", "# made by hand\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
        {"scene.usd", "#usda 1.0\n"},
        {"scene.zip", "PK\x03\x04 and so on"},
        {"nothing.glb", ""},
        {"file", "precious"},
        {"comma.json", "{\n  \"tile\": {\"width\": 16, \"height\": 16},\n}\n"},
        {"key.json", R"({"tile": {"widht": 16}})"},
        {"loop.json", R"({"base": "loop.json"})"},
        {"both.json", R"({"base": "v3d", "preset": "v3d"})"},
        {"impossible.json", R"({"name": "impossible", "base": "v3d", "clock": {"mhz": 9000}})"},
        {"study.json", R"({"captures": ["vases.glb"], "axes": [{"key": "tile.width", "values": [16, 32]}]})"}};
    for (const auto& [name, text] : texts) test::write_text(folder / name, text);
    ASSERT_EQ(run_in_folder({"replay", "vases.glb", "--size", "16x16", "--quiet", "--no-report", "--out", "results",
                             "--record", "vases.record"})
                  .status,
              0);
  }
  static void TearDownTestSuite() { delete std::exchange(folder_, nullptr); }

  static ProcessResult run_in_folder(const std::vector<std::string>& arguments) {
    std::vector<std::string> command = {"/bin/sh", "-c", "cd \"$0\" && exec \"$@\"", folder_->path().string(),
                                        TESSERA_PROGRAM};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return run_process(command);
  }

  inline static test::TemporaryFolder* folder_ = nullptr;
};

TEST_P(Mistakes, AreAnsweredByOneLineThatNamesTheRemedyAndDestroyNothing) {
  const auto before = contents(folder_->path());
  const ProcessResult r = run_in_folder(GetParam().arguments);
  EXPECT_EQ(r.status, GetParam().status) << r.errors;
  EXPECT_TRUE(one_line(r.errors)) << r.errors;
  EXPECT_THAT(r.errors, testing::StartsWith("tessera: "));
  EXPECT_THAT(r.errors, HasSubstr(GetParam().remedy));
  EXPECT_EQ(r.output, "");
  EXPECT_EQ(contents(folder_->path()), before);
}

std::vector<Mistake> mistakes() {
  const auto replay = [](std::vector<std::string> more) {
    std::vector<std::string> all = {"replay", "vases.glb", "--size", "16x16", "--quiet", "--out", "new"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  return {
      {"NoCommand", {"replya", "vases.glb"}, 2, "did you mean 'replay'?"},
      {"WrongOption", replay({"--sice", "3x3"}), 2, "did you mean '--size'?"},
      {"MisspelledKey", replay({"--set", "tile.widht=16"}), 2, "did you mean 'tile.width'?"},
      {"KeyWithoutValue", replay({"--set", "tile.width"}), 2, "KEY=VALUE"},
      {"FramesReversed", replay({"--frames", "5:2"}), 2, "expected A:B with A < B"},
      {"OneFrame", replay({"--frames", "5"}), 2, "expected A:B with A < B"},
      {"NegativeFrame", replay({"--frames=-1:4"}), 2, "expected A:B with A < B"},
      {"NoSize", {"replay", "vases.glb", "--size", "0x0"}, 2, "expected WIDTHxHEIGHT, 1 to 16384 each"},
      {"TooLarge", {"replay", "vases.glb", "--size", "20000x20000"}, 2, "1 to 16384 each"},
      {"TwoSizes", replay({"--size", "32x32"}), 2, "--size: is given 2 times; give it once"},
      {"NegativeThreads", replay({"--threads", "-1"}), 2, "--threads -1: expected a number"},
      {"TwoCaptures", replay({"models/eggs.glb"}), 2, "unexpected argument 'models/eggs.glb'"},
      {"MissingFile", {"replay", "vase.glb"}, 3, "no such file; did you mean 'vases.glb'?"},
      {"FolderAsCapture", {"replay", "models"}, 3, "give a .gltf or .glb file; in it models/eggs.glb"},
      {"EmptyFile", {"replay", "nothing.glb"}, 3, "the file is empty"},
      {"Blend", {"replay", "scene.blend"}, 3, "is a Blender file: open it in Blender and export glTF 2.0"},
      {"Fbx", {"replay", "scene.fbx"}, 3, "is an FBX file: convert it with FBX2glTF"},
      {"Obj", {"inspect", "scene.obj"}, 3, "is a Wavefront OBJ file: convert it"},
      {"Usd", {"tradeoff", "scene.usd", "--out", "new"}, 3, "is a USD file: import it in Blender"},
      {"Zip", {"pack", "scene.zip", "new.glb"}, 3, "is a ZIP archive: unpack it"},
      {"Image", {"replay", "a.png"}, 3, "is an image (PNG): `tessera compare` takes images"},
      {"StudyToReplay", {"replay", "study.json"}, 3, "is a study: `tessera sweep study.json --out DIR`"},
      {"RecordToReplay", {"replay", "vases.record"}, 3, "is a record of a replay: `tessera time vases.record`"},
      {"ResultsToReplay", {"replay", "results"}, 3, "is the folder of a replay: `tessera report`"},
      {"StatisticsToReplay", {"replay", "results/stats.json"}, 3, "`tessera compare` takes it"},
      {"MachineToReplay", {"replay", "key.json"}, 3, "describes a machine: give it to --gpu key.json"},
      {"CaptureToTime",
       {"time", "vases.glb"},
       3,
       "is a capture: `tessera replay vases.glb` renders it, and with --record"},
      {"CaptureToSweep", {"sweep", "vases.glb", "--out", "new"}, 3, "is a capture: `tessera replay vases.glb`"},
      {"CaptureToReport", {"report", "vases.glb"}, 3, "is a capture: `tessera replay vases.glb`"},
      {"FolderWithoutResults", {"compare", "results", "empty"}, 3, "holds no stats.json"},
      {"ImageAndReplay", {"compare", "results", "a.png"}, 2, "images or replays, not both"},
      {"UnknownMetric",
       {"compare", "results", "results", "--no-images", "--threshold", "cycle=2"},
       2,
       "did you mean 'cycles'?"},
      {"UnknownPreset", replay({"--gpu", "mid-mobil"}), 2, "did you mean 'mid-mobile'?"},
      {"MissingMachine", replay({"--gpu", "my.json"}), 2, "no GPU file 'my.json'; presets: entry-mobile"},
      {"FolderAsMachine", replay({"--gpu", "models"}), 3, "models: is a folder: give a preset or a JSON file"},
      {"CaptureAsMachine", replay({"--gpu", "models/eggs.glb"}), 3, "models/eggs.glb: is a capture"},
      {"CommaTooMany", replay({"--gpu", "comma.json"}), 3, "remove the comma before '}' in line 2"},
      {"MisspelledMember", replay({"--gpu", "key.json"}), 3, "did you mean 'tile.width'?"},
      {"MachineOfItself", replay({"--gpu", "loop.json"}), 3, "files that start from each other"},
      {"TwoBases", replay({"--gpu", "both.json"}), 3, "leave one of them out"},
      {"ImpossibleMachine", replay({"--gpu", "impossible.json"}), 2, "clock.mhz: 9000 MHz need"},
      {"UnknownCamera", replay({"--camera", "eye"}), 2, "no camera 'eye' in vases.glb, which has"},
      {"UnknownAnimation", replay({"--animation", "walk"}), 2, "no animation 'walk' in vases.glb, which has none"},
      {"UnknownScene", replay({"--scene", "7"}), 2, "no scene '7' in vases.glb, which has"},
      {"OrbitOfACamera", replay({"--orbit", "30", "--camera", "0"}), 2, "leave one of them out"},
      {"OrbitInWords", replay({"--orbit", "left"}), 2, "expected DEGREES[:ELEVATION]"},
      {"LensInWords", replay({"--lens", "wide"}), 2, "expected RADIUS[:FOCUS] in scene units"},
      {"ShutterReversed", replay({"--shutter", "1:0"}), 2, "OPEN not after CLOSE"},
      {"UnknownLayer", replay({"--aux", "nrmal"}), 2, "layers are depth, normal"},
      {"RegionOutside", replay({"--region", "10,10,10,10"}), 2, "is not inside the frame of 16x16"},
      {"UnknownTopic", {"describe", "counter"}, 2, "did you mean 'counters'?"},
      {"UnknownShell", {"describe", "completion", "fish"}, 2, "shells are bash and zsh"},
      {"DifferenceOfCounters", {"describe", "counters", "--diff", "v3d", "v3d"}, 2, "is for `tessera describe gpu`"},
      {"OutIsAFile", {"replay", "vases.glb", "--out", "file"}, 2, "file is not a folder"},
      {"OutInsideAFile", {"replay", "vases.glb", "--out", "file/deep"}, 2, "file is not a folder"},
      {"OutIsTheInput", {"replay", "vases.glb", "--out", "vases.glb"}, 2, "vases.glb is not a folder"},
      {"OutIsNothing", {"replay", "vases.glb", "--out", ""}, 2, "expected the name of a folder"},
      {"OutCannotBeWritten",
       {"replay", "vases.glb", "--size", "16x16", "--quiet", "--out", "/proc/new"},
       6,
       "cannot create the folder /proc/new"},
      {"PackOntoItself", {"pack", "vases.glb", "vases.glb"}, 2, "it is the input, which would be lost"},
      {"PackOntoItselfByALink", {"pack", "vases.glb", "link.glb"}, 2, "it is the input, which would be lost"},
      {"PackAsKtx2", {"pack", "vases.glb", "new.glb", "--ktx2", "uastc"}, 2, "use --webp"},
      {"PackAsKtx2WithoutFiles", {"pack", "--ktx2=etc1s"}, 2, "basisu or toktx"},
      {"RecordOntoTheCapture", replay({"--record", "vases.glb"}), 2, "it is the input, which would be lost"},
      {"MapOntoAnImage", {"compare", "a.png", "results/frame_0000.png", "--flip-map", "a.png"}, 2, "it is the input"},
  };
}

INSTANTIATE_TEST_SUITE_P(OfAUser, Mistakes, testing::ValuesIn(mistakes()),
                         [](const auto& mistake) { return std::string(mistake.param.name); });

// ---- Outputs ----------------------------------------------------------------------------------------------------

class Outputs : public testing::Test {
 protected:
  // Frames of "flyby" by default.
  static std::vector<std::string> replay(const fs::path& out, std::vector<std::string> more = {}) {
    std::vector<std::string> all = {
        "replay", test::shipped_capture("flyby").string(), "--no-report", "--quiet", "--out", out.string()};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  static ProcessResult shell(const std::string& script, const std::vector<std::string>& arguments) {
    std::vector<std::string> command = {"/bin/sh", "-c", script, "sh", TESSERA_PROGRAM};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return run_process(command);
  }
  // Frames that statistics hold, and whether a file is half written.
  static std::size_t frames_in(const fs::path& out) { return stats_of(out)["frames"].size(); }
  static bool half_written(const fs::path& out) {
    return std::any_of(fs::directory_iterator(out), {},
                       [](const auto& entry) { return entry.path().extension() == ".part"; });
  }
  static void expect_saved(const ProcessResult& r, const fs::path& out, const char* reason) {
    EXPECT_EQ(r.status, 6) << r.errors;
    EXPECT_TRUE(one_line(r.errors)) << r.errors;
    EXPECT_THAT(r.errors, HasSubstr(reason));
    EXPECT_THAT(r.errors, HasSubstr("frames are in"));
    EXPECT_THAT(r.errors, testing::Not(HasSubstr(".part")));
    EXPECT_GE(frames_in(out), 1u);
    EXPECT_LT(frames_in(out), 40u);
    EXPECT_EQ(stats_of(out)["stopped"]["wanted_frames"], 40);
    EXPECT_TRUE(fs::exists(out / "stats.csv"));
    EXPECT_FALSE(half_written(out));
  }

  test::TemporaryFolder folder_;
};

// Images of 1280x720 do not fit into the files that may be written, statistics do.
TEST_F(Outputs, FilesThatMayNotGrowLeaveTheStatisticsOfFinishedFrames) {
  const ProcessResult r =
      shell("ulimit -f 800; exec \"$@\"", replay(folder_ / "out", {"--frames", "0:40", "--spp", "1"}));
  expect_saved(r, folder_ / "out", "File too large");
}

// Where namespaces of its own let a user mount a file system.
TEST_F(Outputs, AFullDiskLeavesTheStatisticsOfFinishedFrames) {
  const fs::path disk = folder_ / "disk";
  fs::create_directory(disk);
  const std::string script =
      "exec unshare --user --map-root-user --mount sh -c 'mount -t tmpfs -o size=3m tmpfs \"$1\" || exit 77; shift; "
      "\"$@\"; status=$?; cp \"$KEEP\"/* \"$KEPT\"; exit $status' sh " +
      disk.string() + " \"$@\"";
  fs::create_directory(folder_ / "kept");
  ::setenv("KEEP", (disk / "out").c_str(), 1);
  ::setenv("KEPT", (folder_ / "kept").c_str(), 1);
  const ProcessResult r = shell(script, replay(disk / "out", {"--frames", "0:40", "--size", "320x180"}));
  if (r.status == 77 || r.status == 127 || r.errors.find("unshare") != std::string::npos)
    GTEST_SKIP() << "no file system can be mounted here: " << r.errors;
  expect_saved(r, folder_ / "kept", "No space left on device");
}

TEST_F(Outputs, ARunThatIsKilledLeavesWholeFilesAndTheNextOneWorks) {
  const fs::path out = folder_ / "out";
  const std::vector<std::string> command = replay(out, {"--frames", "0:400", "--size", "320x180"});
  const ProcessResult killed = run_tessera(command, {.kill_when = [&] { return fs::exists(out / "frame_0003.png"); }});
  EXPECT_EQ(killed.signal, SIGKILL);
  for (int frame = 0; frame < 3; ++frame)
    EXPECT_NO_THROW(std::ignore = json::parse(test::read_text(out / ("tiles_000" + std::to_string(frame) + ".json"))));
  EXPECT_FALSE(fs::exists(out / "stats.json"));
  test::write_text(out / "frame_0001.png.1-1.part", "half");
  const ProcessResult again = run_tessera(replay(out, {"--frames", "0:2", "--size", "320x180"}));
  EXPECT_EQ(again.status, 0) << again.errors;
  EXPECT_EQ(frames_in(out), 2u);
  EXPECT_FALSE(half_written(out));
}

TEST_F(Outputs, AStoppedRunEndsWithStatus130AndSaysHowToGoOn) {
  for (const char* signal : {"INT", "TERM"}) {
    const fs::path out = folder_ / signal;
    const ProcessResult r = shell("\"$@\" & child=$!; while [ ! -e " + (out / "frame_0003.png").string() +
                                      " ]; do sleep 0.05; done; kill -" + std::string(signal) + " $child; wait $child",
                                  replay(out, {"--frames", "3:5000", "--size", "320x180"}));
    EXPECT_EQ(r.status, 130) << r.errors;
    EXPECT_TRUE(one_line(r.errors)) << r.errors;
    const std::size_t done = frames_in(out);
    EXPECT_THAT(r.errors, HasSubstr("--frames " + std::to_string(3 + done) + ":5000 and another --out"));
    EXPECT_EQ(stats_of(out)["stopped"]["wanted_frames"], 4997);
  }
}

// OL1, with the test as the one at work.
TEST_F(Outputs, ASecondRunIntoAFolderInUseIsRefusedAndMayFollow) {
  const fs::path out = folder_ / "out";
  fs::create_directory(out);
  const int held = ::open(out.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  ASSERT_GE(held, 0);
  ASSERT_EQ(::flock(held, LOCK_EX | LOCK_NB), 0);
  const std::vector<std::string> sweep = {"sweep", (folder_ / "study.json").string(), "--quiet", "--out", out.string()};
  test::write_text(folder_ / "study.json",
                   R"({"captures": [")" + test::shipped_capture("vases").string() + R"("], "size": "16x16"})");
  for (const auto& command : {replay(out, {"--frames", "0:1", "--size", "16x16"}), sweep}) {
    const ProcessResult r = run_tessera(command);
    EXPECT_EQ(r.status, 6) << r.errors;
    EXPECT_TRUE(one_line(r.errors)) << r.errors;
    EXPECT_THAT(r.errors, HasSubstr("another tessera is at work there; wait for it, or choose another --out"));
    EXPECT_TRUE(fs::is_empty(out));
  }
  ::close(held);
  EXPECT_EQ(run_tessera(replay(out, {"--frames", "0:1", "--size", "16x16"})).status, 0);
}

// OL2.
TEST_F(Outputs, AFolderThatWasMadeForNothingIsGone) {
  const ProcessResult r = shell("ulimit -f 0; exec \"$@\"", replay(folder_ / "new" / "deep", {"--size", "16x16"}));
  EXPECT_EQ(r.status, 6);
  EXPECT_FALSE(fs::exists(folder_ / "new"));
}

TEST_F(Outputs, TheSameCommandAgainGivesTheSameAndLeavesForeignFiles) {
  const fs::path out = folder_ / "out";
  fs::create_directories(out / "notes");
  test::write_text(out / "notes" / "mine.txt", "precious");
  test::write_text(out / "frame_of_mine.png", "precious");
  const std::vector<std::string> command = replay(out, {"--frames", "0:2", "--size", "64x36"});
  std::map<std::string, std::string> before;
  for (int run = 0; run < 2; ++run) {
    ASSERT_EQ(run_tessera(command).status, 0);
    auto after = contents(out);
    EXPECT_EQ(after["notes/mine.txt"], "precious");
    EXPECT_EQ(after["frame_of_mine.png"], "precious");
    for (const char* timed : {"stats.json", "stats.csv"}) after.erase(timed);
    if (run == 1) {
      EXPECT_EQ(after, before);
    }
    before = after;
  }
}

TEST_F(Outputs, NamesWithNewlinesAndSpacesWorkAndMessagesStayOneLine) {
  const fs::path out = folder_ / "two\nlines and 'quotes'";
  EXPECT_EQ(run_tessera(replay(out, {"--frames", "0:1", "--size", "16x16"})).status, 0);
  EXPECT_EQ(frames_in(out), 1u);
  fs::remove(out / "stats.json");
  fs::create_directory(out / "stats.json");
  const ProcessResult r = run_tessera(replay(out, {"--frames", "0:1", "--size", "16x16"}));
  EXPECT_EQ(r.status, 2);
  EXPECT_TRUE(one_line(r.errors)) << r.errors;
}

TEST_F(Outputs, ALinkToAFolderStaysAndOneToNothingIsRefused) {
  fs::create_directory(folder_ / "real");
  fs::create_directory_symlink("real", folder_ / "link");
  EXPECT_EQ(run_tessera(replay(folder_ / "link", {"--frames", "0:1", "--size", "16x16"})).status, 0);
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(frames_in(folder_ / "real"), 1u);
  fs::create_symlink("nowhere", folder_ / "dangling");
  const ProcessResult r = run_tessera(replay(folder_ / "dangling", {"--size", "16x16"}));
  EXPECT_EQ(r.status, 2);
  EXPECT_TRUE(one_line(r.errors)) << r.errors;
  EXPECT_THAT(r.errors, HasSubstr("dangling is not a folder"));
}

TEST_F(Outputs, TheFolderOfTheCaptureMayBeTheFolderOfTheResults) {
  fs::copy_file(test::shipped_capture("vases"), folder_ / "vases.glb");
  const std::string before = test::read_text(folder_ / "vases.glb");
  const ProcessResult r = run_tessera({"replay", (folder_ / "vases.glb").string(), "--size", "16x16", "--quiet",
                                       "--out", folder_.path().string() + "/"});
  EXPECT_EQ(r.status, 0) << r.errors;
  EXPECT_EQ(test::read_text(folder_ / "vases.glb"), before);
}

TEST_F(Outputs, AFolderThatMayNotBeWrittenIsStatus6) {
  fs::create_directory(folder_ / "locked");
  fs::permissions(folder_ / "locked", fs::perms::owner_read | fs::perms::owner_exec);
  if (::access((folder_ / "locked").c_str(), W_OK) == 0) GTEST_SKIP() << "this user may write anywhere";
  const ProcessResult r = run_tessera(replay(folder_ / "locked" / "out", {"--size", "16x16"}));
  EXPECT_EQ(r.status, 6);
  EXPECT_TRUE(one_line(r.errors)) << r.errors;
  EXPECT_THAT(r.errors, HasSubstr("Permission denied"));
  fs::permissions(folder_ / "locked", fs::perms::owner_all);
}

TEST_F(Outputs, AnUnwritableSummaryIsStatus6AndTheResultsAreThere) {
  std::vector<std::string> command = replay(folder_ / "out", {"--frames", "0:1", "--size", "16x16"});
  std::erase(command, "--quiet");
  const ProcessResult r = shell("exec \"$@\" > /dev/full 2>/dev/null", command);
  EXPECT_EQ(r.status, 6);
  EXPECT_EQ(frames_in(folder_ / "out"), 1u);
}

TEST_F(Outputs, AReplayEndsWithSixLines) {
  std::vector<std::string> command = replay(folder_ / "out", {"--frames", "0:2", "--size", "64x36"});
  std::erase(command, "--quiet");
  const ProcessResult r = run_tessera(command);
  EXPECT_EQ(r.status, 0) << r.errors;
  EXPECT_EQ(std::count(r.output.begin(), r.output.end(), '\n'), 6) << r.output;
  EXPECT_THAT(r.output, testing::ContainsRegex("^time .* ms a frame, .* cycles of mid-mobile at"));
  for (const char* line :
       {"\ntarget    2 of 2 frames meet 60 frames/s", "\nbound by ", "\ntraffic ", "\nenergy ", "\nresults "})
    EXPECT_THAT(r.output, HasSubstr(line));
  EXPECT_THAT(r.output, HasSubstr("stats.json, stats.csv, 2 frames\n"));
}

TEST(Mistakes, ATradeoffOfABloomNamesTheKeyThatLeavesItOut) {
  const test::TemporaryFolder folder;
  const ProcessResult r = run_tessera({"tradeoff", test::shipped_capture("corridor").string(), "--out",
                                       (folder / "a").string(), "--size", "64x36", "--knobs", "samples", "--quiet"});
  EXPECT_EQ(r.status, 2);
  EXPECT_THAT(r.errors, testing::HasSubstr("set post.bloom=0"));
  EXPECT_TRUE(one_line(r.errors)) << r.errors;
}

}  // namespace
}  // namespace tessera::replay::mistakes_test
