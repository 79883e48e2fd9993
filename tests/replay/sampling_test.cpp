// Samples and searches: the choice of points, and a search that finds the optimum of a grid.
#include "base/error.h"
#include "replay/sweep/goal.h"
#include "replay/sweep/points.h"
#include "replay/sweep/study.h"
#include "replay/sweep/unit_samples.h"
#include "tests/support/tests.h"

namespace tessera::replay::sampling_test {
namespace {

// How many of the strips [k/n, (k+1)/n) of a dimension hold exactly one of n points.
std::size_t strips_hit_once(const std::vector<std::vector<double>>& points, std::size_t dimension) {
  std::map<std::size_t, int> hits;
  const double n = static_cast<double>(points.size());
  for (const std::vector<double>& point : points) {
    std::size_t strip = static_cast<std::size_t>(point[dimension] * n);
    // The product may round over the border that the point lies before.
    if (point[dimension] < static_cast<double>(strip) / n) --strip;
    ++hits[strip];
  }
  return static_cast<std::size_t>(
      std::count_if(hits.begin(), hits.end(), [](const auto& strip) { return strip.second == 1; }));
}

// Invariant LH1, of many sizes and seeds; the broken twin are plain random numbers.
TEST(UnitSamples, ALatinHypercubeHitsEachStripOfEachAxisOnce) {
  for (const std::size_t count : {std::size_t{1}, std::size_t{2}, std::size_t{3}, std::size_t{7}, std::size_t{49},
                                  std::size_t{100}, std::size_t{1000}, std::size_t{4097}})
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      const auto points = unit_samples(SampleMethod::kLatinHypercube, count, 4, seed);
      ASSERT_EQ(points.size(), count);
      for (std::size_t d = 0; d < 4; ++d) {
        EXPECT_EQ(strips_hit_once(points, d), count) << count << " points, seed " << seed << ", axis " << d;
        for (const auto& point : points) EXPECT_TRUE(point[d] >= 0 && point[d] < 1);
      }
    }
  const auto random = unit_samples(SampleMethod::kRandom, 1000, 1, 0);
  EXPECT_NEAR(static_cast<double>(strips_hit_once(random, 0)) / 1000, std::exp(-1.0), 0.05) << "Poisson of mean 1";
}

TEST(UnitSamples, FollowFromTheSeedAndFromNothingElse) {
  for (const SampleMethod method : {SampleMethod::kRandom, SampleMethod::kLatinHypercube}) {
    EXPECT_EQ(unit_samples(method, 20, 3, 1), unit_samples(method, 20, 3, 1));
    EXPECT_NE(unit_samples(method, 20, 3, 1), unit_samples(method, 20, 3, 2));
  }
  // The first numbers of the paper's generator with seed 0.
  SeededNumbers numbers(0);
  EXPECT_EQ(numbers.whole(), 0xe220a8397b1dcdafu);
  EXPECT_EQ(numbers.whole(), 0x6e789e6aa1b965f4u);
}

// ---- Differential evolution -------------------------------------------------------------------------------------

constexpr double kNowhere = std::numeric_limits<double>::infinity();

TEST(Score, FeasibleComesBeforeGoodAndLessWrongBeforeMore) {
  const Score good{1, 0}, better{0, 0}, wrong{-5, 0.5}, worse{-9, 0.7}, nowhere{0, kNowhere};
  EXPECT_TRUE(better.better_than(good));
  EXPECT_TRUE(good.better_than(wrong));
  EXPECT_TRUE(wrong.better_than(worse));
  EXPECT_TRUE(worse.better_than(nowhere));
  for (const Score& score : {good, wrong, nowhere}) EXPECT_FALSE(score.better_than(score));
}

using Problem = Score (*)(const std::vector<double>&);

// The best score of a search of so many candidates.
Score searched(Problem problem, std::size_t dimensions, std::size_t population, std::size_t candidates,
               std::uint64_t seed) {
  DifferentialEvolution evolution(dimensions, population, seed);
  Score best{0, kNowhere};
  for (std::size_t done = 0; done < candidates; done += population) {
    std::vector<Score> scores;
    for (const std::vector<double>& at : evolution.ask()) scores.push_back(problem(at));
    for (const Score& score : scores)
      if (score.better_than(best)) best = score;
    evolution.tell(scores);
  }
  return best;
}

// A valley that is bent, with its minimum 0 at (0.75, 0.75): Rosenbrock's, over [-2, 2]^2 scaled.
Score valley(const std::vector<double>& at) {
  const double x = 4 * at[0] - 2, y = 4 * at[1] - 2;
  return {100 * std::pow(y - x * x, 2) + std::pow(1 - x, 2), 0};
}

// Problem G06 of Michalewicz and Schoenauer (1996): the feasible part is 0.007 % of the square; minimum -6961.81388.
Score needle(const std::vector<double>& at) {
  const double x = 13 + 87 * at[0], y = 100 * at[1];
  const double outside = 100 - std::pow(x - 5, 2) - std::pow(y - 5, 2);
  const double inside = std::pow(x - 6, 2) + std::pow(y - 5, 2) - 82.81;
  return {std::pow(x - 10, 3) + std::pow(y - 20, 3), std::max(outside, 0.0) + std::max(inside, 0.0)};
}

TEST(DifferentialEvolution, FindsKnownMinimaThatRandomPointsDoNot) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    EXPECT_LT(searched(valley, 2, 20, 4000, seed).objective, 1e-6) << seed;
    const Score best = searched(needle, 2, 20, 4000, seed);
    EXPECT_EQ(best.violation, 0) << seed;
    EXPECT_NEAR(best.objective, -6961.81388, 0.1) << seed;
    Score lucky{0, kNowhere};
    for (const auto& at : unit_samples(SampleMethod::kRandom, 4000, 2, seed))
      if (needle(at).better_than(lucky)) lucky = needle(at);
    EXPECT_TRUE(best.better_than(lucky));
    EXPECT_GT(lucky.violation > 0 ? 0 : lucky.objective, -6900) << "random points are not expected to be as good";
  }
}

