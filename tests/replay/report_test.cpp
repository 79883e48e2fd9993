// report.html, opened as a reader would: in a browser without a network.
#include <fmt/ranges.h>
#include <regex>

#include "base/image_codec.h"
#include "replay/report/page_parts.h"
#include "tests/replay/report_pages.h"
#include "tests/support/browser.h"
#include "tests/support/tests.h"

namespace tessera::replay::report_test {
namespace {

using test::OpenedPage;

const std::vector<std::string> kPages = {"replay", "frame", "sweep", "shard", "tradeoff"};

TEST_F(ReportInBrowser, OpensWithoutScriptErrors) {
  for (const std::string& name : kPages) {
    const OpenedPage opened = test::open_page(page(name));
    EXPECT_EQ(opened.console, "") << name;
    EXPECT_EQ(test::body_attribute(opened, "data-errors"), "0") << name;
    EXPECT_EQ(test::body_attribute(opened, "data-ready"), "true") << name << ": all plots are drawn";
    EXPECT_THAT(opened.dom, HasSubstr("<svg")) << name;
  }
}

TEST_F(ReportInBrowser, AScriptErrorIsNoticed) {
  const OpenedPage opened = open_with("replay", "noSuchFunction();");
  EXPECT_EQ(test::body_attribute(opened, "data-errors"), "1");
  EXPECT_THAT(opened.console, HasSubstr("noSuchFunction"));
}

TEST_F(Report, NeedsNoOtherFileAndNoNetwork) {
  static const std::regex kFetched("(src|href)=[\"'](?!data:|#)|@import|url\\(");
  for (const std::string& name : kPages) {
    // Skips scripts: the check below looks at their requests.
    std::string markup = test::read_text(page(name));
    for (std::size_t at = 0; (at = markup.find("<script", at)) != std::string::npos;)
      markup.erase(at, markup.find("</script>", at) + 9 - at);
    EXPECT_FALSE(std::regex_search(markup, kFetched)) << name;
  }
}

TEST_F(ReportInBrowser, FetchesNothing) {
  const OpenedPage opened =
      open_with("replay",
                "document.body.dataset.fetched = performance.getEntriesByType('resource').filter((entry) => "
                "!entry.name.startsWith('data:')).length;");
  EXPECT_EQ(test::body_attribute(opened, "data-fetched"), "0");
}

TEST_F(ReportInBrowser, SectionsPlotsAndTablesAreThere) {
  const OpenedPage replay = test::open_page(page("replay")), sweep = test::open_page(page("sweep"));
  for (const char* id : {"frames", "memory", "queues", "baselines", "counters", "effects", "configuration"})
    EXPECT_THAT(replay.dom, HasSubstr("<section id=\"" + std::string(id) + "\"")) << id;
  for (const char* id : {"study", "pareto", "curves", "purposes", "frames", "points", "configuration"})
    EXPECT_THAT(sweep.dom, HasSubstr("<section id=\"" + std::string(id) + "\"")) << id;
  // Every counter, setting and number of the machine.
  for (const char* text : {"tilecore.triangle_tests", "sampling.samples_per_pixel", "parameter_buffer.bytes"})
    EXPECT_THAT(replay.dom, HasSubstr(text));
  EXPECT_THAT(sweep.dom,
              HasSubstr("6 points: 4 with results, 0 not done yet, 2 with values that do not fit each other"));
  EXPECT_THAT(test::open_page(page("shard")).dom, HasSubstr("3 not done yet"));
}

TEST_F(ReportInBrowser, CyclesAndEnergyAreShownWhereTheModelRan) {
  const json frame = json::parse(test::read_text(path("replay/stats.json")))["frames"][2];
  std::string cycles = std::to_string(frame["timing"]["cycles"].get<std::uint64_t>());
  for (std::size_t at = cycles.size(); at > 3;) cycles.insert(at -= 3, "\u202f");  // narrow spaces between thousands
  const OpenedPage opened = test::open_page(page("replay"), "frame=2");
  const std::string bound_by = frame["timing"]["bound_by"];
  for (const std::string& text : {std::string("<section id=\"timing\""), std::string("<section id=\"energy\""),
                                  cycles + " cycles, bound by " + bound_by + "."})
    EXPECT_THAT(opened.dom, HasSubstr(text));
  run({"replay", test::shipped_capture("eggs").string(), "--size", "32x18", "--set", "output.machine_model=false",
       "--out", path("untimed")});
  const OpenedPage untimed = test::open_page(page("untimed"));
  EXPECT_EQ(test::body_attribute(untimed, "data-errors"), "0") << untimed.console;
  for (const char* text : {"<section id=\"timing\"", "<section id=\"energy\""})
    EXPECT_THAT(untimed.dom, testing::Not(HasSubstr(text)));
}

TEST_F(ReportInBrowser, TextsOfFilesNeverBecomeMarkup) {
  const OpenedPage opened = test::open_page(page("sweep"));
  EXPECT_EQ(test::body_attribute(opened, "data-errors"), "0");
  EXPECT_THAT(opened.dom, HasSubstr("A study &lt;/script&gt;&lt;script&gt;complain('escaped')&lt;/script&gt;</h1>"));
}

// The plots show the table's rows from the start, when the address fixes an axis.
TEST_F(ReportInBrowser, AnAxisHeldFixedByTheAddressIsHeldFromTheStart) {
  std::istringstream lines(test::read_text(path("sweep/sweep.csv")));
  std::vector<std::string> head, expected;
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> cells;
    std::istringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
    if (head.empty()) head = cells;
    const auto cell = [&](const char* name) {
      return cells.at(static_cast<std::size_t>(std::find(head.begin(), head.end(), name) - head.begin()));
    };
    if (cell("tile.width") == "32") expected.push_back(cell("binner.queue_bytes_peak"));
  }
  ASSERT_EQ(expected.size(), 2u);
  const auto values = [&](const std::string& fragment) {
    return test::body_attribute(open_with("sweep",
                                          "document.body.dataset.values = drawn.find((entry) => "
                                          "entry.place.closest('#curves')).rows().map((row) => row.raw_y).join(' ');",
                                          false, fragment),
                                "data-values");
  };
  const std::string address =
      "curves.along=frontend.split_pixels&curves.lines=frontend.split_pixels&curves.column=binner.queue_bytes_peak";
  EXPECT_EQ(values(address + "&curves.tile.width=32"), expected[0] + " " + expected[1]);
  EXPECT_NE(values(address), expected[0] + " " + expected[1]);
}

// ---- A tradeoff -------------------------------------------------------------------------------------------------

template <class Base>
class OfTradeoff : public Base {
 protected:
  static json tradeoff() { return json::parse(test::read_text(Base::path("tradeoff/tradeoff.json"))); }
  static json knob(const std::string& name) {
    const json result = tradeoff();
    return *std::find_if(result["knobs"].begin(), result["knobs"].end(),
                         [&](const json& k) { return k["name"] == name; });
  }
  // As the page writes numbers: narrow spaces between thousands.
  static std::string grouped(std::uint64_t value) {
    std::string text = std::to_string(value);
    for (std::size_t at = text.size(); at > 3;) text.insert(at -= 3, "\u202f");
    return text;
  }
};
using TradeoffReport = OfTradeoff<Report>;
using TradeoffReportInBrowser = OfTradeoff<ReportInBrowser>;

TEST_F(TradeoffReportInBrowser, EveryKnobHasItsSectionWithItsSettingsOrTheReasonWhyItIsLeftOut) {
  const json result = tradeoff();
  const std::string dom = test::open_page(page("tradeoff")).dom;
  for (const char* id : {"summary", "front", "convergence", "configuration"})
    EXPECT_THAT(dom, HasSubstr("<section id=\"" + std::string(id) + "\"")) << id;
  std::size_t skipped = 0, settings = 0;
  for (const json& k : result["knobs"]) {
    EXPECT_THAT(dom, HasSubstr("<section id=\"knob-" + k["name"].get<std::string>() + "\""));
    if (const std::string reason = k["skipped"]; !reason.empty()) {
      EXPECT_THAT(dom, HasSubstr("Left out: " + reason + "."));
      ++skipped;
    }
    if (k["idle"] == true) {
      std::vector<std::string> labels;
      for (const json& row : k["settings"]) labels.push_back(row["label"]);
      EXPECT_THAT(dom, HasSubstr(fmt::format("Without effect here: {} give the same image", fmt::join(labels, ", "))));
    }
    for (const json& row : k["settings"]) {
      ++settings;
      if (k["idle"] == true) continue;
      EXPECT_THAT(dom, HasSubstr("<li>" + row["says"].get<std::string>() + "</li>"));
      if (row["cycles"].is_null()) continue;
      EXPECT_THAT(dom, HasSubstr("<td class=\"number\">" + grouped(row["cycles"]) + "</td>")) << row["label"];
    }
  }
  EXPECT_EQ(skipped, 1u) << "nothing is advected in a first frame";
  EXPECT_THAT(dom, HasSubstr(std::to_string(settings) + " settings of " +
                             std::to_string(result["knobs"].size() - skipped) + " knobs"));
  EXPECT_THAT(dom, HasSubstr("<pre>" + result["cheapest"]["setting"]["arguments"].get<std::string>() + "</pre>"));
}

// The page finds the front by itself; so did the program.
TEST_F(TradeoffReportInBrowser, ThePlottedFrontIsTheOneOfTheResult) {
  const json rows = knob("joint")["settings"];
  std::set<std::string> expected, all;
  for (const json& row : rows) {
    all.insert(row["label"].get<std::string>());
    if (row["front"]["ms"] == true) expected.insert(row["label"].get<std::string>());
  }
  ASSERT_FALSE(expected.empty());
  ASSERT_LT(expected.size(), all.size());
  const OpenedPage opened =
      open_with("tradeoff",
                "const rows = drawn.find((entry) => entry.place.closest('#front')).rows(), label = (row) => "
                "data.tradeoff.knobs.flatMap((knob) => knob.settings)[row.index].label;"
                "document.body.dataset.front = rows.filter((row) => row.front).map(label).join(';'); "
                "document.body.dataset.all = rows.map(label).join(';');",
                false, "front.knob=joint");
  const auto labels = [&](const char* name) {
    std::set<std::string> out;
    std::istringstream stream(test::body_attribute(opened, name));
    for (std::string label; std::getline(stream, label, ';');) out.insert(label);
    return out;
  };
  EXPECT_EQ(labels("data-front"), expected);
  EXPECT_EQ(labels("data-all"), all);
}

TEST_F(TradeoffReportInBrowser, ASettingIsChosenByKeysAndShowsItsArguments) {
  const json row = knob("samples")["settings"][1];
  const OpenedPage opened = open_with("tradeoff", R"(
    const line = [...document.querySelectorAll('#front tbody tr')][1];
    line.dispatchEvent(new KeyboardEvent('keydown', { key: 'Enter', bubbles: true }));
    document.body.dataset.said = document.querySelector('#front [aria-live]').textContent;
    document.body.dataset.unreachable = [...document.querySelectorAll('a, button, select, input, summary')].filter((element) => element.tabIndex < 0).length;
    document.body.dataset.unnamed = [...document.querySelectorAll('select, input')].filter((element) => !element.labels.length && !element.getAttribute('aria-label')).length;)");
  const std::string said = test::body_attribute(opened, "data-said");
  EXPECT_THAT(said, HasSubstr(row["label"].get<std::string>()));
  EXPECT_THAT(said, HasSubstr(row["says"].get<std::string>()));
  EXPECT_THAT(said, HasSubstr(row["arguments"].get<std::string>()));
  EXPECT_EQ(test::body_attribute(opened, "data-unreachable"), "0");
  EXPECT_EQ(test::body_attribute(opened, "data-unnamed"), "0");
}

TEST_F(TradeoffReportInBrowser, AnAxisOfErrorsOrCostsFollowsTheAddress) {
  const auto shown = [&](const std::string& fragment) {
    return test::body_attribute(
        open_with("tradeoff",
                  "document.body.dataset.points = drawn.find((entry) => "
                  "entry.place.closest('#front')).rows().map((row) => row.raw_x + ' ' + row.raw_y).join(';');",
                  false, fragment),
        "data-points");
  };
  std::string expected, wrong;
  const json samples = knob("samples");
  for (const json& row : samples["settings"]) {
    const auto add = [](std::string& to, const json& x, const json& y) {
      to += (to.empty() ? "" : ";") + x.dump() + " " + y.dump();
    };
    add(expected, row["dram_bytes"], row["error"]["max_error"]);
    add(wrong, row["ms"], row["error"]["flip"]);
  }
  const std::string points = shown("front.knob=samples&front.across=dram_bytes&front.up=max_error");
  EXPECT_EQ(points, expected);
  EXPECT_NE(points, wrong);
  EXPECT_EQ(shown("front.knob=samples"), wrong);
}

TEST_F(TradeoffReportInBrowser, AFileNameNeverBecomesMarkup) {
  const OpenedPage opened = test::open_page(page("tradeoff"));
  EXPECT_THAT(opened.dom, HasSubstr("Cost of accuracy: a &lt;b onclick='complain()'&gt;&amp;amp;.glb</h1>"));
  EXPECT_THAT(opened.dom, testing::Not(HasSubstr("<b onclick")));
}

// Each effect has a row: an effect that ran has the frame's cost less the cost of the frame without it; the others
// have the reason.
TEST_F(ReportInBrowser, ATradeoffOfEffectsHasACostForEachThatRanAndAReasonForTheOthers) {
  const json all = json::parse(test::read_text(path("effects/tradeoff.json"))), settings = all["knobs"][0]["settings"];
  const OpenedPage opened = open_with("effects", R"(
    const rows = (id) => [...document.querySelectorAll(`#${id} > .scroll tbody tr`)].map((row) => [...row.cells].map((cell) => cell.textContent.replaceAll('\u202f', '')).join('|')).join(';');
    document.body.dataset.ran = rows('effects');
    document.body.dataset.absent = rows('absent');)");
  EXPECT_EQ(test::body_attribute(opened, "data-errors"), "0") << opened.console;
  const std::string ran = test::body_attribute(opened, "data-ran"),
                    absent = test::body_attribute(opened, "data-absent");
  int count = 0;
  for (const json& effect : all["effects"]) {
    std::string name = effect["name"];
    std::replace(name.begin(), name.end(), '_', ' ');
    if (!effect["ran"].get<bool>()) {
      EXPECT_THAT(absent, HasSubstr(name + "|0|" + effect["reason"].get<std::string>()));
      continue;
    }
    ++count;
    const json without = settings[effect["setting"].get<std::size_t>()];
    const auto more = settings[0]["dram_bytes"].get<std::int64_t>() - without["dram_bytes"].get<std::int64_t>();
    const json decibels = without["error"]["psnr_db"];
    const std::size_t at = ran.find(name + "|");
    ASSERT_NE(at, std::string::npos) << name << " in " << ran;
    const std::string row = ran.substr(at, ran.find(';', at) - at);
    EXPECT_THAT(row, HasSubstr(fmt::format("|{} (", more)));
    EXPECT_THAT(row,
                HasSubstr(decibels.is_null() ? std::string("|the same|")
                                             : fmt::format("|{:g}|", std::round(10 * decibels.get<double>()) / 10)));
    EXPECT_TRUE(row.ends_with(fmt::format("|{}|{}", effect["tiles"].get<int>(), effect["sub_patches"].get<int>())))
        << row;
  }
  EXPECT_GE(count, 3);
}

// The same without a browser: the page of effects needs all of it.
TEST_F(Report, EffectsWithoutAMemberOfThePageEndWithStatus3) {
  const json sound = json::parse(test::read_text(path("effects/tradeoff.json")));
  fs::create_directories(path("few"));
  for (const char* member :
       {"name", "ran", "reason", "without", "stays", "tiles", "sub_patches", "counters", "setting"}) {
    json lacking = sound, other = sound;
    lacking["effects"][0].erase(member);
    other["effects"][0][member] = json::array();
    for (const json& broken : {lacking, other}) {
      test::write_text(path("few/tradeoff.json"), broken.dump());
      const ProcessResult r = run_tessera({"report", path("few")});
      EXPECT_EQ(r.status, 3) << member << ": " << r.errors;
    }
  }
  json outside = sound;
  outside["effects"][0]["setting"] = sound["knobs"][0]["settings"].size();
  test::write_text(path("few/tradeoff.json"), outside.dump());
  EXPECT_THAT(run_tessera({"report", path("few")}).errors, HasSubstr("is not the number of a setting"));
}

// Members that the page reads, each removed or given another type in turn.
TEST_F(TradeoffReport, AResultWithoutAMemberOfThePageEndsWithStatus3) {
  const json sound = tradeoff();
  fs::create_directories(path("lacking"));
  std::vector<json::json_pointer> places;
  for (const char* place : {"/schema",
                            "/stopped",
                            "/capture",
                            "/frame",
                            "/size",
                            "/size/1",
                            "/rounds",
                            "/settings",
                            "/gpu",
                            "/knobs",
                            "/reference",
                            "/reference/samples",
                            "/reference/edge_pixels",
                            "/reference/psnr_db",
                            "/reference/convergence",
                            "/reference/convergence/samples",
                            "/reference/convergence/rms_error",
                            "/reference/convergence/slope",
                            "/reference/convergence/size",
                            "/cheapest/setting",
                            "/cheapest/cost",
                            "/knobs/0/name",
                            "/knobs/0/title",
                            "/knobs/0/settings",
                            "/knobs/0/settings/1/label",
                            "/knobs/0/settings/1/says",
                            "/knobs/0/settings/1/arguments",
                            "/knobs/0/settings/1/error",
                            "/knobs/0/settings/1/error/flip",
                            "/knobs/0/settings/1/error/ssim",
                            "/knobs/0/settings/1/error/psnr_db",
                            "/knobs/0/settings/1/error/max_error",
                            "/knobs/0/settings/1/cycles",
                            "/knobs/0/settings/1/front",
                            "/knobs/0/settings/1/host",
                            "/knobs/0/settings/1/host/seconds/median",
                            "/knobs/0/settings/1/host/seconds/low",
                            "/knobs/0/settings/1/host/processor_seconds"})
    places.emplace_back(place);
  for (const json::json_pointer& place : places) {
    ASSERT_TRUE(sound.contains(place)) << place.to_string();
    json lacking = sound, other = sound;
    json& holder = lacking[place.parent_pointer()];
    if (holder.is_object())
      holder.erase(place.back());
    else
      holder.erase(std::stoul(place.back()));
    other[place] = json::array({json::array()});
    for (const json& broken : {lacking, other}) {
      test::write_text(path("lacking/tradeoff.json"), broken.dump());
      const ProcessResult r = run_tessera({"report", path("lacking")});
      EXPECT_EQ(r.status, 3) << place.to_string() << ": " << r.errors;
      EXPECT_THAT(r.errors, HasSubstr("tradeoff.json")) << place.to_string();
      EXPECT_FALSE(fs::exists(page("lacking"))) << place.to_string();
    }
  }
  test::write_text(path("lacking/tradeoff.json"), sound.dump());
  EXPECT_EQ(run_tessera({"report", path("lacking")}).status, 0);
}

// ---- How pages look ---------------------------------------------------------------------------------------------

TEST_F(ReportInBrowser, FollowsTheReadersWishForDarkOrLight) {
  const std::string script =
      "document.body.dataset.ground = getComputedStyle(document.body).backgroundColor; document.body.dataset.axis = "
      "plotTheme().axis.titleColor;";
  const OpenedPage light = open_with("replay", script, false), dark = open_with("replay", script, true);
  EXPECT_EQ(test::body_attribute(light, "data-ground"), "rgb(255, 255, 255)");
  EXPECT_EQ(test::body_attribute(dark, "data-ground"), "rgb(20, 23, 27)");
  EXPECT_NE(test::body_attribute(light, "data-axis"), test::body_attribute(dark, "data-axis")) << "plots follow";
  EXPECT_EQ(test::body_attribute(dark, "data-errors"), "0");
}

// Relative luminance and contrast as WCAG 2.1 defines them.
double luminance(const std::string& color) {
  double sum = 0;
  const double weights[] = {0.2126, 0.7152, 0.0722};
  for (std::size_t c = 0; c < 3; ++c) {
    const double value = static_cast<double>(std::stoi(color.substr(1 + 2 * c, 2), nullptr, 16)) / 255;
    sum += weights[c] * (value <= 0.03928 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4));
  }
  return sum;
}
double contrast(const std::string& a, const std::string& b) {
  const double x = luminance(a), y = luminance(b);
  return (std::max(x, y) + 0.05) / (std::min(x, y) + 0.05);
}

