// A larger machine is not always better: the energy of a frame has its minimum inside the range of machines.
#include "gpu/device.h"
#include "gpu/machine_model.h"
#include "scene/capture_reader.h"
#include "tests/support/coarse_machine.h"
#include "tests/support/tests.h"

namespace tessera::gpu::energy_optimum_test {
namespace {

// A frame of eggs, recorded with its items.
class EnergyOptimum : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const scene::Capture capture = scene::read_capture(test::shipped_capture("eggs"));
    RenderRequest request{160, 90, {0, 0, 160, 90}};
    request.record_items = true;
    Device device(capture, {}, RunSettings(), request);
    work_ = new std::vector<timing::FrameWork>{std::move(device.render(3).model->record.work)};
  }
  static void TearDownTestSuite() {
    delete work_;
    work_ = nullptr;
  }
  // Shaders of few operations, so that caches show.
  static GpuConfiguration machine() {
    auto gpu = test::coarse_machine<GpuConfiguration>();
    gpu.queues.model = hardware::TimingModel::kEvents;
    return gpu;
  }
  // Energy of the frame with each value.
  static std::vector<double> energies(const std::vector<double>& values,
                                      const std::function<void(GpuConfiguration&, double)>& set) {
    std::vector<double> nj;
    for (const double value : values) {
      GpuConfiguration gpu = machine();
      set(gpu, value);
      nj.push_back(cycle_cost(gpu, *work_).energy_nj);
    }
    return nj;
  }
  static void expect_interior(const std::vector<double>& nj) {
    const auto least = std::min_element(nj.begin(), nj.end());
    EXPECT_LT(*least, 0.99 * nj.front());
    EXPECT_LT(*least, 0.99 * nj.back());
  }

  inline static std::vector<timing::FrameWork>* work_ = nullptr;
};

// Slow clocks leak for longer, fast ones need voltage.
TEST_F(EnergyOptimum, OfTheClockLiesInside) {
  std::vector<double> clocks;
  for (double mhz = 200; mhz <= 1200; mhz += 100) clocks.push_back(mhz);
  expect_interior(energies(clocks, [](GpuConfiguration& gpu, double mhz) { gpu.clock_mhz = mhz; }));
}

// Few lanes leak for longer, many leak more.
TEST_F(EnergyOptimum, OfTheLanesLiesInside) {
  expect_interior(energies({1, 2, 4, 8, 16, 32, 64, 128, 256, 512}, [](GpuConfiguration& gpu, double lanes) {
    gpu.shader.lanes = static_cast<std::int64_t>(lanes);
  }));
}

// Small caches ask the memory, large ones cost more with each access and leak.
TEST_F(EnergyOptimum, OfTheL2LiesInside) {
  std::vector<double> sizes;
  for (double bytes = 4096; bytes <= 64 << 20; bytes *= 4) sizes.push_back(bytes);
  expect_interior(energies(
      sizes, [](GpuConfiguration& gpu, double bytes) { gpu.caches.l2_bytes = static_cast<std::int64_t>(bytes); }));
}

TEST_F(EnergyOptimum, OfTheTextureCacheLiesInside) {
  std::vector<double> sizes;
  for (double bytes = 256; bytes <= 4 << 20; bytes *= 4) sizes.push_back(bytes);
  // Instructions take nine tenths of the frame's energy, the same with every cache: without them.
  expect_interior(energies(sizes, [](GpuConfiguration& gpu, double bytes) {
    gpu.caches.texture_bytes = static_cast<std::int64_t>(bytes);
    gpu.energy_pj[hardware::Event::kShaderClocks] = 0;
  }));
}

// Between time, silicon and energy there are many machines that no other beats, and they differ in all that was varied.
TEST_F(EnergyOptimum, MachinesThatNoneBeatsDifferInLanesCoresAndCaches) {
  struct Point {
    double us, mm2, nj;
    std::int64_t lanes, cores, l2;
  };
  std::vector<Point> points;
  for (const std::int64_t lanes : {8, 16, 32, 64})
    for (const std::int64_t cores : {1, 2, 4, 8})
      for (const std::int64_t l2 : {64 << 10, 256 << 10, 1024 << 10}) {
        GpuConfiguration gpu = machine();
        gpu.shader.lanes = lanes, gpu.cores.count = cores, gpu.caches.l2_bytes = l2;
        const CycleCost cost = cycle_cost(gpu, *work_);
        points.push_back({cost.cycles / gpu.clock_mhz, gpu.area().total_mm2(), cost.energy_nj, lanes, cores, l2});
      }
  const auto front = [&](double Point::*other) {
    std::vector<Point> best;
    for (const Point& p : points)
      if (std::none_of(points.begin(), points.end(), [&](const Point& q) {
            return q.us <= p.us && q.*other <= p.*other && (q.us < p.us || q.*other < p.*other);
          }))
        best.push_back(p);
    return best;
  };
  std::set<std::int64_t> lanes, cores, l2;
  for (const Point& p : front(&Point::mm2)) lanes.insert(p.lanes), cores.insert(p.cores), l2.insert(p.l2);
  EXPECT_GE(front(&Point::mm2).size(), 5u);
  EXPECT_LT(front(&Point::mm2).size(), points.size() * 3 / 4);
  EXPECT_GE(lanes.size(), 2u);
  EXPECT_GE(cores.size(), 2u);
  EXPECT_GE(l2.size(), 2u);
  EXPECT_GE(front(&Point::nj).size(), 2u);
}

}  // namespace
}  // namespace tessera::gpu::energy_optimum_test
