// The program as its users meet it: exit statuses, messages, files.
#include "base/exr_file.h"
#include "base/image_codec.h"
#include "base/image_metrics.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/pass_assets.h"
#include "tests/support/tests.h"

namespace tessera::replay::program_test {
namespace {

std::set<std::string> files_in(const fs::path& folder) {
  std::set<std::string> names;
  if (fs::exists(folder))
    for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

json stats_of(const fs::path& folder) { return json::parse(test::read_text(folder / "stats.json")); }

std::string capture(const char* name) { return test::shipped_capture(name).string(); }

std::size_t line_count(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

// ---- replay -----------------------------------------------------------------------------------------------------

TEST(ReplayCommand, WritesImagesAndStatisticsOfEveryFrame) {
  const test::TemporaryFolder out;
  const ProcessResult r =
      run_tessera({"replay", capture("flyby"), "--size", "64x36", "--frames", "0:3", "--out", out.path().string()});
  ASSERT_EQ(r.status, 0) << r.errors;
  EXPECT_EQ(files_in(out.path()),
            (std::set<std::string>{"frame_0000.exr", "frame_0000.png", "frame_0001.exr", "frame_0001.png",
                                   "frame_0002.exr", "frame_0002.png", "report.html", "stats.csv", "stats.json",
                                   "tiles_0000.json", "tiles_0001.json", "tiles_0002.json"}));
  const json stats = stats_of(out.path());
  EXPECT_EQ(stats["schema"], "tessera.stats/1");
  ASSERT_EQ(stats["frames"].size(), 3u);
  EXPECT_EQ(stats["frames"][2]["frame"], 2);
  EXPECT_TRUE(stats["frames"][0]["effects"]["motion"].get<bool>());
  EXPECT_FALSE(stats["frames"][0]["effects"]["displacement"].get<bool>());
  EXPECT_EQ(stats["settings"]["width"], 64);
  EXPECT_EQ(stats["gpu"]["preset"], "mid-mobile");
  std::uint64_t sum = 0, peak = 0;
  for (const json& frame : stats["frames"]) {
    sum += frame["counters"]["tilecore.triangles"].get<std::uint64_t>();
    peak = std::max(peak, frame["counters"]["binner.queue_bytes_peak"].get<std::uint64_t>());
  }
  EXPECT_EQ(stats["total"]["counters"]["tilecore.triangles"], sum);
  EXPECT_EQ(stats["total"]["counters"]["binner.queue_bytes_peak"], peak);
  EXPECT_EQ(line_count(test::read_text(out / "stats.csv")), 4u);
}

TEST(ReplayCommand, TheLedgerOfAFrameAddsUpToItsCounters) {
  const test::TemporaryFolder out;
  ASSERT_EQ(run_tessera({"replay", capture("eggs"), "--size", "96x54", "--quiet", "--out", out.path().string()}).status,
            0);
  const json frame = stats_of(out.path())["frames"][0];
  std::uint64_t read = 0, written = 0;
  for (const json& row : frame["dram"])
    read += row["read_bytes"].get<std::uint64_t>(), written += row["written_bytes"].get<std::uint64_t>();
  EXPECT_EQ(frame["counters"]["dram.read_bytes"], read);
  EXPECT_EQ(frame["counters"]["dram.written_bytes"], written);
}

TEST(ReplayCommand, EveryFixedCounterNameOfTheUnitsThatRanIsThere) {
  const test::TemporaryFolder out;
  ASSERT_EQ(
      run_tessera({"replay", capture("vases"), "--size", "32x32", "--quiet", "--out", out.path().string()}).status, 0);
  const json counters = stats_of(out.path())["frames"][0]["counters"];
  for (const char* name : {"frontend.base_patches",
                           "frontend.sub_patches",
                           "frontend.culled_frustum",
                           "frontend.culled_backface",
                           "tilecore.culled_occlusion",
                           "binner.entries",
                           "binner.tile_overlaps",
                           "binner.queue_bytes_written",
                           "binner.queue_bytes_read",
                           "binner.queue_bytes_peak",
                           "binner.partial_renders",
                           "binner.spilled_bytes",
                           "tilecore.tessellated_sub_patches",
                           "tilecore.domain_evaluations",
                           "tilecore.triangles",
                           "tilecore.box_tests",
                           "tilecore.triangle_tests",
                           "tilecore.sample_hits",
                           "tilecore.samples_visible",
                           "tilecore.pixel_shader_invocations",
                           "resolve.pixels_shaded",
                           "dram.read_bytes",
                           "dram.written_bytes"})
    EXPECT_TRUE(counters.contains(name)) << name;
  // Units that do not exist yet, or did not run, report nothing.
  for (const char* name :
       {"tilecore.stencil_tests", "tilecore.node_visits", "resolve.blocks_rate_4", "resolve.pixels_advected"})
    EXPECT_FALSE(counters.contains(name)) << name;
}

TEST(ReplayCommand, CountersOfAVisibilityMethodAreThereWhenItsUnitsRan) {
  const test::TemporaryFolder out;
  const auto counters = [&](const std::string& setting) {
    const auto folder = out / setting;
    EXPECT_EQ(run_tessera({"replay", capture("serpent"), "--size", "96x54", "--frames", "12:14", "--quiet", "--set",
                           setting, "--out", folder.string()})
                  .status,
              0);
    EXPECT_EQ(line_count(test::read_text(folder / "stats.csv")), 3u);
    return stats_of(folder)["total"]["counters"];
  };
  const json segments = counters("tilecore.visibility_method=segments");
  for (const char* name :
       {"tilecore.stencil_tests", "tilecore.stencil_kept", "tilecore.stencil_hits", "tilecore.stencil_lanes_issued"})
    EXPECT_TRUE(segments.contains(name)) << name;
  for (const char* name : {"tilecore.node_visits", "tilecore.rays_cast", "tilecore.rays_hit"})
    EXPECT_FALSE(segments.contains(name)) << name;
  const json rays = counters("tilecore.traversal=ray");
  for (const char* name : {"tilecore.stencil_tests", "tilecore.node_visits", "tilecore.rays_cast", "tilecore.rays_hit"})
    EXPECT_TRUE(rays.contains(name)) << name;
  EXPECT_LE(rays["tilecore.rays_hit"], rays["tilecore.rays_cast"]);
  EXPECT_EQ(rays["tilecore.rays_cast"], rays["tilecore.stencil_kept"]);
}

TEST(ReplayCommand, TheSameInputsGiveTheSameBytes) {
  const test::TemporaryFolder out;
  for (const char* run : {"a", "b"})
    ASSERT_EQ(run_tessera({"replay", capture("serpent"), "--size", "80x45", "--quiet", "--aux",
                           "depth,normal,patch,invocations", "--out", (out / run).string()})
                  .status,
              0);
  for (const char* file : {"frame_0012.exr", "frame_0012.png"})
    EXPECT_EQ(test::read_text(out / "a" / file), test::read_text(out / "b" / file));
  EXPECT_EQ(stats_of(out / "a")["total"]["counters"], stats_of(out / "b")["total"]["counters"]);
}

TEST(ReplayCommand, SeedAndSamplesChangeTheNoiseNotTheImage) {
  const test::TemporaryFolder out;
  const auto frame_image = [&](const char* name, std::vector<std::string> more) {
    std::vector<std::string> arguments = {"replay", capture("eggs"),      "--size", "128x72", "--quiet",
                                          "--out",  (out / name).string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    EXPECT_EQ(run_tessera(arguments).status, 0);
    return read_exr(out / name / "frame_0014.exr");
  };
  const Image many = frame_image("many", {"--spp", "64"}), one = frame_image("one", {"--spp", "16", "--seed", "1"}),
              two = frame_image("two", {"--spp", "16", "--seed", "2"});
  EXPECT_NE(one.values, two.values);
  const auto error = [&](const Image& image) {
    double sum = 0;
    for (std::size_t i = 0; i < image.values.size(); ++i)
      sum += std::pow(static_cast<double>(image.values[i]) - static_cast<double>(many.values[i]), 2);
    return std::sqrt(sum / static_cast<double>(image.values.size()));
  };
  EXPECT_LT(error(one), 0.06);
  EXPECT_LT(error(two), 0.06);
}

TEST(ReplayCommand, ARegionIsRenderedAlone) {
  const test::TemporaryFolder out;
  ASSERT_EQ(run_tessera({"replay", capture("vases"), "--size", "120x80", "--region", "20,30,50,40", "--quiet", "--out",
                         out.path().string()})
                .status,
            0);
  EXPECT_EQ(read_exr(out / "frame_0000.exr").width, 50);
  EXPECT_EQ(read_exr(out / "frame_0000.exr").height, 40);
}

TEST(ReplayCommand, CtrlCFinishesTheRunningFrameAndWritesItsStatistics) {
  const test::TemporaryFolder out;
  const ProcessResult r =
      run_tessera({"replay", capture("flyby"), "--size", "320x180", "--frames", "0:5000", "--out", out.path().string()},
                  {.interrupt_after_ms = 700});
  EXPECT_EQ(r.status, 130) << r.errors;
  EXPECT_THAT(r.errors, HasSubstr("stopped after"));
  const json stats = stats_of(out.path());
  const std::size_t frames = stats["frames"].size();
  EXPECT_GE(frames, 1u);
  EXPECT_LT(frames, 5000u);
  // Every frame that the statistics name has its images, and nothing else is there.
  EXPECT_EQ(files_in(out.path()).size(), 3 * frames + 3);
}

TEST(ReplayCommand, AFolderThatCannotBeWrittenIsReportedAndNothingIsLeftBehind) {
  const test::TemporaryFolder out;
  test::write_text(out / "file", "x");
  const ProcessResult r = run_tessera(
      {"replay", capture("vases"), "--size", "16x16", "--quiet", "--out", (out / "file" / "deep").string()});
  EXPECT_EQ(r.status, 2);
  EXPECT_EQ(line_count(r.errors), 1u) << r.errors;
  EXPECT_EQ(files_in(out.path()), std::set<std::string>{"file"});
}

TEST(ReplayCommand, AFolderThatCannotBeWrittenIsFoundBeforeAnyFrameIsRendered) {
  const test::TemporaryFolder out;
  test::write_text(out / "file", "x");
  const ProcessResult r =
      run_tessera({"replay", capture("vases"), "--size", "16x16", "--frames", "0:9", "--out", (out / "file").string()});
  EXPECT_EQ(r.status, 2);
  EXPECT_THAT(r.errors, testing::Not(HasSubstr("frame 0")));
  EXPECT_THAT(r.errors, testing::Not(HasSubstr(".part")));
}

TEST(ReplayCommand, QuietStillSaysThatItStopped) {
  const test::TemporaryFolder out;
  const ProcessResult r = run_tessera(
      {"replay", capture("flyby"), "--size", "320x180", "--frames", "0:5000", "--quiet", "--out", out.path().string()},
      {.interrupt_after_ms = 700});
  EXPECT_THAT(r.errors, testing::StartsWith("stopped after"));
  EXPECT_EQ(line_count(r.errors), 1u) << r.errors;
}

struct WrongCall {
  std::vector<std::string> arguments;
  const char* message;
};

TEST(ReplayCommand, WrongUsageEndsWithStatus2AndOneClearMessage) {
  const test::TemporaryFolder out;
  const std::vector<WrongCall> calls = {
      {{"--set", "tile.widht=3"}, "did you mean 'tile.width'"},
      {{"--set", "tile.width=20"}, "multiples of 8"},
      {{"--set", "tile.width=1000"}, "from 8 to 256"},
      {{"--set", "shading.rate=often"}, "one of pixel, primitive, sample"},
      {{"--set", "novalue"}, "KEY=VALUE"},
      {{"--gpu", "enormous"}, "presets: entry-mobile, mid-mobile, high-mobile, v3d"},
      {{"--size", "0x10"}, "--size"},
      {{"--size", "12x"}, "--size"},
      {{"--size", "99999x10"}, "1 to 16384"},
      {{"--frames", "5:5"}, "A < B"},
      {{"--frames", "5"}, "A:B"},
      {{"--frames=-1:4"}, "A:B"},
      {{"--region", "0,0,9999,10"}, "not inside the frame"},
      {{"--spp", "65"}, "from 1 to 64"},
      {{"--spp", "many"}, "whole number"},
      {{"--aux", "beauty"}, "layers are"},
      {{"--set", "parameter_buffer.bytes=256"}, "cannot hold the first chunks"},
      {{"--max-memory", "nan"}, "--max-memory nan"},
      {{"--max-memory=-1"}, "--max-memory -1: expected a number in (0, 1048576]"},
      {{"--unknown"}, "unknown option '--unknown'"},
      {{"--sizee", "3x3"}, "unknown option '--sizee'; did you mean '--size'?"},
      {{"--frame=3:4"}, "did you mean '--frames'?"},
      {{"another.glb"}, "unexpected argument 'another.glb'"},
  };
  for (const WrongCall& call : calls) {
    std::vector<std::string> arguments = {"replay", capture("vases"), "--quiet", "--out", (out / "x").string()};
    arguments.insert(arguments.end(), call.arguments.begin(), call.arguments.end());
    const ProcessResult r = run_tessera(arguments);
    EXPECT_EQ(r.status, 2) << call.arguments[0] << ": " << r.errors;
    EXPECT_THAT(r.errors, HasSubstr(call.message));
    EXPECT_FALSE(fs::exists(out / "x")) << call.arguments[0];
  }
}

TEST(ReplayCommand, ImagesBeyondTheMemoryLimitEndWithStatus4) {
  const test::TemporaryFolder out;
  const ProcessResult r = run_tessera(
      {"replay", capture("vases"), "--size", "16384x16384", "--max-memory", "1", "--out", (out / "x").string()});
  EXPECT_EQ(r.status, 4) << r.errors;
  EXPECT_FALSE(fs::exists(out / "x"));
}

// While a frame's images are written, the next one's are rendered: both count.
TEST(ReplayCommand, ImagesOfTwoFramesCountAgainstTheMemoryLimit) {
  const test::TemporaryFolder out;
  const auto replay = [&](const char* frames) {
    return run_tessera({"replay", capture("vases"), "--size", "1280x720", "--frames", frames, "--max-memory", "0.05",
                        "--no-report", "--quiet", "--out", (out / "x").string()});
  };
  const ProcessResult two = replay("0:2"), one = replay("0:1");
  EXPECT_EQ(two.status, 4) << two.errors;
  EXPECT_THAT(two.errors, HasSubstr("--max-memory allows"));
  EXPECT_EQ(one.status, 0) << one.errors;
}

// From four threads on two frames are rendered at once.
TEST(ReplayCommand, FramesAtOnceAreTheFramesOneAfterTheOther) {
  const test::TemporaryFolder out;
  const auto replay = [&](const char* threads) {
    const ProcessResult r = run_tessera({"replay", capture("stroll"), "--size", "96x64", "--frames", "0:5", "--threads",
                                         threads, "--no-report", "--quiet", "--out", (out / threads).string()});
    EXPECT_EQ(r.status, 0) << r.errors;
  };
  replay("1");
  replay("4");
  for (int frame = 0; frame < 5; ++frame)
    for (const char* ending : {".exr", ".png"}) {
      const std::string name = "frame_000" + std::to_string(frame) + ending;
      EXPECT_EQ(test::read_text(out / "1" / name), test::read_text(out / "4" / name)) << name;
    }
  const auto counters = [&](const char* threads) {
    nlohmann::json all;
    const auto stats = nlohmann::json::parse(test::read_text(out / threads / "stats.json"));
    for (const auto& frame : stats["frames"]) all.push_back({frame["frame"], frame["counters"], frame["timing"]});
    return all;
  };
  EXPECT_EQ(counters("1"), counters("4"));
}

TEST(ReplayCommand, MissingCapturesEndWithStatus3) {
  const ProcessResult r = run_tessera({"replay", "no/such.glb"});
  EXPECT_EQ(r.status, 3);
  EXPECT_EQ(r.errors, "tessera: no/such.glb: no such file\n");
}

// ---- The other commands -----------------------------------------------------------------------------------------

TEST(Program, HelpTeachesEveryCommandAndOptions) {
  const ProcessResult all = run_tessera({"--help"});
  EXPECT_EQ(all.status, 0);
  for (const char* command : {"replay", "inspect", "pack", "compare", "sweep", "report", "describe"}) {
    EXPECT_THAT(all.output, HasSubstr(command));
    const ProcessResult one = run_tessera({command, "--help"});
    EXPECT_EQ(one.status, 0);
    EXPECT_THAT(one.output, HasSubstr("Usage: tessera"));
  }
  for (const char* option :
       {"--frames", "--size", "--spp", "--gpu", "--set", "--threads", "--seed", "--region", "--out", "--aux"})
    EXPECT_THAT(run_tessera({"replay", "--help"}).output, HasSubstr(option));
  EXPECT_EQ(run_tessera({}).status, 2);
  EXPECT_EQ(run_tessera({"fly"}).status, 2);
}

TEST(Program, UnknownCommandsAreAnsweredWithTheNearest) {
  EXPECT_EQ(run_tessera({"replai", "x.glb"}).errors, "tessera: unknown command 'replai'; did you mean 'replay'?\n");
  EXPECT_EQ(run_tessera({"fly"}).errors, "tessera: unknown command 'fly'; `tessera --help` lists them\n");
  for (const std::vector<std::string>& call :
       std::vector<std::vector<std::string>>{{}, {"fly"}, {"replay"}, {"pack", "a"}, {"compare", "a"}}) {
    const ProcessResult r = run_tessera(call);
    EXPECT_EQ(r.status, 2);
    EXPECT_EQ(line_count(r.errors), 1u) << r.errors;
    EXPECT_THAT(r.errors, testing::StartsWith("tessera: "));
  }
}

TEST(Program, OutputThatCannotBeWrittenIsAFailure) {
  for (const char* arguments :
       {"inspect \"$1\"", "inspect --json \"$1\"", "describe counters", "--help", "replay --help"}) {
    const ProcessResult r = test::run_process(
        {"/bin/sh", "-c", "\"$0\" " + std::string(arguments) + " > /dev/full", TESSERA_PROGRAM, capture("vases")});
    EXPECT_EQ(r.status, 6) << arguments;
    EXPECT_THAT(r.errors, HasSubstr("No space left on device")) << arguments;
  }
}

TEST(PackCommand, FailuresNameTheTargetNotATemporaryFile) {
  const ProcessResult r = run_tessera({"pack", capture("vases"), "/proc/x.glb"});
  EXPECT_EQ(r.status, 6);
  EXPECT_THAT(r.errors, testing::StartsWith("tessera: cannot write /proc/x.glb: "));
}

TEST(InspectCommand, ListsTheContentsOfACapture) {
  const ProcessResult table = run_tessera({"inspect", capture("eggs")});
  EXPECT_EQ(table.status, 0);
  EXPECT_THAT(table.output, HasSubstr("444 Bezier patches"));
  EXPECT_THAT(table.output, HasSubstr("lens of radius 0.085 focused at 5.75"));
  const json report = json::parse(run_tessera({"inspect", capture("serpent"), "--json"}).output);
  EXPECT_EQ(report["skins"], 1);
  EXPECT_EQ(report["settings"]["first_frame"], 12);
  EXPECT_TRUE(report["meshes"][0]["skinned"].get<bool>());
}

TEST(InspectCommand, SaysWhichLightsCastShadows) {
  test::GltfAsset asset = test::everything_asset();
  json& lights = asset.document["extensions"]["KHR_lights_punctual"]["lights"];  // light 0: a spot of 69 degrees
  lights.push_back({{"type", "directional"}});
  lights.push_back({{"type", "point"}});
  lights.push_back({{"type", "spot"}, {"spot", {{"outerConeAngle", 1.1}}}});
  for (const auto& [node, light] : {std::pair{1u, 2}, {2u, 1}, {3u, 2}, {4u, 3}})
    asset.document["nodes"][node]["extensions"]["KHR_lights_punctual"]["light"] = light;
  asset.document["extensions"]["TESSERA_capture"]["shadows"] = {
      {{"light", 1}, {"size", 512}, {"cascades", 4}, {"distance", 200}},
      {{"light", 0}},
      {{"light", 2}, {"size", 64}},
      {{"light", 3}, {"size", 64}}};
  const test::TemporaryFolder folder;
  test::write_text(folder / "lit.glb", asset.glb());
  const std::string file = (folder / "lit.glb").string();
  const ProcessResult table = run_tessera({"inspect", file});
  for (const char* line : {"  shadows     light 1, directional: 4 maps of 512x512 up to 200 from the camera, 4.0 MiB\n",
                           "  shadows     light 0, spot: 1 map of 1024x1024, 4.0 MiB\n",
                           "  shadows     light 2, point: at most 12 maps of 64x64, 192.0 KiB, in 2 nodes\n",
                           "  shadows     light 3, spot: at most 6 maps of 64x64, 96.0 KiB\n"})
    EXPECT_THAT(table.output, HasSubstr(line)) << table.errors;
  const json shadows = json::parse(run_tessera({"inspect", file, "--json"}).output)["shadows"];
  EXPECT_EQ(shadows[0], json({{"light", 1},
                              {"type", "directional"},
                              {"nodes", 1},
                              {"size", 512},
                              {"cascades", 4},
                              {"distance", 200.0},
                              {"max_maps", 4},
                              {"max_bytes", 4 * 512 * 512 * 4}}));
  EXPECT_EQ(shadows[2]["max_maps"], 12);
}

std::string capture_with_passes(const test::TemporaryFolder& folder, bool fills = true) {
  test::GltfAsset asset = test::everything_asset();
  json& settings = asset.document["extensions"]["TESSERA_capture"];
  settings.update(test::deferred_passes());
  if (!fills) settings["passes"][0]["subpasses"][1]["input"] = {"albedo", "normal", "depth"};
  test::write_text(folder / "passes.glb", asset.glb());
  return (folder / "passes.glb").string();
}

TEST(InspectCommand, ShowsPassesAndAttachments) {
  const test::TemporaryFolder folder;
  const std::string file = capture_with_passes(folder);
  const ProcessResult table = run_tessera({"inspect", file});
  for (const char* line :
       {"  attachment  albedo: rgba8, frame\n", "  attachment  glow: r11g11b10f, 0.5 of the frame, 5 levels, frame\n",
        "  pass        main: gbuffer draws opaque writes albedo normal pbr; light inputs albedo normal pbr depth "
        "writes "
        "lit; forward draws blended writes lit, 24 B of tile memory a sample\n",
        "  pass        bloom: bloom samples lit writes glow, 4 B of tile memory a sample\n"})
    EXPECT_THAT(table.output, HasSubstr(line)) << table.errors;
  const json graph = json::parse(run_tessera({"inspect", file, "--json"}).output)["graph"];
  EXPECT_EQ(graph["attachments"].size(), 5u);
  EXPECT_EQ(graph["attachments"][1], json({{"name", "glow"},
                                           {"format", "r11g11b10f"},
                                           {"sample_bits", 32},
                                           {"size", nullptr},
                                           {"scale", 0.5},
                                           {"samples", nullptr},
                                           {"layers", 1},
                                           {"levels", 5},
                                           {"life", "frame"}}));
  EXPECT_EQ(graph["passes"][0]["depth"], "depth");
  EXPECT_EQ(graph["passes"][0]["subpasses"][1]["input"], json({"albedo", "normal", "pbr", "depth"}));
  EXPECT_EQ(graph["passes"][2]["name"], "final");
  EXPECT_TRUE(json::parse(run_tessera({"inspect", capture("eggs"), "--json"}).output)["graph"].is_null());
}

TEST(ReplayCommand, RefusesPassesThatTheMachineDoesNotRender) {
  const test::TemporaryFolder folder;
  const std::string file = capture_with_passes(folder, false);
  const fs::path out = folder / "out";
  for (const char* command : {"replay", "tradeoff", "view"}) {
    const ProcessResult r = run_tessera({command, file, "--size", "32x18", "--out", out.string()});
    EXPECT_EQ(r.status, 3) << command;
    EXPECT_EQ(r.errors,
              "tessera: " + file +
                  ": /extensions/TESSERA_capture/passes/0/subpasses/1/input: is not the G-buffer and 'depth': light "
                  "reads all of it\n")
        << command;
    EXPECT_TRUE(files_in(out).empty()) << command;
  }
}

TEST(ReplayCommand, RendersAGbufferThatACaptureDescribes) {
  const test::TemporaryFolder folder;
  const std::string file = capture_with_passes(folder);
  const fs::path out = folder / "out";
  const ProcessResult r = run_tessera({"replay", file, "--size", "32x18", "--no-report", "--out", out.string()});
  ASSERT_EQ(r.status, 0) << r.errors;
  const json stats = json::parse(test::read_text(out / "stats.json"));
  EXPECT_EQ(stats["settings"]["shading.path"], "gbuffer");
  EXPECT_EQ(stats["settings"]["gbuffer.bits"], 96);
  EXPECT_EQ(stats["frames"][0]["passes"].back()["name"], "final");
}

// Samples of a G-buffer take 16 bytes here, and 12 without it: 60000 bytes hold a tile of the second kind alone.
TEST(SweepCommand, AChosenTileMemoryMustHoldTheGbufferOfACapture) {
  const test::TemporaryFolder folder;
  const json study = {{"captures", {capture_with_passes(folder)}},
                      {"size", "32x18"},
                      {"axes", {{{"key", "tilecore.memory_bytes"}, {"values", {60000, 196608}}}}}};
  test::write_text(folder / "study.json", study.dump());
  const std::string out = (folder / "out").string();
  const ProcessResult r = run_tessera({"sweep", (folder / "study.json").string(), "--quiet", "--out", out});
  ASSERT_EQ(r.status, 0) << r.errors;
  const std::string table = test::read_text(folder / "out" / "sweep.csv");
  EXPECT_THAT(table, HasSubstr("60000 bytes hold no tile"));
  EXPECT_EQ(std::ranges::count(table, '\n'), 4) << table;  // heads, the fault, two frames
}

TEST(ReplayCommand, RendersPassesThatACaptureDescribes) {
  const test::TemporaryFolder folder;
  test::GltfAsset asset = test::everything_asset();
  asset.document["extensions"]["TESSERA_capture"].update(json::parse(R"({
    "attachments": {"lit": {"format": "rgba16f"}},
    "passes": [
      {"name": "surfaces", "draw": "all", "shader": "forward", "write": ["lit"], "store": {"depth": "store"}},
      {"name": "final", "shader": "copy", "sample": ["lit"], "write": ["frame"], "load": {"frame": "none"}}]})"));
  test::write_text(folder / "passes.glb", asset.glb());
  const fs::path out = folder / "out";
  const ProcessResult r =
      run_tessera({"replay", (folder / "passes.glb").string(), "--size", "64x64", "--frames", "0:1", "--set",
                   "effects.shadows=off", "--set", "frame_buffer.compression=none", "--out", out.string()});
  ASSERT_EQ(r.status, 0) << r.errors;
  const json frame = json::parse(test::read_text(out / "stats.json"))["frames"][0];
  ASSERT_GE(frame["passes"].size(), 2u);
  EXPECT_EQ(frame["passes"].back()["name"], "final");
  EXPECT_EQ(frame["timing"]["passes"].back()["name"], "final");
  int read = 0, written = 0;
  for (const json& row : frame["dram"])
    if (row["purpose"] == "attachment") read += row.value("read_bytes", 0), written += row.value("written_bytes", 0);
  EXPECT_EQ(read, 64 * 64 * 8);
  EXPECT_EQ(written, 64 * 64 * (8 + 4 * 4));
}

TEST(InspectCommand, TellsTheCostsOfAReplay) {
  const test::TemporaryFolder out;
  const std::string run = (out / "run").string();
  const ProcessResult replay =
      run_tessera({"replay", capture("vases"), "--frames", "0:1", "--size", "32x18", "--out", run});
  ASSERT_EQ(replay.status, 0) << replay.errors;
  // The last lines of the replay, but for the place of the results.
  const std::string said = replay.output.substr(replay.output.find("time  "));
  const std::string figures = said.substr(0, said.find("results "));
  EXPECT_THAT(figures, testing::AllOf(HasSubstr(" ms a frame, "), HasSubstr(" frames/s"), HasSubstr(" W at ")));
  for (const std::string& path : {run, run + "/stats.json"}) {
    const ProcessResult r = run_tessera({"inspect", path});
    EXPECT_EQ(r.status, 0) << r.errors;
    EXPECT_THAT(r.output, testing::StartsWith(path + ": 1 frame of vases.glb\n" + figures));
  }
  const json total = json::parse(run_tessera({"inspect", run, "--json"}).output);
  EXPECT_GT(total["timing"]["time_ms"], 0);
  EXPECT_GT(total["energy"]["power_w"], 0);
}

TEST(InspectCommand, AReplayWithoutItsSumIsRefused) {
  const test::TemporaryFolder out;
  test::write_text(out / "stats.json",
                   R"({"schema":"tessera.stats/1","frames":[{"frame":0}],"total":{"counters":{}}})");
  for (const std::string& path : {out.path().string(), (out / "stats.json").string()}) {
    const ProcessResult r = run_tessera({"inspect", path});
    EXPECT_EQ(r.status, 3) << r.errors;
    EXPECT_THAT(r.errors, HasSubstr("holds no sum of a replay's frames"));
    EXPECT_EQ(r.output, "");
  }
}

TEST(PackCommand, WrongUsageEndsWithStatus2AndOneClearMessageAndNoFile) {
  const test::TemporaryFolder out;
  const std::vector<WrongCall> calls = {
      {{"--size", "0x0"}, "--size 0x0: expected WIDTHxHEIGHT, 1 to 16384 each"},
      {{"--size", "nanx10"}, "--size nanx10"},
      {{"--size", "10.5x20"}, "--size 10.5x20"},
      {{"--frames", "0.5:3"}, "--frames 0.5:3: expected A:B with A < B"},
      {{"--frames", "0:9e99"}, "--frames 0:9e99"},
      {{"--frames", "3:1"}, "A < B"},
      {{"--frame-rate", "0"}, "--frame-rate 0: expected a number in (0, 1000000]"},
      {{"--frame-rate", "nan"}, "--frame-rate nan"},
      {{"--shutter", "0.5:0"}, "--shutter 0.5:0: expected OPEN:CLOSE"},
      {{"--shutter", "0:9"}, "-1 to 2"},
      {{"--shutter", "0:inf"}, "--shutter 0:inf"},
      {{"--exposure=-1"}, "--exposure -1"},
      {{"--environment=-1"}, "--environment -1: expected a number in [0, 1000000]"},
      {{"--aperture", "nan"}, "--aperture nan"},
      {{"--aperture", "1", "--focus", "0"}, "--focus 0"},
      {{"--focus", "3"}, "--focus needs --aperture"},
      {{"--method", "zip"}, "is not auto, edgebreaker, sequential or none"},
      {{"--method", "1"}, "is not auto, edgebreaker, sequential or none"},
      {{"--position-bits", "0"}, "--position-bits"},
      {{"--normal-bits", "1"}, "--normal-bits"},
      {{"--color-bits", "25"}, "not in range 1 to 24"},
  };
  for (const WrongCall& call : calls) {
    std::vector<std::string> arguments = {"pack", capture("vases"), (out / "x.glb").string()};
    arguments.insert(arguments.end(), call.arguments.begin(), call.arguments.end());
    const ProcessResult r = run_tessera(arguments);
    EXPECT_EQ(r.status, 2) << call.arguments[0] << ": " << r.errors;
    EXPECT_THAT(r.errors, HasSubstr(call.message));
    EXPECT_TRUE(files_in(out.path()).empty()) << call.arguments[0];
  }
}

TEST(PackCommand, SettingsOfTheCommandLineGoIntoTheCapture) {
  const test::TemporaryFolder out;
  const ProcessResult r = run_tessera({"pack", capture("vases"), (out / "x.glb").string(), "--size", "320x200",
                                       "--frames", "3:7", "--shutter", "-0.25:0.5", "--frame-rate", "48"});
  ASSERT_EQ(r.status, 0) << r.errors;
  const json settings = json::parse(run_tessera({"inspect", (out / "x.glb").string(), "--json"}).output)["settings"];
  EXPECT_EQ(settings["resolution"], json({320, 200}));
  EXPECT_EQ(settings["first_frame"], 3);
  EXPECT_EQ(settings["frames"], 4);
  EXPECT_EQ(settings["shutter"], json({-0.25, 0.5}));
  EXPECT_EQ(settings["frame_rate"], 48.0);
}

TEST(CompareCommand, MeasuresImagesAndFolders) {
  const test::TemporaryFolder out;
  for (const char* spp : {"1", "4"})
    ASSERT_EQ(run_tessera({"replay", capture("vases"), "--size", "96x54", "--spp", spp, "--quiet", "--out",
                           (out / spp).string()})
                  .status,
              0);
  const std::string a = (out / "1").string(), b = (out / "4").string();
  const json same =
      json::parse(run_tessera({"compare", a + "/frame_0000.png", a + "/frame_0000.png", "--json"}).output);
  EXPECT_TRUE(same["psnr_db"].is_null());
  EXPECT_EQ(same["flip"], 0.0);
  const json folders = json::parse(run_tessera({"compare", a, b, "--json"}).output);
  EXPECT_GT(folders["frames"][0]["psnr_db"].get<double>(), 20.0);
  EXPECT_LT(folders["frames"][0]["ssim"].get<double>(), 1.0);
  EXPECT_FALSE(folders["counters"].empty());
  const ProcessResult map =
      run_tessera({"compare", a + "/frame_0000.png", b + "/frame_0000.exr", "--flip-map", (out / "map.png").string()});
  EXPECT_EQ(map.status, 0) << map.errors;
  EXPECT_TRUE(fs::exists(out / "map.png"));
  EXPECT_EQ(run_tessera({"compare", a, b + "/frame_0000.png"}).status, 2);
  EXPECT_EQ(run_tessera({"compare", a + "/stats.json", b + "/frame_0000.png"}).status, 3);
}

TEST(CompareCommand, AMaskLimitsTheFiguresToItsPixels) {
  const test::TemporaryFolder folder;
  Image8 black(8, 4, 3), half(8, 4, 3), alpha(8, 4, 4), none(8, 4, 4);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 8; ++x) {
      if (x < 4) half.at(x, y)[1] = 255;
      if (x < 4) alpha.at(x, y)[3] = 1;
    }
  write_png(folder / "black.png", black);
  write_png(folder / "half.png", half);
  write_png(folder / "alpha.png", alpha);
  write_png(folder / "none.png", none);
  Image8 small(4, 4, 3);
  small.values.assign(small.values.size(), 255);
  write_png(folder / "small.png", small);
  const auto compare = [&](const char* a, const char* b, const char* mask) {
    return run_tessera(
        {"compare", (folder / a).string(), (folder / b).string(), "--json", "--mask", (folder / mask).string()});
  };
  const json all = json::parse(
      run_tessera({"compare", (folder / "black.png").string(), (folder / "half.png").string(), "--json"}).output);
  for (const char* mask : {"alpha.png", "half.png"}) {
    const json covered = json::parse(compare("black.png", "half.png", mask).output);
    EXPECT_NEAR(covered["psnr_db"].get<double>(), all["psnr_db"].get<double>() - 10 * std::log10(2), 1e-9);
    EXPECT_GT(covered["flip"], all["flip"]);
  }
  EXPECT_THAT(compare("black.png", "half.png", "none.png").errors, HasSubstr("none.png: covers no pixel"));
  EXPECT_THAT(compare("black.png", "half.png", "small.png").errors, HasSubstr("small.png: is 4x4 pixels"));
  EXPECT_EQ(run_tessera({"compare", folder.path().string(), folder.path().string(), "--mask", "x.png"}).status, 2);
}

// Statistics are input like any other: a member that is missing or of another type is the file's fault, not the
// program's.
TEST(CompareCommand, DamagedStatisticsEndWithStatus3) {
  const test::TemporaryFolder folder;
  fs::create_directories(folder / "run");
  write_png(folder / "run" / "frame_0000.png", Image8(2, 2, 3));
  for (const char* text :
       {"[]", "7", "{}", R"({"schema":7,"total":{}})", R"({"schema":"tessera.stats/1","total":7})",
        R"({"schema":"tessera.stats/1","total":{}})", R"({"schema":"tessera.stats/1","total":{"counters":[1]}})",
        R"({"schema":"tessera.stats/1","total":{"counters":7}})", "{"}) {
    test::write_text(folder / "run" / "stats.json", text);
    const test::ProcessResult r = test::run_tessera({"compare", (folder / "run").string(), (folder / "run").string()});
    EXPECT_EQ(r.status, 3) << text << ": " << r.errors;
    EXPECT_NE(r.errors.find("stats.json"), std::string::npos) << r.errors;
  }
}

TEST(DescribeCommand, ListsEveryTopicAsTextJsonAndMarkdown) {
  for (const char* topic : {"counters", "settings", "gpu", "extensions", "formats", "effects"}) {
    EXPECT_FALSE(run_tessera({"describe", topic}).output.empty());
    const json rows = json::parse(run_tessera({"describe", topic, "--json"}).output);
    EXPECT_GT(rows.size(), 4u);
    for (const json& row : rows) EXPECT_FALSE(row["meaning"].get<std::string>().empty());
  }
  EXPECT_EQ(run_tessera({"describe", "weather"}).status, 2);
}

TEST(DescribeCommand, NamesExactlyTheCountersThatStatisticsHold) {
  const test::TemporaryFolder out;
  // Everything moves and is traced by single rays, so that all units run.
  ASSERT_EQ(run_tessera({"replay", capture("vases"), "--size", "16x16", "--baselines", "--quiet", "--set",
                         "effects.motion=on", "--set", "tilecore.traversal=ray", "--set", "resolve.desampling=adaptive",
                         "--set", "frame_buffer.compression=lossless", "--out", out.path().string()})
                .status,
            0);
  ASSERT_EQ(
      run_tessera({"replay", capture("workshop"), "--size", "16x16", "--quiet", "--out", (out / "procedures").string()})
          .status,
      0);
  // A triangle at three places, through which one sees.
  test::write_text(out / "instances.gltf",
                   R"({"asset":{"version":"2.0"},"extensionsUsed":["EXT_mesh_gpu_instancing",
      "KHR_materials_transmission"],"scenes":[{"nodes":[0]}],
      "nodes":[{"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0}}}}],
      "materials":[{"extensions":{"KHR_materials_transmission":{"transmissionFactor":1}}}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],
      "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
      "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,
      "uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})");
  ASSERT_EQ(run_tessera({"replay", (out / "instances.gltf").string(), "--size", "16x16", "--quiet", "--out",
                         (out / "instances").string()})
                .status,
            0);
  // The front end looks at the depths of the frame before, and lights cast shadows.
  ASSERT_EQ(
      run_tessera({"replay", capture("city"), "--size", "64x36", "--frames", "0:2", "--quiet", "--no-report", "--set",
                   "frontend.previous_depth_culling=true", "--set", "tile.rendering_elimination=true", "--set",
                   "effects.shadows=all", "--set", "shadows.size=64", "--out", (out / "depths").string()})
          .status,
      0);
  // Nothing changes from frame to frame.
  ASSERT_EQ(run_tessera({"replay", capture("vases"), "--size", "16x16", "--frames", "0:2", "--quiet", "--no-report",
                         "--set", "frame_buffer.transaction_elimination=true", "--out", (out / "still").string()})
                .status,
            0);
  // Passes over images, lists of lights, and a G-buffer in memory.
  ASSERT_EQ(run_tessera({"replay", capture("corridor"), "--size", "32x18", "--frames", "0:1", "--quiet", "--no-report",
                         "--set", "shadows.size=64", "--set", "shading.path=gbuffer_external", "--out",
                         (out / "post").string()})
                .status,
            0);
  std::set<std::string> described, counted;
  const json post = stats_of(out / "post")["frames"][0];
  for (const auto& [name, value] : post["counters"].items()) counted.insert(name);
  const json depths = stats_of(out / "depths")["frames"][1];
  for (const auto& [name, value] : depths["counters"].items()) counted.insert(name);
  const json still = stats_of(out / "still")["frames"][1];
  for (const auto& [name, value] : still["counters"].items()) counted.insert(name);
  const json instances = stats_of(out / "instances")["frames"][0];
  for (const auto& [name, value] : instances["counters"].items()) counted.insert(name);
  const json rows = json::parse(run_tessera({"describe", "counters", "--json"}).output),
             frame = stats_of(out.path())["frames"][0], procedures = stats_of(out / "procedures")["frames"][0];
  for (const json& row : rows) described.insert(row["name"]);
  for (const auto& [name, value] : procedures["counters"].items()) counted.insert(name);
  for (const auto& [name, value] : frame["counters"].items()) counted.insert(name);
  for (const auto& [name, value] : frame["baselines"]["immediate"].items()) counted.insert(name);
  for (const std::string& name : described)
    EXPECT_TRUE(counted.contains(name)) << name << " is described and not counted";
  for (const std::string& name : counted)
    EXPECT_TRUE(described.contains(name)) << name << " is counted and not described";
}

TEST(Program, BaselinesAreNotComparedWithAMachineThatEliminatesTiles) {
  const test::TemporaryFolder out;
  for (const char* key : {"tile.rendering_elimination=true", "frame_buffer.transaction_elimination=true"}) {
    const auto run = run_tessera({"replay", capture("vases"), "--size", "16x16", "--baselines", "--quiet", "--set", key,
                                  "--out", (out / "x").string()});
    EXPECT_EQ(run.status, 2);
    EXPECT_THAT(run.errors, HasSubstr("the machine needs tile.rendering_elimination=false"));
  }
}

TEST(Program, HistoriesWarmUpsAndImagesOfTheResolveUnitNeedDesampling) {
  const test::TemporaryFolder out;
  const auto replay = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"replay", capture("stroll"),   "--size", "160x90", "--quiet",
                                          "--out",  (out / "x").string()};
    if (std::find(more.begin(), more.end(), "--frames") == more.end()) more.insert(more.end(), {"--frames", "20:22"});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_tessera(arguments);
  };
  const std::string history = (out / "history").string(), on = "resolve.desampling=adaptive";
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"--aux", "rate"},
        {"--warmup", "2"},
        {"--save-history", history},
        {"--set", on, "--warmup", "-1"},
        {"--set", on, "--set", "resolve.reuse_speed=9"},
        {"--set", on, "--set", "stereo.eye_separation=1", "--save-history", history}})
    EXPECT_EQ(replay(arguments).status, 2) << arguments[0] << " " << arguments[1];
  EXPECT_EQ(replay({"--set", on, "--history", history}).status, 3);
  ASSERT_EQ(replay({"--set", on, "--warmup", "2", "--save-history", history, "--aux",
                    "rate,velocity,edges,discrepancy,origin,error"})
                .status,
            0);
  // With a warm-up the first frame that is written has a history already; without it has none.
  const auto advected = [&] {
    return stats_of(out / "x")["frames"][0]["counters"]["resolve.pixels_advected"].get<int>();
  };
  EXPECT_GT(advected(), 0);
  ASSERT_EQ(replay({"--set", on, "--history", history, "--frames", "22:23"}).status, 0);
  EXPECT_GT(advected(), 0);
  ASSERT_EQ(replay({"--set", on}).status, 0);
  EXPECT_EQ(advected(), 0);
  ASSERT_EQ(replay({"--set", "stereo.eye_separation=0.1"}).status, 0);
  for (const char* name : {"frame_0020.right.exr", "frame_0020.right.png", "frame_0021.png"})
    EXPECT_TRUE(fs::exists(out / "x" / name)) << name;
}

}  // namespace
}  // namespace tessera::replay::program_test