// WCAG 2.1: text 4.5 (7 for most of it), drawings 3.
TEST(ReportColors, TextAndDrawingsAreReadableInDarkAndLight) {
  const std::string css(page_files().at("page.css")), units(page_files().at("units.js"));
  static const std::regex kRoot(":root \\{([^}]*)\\}"), kColor("--([a-z]+): (#[0-9a-f]{6})"),
      kDrawn("'(#[0-9a-f]{6})'");
  int schemes = 0;
  for (auto root = std::sregex_iterator(css.begin(), css.end(), kRoot); root != std::sregex_iterator();
       ++root, ++schemes) {
    const std::string body = (*root)[1];
    std::map<std::string, std::string> color;
    for (auto at = std::sregex_iterator(body.begin(), body.end(), kColor); at != std::sregex_iterator(); ++at)
      color[(*at)[1]] = (*at)[2];
    for (const char* ground : {"ground", "panel"}) {
      EXPECT_GE(contrast(color.at("ink"), color.at(ground)), 7.0) << ground;
      for (const char* text : {"quiet", "accent", "mark", "good"})
        EXPECT_GE(contrast(color.at(text), color.at(ground)), 4.5) << text << " on " << ground;
      for (auto at = std::sregex_iterator(units.begin(), units.end(), kDrawn); at != std::sregex_iterator(); ++at)
        EXPECT_GE(contrast((*at)[1], color.at(ground)), 3.0)
            << (*at)[1] << " on " << ground << " of scheme " << schemes;
    }
    EXPECT_GE(contrast(color.at("ink"), color.at("bar")), 4.5) << "a number on its bar";
    EXPECT_GE(contrast(color.at("ground"), color.at("accent")), 4.5) << "a button that is pressed";
  }
  EXPECT_EQ(schemes, 2);
  EXPECT_LT(contrast("#777777", "#888888"), 4.5) << "the measure itself";
}

