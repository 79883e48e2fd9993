// Barriers in every kind of page, as a tool finds them: axe-core, in light and dark.
#include "tests/support/accessibility.h"
#include "tests/replay/report_pages.h"
#include "tests/support/running_process.h"
#include "tests/support/tests.h"

namespace tessera::replay::accessibility_test {
namespace {

using test::LivePage;
using testing::Contains;
using testing::IsEmpty;

class AccessibilityInBrowser : public ReportInBrowser {
 protected:
  void SetUp() override {
    ReportInBrowser::SetUp();
    if (IsSkipped()) return;
    if (const std::string missing = test::missing_accessibility_tool(); !missing.empty()) GTEST_SKIP() << missing;
  }
  // All of a page, in a window so large that nothing is scrolled away, after `script`.
  static std::vector<std::string> findings(const std::string& url, const std::string& script = "") {
    LivePage page(url, 1600, 24000);
    EXPECT_TRUE(page.wait_for("document.body.dataset.ready === 'true'")) << url;
    page.evaluate("(async () => { repaintAll(); " + script + "; repaintAll(); })()");
    EXPECT_THAT(page.errors(), IsEmpty());
    return test::accessibility_findings(page);
  }
  static std::vector<std::string> findings(const std::filesystem::path& file, const std::string& script = "") {
    return findings("file://" + file.string(), script);
  }
};

// Boxes are full of their colours, a tile and a drawable are chosen, another frame is beside: text stands on all there is.
constexpr const char* kAllOfIt = R"(
  for (const frame of framesOf()) for (const unit of Object.values(frame.timing.units)) unit.utilisation = 1;
  show({ tile: 3, row: 0, other: firstOther() });
  repaintAll();
  document.querySelector('[data-unit=texture]').dispatchEvent(new MouseEvent('click'));
  await viewOf())";

TEST_F(AccessibilityInBrowser, AReplayHasNoBarrier) {
  EXPECT_THAT(findings(page("replay")), IsEmpty());
  EXPECT_THAT(findings(page("replay"), kAllOfIt), IsEmpty());
}
TEST_F(AccessibilityInBrowser, OneFrameHasNoBarrier) { EXPECT_THAT(findings(page("frame")), IsEmpty()); }
TEST_F(AccessibilityInBrowser, RunsSideBySideHaveNoBarrier) {
  EXPECT_THAT(findings(std::filesystem::path(path("replay/compare.html"))), IsEmpty());
}
TEST_F(AccessibilityInBrowser, ASweepHasNoBarrier) {
  EXPECT_THAT(findings(page("sweep"), "document.querySelector('#points tbody tr').click()"), IsEmpty());
}
TEST_F(AccessibilityInBrowser, ATradeoffHasNoBarrier) {
  EXPECT_THAT(findings(page("tradeoff"), "document.querySelector('#front tbody tr').click()"), IsEmpty());
}
TEST_F(AccessibilityInBrowser, AViewHasNoBarrier) {
  test::RunningProcess view({TESSERA_PROGRAM, "view", test::shipped_capture("eggs").string(), "--size", "320x180"});
  EXPECT_THAT(findings(view.read_line()), IsEmpty());
}

// The broken twins: a button without a name, texts of 2:1 in the document, on a bar and in a drawing.
TEST_F(AccessibilityInBrowser, ItsFaultsAreReported) {
  const std::vector<std::string> found = findings(page("replay"), R"(
    main.append(make('button', { type: 'button', id: 'nameless' }));
    main.append(make('p', { id: 'pale', style: 'color: #b4b4b4; background: #ffffff' }, 'a pale text'));
    main.append(make('p', { id: 'striped', style: 'color: #404040; background: #ffffff linear-gradient(to left, #505050 50%, transparent 0)' }, 'a text on a bar'));
    main.append(draw('svg', { width: 400, height: 40 }, draw('rect', { width: 400, height: 40, fill: '#6a6a6a' }), draw('text', { id: 'drawn', x: 10, y: 20, fill: '#9f9f9f' }, 'a text in a drawing')));)");
  for (const std::string scheme : {"light: ", "dark: "}) {
    EXPECT_THAT(found, Contains(testing::StartsWith(scheme + "button-name: #nameless: ")));
    EXPECT_THAT(found, Contains(scheme + "color-contrast: #pale: #b4b4b4 on #ffffff, 2.07 of 4.5:1"));
    EXPECT_THAT(found, Contains(testing::StartsWith(scheme + "color-contrast: #striped: #404040 on #505050, 1.")));
    EXPECT_THAT(found, Contains(testing::StartsWith(scheme + "color-contrast: #drawn: #9f9f9f on #6a6a6a, 2.")));
  }
  EXPECT_EQ(found.size(), 8u) << testing::PrintToString(found);
}

}  // namespace
}  // namespace tessera::replay::accessibility_test
