// Questions that the page of a replay answers, and the presses that each takes.
#include "tests/replay/report_pages.h"
#include "tests/support/tests.h"

namespace tessera::replay::report_page_test {
namespace {

using test::OpenedPage;

class ReportPageInBrowser : public ReportInBrowser {
 protected:
  static json stats(const std::string& folder = "replay") {
    return json::parse(test::read_text(path(folder + "/stats.json")));
  }
  static json tiles(int frame) {
    return json::parse(test::read_text(path(fmt::format("replay/tiles_{:04d}.json", frame))));
  }
  // The page of both runs, as open_with().
  static OpenedPage open_joint_with(const std::string& script) {
    std::filesystem::create_directories(path("joint"));
    std::filesystem::copy_file(path("replay/compare.html"), path("joint/report.html"),
                               std::filesystem::copy_options::overwrite_existing);
    return open_with("joint", script);
  }
  // Findings of a script, by name.
  static std::string found(const OpenedPage& page, const std::string& name) {
    EXPECT_EQ(test::body_attribute(page, "data-errors"), "0") << page.console;
    return test::body_attribute(page, "data-" + name);
  }
};

// Tiles of the overlay that a highlight leaves lit.
constexpr const char* kLitTiles = R"(
  const settled = async () => { await viewOf(); await new Promise((resolve) => setTimeout(resolve, 50)); };
  const litTiles = async () => {
    await settled();
    const { tiles, place } = await viewOf(), canvas = document.querySelector('#frames .browser canvas');
    const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    return [...Array(tiles.grid[0] * tiles.grid[1]).keys()].filter((tile) => {
      const x = Math.min(canvas.width - 1, (tile % tiles.grid[0]) * tiles.tile[0] + 1), y = Math.min(canvas.height - 1, Math.floor(tile / tiles.grid[0]) * tiles.tile[1] + 1);
      return pixels.data[4 * (y * canvas.width + x) + 3] <= 140;  // pixels of other drawables in the tile are 128
    });
  };
)";

std::set<int> numbers(const std::string& text) {
  std::set<int> out;
  for (std::size_t at = 0; at < text.size();) {
    std::size_t used = 0;
    out.insert(std::stoi(text.substr(at), &used));
    at += used + 1;
  }
  return out;
}

// Which object costs most? The first row of a table that is there. Where is it? One press.
TEST_F(ReportPageInBrowser, TheDearestDrawableIsTheFirstRowAndAPressShowsItsTiles) {
  const json rows = stats()["frames"][0]["drawables"], lists = tiles(0)["lists"];
  const OpenedPage opened = open_with("replay", std::string(kLitTiles) + R"(
    const row = document.querySelector('#frames .costs table tbody tr');
    document.body.dataset.said = row.textContent;
    row.click();
    document.body.dataset.lit = (await litTiles()).join(' ');
    row.dispatchEvent(new KeyboardEvent('keydown', { key: 'Enter', bubbles: true }));
    document.body.dataset.again = shown.row;)");
  EXPECT_THAT(found(opened, "said"), testing::StartsWith(rows[0]["node"].get<std::string>()));
  std::set<int> expected;
  for (std::size_t tile = 0; tile < lists.size(); ++tile)
    for (std::size_t k = 0; k < lists[tile].size(); k += 3)
      if (lists[tile][k] == 0) expected.insert(static_cast<int>(tile));
  ASSERT_FALSE(expected.empty());
  ASSERT_LT(expected.size(), lists.size());
  EXPECT_EQ(numbers(found(opened, "lit")), expected);
  EXPECT_EQ(found(opened, "again"), "-1") << "the same press lets go";
}

TEST_F(ReportPageInBrowser, AMaterialShowsTheTilesOfAllItsDrawables) {
  const json frame = stats()["frames"][0], lists = tiles(0)["lists"];
  const std::string material = frame["materials"][1]["material"];
  const OpenedPage opened = open_with("replay", std::string(kLitTiles) + R"(
    document.querySelectorAll('#frames .costs table')[1].querySelectorAll('tbody tr')[1].click();
    document.body.dataset.lit = (await litTiles()).join(' ');)");
  std::set<int> expected;
  for (std::size_t tile = 0; tile < lists.size(); ++tile)
    for (std::size_t k = 0; k < lists[tile].size(); k += 3)
      if (frame["drawables"][lists[tile][k].get<std::size_t>()]["material"] == material)
        expected.insert(static_cast<int>(tile));
  EXPECT_EQ(numbers(found(opened, "lit")), expected) << material;
}

// Which tile, and why? One press.
TEST_F(ReportPageInBrowser, TheSlowestTileIsAPressAwayAndTellsItsBound) {
  const json of = tiles(0), costs = of["costs"];
  const auto cycles = costs["cycles"].get<std::vector<std::uint64_t>>();
  const auto tile = static_cast<int>(std::max_element(cycles.begin(), cycles.end()) - cycles.begin());
  const int columns = of["grid"][0], bound = costs["bound_by"][static_cast<std::size_t>(tile)];
  ASSERT_GE(bound, 0);
  const OpenedPage opened = open_with("replay", std::string(kLitTiles) + R"(
    [...document.querySelectorAll('#frames button')].find((button) => button.textContent === 'Slowest tile').click();
    await settled();
    document.body.dataset.said = document.querySelector('#frames .tile').textContent;
    document.body.dataset.bound = boundWords(')" + costs["bounds"][static_cast<std::size_t>(bound)].get<std::string>() +
                                                    "');");
  const std::string said = found(opened, "said");
  EXPECT_THAT(said, testing::StartsWith(fmt::format("Tile {}, {}", tile % columns, tile / columns)));
  EXPECT_THAT(said, HasSubstr("Bound by " + found(opened, "bound")));
  EXPECT_THAT(said, HasSubstr("1 of "));
  EXPECT_THAT(said, HasSubstr("frame buffer")) << "bytes by purpose";
}

// Question: which surface does this pixel show? A press on the image; Shift and the arrow keys go on from there.
TEST_F(ReportPageInBrowser, APressOnTheImageNamesThePixelsSurface) {
  const json of = tiles(0), pixels = of["pixels"], rows = stats()["frames"][0]["drawables"];
  // The runs by themselves.
  const auto value = [&](const char* name, std::uint64_t place) {
    const json& runs = pixels[name];
    std::size_t k = 0;
    for (std::uint64_t end = runs["lengths"][0]; end <= place; end += runs["lengths"][++k].get<std::uint64_t>()) {
    }
    return runs["values"][k].get<std::uint64_t>();
  };
  const OpenedPage opened = open_with("replay", std::string(kLitTiles) + R"(
    const browser = document.querySelector('#frames .browser'), box = browser.querySelector('canvas').getBoundingClientRect();
    const look = () => document.querySelector('#frames .tile').textContent;
    const at = (x, y) => browser.dispatchEvent(new MouseEvent('click', { clientX: box.left + box.width * (x + 0.5) / 320, clientY: box.top + box.height * (y + 0.5) / 180, bubbles: true }));
    await settled();
    at(160, 100); await settled();
    document.body.dataset.pressed = look();
    browser.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowRight', shiftKey: true, bubbles: true }));
    await settled();
    document.body.dataset.moved = look();
    document.body.dataset.outlined = browser.querySelector('canvas').getContext('2d').getImageData(0, 0, 320, 180).data.some((byte) => byte === 255);
    browser.dispatchEvent(new KeyboardEvent('keydown', { key: 'Escape', bubbles: true }));
    await settled();
    document.body.dataset.left = look();)");
  for (const auto& [name, x] : {std::pair{"pressed", 160}, {"moved", 161}}) {
    const std::uint64_t place = 100u * 320u + static_cast<std::uint64_t>(x), seen = value("seen", place);
    ASSERT_GT(seen, 0u) << "choose another pixel";
    const json& table = pixels["sub_patches"];
    const std::string said = found(opened, name);
    EXPECT_THAT(said, testing::StartsWith(fmt::format("Pixel {}, 100", x)));
    EXPECT_THAT(said, HasSubstr(rows[table["row"][seen - 1].get<std::size_t>()]["node"].get<std::string>()));
    EXPECT_THAT(said, HasSubstr(fmt::format("base patch {}", table["patch"][seen - 1].get<int>())));
    EXPECT_THAT(said, HasSubstr(fmt::format("cells {}–{} by", table["cells"][4 * seen - 4].get<int>(),
                                            table["cells"][4 * seen - 2].get<int>())));
    EXPECT_THAT(said, HasSubstr(fmt::format("{} of 4 of its samples", value("samples", place))));
    EXPECT_THAT(said, HasSubstr(fmt::format("{} invocation", value("invocations", place))));
  }
  EXPECT_EQ(found(opened, "outlined"), "true");
  EXPECT_EQ(found(opened, "left"), "No tile is pinned.");
}

// A counter along the timeline: its windows add up to the counter of the frame, and a press takes it away again.
TEST_F(ReportPageInBrowser, ACounterIsDrawnOverTimeAndAddsUp) {
  const OpenedPage opened = open_with("replay", std::string(kLitTiles) + R"(
    await settled();
    const of = { ...(await viewOf()), timeline: (await viewOf()).tiles.timeline }, frame = frameOf(), off = [];
    for (const [name] of seriesNames(of.tiles, frame)) {
      const sum = seriesOf(name, of, frame).reduce((a, b) => a + b, 0), values = mapValues(of.tiles, name), all = values ? values.reduce((a, b) => a + b, 0) : frame.counters[name];
      if (Math.abs(sum - all) > 1e-6 * Math.max(1, all)) off.push(`${name} ${sum} ${all}`);
    }
    document.body.dataset.off = off.join('; ');
    document.body.dataset.names = seriesNames(of.tiles, frame).length;
    // A count of a tile lies within that tile's time.
    const one = { timeline: of.timeline, tiles: { ...of.tiles, maps: { box_tests: { values: of.tiles.maps.box_tests.values.map((value, tile) => (tile === of.timeline.tile[0] ? 7 : 0)) } } } };
    const width = of.timeline.cycles / of.timeline.windows, end = of.timeline.begin[0] + of.timeline.spans.slice(0, 8).reduce((a, b) => a + b, 0);
    document.body.dataset.outside = seriesOf('box_tests', one, frame).filter((value, w) => value > 0 && ((w + 1) * width < of.timeline.begin[0] || w * width > end)).length;
    const picker = document.querySelector('#timeline select'), canvas = document.querySelector('#timeline canvas'), before = canvas.height;
    picker.value = 'pixel_shader_invocations';
    picker.dispatchEvent(new Event('change', { bubbles: true }));
    await settled();
    document.body.dataset.taller = canvas.height > before;
    document.querySelector('#timeline .chosen-series button').click();
    await settled();
    document.body.dataset.back = canvas.height === before;)");
  EXPECT_EQ(found(opened, "off"), "");
  EXPECT_GT(std::stoi(found(opened, "names")), 30);
  EXPECT_EQ(found(opened, "outside"), "0");
  EXPECT_EQ(found(opened, "taller"), "true");
  EXPECT_EQ(found(opened, "back"), "true");
}

// The graph of passes shows the bytes that passes leave for each other, equal to stats.json, in words as well.
TEST_F(ReportPageInBrowser, AGraphOfPassesHasTheBytesOnItsEdges) {
  const json passes = json::parse(test::read_text(path("passes/stats.json")))["frames"][0]["passes"];
  ASSERT_GT(passes.size(), 1u);
  const OpenedPage opened = open_with("passes", R"(
    repaintAll();
    const graph = document.querySelector('#passes svg');
    document.body.dataset.said = graph.getAttribute('aria-label');
    document.body.dataset.arrows = graph.querySelectorAll('path').length;
    document.body.dataset.cut = [...graph.querySelectorAll('text')].filter((text) => { const box = text.getBBox(); return box.x < 0 || box.x + box.width > graph.viewBox.baseVal.width; }).length;
    document.body.dataset.exact = frameOf().passes.map((pass) => quantity(passBytes(pass, 'written_bytes', 'shadow_map') || passBytes(pass, 'read_bytes', 'shadow_map'), 'bytes')).join(';');
    document.body.dataset.rows = document.querySelectorAll('#passes tbody tr').length;)");
  std::size_t edges = 0;
  const std::string said = found(opened, "said");
  for (const json& pass : passes) {
    EXPECT_THAT(said, HasSubstr(pass["name"].get<std::string>()));
    std::map<std::string, std::pair<bool, bool>> moved;
    for (const json& row : pass["dram"])
      for (const char* image : {"shadow_map", "frame_buffer", "attachment", "scene_color", "history", "coarse_depth"})
        if (row["purpose"] == image) {
          moved[image].first |= row["read_bytes"].get<std::uint64_t>() > 0;
          moved[image].second |= row["written_bytes"].get<std::uint64_t>() > 0;
        }
    for (const auto& [image, ways] : moved) edges += (ways.first ? 1u : 0u) + (ways.second ? 1u : 0u);
  }
  EXPECT_EQ(found(opened, "arrows"), std::to_string(edges));
  EXPECT_EQ(found(opened, "rows"), std::to_string(passes.size()));
  EXPECT_EQ(found(opened, "cut"), "0");
  std::istringstream exact(found(opened, "exact"));
  for (std::string bytes; std::getline(exact, bytes, ';');) EXPECT_THAT(said, HasSubstr(bytes));
}

TEST_F(ReportPageInBrowser, RunsOfPixelsCoverTheImage) {
  const json pixels = tiles(0)["pixels"];
  EXPECT_EQ(pixels["region"], json({0, 0, 320, 180}));
  for (const char* name : {"seen", "samples", "invocations", "layers", "nearest_layer"}) {
    const auto lengths = pixels[name]["lengths"].get<std::vector<std::uint64_t>>();
    EXPECT_EQ(std::accumulate(lengths.begin(), lengths.end(), std::uint64_t{0}), 320u * 180u) << name;
    EXPECT_EQ(lengths.size(), pixels[name]["values"].size()) << name;
  }
}

// With machine.timing=events a replay estimates the bound of a tile; tessera time --split tiles simulates it.
TEST_F(ReportPageInBrowser, ABoundThatIsEstimatedSaysSo) {
  const OpenedPage opened = open_with("replay", std::string(kLitTiles) + R"(
    const verdict = async (estimated) => { show({ tile: -1 }); await settled(); (await viewOf()).tiles.costs.estimated = estimated; [...document.querySelectorAll('#frames button')].find((button) => button.textContent === 'Slowest tile').click(); await settled(); return document.querySelector('#frames .tile .verdict').textContent; };
    document.body.dataset.own = String((await viewOf()).tiles.costs.estimated);
    document.body.dataset.simulated = await verdict(false);
    document.body.dataset.estimated = await verdict(true);)");
  EXPECT_EQ(found(opened, "own"), "true");
  EXPECT_THAT(found(opened, "simulated"), testing::Not(HasSubstr("saves about")));
  EXPECT_THAT(found(opened, "estimated"), HasSubstr("saves about"));
  EXPECT_THAT(found(opened, "estimated"), HasSubstr("tessera time --split tiles simulates it"));
}

TEST_F(ReportPageInBrowser, TilesAreChosenByKeysAndFramesByButtons) {
  const json of = tiles(1);
  const int columns = of["grid"][0];
  const OpenedPage opened = open_with("replay", std::string(kLitTiles) + R"(
    document.querySelector('.bar [aria-label="Next frame"]').click();
    const image = document.querySelector('#frames .browser');
    image.focus();
    for (const key of ['ArrowRight', 'ArrowRight', 'ArrowRight', 'ArrowRight', 'ArrowDown', 'ArrowDown', 'ArrowDown', 'ArrowUp'])
      document.activeElement.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }));
    repaintAll();
    await settled();
    document.body.dataset.said = document.querySelector('#frames .tile').textContent;
    document.body.dataset.rows = [...document.querySelectorAll('#frames .tile tr')].map((row) => [...row.children].map((cell) => cell.textContent).join('=')).join(';');
    document.body.dataset.frame = shown.frame;
    // Everything that a mouse can press is reached by the Tab key, and has a name.
    document.body.dataset.unreachable = [...document.querySelectorAll('a, button, select, input, summary, canvas.gantt, .unit, .browser')].filter((element) => element.tabIndex < 0).length;
    document.body.dataset.unnamed = [...document.querySelectorAll('select, input, canvas.gantt, .unit, .browser')].filter((element) => !(element.labels && element.labels.length) && !element.getAttribute('aria-label')).length;)");
  EXPECT_EQ(found(opened, "frame"), "1");
  EXPECT_THAT(found(opened, "said"), HasSubstr("Tile 3, 2"));
  EXPECT_THAT(found(opened, "said"), testing::StartsWith("Pixel 112, 80")) << "the middle of the tile";
  const auto entries = of["maps"]["entries"]["values"][static_cast<std::size_t>(2 * columns + 3)].get<std::uint64_t>();
  EXPECT_THAT(found(opened, "rows"), HasSubstr(fmt::format(";entries={};", entries)));
  EXPECT_EQ(found(opened, "unreachable"), "0");
  EXPECT_EQ(found(opened, "unnamed"), "0");
}