// The image of a page: the map lies over the frame, plots have colours, nothing is blank.
TEST_F(ReportInBrowser, ItsPhotographShowsImageMapAndPlots) {
  const auto colors = [&](const std::string& fragment) {
    const std::string bytes = test::photograph_page(page("replay"), 1280, 1400, fragment);
    DecodedImage image;
    std::string fault;
    EXPECT_TRUE(
        decode_image(std::span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()), {}, image, fault))
        << fault;
    std::map<int, std::size_t> counts;
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < image.width(); ++x)
        ++counts[static_cast<int>(image.unorm(x, y, 0) * 255 + 0.5f) << 16 |
                 static_cast<int>(image.unorm(x, y, 1) * 255 + 0.5f) << 8 |
                 static_cast<int>(image.unorm(x, y, 2) * 255 + 0.5f)];
    return counts;
  };
  const auto with = colors("section=frames&map=box_tests"), frame2 = colors("section=frames&map=box_tests&picture=2");
  EXPECT_GT(with.size(), 1000u);
  EXPECT_GT(colors("section=machine").at(0x009e73), 500u) << "the arrow of the frame buffer";
  EXPECT_LT(with.at(0xffffff), 1280u * 1400u * 9 / 10) << "most of it is not blank";
  EXPECT_NE(with, frame2);
}

