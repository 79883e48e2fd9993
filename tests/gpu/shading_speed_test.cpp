// The kernel against its scalar twin in one run: a ratio, never a time.
#include "base/simd_targets.h"
#include "bench/support/invocations.h"
#include "bench/support/timing.h"
#include "tests/support/tests.h"

namespace tessera::tilecore::shading_speed_test {
namespace {

double ratio_to_alone(const std::string& capture) {
  const bench::CaptureInvocations of(TESSERA_SOURCE_DIR "/captures/" + capture + ".glb", 1 << 13);
  std::vector<ShadedPoint> points(of.invocations.size());
  PixelShader shader;
  std::vector<double> ratios;
  for (int round = 0; round < 9; ++round) {
    const double begin = bench::now();
    for (int again = 0; again < 4; ++again) shader.shade(*of.frame, of.lighting, of.invocations, points);
    const double middle = bench::now();
    for (const Invocation& v : of.invocations) points[0] = shade_point(*of.frame, of.lighting, v);
    ratios.push_back((middle - begin) / 4 / (bench::now() - middle));
  }
  return bench::median(ratios);
}

TEST(ShadingSpeed, LanesTakeAThirdOfTheScalarTwinsTime) {
  if (simd_target_name() != "AVX2" && simd_target_name() != "AVX3") GTEST_SKIP() << "no wide vectors on this machine";
  for (const char* capture : {"eggs", "stroll"}) {
    const double ratio = ratio_to_alone(capture);
    RecordProperty(capture, std::to_string(ratio));
    EXPECT_LT(ratio, 0.33) << capture;
  }
}

}  // namespace
}  // namespace tessera::tilecore::shading_speed_test
