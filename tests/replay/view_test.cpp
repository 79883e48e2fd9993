// `tessera view`: the results of its session, and its page in a browser with a user.
#include <condition_variable>
#include <mutex>

#include "base/error.h"
#include "replay/view/view_session.h"
#include "scene/capture_reader.h"
#include "tests/support/browser.h"
#include "tests/support/live_page.h"
#include "tests/support/pass_graphs.h"
#include "tests/support/running_process.h"
#include "tests/support/tests.h"

namespace tessera::replay::view_test {
namespace {

using test::LivePage;
using test::RunningProcess;

// ---- The session --------------------------------------------------------------------------------------------------

// A session of a small frame, and all that it said.
class Session {
 public:
  explicit Session(const std::string& capture = "eggs", std::vector<std::string> sets = {},
                   const std::string& size = "96x54", int warmup = 0)
      : capture_(scene::read_capture(test::shipped_capture(capture), {})),
        session_(start(capture, sets, size, warmup), 1u << 30) {
    session_.run([this](const std::shared_ptr<const ViewResult>& result) {
      const std::lock_guard lock(mutex_);
      results_.push_back(result);
      more_.notify_all();
    });
    while (!session_.wait_for_start(1000)) {
    }
  }

  ViewSession& operator*() { return session_; }
  ViewSession* operator->() { return &session_; }
  // The final result of a change.
  std::shared_ptr<const ViewResult> after(const json& changes) {
    const std::uint64_t revision = session_.request(changes, true);
    std::unique_lock lock(mutex_);
    const bool there = more_.wait_for(lock, std::chrono::seconds(60), [&] {
      return !results_.empty() && results_.back()->revision == revision && !results_.back()->stale;
    });
    EXPECT_TRUE(there) << changes;
    return results_.back();
  }
  // The error of a state "failed".
  std::string failure_of(const json& changes) {
    const std::uint64_t revision = session_.request(changes, true);
    for (int k = 0; k < 6000; ++k) {
      const json state = session_.state();
      if (state["revision"] == revision && state["phase"] == "failed") return state["error"];
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return "";
  }
  std::vector<std::shared_ptr<const ViewResult>> results() {
    const std::lock_guard lock(mutex_);
    return results_;
  }

 private:
  ViewStart start(const std::string& capture, std::vector<std::string> sets, const std::string& size,
                  int warmup) const {
    ViewStart start;
    start.capture = &capture_;
    start.file = test::shipped_capture(capture).string();
    start.sets = std::move(sets);
    start.size = size;
    start.warmup = warmup;
    return start;
  }

  scene::Capture capture_;
  std::mutex mutex_;
  std::condition_variable more_;
  std::vector<std::shared_ptr<const ViewResult>> results_;
  ViewSession session_;
};

// VWS1: a result equals the replay of its command line.
void expect_as_replayed(const ViewResult& result) {
  const test::TemporaryFolder out;
  std::istringstream words(result.command);
  std::vector<std::string> arguments{std::istream_iterator<std::string>(words), {}};
  ASSERT_EQ(arguments.at(0), "tessera");
  arguments.erase(arguments.begin());
  for (const char* more : {"--quiet", "--no-report", "--out"}) arguments.emplace_back(more);
  arguments.push_back(out.path().string());
  const ProcessResult replay = run_tessera(arguments);
  ASSERT_EQ(replay.status, 0) << replay.errors;
  json expected = json::parse(test::read_text(out / "stats.json")), found = result.stats;
  for (json* stats : {&expected, &found}) {
    stats->erase("host");
    for (json* part : {&(*stats)["frames"][0], &(*stats)["total"]}) part->erase("host");
  }
  EXPECT_EQ(found, expected) << result.command << "\n" << json::diff(found, expected).dump(1).substr(0, 2000);
  const std::string png = test::read_text(out / fmt::format("frame_{:04}.png", result.frame));
  EXPECT_TRUE(png == *result.image.png) << result.command;
}

TEST(View, ResultsEqualTheirCommandLine) {  // VWS1
  Session session("eggs", {"tile.width=16", "shader.lanes=48"});
  expect_as_replayed(*session->result());
  for (const json& changes :
       {json{{"memory.channels", 2}}, json{{"tile.width", 64}, {"sampling.samples_per_pixel", 8}},
        json{{"clock.mhz", 600}}, json{{"memory.type", "lpddr5-6400"}}, json{{"shading.rate", "sample"}},
        json{{"machine.timing", "phases"}, {"memory.channels", nullptr}, {"memory.type", nullptr}},
        json{{"memory.bytes_per_clk", 32}}, json{{"l2.bytes", 1048576}}, json{{"frame", 3}}}) {
    expect_as_replayed(*session.after(changes));
    if (testing::Test::HasFatalFailure()) return;
  }
  const auto back = session.after({{"tile.width", nullptr},
                                   {"sampling.samples_per_pixel", nullptr},
                                   {"clock.mhz", nullptr},
                                   {"memory.bytes_per_clk", nullptr},
                                   {"shading.rate", nullptr},
                                   {"machine.timing", nullptr},
                                   {"l2.bytes", nullptr},
                                   {"frame", nullptr}});
  EXPECT_EQ(back->changes, json::object());
  EXPECT_EQ(back->summary, session.results().front()->summary);
  EXPECT_EQ(back->command, session.results().front()->command);
}

TEST(View, AHistoryIsRenderedBeforeTheFrame) {  // VWS1
  Session session("serpent", {"resolve.desampling=adaptive"}, "96x54", 2);
  const auto later = session.after({{"frame", 4}});
  EXPECT_THAT(later->command, HasSubstr(" --warmup 2"));
  expect_as_replayed(*later);
  EXPECT_GT(later->stats["total"]["counters"]["resolve.pixels_advected"], 0);
}

TEST(View, TemporalAntialiasingHasAHistory) {
  const scene::Capture plain = scene::read_capture(test::shipped_capture("eggs"), {});
  const auto first_of_frame_9 = [](const scene::Capture& capture, std::vector<std::string> sets) {
    ViewStart start;
    start.capture = &capture, start.sets = std::move(sets), start.size = "96x54", start.frame = 9;
    return ViewSpace(start).start_point().first_frame(4);
  };
  const scene::Capture antialiased = test::with_graph(plain, test::antialiasing());
  EXPECT_EQ(first_of_frame_9(antialiased, {}), 5);
  EXPECT_EQ(first_of_frame_9(antialiased, {"post.taa=0"}), 9);
  EXPECT_EQ(first_of_frame_9(plain, {}), 9);
}

TEST(View, TheNewestRequestWinsAndNoneBeforeItComesLater) {  // VWS2
  Session session("eggs", {}, "640x360");
  for (const int width : {8, 16, 24, 40, 48, 64}) session->request({{"tile.width", width}}, false);
  const auto last = session.after({{"tile.width", 56}});
  EXPECT_EQ(last->changes, (json{{"tile.width", 56}}));
  std::uint64_t before = 0;
  for (const auto& result : session.results()) {
    EXPECT_GE(result->revision, before);
    before = result->revision;
  }
  expect_as_replayed(*last);
  EXPECT_EQ(session->history().size(), 2u) << "the start and the kept result";
}

TEST(View, ARunningFrameIsAbandonedAtItsNextTile) {  // VWS2
  const scene::Capture capture = scene::read_capture(test::shipped_capture("eggs"), {});
  gpu::RenderRequest request;
  request.width = 96, request.height = 54;
  request.region = {0, 0, 96, 54};
  gpu::Device device(capture, {}, {}, request);
  device.render(0);
  device.abandon();
  EXPECT_THROW(device.render(1), gpu::Abandoned);
  EXPECT_EQ(device.progress().done(), 0u);
}

TEST(View, KeysOfTimingRenderNothing) {  // VWS3
  Session session;
  const std::uint64_t image = session->result()->image.number;
  double ms = session->result()->summary["ms"];
  for (const auto& [key, less] :
       {std::pair{"memory.channels", json(1)}, {"clock.mhz", json(5.0)}, {"shader.lanes", json(8)}}) {
    const auto result = session.after({{key, less}});
    EXPECT_FALSE(result->rendered) << key;
    EXPECT_EQ(result->image.number, image) << key;
    EXPECT_GT(result->summary["ms"], ms) << key;
    ms = result->summary["ms"];
  }
  EXPECT_TRUE(session.after({{"tile.width", 16}})->rendered) << "the failing twin";
}

// Sizes of caches: at once in time, where events are simulated, and then in the counters of the emulated order.
TEST(View, CachesOfEventsAreTimedFirstAndRenderedThen) {
  Session session("eggs");
  const auto last = session.after({{"l2.bytes", 65536}});
  EXPECT_TRUE(last->rendered);
  const auto results = session.results();
  ASSERT_EQ(results.size(), 3u);
  EXPECT_TRUE(results[1]->stale);
  EXPECT_EQ(results[1]->revision, last->revision);
  json timed = results[1]->stats["total"]["timing"], rendered = last->stats["total"]["timing"];
  // The coarse model counts the misses of the caches in the emulated order, as counters do.
  for (json* timing : {&timed, &rendered}) timing->erase("coarse_cycles");
  EXPECT_EQ(timed, rendered);
  EXPECT_EQ(results[1]->stats["total"]["counters"], results[0]->stats["total"]["counters"]);
  EXPECT_EQ(session->history().size(), 2u);
}

TEST(View, ARequestThatIsRefusedChangesNothing) {  // VWS4
  Session session;
  const auto refused = [&](const json& changes, const std::string& says) {
    try {
      session->request(changes, true);
      ADD_FAILURE() << changes << " is taken";
    } catch (const UsageError& error) {
      EXPECT_THAT(error.what(), HasSubstr(says)) << changes;
    }
  };
  refused({{"memory.gb_per_sec", 30}}, "did you mean 'memory.gb_per_s'?");
  refused({{"memory.gb_per_sec", nullptr}}, "did you mean 'memory.gb_per_s'?");
  refused({{"memory.gb_per_s", -1}}, "memory.gb_per_s");
  refused({{"memory.gb_per_s", "fast"}}, "memory.gb_per_s");
  refused({{"shading.rate", "rarely"}}, "shading.rate");
  refused({{"tile.width", 20.5}}, "tile.width");
  refused({{"tile.width", 20}}, "tile.width");
  refused({{"tile.width", {1, 2}}}, "tile.width");
  refused({{"clock.mhz", 600}, {"tile.width", 20}}, "tile.width");
  refused({{"output.machine_model", false}}, "output.machine_model");
  refused({{"frame", -1}}, "frame");
  refused({{"frame", 1e300}}, "frame");
  refused(json::array({1}), "expected an object");
  const auto result = session.after({{"tile.width", 16}});
  EXPECT_EQ(result->revision, 2u);
  EXPECT_EQ(result->changes, (json{{"tile.width", 16}}));
}

TEST(View, AFailedRenderIsReportedAndTheSessionGoesOn) {
  Session session;
  // The machine bears it; a shader of the frame does not.
  EXPECT_THAT(session.failure_of({{"shader.register_bytes", 1024}}), HasSubstr("a shader of the frame takes"));
  EXPECT_EQ(session.after({{"shader.register_bytes", nullptr}})->changes, json::object());
}

TEST(View, OnlyKeptResultsAreInTheHistory) {
  Session session;
  const auto wait = [&](std::uint64_t revision) {
    while (session->result()->revision != revision) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  wait(session->request({{"clock.mhz", 500}}, false));
  wait(session->request({{"clock.mhz", 550}}, false));
  EXPECT_EQ(session->history().size(), 1u);
  // Let go at the same place, the slider keeps the result as it is.
  EXPECT_EQ(session->request({{"clock.mhz", 550}}, true), 3u);
  const json history = session->history();
  ASSERT_EQ(history.size(), 2u);
  EXPECT_EQ(history[1]["changes"], (json{{"clock.mhz", 550}}));
  EXPECT_EQ(history[1]["summary"], session->result()->summary);
}

// ViewSession::left_out() once it is in one of these phases.
json left_out_when(ViewSession& session, const std::set<std::string>& phases) {
  json now;
  for (int k = 0; k < 6000; ++k) {
    now = session.left_out();
    if (phases.contains(now.value("phase", ""))) return now;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ADD_FAILURE() << now;
  return now;
}

// VWS5: rows equal the rows of `replay --without` for the result's command line, largest saving first.
TEST(View, MeasuresTheFrameWithoutEachDrawable) {
  Session session("eggs", {"shader.lanes=48"});
  const auto result = session.after({{"frame", 4}, {"tile.width", 16}});
  EXPECT_EQ(session->left_out(), json::object());
  session->measure_without(json::object());
  const json measured = left_out_when(*session, {"done"});
  EXPECT_EQ(measured["revision"], result->revision);
  EXPECT_EQ(measured["done"], measured["all"]);
  const test::TemporaryFolder out;
  std::istringstream words(result->command);
  std::vector<std::string> arguments{std::istream_iterator<std::string>(words), {}};
  arguments.erase(arguments.begin());
  for (const char* more : {"--quiet", "--no-report", "--without", "all", "--out"}) arguments.emplace_back(more);
  arguments.push_back(out.path().string());
  ASSERT_EQ(run_tessera(arguments).status, 0);
  const json expected = json::parse(test::read_text(out / "stats.json"))["frames"][0]["without"]["drawables"];
  EXPECT_GT(expected.size(), 1u);
  EXPECT_EQ(measured["rows"], expected);
  // One of them alone is the same row.
  session->measure_without({{"node", expected[1]["node"]}, {"material", expected[1]["material"]}});
  EXPECT_EQ(left_out_when(*session, {"done"})["rows"], json::array({expected[1]}));
  EXPECT_EQ(session->result()->revision, result->revision) << "the result stays";
}

TEST(View, AMeasurementEndsWhereItIsCancelledOrTheFrameIsAnother) {  // VWS5
  Session session("garden", {}, "640x360");
  session->measure_without(json::object());
  session->cancel_measuring();
  EXPECT_EQ(left_out_when(*session, {"cancelled", "done"})["phase"], "cancelled");
  session->measure_without(json::object());
  for (int k = 0; k < 6000 && session->left_out()["done"] == 0; ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  const json some = session->left_out();
  EXPECT_GT(some["done"], 0);
  EXPECT_LT(some["done"], some["all"]);
  EXPECT_EQ(some["rows"].size(), some["done"].get<std::size_t>()) << "as it goes";
  const auto start = std::chrono::steady_clock::now();
  const auto timed = session.after({{"clock.mhz", 600}});
  EXPECT_EQ(session->left_out()["phase"], "cancelled");
  EXPECT_FALSE(timed->rendered);
  RecordProperty("seconds",
                 std::to_string(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()));
}

TEST(View, PartsThatCannotBeLeftOutAreReported) {
  Session session;
  const auto fault = [&](const json& part) -> std::string {
    try {
      session->measure_without(part);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(fault({{"node", "no such"}, {"material", "m"}}), HasSubstr("the frame draws no no such / m"));
  EXPECT_THAT(fault({{"node", "ground"}}), HasSubstr("material"));
  EXPECT_THAT(fault({{"node", 1}, {"material", "m"}}), HasSubstr("node"));
  EXPECT_THAT(fault(json::array()), HasSubstr("expected"));
  EXPECT_EQ(session->left_out(), json::object()) << "a refusal measures nothing";
}

TEST(View, WordsOfACommandLineAreQuotedForAShell) {
  EXPECT_EQ(shell_word("captures/eggs.glb"), "captures/eggs.glb");
  EXPECT_EQ(shell_word("my eggs.glb"), "'my eggs.glb'");
  EXPECT_EQ(shell_word("it's $HOME;`ls`"), "'it'\\''s $HOME;`ls`'");
  EXPECT_EQ(shell_word(""), "''");
  const ProcessResult echo = test::run_process({"/bin/sh", "-c", "printf %s " + shell_word("a'b\"c $x\n*")});
  EXPECT_EQ(echo.output, "a'b\"c $x\n*");
}

// ---- The program --------------------------------------------------------------------------------------------------

std::vector<std::string> view_of(const std::string& capture, std::vector<std::string> more = {}) {
  std::vector<std::string> arguments = {TESSERA_PROGRAM, "view", test::shipped_capture(capture).string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

TEST(ViewCommand, PrintsOneAddressAndEndsWithCtrlC) {
  const test::TemporaryFolder temporary;
  RunningProcess view({"/usr/bin/env", "TMPDIR=" + temporary.path().string(), TESSERA_PROGRAM, "view",
                       test::shipped_capture("eggs").string(), "--size", "96x54"});
  const std::string url = view.read_line();
  EXPECT_THAT(url, testing::MatchesRegex("http://127\\.0\\.0\\.1:[0-9]+/[0-9a-f]+/"));
  view.interrupt();
  const ProcessResult end = view.wait();
  EXPECT_EQ(end.status, 130);
  EXPECT_EQ(end.output, "");
  EXPECT_TRUE(fs::is_empty(temporary.path())) << "nothing is left";
}

TEST(ViewCommand, CtrlCEndsTheFirstFrameToo) {
  RunningProcess view(view_of("garden", {"--size", "3840x2160", "--set", "sampling.samples_per_pixel=64"}));
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  view.interrupt();
  const ProcessResult end = view.wait();
  EXPECT_EQ(end.status, 130);
  EXPECT_EQ(end.output, "");
}

TEST(ViewCommand, MistakesAreReportedBeforeAnythingIsServed) {
  const auto fails = [](std::vector<std::string> more, int status, const std::string& says) {
    const ProcessResult r = test::run_process(view_of("eggs", std::move(more)));
    EXPECT_EQ(r.status, status) << r.errors;
    EXPECT_EQ(r.output, "");
    EXPECT_THAT(r.errors, HasSubstr(says));
  };
  fails({"--set", "tile.widht=16"}, 2, "did you mean 'tile.width'?");
  fails({"--size", "0x0"}, 2, "--size");
  fails({"--port", "65536"}, 2, "--port");
  fails({"--frame", "-1"}, 2, "--frame");
  fails({"--set", "output.machine_model=false"}, 2, "output.machine_model");
  fails({"--size", "96x54", "--set", "shader.register_bytes=1024"}, 2, "shader.register_bytes");
  fails({"--size", "16384x16384", "--max-memory", "0.5"}, 4, "--max-memory");
  EXPECT_EQ(run_tessera({"view", "no_such_file.glb"}).status, 3);
  RunningProcess first(view_of("eggs", {"--size", "32x32"}));
  const std::string url = first.read_line();
  const std::string port = url.substr(17, url.find('/', 17) - 17);
  fails({"--port", port}, 2, "--port " + port + ": Address already in use");
}

// ---- The page -----------------------------------------------------------------------------------------------------

// A view and its page, for each test alone.
class ViewInBrowser : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::has_browser()) GTEST_SKIP() << "needs Debian's chromium";
  }
  void open(std::vector<std::string> more = {"--size", "320x180"}) {
    process_ = std::make_unique<RunningProcess>(view_of("eggs", std::move(more)));
    url_ = process_->read_line();
    page_ = std::make_unique<LivePage>(url_);
    ASSERT_TRUE(page_->wait_for("document.body.dataset.ready === 'true'"));
  }
  // The number on the card of the frame time.
  double milliseconds() {
    return page_->evaluate("parseFloat(document.querySelector('#view .card strong').textContent)");
  }
  std::string text(const std::string& selector) {
    return page_->evaluate("document.querySelector('" + selector + "').textContent");
  }
  void focus(const std::string& selector) { page_->evaluate("document.querySelector('" + selector + "').focus()"); }
  // Seconds until the page shows a result that answers `act`.
  template <class Act>
  double seconds_of(const Act& act) {
    const std::string before = page_->evaluate("document.body.dataset.revision");
    const auto start = std::chrono::steady_clock::now();
    act();
    EXPECT_TRUE(page_->wait_for("document.body.dataset.revision !== '" + before +
                                "' && document.body.dataset.phase === 'idle'"));
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  void expect_no_errors() {
    EXPECT_THAT(page_->errors(), testing::IsEmpty());
    EXPECT_EQ(page_->evaluate("document.body.dataset.errors"), "0");
  }

  std::unique_ptr<RunningProcess> process_;
  std::string url_;
  std::unique_ptr<LivePage> page_;
};

// Question: how much does a clock faster by 30 % give? Six keys on the slider, five per cent each.
TEST_F(ViewInBrowser, AFasterClockIsTimedAtOnce) {
  open({"--size", "1280x720"});
  const std::string source = page_->evaluate("document.querySelector('.sides img').src");
  const double before = milliseconds();
  focus("[data-key=\"clock.mhz\"] input[type=range]");
  const double seconds = seconds_of([&] {
    for (int k = 0; k < 6; ++k) page_->press("ArrowRight");
  });
  ASSERT_TRUE(
      page_->wait_for("document.querySelector('[data-key=\"clock.mhz\"] .delta').textContent === '+30\u202f%'"));
  ASSERT_TRUE(page_->wait_for("document.querySelector('.command').textContent.includes('--set clock.mhz=1105')"));
  RecordProperty("seconds", std::to_string(seconds));
  std::printf("a clock faster by 30 %%: shown after %.3f s, six keys included\n", seconds);
  EXPECT_LT(milliseconds(), before);
  EXPECT_THAT(text("#view .state"), testing::StartsWith("timed in "));
  EXPECT_EQ(page_->evaluate("document.querySelector('.sides img').src"), source) << "nothing was rendered";
  // The report below follows: its configuration has the new number.
  EXPECT_TRUE(page_->wait_for("document.querySelector('#configuration pre').textContent.includes('1105')"));
  // A replay gives the same number.
  const test::TemporaryFolder out;
  ASSERT_EQ(run_tessera({"replay", test::shipped_capture("eggs").string(), "--set", "clock.mhz=1105", "--quiet",
                         "--no-report", "--out", out.path().string()})
                .status,
            0);
  const json stats = json::parse(test::read_text(out / "stats.json"));
  const double ms =
      stats["total"]["timing"]["cycles"].get<double>() / stats["gpu"]["clock"]["mhz"].get<double>() * 1e-3;
  EXPECT_NEAR(milliseconds(), ms, 1e-3 * ms);
  expect_no_errors();
}

TEST_F(ViewInBrowser, AnotherTileSizeIsRenderedAndItsImageShown) {
  open();
  const std::string source = page_->evaluate("document.querySelector('.sides img').src");
  page_->evaluate("document.querySelector('[data-key=\"tile.width\"] input[type=number]').value = '64'");
  seconds_of([&] {
    page_->evaluate(
        "document.querySelector('[data-key=\"tile.width\"] input[type=number]').dispatchEvent(new Event('change'))");
  });
  EXPECT_THAT(text("#view .state"), testing::StartsWith("rendered in "));
  EXPECT_NE(page_->evaluate("document.querySelector('.sides img').src"), source);
  EXPECT_TRUE(page_->wait_for(
      "document.querySelector('.sides img').complete && document.querySelector('.sides img').naturalWidth === 320"));
  EXPECT_TRUE(page_->wait_for("data.runs[0].views[0].tiles.tile[0] === 64"));
  EXPECT_EQ(page_->evaluate("document.querySelectorAll('#view tbody tr').length"), 2);
  expect_no_errors();
}

TEST_F(ViewInBrowser, AnyKeyCanBeAddedAndAMistakeNamesTheNearest) {
  open();
  focus("#view form input");
  page_->type("texture.latency_clk");
  page_->press("Enter");
  EXPECT_TRUE(page_->wait_for("document.querySelector('[data-key=\"texture.latency_clk\"] input[type=range]')"));
  page_->evaluate("document.querySelector('#view form input').value = ''");
  focus("#view form input");
  page_->type("texture.latncy_clk");
  page_->press("Enter");
  EXPECT_TRUE(page_->wait_for(
      "document.querySelector('#view .error').textContent.includes(\"did you mean 'texture.latency_clk'\")"));
  // A value that does not fit: said, and the control goes back.
  page_->evaluate(
      "{ const field = document.querySelector('[data-key=\"tile.width\"] input[type=number]'); field.value = '20'; "
      "field.dispatchEvent(new Event('change')); }");
  EXPECT_TRUE(page_->wait_for("document.querySelector('#view .error').textContent.includes('tile.width')"));
  EXPECT_TRUE(page_->wait_for("document.querySelector('[data-key=\"tile.width\"] input[type=number]').value === '32'"));
  for (const std::string& error : page_->errors()) EXPECT_THAT(error, HasSubstr("400")) << "only the refusals";
}

TEST_F(ViewInBrowser, APressOnTheHistoryGoesBack) {
  open();
  const double before = milliseconds();
  seconds_of([&] {
    page_->evaluate(
        "{ const select = document.querySelector('[data-key=\"shading.rate\"] select'); select.value = 'sample'; "
        "select.dispatchEvent(new Event('change')); }");
  });
  EXPECT_GT(milliseconds(), before);
  seconds_of([&] { page_->evaluate("[...document.querySelectorAll('#view tbody button')].at(-1).click()"); });
  EXPECT_EQ(milliseconds(), before);
  EXPECT_EQ(page_->evaluate("document.querySelector('[data-key=\"shading.rate\"] select').value"), "pixel");
  EXPECT_EQ(page_->evaluate("Object.keys(data.stats).length > 0 && document.querySelector('#view .error').textContent"),
            "");
  expect_no_errors();
}

TEST_F(ViewInBrowser, APressMeasuresTheFrameWithoutEachDrawable) {
  open({"--size", "96x54"});
  EXPECT_EQ(page_->evaluate("document.querySelectorAll('#view .without table').length"), 0);
  page_->evaluate("document.querySelector('#view .measure').click()");
  ASSERT_TRUE(page_->wait_for("document.querySelector('#view .without > div').dataset.phase === 'done'"));
  const int drawables =
      page_->evaluate("data.stats.frames[0].drawables.filter((row) => row.node || row.material).length");
  EXPECT_GT(drawables, 1);
  EXPECT_EQ(page_->evaluate("document.querySelectorAll('#view .without tbody tr').length"), drawables);
  const json saved = page_->evaluate(
      "[...document.querySelectorAll('#view .without tbody tr')].map((row) => "
      "parseFloat(row.cells[1].textContent.replace('\u2212', '-')))");
  EXPECT_TRUE(std::is_sorted(saved.begin(), saved.end(), [](const json& a, const json& b) { return a > b; })) << saved;
  EXPECT_EQ(page_->evaluate("document.querySelector('#view .cancel').disabled"), true);
  // The selected one alone.
  page_->evaluate(
      "{ const which = document.querySelector('#view select[aria-label^=Drawable]'); which.selectedIndex = 1; "
      "document.querySelector('#view .measure').click(); }");
  EXPECT_TRUE(page_->wait_for("document.querySelectorAll('#view .without tbody tr').length === 1"));
  // Another frame: figures of the one before are not shown beside it.
  seconds_of([&] {
    page_->evaluate(
        "{ const frame = document.querySelector('#view input[aria-label=Frame]'); frame.value = '16'; "
        "frame.dispatchEvent(new "
        "Event('change')); }");
  });
  EXPECT_TRUE(page_->wait_for("document.querySelectorAll('#view .without table').length === 0"));
  expect_no_errors();
}

TEST_F(ViewInBrowser, AMeasurementIsCancelledAndRefusalsAreReported) {
  open({"--size", "1280x720", "--set", "sampling.samples_per_pixel=64"});
  page_->evaluate("document.querySelector('#view .measure').click()");
  ASSERT_TRUE(page_->wait_for("!document.querySelector('#view .cancel').disabled"));
  page_->evaluate("document.querySelector('#view .cancel').click()");
  ASSERT_TRUE(page_->wait_for("document.querySelector('#view .without > div').dataset.phase === 'cancelled'"));
  EXPECT_EQ(page_->evaluate("document.querySelector('#view .measure').disabled"), false);
  const json reply = page_->evaluate(
      "fetch('without', { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: "
      "JSON.stringify({ node: 'no such', material: '' }) }).then(async (reply) => [reply.status, (await "
      "reply.json()).error])");
  EXPECT_EQ(reply[0], 400);
  EXPECT_THAT(reply[1].get<std::string>(), HasSubstr("the frame draws no no such"));
}

TEST_F(ViewInBrowser, FetchesFromItsOwnAddressAlone) {
  open();
  const json fetched = page_->evaluate("performance.getEntriesByType('resource').map((entry) => entry.name)");
  EXPECT_GE(fetched.size(), 1u);
  for (const json& name : fetched)
    EXPECT_TRUE(name.get<std::string>().starts_with(url_) || name.get<std::string>().starts_with("data:")) << name;
  // Its policy forbids the rest.
  EXPECT_EQ(page_->evaluate("fetch('http://127.0.0.1:1/').then(() => 'fetched', (error) => error.name)"), "TypeError");
  EXPECT_THAT(page_->errors(), testing::Contains(HasSubstr("Content Security Policy")));
}

TEST_F(ViewInBrowser, EverythingIsReachedByKeysAndNamed) {
  open();
  EXPECT_EQ(page_->evaluate("[...document.querySelectorAll('a, button:enabled, select, input, "
                            "summary')].filter((element) => element.tabIndex < 0).length"),
            0);
  EXPECT_EQ(page_->evaluate("[...document.querySelectorAll('select, input')].filter((element) => "
                            "!element.labels.length && !element.getAttribute('aria-label')).length"),
            0);
}

TEST_F(ViewInBrowser, SaysWhenTheProgramHasEnded) {
  open();
  process_->interrupt();
  EXPECT_EQ(process_->wait().status, 130);
  EXPECT_TRUE(page_->wait_for("document.querySelector('.state').textContent.includes('does not answer')"));
}

}  // namespace
}  // namespace tessera::replay::view_test
