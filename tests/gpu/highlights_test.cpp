// Light above white beside darker pixels, desampled by adaptive rates.
#include "base/image_metrics.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "tests/support/displayed_image.h"
#include "tests/support/tests.h"

namespace tessera::gpu::highlights_test {
namespace {

constexpr int kWidth = 160, kHeight = 96, kFrames = 5;

// A bumpy sheet below lamps, which moves by some pixels each frame: its highlights stay where they are, so that the
// previous colours of a place tell little.
scene::Capture bumps() {
  scene::Capture capture;
  capture.settings.frame_rate = 8;
  scene::Material material;
  material.base_color = {0.2f, 0.2f, 0.2f, 1};
  material.metallic = 0, material.roughness = 0.15f;
  material.double_sided = true;
  constexpr int kCells = 96;
  std::vector<Vec3> places, normals;
  std::vector<std::uint32_t> corners;
  for (int j = 0; j <= kCells; ++j)
    for (int i = 0; i <= kCells; ++i) {
      const float x = 8.0f * static_cast<float>(i) / kCells - 4, y = 8.0f * static_cast<float>(j) / kCells - 4;
      places.emplace_back(x, y, 0.03f * std::sin(9 * x) * std::sin(9 * y));
      normals.push_back(glm::normalize(
          Vec3(-0.27f * std::cos(9 * x) * std::sin(9 * y), -0.27f * std::sin(9 * x) * std::cos(9 * y), 1)));
      if (i == kCells || j == kCells) continue;
      const auto first = static_cast<std::uint32_t>(j * (kCells + 1) + i), row = std::uint32_t{kCells + 1};
      for (const std::uint32_t c : {first, first + 1, first + row + 1, first, first + row + 1, first + row})
        corners.push_back(c);
    }
  scene::Primitive sheet = test::triangles(places, corners, test::add_material(capture, material));
  sheet.vertices.normals = normals;
  const int node = test::add_node(capture, sheet);
  test::add_motion(capture, node, {1.3, 0.7, 0});
  for (int k = 0; k < 4; ++k) {
    capture.lights.emplace_back();
    capture.lights.back().type = shaders::Light::Type::kPoint;
    capture.lights.back().color = Vec3(60.0f);
    capture.light_parameters.emplace_back();
    scene::Node lamp;
    lamp.light = k;
    lamp.transform.translation = {k % 2 == 0 ? -1.5f : 1.5f, k < 2 ? -1.0f : 1.0f, 2.5f};
    capture.roots.push_back(static_cast<int>(capture.nodes.size()));
    capture.nodes.push_back(lamp);
  }
  test::add_camera(capture, {0, 0, 4});
  return capture;
}

// The worst frame after the first, in dB as displays show it, and how many blocks were shaded for their highlights.
struct Worst {
  double psnr = 1000;
  std::uint64_t blocks = 0;
};
Image shown(const Image& color) {
  Image linear(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (std::size_t c = 0; c < 3; ++c) linear.at(x, y)[c] = color.at(x, y)[c];
  return test::displayed(linear);
}

Worst worst(const std::vector<std::string>& keys) {
  const scene::Capture capture = bumps();
  RunSettings settings;
  settings.output.machine_model = false;
  GpuConfiguration full, adaptive;
  for (const std::string& key : keys) apply_setting(key, settings, adaptive);
  Device every(capture, full, {}, {kWidth, kHeight, {0, 0, kWidth, kHeight}}),
      some(capture, adaptive, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}});
  Worst out;
  for (int f = 0; f < kFrames; ++f) {
    const FrameResult a = every.render(f), b = some.render(f);
    out.blocks += b.counters.desampling.blocks_highlight;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (std::size_t c = 0; c < 3; ++c) EXPECT_GE(b.targets.color.at(x, y)[c], 0.0f);
    if (f > 0) out.psnr = std::min(out.psnr, psnr(shown(a.targets.color), shown(b.targets.color)));
  }
  return out;
}

TEST(Highlights, BordersAreShadedInFull) {
  const Worst found = worst({"resolve.desampling=adaptive"}),
              without = worst({"resolve.desampling=adaptive", "resolve.discrepancy=off"});
  EXPECT_GT(found.blocks, 0u);
  EXPECT_EQ(without.blocks, 0u);
  std::cout << "bumps: " << found.psnr << " dB, " << without.psnr << " without the check\n";
  EXPECT_GT(found.psnr, without.psnr + 1) << "only the check finds them";
}

}  // namespace
}  // namespace tessera::gpu::highlights_test
