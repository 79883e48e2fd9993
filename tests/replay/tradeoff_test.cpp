// `tessera tradeoff`: fronts, words, points, knobs, and the command as a whole.
#include "replay/tradeoff/tradeoff.h"
#include "base/error.h"
#include "gpu/view_inputs.h"
#include "replay/sweep/columns.h"
#include "replay/tradeoff/combination_search.h"
#include "replay/tradeoff/decisions.h"
#include "replay/tradeoff/tradeoff_files.h"
#include "replay/tradeoff/trial.h"
#include "replay/tradeoff/trial_file.h"
#include "scene/capture_reader.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/tests.h"

namespace tessera::replay::tradeoff_test {
namespace {

// ---- Fronts -----------------------------------------------------------------------------------------------------

bool beats(const ErrorAndCost& b, const ErrorAndCost& a) {
  return b.error <= a.error && b.cost <= a.cost && (b.error < a.error || b.cost < a.cost);
}

TEST(ParetoFront, HoldsTheUnbeatenPoints) {  // TO2
  test::Random random(3);
  for (int round = 0; round < 50; ++round) {
    std::vector<ErrorAndCost> points;
    for (int k = 0; k < 12; ++k)
      points.push_back({static_cast<double>(random.integer(0, 5)), static_cast<double>(random.integer(0, 5))});
    const std::vector<bool> front = pareto_front(points);
    EXPECT_TRUE(std::any_of(front.begin(), front.end(), [](bool on) { return on; }));
    for (std::size_t a = 0; a < points.size(); ++a) {
      // On the front: none beats it. Off it: one of the front does.
      const bool beaten =
          std::any_of(points.begin(), points.end(), [&](const ErrorAndCost& b) { return beats(b, points[a]); });
      EXPECT_EQ(front[a], !beaten);
      bool by_front = false;
      for (std::size_t b = 0; b < points.size(); ++b) by_front = by_front || (front[b] && beats(points[b], points[a]));
      EXPECT_EQ(!front[a], by_front);
    }
  }
  EXPECT_EQ(pareto_front({{1, 1}, {1, 1}}), (std::vector<bool>{true, true})) << "equal points do not beat each other";
}

SettingResult setting(const char* label, double flip, double psnr_db, std::uint64_t cycles, bool in_double = false) {
  SettingResult out;
  out.label = label;
  out.in_double = in_double;
  out.measured.error = ImageError{psnr_db, 0.9, flip, flip};
  out.measured.image_sha256 = label;
  out.measured.cycles = cycles;
  out.measured.ms = static_cast<double>(cycles);  // a thousand a second
  out.measured.dram_bytes = 1;
  out.measured.energy_nj = 1.0;
  out.measured.wall_seconds = out.measured.processor_seconds = {1, 1, 1};
  return out;
}

KnobResult random_knob(test::Random& random) {
  KnobResult knob;
  for (int s = 0; s < 9; ++s) {
    const std::string label = std::to_string(s);
    SettingResult& one = knob.settings.emplace_back(setting(label.c_str(), 0.1 * random.integer(0, 4), 30, 0));
    const auto cost = [&] { return static_cast<std::uint64_t>(random.integer(0, 4)); };
    one.measured.ms = static_cast<double>(cost());
    one.measured.dram_bytes = cost();
    one.measured.energy_nj = static_cast<double>(cost());
    one.measured.wall_seconds.median = static_cast<double>(cost());
    one.measured.processor_seconds.median = static_cast<double>(cost());
    if (random.integer(0, 5) == 0) one.measured.ms.reset();
  }
  return knob;
}

// Settings whose membership of a front breaks TO2: a setting that is beaten and on it, or beaten by none and off it,
// or judged by a cost that it does not have.
int front_violations(const KnobResult& knob) {
  int violations = 0;
  for (const Cost cost : kCosts)
    for (const SettingResult& a : knob.settings) {
      const auto cost_a = cost_of(a.measured, cost);
      const bool beaten =
          cost_a && std::any_of(knob.settings.begin(), knob.settings.end(), [&](const SettingResult& b) {
            const auto cost_b = cost_of(b.measured, cost);
            return cost_b && beats({b.measured.error->flip, *cost_b}, {a.measured.error->flip, *cost_a});
          });
      const std::optional<bool> on_front = a.on_front(cost);
      const bool right = cost_a ? on_front.has_value() && *on_front != beaten : !on_front.has_value();
      violations += right ? 0 : 1;
    }
  return violations;
}

TEST(Judge, PutsUnbeatenSettingsOnEveryFront) {  // TO2
  test::Random random(5);
  int broken = 0;
  for (int round = 0; round < 50; ++round) {
    KnobResult knob = random_knob(random);
    judge(knob);
    EXPECT_EQ(front_violations(knob), 0) << round;
    // The failing twin: the cheapest setting is taken for the front, whatever its error.
    for (const Cost cost : kCosts) {
      std::optional<double> least;
      for (const SettingResult& s : knob.settings)
        if (const auto value = cost_of(s.measured, cost); value && (!least || *value < *least)) least = value;
      for (SettingResult& s : knob.settings)
        if (const auto value = cost_of(s.measured, cost)) s.front[static_cast<std::size_t>(cost)] = *value == *least;
    }
    broken += front_violations(knob) > 0 ? 1 : 0;
  }
  EXPECT_GT(broken, 40);
}

TEST(Judge, AKnobIsIdleWhenAllSettingsGiveTheSameImageForTheSameWork) {
  KnobResult knob;
  for (const char* label : {"a", "b", "c"}) {
    SettingResult& one = knob.settings.emplace_back(setting(label, 0.1, 30, 100));
    one.measured.image_sha256 = "image";
    one.measured.watched = Figure{std::uint64_t{7}};
  }
  knob.settings[1].measured.wall_seconds.median = 5;  // hosts differ
  judge(knob);
  EXPECT_TRUE(knob.idle);
  EXPECT_TRUE(knob.settings[2].same_image);
  const auto differs = [&](const auto& change) {
    KnobResult other = knob;
    change(other.settings[2].measured);
    judge(other);
    return !other.idle;
  };
  EXPECT_TRUE(differs([](Measurement& m) { m.image_sha256 = "another"; }));
  EXPECT_TRUE(differs([](Measurement& m) { m.cycles = 101; }));
  EXPECT_TRUE(differs([](Measurement& m) { m.dram_bytes.reset(); }));
  EXPECT_TRUE(differs([](Measurement& m) { m.energy_nj = 1.5; }));
  EXPECT_TRUE(differs([](Measurement& m) { m.watched = Figure{std::uint64_t{8}}; }));
  KnobResult skipped;
  judge(skipped);
  EXPECT_FALSE(skipped.idle) << "a knob that was not turned is left out, not idle";
}

TEST(Measurement, TakesTheFiguresOfATrial) {
  TrialResult trial;
  trial.host = {{4, 1, 2}, {3, 1}};
  Measurement none = measurement_of(trial, "tilecore.triangles", 850);
  EXPECT_FALSE(none.cycles || none.dram_bytes || none.energy_nj || none.watched) << "nothing was run on the machine";
  EXPECT_EQ(none.wall_seconds.median, 2);
  EXPECT_EQ(none.wall_seconds.low, 1);
  EXPECT_EQ(none.wall_seconds.high, 4);
  EXPECT_EQ(none.processor_seconds.median, 2) << "of two, their mean";
  trial.figures = {{"timing.cycles", std::uint64_t{9}}, {"dram.written_bytes", std::uint64_t{64}}};
  Measurement some = measurement_of(trial, "tilecore.triangles", 850);
  EXPECT_EQ(some.cycles, 9u);
  EXPECT_EQ(some.ms, 9 / 850e3);
  EXPECT_EQ(some.dram_bytes, 64u) << "nothing was read";
  EXPECT_EQ(some.watched, Figure{std::uint64_t{0}}) << "a figure that is 0 is left out of a trial";
  EXPECT_FALSE(measurement_of(trial, "", 850).watched);
}

TEST(Cheapest, IsTheLeastCostAmongAcceptableSettings) {
  KnobResult a, b;
  a.name = "a";
  a.settings = {setting("bad", 0.2, 20, 10), setting("good", 0.04, 32, 50), setting("best", 0.01, 40, 90)};
  b.name = "b";
  b.settings = {setting("too good", 0.0, 99, 1, true)};
  const auto label = [&](std::optional<double> max_flip, std::optional<double> min_psnr_db) -> std::string {
    const auto found = cheapest({a, b}, {Cost::kMs, max_flip, min_psnr_db});
    return found ? found->knob + ": " + found->setting.label : "none";
  };
  EXPECT_EQ(label(0.05, {}), "a: good");
  EXPECT_EQ(label({}, 35), "a: best");
  EXPECT_EQ(label(0.05, 35), "a: best") << "both must hold";
  EXPECT_EQ(label({}, {}), "a: bad");
  EXPECT_EQ(label(0.001, {}), "none") << "a run in double precision is no machine";
  a.settings[2].measured.error->psnr_db.reset();
  EXPECT_EQ(label({}, 99), "a: best") << "an image that equals the reference has any PSNR";
  a.settings.push_back(setting("as cheap, better", 0.03, 33, 50));
  EXPECT_EQ(label(0.05, {}), "a: as cheap, better");
}

// A machine whose squared errors add up and costs multiply.
struct SeparableMachine {
  explicit SeparableMachine(test::Random& random) {
    for (int k = 0; k < 3; ++k)
      for (int s = 0; s < 5; ++s) {
        squared[k][s] = 1e-4 * static_cast<double>(random.uniform(0.2f, 5));
        cost[k][s] = static_cast<double>(random.uniform(0.3f, 3));
      }
  }
  Measurement measured(const CombinationSearch::Combination& at) const {
    double error = 1e-5, ms = 1;
    for (std::size_t k = 0; k < 3; ++k) error += squared[k][at[k]], ms *= cost[k][at[k]];
    Measurement m;
    m.error = ImageError{-10 * std::log10(error), 0, 0.1, 0};
    m.ms = ms;
    return m;
  }
  std::vector<KnobResult> alone() const {
    std::vector<KnobResult> knobs(3);
    for (std::size_t k = 0; k < 3; ++k) {
      knobs[k].against = 2;
      for (std::size_t s = 0; s < 5; ++s) {
        CombinationSearch::Combination at = {2, 2, 2};
        at[k] = s;
        knobs[k].settings.emplace_back().measured = measured(at);
      }
    }
    return knobs;
  }
  double squared[3][5], cost[3][5];
};

TEST(CombinationSearch, CSE2FindsTheCheapestWithFewTrials) {
  test::Random random(3);
  std::size_t trials = 0;
  int blind = 0;  // the failing twin: the cheapest of single settings
  for (int round = 0; round < 40; ++round) {
    const SeparableMachine machine(random);
    const CheapestWanted wanted{Cost::kMs, {}, static_cast<double>(random.uniform(26, 34))};
    std::optional<double> least, alone;
    for (std::size_t n = 0; n < 125; ++n) {
      const CombinationSearch::Combination at = {n % 5, n / 5 % 5, n / 25};
      const Measurement m = machine.measured(at);
      if (shortfall_db(*m.error, wanted) > 0) continue;
      if (!least || *m.ms < *least) least = *m.ms;
    }
    CombinationSearch search(machine.alone(), wanted);
    if (const auto found = cheapest(machine.alone(), wanted)) alone = found->setting.measured.ms;
    std::optional<double> best = alone;
    std::set<CombinationSearch::Combination> seen;
    while (const auto next = search.next()) {
      EXPECT_TRUE(seen.insert(*next).second) << "CSE1: proposed twice";
      EXPECT_GT(std::count_if(next->begin(), next->end(), [](std::size_t s) { return s != 2; }), 1) << "CSE1: measured";
      const Measurement m = machine.measured(*next);
      if (shortfall_db(*m.error, wanted) == 0 && (!best || *m.ms < *best)) best = *m.ms;
      search.add(*next, m);
      ASSERT_LE(seen.size(), 125u);
    }
    EXPECT_EQ(best.has_value(), least.has_value()) << round;
    if (best && least) {
      EXPECT_DOUBLE_EQ(*best, *least) << round;
    }
    if (least) trials += seen.size();
    blind += least && (!alone || *alone > *least) ? 1 : 0;
  }
  EXPECT_LT(trials, 40u * 12u);
  EXPECT_GT(blind, 10);
}

TEST(Cheapest, TheNearestMissLacksTheFewestDecibels) {
  KnobResult a;
  a.name = "a";
  a.settings = {setting("far", 0.2, 20, 10), setting("near", 0.04, 32, 50), setting("as near, expensive", 0.04, 32, 60),
                setting("good", 0.01, 40, 90)};
  const auto missed = nearest_miss({a}, {Cost::kMs, {}, 35});
  ASSERT_TRUE(missed);
  EXPECT_EQ(missed->setting.label, "near");
  EXPECT_FALSE(nearest_miss({a}, {Cost::kMs, 0.5, {}})) << "all are good enough";
  EXPECT_DOUBLE_EQ(shortfall_db(*a.settings[1].measured.error, {Cost::kMs, {}, 35}), 3);
  EXPECT_NEAR(shortfall_db(*a.settings[1].measured.error, {Cost::kMs, 0.004, {}}), 20, 1e-9) << "FLIP is an amplitude";
}

TEST(Words, TellTheCostsAndSavingsOfASetting) {
  SettingResult exact = setting("float", 0.1, 30.0, 1000), packed = setting("packed", 0.1, 29.9, 1000);
  exact.measured.watched = Figure{std::uint64_t{200}};
  packed.measured.watched = Figure{std::uint64_t{176}};
  const auto words = [&] { return setting_in_words(packed, exact, "resolve cycles"); };
  EXPECT_EQ(words(), "packed: costs 0.10 dB against float; saves 12.0 % of resolve cycles");
  packed.measured.error->psnr_db = 30.25;
  packed.measured.ms = 2500;
  EXPECT_EQ(words(), "packed: gains 0.25 dB over float; saves 12.0 % of resolve cycles, takes 2.50 times the time");
  packed.measured.image_sha256 = exact.measured.image_sha256;
  packed.measured.watched = Figure{std::uint64_t{200}};
  packed.measured.ms = 1031;
  EXPECT_EQ(words(), "packed: the same image as float; takes 3.1 % more time");
  packed.measured.ms.reset();
  EXPECT_EQ(words(), "packed: the same image as float; no machine, no time");
}

// ---- Points -----------------------------------------------------------------------------------------------------

class TrialFile : public testing::Test {
 protected:
  static TrialResult trial() {
    return {.error = ImageError{40.5, 0.99, 0.01, 0.25},
            .image_sha256 = std::string(64, 'a'),
            .figures = {{"timing.cycles", std::uint64_t{1} << 60},
                        {"dram.read_bytes", std::uint64_t{64}},
                        {"energy.total_nj", 5.0},
                        {"timing.units.l2.utilisation", 0.1 + 0.2},
                        {"tilecore.triangles", std::uint64_t{3}}},
            .host = {{0.1, 0.2}, {0.3, 0.4}}};
  }
  // Message of the refusal of a file with this text, or "" when it is read.
  std::string refusal(const std::string& text, bool timed = false) {
    test::write_text(file_, text);
    try {
      read_trial(file_, timed);
    } catch (const InputError& error) {
      EXPECT_EQ(error.file(), file_.string());
      return error.place() + " " + error.fault();
    }
    return "";
  }
  test::TemporaryFolder folder_;
  fs::path file_ = folder_ / "0123456789abcdef0123456789abcdef.json";
};

TEST_F(TrialFile, ReadsBackToTheLastBit) {  // TF1
  TrialResult in_double = trial();
  in_double.error->psnr_db.reset();
  in_double.figures.clear();
  for (const TrialResult& one : {trial(), in_double}) {
    write_trial(file_, one);
    EXPECT_EQ(read_trial(file_, false), one);
    const std::string text = test::read_text(file_);
    write_trial(file_, read_trial(file_, false));
    EXPECT_EQ(test::read_text(file_), text);
  }
  TrialResult timed = trial();
  timed.error.reset();
  write_trial(file_, timed);
  EXPECT_EQ(read_trial(file_, true), timed);
}

TEST_F(TrialFile, IsRefusedAtEveryTruncatedLength) {  // TF2
  write_trial(file_, trial());
  const std::string text = test::read_text(file_);
  for (std::size_t length = 0; length + 1 < text.size(); ++length)  // the last byte ends the line
    ASSERT_THAT(refusal(text.substr(0, length)), testing::StartsWith("byte ")) << length;
  EXPECT_EQ(refusal(text), "");
}

// Every member taken away, made another type, and those with a range out of it.
TEST_F(TrialFile, IsRefusedWithThePlaceOfTheFault) {  // TF2
  write_trial(file_, trial());
  const json sound = json::parse(test::read_text(file_));
  for (const char* place : {"/schema", "/error", "/error/psnr_db", "/error/ssim", "/error/flip", "/error/max_error",
                            "/picture", "/values", "/host", "/host/seconds", "/host/processor_seconds"}) {
    const json::json_pointer at(place);
    json lacking = sound, other = sound;
    lacking[at.parent_pointer()].erase(at.back());
    EXPECT_EQ(refusal(lacking.dump()), std::string(place) + " is missing");
    other[at] = true;
    EXPECT_THAT(refusal(other.dump()), testing::StartsWith(std::string(place) + " is not ")) << place;
  }
  const auto with = [&](const char* place, const json& value) {
    json changed = sound;
    changed[json::json_pointer(place)] = value;
    return refusal(changed.dump());
  };
  EXPECT_EQ(with("/schema", "tessera.point/1"), "/schema is not tessera.trial/1") << "a point of a sweep";
  EXPECT_EQ(with("/picture", "abc"),
            "/"
            "picture"
            " is not 64 lower-case hexadecimal digits");
  EXPECT_EQ(with("/values/timing.cycles", 1.5), "/values/timing.cycles is not a whole number of at least 0");
  EXPECT_EQ(with("/values/dram.read_bytes", -1), "/values/dram.read_bytes is not a whole number of at least 0");
  EXPECT_EQ(with("/values/energy.total_nj", -1.5), "/values/energy.total_nj is below 0");
  EXPECT_EQ(with("/values/a~1b", "x"), "/values/a~1b is not a number");
  EXPECT_EQ(with("/error/flip", -0.5), "/error/flip is below 0");
  EXPECT_EQ(with("/host/seconds", json::array()), "/host/seconds has no round");
  EXPECT_EQ(with("/host/seconds", {0.1, -0.1}), "/host/seconds has a time below 0");
  EXPECT_EQ(with("/host/seconds", {0.1}), "/host/processor_seconds has not one time for each of \"seconds\"");
  EXPECT_EQ(with("/values/energy.total_nj", 5), "") << "5 is 5.0";
  EXPECT_THAT(refusal("[]"), HasSubstr("is not an object"));
  EXPECT_EQ(with("/error", json()), "/error is not an object");
  EXPECT_EQ(refusal(sound.dump(), true), "/error is not null, and the trial draws nothing");
}

// ---- Knobs ------------------------------------------------------------------------------------------------------

TEST(Knobs, HaveKeysThatExistValuesThatFitAndColumnsThatAreCounted) {
  std::set<std::string> names;
  for (const Knob& knob : knobs()) {
    EXPECT_TRUE(names.insert(knob.name).second) << knob.name;
    ASSERT_LT(knob.against, knob.settings.size()) << knob.name;
    EXPECT_GE(knob.settings.size(), 2u);
    for (const KnobSetting& setting : knob.settings) {
      gpu::RunSettings settings;
      gpu::GpuConfiguration gpu;
      EXPECT_NO_THROW(apply(knob.context, settings, gpu)) << knob.name;
      EXPECT_NO_THROW(apply(setting.values, settings, gpu)) << knob.name << " " << setting.label;
      EXPECT_NO_THROW(gpu::check_gpu(gpu));
    }
    const std::vector<std::string>& columns = known_columns();
    if (!knob.watched.empty() && !knob.watched.starts_with("timing.units.") && knob.watched != "capture.file_bytes") {
      EXPECT_NE(std::find(columns.begin(), columns.end(), knob.watched), columns.end()) << knob.watched;
    }
  }
  EXPECT_THROW(knob_named("smaples"), UsageError);
}

// The settings that the others are compared with are the machine's defaults, except for the knob's context.
TEST(Knobs, CompareWithTheDefaults) {
  for (const Knob& knob : knobs()) {
    if (knob.name.starts_with("reconstruction")) continue;  // with exact weights
    gpu::RunSettings settings, plain;
    gpu::GpuConfiguration gpu, plain_gpu;
    apply(knob.context, settings, gpu);
    apply(knob.context, plain, plain_gpu);
    apply(knob.settings[knob.against].values, settings, gpu);
    EXPECT_EQ(settings_json(settings), settings_json(plain)) << knob.name;
    EXPECT_EQ(gpu::gpu_json(gpu), gpu::gpu_json(plain_gpu)) << knob.name;
  }
}

TEST(Knobs, AreLeftOutWhereTheyChangeNothing) {
  const auto reason = [](const char* capture_name, const char* knob) {
    const scene::Capture capture = scene::read_capture(test::shipped_capture(capture_name));
    const scene::Assembly assembly = scene::assemble(capture);
    const auto frame = scene::pose_frame(assembly, gpu::frame_camera(capture, {}, 64, 36),
                                         gpu::frame_request(capture, {}, {}, 64, 36, capture.settings.first_frame));
    return why_without_effect(knob_named(knob), *frame, false);
  };
  EXPECT_THAT(reason("vases", "temporal_pattern"), HasSubstr("nothing moves"));
  EXPECT_THAT(reason("serpent", "displacement"), HasSubstr("nothing is displaced"));
  EXPECT_THAT(reason("serpent", "procedure_spacing"), HasSubstr("no procedures"));
  for (const char* knob : {"procedure_path", "procedure_spacing", "procedure_cells"})
    EXPECT_EQ(reason("workshop", knob), "") << knob;
  EXPECT_THAT(reason("serpent", "advection"), HasSubstr("no frame before"));
  for (const char* knob : {"temporal_pattern", "displacement", "edge", "samples"})
    EXPECT_EQ(reason("eggs", knob), "") << knob;
}

// Registers for any number of warps are an idealisation: a frame that they time leaks as much a cycle as the machine's does.
TEST(Knobs, ModelsOfTimingAddNoSilicon) {
  gpu::GpuConfiguration small;
  small.queues.register_bytes = 48 << 10;
  for (const gpu::GpuConfiguration& base : {gpu::GpuConfiguration(), small})
    for (const Knob& knob : knobs()) {
      if (!knob.timed) continue;
      for (const KnobSetting& setting : knob.settings) {
        gpu::RunSettings settings;
        gpu::GpuConfiguration gpu = base, charged = base;
        KeyValues values = setting.values;
        if (setting.ideal_registers) {
          apply(values, settings, charged);
          EXPECT_GT(charged.area().total_mm2(), 5 * base.area().total_mm2()) << "the twin: they would leak";
          keep_register_silicon(base, values);
        }
        apply(values, settings, gpu);
        EXPECT_NEAR(gpu.area().total_mm2(), base.area().total_mm2(), 1e-9) << knob.name << ": " << setting.label;
      }
    }
}

// ---- Printed tables ----------------------------------------------------------------------------------------------

TEST(Table, ShowsTheDecidingFigures) {
  TradeoffResult result;
  KnobResult& knob = result.knobs.emplace_back();
  knob.name = "knob", knob.title = "a knob";
  knob.settings = {setting("asked", 0.3, 25, 60), setting("cheap", 0.2, 30, 10), setting("beaten", 0.25, 28, 50),
                   setting("good", 0.1, 40, 90), setting("exact", 0.01, 60, 0, true)};
  knob.settings[0].is_base = true;
  knob.settings[4].measured.ms.reset();
  judge(knob);
  for (const char* name : {"first", "second"}) {
    KnobResult& other = result.knobs.emplace_back();
    other.name = other.title = name;
    other.skipped = "nothing moves";
  }
  KnobResult joint = result.knobs.front();
  joint.name = "joint", joint.combines = true;
  result.knobs.push_back(joint);
  const std::string some = tradeoff_table(result, false), all = tradeoff_table(result, true);
  for (const char* label : {"asked", "cheap", "good", "exact"}) EXPECT_THAT(some, HasSubstr(label));
  EXPECT_THAT(some, testing::Not(HasSubstr("beaten ")));
  EXPECT_THAT(some, HasSubstr("(knob), 5 settings\n"));
  EXPECT_THAT(some, HasSubstr("(joint), 5 combinations\n"));
  EXPECT_THAT(some, HasSubstr("  1 more, which others beat in FLIP and ms\n"));
  EXPECT_THAT(some, HasSubstr("left out, because nothing moves: first, second\n"));
  EXPECT_THAT(all, HasSubstr("beaten "));
  EXPECT_THAT(all, HasSubstr("cheap: gains 5.00 dB over asked"));
  EXPECT_THAT(all, testing::Not(HasSubstr("1 more")));
}

TEST(CheapestText, NamesTheTriedSettings) {
  TradeoffResult result;
  const CheapestAnswer answer{{Cost::kMs, {}, 99}, {}, {}};
  const auto add = [&](const char* name, std::vector<SettingResult> settings) -> KnobResult& {
    KnobResult& knob = result.knobs.emplace_back();
    knob.name = name;
    knob.settings = std::move(settings);
    return knob;
  };
  add("samples", {setting("1", 0.2, 30, 10), setting("2", 0.1, 31, 20)});
  EXPECT_THAT(cheapest_text(result, answer), testing::StartsWith("none of 2 settings of samples has a PSNR"));
  add("edge", {setting("3", 0.2, 30, 10)});
  add("joint", {setting("1 | 3", 0.2, 30, 10)}).combines = true;
  EXPECT_THAT(cheapest_text(result, answer), testing::StartsWith("none of 3 settings of 2 knobs and 1 combinations"));
}

// ---- The command ------------------------------------------------------------------------------------------------

class TradeoffCommand : public testing::Test {
 protected:
  ProcessResult run(const std::string& out, std::vector<std::string> more, const char* capture = "eggs") {
    std::vector<std::string> arguments = {"tradeoff", test::shipped_capture(capture).string(),
                                          "--out",    (folder_ / out).string(),
                                          "--size",   "64x36",
                                          "--rounds", "1",
                                          "--run",    "2"};
    if (std::find(more.begin(), more.end(), "--reference-samples") == more.end())
      arguments.insert(arguments.end(), {"--reference-samples", "32"});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_tessera(arguments);
  }
  json result(const std::string& out) { return json::parse(test::read_text(folder_ / out / "tradeoff.json")); }
  // The result without times of the host's clock.
  static json timeless(json value) {
    if (value.is_object()) {
      value.erase("host");
      for (auto& [name, member] : value.items()) member = timeless(member);
    }
    if (value.is_array())
      for (json& member : value) member = timeless(member);
    return value;
  }
  std::map<std::string, fs::file_time_type> files(const std::string& out) {
    std::map<std::string, fs::file_time_type> times;
    for (const char* part : {"points", "reference"})
      for (const auto& entry : fs::directory_iterator(folder_ / out / part))
        times[entry.path().filename().string()] = entry.last_write_time();
    return times;
  }
  test::TemporaryFolder folder_;
};

const std::vector<std::string> kSome = {"--knobs", "samples,temporal_pattern,displacement,arithmetic,desampling",
                                        "--quiet"};

TEST_F(TradeoffCommand, FollowsFromItsInputsButForTimes) {  // TO1
  std::vector<std::string> one = kSome, two = kSome;
  one.insert(one.end(), {"--threads", "1"});
  two.insert(two.end(), {"--threads", "2"});
  ASSERT_EQ(run("a", one).status, 0);
  ASSERT_EQ(run("b", two).status, 0);
  EXPECT_EQ(timeless(result("a")), timeless(result("b")));
  EXPECT_NE(result("a"), result("b")) << "the twin: times differ";
}

TEST_F(TradeoffCommand, DoesNotRepeatFinishedTrials) {  // TO3
  ASSERT_EQ(run("a", kSome).status, 0);
  const auto first = files("a");
  const json before = result("a");
  ASSERT_EQ(run("a", kSome).status, 0);
  EXPECT_EQ(files("a"), first);
  EXPECT_EQ(result("a"), before);
  // A lost trial, and only that, is run again.
  const auto gone = std::find_if(first.begin(), first.end(),
                                 [&](const auto& f) { return fs::exists(folder_ / "a" / "points" / f.first); });
  fs::remove(folder_ / "a" / "points" / gone->first);
  ASSERT_EQ(run("a", kSome).status, 0);
  auto again = files("a");
  EXPECT_NE(again[gone->first], gone->second);
  again[gone->first] = gone->second;
  EXPECT_EQ(again, first);
  EXPECT_EQ(timeless(result("a")), timeless(before));
}

TEST_F(TradeoffCommand, ADamagedPointEndsWithStatus3AndItsName) {
  const std::vector<std::string> one = {"--knobs", "split_depth", "--quiet"};
  ASSERT_EQ(run("a", one).status, 0);
  const fs::path point = fs::directory_iterator(folder_ / "a" / "points")->path();
  json damaged = json::parse(test::read_text(point));
  damaged["values"]["timing.cycles"] = "many";
  test::write_text(point, damaged.dump());
  const ProcessResult r = run("a", one);
  EXPECT_EQ(r.status, 3);
  EXPECT_THAT(r.errors, HasSubstr(point.filename().string() + ": /values/timing.cycles: is not a whole number"));
}

TEST_F(TradeoffCommand, ErrorFallsWithSamplesAndTheDoubleOneIsNearTheSingleOne) {
  ASSERT_EQ(
      run("a", {"--knobs", "samples,arithmetic", "--quiet", "--reference-edge", "0", "--reference-samples", "256"})
          .status,
      0);
  const json knobs_json = result("a")["knobs"];
  const auto knob = [&](const char* name) {
    return *std::find_if(knobs_json.begin(), knobs_json.end(), [&](const json& k) { return k["name"] == name; });
  };
  const json samples = knob("samples")["settings"], arithmetic = knob("arithmetic")["settings"];
  EXPECT_GT(samples[0]["error"]["flip"], samples[3]["error"]["flip"]);
  EXPECT_GT(samples[3]["error"]["flip"], samples[6]["error"]["flip"]);
  EXPECT_LT(samples[0]["cycles"], samples[6]["cycles"]);
  EXPECT_TRUE(samples[2]["base"]);
  EXPECT_EQ(arithmetic[0]["cycles"], nullptr);
  // 0.101: edges of cells that pass between samples of one and the other.
  EXPECT_NEAR(arithmetic[0]["error"]["psnr_db"].get<double>(), arithmetic[1]["error"]["psnr_db"].get<double>(), 0.15);
}

TEST_F(TradeoffCommand, PrintsArgumentsThatReplayTakes) {
  const ProcessResult r = run("a", {"--knobs", "samples,shading", "--max-flip", "0.9", "--set", "tile.width=16"});
  ASSERT_EQ(r.status, 0) << r.errors;
  EXPECT_THAT(r.output, HasSubstr("FLIP of at most 0.9: least ms with"));
  const std::string arguments = result("a")["cheapest"]["setting"]["arguments"];
  EXPECT_THAT(arguments, HasSubstr("--set tile.width=16"));
  std::vector<std::string> replay = {"replay",  test::shipped_capture("eggs").string(),
                                     "--size",  "64x36",
                                     "--quiet", "--no-report",
                                     "--out",   (folder_ / "r").string()};
  std::istringstream words(arguments);
  for (std::string word; words >> word;) replay.push_back(word);
  ASSERT_EQ(run_tessera(replay).status, 0);
  const json stats = json::parse(test::read_text(folder_ / "r" / "stats.json"));
  EXPECT_EQ(stats["frames"][0]["timing"]["cycles"], result("a")["cheapest"]["setting"]["cycles"])
      << "the same machine does the same work";
  EXPECT_THAT(run("a", {"--knobs", "samples", "--max-flip", "0"}).output,
              HasSubstr("none of 7 settings of samples has a FLIP of at most 0\n"));
}

TEST_F(TradeoffCommand, BitsOfAttributesCostBytesAndBuyAccuracy) {
  // A rough sheet, not compressed: pack leaves compressed meshes alone.
  constexpr int kSide = 40;
  test::Random random(7);
  std::vector<float> positions;
  std::vector<std::uint32_t> indices;
  for (int k = 0; k < kSide * kSide; ++k)
    positions.insert(positions.end(), {static_cast<float>(k % kSide) * 0.1f, static_cast<float>(k / kSide) * 0.1f,
                                       random.uniform(-0.1f, 0.1f)});
  for (int j = 0; j + 1 < kSide; ++j)
    for (int i = 0; i + 1 < kSide; ++i)
      for (const int corner : {0, 1, kSide + 1, 0, kSide + 1, kSide})
        indices.push_back(static_cast<std::uint32_t>(j * kSide + i + corner));
  test::GltfAsset asset;
  const int position = asset.add_accessor("VEC3", positions), index = asset.add_accessor("SCALAR", indices);
  asset.add("meshes", {{"primitives", {{{"attributes", {{"POSITION", position}}}, {"indices", index}}}}});
  asset.add("nodes", {{"mesh", 0}});
  const fs::path plain = folder_ / "plain.glb";
  test::write_text(plain, asset.glb());
  ASSERT_EQ(
      run_tessera({"tradeoff", plain.string(), "--out", (folder_ / "a").string(), "--size", "160x90", "--rounds", "1",
                   "--run", "1", "--reference-samples", "8", "--knobs", "draco_bits,meshopt_bits", "--quiet"})
          .status,
      0);
  for (const char* name : {"draco_bits", "meshopt_bits"}) {
    SCOPED_TRACE(name);
    const json knobs_json = result("a")["knobs"];
    const auto knob =
        std::find_if(knobs_json.begin(), knobs_json.end(), [&](const json& k) { return k["name"] == name; });
    ASSERT_NE(knob, knobs_json.end());
    const json& settings = (*knob)["settings"];
    const std::size_t last = settings.size() - 1;
    const auto bytes = [&](std::size_t s) { return settings[s]["watched"].get<std::uint64_t>(); };
    const auto sha = [&](std::size_t s) { return settings[s]["picture"].get<std::string>(); };
    EXPECT_THAT(settings[1]["arguments"].get<std::string>(), HasSubstr("--position-bits 8"));
    EXPECT_LT(bytes(1), bytes(last));
    EXPECT_LT(bytes(last), bytes(0));
    EXPECT_NE(sha(0), sha(1));
    EXPECT_NE(sha(1), sha(last));
  }
}

TEST_F(TradeoffCommand, TurnsKnobsTogether) {
  ASSERT_EQ(run("a", {"--joint", "samples,shading", "--knobs", "samples", "--quiet"}).status, 0);
  const json knobs_json = result("a")["knobs"];
  ASSERT_EQ(knobs_json.back()["name"], "joint");
  std::size_t expected = 1;
  for (const json& knob : knobs_json) {
    if (knob["name"] == "joint") continue;
    expected *=
        static_cast<std::size_t>(std::count_if(knob["settings"].begin(), knob["settings"].end(), [](const json& r) {
          return r["front"]["ms"] == true || r["base"] == true;
        }));
  }
  EXPECT_EQ(knobs_json.back()["settings"].size(), expected);
  EXPECT_GT(expected, 2u);
  EXPECT_THAT(run("a", {"--joint", "samples,shading", "--max-points", "2"}).errors, HasSubstr("--max-points allows 2"));
  EXPECT_THAT(run("a", {"--joint", "reconstruction,reconstruction_4"}).errors,
              HasSubstr("would be set by two of the knobs"));
}

// Desampling goes on from the frames before: it is turned where the other knobs are at their best, and without such frames
// its adaptive setting is left out.
TEST_F(TradeoffCommand, TurnsDesamplingAtTheBestOfTheOtherKnobs) {
  ASSERT_EQ(run("a", {"--joint", "desampling,samples,shading", "--knobs", "samples", "--quiet"}).status, 0);
  ASSERT_EQ(run("plain", {"--joint", "samples,shading", "--knobs", "samples", "--quiet"}).status, 0);
  const json rows = result("a")["knobs"].back()["settings"], others = result("plain")["knobs"].back()["settings"];
  std::set<std::string> off, adaptive, best;
  for (const json& row : rows) {
    const std::string label = row["label"];
    const std::size_t bar = label.rfind(" | ");
    (label.substr(bar) == " | off" ? off : adaptive).insert(label.substr(0, bar));
  }
  for (const json& row : others) {
    EXPECT_TRUE(off.contains(row["label"].get<std::string>())) << row["label"];
    const auto beats = [&](const json& other, const char* error, double sign) {
      return other["ms"] <= row["ms"] && other["error"] != row["error"] &&
             sign * other["error"][error].get<double>() <= sign * row["error"][error].get<double>();
    };
    for (const auto& by : {std::pair("flip", 1.0), std::pair("psnr_db", -1.0)})
      if (std::none_of(others.begin(), others.end(),
                       [&](const json& other) { return beats(other, by.first, by.second); }))
        best.insert(row["label"].get<std::string>());
  }
  EXPECT_EQ(off.size(), others.size());
  EXPECT_EQ(adaptive, best);
  EXPECT_LT(adaptive.size(), off.size()) << "the twin: there are others";
  ASSERT_EQ(run("b", {"--joint", "samples,desampling", "--knobs", "samples", "--quiet", "--frame", "0"}).status, 0);
  std::set<std::string> settings;
  const json first_frame = result("b");
  for (const json& knob : first_frame["knobs"])
    for (const json& row : knob["settings"])
      if (knob["name"] == "desampling") settings.insert(row["label"].get<std::string>());
  EXPECT_THAT(settings, testing::ElementsAre("checkerboard", "fixed_4", "fixed_8", "off"));
}

TEST_F(TradeoffCommand, CtrlCStopsAmongTheRoundsOfAKnobAndTheNextRunGoesOn) {
  const std::vector<std::string> arguments = {"tradeoff",
                                              test::shipped_capture("eggs").string(),
                                              "--out",
                                              (folder_ / "a").string(),
                                              "--size",
                                              "64x36",
                                              "--reference-samples",
                                              "4",
                                              "--knobs",
                                              "split_depth",
                                              "--rounds"};
  std::vector<std::string> long_one = arguments, short_one = arguments;
  long_one.emplace_back("1000");
  short_one.emplace_back("1");
  const ProcessResult stopped = run_tessera(long_one, {.interrupt_after_ms = 2000});
  EXPECT_EQ(stopped.status, 130) << stopped.errors;
  EXPECT_TRUE(result("a").at("stopped").get<bool>());
  EXPECT_TRUE(result("a").at("knobs").empty());
  EXPECT_EQ(run_tessera(short_one).status, 0);
  EXPECT_FALSE(result("a").at("stopped").get<bool>());
  EXPECT_EQ(result("a").at("knobs").at(0).at("settings").size(), 5u);
}

// Models of timing look at one record: each equals a replay with its keys, and errors are relative to the finest
// model.
TEST_F(TradeoffCommand, ModelsOfTimingTimeOneRecord) {
  const ProcessResult r = run("a", {"--knobs", "samples,timing,requests", "--reference-samples", "1",
                                    "--reference-edge", "0", "--max-flip", "1"});
  ASSERT_EQ(r.status, 0) << r.errors;
  EXPECT_THAT(r.output, HasSubstr("phases of tiles"));
  const json all = result("a");
  for (const json& knob : all["knobs"]) {
    EXPECT_EQ(knob["timed"].get<bool>(), knob["name"] != "samples");
    for (const json& setting : knob["settings"]) EXPECT_EQ(setting["error"].is_null(), knob["timed"].get<bool>());
    if (!knob["timed"].get<bool>()) continue;
    const json& finest = knob["settings"][0];
    EXPECT_EQ(finest["cycles_error"], 0.0);
    EXPECT_EQ(knob["against"], 0);
    for (const json& setting : knob["settings"]) {
      EXPECT_DOUBLE_EQ(setting["cycles_error"].get<double>(),
                       setting["cycles"].get<double>() / finest["cycles"].get<double>() - 1);
      EXPECT_TRUE(setting["same_picture"].get<bool>());
      EXPECT_TRUE(setting["front"].empty());
      std::vector<std::string> replay = {
          "replay",   test::shipped_capture("eggs").string(),
          "--size",   "64x36",
          "--quiet",  "--no-report",
          "--out",    (folder_ / "r").string(),
          "--frames", std::to_string(all["frame"].get<int>()) + ":" + std::to_string(all["frame"].get<int>() + 1)};
      std::istringstream words(setting["arguments"].get<std::string>());
      for (std::string word; words >> word;) replay.push_back(word);
      ASSERT_EQ(run_tessera(replay).status, 0);
      const json stats = json::parse(test::read_text(folder_ / "r" / "stats.json"));
      EXPECT_EQ(stats["frames"][0]["timing"]["cycles"], setting["cycles"]) << setting["label"];
    }
  }
  EXPECT_EQ(all["cheapest"]["setting"]["knob"], "samples") << "how a machine is timed makes it no cheaper";
  EXPECT_EQ(run("a", {"--joint", "timing"}).status, 2);
  EXPECT_FALSE(all["reference"].is_null());
  EXPECT_TRUE(fs::exists(folder_ / "a" / "reference"));
}

// Models of timing alone draw nothing: no reference is rendered, and the trials equal the trials of a mix of knobs.
TEST_F(TradeoffCommand, ModelsOfTimingNeedNoReference) {
  const std::vector<std::string> knobs = {"--knobs", "timing,memory_model,shader_costs,warps,requests"};
  const ProcessResult r = run("a", knobs);
  ASSERT_EQ(r.status, 0) << r.errors;
  EXPECT_FALSE(fs::exists(folder_ / "a" / "reference"));
  EXPECT_TRUE(fs::exists(folder_ / "a" / "report.html"));
  const json alone = result("a");
  EXPECT_TRUE(alone["reference"].is_null());
  EXPECT_EQ(alone["knobs"].size(), 5u);
  ASSERT_EQ(run("a", {"--knobs", "samples,timing"}).status, 0);
  const json mixed = result("a");
  EXPECT_FALSE(mixed["reference"].is_null());
  EXPECT_EQ(mixed["knobs"][1], alone["knobs"][0]) << "host times and all: nothing was timed again";
}

TEST_F(TradeoffCommand, RefusesUnknownKnobsAndIncomparableSettings) {
  EXPECT_THAT(run("a", {"--knobs", "smaples"}).errors, HasSubstr("samples"));
  EXPECT_EQ(run("a", {"--knobs", "smaples"}).status, 2);
  EXPECT_EQ(run("a", {"--cost", "money"}).status, 2);
  EXPECT_EQ(run("a", {"--set", "stereo.eye_separation=0.1"}).status, 2);
  EXPECT_EQ(run("a", {"--set", "output.machine_model=false"}).status, 2);
  EXPECT_EQ(run("a", {"--reference-edge", "-1"}).status, 2);
  EXPECT_EQ(run("a", {"--max-memory", "0.0001"}).status, 4);
}

}  // namespace
}  // namespace tessera::replay::tradeoff_test
