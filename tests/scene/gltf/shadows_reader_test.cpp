// TESSERA_capture.shadows: its values, and the places and words of its faults. Malformed values are rows of
// broken_captures.json.
#include "scene/capture_reader.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::shadows_reader_test {
namespace {

using test::GltfAsset;

// Light 0 is a spot, light 1 directional, light 2 a point; more points follow.
GltfAsset asset_with(const json& shadows, int lights = 3) {
  GltfAsset asset = test::everything_asset();
  json& all = asset.document["extensions"]["KHR_lights_punctual"]["lights"];
  all.push_back({{"type", "directional"}});
  for (int light = 2; light < lights; ++light) all.push_back({{"type", "point"}});
  asset.document["extensions"]["TESSERA_capture"]["shadows"] = shadows;
  return asset;
}

// The fault with its place below TESSERA_capture.
std::string fault_of(const json& shadows, int lights = 3) {
  try {
    test::read_asset(asset_with(shadows, lights));
  } catch (const InputError& error) {
    const std::string extension = "/extensions/TESSERA_capture";
    EXPECT_TRUE(error.place().starts_with(extension)) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    const std::string text = error.what();
    return text.substr(text.find(extension) + extension.size());
  }
  return "none";
}

json lights_that_cast(int count) {
  json shadows = json::array();
  for (int light = 0; light < count; ++light) shadows.push_back({{"light", light}});
  return shadows;
}

TEST(ShadowsReader, ReadsEveryMember) {
  const std::vector<ShadowRequest> shadows =
      test::read_asset(
          asset_with({{{"light", 1}, {"size", 2048}, {"cascades", 4}, {"distance", 200.5}}, {{"light", 0}}}))
          .settings.shadows;
  ASSERT_EQ(shadows.size(), 2u);
  EXPECT_EQ(shadows[0].light, 1);
  EXPECT_EQ(shadows[0].size, 2048);
  EXPECT_EQ(shadows[0].cascades, 4);
  EXPECT_EQ(shadows[0].distance, 200.5);
  EXPECT_EQ(shadows[1].light, 0);
  EXPECT_EQ(shadows[1].size, 1024);
  EXPECT_EQ(shadows[1].cascades, 1);
  EXPECT_EQ(shadows[1].distance, 0.0);
}

TEST(ShadowsReader, LightsCastNothingUnlessTheFileAsks) {
  EXPECT_TRUE(test::read_asset(test::everything_asset()).settings.shadows.empty());
  EXPECT_TRUE(test::read_asset(asset_with(json::array())).settings.shadows.empty());
}

TEST(ShadowsReader, NamesALightThatIsNotThere) {
  EXPECT_EQ(fault_of({{{"light", 3}}}), "/shadows/0/light: points at light 3, there are 3");
  EXPECT_EQ(fault_of(json::array({json::object()})), "/shadows/0: lacks the property 'light'");
}

TEST(ShadowsReader, RefusesALightNamedTwice) {
  EXPECT_EQ(fault_of({{{"light", 1}}, {{"light", 0}}, {{"light", 1}}}),
            "/shadows/2/light: is light 1, which shadows/0 names already");
}

TEST(ShadowsReader, CascadesAndDistanceNeedDirectionalLights) {
  EXPECT_EQ(fault_of({{{"light", 0}, {"cascades", 2}}}),
            "/shadows/0/cascades: need a directional light, light 0 is a spot light");
  EXPECT_EQ(fault_of({{{"light", 2}, {"distance", 10}}}),
            "/shadows/0/distance: needs a directional light, light 2 is a point light");
  EXPECT_EQ(fault_of({{{"light", 0}, {"cascades", 1}, {"distance", 0}}}), "none");
}

TEST(ShadowsReader, AtMostSixteenLightsCast) {
  EXPECT_EQ(fault_of(lights_that_cast(16), 17), "none");
  EXPECT_EQ(fault_of(lights_that_cast(17), 17), "/shadows: are of 17 lights, at most 16 may cast");
}

TEST(ShadowsReader, LimitsEqualThePages) {
  EXPECT_EQ(fault_of({{{"light", 1}, {"size", 1}, {"cascades", 8}}}), "none");
  EXPECT_EQ(fault_of({{{"light", 1}, {"size", 16384}}}), "none");
  EXPECT_EQ(fault_of({{{"light", 1}, {"size", 0}}}), "/shadows/0/size: is 0, outside [1, 16384]");
  EXPECT_EQ(fault_of({{{"light", 1}, {"size", 16385}}}), "/shadows/0/size: is 16385, outside [1, 16384]");
  EXPECT_EQ(fault_of({{{"light", 1}, {"cascades", 9}}}), "/shadows/0/cascades: is 9, outside [1, 8]");
  EXPECT_THAT(fault_of({{{"light", 1}, {"distance", -1}}}), testing::StartsWith("/shadows/0/distance: is -1, outside"));
}

}  // namespace
}  // namespace tessera::scene::shadows_reader_test
