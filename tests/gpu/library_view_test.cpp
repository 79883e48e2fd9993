// tessera::View chooses through the library whatever the options of `tessera replay` choose.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tessera/tessera.h>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/image_codec.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/view_asset.h"

namespace tessera::library_view_test {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

struct Choice {
  const char* option;
  std::optional<std::string> View::*member;
  const char* word;
};

class LibraryView : public testing::Test {
 protected:
  static constexpr int kFrame = 9, kWidth = 60, kHeight = 44;  // another shape than the file's 1280x720

  std::vector<std::uint8_t> of_library(const View& view) const {
    RenderOptions options;
    options.width = kWidth;
    options.height = kHeight;
    const Frame frame = Device(Scene(file_, {}, view), Gpu(), {}, options).render(kFrame);
    const auto values = frame.display().values;
    return {values.begin(), values.end()};
  }
  std::vector<std::uint8_t> of_program(std::vector<std::string> arguments) const {
    const fs::path out = folder_ / "out";
    arguments.insert(arguments.begin(), {"replay", file_.string(), "--size", std::to_string(kWidth) + "x44", "--frames",
                                         "9:10", "--quiet", "--no-report", "--out", out.string()});
    const test::ProcessResult r = test::run_tessera(arguments);
    EXPECT_EQ(r.status, 0) << r.errors;
    const std::string png = test::read_text(out / "frame_0009.png");
    DecodedImage image;
    std::string fault;
    EXPECT_TRUE(decode_image({reinterpret_cast<const std::uint8_t*>(png.data()), png.size()}, {}, image, fault))
        << fault;
    return std::get<Image8>(image.pixels).values;
  }
  std::string refusal(const View& view) const {
    try {
      const Scene scene(file_, {}, view);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "nothing was refused";
  }

  test::TemporaryFolder folder_;
  const fs::path file_ = test::view_asset().write(folder_.path());
};

TEST_F(LibraryView, FramesEqualTheCommandLinesWithTheSameChoices) {
  const std::vector<std::uint8_t> usual = of_library({});
  EXPECT_EQ(of_program({}), usual);
  const std::vector<std::vector<Choice>> all = {
      {{"--camera", &View::camera, "far"}},
      {{"--camera", &View::camera, "1"}},
      {{"--camera", &View::camera, "auto"}},
      {{"--scene", &View::scene, "other"}},
      {{"--animation", &View::animation, "sink"}},
      {{"--animation", &View::animation, "none"}},
      {{"--orbit", &View::orbit, "75:40"}},
      {{"--lens", &View::lens, "0.3"}},
      {{"--shutter", &View::shutter, "0:1"}},
      {{"--orbit", &View::orbit, "-30"}, {"--lens", &View::lens, "0.2:2"}, {"--animation", &View::animation, "rise"}}};
  for (const std::vector<Choice>& choices : all) {
    View view;
    std::vector<std::string> arguments;
    for (const Choice& choice : choices) {
      view.*choice.member = choice.word;
      arguments.insert(arguments.end(), {choice.option, choice.word});
    }
    const std::vector<std::uint8_t> frame = of_library(view);
    EXPECT_NE(frame, usual) << choices[0].option << " " << choices[0].word;
    EXPECT_EQ(frame, of_program(arguments)) << choices[0].option << " " << choices[0].word;
  }
}

TEST_F(LibraryView, MissingPartsAreRefusedAsByTheCommandLine) {
  const std::vector<std::pair<Choice, const char*>> wrong = {
      {{"--scene", &View::scene, "third"}, "which has 0 'all', 1 'other'"},
      {{"--camera", &View::camera, "fra"}, "which has 0 'near', 1 'far', 2 'lost'"},
      {{"--animation", &View::animation, "walk"}, "which has 0 'rise', 1 'sink', 2 'turn'"},
      {{"--orbit", &View::orbit, "left"}, "expected DEGREES"},
      {{"--lens", &View::lens, "-1"}, "expected RADIUS"},
      {{"--shutter", &View::shutter, "1:0"}, "expected OPEN:CLOSE"}};
  for (const auto& [choice, said] : wrong) {
    View view;
    view.*choice.member = choice.word;
    const std::string message = refusal(view);
    EXPECT_THAT(message, HasSubstr(said));
    const test::ProcessResult r = test::run_tessera({"replay", file_.string(), choice.option, choice.word});
    EXPECT_EQ(r.status, 2);
    EXPECT_THAT(r.errors, HasSubstr(message));
  }
  View both;
  both.camera = "near";
  both.orbit = "40";
  EXPECT_THAT(refusal(both), HasSubstr("--camera auto"));
}

// The automatic framing follows the frame's own shape; a camera of the file does not count as made up.
TEST_F(LibraryView, ADeviceSaysWhetherItsCameraWasMadeUp) {
  const auto made_up = [&](const View& view) { return Device(Scene(file_, {}, view)).automatic_camera(); };
  View view;
  EXPECT_FALSE(made_up(view));
  view.camera = "auto";
  EXPECT_TRUE(made_up(view));
  view.camera = "far";
  view.lens = "0.1";
  EXPECT_FALSE(made_up(view));
}

}  // namespace
}  // namespace tessera::library_view_test
