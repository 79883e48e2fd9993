// Sums that must add up, and figures that follow from a definition: sizes of frame buffers and lists, tiles per
// frame, record ratios, memory rates, and on a small scene the ledger, work, cycles, energy and DRAM trace of one
// frame.
#include "frontend/front_end.h"
#include "gpu/configuration.h"
#include "gpu/device.h"
#include "hardware/external_memory.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"
#include "tilecore/resolve/multisample_resolve.h"
#include "tilecore/tessellation/tessellator.h"

namespace tessera::replay::identities_test {
namespace {

using memory::Purpose;
using memory::Unit;

struct Resolution {
  const char* name;
  int width, height;
  double rgba8_megabytes;                      // published
  std::uint64_t tiles_16, tiles_32, tiles_64;  // published
};
constexpr Resolution kResolutions[] = {{"1080p", 1920, 1080, 8.29, 8160, 2040, 510},
                                       {"1440p", 2560, 1440, 14.7, 14400, 3600, 920},
                                       {"4K", 3840, 2160, 33.2, 32400, 8160, 2040}};

// Bytes that the resolve unit writes when it resolves every tile of a frame.
std::uint64_t resolved_bytes(int width, int height, int side) {
  const binner::TileGrid grid(width, height, side, side);
  const std::vector<Vec3> color(static_cast<std::size_t>(side * side));
  const std::vector<float> coverage(color.size());
  Image target(width, height, 4);
  tilecore::ResolveCounters counters;
  memory::Ledger ledger;
  for (binner::TileIndex t = 0; t < grid.tile_count(); ++t)
    tilecore::resolve_multisample({color, coverage, 1, grid.pixels(t), {0, 0, width, height}, 64}, target, counters,
                                  ledger);
  return ledger.traffic(Unit::kResolve, Purpose::kFrameBuffer).written_bytes;
}

TEST(Identities, FramesHaveTheTilesAndBytesThatAreKnownOfThem) {
  for (const Resolution& r : kResolutions) {
    for (const auto& [side, tiles] : {std::pair{16, r.tiles_16}, {32, r.tiles_32}, {64, r.tiles_64}})
      EXPECT_EQ(binner::TileGrid(r.width, r.height, side, side).tile_count(), tiles) << r.name << " " << side;
    const std::uint64_t bytes = resolved_bytes(r.width, r.height, 32);
    EXPECT_NEAR(static_cast<double>(bytes) / tilecore::kFramePixelBytes * 4 / 1e6, r.rgba8_megabytes, 0.05) << r.name;
    EXPECT_EQ(bytes,
              static_cast<std::uint64_t>(r.width) * static_cast<std::uint64_t>(r.height) * tilecore::kFramePixelBytes)
        << r.name << ": no burst twice, none left out";
  }
  // Arm: keeping four layers of 1080p on chip saves up to 4 GB/s.
  EXPECT_NEAR(static_cast<double>(resolved_bytes(1920, 1080, 32)) / tilecore::kFramePixelBytes * 4 * 4 * 2 * 60 / 1e9,
              3.98, 0.005);
}

TEST(Identities, V3dListsAndTileStatesTakeTheBytesThatMesaReserves) {
  const std::uint64_t tiles = binner::TileGrid(1920, 1080, 64, 64).tile_count();
  EXPECT_EQ((tiles * 64 + 4095) / 4096 * 4096 + (8 << 10) + (512 << 10), 565248u);
  EXPECT_EQ(tiles * 256, 130560u);
}

// One flat patch in front of a camera, and something behind it.
scene::Capture small_scene() {
  scene::Capture capture;
  const auto add_patch = [&](float x, float y, float z, float side) {
    scene::Primitive primitive;
    primitive.kind = scene::Primitive::Kind::kBezierPatches;
    std::vector<Vec2> texcoords;
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) {
        const float u = static_cast<float>(i) / 3, v = static_cast<float>(j) / 3;
        primitive.vertices.positions.emplace_back(x + side * u, y + side * v, z + 0.3f * side * u * (1 - u));
        texcoords.emplace_back(u, v);
      }
    primitive.vertices.texcoords = {texcoords};
    capture.meshes.push_back({"", {primitive}, {}});
    scene::Node node;
    node.mesh = static_cast<int>(capture.meshes.size()) - 1;
    capture.nodes.push_back(node);
    capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
  };
  add_patch(-1, -1, 0, 1.6f);
  add_patch(-0.6f, -0.4f, -1, 2);
  capture.cameras.emplace_back();
  scene::Node eye;
  eye.camera = 0;
  eye.transform.translation = {0, 0, 3};
  capture.nodes.push_back(eye);
  capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
  return capture;
}

TEST(Identities, VerticesOfAPatchOutgrowItsRecordByTheSquareOfTheFactor) {
  constexpr double kVertexBytes = 32;
  const scene::Capture capture = small_scene();
  const scene::Assembly assembly = scene::assemble(capture);
  const auto frame = scene::pose_frame(assembly, scene::choose_camera(capture, 640, 360), {});
  tilecore::Tessellator tessellator;
  tilecore::MicroMesh mesh;
  // The control points, without the header that a triangle's state would have as well.
  const double record = 16 * sizeof(Vec3);
  for (const auto& [factor, ratio] : {std::pair{4, 4.0}, {8, 13.0}, {16, 48.0}, {32, 181.0}}) {
    const auto cells = static_cast<std::uint8_t>(factor);
    frame->patterns[0] = {cells, cells, {cells, cells, cells, cells}};
    const auto work = tessellator.tessellate(*frame, 0, {0, 0, cells, cells}, {}, mesh);
    EXPECT_NEAR(static_cast<double>(work.domain_evaluations) * kVertexBytes / record, ratio, 0.5) << factor;
  }
}

TEST(Identities, PresetsHaveTheirMemorysRateAndArmsPower) {
  for (const auto& [preset, rate] : {std::pair{"entry-mobile", 12.8}, {"mid-mobile", 34.1}, {"high-mobile", 68.3}}) {
    const gpu::GpuConfiguration gpu = gpu::load_gpu(preset);
    EXPECT_NEAR(gpu.memory.gb_per_s, rate, 0.05) << preset;
  }
  // 1 GB moved within a second, with nothing else going on: 100 mW.
  timing::FrameWork work;
  work.other_bytes = 1000000000;
  const double nj =
      hardware::frame_energy(gpu::load_gpu("mid-mobile"), timing::energy_events(work), 0, 0).by_unit_nj.at("dram");
  EXPECT_NEAR(nj * 1e-6, 100, 1e-9);
}

TEST(Identities, AFrameAddsUp) {
  const scene::Capture capture = small_scene();
  gpu::GpuConfiguration gpu;
  gpu.frame_buffer.compression = tilecore::FrameBufferCompression::kNone;
  const gpu::RunSettings settings;
  const gpu::RenderRequest request{.width = 320, .height = 180, .region = {0, 0, 320, 180}, .keep_transactions = true};
  gpu::Device renderer(capture, gpu, settings, request);
  const gpu::FrameResult result = renderer.render(0);
  const gpu::MachineModel& model = *result.model;
  const memory::Traffic total = result.counters.ledger.total();
  const std::uint64_t bytes = total.read_bytes + total.written_bytes;
  EXPECT_EQ(model.record.work.dram_bytes(), bytes);
  const timing::MemoryCounts& memory = model.timing.events->memory;
  EXPECT_EQ(model.transactions.size() * hardware::external_memory(gpu).transaction_bytes,
            memory.read_bytes + memory.written_bytes);
  EXPECT_EQ(result.counters.resolve.pixels_shaded, 320u * 180);
  EXPECT_EQ(result.counters.ledger.traffic(Unit::kResolve, Purpose::kFrameBuffer).written_bytes,
            320u * 180 * tilecore::kFramePixelBytes);
  double sum = 0;
  for (const auto& [unit, nj] : model.energy.by_unit_nj) sum += nj;
  EXPECT_EQ(model.energy.total_nj(), sum);
  EXPECT_LE(*std::max_element(model.timing.busy.begin(), model.timing.busy.end()), model.timing.cycles);
}

}  // namespace
}  // namespace tessera::replay::identities_test