TEST_F(ReportPageInBrowser, OneSliderMovesEverySection) {
  const json frames = stats()["frames"];
  const OpenedPage opened = open_with("replay", R"(
    const slider = document.querySelector('.bar input[type=range]');
    slider.value = 2;
    slider.dispatchEvent(new Event('input'));
    repaintAll();
    await viewOf();
    document.body.dataset.cards = document.querySelector('#summary').textContent;
    document.body.dataset.machine = document.querySelector('#machine [data-unit=shader]').getAttribute('aria-label');
    for (const id of ['memory', 'timing', 'counters', 'effects']) document.body.dataset[id] = document.getElementById(id).textContent.includes('frame 2');)");
  EXPECT_THAT(found(opened, "cards"),
              HasSubstr(fmt::format("bound by {}", frames[2]["timing"]["bound_by"].get<std::string>())));
  const OpenedPage first =
      open_with("replay", "document.body.dataset.cards = document.querySelector('#summary').textContent;");
  EXPECT_NE(found(opened, "cards"), found(first, "cards"));
  EXPECT_THAT(found(opened, "machine"), testing::MatchesRegex("Shader .*: share of the frame in which it is busy.*"));
  for (const char* id : {"memory", "timing", "counters", "effects"}) EXPECT_EQ(found(opened, id), "true") << id;
}

