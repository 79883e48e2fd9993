// The time left of a tradeoff: predicted times of its trials, and the rates at which they run.
#include "replay/tradeoff/work_clock.h"

#include "replay/tradeoff/trial.h"
#include "tests/support/tests.h"

namespace tessera::replay::work_clock_test {
namespace {

// A record of 33 s that 36 timings of 0.8 s follow: shares of expected work alone said 1164 s after the first of them.
TEST(WorkClock, TIL1EachKindGoesOnAtItsOwnRate) {
  WorkClock clock;
  EXPECT_FALSE(clock.seconds_left()) << "nothing is measured";
  clock.expect(WorkKind::kRecord, 1);
  clock.expect(WorkKind::kTiming, 36 * 0.1);
  clock.finish(WorkKind::kRecord, 1, 33);
  EXPECT_NEAR(*clock.seconds_left(), 36 * 3.3, 1e-9) << "timings have no rate yet: the record's rate counts";
  clock.finish(WorkKind::kTiming, 0.1, 0.8);
  EXPECT_NEAR(*clock.seconds_left(), 35 * 0.8, 1e-9);
  const double by_shares = (33 + 0.8) / (0.1 / 3.6) * (3.5 / 3.6);
  EXPECT_GT(by_shares, 1100) << "the twin";
  clock.expect(WorkKind::kRender, 2);
  EXPECT_NEAR(*clock.seconds_left(1), 35 * 0.8 + 3 * 33.8 / 1.1, 1e-9);
  for (int k = 0; k < 35; ++k) clock.finish(WorkKind::kTiming, 0.1, 0.8);
  clock.finish(WorkKind::kRender, 2, 5);
  EXPECT_NEAR(*clock.seconds_left(), 0, 1e-9);
  EXPECT_NEAR(clock.done(), 6.6, 1e-9);
}

// Everything that a run of trials is expected to do is told to the clock, records that trials share once.
TEST(WorkClock, IsToldOfAllThatTrialsDo) {
  PackedCaptures captures(test::shipped_capture("eggs"), {}, {}, ImageSize{32, 18});
  TrialPlace place;
  place.width = 32, place.height = 18, place.frame = 2, place.first_frame = 1, place.rounds = 2;
  std::vector<Trial> trials(4);
  trials[0].timed = trials[1].timed = true;
  trials[1].gpu.queues.model = hardware::TimingModel::kPhases;
  trials[2].settings.resolve.desampling = tilecore::Desampling::kAdaptive;
  WorkClock clock;
  std::set<std::string> records;
  for (Trial& trial : trials) {
    name_trial(trial, place);
    const TrialWork work = expected_work(trial, place);
    clock.expect(WorkKind::kRender, work.before);
    if (trial.timed && records.insert(record_name(trial)).second) clock.expect(WorkKind::kRecord, work.record);
    clock.expect(kind_of(trial), work.round * place.rounds);
  }
  EXPECT_EQ(records.size(), 1u);
  const double all = clock.left();
  FrameRecords kept;
  const Image black = Image(32, 18, 4);
  run_trials(captures, trials, place, &black, kept, clock);
  EXPECT_NEAR(clock.left(), 0, 1e-9);
  EXPECT_NEAR(clock.done(), all, 1e-9);
  EXPECT_GT(clock.done(), 0);
}

// Expected work says how host times compare, well enough for the time that is left.
TEST(TrialWork, AddsUpRoundsAndTheFramesBefore) {
  TrialPlace place;
  place.frame = 5;
  place.first_frame = 1;
  Trial plain{.settings = {}, .gpu = {}, .packing = {}};
  EXPECT_NEAR(all_work(plain, place), 3, 0.05) << "three rounds of four samples";
  Trial many = plain;
  many.settings.sampling.samples_per_pixel = 64;
  EXPECT_GT(all_work(many, place), 5 * all_work(plain, place));
  Trial adaptive = plain;
  adaptive.settings.resolve.desampling = tilecore::Desampling::kAdaptive;
  EXPECT_NEAR(all_work(adaptive, place), all_work(plain, place) + 2, 0.05) << "four untimed frames";
  TrialPlace first = place;
  first.first_frame = first.frame;
  EXPECT_EQ(all_work(adaptive, first), all_work(plain, first)) << "there are no frames before";
  Trial timed = plain;
  timed.timed = true;
  EXPECT_LT(all_work(timed, place), 0.5 * all_work(plain, place));
}

}  // namespace
}  // namespace tessera::replay::work_clock_test
