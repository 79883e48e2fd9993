// Questions that a reader comes with, answered by the pages: by the mouse, and by the keyboard alone.
#include "tests/replay/report_pages.h"
#include "tests/support/live_page.h"
#include "tests/support/tests.h"

namespace tessera::replay::questions_test {
namespace {

using test::LivePage;
using testing::StartsWith;

class QuestionsInBrowser : public ReportInBrowser {
 protected:
  static std::unique_ptr<LivePage> open(const std::string& name) {
    auto page = std::make_unique<LivePage>("file://" + ReportInBrowser::page(name).string(), 1280, 800);
    EXPECT_TRUE(page->wait_for("document.body.dataset.ready === 'true'"));
    page->evaluate("repaintAll()");
    return page;
  }
  static std::string text(LivePage& page, const std::string& selector) {
    return page.evaluate("document.querySelector(" + json(selector).dump() + ").textContent");
  }
  // Presses an element by the mouse, or by Tab and Enter.
  static void press(LivePage& page, const std::string& selector, bool by_keys) {
    if (!by_keys) return page.click(selector);
    ASSERT_TRUE(page.tab_to(selector)) << selector;
    page.press("Enter");
  }
  static json stats(const std::string& name) { return json::parse(test::read_text(path(name + "/stats.json"))); }
};

// Which of three machines holds a frame rate under a power? One is too slow, one takes too much.
TEST_F(QuestionsInBrowser, WhichMachineHoldsTheRate) {
  run({"sweep", test::shipped_capture("eggs").string(), "--gpu", "entry-mobile", "--gpu", "mid-mobile", "--gpu",
       "high-mobile", "--fps", "2000", "--watts", "0.4", "--frames", "5:6", "--size", "96x54", "--out", path("three")});
  for (const bool by_keys : {false, true}) {
    const auto page = open("three");
    EXPECT_THAT(text(*page, "main section .verdict"), StartsWith("Best: gpu = mid-mobile"));
    EXPECT_THAT(text(*page, "#goal .note"), HasSubstr("1 of 3 candidates meet the limits"));
    press(*page, "#goal tbody tr", by_keys);
    EXPECT_THAT(text(*page, "#pareto h3"), HasSubstr("gpu = mid-mobile"));
  }
}

// Which point of a study wins? The oracle is the least of the study's own table.
TEST_F(QuestionsInBrowser, WhichPointOfASweepWins) {
  const json study = {{"captures", {test::shipped_capture("eggs").string()}},
                      {"size", "96x54"},
                      {"axes", {{{"key", "frontend.split_pixels"}, {"values", {8, 16, 64}}}}},
                      {"goal", {{"minimise", "timing.cycles"}}}};
  test::write_text(path("winner.json"), study.dump());
  run({"sweep", path("winner.json"), "--out", path("winner")});
  for (const bool by_keys : {false, true}) {
    const auto page = open("winner");
    const std::string least = page->evaluate(R"((() => {
      const { rows, columns, points } = data.sweep, column = columns.indexOf('timing.cycles') + 3;
      return `Best: frontend.split_pixels = ${points[[...rows].sort((a, b) => a[column] - b[column])[0][0]].values[0]}`;
    })())");
    EXPECT_THAT(text(*page, "#goal .verdict"), StartsWith(least + ","));
    // The others are beaten, and folded.
    EXPECT_EQ(page->evaluate("document.querySelectorAll('#goal > .scroll tbody tr').length"), 1);
    EXPECT_EQ(text(*page, "#goal summary"), "2 candidates that another beats in all of these columns");
    press(*page, "#goal tbody tr", by_keys);
    EXPECT_THAT(text(*page, "#pareto h3"), HasSubstr(least.substr(6)));
  }
}

// Rows of a table are one stop of the Tab key, and arrow keys go between them.
TEST_F(QuestionsInBrowser, RowsAreChosenByArrows) {
  const auto page = open("sweep");
  ASSERT_GE(page->evaluate("document.querySelectorAll('#points tbody tr').length"), 3);
  EXPECT_EQ(page->evaluate("document.querySelectorAll('#points tbody tr[tabindex=\"0\"]').length"), 1);
  ASSERT_TRUE(page->tab_to("#points tbody tr"));
  const std::array<std::pair<const char*, int>, 5> keys = {
      {{"ArrowDown", 1}, {"ArrowUp", 0}, {"ArrowUp", 0}, {"End", -1}, {"Home", 0}}};
  for (const auto& [key, row] : keys) {
    page->press(key);
    EXPECT_EQ(page->evaluate("document.activeElement === [...document.querySelectorAll('#points tbody tr')].at(" +
                             std::to_string(row) + ")"),
              true)
        << key;
  }
  page->press("ArrowDown");
  page->press("Enter");
  EXPECT_THAT(text(*page, "#pareto h3"),
              StartsWith("Point " + text(*page, "#points tbody tr:nth-child(2) td:first-child") + ":"));
  EXPECT_EQ(page->evaluate("document.querySelectorAll('#points tbody tr[tabindex=\"0\"]').length"), 1);
}