TEST_F(ReportPageInBrowser, AUnitOpensItsCountersAndStallsAreItsHint) {
  const OpenedPage opened = open_with("replay", R"(
    const unit = document.querySelector('#machine [data-unit=texture]');
    unit.focus();
    await viewOf();
    await new Promise((resolve) => setTimeout(resolve, 50));
    unit.blur();
    unit.focus();
    document.body.dataset.hint = document.querySelector('.hint').textContent;
    unit.dispatchEvent(new KeyboardEvent('keydown', { key: 'Enter', bubbles: true }));
    document.body.dataset.panel = document.querySelector('#machine .panel').textContent;
    document.body.dataset.open = unit.getAttribute('aria-expanded');)");
  EXPECT_THAT(found(opened, "hint"), HasSubstr("busy"));
  EXPECT_THAT(found(opened, "hint"), HasSubstr("tiles wait for this phase"));
  for (const char* name : {"texture.cache_requests", "texture.texels_per_clk"})
    EXPECT_THAT(found(opened, "panel"), HasSubstr(name));
  EXPECT_EQ(found(opened, "open"), "true");
}

// Arrows are as wide as their bytes, and every byte of the ledger is in one.
TEST_F(ReportPageInBrowser, ArrowsHoldTheLedger) {
  const json frame = stats()["frames"][1];
  const OpenedPage opened = open_with("replay", R"(
    const flows = flowsOf(framesOf()[1]);
    document.body.dataset.bytes = flows.reduce((sum, flow) => sum + flow.bytes, 0);
    document.body.dataset.places = flows.every((flow) => kAnchors[flow.anchor]);)");
  EXPECT_EQ(found(opened, "bytes"), std::to_string(frame["counters"]["dram.read_bytes"].get<std::uint64_t>() +
                                                   frame["counters"]["dram.written_bytes"].get<std::uint64_t>()));
  EXPECT_EQ(found(opened, "places"), "true");
}

