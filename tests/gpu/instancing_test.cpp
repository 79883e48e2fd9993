// Instances on the machine: the images of a node for each, with less read.
#include "gpu/counter_list.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "tests/support/instances.h"
#include "tests/support/tests.h"

namespace tessera::gpu::instancing_test {
namespace {

constexpr int kWidth = 96, kHeight = 54;

// Frames 0 and 1, of one device.
std::vector<FrameResult> render(const scene::Capture& capture, const std::vector<std::string>& keys,
                                bool record = false) {
  RunSettings settings;
  GpuConfiguration gpu;
  for (const std::string& key : keys) apply_setting(key, settings, gpu);
  RenderRequest request{kWidth, kHeight, {0, 0, kWidth, kHeight}};
  request.auxiliary = true;
  request.record_accesses = record;
  Device device(capture, gpu, settings, request);
  std::vector<FrameResult> frames;
  frames.push_back(device.render(0));
  frames.push_back(device.render(1));
  return frames;
}

// Counters that differ where instances are dropped, or their records read.
const std::set<std::string_view> kOfCulling = {"frontend.base_patches",
                                               "frontend.bounds_computed",
                                               "frontend.cells",
                                               "frontend.culled_frustum",
                                               "frontend.cells_culled_frustum",
                                               "frontend.instances",
                                               "frontend.instances_culled",
                                               "frontend.instance_groups_tested",
                                               "frontend.instances_tested",
                                               "frontend.table_lines",  // by blocks of those patches
                                               "frontend.record_lines",
                                               "frontend.record_misses",
                                               "l2.requests",
                                               "l2.attribute_requests",
                                               "l2.misses",
                                               "dram.read_bytes"};

TEST(InstancedImages, EqualANodeForEachInstance) {
  const std::vector<std::vector<std::string>> ways = {
      {}, {"frontend.previous_depth_culling=true"}, {"parameter_buffer.bytes=4096"}, {"shading.rate=cache"}};
  Random random(1);
  for (int trial = 0; trial < 16; ++trial) {
    const scene::Capture capture = test::random_instanced_scene(random, 40, trial % 2 == 0 ? 1.5f : 8.0f),
                         nodes = test::with_node_per_instance(capture);
    const auto& keys = ways[static_cast<std::size_t>(trial) % ways.size()];
    const std::vector<FrameResult> of_instances = render(capture, keys), of_nodes = render(nodes, keys);
    for (std::size_t f = 0; f < 2; ++f) {
      const FrameResult &a = of_instances[f], &b = of_nodes[f];
      EXPECT_EQ(a.targets.color.values, b.targets.color.values) << trial;
      EXPECT_EQ(a.targets.depth.values, b.targets.depth.values) << trial;
      EXPECT_EQ(a.targets.patch.values, b.targets.patch.values) << trial;
      auto of_a = counter_values(a.counters);
      EXPECT_GT(of_a["frontend.instances"], 0u);
      EXPECT_GT(of_a["tilecore.sample_hits"], 0u);
      // The front end does not defer patches of nodes that the previous frame hides.
      if (f > 0 && keys == ways[1]) continue;
      for (const auto& [name, value] : counter_values(b.counters))
        if (!kOfCulling.contains(name)) {
          EXPECT_EQ(of_a[name], value) << name;
        }
    }
  }
}

TEST(InstancedImages, CountersOfInstancesAreAbsentWithoutThem) {
  Random random(2);
  const scene::Capture nodes = test::with_node_per_instance(test::random_instanced_scene(random, 5, 1.0f));
  for (const auto& [name, value] : counter_values(render(nodes, {})[0].counters))
    EXPECT_EQ(name.find("instance"), std::string_view::npos) << name;
}

// The records of a mesh lie in memory once, whoever reads them.
TEST(InstancedMemory, InstancesReadTheSameAddresses) {
  Random random(3);
  const scene::Capture capture = test::random_instanced_scene(random, 40, 1.5f),
                       nodes = test::with_node_per_instance(capture);
  const auto extent = [](const FrameResult& frame) {
    std::uint64_t end = 0;
    for (const auto& round : frame.model->record.accesses) {
      const auto look = [&](const std::vector<memory::Access>& accesses) {
        for (const memory::Access& access : accesses)
          if (access.purpose == memory::Purpose::kPatchData) end = std::max(end, access.offset + access.bytes);
      };
      look(round.geometry);
      for (const auto& tile : round.tiles) look(tile);
    }
    return end;
  };
  const FrameResult a = std::move(render(capture, {}, true)[0]), b = std::move(render(nodes, {}, true)[0]);
  EXPECT_LT(extent(a) * 5, extent(b));
  // Every byte of the front end is in the log, and boxes of instances take time.
  std::uint64_t logged = 0;
  for (const memory::Access& access : a.model->record.accesses[0].geometry)
    if (access.unit == memory::Unit::kFrontend && access.purpose == memory::Purpose::kPatchData) logged += access.bytes;
  EXPECT_EQ(logged, a.counters.ledger.traffic(memory::Unit::kFrontend, memory::Purpose::kPatchData).read_bytes);
  const auto values = counter_values(a.counters);
  EXPECT_EQ(a.model->record.work.rounds[0].geometry.events[hardware::Event::kBounds],
            values.at("frontend.bounds_computed") + values.at("frontend.instance_groups_tested") +
                values.at("frontend.instances_tested"));
}

}  // namespace
}  // namespace tessera::gpu::instancing_test