// Arrow keys go through the marks of a plot from left to right, the hint says the mark, and Enter presses it.
TEST_F(QuestionsInBrowser, MarksOfAPlotAreChosenByArrows) {
  const auto page = open("sweep");
  ASSERT_TRUE(page->tab_to("#pareto .plot"));
  page->press("ArrowRight");
  EXPECT_EQ(page->evaluate("document.querySelector('#pareto .ring').hidden"), false);
  const std::string first = text(*page, ".hint");
  page->press("ArrowRight");
  EXPECT_NE(text(*page, ".hint"), first);
  page->press("ArrowLeft");
  EXPECT_EQ(text(*page, ".hint"), first);
  page->press("Enter");
  // The hint names the values of the axes, as the heading of the point does.
  const std::string shown = text(*page, "#pareto h3"), said = shown.substr(shown.find(": ") + 2);
  EXPECT_THAT(first, StartsWith(said));
  // The mark lies under the ring: a press of the mouse at its middle shows the same point.
  page->evaluate("document.querySelector('#pareto h3').textContent = ''");
  page->click("#pareto .ring");
  EXPECT_EQ(text(*page, "#pareto h3"), shown);
}

// Is binning before tessellation better for this content? A sentence says it, and the contents lead there.
TEST_F(QuestionsInBrowser, IsBinningBeforeTessellationBetter) {
  const std::string sentence = stats("replay")["total"]["baseline_verdict"]["sentence"];
  ASSERT_THAT(sentence, StartsWith("tessera against the best that ships: "));
  for (const bool by_keys : {false, true}) {
    const auto page = open("replay");
    press(*page, "#contents a[href='#baselines']", by_keys);
    EXPECT_EQ(text(*page, "#baselines .verdict"), sentence);
    EXPECT_TRUE(
        page->wait_for("(() => { const box = document.querySelector('#baselines .verdict').getBoundingClientRect(); "
                       "return box.top >= 0 && box.bottom <= innerHeight; })()",
                       5));
  }
}

// Which object costs most? The first row of the table; a press shows where it is.
TEST_F(QuestionsInBrowser, WhichObjectCostsMost) {
  json drawables = stats("replay")["frames"][0]["drawables"];
  const auto most = std::max_element(drawables.begin(), drawables.end(),
                                     [](const json& a, const json& b) { return a["cycles"] < b["cycles"]; });
  for (const bool by_keys : {false, true}) {
    const auto page = open("replay");
    const std::string row = "#frames .costs table tbody tr";
    EXPECT_THAT(text(*page, row), StartsWith((*most)["node"].get<std::string>()));
    press(*page, row, by_keys);
    EXPECT_EQ(page->evaluate("frameOf().drawables[shown.row].node"), (*most)["node"]);
  }
}

// Why is a frame slower? One press goes to the slowest, and its causes are on the page.
TEST_F(QuestionsInBrowser, WhyIsAFrameSlower) {
  const json frames = stats("replay")["frames"];
  std::size_t slowest = 0;
  for (std::size_t k = 1; k < frames.size(); ++k)
    if (frames[k]["timing"]["cycles"] > frames[slowest]["timing"]["cycles"]) slowest = k;
  for (const bool by_keys : {false, true}) {
    const auto page = open("replay");
    page->evaluate(
        "show({ frame: " + std::to_string((slowest + 1) % frames.size()) +
        " }); [...document.querySelectorAll('.bar button')].find((button) => button.textContent === 'Slowest "
        "frame').id = 'slowest'; true");
    press(*page, "#slowest", by_keys);
    EXPECT_EQ(page->evaluate("shown.frame"), slowest);
    page->evaluate("repaintAll()");
    EXPECT_THAT(page->evaluate("[...document.querySelectorAll('#rates h3')].map((head) => head.textContent).join()"),
                HasSubstr(fmt::format("Why frame {} (B) is the slowest", frames[slowest]["frame"].get<int>())));
    EXPECT_GE(page->evaluate("document.querySelectorAll('#rates .why li').length"), 1);
  }
}

}  // namespace
}  // namespace tessera::replay::questions_test