TEST_F(ReportPageInBrowser, MapsOfZerosAreNotOfferedAndScalesStayOverFrames) {
  std::set<std::string> expected;
  for (int frame = 0; frame < 3; ++frame) {
    const json of = tiles(frame);
    for (const auto& [name, map] : of["maps"].items())
      for (const json& value : map["values"])
        if (value != 0) expected.insert(name);
  }
  const OpenedPage opened = open_with("replay", std::string(kLitTiles) + R"(
    const select = [...document.querySelectorAll('#frames select')][0], scale = () => document.querySelector('#frames .legend').textContent;
    document.body.dataset.maps = [...select.options].map((option) => option.value).filter((name) => name && !name.includes('.')).sort().join(' ');
    await settled();
    const before = scale();
    show({ frame: 2 });
    repaintAll();
    await settled();
    document.body.dataset.same = before === scale() && before.length > 0;)");
  std::string names;
  for (const std::string& name : expected) names += (names.empty() ? "" : " ") + name;
  EXPECT_EQ(found(opened, "maps"), names);
  EXPECT_LT(expected.size(), tiles(0)["maps"].size());
  EXPECT_EQ(found(opened, "same"), "true");
}

// The page holds the same tiles as the folder.
TEST_F(ReportPageInBrowser, TilesComeOutAsTheyWentIn) {
  json expected = tiles(2);
  std::erase_if(expected["maps"].get_ref<json::object_t&>(), [](const auto& map) {
    const json& values = map.second["values"];
    return std::all_of(values.begin(), values.end(), [](const json& value) { return value == 0; });
  });
  for (auto& [name, map] : expected["maps"].items()) map = {{"values", map["values"]}};
  for (json& nj : expected["costs"]["energy_nj"]) nj = std::llround(nj.get<double>());
  expected.erase("schema");
  expected.erase("frame");
  const OpenedPage opened =
      open_with("replay", "show({ frame: 2 }); document.body.dataset.tiles = JSON.stringify((await viewOf()).tiles);");
  std::string text = found(opened, "tiles");
  for (std::size_t at; (at = text.find("&quot;")) != std::string::npos;) text.replace(at, 6, "\"");
  EXPECT_EQ(json::parse(text), expected);
}

