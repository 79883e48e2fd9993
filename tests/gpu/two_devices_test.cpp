// Devices share nothing that changes: through the library's public interface, as a program with several would.
#include <gtest/gtest.h>

#include <tessera/tessera.h>

#include <thread>
#include <vector>

namespace {

struct Work {
  tessera::Gpu gpu;
  tessera::Settings settings;
};

// Two machines that have little in common, and one that looks at the frame before.
std::vector<Work> all_work() {
  std::vector<Work> work(3);
  work[0].gpu = tessera::Gpu("small");
  work[1].gpu = tessera::Gpu("large").set("tilecore.visibility_method", "patch-bvh").set("tile.height", 32);
  work[1].settings.set("shading.rate", "sample").set("sampling.samples_per_pixel", 9);
  work[2].settings.set("resolve.desampling", "adaptive").set("output.exposure", 0.5);
  return work;
}

std::vector<tessera::Frame> render(const tessera::Scene& scene, const Work& work) {
  tessera::RenderOptions options;
  options.width = 160;
  options.height = 90;
  tessera::Device device(scene, work.gpu, work.settings, options);
  std::vector<tessera::Frame> frames;
  for (int frame = 12; frame < 15; ++frame) frames.push_back(device.render(frame));
  return frames;
}

template <class T>
std::vector<T> values(const tessera::ImageView<T>& image) {
  return {image.values.begin(), image.values.end()};
}

void expect_same(const tessera::Frame& a, const tessera::Frame& b) {
  EXPECT_EQ(values(a.image()), values(b.image()));
  EXPECT_EQ(values(a.display()), values(b.display()));
  EXPECT_EQ(a.counters(), b.counters());
  EXPECT_EQ(a.timing()->cycles, b.timing()->cycles);
  EXPECT_EQ(a.timing()->busy_cycles, b.timing()->busy_cycles);
  EXPECT_EQ(a.energy()->by_unit_nj, b.energy()->by_unit_nj);
  for (std::size_t m = 0; m < a.tile_maps().size(); ++m) {
    const tessera::TileMap &x = a.tile_maps()[m], &y = b.tile_maps()[m];
    for (int row = 0; row < x.rows; ++row)
      for (int column = 0; column < x.columns; ++column) ASSERT_EQ(x.at(column, row), y.at(column, row)) << x.name;
  }
}

TEST(Devices, InThreadsOfTheirOwnGiveTheSameFramesAsAlone) {
  const tessera::Scene scene(TESSERA_SOURCE_DIR "/captures/eggs.glb");
  const std::vector<Work> work = all_work();
  std::vector<std::vector<tessera::Frame>> alone, together(work.size());
  for (const Work& one : work) alone.push_back(render(scene, one));
  std::vector<std::thread> threads;
  for (std::size_t w = 0; w < work.size(); ++w) threads.emplace_back([&, w] { together[w] = render(scene, work[w]); });
  for (std::thread& thread : threads) thread.join();
  for (std::size_t w = 0; w < work.size(); ++w)
    for (std::size_t f = 0; f < alone[w].size(); ++f) expect_same(alone[w][f], together[w][f]);
  EXPECT_NE(alone[0][2].counters(), alone[1][2].counters());
  EXPECT_NE(alone[1][2].counters(), alone[2][2].counters());
}

}  // namespace
