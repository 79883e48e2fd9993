// Settings of precision: each changes only the values that it names.
#include <Imath/half.h>

#include "base/half_float.h"
#include "gpu/device.h"
#include "gpu/view_inputs.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"
#include "tilecore/tessellation/tessellator.h"

namespace tessera::gpu::precision_test {
namespace {

using scene::Capture;

Capture shipped(const char* name) { return scene::read_capture(test::shipped_capture(name)); }

struct Machine {
  RunSettings settings;
  gpu::GpuConfiguration gpu;
  Machine& set(const std::string& text) {
    apply_setting(text, settings, gpu);
    return *this;
  }
  std::vector<float> image(const Capture& capture, int frame) const {
    Device renderer(capture, gpu, settings, {96, 54, {0, 0, 96, 54}});
    return renderer.render(frame).targets.color.values;
  }
};

TEST(HalfFloat, RoundsAsImathDoes) {
  const auto same = [](float value) {
    const float ours = round_to_half(value), theirs = static_cast<float>(Imath::half(value));
    return std::isnan(value) ? std::isnan(ours) : ours == theirs && std::signbit(ours) == std::signbit(theirs);
  };
  // Every half, the midpoint to the next half, and the floats beside the midpoint.
  for (std::uint32_t bits = 0; bits < 0x10000; ++bits) {
    Imath::half h;
    h.setBits(static_cast<unsigned short>(bits));
    const float value = static_cast<float>(h);
    ASSERT_TRUE(same(value)) << bits;
    Imath::half next;
    next.setBits(static_cast<unsigned short>(bits + 1));
    const float middle = value + 0.5f * (static_cast<float>(next) - value);
    for (const float near : {middle, std::nextafter(middle, 1e30f), std::nextafter(middle, -1e30f)})
      ASSERT_TRUE(same(near)) << bits << ": " << near;
  }
  for (const float value : {65519.0f, 65520.0f, 1e10f, -1e10f, std::numeric_limits<float>::infinity(), 1e-30f})
    EXPECT_TRUE(same(value)) << value;
}

TEST(SubpixelBits, PutVerticesOnTheirGridWithinHalfAStep) {
  const Capture capture = shipped("eggs");
  const scene::Assembly assembly = scene::assemble(capture);
  for (const int bits : {4, 5, 8}) {
    Machine machine;
    machine.set("tessellator.subpixel_bits=" + std::to_string(bits));
    const auto frame = scene::pose_frame(assembly, frame_camera(capture, machine.settings, 96, 54),
                                         frame_request(capture, machine.gpu, machine.settings, 96, 54, 14));
    const auto fine =
        scene::pose_frame(assembly, frame_camera(capture, {}, 96, 54), frame_request(capture, {}, {}, 96, 54, 14));
    tilecore::Tessellator tessellator;
    tilecore::MicroMesh mesh, finest;
    const float step = std::ldexp(1.0f, -bits);
    std::size_t seen = 0, off_coarser = 0;
    for (std::uint32_t patch = 0; patch < 60; ++patch) {
      tessellator.tessellate(*frame, patch, scene::patch_cells(*frame, patch), {true, true}, mesh);
      tessellator.tessellate(*fine, patch, scene::patch_cells(*fine, patch), {true, true}, finest);
      for (std::size_t v = 0; v < mesh.vertex_count; ++v) {
        if (mesh.projected[v] == 0) continue;
        ++seen;
        ASSERT_EQ(mesh.x0[v], std::nearbyint(mesh.x0[v] / step) * step);
        ASSERT_LE(std::abs(mesh.x0[v] - finest.x0[v]), 0.5f * step + 1.0f / 512);
        off_coarser += mesh.x0[v] != std::nearbyint(mesh.x0[v] / (2 * step)) * (2 * step) ? 1 : 0;
      }
    }
    EXPECT_GT(seen, 100u);
    EXPECT_GT(off_coarser, 0u) << "the twin: a grid of one bit less does not hold them";
  }
}

// Bounds and culling know the grid: however sub-patches are bounded, cut, culled and binned, the image is the same.
TEST(SubpixelBits, LeaveTheImageIndependentOfBoundsAndTiles) {
  for (const char* name : {"eggs", "flyby"}) {
    const Capture capture = shipped(name);
    const int number = capture.settings.first_frame;
    const auto with = [](const char* bits) { return Machine().set(std::string("tessellator.subpixel_bits=") + bits); };
    const std::vector<float> expected = with("4").image(capture, number);
    EXPECT_EQ(with("4")
                  .set("frontend.bound_method=aabb")
                  .set("binner.coverage=rectangle")
                  .set("binner.time_intervals=false")
                  .image(capture, number),
              expected)
        << name;
    EXPECT_EQ(with("4")
                  .set("tile.width=8")
                  .set("tile.height=8")
                  .set("frontend.backface_culling=false")
                  .image(capture, number),
              expected)
        << name;
    EXPECT_EQ(with("4").set("frontend.split_pixels=8").image(capture, number), expected) << name;
    EXPECT_NE(with("8").image(capture, number), expected) << "the bits do something";
  }
}

TEST(DisplacementBias, AddsToTheLevelAndNeverGoesBelowTheFirst) {
  const Capture capture = shipped("eggs");
  const scene::Assembly assembly = scene::assemble(capture);
  const auto levels = [&](const char* bias) {
    Machine machine;
    machine.set(std::string("tessellation.displacement_bias=") + bias);
    return scene::pose_frame(assembly, frame_camera(capture, machine.settings, 96, 54),
                             frame_request(capture, machine.gpu, machine.settings, 96, 54, 14))
        ->displacement_lod;
  };
  const std::vector<float> plain = levels("0"), more = levels("1.5"), less = levels("-1");
  std::size_t displaced = 0;
  for (std::size_t p = 0; p < plain.size(); ++p) {
    if (more[p] == 0) continue;  // not displaced
    ++displaced;
    EXPECT_FLOAT_EQ(more[p], plain[p] + 1.5f);
    EXPECT_FLOAT_EQ(less[p], std::max(plain[p] - 1, 0.0f));
  }
  EXPECT_GT(displaced, 0u);
  Machine coarse;
  coarse.set("tessellation.displacement_bias=2");
  EXPECT_EQ(coarse.image(capture, 14), Machine(coarse).set("frontend.bound_method=interval").image(capture, 14))
      << "bounds know the level";
  EXPECT_NE(coarse.image(capture, 14), Machine().image(capture, 14));
}

TEST(HalfAttributes, ChangeColoursALittleAndVisibilityNotAtAll) {
  const Capture capture = shipped("serpent");
  const std::vector<float> plain = Machine().image(capture, 12),
                           half = Machine().set("shading.attributes=half").image(capture, 12);
  EXPECT_NE(plain, half);
  double sum = 0;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    if (i % 4 == 3) {
      EXPECT_EQ(plain[i], half[i]) << "coverage";
    }
    sum += std::abs(static_cast<double>(plain[i]) - static_cast<double>(half[i]));
  }
  EXPECT_LT(sum / static_cast<double>(plain.size()), 0.01);
}

}  // namespace
}  // namespace tessera::gpu::precision_test