TEST_F(ReportPageInBrowser, TwoRunsAreSideBySideWithTheKeysThatDifferAfterTheFigures) {
  const OpenedPage opened = open_joint_with(R"(
    const part = document.getElementById('compare');
    document.body.dataset.keys = [...document.querySelectorAll('#differences tbody tr')].map((row) => [...row.children].slice(0, 3).map((cell) => cell.textContent).join('=')).join(';');
    document.body.dataset.last = [...document.querySelectorAll('main > section')].slice(-2).map((section) => section.id).join(' ');
    document.body.dataset.cards = document.querySelectorAll('#summary .versus').length;
    const select = part.querySelector('select');
    select.value = 'difference';
    select.dispatchEvent(new Event('change'));
    await Promise.all([...part.querySelectorAll('.swipe img')].map((image) => image.decode()));
    for (let k = 0; k < 100 && !part.querySelector('p.note[aria-live]').textContent; ++k) await new Promise((resolve) => setTimeout(resolve, 50));
    document.body.dataset.says = part.querySelector('p.note[aria-live]').textContent;)");
  EXPECT_EQ(found(opened, "keys"), "tile.height=32=16;tile.width=32=16");
  EXPECT_EQ(found(opened, "last"), "differences configuration");
  EXPECT_GE(std::stoi(found(opened, "cards")), 6);
  EXPECT_THAT(found(opened, "says"), HasSubstr("Largest difference of a channel"));
}

// The arrows add up to the bytes that a frame moves: of memory and from the L2.
TEST_F(ReportPageInBrowser, ArrowsOfTwoRunsAreSideBySide) {
  const OpenedPage opened = open_joint_with(R"(
    const sum = (side) => [...document.querySelectorAll(`#machine .flow[data-side=${side}]`)].reduce((all, arrow) => all + Number(arrow.dataset.bytes), 0);
    document.body.dataset.a = sum('A');
    document.body.dataset.b = sum('B');
    document.body.dataset.l2 = document.querySelector('#machine [data-unit=l2]').textContent.split('|').length;
    show({ other: null });
    document.body.dataset.alone = sum('A') + ' ' + sum('B');)");
  const auto moved = [&](const std::string& folder) {
    const json all = stats(folder), frame = all["frames"][0]["counters"];
    return std::to_string(
        frame["dram.read_bytes"].get<std::uint64_t>() + frame["dram.written_bytes"].get<std::uint64_t>() +
        frame["l2.requests"].get<std::uint64_t>() * std::max(64, all["gpu"]["memory"]["burst_bytes"].get<int>()));
  };
  ASSERT_NE(moved("replay"), moved("other"));
  EXPECT_EQ(found(opened, "a"), moved("replay"));
  EXPECT_EQ(found(opened, "b"), moved("other"));
  EXPECT_EQ(found(opened, "alone"), moved("replay") + " 0");
  EXPECT_EQ(found(opened, "l2"), "2");
}

