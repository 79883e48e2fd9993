// shading.surface=interpolated: the same image however the machine is built, and near the evaluated one.
#include "gpu/device.h"
#include "gpu/settings.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"

namespace tessera::gpu::interpolated_surface_test {
namespace {

constexpr const char *kInterpolated = "shading.surface=interpolated", *kEvaluated = "shading.surface=evaluated",
                     *kFrame = "shading.surface=frame";

FrameResult rendered(const scene::Capture& capture, std::vector<const char*> settings) {
  GpuConfiguration gpu;
  RunSettings run;
  for (const char* setting : settings) apply_setting(setting, run, gpu);
  return Device(capture, gpu, run, {160, 90, {0, 0, 160, 90}}).render(3);
}

double clipped_psnr(const Image& a, const Image& b) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < a.values.size(); ++k) {
    const auto clip = [](float x) { return std::clamp(static_cast<double>(x), 0.0, 1.0); };
    const double d = clip(a.values[k]) - clip(b.values[k]);
    sum += d * d, ++count;
  }
  return sum == 0 ? 99 : -10 * std::log10(sum / static_cast<double>(count));
}

class InterpolatedSurface : public testing::TestWithParam<const char*> {};

TEST_P(InterpolatedSurface, HasTheSameBitsOnEveryMachine) {
  const scene::Capture capture = scene::read_capture(test::shipped_capture(GetParam()));
  const FrameResult usual = rendered(capture, {kInterpolated});
  EXPECT_GT(usual.counters.shading.vertex_outputs, 0u);
  for (const std::vector<const char*>& machine : {std::vector<const char*>{"tile.width=16", "tile.height=16"},
                                                  {"tile.width=64", "tile.height=64"},
                                                  {"tessellator.cache_bytes=0"},
                                                  {"frontend.split_depth=0"},
                                                  {"shader.warp_lanes=16"},
                                                  {"machine.timing=phases"}}) {
    std::vector<const char*> settings = machine;
    settings.push_back(kInterpolated);
    EXPECT_EQ(rendered(capture, settings).targets.color.values, usual.targets.color.values) << machine.front();
  }
}

TEST_P(InterpolatedSurface, IsNearTheEvaluatedOneAndNearerWithShorterEdges) {
  const scene::Capture capture = scene::read_capture(test::shipped_capture(GetParam()));
  const auto distance = [&](const char* edge) {
    return clipped_psnr(rendered(capture, {kInterpolated, edge}).targets.color,
                        rendered(capture, {kEvaluated, edge}).targets.color);
  };
  const double usual = distance("tessellation.target_edge_pixels=4"),
               fine = distance("tessellation.target_edge_pixels=1");
  std::printf("%s: %.1f dB at 4 pixels, %.1f at 1\n", GetParam(), usual, fine);
  EXPECT_GT(usual, 30);
  // Shorter edges show finer levels of a height map, which are as far from their triangles.
  const bool displaced = std::any_of(capture.materials.begin(), capture.materials.end(),
                                     [](const scene::Material& m) { return m.displacement.has_value(); });
  EXPECT_GT(fine, displaced ? 36 : usual + 3);
}

TEST_P(InterpolatedSurface, FrameLooksUpHeightsWhereThereAreSomeAndIsTheSameElsewhere) {
  const scene::Capture capture = scene::read_capture(test::shipped_capture(GetParam()));
  const bool displaced = std::any_of(capture.materials.begin(), capture.materials.end(),
                                     [](const scene::Material& m) { return m.displacement.has_value(); });
  const FrameResult plain = rendered(capture, {kInterpolated}), frame = rendered(capture, {kFrame});
  EXPECT_EQ(frame.counters.shading.surface_evaluations, 0u);
  EXPECT_EQ(frame.counters.shading.vertex_outputs, plain.counters.shading.vertex_outputs);
  EXPECT_EQ(frame.targets.color.values == plain.targets.color.values, !displaced);
  for (const char* machine : {"tile.width=16", "tessellator.cache_bytes=0", "shader.warp_lanes=16"})
    EXPECT_EQ(rendered(capture, {kFrame, machine}).targets.color.values, frame.targets.color.values) << machine;
  if (!displaced) return;
  EXPECT_GT(frame.counters.shading.height_lookups, plain.counters.shading.height_lookups);
  // The frame is nearer to evaluated short edges: it has the heights that patches of long edges lack.
  const FrameResult fine = rendered(capture, {kEvaluated, "tessellation.target_edge_pixels=0.75"});
  const double of_frame = clipped_psnr(frame.targets.color, fine.targets.color),
               of_plain = clipped_psnr(plain.targets.color, fine.targets.color);
  std::printf("%s: frame %.1f dB, interpolated %.1f dB\n", GetParam(), of_frame, of_plain);
  EXPECT_GT(of_frame, of_plain + (std::string_view(GetParam()) == "eggs" ? 2 : 0));
}

INSTANTIATE_TEST_SUITE_P(Captures, InterpolatedSurface, testing::Values("eggs", "vases", "city", "garden"),
                         [](const auto& capture) { return std::string(capture.param); });

// Rates, quads and desampling ask for invocations in other ways.
TEST(InterpolatedSurface, RatesQuadsAndDesamplingInterpolateAsWell) {
  const scene::Capture capture = scene::read_capture(test::shipped_capture("vases"));
  for (const std::vector<const char*>& how : {std::vector<const char*>{"shading.rate=sample"},
                                              {"shading.rate=primitive"},
                                              {"shading.derivatives=quad"},
                                              {"shading.rate=cache"},
                                              {"shading.attributes=half"},
                                              {"stereo.eye_separation=0.06"}}) {
    std::vector<const char*> settings = how;
    settings.push_back(kEvaluated);
    const FrameResult evaluated = rendered(capture, settings);
    settings.back() = kInterpolated;
    const FrameResult interpolated = rendered(capture, settings);
    EXPECT_EQ(interpolated.counters.shading.surface_evaluations, 0u) << how.front();
    EXPECT_GT(interpolated.counters.shading.vertex_outputs, 0u) << how.front();
    EXPECT_GT(clipped_psnr(interpolated.targets.color, evaluated.targets.color), 30) << how.front();
  }
}

// Procedures that are drawn as patches; sampled ones have no vertices.
TEST(InterpolatedSurface, ProceduresDrawnAsPatchesInterpolateOnEveryMachine) {
  const scene::Capture capture = scene::read_capture(test::shipped_capture("workshop"));
  constexpr const char* kPatches = "procedures.path=tessellated";
  const FrameResult usual = rendered(capture, {kInterpolated, kPatches}),
                    evaluated = rendered(capture, {kEvaluated, kPatches}), sampled = rendered(capture, {kInterpolated});
  EXPECT_EQ(usual.counters.shading.surface_evaluations, 0u);
  EXPECT_GT(usual.counters.shading.vertex_outputs, 0u);
  EXPECT_EQ(sampled.counters.shading.vertex_outputs, 0u);
  EXPECT_GT(clipped_psnr(usual.targets.color, evaluated.targets.color), 30);
  EXPECT_EQ(rendered(capture, {kFrame, kPatches}).targets.color.values, usual.targets.color.values);
  for (const char* machine : {"tile.width=16", "tessellator.cache_bytes=0", "shader.warp_lanes=16"})
    EXPECT_EQ(rendered(capture, {kInterpolated, kPatches, machine}).targets.color.values, usual.targets.color.values)
        << machine;
}

}  // namespace
}  // namespace tessera::gpu::interpolated_surface_test