// ---- Folders and files ------------------------------------------------------------------------------------------

TEST_F(Report, MadeAgainGivesTheSameBytes) {
  for (const std::string& name : kPages) {
    const std::string before = test::read_text(page(name));
    ASSERT_EQ(run_tessera({"report", path(name)}).status, 0);
    EXPECT_TRUE(test::read_text(page(name)) == before) << name;
  }
}

TEST_F(ReportInBrowser, ManyFramesShowEveryNthAndTotalsOfAll) {
  json stats = json::parse(test::read_text(path("replay/stats.json")));
  const json frame = stats.at("frames").at(0);
  const auto shown = [&](int count) {
    stats["frames"] = json::array();
    for (int f = 0; f < count; ++f) {
      stats["frames"].push_back(frame);
      stats["frames"].back()["frame"] = f;
    }
    fs::create_directories(path("long"));
    test::write_text(path("long/stats.json"), stats.dump());
    EXPECT_EQ(run_tessera({"report", path("long")}).status, 0);
    const OpenedPage opened = open_with(
        "long", "document.body.dataset.frames = framesOf().length; document.body.dataset.says = data.subtitle;");
    EXPECT_EQ(
        test::body_attribute(opened, "data-says").find(fmt::format("{} frames (every ", count)) != std::string::npos,
        count > 1024)
        << count;
    return test::body_attribute(opened, "data-frames");
  };
  EXPECT_EQ(shown(1024), "1024");
  EXPECT_EQ(shown(1025), "513");
  EXPECT_EQ(shown(3000), "750");
}