// Invariants DE1, DE2 and DE3.
TEST(DifferentialEvolution, StaysInTheCubeNeverGetsWorseAndFollowsFromTheSeed) {
  DifferentialEvolution one(3, 8, 7), same(3, 8, 7), other(3, 8, 8);
  EXPECT_NE(one.ask(), other.ask());
  std::vector<Score> before;
  for (int generation = 0; generation < 60; ++generation) {
    EXPECT_EQ(one.ask(), same.ask());
    std::vector<Score> scores;
    for (const std::vector<double>& at : one.ask()) {
      for (const double coordinate : at) EXPECT_TRUE(coordinate >= 0 && coordinate < 1) << coordinate;
      // Best in a corner, so that mutants want out.
      scores.push_back({at[0] - at[1] + at[2], at[0] + at[1] < 0.1 ? kNowhere : 0});
    }
    one.tell(scores);
    same.tell(scores);
    for (std::size_t m = 0; m < before.size(); ++m) EXPECT_FALSE(before[m].better_than(one.scores()[m]));
    before.assign(one.scores().begin(), one.scores().end());
  }
}

// ---- Studies ----------------------------------------------------------------------------------------------------

json study_with(const json& members) {
  json study = {{"captures", {test::shipped_capture("vases").string()}}, {"size", "32x32"}};
  study.update(members);
  return study;
}

Study read(const test::TemporaryFolder& folder, const json& study) {
  test::write_text(folder / "study.json", study.dump());
  return read_study(folder / "study.json", 1000);
}

json range(const char* key, double from, double to, const char* scale = "linear") {
  return {{"key", key}, {"range", {{"from", from}, {"to", to}, {"scale", scale}}}};
}

