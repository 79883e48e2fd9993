// A machine with twice of anything is not slower: every number that timing reads, on all captures, both models of memory and
// both costs of shaders.
#include "base/parallel.h"
#include "gpu/device.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"
#include "timing/events/event_model.h"

namespace tessera::gpu::more_is_not_slower_test {
namespace {

struct MoreMachine {
  std::string key;
  GpuConfiguration gpu;
};

// Work and time that a machine has less of when it is faster.
bool less_is_faster(std::string_view key) {
  return key.find("latency") != key.npos || (key.starts_with("shader.") && key.ends_with("operations")) ||
         key == "shader.registers";
}

bool leaves_cycles(std::string_view key) {
  return key.starts_with("energy.") || key.starts_with("area.") || key.starts_with("voltage.") ||
         key == "memory.pj_per_bit" || key == "clock.mhz";
}

// The machine with twice of each number, where it may be so.
std::vector<MoreMachine> machines_with_twice(const GpuConfiguration& gpu) {
  std::vector<MoreMachine> machines;
  for (const auto& key : gpu_keys().keys()) {
    const bool cache = key.name.starts_with("l2.") || key.name.starts_with("texture.cache_");
    const KeyValue value = key.get(gpu);
    if ((!key.timing && !cache) || leaves_cycles(key.name)) continue;
    const double factor = less_is_faster(key.name) ? 0.5 : 2;
    MoreMachine more{std::string(key.name), gpu};
    if (const auto* whole = std::get_if<std::int64_t>(&value))
      key.set(more.gpu, std::clamp(static_cast<std::int64_t>(static_cast<double>(*whole) * factor),
                                   static_cast<std::int64_t>(key.min), static_cast<std::int64_t>(key.max)));
    else if (const auto* number = std::get_if<double>(&value))
      key.set(more.gpu, std::clamp(*number * factor, key.min, key.max));
    else
      continue;
    machines.push_back(std::move(more));
  }
  return machines;
}

// Cycles of a frame, and those until a core has done its last tile, the mean over the cores.
struct Ends {
  double frame = 0, cores = 0;
};
Ends ends_of(const GpuConfiguration& gpu, const timing::FrameWork& work) {
  const timing::Schedule schedule = timing::simulate_events(gpu, work).schedule;
  return {schedule.cycles, schedule.cycles - timing::imbalance(gpu, schedule)};
}

class MoreIsNotSlower : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const scene::Capture capture = scene::read_capture(test::shipped_capture(GetParam()));
    RenderRequest request{640, 360, {0, 0, 640, 360}};
    request.record_items = true;
    Device device(capture, {}, RunSettings(), request);
    work_ = std::move(device.render(5).model->record.work);
  }
  // Calls `check` with the name of the doubled part and the times of the machine without and with it.
  template <class Check>
  void with_twice(std::int64_t cores, const Check& check) {
    for (const auto memory : {hardware::MemoryModel::kFluid, hardware::MemoryModel::kBanks})
      for (const auto costs : {hardware::ShaderCosts::kConstant, hardware::ShaderCosts::kCompiled}) {
        GpuConfiguration gpu;
        gpu.cores.count = cores;
        gpu.queues.model = hardware::TimingModel::kEvents;
        gpu.memory.model = memory;
        gpu.shader.costs = costs;
        const Ends plain = ends_of(gpu, work_);
        const std::vector<MoreMachine> machines = machines_with_twice(gpu);
        EXPECT_GT(machines.size(), 40u);
        std::vector<Ends> ends(machines.size());
        parallel_for(machines.size(), [&](std::size_t m) { ends[m] = ends_of(machines[m].gpu, work_); });
        for (std::size_t m = 0; m < machines.size(); ++m)
          check(fmt::format("{}, {}, {}", machines[m].key, word(memory), word(costs)), plain, ends[m]);
      }
  }

  timing::FrameWork work_;
};

// One core takes the tiles in their order, whatever the machine: less work in it takes no longer.
TEST_P(MoreIsNotSlower, OnOneCore) {
  with_twice(1, [](const std::string& what, const Ends& plain, const Ends& more) {
    EXPECT_LE(more.frame, 1.005 * plain.frame) << what;
  });
}

// Several cores take other tiles than before, as each asks for one when it has room; so the last of them may end later
// although all have less to do (Graham 1969: anomalies of list scheduling). On the mean they end at the same time.
TEST_P(MoreIsNotSlower, OnFourCores) {
  with_twice(4, [](const std::string& what, const Ends& plain, const Ends& more) {
    EXPECT_LE(more.frame, 1.02 * plain.frame) << what;
    EXPECT_LE(more.cores, 1.01 * plain.cores) << what;
  });
}

INSTANTIATE_TEST_SUITE_P(Captures, MoreIsNotSlower,
                         testing::Values("city", "eggs", "flyby", "garden", "serpent", "stroll", "vases", "workshop"),
                         [](const auto& capture) { return std::string(capture.param); });

}  // namespace
}  // namespace tessera::gpu::more_is_not_slower_test
