// References are kept, and any program can read them.
#include "reference/reference_renderer.h"
#include "reference/reference_store.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"

namespace tessera::reference::kept_reference_test {
namespace {

class KeptReferences : public testing::Test {
 protected:
  Reference get(const scene::Capture& capture, const std::string& scene, std::string& note,
                const gpu::RunSettings& settings = {}) {
    note.clear();
    return get_kept_reference(gpu::PreparedCapture(capture), {}, settings,
                              {.width = 48, .height = 27, .frame = 14, .samples = 4, .edge_pixels = 0},
                              {folder_.path() / "kept", "eggs", scene}, note);
  }
  std::size_t files() const {
    std::size_t count = 0;
    for ([[maybe_unused]] const auto& file : std::filesystem::directory_iterator(folder_.path() / "kept")) ++count;
    return count;
  }
  test::TemporaryFolder folder_;
};

TEST_F(KeptReferences, AreReadAsTheyWereWritten) {  // RK2
  const scene::Capture eggs = scene::read_capture(test::shipped_capture("eggs"));
  std::string note;
  const Reference made = get(eggs, "scene", note), again = get(eggs, "scene", note);
  EXPECT_EQ(note, "");
  EXPECT_EQ(made.color.values, again.color.values);
  EXPECT_EQ(made.info, again.info) << "host times, too: it was not rendered again";
  EXPECT_EQ(files(), 2u);
  // Half precision errs far less than any setting.
  const Reference exact =
      get_reference(gpu::PreparedCapture(eggs), {}, {},
                    {.width = 48, .height = 27, .frame = 14, .samples = 4, .edge_pixels = 0}, folder_.path(), "inputs");
  EXPECT_LT(rms_difference(exact.color, made.color), 1e-3);
  EXPECT_NE(exact.color.values, made.color.values) << "the twin: it is stored in half precision";
}

TEST_F(KeptReferences, AnotherSceneOrShaderMakesThemOld) {  // RK1
  scene::Capture eggs = scene::read_capture(test::shipped_capture("eggs"));
  std::string note;
  const Reference made = get(eggs, "scene", note);
  EXPECT_NE(get(eggs, "another file", note).info.host, made.info.host);
  EXPECT_THAT(note, testing::HasSubstr("the capture's file is another one"));
  get(eggs, "another file", note);
  EXPECT_EQ(note, "") << "it was written again";
  // A light that shades all a little more stands for a shader that was changed: the file is the same.
  eggs.settings.environment = eggs.settings.environment.value_or(1.0f) * 1.01f;
  get(eggs, "another file", note);
  EXPECT_THAT(note, testing::HasSubstr("a shader or the renderer draws it otherwise"));
  EXPECT_EQ(files(), 2u);
  // Other settings have a file of their own.
  gpu::RunSettings still;
  still.effects.motion = gpu::EffectMode::kOff;
  get(eggs, "another file", note, still);
  EXPECT_EQ(note, "");
  EXPECT_EQ(files(), 4u);
}

}  // namespace
}  // namespace tessera::reference::kept_reference_test