TEST(SampledStudy, TakesEachStripOfEachAxisOnce) {
  const test::TemporaryFolder folder;
  constexpr std::size_t kPoints = 40;
  const Study study = read(folder, study_with({{"sample", {{"points", kPoints}, {"seed", 5}}},
                                               {"axes",
                                                {range("clock.mhz", 200, 1000),
                                                 range("texture.latency_clk", 2, 200, "log"),
                                                 range("shader.lanes", 1, 40),
                                                 {{"key", "tile.width"}, {"values", {8, 16, 32, 64}}}}}}));
  EXPECT_EQ(study.point_count, kPoints);
  const std::vector<SweepPoint> points = expand_points(study, "program");
  ASSERT_EQ(points.size(), kPoints);
  std::set<int> linear, logarithmic;
  std::map<int, int> whole, listed;
  for (const SweepPoint& point : points) {
    const std::vector<json> values = point_values(study, point);
    linear.insert(static_cast<int>((values[0].get<double>() - 200) / 800 * kPoints));
    logarithmic.insert(static_cast<int>(std::log10(values[1].get<double>() / 2) / 2 * kPoints));
    ++whole[values[2]];
    ++listed[values[3]];
  }
  EXPECT_EQ(linear.size(), kPoints);
  EXPECT_EQ(logarithmic.size(), kPoints);
  EXPECT_EQ(whole.size(), 40u) << "as many whole numbers as points: each once";
  EXPECT_EQ(listed, (std::map<int, int>{{8, 10}, {16, 10}, {32, 10}, {64, 10}}));
}

TEST(SampledStudy, AnotherSeedIsOtherPointsAndRandomIsAnotherMethod) {
  const test::TemporaryFolder folder;
  const auto hashes = [&](const json& sample) {
    std::set<std::string> out;
    for (const SweepPoint& point :
         expand_points(read(folder, study_with({{"sample", sample}, {"axes", {range("clock.mhz", 200, 1000)}}})), "p"))
      out.insert(point.hash);
    return out;
  };
  EXPECT_EQ(hashes({{"points", 9}}), hashes({{"points", 9}, {"seed", 0}, {"method", "latin_hypercube"}}));
  EXPECT_NE(hashes({{"points", 9}}), hashes({{"points", 9}, {"seed", 1}}));
  EXPECT_NE(hashes({{"points", 9}}), hashes({{"points", 9}, {"method", "random"}}));
}

TEST(SampledStudy, FaultsAreNamedByTheirPlace) {
  struct Broken {
    json members;
    const char* message;
  };
  const json axes = json::array({range("clock.mhz", 200, 1000)});
  const auto sample = [&](const json& value) { return json{{"sample", value}, {"axes", axes}}; };
  const auto goal = [&](json value) {
    value["points"] = 10;
    return json{{"goal", value}, {"axes", axes}};
  };
  const auto on = [](const json& axis) { return json{{"sample", {{"points", 3}}}, {"axes", {axis}}}; };
  const std::vector<Broken> studies = {
      {sample({{"point", 3}}), "/sample/point: unknown key 'point'; did you mean 'points'?"},
      {sample({{"seed", 3}}), "/sample: lacks 'points'"},
      {sample({{"points", 0}}), "/sample/points: is not a whole number from 1 on"},
      {sample({{"points", 2.5}}), "/sample/points: is not a whole number"},
      {sample({{"points", 3}, {"method", "sobol"}}), "/sample/method: is neither latin_hypercube nor random"},
      {sample({{"points", 3}, {"method", 4}}), "/sample/method: is neither"},
      {{{"sample", {{"points", 3}}}}, "/sample: a study without axes"},
      {{{"goal", {{"minimise", "timing.cycles"}, {"seed", 3}}}, {"axes", {{{"key", "tile.width"}, {"values", {16}}}}}},
       "/goal/seed: is of a search, which has 'points'"},
      {{{"goal", {{"minimise", "timing.cycles"}}}, {"axes", axes}}, "a range of any number is for studies with"},
      {goal({{"minimize", "timing.cycles"}}), "did you mean 'minimise'?"},
      {goal({}), "/goal: needs either 'minimise' or 'maximise'"},
      {goal({{"minimise", "timing.cycle"}}),
       "/goal/minimise: unknown key 'timing.cycle'; did you mean 'timing.cycles'?"},
      {goal({{"maximise", "timing.bound_by"}}), "/goal/maximise: 'timing.bound_by' is a text, not a number"},
      {goal({{"minimise", "timing.cycles"}, {"subject_to", {{"energy.total_nj", 3}}}}),
       "/goal/subject_to/energy.total_nj: is not an object"},
      {goal({{"minimise", "timing.cycles"}, {"subject_to", {{"energy.total_nj", json::object()}}}}),
       "/goal/subject_to/energy.total_nj: needs 'at_most', 'at_least' or both"},
      {goal({{"minimise", "timing.cycles"}, {"subject_to", {{"energy.total_nj", {{"at_most", 1}, {"at_least", 2}}}}}}),
       "leaves nothing between"},
      {goal({{"minimise", "timing.cycles"}, {"population", 3}}), "/goal/population: is not a whole number from 4 on"},
      {{{"goal", {{"minimise", "timing.cycles"}, {"points", 5}}}}, "/goal: there is nothing to choose without 'axes'"},
      {{{"goal", {{"minimise", "timing.cycles"}, {"points", 5}}}, {"sample", {{"points", 3}}}, {"axes", axes}},
       "either a 'sample' or a 'goal'"},
      {{{"axes", axes}}, "/axes/0/range: needs either 'step' or 'factor'; a range of any number is for studies with"},
      {on(range("clock.mhz", 200, 100)), "/axes/0/range: ends before it begins"},
      {on(range("clock.mhz", 200, 1000, "cubic")), "/axes/0/range/scale: is neither linear nor log"},
      {on(range("resolve.reuse_speed", 0, 1, "log")), "/axes/0/range: a logarithmic range begins above 0"},
      {on(range("shader.lanes", 1.5, 4)), "/axes/0/range: ends of a range of whole numbers are whole"},
      {on(range("tile.width", 8, 4000)), "/axes/0/range/to: tile.width: '4000'"},
      {on({{"key", "clock.mhz"}, {"range", {{"from", 1}, {"to", 2}, {"step", 1}, {"scale", "log"}}}}),
       "/axes/0/range/scale: is of ranges without 'step' and 'factor'"},
  };
  const test::TemporaryFolder folder;
  for (const Broken& broken : studies) {
    try {
      read(folder, study_with(broken.members));
      ADD_FAILURE() << "accepted " << broken.members;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(broken.message)) << broken.members;
    }
  }
  EXPECT_THROW(read(folder, study_with(sample({{"points", 1001}}))), LimitError);
  EXPECT_THROW(read(folder, study_with({{"goal", {{"minimise", "timing.cycles"}, {"points", 4e9}}}, {"axes", axes}})),
               InputError)
      << "no whole number";
  EXPECT_THROW(
      read(folder, study_with({{"goal", {{"minimise", "timing.cycles"}, {"points", 4000000000u}}}, {"axes", axes}})),
      LimitError);
}

