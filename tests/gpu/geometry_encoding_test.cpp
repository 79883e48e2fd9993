// geometry.encoding: its effect on memory, decoders and images.
#include "base/error.h"
#include "gpu/device.h"
#include "gpu/prepared_capture.h"
#include "gpu/settings.h"
#include "gpu/unread_keys.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"

namespace tessera::gpu::geometry_encoding_test {
namespace {

using hardware::Event;
using memory::Purpose;
using memory::Unit;

constexpr const char *kQuantised = "geometry.encoding=quantised", *kMeshlet = "geometry.encoding=meshlet",
                     *kDgf = "geometry.encoding=dgf";

FrameResult rendered(const scene::Capture& capture, std::vector<const char*> settings, int frame = 3) {
  GpuConfiguration gpu;
  RunSettings run;
  for (const char* setting : settings) apply_setting(setting, run, gpu);
  return Device(capture, gpu, run, {160, 90, {0, 0, 160, 90}}).render(frame);
}

std::uint64_t in_tiles(const FrameResult& r, Event event) {
  std::uint64_t sum = 0;
  for (const timing::WorkRound& round : r.model->record.work.rounds)
    for (const timing::TileWork& tile : round.tiles) sum += tile.events[event];
  return sum;
}
std::uint64_t before_tiles(const FrameResult& r, Event event) {
  std::uint64_t sum = 0;
  for (const timing::WorkRound& round : r.model->record.work.rounds) sum += round.geometry.events[event];
  return sum;
}

std::uint64_t records_read(const FrameResult& r) {
  const memory::Ledger& ledger = r.counters.ledger;
  return ledger.traffic(Unit::kFrontend, Purpose::kPatchData).read_bytes +
         ledger.traffic(Unit::kTilecore, Purpose::kPatchData).read_bytes +
         ledger.traffic(Unit::kTilecore, Purpose::kAttributes).read_bytes;
}

double clipped_psnr(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.values.size(); ++k) {
    const auto clip = [](float x) { return std::clamp(static_cast<double>(x), 0.0, 1.0); };
    const double d = clip(a.values[k]) - clip(b.values[k]);
    sum += d * d;
  }
  return sum == 0 ? 99 : -10 * std::log10(sum / static_cast<double>(a.values.size()));
}

scene::Capture mesh_capture() {
  scene::Capture capture;
  scene::Primitive mesh = test::wavy_grid(60, 1);
  for (Vec3& p : mesh.vertices.positions) p = (p - Vec3(30, 30, 0)) * (1.0f / 30);
  test::add_node(capture, std::move(mesh));
  test::add_camera(capture, {0, 0, 2});
  return capture;
}

TEST(GeometryEncoding, RawDecodesNothingAndMeshletsPayTheirDecoder) {
  const scene::Capture capture = mesh_capture();
  const FrameResult raw = rendered(capture, {}, 0), meshlet = rendered(capture, {kMeshlet}, 0),
                    free = rendered(capture, {kMeshlet, "energy.decoded_element_pj=0"}, 0);
  for (const Event event : {Event::kDecodedForBounds, Event::kDecodedElements, Event::kDecodedForShading}) {
    EXPECT_EQ(in_tiles(raw, event) + before_tiles(raw, event), 0u);
    // Clusters are bounded by records of their own.
    EXPECT_EQ(in_tiles(meshlet, event) + before_tiles(meshlet, event) > 0, event != Event::kDecodedForBounds);
  }
  EXPECT_LT(records_read(meshlet), records_read(raw));
  const double decoded =
      static_cast<double>(in_tiles(meshlet, Event::kDecodedElements) + in_tiles(meshlet, Event::kDecodedForShading));
  EXPECT_NEAR(meshlet.model->energy.by_unit_nj.at("tessellator"),
              free.model->energy.by_unit_nj.at("tessellator") + decoded * 5e-3, 1e-3);
  EXPECT_LT(meshlet.model->energy.by_unit_nj.at("dram"), raw.model->energy.by_unit_nj.at("dram"));
}

// Vertices on the borders of blocks are decoded for each block.
TEST(GeometryEncoding, BlocksOfDgfPayForTheVerticesThatTheyShare) {
  const scene::Capture capture = mesh_capture();
  const FrameResult raw = rendered(capture, {}, 0), meshlet = rendered(capture, {kMeshlet}, 0),
                    dgf = rendered(capture, {kDgf}, 0),
                    free = rendered(capture, {kDgf, "energy.decoded_element_pj=0"}, 0);
  EXPECT_LT(records_read(dgf), records_read(raw));
  EXPECT_GT(in_tiles(dgf, Event::kDecodedElements), in_tiles(meshlet, Event::kDecodedElements));
  const double decoded =
      static_cast<double>(in_tiles(dgf, Event::kDecodedElements) + in_tiles(dgf, Event::kDecodedForShading));
  EXPECT_NEAR(dgf.model->energy.by_unit_nj.at("tessellator"),
              free.model->energy.by_unit_nj.at("tessellator") + decoded * 5e-3, 1e-3);
  // The same places in the same clusters.
  EXPECT_GE(clipped_psnr(dgf.targets.color, meshlet.targets.color), 45.0);
}

TEST(GeometryEncoding, ASlowDecoderTakesTime) {
  const scene::Capture capture = mesh_capture();
  const char* const kSlow = "tessellator.decoded_per_clk=0.01";
  for (const char* timing : {"machine.timing=events", "machine.timing=phases"}) {
    const double fast = rendered(capture, {kMeshlet, timing}, 0).model->timing.cycles,
                 slow = rendered(capture, {kMeshlet, timing, kSlow}, 0).model->timing.cycles;
    EXPECT_GT(slow, fast) << timing;
  }
  const scene::Capture eggs = scene::read_capture(test::shipped_capture("eggs"));
  const FrameResult fast = rendered(eggs, {kQuantised}),
                    slow = rendered(eggs, {kQuantised, "frontend.decoded_per_clk=0.01"});
  EXPECT_GT(fast.counters.frontend.elements_decoded, 0u);
  EXPECT_EQ(fast.counters.frontend.elements_decoded % 16, 0u);
  EXPECT_EQ(before_tiles(fast, Event::kDecodedForBounds), fast.counters.frontend.elements_decoded);
  EXPECT_GE(slow.model->timing.cycles, 100.0 * static_cast<double>(fast.counters.frontend.elements_decoded));
}

TEST(GeometryEncoding, DecodersTakeSiliconWhereTheyAre) {
  GpuConfiguration gpu;
  const double raw = gpu.area().total_mm2();
  gpu.silicon_mm2[hardware::Silicon::kDecoder] = 1;
  EXPECT_EQ(gpu.area().total_mm2(), raw);
  gpu.geometry.encoding = scene::GeometryEncoding::kMeshlet;
  gpu.silicon_mm2[hardware::Silicon::kDecoder] = 0;
  EXPECT_EQ(gpu.area().total_mm2(), raw);
  gpu.silicon_mm2[hardware::Silicon::kDecoder] = 1;
  EXPECT_NEAR(gpu.area().total_mm2(),
              raw + gpu.rates[Event::kDecodedForBounds] +
                  gpu.rates[Event::kDecodedElements] * static_cast<double>(gpu.cores.count),
              1e-9);
}

TEST(GeometryEncoding, BitsOfRawGeometryAreRefused) {
  GpuConfiguration gpu;
  RunSettings run;
  apply_setting("geometry.bits=12", run, gpu);
  EXPECT_THROW(check_gpu(gpu), UsageError);
  apply_setting(kQuantised, run, gpu);
  check_gpu(gpu);
}

class EncodedCaptures : public testing::TestWithParam<const char*> {};

// 16 bits move nothing by more than a fraction of a pixel; 8 bits do. All encodings have the same lattice.
TEST_P(EncodedCaptures, SixteenBitsAreNearTheFloatsAndEncodingsAgree) {
  const scene::Capture capture = scene::read_capture(test::shipped_capture(GetParam()));
  const FrameResult raw = rendered(capture, {}), quantised = rendered(capture, {kQuantised}),
                    meshlet = rendered(capture, {kMeshlet}), dgf = rendered(capture, {kDgf}),
                    coarse = rendered(capture, {kQuantised, "geometry.bits=8"});
  EXPECT_GE(clipped_psnr(quantised.targets.color, raw.targets.color), 45.0);
  EXPECT_GE(clipped_psnr(meshlet.targets.color, raw.targets.color), 45.0);
  EXPECT_GE(clipped_psnr(dgf.targets.color, raw.targets.color), 45.0);
  EXPECT_LT(clipped_psnr(coarse.targets.color, raw.targets.color),
            clipped_psnr(quantised.targets.color, raw.targets.color));
  EXPECT_LT(records_read(quantised), records_read(raw));
  EXPECT_LT(records_read(meshlet), records_read(quantised));
  EXPECT_LT(records_read(dgf), records_read(raw));
  EXPECT_GE(records_read(dgf), records_read(meshlet));
}
INSTANTIATE_TEST_SUITE_P(Shipped, EncodedCaptures, testing::Values("eggs", "city"));

TEST(GeometryEncoding, PreparedScenesOfAllEncodingsShareOneCapture) {
  const scene::Capture capture = mesh_capture();
  const PreparedCapture prepared(capture);
  const scene::TextureSettings textures;
  const PreparedScene &meshlet = prepared.scene(textures, {scene::GeometryEncoding::kMeshlet, 16}),
                      &raw = prepared.scene(textures),
                      &again = prepared.scene(textures, {scene::GeometryEncoding::kRaw, 9});
  EXPECT_EQ(&raw, &again) << "bits of floats say nothing";
  EXPECT_NE(&raw, &meshlet);
  EXPECT_TRUE(raw.assembly.held_clusters.empty());
  EXPECT_FALSE(meshlet.assembly.held_clusters.empty());
  EXPECT_EQ(&prepared.scene(textures, {scene::GeometryEncoding::kMeshlet, 16}), &meshlet);
}

}  // namespace
}  // namespace tessera::gpu::geometry_encoding_test
