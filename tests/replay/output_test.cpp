// Places of results: files, streams, and targets that must never be replaced, by the rules of base/output_file.h.
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>
#include <csignal>

#include "base/image_codec.h"
#include "tests/support/tests.h"

namespace tessera::replay::output_test {
namespace {

std::set<std::string> files_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

bool one_line(const std::string& text) { return std::count(text.begin(), text.end(), '\n') == 1; }

std::string capture(const char* name) { return test::shipped_capture(name).string(); }

// An option that names one file; the text written there follows from the inputs alone.
struct NamedOutput {
  const char* name;
  std::vector<std::string> before, after;  // arguments
};

std::ostream& operator<<(std::ostream& out, const NamedOutput& output) { return out << output.name; }

class Output : public testing::TestWithParam<NamedOutput> {
 protected:
  Output() {
    Image8 image(8, 8, 3);
    write_png(inputs_ / "a.png", image);
    image.values[0] = 255;
    write_png(inputs_ / "b.png", image);
  }

  // The call that writes its result to `target`; --out is a folder that the call makes.
  std::vector<std::string> call(const std::string& target) const {
    std::vector<std::string> arguments = GetParam().before;
    arguments.push_back(target);
    arguments.insert(arguments.end(), GetParam().after.begin(), GetParam().after.end());
    if (arguments[0] == "replay") arguments.insert(arguments.end(), {"--quiet", "--out", out().string()});
    for (std::string& argument : arguments)
      if (argument == "a.png" || argument == "b.png") argument = (inputs_ / argument).string();
    return arguments;
  }
  fs::path out() const { return inputs_ / "out"; }

  // Through /bin/sh: "$@" is the program with the arguments of call(target), $OUT a file of folder_.
  ProcessResult shell(const std::string& script, const std::string& file, const std::string& target) const {
    std::vector<std::string> argv = {"/bin/sh",      "-c", "OUT=$1; shift; " + script, "sh", (folder_ / file).string(),
                                     TESSERA_PROGRAM};
    for (const std::string& argument : call(target)) argv.push_back(argument);
    return test::run_process(argv);
  }
  ProcessResult shell(const std::string& script, const std::string& file) const {
    return shell(script, file, (folder_ / file).string());
  }

  std::string whole() const {
    const fs::path file = inputs_ / "whole";
    EXPECT_EQ(run_tessera(call(file.string())).status, 0);
    return test::read_text(file);
  }