// Values beside each other make a machine or not, whatever each is alone.
TEST(SampledStudy, AMultipleThatAMachineOfTheAxisCannotHaveIsAFault) {
  const test::TemporaryFolder folder;
  const auto points =
      expand_points(read(folder, study_with({{"axes",
                                              {{{"key", "gpu"}, {"values", {"mid-mobile", "entry-mobile"}}},
                                               {{"key", "tilecore.count"}, {"values", {"x1", "x0.5"}}}}}})),
                    "program");
  ASSERT_EQ(points.size(), 4u);
  for (const std::size_t p : {0u, 1u, 2u}) EXPECT_EQ(points[p].fault, "");
  std::set<std::string> hashes;
  for (const SweepPoint& point : points) hashes.insert(point.hash);
  EXPECT_EQ(hashes.size(), 4u) << "faults too";
  EXPECT_THAT(points[3].fault, HasSubstr("tilecore.count: x0.5 of 1 is 0.5, not a whole number"));
}

TEST(Goal, IsTheMeanOfTheFramesAndItsLimitsHoldForEach) {
  const auto frame = [](double cycles, double nj) {
    return json{{"counters", json::object()},
                {"dram", json::array()},
                {"timing", {{"cycles", cycles}}},
                {"energy", {{"total_nj", nj}}}};
  };
  Goal goal;
  goal.column = "energy.total_nj";
  goal.subject_to = {{"timing.cycles", 50, 200}};
  EXPECT_EQ(score_of(goal, std::vector{frame(100, 3), frame(200, 5)}).objective, 4);
  EXPECT_EQ(score_of(goal, std::vector{frame(100, 3), frame(200, 5)}).violation, 0);
  EXPECT_DOUBLE_EQ(score_of(goal, std::vector{frame(100, 3), frame(300, 5)}).violation, 0.5) << "the worst frame";
  EXPECT_DOUBLE_EQ(score_of(goal, std::vector{frame(40, 3), frame(200, 5)}).violation, 0.2);
  goal.maximise = true;
  EXPECT_EQ(score_of(goal, std::vector{frame(100, 3)}).objective, -3);
  EXPECT_EQ(score_of(goal, {}).violation, kNowhere);
  goal.column = "tilecore.triangles";
  EXPECT_EQ(score_of(goal, std::vector{frame(100, 3)}).violation, kNowhere) << "no frame says";
}

