// --scene, --camera, --animation, --orbit, --lens and --shutter: the drawn part of a file and its camera.
#include "replay/view_options.h"
#include "base/error.h"
#include "scene/pose.h"
#include "scene/view.h"
#include "tests/support/tests.h"
#include "tests/support/view_asset.h"

namespace tessera::replay::view_options_test {
namespace {

class ViewOptions : public testing::Test {
 protected:
  scene::Capture read(const ViewChoices& view) const { return read_capture(file_, {}, view, ImageSize{640, 480}); }
  scene::Capture with(const char* option, const std::string& word) const {
    ViewChoices view;
    (option == std::string("camera")  ? view.selection.camera
     : option == std::string("scene") ? view.selection.scene
                                      : view.selection.animation) = word;
    return read(view);
  }
  std::string refusal(const char* option, const std::string& word) const {
    try {
      with(option, word);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  }

  test::TemporaryFolder folder_;
  const fs::path file_ = test::view_asset().write(folder_.path());
};

TEST_F(ViewOptions, CamerasAreChosenByTheirNameTheirNodesNameOrTheirNumber) {
  const auto node = [&](const std::string& word) { return scene::camera_node(with("camera", word)); };
  EXPECT_EQ(scene::camera_node(read({})), 1);
  EXPECT_EQ(node("near"), 1);
  EXPECT_EQ(node("eye"), 1);
  EXPECT_EQ(node("far"), 2);
  EXPECT_EQ(node("1"), 2);
  EXPECT_EQ(node("auto"), 4);  // one of its own
  EXPECT_THAT(refusal("camera", "fra"), HasSubstr("no camera 'fra' in"));
  EXPECT_THAT(refusal("camera", "3"), HasSubstr("which has 0 'near', 1 'far', 2 'lost'"));
  for (const char* lost : {"lost", "2"})
    EXPECT_THAT(refusal("camera", lost), HasSubstr("is in no node of the scene that is drawn"));
  EXPECT_NE(refusal("camera", "elsewhere"), "");
}

TEST_F(ViewOptions, AnimationsAreChosenOneAtATimeOrAllThatDoNotFight) {
  const auto played = [&](const std::string& word) { return with("animation", word).played_animations; };
  EXPECT_EQ(read({}).played_animations, (std::vector{0, 2}));
  EXPECT_EQ(played("all"), (std::vector{0, 2}));
  EXPECT_EQ(played("sink"), std::vector{1});
  EXPECT_EQ(played("1"), std::vector{1});
  EXPECT_EQ(played("none"), std::vector<int>{});
  EXPECT_THAT(refusal("animation", "walk"), HasSubstr("which has 0 'rise', 1 'sink', 2 'turn'"));
  EXPECT_EQ(scene::pose_at(with("animation", "sink"), 1).world[0][3].y, -2);
}

TEST_F(ViewOptions, ASceneIsChosenAndFramedWhereItHasNoCamera) {
  const scene::Capture other = with("scene", "other");
  EXPECT_EQ(other.roots, std::vector{0});
  EXPECT_EQ(scene::camera_node(other), scene::kNone);
  EXPECT_EQ(with("scene", "0").roots, (std::vector{0, 1, 2}));
  EXPECT_THAT(refusal("scene", "2"), HasSubstr("no scene '2' in"));
}

// From wherever it is framed, the scene fills three quarters of the height, or nine tenths of the width.
TEST_F(ViewOptions, AnOrbitTurnsTheAutomaticCameraAroundTheScene) {
  ViewChoices view;
  view.selection.camera = "auto";
  view.selection.animation = "none";
  const DVec3 usual = scene::choose_camera(read(view), 640, 480).view(scene::pose_at(read(view), 0)).camera_to_world[2];
  for (const double azimuth : {0.0, 90.0, -120.0})
    for (const double elevation : {-89.0, -20.0, 0.0, 60.0}) {
      view.orbit = fmt::format("{}:{}", azimuth, elevation);
      const scene::Capture capture = read(view);
      const scene::CameraChoice choice = scene::choose_camera(capture, 640, 480);
      const DVec3 back(choice.view(scene::pose_at(capture, 0)).camera_to_world[2]);
      EXPECT_NEAR(std::asin(back.y), glm::radians(elevation), 1e-12);
      const double turn = std::atan2(back.x, back.z) - std::atan2(usual.x, usual.z);
      EXPECT_NEAR(std::remainder(turn - glm::radians(azimuth), 2 * M_PI), 0, 1e-9) << azimuth;
      const DMat4 m = scene::make_projection(choice.camera, 640, 480).matrix() *
                      choice.view(scene::pose_at(capture, 0)).world_to_camera;
      double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
      for (const Vec3& point : capture.meshes[0].primitives[0].vertices.positions) {
        const DVec4 r = m * DVec4(DVec3(point), 1.0);
        left = std::min(left, r.x / r.w), right = std::max(right, r.x / r.w);
        top = std::min(top, r.y / r.w), bottom = std::max(bottom, r.y / r.w);
      }
      EXPECT_NEAR(std::max((bottom - top) / 360, (right - left) / 576), 1, 1e-6) << *view.orbit;
    }
  view.orbit = "0";
  EXPECT_LT(
      glm::length(
          DVec3(scene::choose_camera(read(view), 640, 480).view(scene::pose_at(read(view), 0)).camera_to_world[2]) -
          usual),
      1e-12);
}

TEST_F(ViewOptions, ALensReplacesTheCamerasAndFocusesOnTheMiddle) {
  ViewChoices view;
  view.lens = "0.05:4";
  const scene::Lens lens = scene::choose_camera(read(view), 64, 36).camera.lens;
  EXPECT_FLOAT_EQ(lens.aperture_radius, 0.05f);
  EXPECT_FLOAT_EQ(lens.focus_distance, 4);
  // The triangle lies between 4.5 and 5 in front of the camera.
  view.lens = "0.05";
  EXPECT_FLOAT_EQ(scene::choose_camera(read(view), 64, 36).camera.lens.focus_distance, 4.75f);
  view.lens = "0";
  EXPECT_EQ(scene::choose_camera(read(view), 64, 36).camera.lens.aperture_radius, 0);
}

TEST_F(ViewOptions, TheShutterFollowsTheCommandLine) {
  ViewChoices view;
  view.shutter = "-0.25:0.5";
  const scene::Capture capture = read(view);
  EXPECT_EQ(capture.settings.shutter_open, -0.25);
  EXPECT_EQ(capture.settings.shutter_close, 0.5);
  EXPECT_FALSE(capture.settings.declared);
}

TEST_F(ViewOptions, WordsThatAreNoNumbersAreRefused) {
  const auto refused = [](std::optional<std::string> ViewChoices::*member, const char* word) {
    ViewChoices view;
    view.*member = word;
    try {
      view.check();
    } catch (const UsageError& error) {
      return std::string(error.what()).find(word) != std::string::npos;
    }
    return false;
  };
  for (const char* word : {"", "x", "1:", ":1", "1:2:3", "nan", "361", "0:90", "inf"})
    EXPECT_TRUE(refused(&ViewChoices::orbit, word)) << word;
  for (const char* word : {"", "-1", "1:0", "1:-1", "nan:1", "1e99", "1:1e99", "1:1e-99"})
    EXPECT_TRUE(refused(&ViewChoices::lens, word)) << word;
  for (const char* word : {"", "1", "1:0", "-2:0", "0:3"}) EXPECT_TRUE(refused(&ViewChoices::shutter, word)) << word;
}

// A shell parses the text back into the given arguments.
TEST_F(ViewOptions, ArgumentsReadBackAsTheCommandLine) {
  ViewChoices view;
  view.selection.camera = "it's";
  view.shutter = "0:0.5";
  EXPECT_EQ(view_arguments(view), " --camera 'it'\\''s' --shutter '0:0.5'");
  EXPECT_EQ(view_arguments({}), "");
}

// ---- The program ------------------------------------------------------------------------------------------------

TEST_F(ViewOptions, InspectListsTheChoicesAndTheDrawnParts) {
  const ProcessResult table = run_tessera({"inspect", file_.string()});
  for (const char* line :
       {"  scene 0     all\n", "  scene 1     other, not drawn\n", "  camera 0    near, perspective, node eye\n",
        "  camera 1    far, perspective, node (no name), not used\n",
        "  camera 2    lost, perspective, node elsewhere, not used\n",
        "  anim. 1     sink: 1 channels, 1 s, frames 0:31, not played\n"})
    EXPECT_THAT(table.output, HasSubstr(line));
  const json chosen =
      json::parse(run_tessera({"inspect", file_.string(), "--json", "--scene", "other", "--animation", "1"}).output);
  EXPECT_TRUE(chosen["view"]["automatic"].get<bool>());
  EXPECT_EQ(chosen["view"]["matrix"].size(), 16u);
  EXPECT_TRUE(chosen["scenes"][1]["drawn"].get<bool>());
  EXPECT_FALSE(chosen["animations"][0]["played"].get<bool>());
  EXPECT_TRUE(chosen["animations"][1]["played"].get<bool>());
}

TEST_F(ViewOptions, ReplaysOfOtherCamerasDifferAndStatisticsSayHow) {
  const auto image = [&](const char* name, std::vector<std::string> more) {
    std::vector<std::string> arguments = {"replay",  file_.string(), "--size", "64x36",
                                          "--quiet", "--no-report",  "--out",  (folder_ / name).string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProcessResult r = run_tessera(arguments);
    EXPECT_EQ(r.status, 0) << r.errors;
    return test::read_text(folder_ / name / "frame_0000.png");
  };
  const std::string usual = image("usual", {});
  EXPECT_EQ(image("near", {"--camera", "near"}), usual);
  EXPECT_NE(image("far", {"--camera", "far"}), usual);
  EXPECT_NE(image("auto", {"--orbit", "40"}), usual);
  EXPECT_NE(image("lens", {"--lens", "0.3:2"}), usual);
  const auto capture = [&](const char* name) {
    return json::parse(test::read_text(folder_ / name / "stats.json"))["capture"];
  };
  EXPECT_EQ(capture("far")["view"], json({{"camera", "far"}}));
  EXPECT_FALSE(capture("usual").contains("view"));
}

// A packed view is the view: the file itself asks for the choices of the command line.
TEST_F(ViewOptions, PackStoresTheChoices) {
  const std::vector<std::vector<std::string>> choices = {
      {"--camera", "far"},     {"--camera", "auto"}, {"--scene", "other"}, {"--animation", "sink"},
      {"--animation", "none"}, {"--orbit", "75:40"}, {"--lens", "0.2"},    {"--lens", "0.1:3", "--camera", "far"}};
  int number = 0;
  for (const std::vector<std::string>& choice : choices) {
    const std::string packed = (folder_ / fmt::format("{}.glb", number)).string();
    std::vector<std::string> pack = {"pack",   file_.string(), packed,     "--method", "none",
                                     "--size", "64x36",        "--frames", "0:2"};
    pack.insert(pack.end(), choice.begin(), choice.end());
    const ProcessResult r = run_tessera(pack);
    ASSERT_EQ(r.status, 0) << r.errors;
    // Automatic framing looks at the frames that pack declares.
    const std::string plain = (folder_ / fmt::format("{}_plain.glb", number)).string();
    ASSERT_EQ(
        run_tessera({"pack", file_.string(), plain, "--method", "none", "--size", "64x36", "--frames", "0:2"}).status,
        0);
    const auto replay = [&](const std::string& file, const std::vector<std::string>& more) {
      const fs::path out = folder_ / "out";
      std::vector<std::string> arguments = {"replay", file,         "--quiet",  "--no-report",
                                            "--out",  out.string(), "--frames", "1:2"};
      arguments.insert(arguments.end(), more.begin(), more.end());
      EXPECT_EQ(run_tessera(arguments).status, 0);
      return test::read_text(out / "frame_0001.png");
    };
    EXPECT_EQ(replay(packed, {}), replay(plain, choice)) << choice[0] << " " << choice[1];
    ++number;
  }
  EXPECT_EQ(
      run_tessera({"pack", file_.string(), (folder_ / "x.glb").string(), "--lens", "1", "--aperture", "1"}).status, 2);
}

TEST_F(ViewOptions, StudiesAndTradeoffsTakeThem) {
  const auto study = [&](const json& more) {
    json root = {{"captures", {file_.filename().string()}}, {"size", "32x32"}, {"columns", {"tilecore.triangles"}}};
    root.update(more);
    test::write_text(folder_ / "study.json", root.dump());
    return run_tessera({"sweep", (folder_ / "study.json").string(), "--quiet", "--out", (folder_ / "sweep").string()});
  };
  EXPECT_EQ(study({{"camera", "far"}, {"shutter", "0:1"}}).status, 0);
  const json sweep = json::parse(test::read_text(folder_ / "sweep" / "sweep.json"));
  EXPECT_EQ(sweep["view"], json({{"camera", "far"}, {"shutter", "0:1"}}));
  const std::string first = sweep["points"][0]["hash"];
  EXPECT_EQ(study({{"camera", "near"}}).status, 0);
  EXPECT_NE(json::parse(test::read_text(folder_ / "sweep" / "sweep.json"))["points"][0]["hash"], first);
  const ProcessResult wrong = study({{"orbit", "left"}});
  EXPECT_EQ(wrong.status, 3);
  EXPECT_THAT(wrong.errors, HasSubstr("/orbit: --orbit left: expected DEGREES"));
  EXPECT_EQ(study({{"camera", "nobody"}}).status, 2);
  const ProcessResult tradeoff =
      run_tessera({"tradeoff", file_.string(), "--size", "16x16", "--reference-samples", "1", "--rounds", "1",
                   "--knobs", "split_depth", "--camera", "far", "--quiet", "--out", (folder_ / "tradeoff").string()});
  EXPECT_EQ(tradeoff.status, 0) << tradeoff.errors;
  EXPECT_EQ(json::parse(test::read_text(folder_ / "tradeoff" / "tradeoff.json"))["view"], json({{"camera", "far"}}));
}

}  // namespace
}  // namespace tessera::replay::view_options_test