TEST_F(ReportPageInBrowser, TimelinesOfTwoRunsAreBelowEachOtherOnOneScale) {
  const OpenedPage opened = open_joint_with(R"(
    const canvas = document.querySelector('canvas.gantt'), settle = () => new Promise((resolve) => setTimeout(resolve, 100));
    repaintAll();
    await viewOf(shown.other);
    await settle();
    // Texts of the rows at a place along the axis, from the top.
    const saidAt = (share) => {
      const at = canvas.getBoundingClientRect(), said = [];
      for (let y = 2; y < at.height; y += 3) {
        canvas.dispatchEvent(new PointerEvent('pointermove', { clientX: at.left + share * at.width, clientY: at.top + y, bubbles: true }));
        const line = hint.hidden ? '' : [...hint.children].map((part) => part.textContent).join(' ');
        if (line && said[said.length - 1] !== line) said.push(line);
      }
      return said;
    };
    const places = [{ run: 0, frame: 0 }, { run: 1, frame: 0 }], times = [], said = saidAt(0.3), order = [];
    for (const at of places) {
      const { timeline } = (await viewOf(at)).tiles, [begin, end] = timeline.geometry[0].map((cycle) => quantity(milliseconds(cycle, at), 'ms'));
      times.push(milliseconds(timeline.cycles, at));
      order.push(said.findIndex((line) => line.startsWith(`${'AB'[at.run]}: front end ${begin} to ${end}`)));
    }
    document.body.dataset.there = order.every((at) => at >= 0) && order[0] < order[1];
    const ended = saidAt(0.98).filter((line) => line.includes('has ended')).map((line) => line[0]);
    document.body.dataset.ended = [...new Set(ended)].join('');
    document.body.dataset.shorter = 'AB'[times[0] < times[1] ? 0 : 1];
    const both = canvas.height;
    show({ other: null });
    repaintAll();
    await settle();
    document.body.dataset.alone = canvas.height < both && saidAt(0.3).every((line) => !line.startsWith('A: '));)");
  EXPECT_EQ(found(opened, "there"), "true");
  EXPECT_EQ(found(opened, "ended"), found(opened, "shorter"));
  EXPECT_EQ(found(opened, "alone"), "true");
}

TEST_F(ReportPageInBrowser, TheBarSaysWhichFrameOfHowMany) {
  run({"replay", test::shipped_capture("eggs").string(), "--frames", "5:6", "--size", "32x32", "--out", path("fifth")});
  const OpenedPage one = open_with("fifth", R"(
    document.body.dataset.says = document.querySelector('.bar .which').textContent;
    document.body.dataset.moves = [...document.querySelectorAll('.bar button, .bar input')].filter((element) => !element.hidden).length;)");
  EXPECT_EQ(found(one, "says"), "frame 5, the only one");
  EXPECT_EQ(found(one, "moves"), "0") << "there is nowhere to go";
  const OpenedPage three = open_with("replay", R"(
    const says = () => document.querySelector('.bar .which').textContent;
    document.body.dataset.first = says();
    document.querySelector('.bar [aria-label="Next frame"]').click();
    document.body.dataset.second = says();)");
  EXPECT_EQ(found(three, "first"), "frame 0 (1 of 3)");
  EXPECT_EQ(found(three, "second"), "frame 1 (2 of 3)");
}

// Who serves the page gives it new numbers.
TEST_F(ReportPageInBrowser, NewStatisticsRedrawThePage) {
  const OpenedPage opened = open_with("replay", R"(
    const stats = JSON.parse(JSON.stringify(run().stats));
    stats.frames[0].timing.cycles = 8500000;
    stats.frames[0].timing.bound_by = 'dram';
    stats.frames[0].counters['tilecore.triangle_tests'] = 123456789;
    update(stats);
    repaintAll();
    document.body.dataset.cards = document.querySelector('#summary').textContent;
    document.body.dataset.counters = document.querySelector('#counters').textContent;)");
  EXPECT_THAT(found(opened, "cards"), HasSubstr("10"));
  EXPECT_THAT(found(opened, "cards"), HasSubstr("memory bandwidth"));
  EXPECT_THAT(found(opened, "cards"), HasSubstr("8\u202f500\u202f000 cycles"));
  EXPECT_THAT(found(opened, "counters"), HasSubstr("123\u202f456\u202f789"));
}

TEST_F(ReportPageInBrowser, TheTimelineZoomsByKeysAndPinsATile) {
  const OpenedPage opened = open_with("replay", R"(
    const canvas = document.querySelector('canvas.gantt');
    canvas.scrollIntoView();
    repaintAll();
    await viewOf();
    await new Promise((resolve) => setTimeout(resolve, 50));
    const look = () => canvas.toDataURL().length + canvas.toDataURL().slice(2000, 4000), whole = look();
    const press = (key) => canvas.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true, cancelable: true }));
    press('+');
    press('+');
    const near = look();
    press('Home');
    document.body.dataset.zoomed = near !== whole && look() === whole;
    show({ tile: 5 });
    // Chromium without a window draws no frames that tell which sections are in sight, and a loaded machine may take its time to paint.
    repaintAll();
    for (let k = 0; k < 100 && look() === whole; ++k) await new Promise((resolve) => setTimeout(resolve, 50));
    document.body.dataset.pinned = look() !== whole;)");
  EXPECT_EQ(found(opened, "zoomed"), "true");
  EXPECT_EQ(found(opened, "pinned"), "true");
}