TEST_F(Report, FoldersThatHoldNothingToReportEndWithStatus3) {
  fs::create_directories(path("empty"));
  fs::create_directories(path("broken"));
  EXPECT_THAT(run_tessera({"report", path("empty")}).errors,
              HasSubstr("holds none of stats.json of a replay, sweep.json of a sweep and tradeoff.json of a tradeoff"));
  EXPECT_THAT(run_tessera({"report", path("none")}).errors, HasSubstr("none: no such folder"));
  for (const char* file : {"stats.json", "sweep.json", "tradeoff.json"})
    for (const char* text : {"", "{", "[]", "{}", R"({"schema": "tessera.stats/1", "frames": []})",
                             R"({"schema": "tessera.stats/1", "frames": [{}], "settings": {"region": [0]}})",
                             R"({"points": [{"hash": 3}]})", R"({"schema": "tessera.tradeoff/1", "knobs": []})", "7"}) {
      for (const char* other : {"stats.json", "sweep.json", "tradeoff.json"})
        fs::remove(path(std::string("broken/") + other));
      test::write_text(path(std::string("broken/") + file), text);
      const ProcessResult r = run_tessera({"report", path("broken")});
      EXPECT_EQ(r.status, 3) << file << " " << text << ": " << r.errors;
      EXPECT_THAT(r.errors, HasSubstr(file)) << text;
      EXPECT_FALSE(fs::exists(page("broken")));
    }
}

