// The machine's shadows beside the reference's shadows: errors of the filters at an edge.
#include "base/image_metrics.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "gpu/view_inputs.h"
#include "reference/reference_renderer.h"
#include "tests/support/shadow_scenes.h"
#include "tests/support/tests.h"

namespace tessera::reference::shadow_error_test {
namespace {

using scene::Capture;
using test::FloorScene;
using test::kFloorHalf;

constexpr int kSide = 256;

gpu::RunSettings settings_of(const std::vector<std::string>& keys, gpu::GpuConfiguration& gpu) {
  gpu::RunSettings settings;
  settings.output.machine_model = false;
  for (const std::string& key : keys) gpu::apply_setting(key, settings, gpu);
  return settings;
}

Image machine_image(const Capture& capture, const std::vector<std::string>& keys) {
  gpu::GpuConfiguration gpu;
  const gpu::RunSettings settings = settings_of(keys, gpu);
  return gpu::Device(capture, gpu, settings, {kSide, kSide, {0, 0, kSide, kSide}}).render(0).targets.color;
}

// By the machine's own samples, so that the shadow alone differs.
Image reference_image(const Capture& capture, const std::vector<std::string>& keys) {
  gpu::GpuConfiguration gpu;
  const gpu::RunSettings settings = settings_of(keys, gpu);
  return render_machines_samples(scene::assemble(capture), gpu, settings, kSide, kSide, 0);
}

// A floor under a sun at 45 degrees; the shadow of a card that is not in the image covers the floor left of x =
// `edge`.
Capture straight_edge(double edge, int size) {
  FloorScene scene;
  const double height = 6;
  test::add_node(scene.capture, test::rectangle({-40, -12}, {edge - height, 12}, scene.white), {0, height, 0});
  scene::made::add_light(scene.capture, {}, {0, 0, 0}, {1, -1, 0}, {.size = size});
  return scene.capture;
}

// The side of a texel on the floor, across the edge.
double texel_on_the_floor(int size) {
  const Capture capture = straight_edge(0, size);
  gpu::GpuConfiguration gpu;
  const gpu::RunSettings settings = settings_of({}, gpu);
  const scene::Assembly assembly = scene::assemble(capture);
  const auto frame = scene::pose_frame(assembly, gpu::frame_camera(capture, settings, kSide, kSide),
                                       gpu::frame_request(capture, gpu, settings, kSide, kSide, 0));
  const auto lights = scene::shadow_lights(*frame, settings.shadows);
  const scene::CameraChoice view = scene::light_views(*frame, lights, settings.shadows).front().front().camera;
  return 2 * static_cast<double>(view.camera.x_mag) / size * std::numbers::sqrt2;
}

// Mean of the squared error over all of an edge's places in a texel, of images in which the lit side has 1.
double mean_square_error(const std::string& filter, int size) {
  const std::vector<std::string> keys = {"shadows.filter=" + filter};
  const double lit =
      static_cast<double>(machine_image(straight_edge(0, size), {"effects.shadows=off"}).at(kSide - 1, kSide / 2)[0]);
  constexpr int kPlaces = 16;
  const double texel = texel_on_the_floor(size);
  double sum = 0;
  for (int k = 0; k < kPlaces; ++k) {
    const double edge = ((k + 0.5) / kPlaces - 0.5) * texel;
    const Capture capture = straight_edge(edge, size);
    const Image machine = machine_image(capture, keys), truth = reference_image(capture, keys);
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) {
        const double off = (static_cast<double>(machine.at(x, y)[0]) - static_cast<double>(truth.at(x, y)[0])) / lit;
        sum += off * off / (kPlaces * kSide * kSide);
      }
  }
  return sum;
}

// Known answer: an edge of length L along a texel axis has a mean squared error of c L s / A, with s the side of a texel
// and A the area of
// the image: 1/4 for the nearest texel, 1/6 for 2x2, 5/18 for 3x3. Texels are far larger than pixels, which average.
TEST(ShadowError, OfAStraightEdgeFollowsFromTheFilter) {
  const double area = 4 * kFloorHalf * kFloorHalf, length = 2 * kFloorHalf;
  std::map<std::pair<std::string, int>, double> errors;
  for (const auto& [filter, share] :
       std::initializer_list<std::pair<const char*, double>>{{"nearest", 1.0 / 4}, {"2x2", 1.0 / 6}, {"3x3", 5.0 / 18}})
    for (const int size : {16, 32}) {
      const double expected = share * length * texel_on_the_floor(size) / area, got = mean_square_error(filter, size);
      errors[{filter, size}] = got;
      EXPECT_NEAR(10 * std::log10(got / expected), 0.0, 0.3) << filter << " " << size;
    }
  EXPECT_NEAR(10 * std::log10(errors[{"nearest", 32}] / errors[{"2x2", 32}]), 1.76, 0.3);
  // 3 dB for texels of half the side. The border takes more of a smaller map, so its texels are more than twice as large.
  const double finer = 10 * std::log10(texel_on_the_floor(16) / texel_on_the_floor(32));
  for (const char* filter : {"nearest", "2x2", "3x3"})
    EXPECT_NEAR(10 * std::log10(errors[{filter, 16}] / errors[{filter, 32}]), finer, 0.3) << filter;
}

}  // namespace
}  // namespace tessera::reference::shadow_error_test
