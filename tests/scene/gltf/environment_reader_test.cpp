// TESSERA_capture.environment: its forms, the places of its image, and refused images.
#include "base/error.h"
#include "base/exr_file.h"
#include "scene/capture_reader.h"
#include "shaders_cpp/environment.h"
#include "tests/support/environments.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/radiance_files.h"
#include "tests/support/tests.h"

namespace tessera::scene::environment_reader_test {
namespace {

using test::GltfAsset;
using Kind = shaders::Surroundings::Kind;

GltfAsset asset_with(const json& environment) {
  GltfAsset asset = test::everything_asset();
  json& settings = asset.document["extensions"]["TESSERA_capture"];
  settings.erase("environment");
  if (!environment.is_null()) settings["environment"] = environment;
  return asset;
}

struct Folder : test::TemporaryFolder {
  Capture read(const GltfAsset& asset, const CaptureLimits& limits = {}) const {
    test::write_text(*this / "f.glb", asset.glb());
    return read_capture(*this / "f.glb", limits);
  }
  std::string fault(const GltfAsset& asset) const {
    try {
      read(asset);
    } catch (const InputError& error) {
      return error.place() + ": " + error.fault();
    } catch (const LimitError& error) {
      return error.what();
    }
    return "";
  }
};

Image sky() {
  return test::sky_image(16, [](const DVec3& d) { return DVec3(1.0 + d.y, 1.0 + d.x, 0.5); });
}

TEST(CaptureEnvironment, IsTheStudioUnlessTheCaptureSaysOtherwise) {
  const Folder folder;
  const auto settings = [&](const json& environment) { return folder.read(asset_with(environment)).settings; };
  EXPECT_EQ(settings(nullptr).environment_kind, Kind::kStudio);
  EXPECT_FALSE(settings(nullptr).environment.has_value());
  EXPECT_FALSE(settings(json::object()).environment.has_value());
  EXPECT_EQ(settings(0.25).environment, 0.25f);
  EXPECT_EQ(settings({{"intensity", 0.5}}).environment, 0.5f);
  EXPECT_EQ(settings({{"uniform", false}}).environment_kind, Kind::kStudio);
  for (const json& furnace : {json("uniform"), json({{"uniform", true}})}) {
    EXPECT_EQ(settings(furnace).environment_kind, Kind::kUniform);
    EXPECT_EQ(settings(furnace).environment, 1.0f);
  }
  EXPECT_EQ(settings({{"uniform", true}, {"intensity", 3}}).environment, 3.0f);
}

TEST(CaptureEnvironment, MayBeAnImageInAFileOrABufferView) {
  const Folder folder;
  const Image image = sky();
  const std::string hdr = test::hdr_file(image);
  test::write_text(folder / "sky one.hdr", hdr);
  std::vector<ExrChannel> channels;
  for (std::size_t c = 0; c < 3; ++c)
    channels.push_back({std::string(1, "RGB"[c]), ExrChannel::Type::kFloat, image.values.data() + c, 3});
  write_exr(folder / "sky.exr", image.width, image.height, channels);
  GltfAsset inside = asset_with(nullptr);
  inside.document["extensions"]["TESSERA_capture"]["environment"] = {
      {"bufferView", inside.add_view(test::bytes_of(hdr))}};
  const std::string data = "data:image/vnd.radiance;base64," + test::base64(test::bytes_of(hdr));
  const shaders::EnvironmentImage expected(sky(), 0.0);
  for (const GltfAsset& asset :
       {asset_with("sky%20one.hdr"), asset_with({{"image", "sky%20one.hdr"}}), asset_with({{"image", "sky.exr"}}),
        asset_with({{"image", data}, {"intensity", 1}}), inside}) {
    const Capture capture = folder.read(asset);
    EXPECT_EQ(capture.settings.environment_kind, Kind::kImage);
    EXPECT_EQ(capture.settings.environment, 1.0f);
    ASSERT_NE(capture.environment_image, nullptr);
    const auto seen = [](const shaders::EnvironmentImage& of, const Vec3& d) {
      return shaders::Environment(test::surroundings_of(of)).specular(d, 0.4f);
    };
    for (const Vec3& d : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0.48f, -0.6f, 0.64f)})
      for (int c = 0; c < 3; ++c)  // eight bits of a mantissa
        EXPECT_NEAR(seen(*capture.environment_image, d)[c], seen(expected, d)[c], 0.02f);
  }
  const Capture outside = folder.read(asset_with("sky%20one.hdr"));
  EXPECT_EQ(outside.file_bytes, std::filesystem::file_size(folder / "f.glb") + hdr.size());
}