TEST_F(Report, WithoutVegaAReplaySaysSoAndIsDoneAndAReportFails) {
  const auto without_vega = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"/usr/bin/env", "TESSERA_VEGA=" + path("nowhere"), TESSERA_PROGRAM});
    return test::run_process(arguments);
  };
  const ProcessResult replay =
      without_vega({"replay", test::shipped_capture("vases").string(), "--size", "32x32", "--out", path("bare")});
  EXPECT_EQ(replay.status, 0);
  EXPECT_THAT(replay.errors, HasSubstr("note: no report.html: "));
  EXPECT_THAT(replay.errors, HasSubstr("install Vega 5 (Debian's package libjs-vega)"));
  EXPECT_TRUE(fs::exists(path("bare/stats.json")));
  EXPECT_FALSE(fs::exists(page("bare")));
  const ProcessResult report = without_vega({"report", path("bare")});
  EXPECT_EQ(report.status, 1);
  EXPECT_THAT(report.errors, HasSubstr("libjs-vega"));
  const ProcessResult sweep = without_vega({"sweep", path("study.json"), "--out", path("bare_sweep")});
  EXPECT_EQ(sweep.status, 0) << sweep.errors;
  EXPECT_EQ(test::read_text(path("bare_sweep/sweep.csv")), test::read_text(path("sweep/sweep.csv")));
}

TEST_F(Report, IsLeftOutWhenNotWanted) {
  run({"replay", test::shipped_capture("vases").string(), "--size", "32x32", "--no-report", "--out", path("unwanted")});
  EXPECT_FALSE(fs::exists(page("unwanted")));
}

}  // namespace
}  // namespace tessera::replay::report_test