TEST_F(ReportPageInBrowser, NumbersAreInUnitsThatPeopleRead) {
  const OpenedPage opened = open_with("replay", R"(
    document.body.dataset.says = [quantity(1.8e6, 'nJ'), quantity(0.05, 'ms'), quantity(4.2, 'ms'), quantity(1536, 'bytes'), quantity(0.4, 'GB/s'), percent(0.0004), number(12345678)].join('|').replaceAll('\u00a0', ' ').replaceAll('\u202f', ' ');
    document.body.dataset.axes = [...document.querySelectorAll('.plot svg text')].map((text) => text.textContent).filter((text) => /^[0-9.]+[mkMG]$/.test(text)).join(' ');)");
  EXPECT_EQ(found(opened, "says"), "1.8 mJ|50 µs|4.2 ms|1.5 KiB|400 MB/s|&lt;0.1 %|12 345 678");
  EXPECT_EQ(found(opened, "axes"), "") << "no 50m, no 1.8M";
}

TEST_F(ReportPageInBrowser, ASweepOpensOnVaryingColumnsAndTellsConstantOnesOnce) {
  const OpenedPage opened = open_with("sweep", R"(
    document.body.dataset.offered = [...document.querySelectorAll('#pareto select')[0].options].length;
    document.body.dataset.constant = [...document.querySelectorAll('#study summary')].map((line) => line.textContent).join(' ');
    document.body.dataset.lines = document.querySelector('#parallel canvas').dataset.lines;
    const stage = document.querySelector('#parallel .stage'), grip = stage.querySelector('.grip').getBoundingClientRect();
    stage.querySelector('svg').dispatchEvent(new PointerEvent('pointermove', { clientX: grip.left + 11, clientY: grip.bottom - 9, bubbles: true }));
    document.body.dataset.hint = document.querySelector('.hint').textContent;)");
  EXPECT_EQ(found(opened, "lines"), "4");
  EXPECT_THAT(found(opened, "constant"), HasSubstr("columns are the same at every point"));
  for (const char* key : {"tile.width = ", "frontend.split_pixels = "})
    EXPECT_THAT(found(opened, "hint"), HasSubstr(key));
}

// Does it hold my rate? A number typed into the page.
TEST_F(ReportPageInBrowser, ATypedTargetTellsWhetherFramesMeetItAndThePower) {
  json frames = stats()["frames"];
  std::vector<double> ms;
  for (const json& frame : frames) ms.push_back(frame["timing"]["time_ms"]);
  std::vector<double> sorted = ms;
  std::sort(sorted.begin(), sorted.end());
  const double target = 1000 / ((sorted[0] + sorted[1]) / 2);  // one of three frames is fast enough
  const OpenedPage opened = open_with("replay", fmt::format(R"(
    const field = document.querySelector('#summary input[type=number]'), says = () => document.querySelector('#summary .rate').textContent;
    document.body.dataset.before = says();
    document.body.dataset.watts = powerOf(frameOf());
    field.value = {};
    field.dispatchEvent(new Event('input', {{ bubbles: true }}));
    document.body.dataset.after = says();)",
                                                            target));
  EXPECT_THAT(found(opened, "before"), testing::StartsWith("Meets 60 frames/s"));
  EXPECT_THAT(found(opened, "before"), HasSubstr("3 of 3 frames meet it."));
  EXPECT_THAT(found(opened, "after"), HasSubstr("1 of 3 frames meet it."));
  EXPECT_THAT(found(opened, "after"), testing::StartsWith(ms[0] == sorted[0] ? "Meets" : "Misses"));
  // The page computes power as the program does.
  EXPECT_NEAR(std::stod(found(opened, "watts")), frames[0]["energy"]["power_w"].get<double>(), 1e-5);
}

// Which frame is slowest, and why? One press, and a list.
TEST_F(ReportPageInBrowser, TheSlowestFrameIsAPressAwayAndSaysWhy) {
  const json all = stats(), spread = all["total"]["over_frames"]["time_ms"];
  const OpenedPage opened = open_with("replay", R"(
    [...document.querySelectorAll('.bar button')].find((button) => button.textContent === 'Slowest frame').click();
    document.body.dataset.frame = frameOf().frame;
    document.body.dataset.rows = [...document.querySelectorAll('#rates tbody tr')].map((row) => row.textContent).join('|').replaceAll('\u00a0', ' ');
    document.body.dataset.why = document.querySelector('#rates .why').textContent;)");
  EXPECT_EQ(found(opened, "frame"), std::to_string(spread["worst_frame"].get<int>()));
  EXPECT_THAT(found(opened, "rows"), testing::StartsWith("frame time"));
  EXPECT_THAT(found(opened, "why"), HasSubstr("more time than A"));
  EXPECT_THAT(found(opened, "why"), HasSubstr("what changed"));
}

