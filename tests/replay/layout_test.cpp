// The layout of every kind of page on a telephone and on a laptop, in light and dark: nothing overlaps, is cut or is too
// small to read, and axe-core finds no barrier.
#include "tests/replay/report_pages.h"
#include "tests/support/accessibility.h"
#include "tests/support/running_process.h"
#include "tests/support/tests.h"

namespace tessera::replay::layout_test {
namespace {

using test::LivePage;
using testing::Contains;
using testing::IsEmpty;
using testing::StartsWith;

class LayoutInBrowser : public ReportInBrowser {
 protected:
  static constexpr std::array<std::array<int, 2>, 2> kWindows = {{{390, 844}, {1280, 800}}};

  // Faults of a page in every window, after `script`, and the faults that axe-core finds, where it is installed.
  static std::vector<std::string> findings(const std::string& url, const std::string& script = "") {
    std::vector<std::string> all;
    for (const auto& [width, height] : kWindows) {
      LivePage page(url);
      page.resize(width, height);
      EXPECT_TRUE(page.wait_for("document.body.dataset.ready === 'true'")) << url;
      page.evaluate("(async () => { repaintAll(); " + script + "; repaintAll(); })()");
      EXPECT_THAT(page.errors(), IsEmpty());
      std::vector<std::string> found = test::layout_findings(page);
      if (test::missing_accessibility_tool().empty())
        for (std::string& finding : test::accessibility_findings(page)) found.push_back(std::move(finding));
      for (const std::string& finding : found) all.push_back(fmt::format("{} px: {}", width, finding));
    }
    return all;
  }
  static std::vector<std::string> findings(const std::filesystem::path& file, const std::string& script = "") {
    return findings("file://" + file.string(), script);
  }
};

TEST_F(LayoutInBrowser, AReplayIsLegible) {
  EXPECT_THAT(findings(page("replay")), IsEmpty());
  // A tile is pinned, a unit is open, and another frame is beside.
  EXPECT_THAT(findings(page("replay"), R"(
    show({ tile: 3, row: 0, other: firstOther() });
    repaintAll();
    document.querySelector('[data-unit=texture]').dispatchEvent(new MouseEvent('click'));
    await viewOf())"),
              IsEmpty());
}
TEST_F(LayoutInBrowser, OneFrameIsLegible) { EXPECT_THAT(findings(page("frame")), IsEmpty()); }
TEST_F(LayoutInBrowser, RunsSideBySideAreLegible) {
  EXPECT_THAT(findings(std::filesystem::path(path("replay/compare.html"))), IsEmpty());
}
TEST_F(LayoutInBrowser, ASweepIsLegible) {
  EXPECT_THAT(findings(page("sweep"), "document.querySelector('#points tbody tr').click()"), IsEmpty());
}
TEST_F(LayoutInBrowser, AStudyWithAGoalIsLegible) {
  run({"sweep", test::shipped_capture("eggs").string(), "--gpu", "entry-mobile", "--gpu", "mid-mobile", "--fps", "2000",
       "--frames", "5:6", "--size", "96x54", "--out", path("goal")});
  EXPECT_THAT(findings(page("goal"), "document.querySelector('#goal tbody tr').click()"), IsEmpty());
}
TEST_F(LayoutInBrowser, ATradeoffIsLegible) {
  EXPECT_THAT(findings(page("tradeoff"), "document.querySelector('#front tbody tr').click()"), IsEmpty());
}
TEST_F(LayoutInBrowser, TheCostsOfEffectsAreLegible) { EXPECT_THAT(findings(page("effects")), IsEmpty()); }
TEST_F(LayoutInBrowser, AViewIsLegible) {
  test::RunningProcess view({TESSERA_PROGRAM, "view", test::shipped_capture("eggs").string(), "--size", "320x180"});
  EXPECT_THAT(findings(view.read_line()), IsEmpty());
}

// The broken twin: two texts at one place, two labels that are cut, a small text, a wide paragraph and a box that scrolls
// sideways without showing it.
TEST_F(LayoutInBrowser, ItsFaultsAreReported) {
  const std::vector<std::string> found = findings(page("frame"), R"(
    const over = make('div', { id: 'over', style: 'position: relative; height: 2rem' });
    for (const text of ['planted first', 'planted second']) over.append(make('span', { style: 'position: absolute; left: 0; top: 0' }, text));
    main.append(over, make('div', { id: 'narrow', style: 'width: 4rem; overflow: hidden; white-space: nowrap' }, 'a label that does not fit'));
    main.append(draw('svg', { id: 'drawing', width: 60, height: 20, viewBox: '0 0 60 20' }, draw('text', { x: 2, y: 14, style: 'font-size: 12px' }, 'a label that leaves')));
    main.append(make('p', { id: 'small', style: 'font-size: 9px' }, 'small print'), make('p', { id: 'wide', style: 'width: 1500px' }, 'a wide paragraph'));
    main.append(make('div', { id: 'hidden', tabindex: 0, style: 'width: 8rem; overflow-x: auto; white-space: nowrap' }, 'a box that scrolls sideways'));)");
  for (const std::string window : {"390 px: light: ", "390 px: dark: ", "1280 px: light: ", "1280 px: dark: "}) {
    EXPECT_THAT(found,
                Contains(StartsWith(window + "overlap: #over > span: \"planted first\" and #over > span: \"pl")));
    EXPECT_THAT(found, Contains(window + "cut: #narrow: \"a label that does not fit\""));
    EXPECT_THAT(found, Contains(window + "cut: #drawing > text: \"a label that leaves\""));
    EXPECT_THAT(found, Contains(window + "small: #small: \"small print\" has 9.0 px"));
    EXPECT_THAT(found, Contains(StartsWith(window + "wide: the page has ")));
    EXPECT_THAT(found, Contains(window + "scroll: #hidden: scrolls sideways and does not show it"));
  }
}

}  // namespace
}  // namespace tessera::replay::layout_test
