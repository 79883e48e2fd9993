// The images of docs/shading.md agree with renders of the program; figures.py checks the page's table.
#include "base/image_codec.h"
#include "base/image_metrics.h"
#include "base/whole_file.h"
#include "tests/support/tests.h"

namespace tessera::materials_page_test {
namespace {

const fs::path kMaterialsFolder = fs::path(TESSERA_SOURCE_DIR) / "docs" / "images" / "materials";
constexpr int kGalleryWidth = 480, kGalleryHeight = 270;

// The part of an image from `x0` on, as wide as one of the gallery.
Image gallery_part(const fs::path& file, int x0) {
  DecodedImage decoded;
  std::string fault;
  EXPECT_TRUE(decode_image(read_whole_file(file, 1u << 24, file.string()), {}, decoded, fault)) << file << fault;
  Image out(kGalleryWidth, kGalleryHeight, 3);
  if (decoded.width() < x0 + kGalleryWidth || decoded.height() != kGalleryHeight) {
    ADD_FAILURE() << file << " is " << decoded.width() << "x" << decoded.height();
    return out;
  }
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      for (int c = 0; c < 3; ++c) out.at(x, y)[static_cast<std::size_t>(c)] = decoded.unorm(x0 + x, y, c);
  return out;
}

// The left half of each image equals our render, within the loss of WebP.
TEST(MaterialsPage, ItsImagesEqualReplays) {
  const auto assets = test::assets_folder();
  const fs::path models = assets ? assets->parent_path() / "materials" : fs::path();
  if (!assets || !fs::is_directory(models)) GTEST_SKIP() << "no folder of models of materials beside TESSERA_ASSETS";
  if (!fs::exists("/usr/bin/python3")) GTEST_SKIP() << "no python3";
  for (const std::string name : {"ClearCoatTest", "SpecularTest", "AnisotropyStrengthTest"}) {
    const test::TemporaryFolder out;
    const std::string copy = (out / "copy.glb").string();
    ASSERT_EQ(test::run_process({"/usr/bin/python3", (kMaterialsFolder / "camera.py").string(),
                                 (models / (name + ".glb")).string(), copy, "1.77778"})
                  .status,
              0);
    const test::ProcessResult r = test::run_tessera(
        {"replay", copy, "--size", "480x270", "--spp", "16", "--no-report", "--quiet", "--out", out.path().string()});
    ASSERT_EQ(r.status, 0) << r.errors;
    const Image now = gallery_part(out / "frame_0000.png", 0);
    const fs::path committed = kMaterialsFolder / (name + ".webp");
    EXPECT_GT(psnr(now, gallery_part(committed, 0)), 32) << name << ": run docs/images/materials/make.sh";
    EXPECT_GT(psnr(now, gallery_part(committed, 0)), psnr(now, gallery_part(committed, kGalleryWidth + 6)) + 3)
        << name << ": the reference beside it is another image";
  }
}

}  // namespace
}  // namespace tessera::materials_page_test
