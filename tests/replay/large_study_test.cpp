// A study of ten thousand points opens at once: its page says how many points there are before it draws them.
#include "replay/report/page_views.h"
#include "replay/report/report.h"
#include "tests/replay/report_pages.h"
#include "tests/support/live_page.h"
#include "tests/support/tests.h"

namespace tessera::replay::large_study_test {
namespace {

using test::LivePage;

class LargeStudyInBrowser : public ReportInBrowser {
 protected:
  static constexpr std::size_t kPoints = 10000;

  // Plants the page of a study of kPoints points: the points of a real study, each of whose numbers is multiplied by
  // one of eight random factors.
  static std::filesystem::path planted() {
    PageViews views;
    std::string note;
    json data = sweep_report(path("sweep"), views, note);
    json& sweep = data["sweep"];
    const json points = sweep["points"];
    json rows = sweep["rows"];
    std::erase_if(rows.get_ref<json::array_t&>(), [](const json& row) { return row[2] != "ok"; });
    sweep["points"] = sweep["rows"] = json::array();
    data["views"] = json::array();
    data["kind"] = "sweep";
    Random random(20);
    for (std::size_t k = 0; k < kPoints; ++k) {
      json row = rows[k % rows.size()], point = points[row[0].get<std::size_t>()];
      point["values"].back() = 16 + k / rows.size();
      row[0] = k;
      std::array<double, 8> factors;
      for (double& factor : factors) factor = static_cast<double>(random.uniform(1, 2));
      for (std::size_t c = 3; c < row.size(); ++c)
        if (row[c].is_number()) row[c] = std::floor(row[c].get<double>() * factors[c % factors.size()]);
      sweep["points"].push_back(std::move(point));
      sweep["rows"].push_back(std::move(row));
    }
    const std::filesystem::path file = path("large.html");
    test::write_text(file, page_text(std::move(data)));
    return file;
  }
};

TEST_F(LargeStudyInBrowser, TenThousandPointsAreThereInTwoSeconds) {
  const std::filesystem::path file = planted();
  double least = 1e9;
  // The best of three: other programs run beside.
  for (int k = 0; k < 3; ++k) {
    LivePage page("file://" + file.string(), 1280, 800);
    ASSERT_TRUE(page.wait_for("document.body.dataset.ready === 'true'"));
    least = std::min(least, std::stod(page.evaluate("document.body.dataset.first").get<std::string>()));
    EXPECT_THAT(page.evaluate("document.querySelector('#study p').textContent"),
                testing::StartsWith("10000 points: 10000 "));
    EXPECT_EQ(page.evaluate("document.querySelector('#parallel canvas').dataset.lines"), "10000");
    EXPECT_EQ(page.evaluate("document.body.dataset.errors"), "0");
  }
  RecordProperty("first_milliseconds", static_cast<int>(least));
  EXPECT_LE(least, 2000) << "milliseconds until the first section is there";
}

// By the Tab key one stop; arrows choose among all lines, Enter shows the point.
TEST_F(LargeStudyInBrowser, AllLinesAreOneStopAndAreChosenByKeys) {
  LivePage page("file://" + ReportInBrowser::page("sweep").string(), 1280, 800);
  ASSERT_TRUE(page.wait_for("document.body.dataset.ready === 'true'"));
  EXPECT_EQ(page.evaluate("[...document.querySelectorAll('#parallel [tabindex]')].length"), 1);
  ASSERT_TRUE(page.tab_to("#parallel .stage"));
  const auto says = [&] {
    return page.evaluate("document.querySelector('#parallel p[aria-live]').textContent").get<std::string>();
  };
  page.press("ArrowUp");
  EXPECT_THAT(says(), testing::StartsWith("tile.width: line 1 of "));
  const std::string first = says();
  page.press("ArrowUp");
  EXPECT_THAT(says(), testing::StartsWith("tile.width: line 2 of "));
  page.press("ArrowDown");
  EXPECT_EQ(says(), first);
  page.press("ArrowRight");
  EXPECT_THAT(says(), testing::StartsWith("tile.height: line "));
  page.press("Enter");
  const std::string shown = page.evaluate("document.querySelector('#pareto h3').textContent");
  EXPECT_THAT(says(), HasSubstr(shown.substr(0, shown.find(':'))));
}

// The space bar marks the ends of a range of the column; Delete drops the range.
TEST_F(LargeStudyInBrowser, ARangeIsKeptByKeys) {
  LivePage page("file://" + ReportInBrowser::page("sweep").string(), 1280, 800);
  ASSERT_TRUE(page.wait_for("document.body.dataset.ready === 'true'"));
  const auto within = [&] {
    return std::stoi(page.evaluate("document.querySelector('#parallel canvas').dataset.lines").get<std::string>());
  };
  const int all = within();
  // Points of the least width of a tile, counted in the study's own data.
  const int least = page.evaluate(R"((() => {
    const column = data.sweep.axes.indexOf('tile.width'), values = data.sweep.points.map((point) => point.values[column]);
    return values.filter((value) => value === Math.min(...values)).length;
  })())");
  ASSERT_LT(least, all);
  ASSERT_TRUE(page.tab_to("#parallel .stage"));
  page.press("ArrowUp");
  page.press(" ");
  EXPECT_EQ(within(), all) << "one end is no range";
  page.press(" ");
  EXPECT_EQ(within(), least);
  page.press("Delete");
  EXPECT_EQ(within(), all);
}

}  // namespace
}  // namespace tessera::replay::large_study_test