// ---- Searches ---------------------------------------------------------------------------------------------------

class Search : public testing::Test {
 protected:
  ProcessResult sweep(const std::string& name, const json& study, std::vector<std::string> more = {},
                      const test::ProcessLimits& limits = {}) {
    test::write_text(folder_ / (name + ".json"), study.dump());
    std::vector<std::string> arguments = {"sweep", (folder_ / (name + ".json")).string(), "--out",
                                          (folder_ / name).string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_tessera(arguments, limits);
  }
  std::map<std::string, std::string> contents(const std::string& out) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder_ / out))
      if (entry.is_regular_file())
        files[fs::relative(entry.path(), folder_ / out).string()] = test::read_text(entry.path());
    return files;
  }
  // "best: energy.total_nj 123 at" as a number.
  static double best_of(const std::string& said) {
    const std::size_t at = said.find("best: energy.total_nj ");
    EXPECT_NE(at, std::string::npos) << said;
    return at == std::string::npos ? kNowhere : std::stod(said.substr(at + 22));
  }
  test::TemporaryFolder folder_;
};

// 2 functions, 3 axes of timing: 2 * 11 * 8 * 8 machines, by the model that times each in a thousandth of a second.
json space() {
  const auto axis = [](const char* key, double from, double to, double step) {
    return json{{"key", key}, {"range", {{"from", from}, {"to", to}, {"step", step}}}};
  };
  return {{"captures", {test::shipped_capture("eggs").string()}},
          {"size", "64x36"},
          {"frames", "3:4"},
          {"columns", {"energy.total_nj", "timing.cycles"}},
          {"settings", {{"machine.timing", "phases"}, {"tessellator.domain_shading", "unit"}}},
          {"axes",
           {{{"keys", {"tile.width", "tile.height"}}, {"values", {16, 32}}},
            axis("clock.mhz", 200, 1000, 80),
            axis("tilecore.count", 1, 8, 1),
            axis("shader.lanes", 8, 64, 8)}}};
}

json searching(std::size_t points) {
  json study = space();
  study["goal"] = {{"minimise", "energy.total_nj"},
                   {"subject_to", {{"timing.cycles", {{"at_most", 15000}}}, {"area.total_mm2", {{"at_most", 6}}}}},
                   {"points", points}};
  return study;
}

// A search over a tenth of the grid's points lies within 1 % of the grid's best; two renders are enough for both.
TEST_F(Search, ATenthOfTheGridFindsItsBest) {
  const ProcessResult found = sweep("search", searching(140));
  ASSERT_EQ(found.status, 0) << found.errors;
  EXPECT_THAT(found.output, HasSubstr("140 points: 0 were there, 2 rendered and 138 timed from their records"));
  json grid = space();
  ASSERT_EQ(sweep("grid", grid, {"--quiet"}).status, 0);
  double best = kNowhere, all = 0, met = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "grid" / "points")) {
    if (entry.path().extension() != ".json") continue;
    const json frame = json::parse(test::read_text(entry.path()))["frames"][0];
    ++all;
    if (frame["timing"]["cycles"] > 15000 || frame["area"]["total_mm2"] > 6) continue;
    ++met;
    best = std::min(best, frame["energy"]["total_nj"].get<double>());
  }
  EXPECT_EQ(all, 2 * 11 * 8 * 8);
  EXPECT_LT(met, all * 0.9) << "limits that all meet are none";
  EXPECT_GT(met, 0);
  EXPECT_LE(best_of(found.output), best * 1.01);
  EXPECT_GE(best_of(found.output), best * 0.99999) << "no better than all of them";
}

