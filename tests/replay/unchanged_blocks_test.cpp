// Data that the resolve unit moves for the next frame: unchanged blocks, colours in the frame buffer's format, lines
// that tiles share, vertices of the previous frame.
#include "base/simd_targets.h"
#include "tests/replay/desampling_replays.h"
#include "tests/support/tests.h"
#include "tilecore/resolve/frame_compression.h"

namespace tessera::replay::unchanged_blocks_test {
namespace {

memory::Traffic history_of(const gpu::FrameResult& r) {
  return r.counters.ledger.traffic(memory::Unit::kResolve, memory::Purpose::kHistory);
}
memory::Traffic frame_buffer_of(const gpu::FrameResult& r) {
  return r.counters.ledger.traffic(memory::Unit::kResolve, memory::Purpose::kFrameBuffer);
}

// A wall that fills frames of 64x32 pixels, two tiles, at rest, or with a part that moves before it.
Capture wall(bool moving_part = false) {
  Capture capture;
  scene::Material material;
  material.unlit = material.double_sided = true;
  const int m = test::add_material(capture, material);
  const auto quad = [&](float side, float z) {
    return test::triangles({{-side, -side, z}, {side, -side, z}, {side, side, z}, {-side, side, z}}, {0, 1, 2, 0, 2, 3},
                           m);
  };
  test::add_node(capture, quad(40, 0));
  if (moving_part) test::add_motion(capture, test::add_node(capture, quad(1, 2)), {3, 0, 0});
  test::add_camera(capture, {0, 0, 10});
  return capture;
}
Machine small() {
  Machine m;
  m.request = {64, 32, {0, 0, 64, 32}};
  return m;
}
// The failing twin: all blocks are read and written.
Machine plain_form_of(Machine m) {
  m.settings.resolve.skip_unchanged = false;
  return m;
}

// Closed form. From the second frame with a history on nothing moves but a byte of each block, read and written, and the
// 16 bytes of its signature, read. The frame before writes signatures and nothing else that the plain form does not.
TEST(UnchangedBlocks, AWallAtRestMovesStatesAndSignaturesAlone) {
  constexpr std::uint64_t kBlocks = 16 * 8, kPixels = 64 * 32;
  for (const char* compression : {"none", "lossless"}) {
    const Machine machine = small().set(std::string("frame_buffer.compression=") + compression);
    const Capture capture = wall();
    const auto kept = machine.frames(capture, 0, 5), plain_form = plain_form_of(machine).frames(capture, 0, 5);
    for (std::size_t f = 0; f < 5; ++f) EXPECT_EQ(kept[f].targets.color.values, plain_form[f].targets.color.values);
    EXPECT_EQ(kept[1].counters.history.signatures_written, 16 * kBlocks);
    EXPECT_EQ(history_of(kept[1]).written_bytes, history_of(plain_form[1]).written_bytes + 16 * kBlocks);
    for (std::size_t f = 2; f < 5; ++f) {
      EXPECT_EQ(kept[f].counters.history.blocks_kept, kBlocks);
      EXPECT_EQ(frame_buffer_of(kept[f]).written_bytes, 0u);
      EXPECT_EQ(history_of(kept[f]).written_bytes, kBlocks);
      EXPECT_EQ(history_of(kept[f]).read_bytes, kBlocks + 16 * kBlocks);
      EXPECT_EQ(kept[f].counters.history.color_bytes, 0u);
      // The failing twin.
      EXPECT_GT(frame_buffer_of(plain_form[f]).written_bytes, 0u);
      EXPECT_GT(plain_form[f].counters.history.color_bytes, 0u);
      if (std::string(compression) == "none") {
        EXPECT_EQ(frame_buffer_of(plain_form[f]).written_bytes, 4 * kPixels);
        EXPECT_EQ(plain_form[f].counters.history.color_bytes, 4 * kPixels);
      }
    }
  }
}

// Whatever moves, whatever the tile, whoever renders a tile twice: the image equals the plain form's image.
TEST(UnchangedBlocks, ImagesEqualThePlainForms) {
  for (const std::vector<const char*>& sets : {std::vector<const char*>{},
                                               {"frame_buffer.compression=lossless"},
                                               {"frame_buffer.format=rgba8"},
                                               {"frame_buffer.format=rgb10a2", "frame_buffer.compression=lossless"},
                                               {"resolve.stencil_reach=neighbours"},
                                               {"frontend.previous_depth_culling=true"},
                                               {"frame_buffer.transaction_elimination=true"},
                                               {"tile.width=8"},
                                               {"resolve.foveation_r0=5", "resolve.foveation_r1=15"},
                                               {"memory.burst_bytes=32"}}) {
    const Capture moving = wall(true), vases = shipped("vases"), stroll = shipped("stroll");
    for (const auto& [capture, first] : {std::pair{&moving, 0}, {&vases, 0}, {&stroll, 20}}) {
      Machine kept = capture == &moving ? small() : Machine();
      for (const char* text : sets) kept.set(text);
      const auto got = kept.frames(*capture, first, first + 5),
                 expected = plain_form_of(kept).frames(*capture, first, first + 5);
      for (std::size_t f = 0; f < got.size(); ++f) {
        EXPECT_EQ(got[f].targets.color.values, expected[f].targets.color.values) << f;
        EXPECT_EQ(counters(got[f]).pixels_advected, counters(expected[f]).pixels_advected);
        EXPECT_EQ(got[f].counters.history.wrong_blocks, 0u);
        EXPECT_EQ(expected[f].counters.history.blocks_kept, 0u);
      }
    }
  }
}

// Where nothing is at rest there is nothing to sign: keeping costs nothing, to the byte.
TEST(UnchangedBlocks, CostNothingWhereTheCameraMoves) {
  const Capture capture = shipped("stroll");
  const auto kept = Machine().frames(capture, 20, 23), plain_form = plain_form_of({}).frames(capture, 20, 23);
  for (std::size_t f = 0; f < kept.size(); ++f)
    EXPECT_EQ(counters_json(kept[f].counters), counters_json(plain_form[f].counters));
}

// The failing twin of a signature: with four bits, the history differs from the shown image.
TEST(UnchangedBlocks, SignaturesOfFewBitsShowWrongBlocks) {
  const Capture capture = wall();
  Machine m;
  m.request = {320, 180, {0, 0, 320, 180}};
  const auto wrong = [&](const char* bits) {
    gpu::Device r = Machine(m).set(std::string("frame_buffer.signature_bits=") + bits).renderer(capture);
    for (int f = 0; f < 3; ++f) r.render(f);
    History spoilt = r.history();  // by less than a discrepancy needs
    test::Random random(9);
    for (Vec4& color : spoilt.color) color *= random.uniform(0.98f, 0.995f);
    r.set_history(spoilt);
    const gpu::FrameResult got = r.render(3);
    EXPECT_EQ(got.counters.desampling.blocks_discrepant, 0u);
    return got.counters.history.wrong_blocks;
  };
  EXPECT_EQ(wrong("64"), 0u);
  // A square of 4 bits: one block in 16 of 3600.
  EXPECT_GT(wrong("4"), 100u);
  EXPECT_LT(wrong("4"), 400u);
}

// ---- Colours ----------------------------------------------------------------------------------------------------

// Half floats, or 8 bits, instead of single precision between pixels: nothing at rest, little on the way.
TEST(HistoryColors, FromTheFrameBufferTheyCostNoWriteAndLittleError) {
  const Capture still = shipped("vases"), moving = shipped("stroll");
  Machine apart;
  apart.set("resolve.history_colors=apart");
  const auto still_apart = apart.frames(still, 0, 4), exact = apart.frames(moving, 20, 24),
             full = plain().frames(moving, 20, 24);
  const std::array<std::tuple<const char*, double, double>, 2> formats = {
      {{"frame_buffer.format=rgba16f", 2e-4, 1.02}, {"frame_buffer.format=rgba8", 8e-4, 1.1}}};
  for (const auto& [format, own, share] : formats) {
    const Machine here = Machine().set(format);
    const auto still_got = here.frames(still, 0, 4), got = plain_form_of(here).frames(moving, 20, 24);
    for (std::size_t f = 0; f < 4; ++f) {
      EXPECT_EQ(still_got[f].targets.color.values, still_apart[f].targets.color.values);
      EXPECT_EQ(history_of(exact[f]).written_bytes, history_of(got[f]).written_bytes + 160 * 90 * 16);
      EXPECT_LT(rmse(got[f].targets.color, exact[f].targets.color), own) << format;
      EXPECT_LT(rmse(got[f].targets.color, full[f].targets.color),
                share * rmse(exact[f].targets.color, full[f].targets.color) + 1e-6)
          << format;
    }
    EXPECT_NE(got[3].targets.color.values, exact[3].targets.color.values);
    EXPECT_GT(exact[3].counters.history.color_bytes, 3 * got[3].counters.history.color_bytes / 2);
  }
}

TEST(HistoryColors, AreReadCompressedFromACompressedFrameBuffer) {
  const Capture capture = shipped("stroll");
  const auto raw = Machine().set("frame_buffer.compression=none").frames(capture, 20, 23),
             packed = Machine().frames(capture, 20, 23);
  for (std::size_t f = 1; f < 3; ++f) {
    EXPECT_EQ(raw[f].targets.color.values, packed[f].targets.color.values);
    EXPECT_LT(packed[f].counters.history.color_bytes, raw[f].counters.history.color_bytes);
  }
}

// ---- The L2 -----------------------------------------------------------------------------------------------------

TEST(HistoryL2, TilesShareLinesAndNothingElseChanges) {
  const Capture capture = shipped("stroll");
  Machine shared, alone;
  alone.set("l2.bytes=0");
  for (Machine* m : {&shared, &alone}) m->request = {320, 180, {0, 0, 320, 180}};
  const auto with = shared.frames(capture, 20, 23), without = alone.frames(capture, 20, 23);
  for (std::size_t f = 0; f < with.size(); ++f) {
    EXPECT_EQ(with[f].targets.color.values, without[f].targets.color.values);
    const auto& asked = without[f].counters.history;
    EXPECT_EQ(history_of(without[f]).read_bytes,
              asked.color_bytes + asked.record_bytes + asked.state_bytes + asked.signature_bytes);
    EXPECT_EQ(with[f].counters.history.color_bytes, asked.color_bytes);
    if (f > 0) {
      EXPECT_LT(history_of(with[f]).read_bytes, 0.9 * static_cast<double>(history_of(without[f]).read_bytes));
    }
  }
}

// ---- Vertices of the frame before -------------------------------------------------------------------------------

// A shape that fills a frame of 8x8 pixels and deforms by weights. `grid`: a Bezier patch, else a triangle.
Capture deforming(bool grid, bool deforms) {
  Capture capture;
  scene::Primitive shape = grid ? test::patches(test::flat_patch({-30, -30, 0}, {60, 0, 0}, {0, 60, 0}))
                                : test::triangles({{-90, -60, 0}, {90, -60, 0}, {0, 120, 0}}, {0, 1, 2});
  shape.vertices.morph_targets.emplace_back();
  shape.vertices.morph_targets[0].positions.assign(shape.vertices.positions.size(), Vec3(0.02f, 0, 0));
  shape.vertices.morph_targets[0].positions[0] = Vec3(0.03f, 0.01f, 0);
  const int node = test::add_node(capture, shape);
  test::add_camera(capture, {0, 0, 6});
  if (!deforms) {
    test::add_motion(capture, node, {0.02, 0, 0});
    return capture;
  }
  test::add_morph(capture, node);
  return capture;
}

// Bytes besides the bytes that the history's counters count.
std::uint64_t vertex_bytes(const Capture& capture, int side, int burst) {
  Machine m;
  m.request = {side, side, {0, 0, side, side}};
  m.gpu.tile.width = m.gpu.tile.height = 8;
  m.gpu.memory.burst_bytes = burst;
  m.set("l2.bytes=0");
  const gpu::FrameResult got = std::move(m.frames(capture, 4, 6)[1]);
  EXPECT_GT(counters(got).velocity_operations, 0u);
  const auto& asked = got.counters.history;
  return history_of(got).read_bytes - asked.color_bytes - asked.record_bytes - asked.state_bytes -
         asked.signature_bytes;
}

// Closed form: three vertices of 12 bytes, or sixteen control points, once for a tile that sees nothing else.
TEST(PreviousVertices, AreChargedOnceForEachThatATileSees) {
  for (const int burst : {16, 32, 64}) {
    const auto in_bursts = [&](std::uint64_t bytes) {
      const auto b = static_cast<std::uint64_t>(burst);
      return (bytes + b - 1) / b * b;
    };
    EXPECT_EQ(vertex_bytes(deforming(false, true), 8, burst), in_bursts(3 * 12));
    EXPECT_EQ(vertex_bytes(deforming(true, true), 8, burst), in_bursts(16 * 12));
    EXPECT_EQ(vertex_bytes(deforming(false, true), 16, burst), 4 * in_bursts(3 * 12));
    // The failing twin: a matrix says where the points of a rigid one were.
    EXPECT_EQ(vertex_bytes(deforming(false, false), 8, burst), 0u);
  }
}

}  // namespace
}  // namespace tessera::replay::unchanged_blocks_test