// Who wins? A sentence, and the machine's own row.
TEST_F(ReportPageInBrowser, BaselinesEndInAVerdict) {
  const OpenedPage opened = open_with("replay", R"(
    document.body.dataset.sentence = document.querySelector('#baselines .verdict').textContent;
    document.body.dataset.marked = [...document.querySelectorAll('#baselines tr.chosen')].map((row) => row.firstChild.textContent).join('|');
    document.body.dataset.kinds = [...document.querySelectorAll('#baselines h3')].map((head) => head.textContent).join('|');)");
  EXPECT_EQ(found(opened, "sentence"), stats()["total"]["baseline_verdict"]["sentence"].get<std::string>());
  EXPECT_EQ(found(opened, "marked"), "tessera");
  EXPECT_EQ(found(opened, "kinds"), "This machine|Shipped in a product|Idealised: in no known product");
}

// Question: how much does an object cost? The saving of the frame without it comes before its share.
TEST_F(ReportPageInBrowser, ObjectsAreOrderedByTheSavingWithoutThem) {
  run({"replay", test::shipped_capture("eggs").string(), "--frames", "5:6", "--size", "96x54", "--without", "all",
       "--out", path("without")});
  const OpenedPage opened = open_with("without", R"(
    const tables = document.querySelectorAll('#frames .costs table');
    document.body.dataset.first = tables[0].querySelector('tbody tr').textContent;
    document.body.dataset.head = [...tables[0].querySelectorAll('th')].map((head) => head.textContent).join('|');
    document.body.dataset.effects = [...document.querySelectorAll('#effects th')].map((head) => head.textContent).join('|');)");
  const json least = stats("without")["frames"][0]["without"]["drawables"][0];
  EXPECT_THAT(found(opened, "head"), testing::StartsWith("drawable|saves when left out|cycles|"));
  EXPECT_THAT(found(opened, "first"), testing::StartsWith(least["node"].get<std::string>()));
  EXPECT_THAT(found(opened, "effects"), HasSubstr("saves when left out"));
}

// Which machine holds the rate? The page opens with it.
TEST_F(ReportPageInBrowser, AGoalOpensWithWhoWins) {
  run({"sweep", test::shipped_capture("eggs").string(), "--gpu", "entry-mobile", "--gpu", "mid-mobile", "--fps", "2000",
       "--frames", "5:6", "--size", "96x54", "--out", path("machines")});
  const OpenedPage opened = open_with("machines", R"(
    document.body.dataset.opens = document.querySelector('main section').id;
    document.body.dataset.sentence = document.querySelector('#goal .verdict').textContent;
    document.body.dataset.rows = [...document.querySelectorAll('#goal tbody tr')].map((row) => row.firstChild.textContent + ' ' + row.lastChild.textContent).join('|');
    document.body.dataset.limits = document.querySelectorAll('#pareto .mark-rule line').length;)");
  EXPECT_EQ(found(opened, "opens"), "goal");
  EXPECT_THAT(found(opened, "sentence"), testing::StartsWith("Best: gpu = mid-mobile"));
  EXPECT_EQ(found(opened, "rows"), "mid-mobile met|entry-mobile missed");
  EXPECT_GE(std::stoi(found(opened, "limits")), 1);
}

// A map that is not in the file, a member of another type: a damaged folder is refused, or its page says that it has a fault.
TEST_F(Report, ADamagedFileOfTilesEndsWithStatus3) {
  std::filesystem::create_directories(path("damaged"));
  for (const char* file :
       {"stats.json", "frame_0000.png", "frame_0001.png", "frame_0002.png", "tiles_0001.json", "tiles_0002.json"})
    std::filesystem::copy_file(path(std::string("replay/") + file), path(std::string("damaged/") + file),
                               std::filesystem::copy_options::overwrite_existing);
  for (
      const char* text :
      {"", "[]", R"({"origin": [0, 0], "tile": [32, 32], "grid": [1, 1]})",
       R"({"origin": [0, 0], "tile": [32, 32], "grid": [1, 1], "maps": {"a": {"unit": "", "meaning": "", "values": ["x"]}}})",
       R"({"origin": [0, 0], "tile": [32, 32], "grid": [1, 1], "maps": {}, "costs": {}})"}) {
    test::write_text(path("damaged/tiles_0000.json"), text);
    const test::ProcessResult r = test::run_tessera({"report", path("damaged")});
    EXPECT_EQ(r.status, 3) << text << ": " << r.errors;
    EXPECT_THAT(r.errors, HasSubstr("tiles_0000.json")) << text;
  }
  std::filesystem::remove(path("damaged/tiles_0000.json"));
  test::write_text(path("damaged/frame_0000.png"), "no image, but long enough for a head");
  EXPECT_EQ(test::run_tessera({"report", path("damaged")}).status, 3);
}

TEST_F(Report, SeveralFoldersMustAllBeReplays) {
  EXPECT_EQ(test::run_tessera({"report", path("replay"), path("sweep")}).status, 3);
  EXPECT_THAT(test::run_tessera({"report", path("replay"), path("sweep")}).errors, HasSubstr("holds no stats.json"));
  std::vector<std::string> many(9, path("replay"));
  many.insert(many.begin(), "report");
  EXPECT_EQ(test::run_tessera(many).status, 2);
}

}  // namespace
}  // namespace tessera::replay::report_page_test