// Invariants GS1 and GS2.
TEST_F(Search, KilledAndStartedAgainGivesTheSameBytes) {
  ASSERT_EQ(sweep("whole", searching(60), {"--quiet", "--threads", "3"}).status, 0);
  const ProcessResult killed =
      sweep("killed", searching(60), {"--quiet", "--threads", "1"}, {.kill_when = [&] {
              std::error_code ignored;
              std::size_t count = 0;
              for (const auto& entry : fs::directory_iterator(folder_ / "killed" / "points", ignored))
                count += entry.path().extension() == ".json" ? 1 : 0;
              return count >= 25;
            }});
  EXPECT_EQ(killed.signal, SIGKILL);
  const std::string said = sweep("killed", searching(60)).output;
  EXPECT_THAT(said, HasSubstr(", 0 rendered and ")) << "records of the killed run are there";
  EXPECT_EQ(contents("killed"), contents("whole"));
  json other = searching(60);
  other["goal"]["seed"] = 1;
  ASSERT_EQ(sweep("other", other, {"--quiet"}).status, 0);
  EXPECT_NE(contents("other")["sweep.csv"], contents("whole")["sweep.csv"]);
}

// A space of few points is searched until nothing new comes up; a point that no machine can have is never the best.
TEST_F(Search, EndsWhereThereIsNothingNew) {
  json study = searching(500);
  study["axes"] = {{{"keys", {"tile.width", "tile.height"}}, {"values", {16, 20, 32}}},
                   {{"key", "shader.lanes"}, {"values", {16, 32}}}};
  study["goal"].erase("subject_to");
  const ProcessResult done = sweep("few", study);
  ASSERT_EQ(done.status, 0) << done.errors;
  EXPECT_THAT(done.output, HasSubstr("6 points: "));
  EXPECT_THAT(done.output, HasSubstr("2 points have values that do not fit each other"));
  EXPECT_LT(best_of(done.output), kNowhere);
  study["goal"]["subject_to"] = {{"timing.cycles", {{"at_most", 1}}}};
  EXPECT_THAT(sweep("none", study).output, HasSubstr("best (none meets the limits): energy.total_nj "));
  const ProcessResult shard = sweep("few", study, {"--shard", "0/2"});
  EXPECT_EQ(shard.status, 2);
  EXPECT_THAT(shard.errors, HasSubstr("--jobs renders several points at once"));
  const ProcessResult dry = sweep("dry", searching(50), {"--dry-run"});
  EXPECT_THAT(dry.output, HasSubstr("at most 50 points: 0 are there, 2 to render and 48 to time"));
}

// Several captures: a candidate is a point of each, and good where their frames are good together.
TEST_F(Search, ACandidateIsAPointOfEachCapture) {
  json study = searching(12);
  study["captures"].push_back(test::shipped_capture("vases").string());
  study["goal"].erase("subject_to");
  study.erase("frames");
  const ProcessResult done = sweep("two", study);
  ASSERT_EQ(done.status, 0) << done.errors;
  EXPECT_THAT(done.output, HasSubstr("24 points: 0 were there, 4 rendered and 20 timed"));
  const json points = json::parse(test::read_text(folder_ / "two" / "sweep.json"))["points"];
  for (std::size_t p = 0; p < points.size(); p += 2) {
    EXPECT_EQ(points[p]["capture"], 0);
    EXPECT_EQ(points[p + 1]["capture"], 1);
    EXPECT_EQ(points[p]["values"], points[p + 1]["values"]);
  }
}

// A sample is split over shards and resumed as a grid is.
TEST_F(Search, ASampleIsShardedAndResumedLikeAGrid) {
  json study = space();
  study["sample"] = {{"points", 20}, {"seed", 2}};
  EXPECT_THAT(sweep("whole", study).output, HasSubstr("20 points: 0 were there, 2 rendered and 18 timed"));
  for (const char* shard : {"1/3", "0/3", "2/3"})
    ASSERT_EQ(sweep("shards", study, {"--quiet", "--shard", shard}).status, 0);
  ASSERT_EQ(run_tessera({"report", (folder_ / "shards").string()}).status, 0);
  EXPECT_EQ(contents("shards"), contents("whole"));
  EXPECT_THAT(sweep("whole", study).output, HasSubstr("20 points: 20 were there, 0 rendered and 0 timed"));
}

}  // namespace
}  // namespace tessera::replay::sampling_test