TEST(CaptureEnvironment, ItsImageIsTurned) {
  const Folder folder;
  test::write_text(folder / "sky.hdr", test::hdr_file(sky()));
  const Capture capture = folder.read(asset_with({{"image", "sky.hdr"}, {"rotation", 1.5707963}, {"intensity", 2}}));
  EXPECT_EQ(capture.settings.environment, 2.0f);
  const shaders::Environment seen(test::surroundings_of(*capture.environment_image));
  // Green grows along +x; a quarter of the circle counterclockwise, seen from above, +x becomes -z.
  EXPECT_NEAR(seen.background({0, 0, -1}).y, 2.0f, 0.1f);
  EXPECT_NEAR(seen.background({0, 0, 1}).y, 0.0f, 0.1f);
  EXPECT_NEAR(seen.background({1, 0, 0}).y, 1.0f, 0.1f);
}

TEST(CaptureEnvironment, WithoutAnImageNothingIsCharged) {
  const Folder folder;
  const Capture studio = folder.read(asset_with(1));
  EXPECT_EQ(studio.environment_image, nullptr);
  EXPECT_EQ(folder.read(asset_with(2)).charged_bytes, studio.charged_bytes);
  test::write_text(folder / "sky.hdr", test::hdr_file(sky()));
  const Capture image = folder.read(asset_with("sky.hdr"));
  EXPECT_GT(image.charged_bytes, studio.charged_bytes + shaders::EnvironmentImage::working_bytes(16));
  CaptureLimits limits;
  limits.max_bytes = image.charged_bytes;
  EXPECT_NO_THROW(folder.read(asset_with("sky.hdr"), limits));
  limits.max_bytes -= 1;
  EXPECT_THROW(folder.read(asset_with("sky.hdr"), limits), BudgetError);
}

TEST(CaptureEnvironment, OtherImagesAreRefusedByName) {
  const Folder folder;
  const std::string place = "/extensions/TESSERA_capture/environment: ";
  const auto fault_of = [&](const std::string& bytes) {
    test::write_text(folder / "sky.hdr", bytes);
    return folder.fault(asset_with("sky.hdr"));
  };
  EXPECT_EQ(fault_of(""), place + "sky.hdr: is neither OpenEXR nor Radiance HDR");
  EXPECT_EQ(fault_of("\x89PNG"), place + "sky.hdr: is neither OpenEXR nor Radiance HDR");
  const std::string whole = test::hdr_file(sky());
  EXPECT_EQ(fault_of(whole.substr(0, whole.size() - 1)), place + "sky.hdr: has a broken row 15, or ends there");
  EXPECT_EQ(fault_of(test::hdr_file(Image(8, 8, 3))),
            place + "sky.hdr: has 8x8 pixels: an equirectangular image is twice as wide as high");
  EXPECT_THAT(fault_of("#?RADIANCE\n\n-Y 20000 +X 40000\n" + std::string(100000, 'x')),
              testing::HasSubstr("environment: sky.hdr: 40000x20000 pixels exceed the limit"));
  EXPECT_THAT(folder.fault(asset_with("missing.hdr")), testing::StartsWith(place + "missing.hdr: "));
  EXPECT_THAT(folder.fault(asset_with("../sky.hdr")), testing::StartsWith(place + "leaves the capture's folder"));
  EXPECT_THAT(folder.fault(asset_with("https://a/sky.hdr")), testing::HasSubstr("is a URI with a scheme"));
  EXPECT_THAT(folder.fault(asset_with("")), testing::HasSubstr("is an empty URI"));
  // Bytes inside have no name.
  EXPECT_EQ(folder.fault(asset_with({{"bufferView", 0}})), place + "is neither OpenEXR nor Radiance HDR");
}

TEST(CaptureEnvironment, ValuesOutsideTheirRangesAreRefusedAtTheirPlace) {
  const Folder folder;
  const std::string place = "/extensions/TESSERA_capture/environment";
  EXPECT_THAT(folder.fault(asset_with(json::array())), testing::StartsWith(place + ": is neither a number"));
  EXPECT_THAT(folder.fault(asset_with(true)), testing::StartsWith(place + ": is neither a number"));
  EXPECT_THAT(folder.fault(asset_with({{"intensity", -1}})), testing::StartsWith(place + "/intensity: "));
  EXPECT_THAT(folder.fault(asset_with({{"rotation", "half"}})), testing::StartsWith(place + "/rotation: "));
  EXPECT_THAT(folder.fault(asset_with({{"bufferView", 999}})), testing::StartsWith(place + "/bufferView: "));
  EXPECT_THAT(folder.fault(asset_with({{"uniform", 1}})), testing::StartsWith(place + "/uniform: "));
  EXPECT_THAT(folder.fault(asset_with({{"image", "a.hdr"}, {"bufferView", 0}})),
              testing::StartsWith(place + ": names more than one"));
  EXPECT_THAT(folder.fault(asset_with({{"image", "a.hdr"}, {"uniform", true}})),
              testing::StartsWith(place + ": names more than one"));
}

}  // namespace
}  // namespace tessera::scene::environment_reader_test
