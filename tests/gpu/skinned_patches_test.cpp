// Bezier patches that a skin carries give the same image as patches that a node carries, mirrored or not: their
// normals follow from control points, which a skin turns over.
#include "gpu/device.h"
#include "gpu/settings.h"
#include "tests/support/tests.h"

namespace tessera::gpu::skinned_patches_test {
namespace {

constexpr int kSide = 64;

scene::Capture stage(const DVec3& scale, bool skinned) {
  scene::Capture capture;
  scene::Primitive patches = test::closed_patches(scene::kNone);
  patches.material = test::add_material(capture, scene::Material());
  if (skinned) {
    patches.vertices.influences.resize(patches.vertices.count());
    for (auto& influence : patches.vertices.influences) influence.weights[0] = 1;
  }
  const auto node = static_cast<std::size_t>(test::add_node(capture, patches));
  if (skinned) {
    const auto joint = static_cast<int>(capture.nodes.size());
    capture.nodes.emplace_back();
    capture.nodes.back().transform.scale = scale;
    capture.roots.push_back(joint);
    capture.skins.push_back({{joint}, {DMat4(1.0)}});
    capture.nodes[node].skin = 0;
    // Its own node counts for the winding alone.
    if (scale.x * scale.y * scale.z < 0) capture.nodes[node].transform.scale = DVec3(1, 1, -7);
  } else {
    capture.nodes[node].transform.scale = scale;
  }
  test::add_camera(capture, DVec3(0.4, 0.3, 4));
  return capture;
}

Image rendered(const scene::Capture& capture, const char* surface) {
  RunSettings run;
  GpuConfiguration gpu;
  apply_setting(surface, run, gpu);
  return Device(capture, gpu, run, {kSide, kSide, {0, 0, kSide, kSide}}).render(0).targets.color;
}

TEST(SkinnedPatches, AreLitAsRigidOnes) {
  for (const char* surface : {"shading.surface=interpolated", "shading.surface=evaluated"})
    for (const DVec3& scale : {DVec3(1, 1, 1), DVec3(-1, 1, 1), DVec3(1, -1, 1), DVec3(-1, -1, 1), DVec3(-1, -1, -1)}) {
      const Image rigid = rendered(stage(scale, false), surface), skinned = rendered(stage(scale, true), surface);
      ASSERT_EQ(rigid.values.size(), skinned.values.size());
      std::size_t apart = 0, lit = 0;
      for (std::size_t k = 0; k < rigid.values.size(); ++k) {
        apart += std::abs(rigid.values[k] - skinned.values[k]) <= 0.004f ? 0 : 1;
        lit += rigid.values[k] > 0.01f ? 1 : 0;
      }
      EXPECT_GT(lit, rigid.values.size() / 4);
      EXPECT_LE(apart, rigid.values.size() / 500) << surface << " " << scale.x << " " << scale.y << " " << scale.z;
    }
}

}  // namespace
}  // namespace tessera::gpu::skinned_patches_test
