#pragma once

#include "tests/support/browser.h"
#include "tests/support/tests.h"

namespace tessera::replay {

// Reports of every kind that a folder can give, made once: ctest runs all of these suites in one process.
class Report : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    static const bool kMade = (make(), true);
    ASSERT_TRUE(kMade && std::filesystem::exists(page("tradeoff"))) << "the pages of these tests were not made";
  }
  static void make() {
    run({"replay", test::shipped_capture("flyby").string(), "--frames", "0:3", "--size", "320x180", "--baselines",
         "--out", path("replay")});
    run({"replay", test::shipped_capture("flyby").string(), "--frames", "0:3", "--size", "320x180", "--set",
         "tile.width=16", "--set", "tile.height=16", "--out", path("other")});
    run({"report", path("replay"), path("other")});
    run({"replay", test::shipped_capture("eggs").string(), "--size", "96x54", "--region", "10,8,70,40", "--out",
         path("frame")});
    run({"replay", test::shipped_capture("city_evening").string(), "--frames", "0:1", "--size", "96x54", "--out",
         path("passes")});
    const nlohmann::json axes = {{{"keys", {"tile.width", "tile.height"}}, {"values", {16, 20, 32}}},
                                 {{"key", "frontend.split_pixels"}, {"values", {16, 64}}}};
    // A text that would end its script, if it were not escaped.
    const nlohmann::json study = {{"title", "A study </script><script>complain('escaped')</script>"},
                                  {"captures", {test::shipped_capture("eggs").string()}},
                                  {"size", "128x72"},
                                  {"pictures", true},
                                  {"axes", axes}};
    test::write_text(path("study.json"), study.dump());
    run({"sweep", path("study.json"), "--out", path("sweep")});
    run({"sweep", path("study.json"), "--out", path("shard"), "--shard", "1/2"});
    run({"report", path("shard")});
    // A file name that would be markup, if it were not escaped.
    std::filesystem::copy_file(test::shipped_capture("eggs"), path("a <b onclick='complain()'>&amp;.glb"));
    run({"tradeoff",
         path("a <b onclick='complain()'>&amp;.glb"),
         "--size",
         "96x54",
         "--knobs",
         "samples,arithmetic,advection",
         "--joint",
         "samples,shading",
         "--rounds",
         "1",
         "--run",
         "1",
         "--reference-samples",
         "16",
         "--max-flip",
         "0.9",
         "--set",
         "tile.width=16",
         "--out",
         path("tradeoff")});
    run({"tradeoff", test::shipped_capture("eggs").string(), "--size", "96x54", "--effects", "--rounds", "1", "--out",
         path("effects")});
  }
  static void run(std::vector<std::string> arguments) {
    if (arguments[0] != "report") arguments.push_back("--quiet");
    const test::ProcessResult r = test::run_tessera(arguments);
    ASSERT_EQ(r.status, 0) << r.errors;
  }
  static std::string path(const std::string& name) {
    static const test::TemporaryFolder kFolder;
    return (kFolder / name).string();
  }
  static std::filesystem::path page(const std::string& name) {
    return std::filesystem::path(path(name)) / "report.html";
  }
};

// Pages as a browser shows them.
class ReportInBrowser : public Report {
 protected:
  void SetUp() override {
    if (!test::has_browser()) GTEST_SKIP() << "needs Debian's chromium";
  }
  // The page of `name` with a further script, run when all is drawn, whose findings are attributes of the body.
  static test::OpenedPage open_with(const std::string& name, const std::string& script, bool dark = false,
                                    const std::string& address = "") {
    std::string text = test::read_text(page(name));
    text.insert(text.rfind("</body>"), "<script>pageReady.then(async () => {" + script + "});</script>");
    test::write_text(path("with.html"), text);
    return test::open_page(path("with.html"), address, dark);
  }
};

}  // namespace tessera::replay
