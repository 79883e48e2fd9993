// The history that one frame leaves to the next: saved and restored, its traffic, its readers.
#include "base/error.h"
#include "tests/replay/desampling_replays.h"
#include "tests/support/tests.h"

namespace tessera::replay::history_test {
namespace {

TEST(Desampling, AReplayGoesOnFromASavedHistoryAsIfItHadNotStopped) {
  const test::TemporaryFolder folder;
  const Capture capture = shipped("stroll");
  gpu::Device whole = Machine().renderer(capture);
  whole.render(20);
  whole.render(21);
  whole.history().save(folder / "history");
  const gpu::FrameResult expected = whole.render(22);
  gpu::Device resumed = Machine().renderer(capture);
  resumed.set_history(History::restore(folder / "history", 1 << 20));
  const gpu::FrameResult got = resumed.render(22);
  EXPECT_GT(counters(got).pixels_advected, 0u);
  EXPECT_EQ(got.targets.color.values, expected.targets.color.values);
  EXPECT_EQ(counters_json(got.counters), counters_json(expected.counters));
  Machine other;
  other.request = {80, 45, {0, 0, 80, 45}};
  gpu::Device smaller = other.renderer(capture);
  EXPECT_THROW(smaller.set_history(History::restore(folder / "history", 1 << 20)), UsageError);
  EXPECT_THROW(History::restore(folder / "history", 100), LimitError);
}

TEST(History, DamagedFilesAreRefusedAtEveryLength) {
  const test::TemporaryFolder folder;
  History history(IntRect{3, 2, 9, 7});
  history.frame = 5;
  history.save(folder / "h");
  EXPECT_EQ(History::restore(folder / "h", 100), history);
  const std::string bytes = test::read_text(folder / "h");
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    test::write_text(folder / "t", bytes.substr(0, n));
    EXPECT_THROW(History::restore(folder / "t", 100), InputError) << n;
  }
  for (const std::size_t at : {std::size_t{0}, std::size_t{7}, std::size_t{11}, std::size_t{19}}) {
    std::string broken = bytes;
    broken[at] = '\xff';
    test::write_text(folder / "t", broken);
    EXPECT_ANY_THROW(History::restore(folder / "t", 100)) << at;
  }
}

// With the counter's dither every pixel is rendered within two frames of advection: a short warm-up is nearly a long
// one.
TEST(Desampling, AWarmedUpReplayIsCloseToOneThatBeganEarlier) {
  const Capture capture = shipped("stroll");
  gpu::Device early = Machine().renderer(capture), late = Machine().renderer(capture);
  for (int f = 10; f < 20; ++f) early.render(f);
  for (int f = 16; f < 20; ++f) late.render(f);
  const gpu::FrameResult a = early.render(20), b = late.render(20), full = plain().renderer(capture).render(20);
  // Both are within 57 dB of full rate; which of them is closer goes with the frame's dither.
  for (const gpu::FrameResult* each : {&a, &b}) EXPECT_LT(rmse(each->targets.color, full.targets.color), 0.0014);
  EXPECT_LT(std::abs(rmse(a.targets.color, full.targets.color) - rmse(b.targets.color, full.targets.color)), 0.0003);
}

TEST(Desampling, HistoryTrafficIsInTheLedger) {
  const Capture capture = shipped("vases");
  const auto frames = Machine().frames(capture, 0, 2);
  const auto traffic = [&](std::size_t f) {
    return frames[f].counters.ledger.traffic(memory::Unit::kResolve, memory::Purpose::kHistory);
  };
  // A byte per block, and packed records where something is seen, in bursts; nothing to read before there is a history.
  EXPECT_EQ(traffic(0).read_bytes, 0u);
  EXPECT_EQ(traffic(0).written_bytes,
            frames[0].counters.history.records_written + frames[0].counters.history.states_written);
  EXPECT_GT(frames[0].counters.history.records_written, 40u * 23u);
  EXPECT_GE(frames[0].counters.history.states_written, 40u * 23u);
  EXPECT_LE(traffic(0).written_bytes, 160u * 90u * 6u);
  EXPECT_GT(traffic(1).read_bytes, counters(frames[1]).pixels_advected * 8u);
  EXPECT_LT(traffic(1).read_bytes, 160u * 90u * 12u);
  EXPECT_EQ(plain()
                .frames(capture, 0, 1)[0]
                .counters.ledger.traffic(memory::Unit::kResolve, memory::Purpose::kHistory)
                .written_bytes,
            0u);
}

// A record for every pixel would take 8 bytes of each.
TEST(Desampling, PackedRecordsTakeLessThanAQuarterOfPixelRecords) {
  Machine m;
  m.request = {640, 360, {0, 0, 640, 360}};
  for (const gpu::FrameResult& frame : m.frames(shipped("stroll"), 10, 13))
    EXPECT_LT(4 * frame.counters.history.records_written, 640u * 360u * History::kSurfaceBytes);
}

// RU6. Who does not advect reads no records; who knows no hysteresis either reads nothing at all.
TEST(Desampling, UnreadHistoryIsNeitherWrittenNorCharged) {
  const Capture capture = shipped("stroll");
  const auto third_frame = [&](std::initializer_list<const char*> settings) {
    Machine m;
    for (const char* text : settings) m.set(text);
    return std::move(m.frames(capture, 20, 23)[2]);
  };
  const auto history = [](const gpu::FrameResult& r) {
    return r.counters.ledger.traffic(memory::Unit::kResolve, memory::Purpose::kHistory);
  };
  constexpr std::uint64_t kPixels = 160 * 90, kBlocks = kPixels / 16;
  const gpu::FrameResult advecting = third_frame({}), still = third_frame({"resolve.advection=false"}),
                         slowest = third_frame({"resolve.reuse_speed=0"});
  EXPECT_GE(history(advecting).written_bytes, kBlocks * History::kBlockBytes);
  EXPECT_GT(advecting.counters.history.records_written, kBlocks);
  EXPECT_EQ(advecting.effect_reasons.at("history"), "kept for the advection of the next frame");
  for (const gpu::FrameResult* r : {&still, &slowest}) {  // a byte per block, in bursts
    for (const std::uint64_t bytes : {history(*r).written_bytes, history(*r).read_bytes})
      EXPECT_TRUE(bytes >= kBlocks && bytes < 2 * kPixels) << bytes;
    EXPECT_GT(counters(*r).velocity_operations, 0u);
    EXPECT_FALSE(r->effects.at("advection"));
  }
  EXPECT_EQ(still.effect_reasons.at("history"),
            "a byte per block for the hysteresis; no unit reads records of pixels: resolve.advection=false");
  EXPECT_EQ(slowest.effect_reasons.at("advection"), "resolve.reuse_speed is 0: nothing is slower");
  const gpu::FrameResult none =
      third_frame({"resolve.advection=false", "resolve.hysteresis=0", "resolve.pattern_error=0"});
  EXPECT_EQ(history(none).written_bytes + history(none).read_bytes, 0u);
  EXPECT_EQ(none.effect_reasons.at("history"), "not kept: resolve.advection=false");
  const gpu::FrameResult contrast = third_frame({"resolve.advection=false", "resolve.hysteresis=0"});
  EXPECT_GE(history(contrast).written_bytes, kBlocks * History::kContrastBytes);
  EXPECT_EQ(contrast.effect_reasons.at("history"),
            "a byte per block of contrast; no unit reads records of pixels: resolve.advection=false");
}

// A replay that goes on with other settings takes nothing from records that were not kept.
TEST(Desampling, AHistoryWithoutRecordsGivesNothingToAdvect) {
  const Capture capture = shipped("stroll");
  gpu::Device without = Machine().set("resolve.advection=false").renderer(capture), with = Machine().renderer(capture);
  for (gpu::Device* r : {&without, &with}) r->render(20), r->render(21);
  const auto goes_on = [&](const History& history) {
    gpu::Device r = Machine().renderer(capture);
    r.set_history(history);
    return counters(r.render(22)).pixels_advected;
  };
  EXPECT_EQ(goes_on(without.history()), 0u);
  EXPECT_GT(goes_on(with.history()), 1000u);
}

// The right eye reads the left one's records, whether that advects or not.
TEST(Desampling, TheLeftEyeKeepsItsRecordsForTheRightOneAlone) {
  const Capture capture = shipped("vases");
  Machine m;
  m.set("resolve.advection=false")
      .set("resolve.hysteresis=0")
      .set("resolve.pattern_error=0")
      .set("stereo.eye_separation=0.06")
      .set("stereo.far_depth=0");
  const gpu::FrameResult got = m.renderer(capture).render(0);
  const auto history = [](const gpu::FrameCounters& c) {
    return c.ledger.traffic(memory::Unit::kResolve, memory::Purpose::kHistory);
  };
  EXPECT_GT(got.right->counters.desampling.pixels_advected, 2000u);
  EXPECT_EQ(got.effect_reasons.at("history"), "kept for the right eye");
  // got.counters is of both eyes.
  EXPECT_EQ(history(got.right->counters).written_bytes, 0u);
  EXPECT_GT(got.counters.history.records_written, 40u * 23u);
  EXPECT_EQ(history(got.counters).written_bytes, got.counters.history.records_written);
}

}  // namespace
}  // namespace tessera::replay::history_test