  test::TemporaryFolder inputs_, folder_;  // folder_: where outputs are named
};

// A device of numbers 1, `minor` in a folder of its own. Without the rights for that, it is the system's device,
// which then cannot be replaced either. Without either there is nothing.
std::optional<fs::path> device(const test::TemporaryFolder& folder, const char* name, unsigned minor) {
  if (::geteuid() != 0) return fs::path("/dev") / name;
  if (::mknod((folder / name).c_str(), S_IFCHR | 0666, makedev(1, minor)) != 0) return std::nullopt;
  const int opened = ::open((folder / name).c_str(), O_WRONLY);
  if (opened < 0) return std::nullopt;
  ::close(opened);
  return folder / name;
}

TEST_P(Output, AFifoGetsTheWholeResultAndStays) {
  const std::string expected = whole();
  ASSERT_EQ(::mkfifo((folder_ / "fifo").c_str(), 0600), 0);
  const ProcessResult r =
      shell("timeout 60 cat \"$OUT\" > \"$OUT.copy\" & \"$@\"; status=$?; wait; exit $status", "fifo");
  EXPECT_EQ(r.status, 0) << r.errors;
  EXPECT_TRUE(fs::is_fifo(folder_ / "fifo"));
  EXPECT_EQ(test::read_text(folder_ / "fifo.copy"), expected);
  EXPECT_EQ(files_in(folder_.path()), (std::set<std::string>{"fifo", "fifo.copy"}));
}

TEST_P(Output, ADescriptorIsWrittenAtItsOffset) {
  const std::string expected = whole();
  for (const char* name : {"/dev/fd/3", "/proc/self/fd/3"}) {
    test::write_text(folder_ / "file", "before,");
    const ProcessResult r = shell("\"$@\" 3>>\"$OUT\"", "file", name);
    EXPECT_EQ(r.status, 0) << r.errors;
    EXPECT_EQ(test::read_text(folder_ / "file"), "before," + expected) << name;
  }
  EXPECT_EQ(files_in(folder_.path()), std::set<std::string>{"file"});
}

TEST_P(Output, StandardOutputHoldsTheResultAlone) {
  const std::string expected = whole();
  const ProcessResult r = run_tessera(call("/proc/self/fd/1"));
  if (GetParam().name == std::string("flip_map")) {
    EXPECT_EQ(r.status, 2);  // its figures go there
    return;
  }
  EXPECT_EQ(r.status, 0) << r.errors;
  EXPECT_EQ(r.output, expected);
}

TEST_P(Output, ADeviceIsWrittenThroughAndAFullOneIsStatus6) {
  const auto null = device(folder_, "null", 3), full = device(folder_, "full", 7);
  if (!null || !full) GTEST_SKIP() << "no device can be made here";
  const std::set<std::string> before = files_in(folder_.path());
  const ProcessResult r = run_tessera(call(null->string()));
  EXPECT_EQ(r.status, 0) << r.errors;
  const ProcessResult failed = run_tessera(call(full->string()));
  EXPECT_EQ(failed.status, 6);
  EXPECT_TRUE(one_line(failed.errors)) << failed.errors;
  EXPECT_THAT(failed.errors, HasSubstr("full: No space left on device"));
  for (const fs::path& file : {*null, *full}) EXPECT_TRUE(fs::is_character_file(file)) << file;
  EXPECT_EQ(files_in(folder_.path()), before);
}

TEST_P(Output, AReaderThatWentAwayIsStatus6) {
  const auto broken = [](const ProcessResult& r, const std::string& status) {
    EXPECT_EQ(status, "6") << r.errors;
    EXPECT_TRUE(one_line(r.errors)) << r.errors;
    EXPECT_THAT(r.errors, HasSubstr("Broken pipe"));
  };
  const ProcessResult pipe =
      shell("{ { sleep 0.2; \"$@\" 3>&1 >/dev/null; printf $? >&4; } | :; } 4>&1", "none", "/dev/fd/3");
  broken(pipe, pipe.output);
  if (GetParam().before[0] != "replay") return;  // writes as soon as there is a reader
  ASSERT_EQ(::mkfifo((folder_ / "fifo").c_str(), 0600), 0);
  const ProcessResult fifo = shell("timeout 60 sh -c ': < \"$1\"' sh \"$OUT\" & \"$@\"", "fifo");
  broken(fifo, std::to_string(fifo.status));
}

TEST_P(Output, CtrlCEndsTheWaitForAReader) {
  ASSERT_EQ(::mkfifo((folder_ / "fifo").c_str(), 0600), 0);
  const ProcessResult r = run_tessera(call((folder_ / "fifo").string()), {.seconds = 60, .interrupt_after_ms = 800});
  EXPECT_FALSE(r.timed_out);
  EXPECT_EQ(r.signal, SIGINT);
}

TEST_P(Output, AnUnusablePlaceForAResultIsStatus2BeforeAnyWork) {
  fs::create_directory(folder_ / "folder");
  fs::create_symlink("folder", folder_ / "link");
  test::write_text(folder_ / "file", "x");
  std::vector<std::pair<std::string, const char*>> places = {
      {"folder", "is a folder"}, {"link", "is a folder"}, {"no/such", "is missing"}, {"file/x", "is not a folder"}};
  // A block device that nothing drives.
  if (::mknod((folder_ / "block").c_str(), S_IFBLK | 0600, makedev(240, 0)) == 0)
    places.push_back({"block", "is a block device"});
  const std::set<std::string> before = files_in(folder_.path());
  for (const auto& [name, why] : places) {
    const ProcessResult r = run_tessera(call((folder_ / name).string()));
    EXPECT_EQ(r.status, 2) << name;
    EXPECT_TRUE(one_line(r.errors)) << r.errors;
    EXPECT_THAT(r.errors, HasSubstr(why));
    EXPECT_EQ(r.output, "");
    EXPECT_FALSE(fs::exists(out())) << name;
  }
  EXPECT_EQ(files_in(folder_.path()), before);
  EXPECT_TRUE(fs::is_empty(folder_ / "folder"));
  EXPECT_EQ(test::read_text(folder_ / "file"), "x");
}

TEST_P(Output, ASymlinkStaysAndItsTargetIsReplacedWhole) {
  const std::string expected = whole();
  fs::create_directory(folder_ / "there");
  test::write_text(folder_ / "there" / "file", "old");
  fs::create_symlink("there/file", folder_ / "link");
  ASSERT_EQ(run_tessera(call((folder_ / "link").string())).status, 0);
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(test::read_text(folder_ / "there" / "file"), expected);
  EXPECT_EQ(files_in(folder_ / "there"), std::set<std::string>{"file"});
}

TEST_P(Output, ARunThatFailsInTheMiddleLeavesTheOldFile) {
  test::write_text(folder_ / "file", "old");
  // No file may grow: writes fail as on a full disk.
  const ProcessResult r = shell("trap '' XFSZ; ulimit -f 0; \"$@\"", "file");
  EXPECT_EQ(r.status, 6);
  EXPECT_TRUE(one_line(r.errors)) << r.errors;
  EXPECT_EQ(test::read_text(folder_ / "file"), "old");
  EXPECT_EQ(files_in(folder_.path()), std::set<std::string>{"file"});
}

std::vector<NamedOutput> named_outputs() {
  const auto replay = [](std::vector<std::string> more) {
    std::vector<std::string> all = {"replay", capture("vases"), "--size", "160x90"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  return {{"trace", replay({"--trace"}), {}},
          {"dram_trace", replay({"--dram-trace"}), {}},
          {"save_history", replay({"--set", "resolve.desampling=adaptive", "--save-history"}), {}},
          {"pack", {"pack", capture("vases")}, {}},
          {"flip_map", {"compare", "a.png", "b.png", "--flip-map"}, {}}};
}

INSTANTIATE_TEST_SUITE_P(Named, Output, testing::ValuesIn(named_outputs()),
                         [](const auto& output) { return std::string(output.param.name); });

// ---- The folder of --out ----------------------------------------------------------------------------------------

struct FolderOutput {
  const char* name;
  std::vector<std::string> arguments;  // the folder follows
  std::vector<const char*> results;    // some of them
};

std::ostream& operator<<(std::ostream& out, const FolderOutput& output) { return out << output.name; }

class OutputFolder : public testing::TestWithParam<FolderOutput> {
 protected:
  OutputFolder() {
    test::write_text(outside_ / "file", "precious");
    test::write_text(outside_ / "study.json", R"({"captures": [")" + capture("vases") + R"("], "size": "32x32",
        "axes": [{"key": "tile.width", "values": [16, 32]}], "columns": ["binner.entries"]})");
  }

  ProcessResult run(const fs::path& out) const {
    std::vector<std::string> arguments = GetParam().arguments;
    for (std::string& argument : arguments)
      if (argument == "study.json") argument = (outside_ / argument).string();
    arguments.push_back(out.string());
    return run_tessera(arguments);
  }
  // A report needs a replay's folder.
  void prepare(const fs::path& out) const {
    if (GetParam().arguments[0] != "report") return;
    ASSERT_EQ(
        run_tessera({"replay", capture("vases"), "--size", "16x16", "--quiet", "--no-report", "--out", out}).status, 0);
  }

  test::TemporaryFolder outside_;
};

TEST_P(OutputFolder, AResultThatIsASymlinkOutOfItIsStatus2BeforeAnyWork) {
  for (const char* name : GetParam().results) {
    const test::TemporaryFolder out;
    prepare(out.path());
    fs::create_directories((out / name).parent_path());
    fs::create_symlink(outside_ / "file", out / name);
    const std::set<std::string> before = files_in(out.path());
    const ProcessResult r = run(out.path());
    EXPECT_EQ(r.status, 2) << name;
    EXPECT_TRUE(one_line(r.errors)) << r.errors;
    EXPECT_THAT(r.errors, HasSubstr(std::string(name) + ": is a symlink that leaves"));
    EXPECT_EQ(files_in(out.path()), before);
    EXPECT_TRUE(fs::is_symlink(out / name));
  }
  EXPECT_EQ(test::read_text(outside_ / "file"), "precious");
}

TEST_P(OutputFolder, AResultThatIsAFifoOrAFolderIsStatus2BeforeAnyWork) {
  for (const char* name : GetParam().results) {
    const test::TemporaryFolder out;
    prepare(out.path());
    fs::create_directories((out / name).parent_path());
    for (const char* kind : {"a FIFO", "a folder"}) {
      fs::remove(out / name);
      if (kind == std::string("a FIFO"))
        ASSERT_EQ(::mkfifo((out / name).c_str(), 0600), 0);
      else
        fs::create_directory(out / name);
      const std::set<std::string> before = files_in(out.path());
      const ProcessResult r = run(out.path());
      EXPECT_EQ(r.status, 2) << name;
      EXPECT_TRUE(one_line(r.errors)) << r.errors;
      EXPECT_THAT(r.errors, HasSubstr(std::string(name) + ": is " + kind));
      EXPECT_EQ(files_in(out.path()), before);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Commands, OutputFolder,
    testing::Values(FolderOutput{"replay",
                                 {"replay", capture("vases"), "--size", "16x16", "--quiet", "--out"},
                                 {"frame_0000.exr", "frame_0000.png", "tiles_0000.json", "stats.json", "stats.csv",
                                  "report.html"}},
                    FolderOutput{"sweep",
                                 {"sweep", "study.json", "--quiet", "--out"},
                                 {"sweep.json", "sweep.csv", "report.html", "points/0.json"}},
                    FolderOutput{"tradeoff",
                                 {"tradeoff", capture("vases"), "--size", "16x16", "--quiet", "--out"},
                                 {"tradeoff.json", "tradeoff.csv", "report.html", "points/0.json", "reference/0.exr"}},
                    FolderOutput{"report", {"report"}, {"report.html"}}),
    [](const auto& output) { return std::string(output.param.name); });

TEST(OutputFolders, AFolderOfPointsElsewhereIsStatus2) {
  const test::TemporaryFolder out, elsewhere;
  fs::create_directory_symlink(elsewhere.path(), out / "points");
  const ProcessResult r =
      run_tessera({"tradeoff", capture("vases"), "--size", "16x16", "--quiet", "--out", out.path().string()});
  EXPECT_EQ(r.status, 2);
  EXPECT_THAT(r.errors, HasSubstr("points: is a symlink that leaves"));
  EXPECT_TRUE(fs::is_empty(elsewhere.path()));
}

TEST(OutputFolders, NamedFilesMayLieInTheFolderThatIsMade) {
  const test::TemporaryFolder folder;
  const std::string out = (folder / "deep" / "er").string();
  const ProcessResult r =
      run_tessera({"replay", capture("vases"), "--size", "16x16", "--quiet", "--out", out, "--trace",
                   out + "/trace.json", "--dram-trace", (folder / "deep" / "d").string()});
  EXPECT_EQ(r.status, 0) << r.errors;
  EXPECT_TRUE(fs::exists(out + "/trace.json"));
  EXPECT_TRUE(fs::exists(folder / "deep" / "d"));
}

// The trace of DRAM has a description beside it, FILE.json.
TEST(OutputFolders, TwoResultsOfOneNameAndADescriptionOverAnInputAreStatus2) {
  const test::TemporaryFolder folder;
  const std::string machine = (folder / "d.json").string(), text = R"({"preset": "mid-mobile"})";
  test::write_text(machine, text);
  const auto refused = [&](const std::vector<std::string>& options) {
    std::vector<std::string> call = {"replay", capture("vases"), "--frames", "0:1",
                                     "--size", "32x18",          "--out",    (folder / "out").string()};
    call.insert(call.end(), options.begin(), options.end());
    const ProcessResult r = run_tessera(call);
    EXPECT_EQ(r.status, 2) << r.errors;
    EXPECT_FALSE(fs::exists(folder / "out"));
    return r.errors;
  };
  const std::string trace = (folder / "d").string();
  EXPECT_THAT(refused({"--dram-trace", trace, "--gpu", machine}), HasSubstr("d.json"));
  EXPECT_EQ(test::read_text(machine), text);
  EXPECT_THAT(refused({"--dram-trace", trace, "--trace", trace}), HasSubstr("two results would have this name"));
  EXPECT_THAT(refused({"--dram-trace", (folder / "e").string(), "--trace", (folder / "e.json").string()}),
              HasSubstr("two results would have this name"));
  EXPECT_FALSE(fs::exists(trace) || fs::exists(folder / "e.json"));
}

TEST(OutputFolders, ALimitOnTheSizeOfFilesIsStatus6AndLeavesNothingHalfWritten) {
  const test::TemporaryFolder folder;
  // Blocks of 512 bytes or 1 KiB: enough for some of the results.
  for (const char* blocks : {"0", "1", "20", "60"}) {
    const fs::path out = folder / blocks;
    const ProcessResult r =
        test::run_process({"/bin/sh", "-c", std::string("ulimit -f ") + blocks + "; exec \"$@\"", "sh", TESSERA_PROGRAM,
                           "replay", capture("eggs"), "--size", "96x54", "--quiet", "--out", out.string()});
    EXPECT_EQ(r.status, 6) << blocks << ": signal " << r.signal << " " << r.errors;
    EXPECT_TRUE(one_line(r.errors)) << r.errors;
    EXPECT_THAT(r.errors, HasSubstr("cannot write"));
    if (!fs::exists(out)) continue;  // made for nothing
    for (const std::string& name : files_in(out)) EXPECT_FALSE(name.ends_with(".part")) << name;
  }
}

TEST(OutputFolders, NamesThatAreNoUtf8Work) {
  const test::TemporaryFolder folder;
  const fs::path file = folder / "a\xff\xc3.glb", out = folder / "out\xfe";
  fs::copy_file(capture("eggs"), file);
  const ProcessResult r = run_tessera({"replay", file.string(), "--size", "96x54", "--quiet", "--out", out.string()});
  EXPECT_EQ(r.status, 0) << r.errors;
  for (const char* name : {"stats.json", "stats.csv", "frame_0014.exr"}) EXPECT_TRUE(fs::exists(out / name)) << name;
  const json stats = json::parse(test::read_text(out / "stats.json"));
  EXPECT_THAT(stats.dump(), HasSubstr("a\xEF\xBF\xBD\xEF\xBF\xBD.glb"));
  for (const std::vector<std::string>& more : {std::vector<std::string>{"inspect", file.string(), "--json"},
                                               {"report", out.string()},
                                               {"pack", file.string(), (folder / "p\xfa.glb").string()},
                                               {"compare", out.string(), out.string()}}) {
    const ProcessResult other = run_tessera(more);
    EXPECT_EQ(other.status, 0) << more[0] << ": " << other.errors;
  }
}

TEST(OutputFolders, AFullDiskIsStatus6) {
  const test::TemporaryFolder folder;
  const ProcessResult r =
      test::run_process({"/bin/sh", "-c", "trap '' XFSZ; ulimit -f 0; \"$@\"", "sh", TESSERA_PROGRAM, "replay",
                         capture("vases"), "--size", "16x16", "--quiet", "--out", folder.path().string()});
  EXPECT_EQ(r.status, 6);
  EXPECT_TRUE(one_line(r.errors)) << r.errors;
  EXPECT_TRUE(files_in(folder.path()).empty());
}

}  // namespace
}  // namespace tessera::replay::output_test
