// TESSERA_capture.attachments and .passes: their values, the places and words of every fault, the order of passes and
// the tile memory that they need. A fuzzer starts from these captures, too.
#include "scene/capture_reader.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/pass_assets.h"
#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::passes_reader_test {
namespace {

using test::deferred_passes;
using test::GltfAsset;

GltfAsset asset_with(const json& members) {
  GltfAsset asset = test::everything_asset();
  asset.document["extensions"]["TESSERA_capture"].update(members);
  return asset;
}

PassGraph graph_of(const json& members) { return test::read_asset(asset_with(members)).settings.graph.value(); }

// The fault with its place below TESSERA_capture.
std::string fault_of(const json& members) {
  try {
    test::read_asset(asset_with(members));
  } catch (const InputError& error) {
    const std::string extension = "/extensions/TESSERA_capture", text = error.what();
    EXPECT_TRUE(error.place().starts_with(extension)) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos);
    return text.substr(text.find(extension) + extension.size());
  }
  return "none";
}

// The same of the deferred renderer with some values set and some removed.
std::string fault_with(const json& set, const std::vector<std::string>& remove = {}) {
  json members = deferred_passes();
  for (const auto& [pointer, value] : set.items()) members[json::json_pointer(pointer)] = value;
  for (const std::string& pointer : remove) members.patch_inplace({{{"op", "remove"}, {"path", pointer}}});
  return fault_of(members);
}

// Passes that copy: each {name, sampled, written}.
json copies(const json& attachments, const std::vector<std::array<const char*, 3>>& passes) {
  json members = {{"attachments", attachments}, {"passes", json::array()}};
  for (const auto& [name, sampled, written] : passes)
    members["passes"].push_back(
        {{"name", name}, {"shader", "copy"}, {"sample", json::array({sampled})}, {"write", json::array({written})}});
  return members;
}

std::vector<std::string> order_of(const json& members) {
  const PassGraph graph = graph_of(members);
  std::vector<std::string> names;
  for (const int pass : pass_order(graph)) names.push_back(graph.passes[static_cast<std::size_t>(pass)].name);
  return names;
}

const json kColor = {{"format", "rgba8"}};
const json kDraw = {{"name", "draw"}, {"shader", "forward"}, {"draw", "all"}, {"write", json::array({"frame"})}};

// ---- Reading ----------------------------------------------------------------------------------------------------

TEST(PassesReader, ReadsADeferredRenderer) {
  const PassGraph graph = graph_of(deferred_passes());
  ASSERT_EQ(graph.attachments.size(), 5u);
  const Attachment& glow = *graph.find("glow");
  EXPECT_EQ(glow.format, AttachmentFormat::kR11G11B10F);
  EXPECT_EQ(glow.scale, 0.5);
  EXPECT_EQ(glow.levels, 5);
  EXPECT_EQ(glow.samples, 0);
  EXPECT_EQ(glow.life, AttachmentLife::kFrame);
  ASSERT_EQ(graph.passes.size(), 3u);
  const Pass& main = graph.passes[0];
  EXPECT_EQ(main.name, "main");
  EXPECT_TRUE(main.lists_subpasses);
  ASSERT_EQ(main.subpasses.size(), 3u);
  EXPECT_EQ(main.subpasses[0].draw, DrawFilter::kOpaque);
  EXPECT_EQ(main.subpasses[0].shader, PassShader::kGbuffer);
  EXPECT_EQ(main.subpasses[1].draw, DrawFilter::kNothing);
  EXPECT_EQ(main.subpasses[1].input, (std::vector<std::string>{"albedo", "normal", "pbr", "depth"}));
  EXPECT_EQ(main.subpasses[2].write, (std::vector<std::string>{"lit"}));
  EXPECT_EQ(graph.passes[2].subpasses[0].sample, (std::vector<std::string>{"lit", "glow"}));
  EXPECT_FALSE(graph.passes[2].lists_subpasses);
}

TEST(PassesReader, ReadsEveryMember) {
  json members = {{"attachments",
                   {{"half",
                     {{"format", "d16"},
                      {"size", {320, 200}},
                      {"samples", 4},
                      {"layers", 2},
                      {"levels", 3},
                      {"life", "persistent"}}}}},
                  {"passes", {kDraw}}};
  members["passes"][0].update({{"view", "right"}, {"load", {{"frame", "clear"}}}, {"store", {{"depth", "discard"}}}});
  const PassGraph graph = graph_of(members);
  const Attachment& half = graph.attachments[0];
  EXPECT_EQ(half.name, "half");
  EXPECT_EQ(half.format, AttachmentFormat::kD16);
  EXPECT_EQ(half.size, (std::array{320, 200}));
  EXPECT_EQ(half.samples, 4);
  EXPECT_EQ(half.layers, 2);
  EXPECT_EQ(half.levels, 3);
  EXPECT_EQ(half.life, AttachmentLife::kPersistent);
  const Pass& pass = graph.passes[0];
  EXPECT_EQ(pass.view, PassView::kRight);
  EXPECT_EQ(pass.load, (std::vector{std::pair{std::string("frame"), LoadAction::kClear}}));
  EXPECT_EQ(pass.store, (std::vector{std::pair{std::string("depth"), StoreAction::kDiscard}}));
}

TEST(PassesReader, ACaptureWithoutPassesHasNoGraph) {
  EXPECT_FALSE(test::read_asset(test::everything_asset()).settings.graph.has_value());
}

TEST(PassesReader, TheExampleOfThePageLoads) {
  const std::string page = test::read_text(fs::path(TESSERA_SOURCE_DIR) / "docs/extensions/TESSERA_capture.md");
  const std::size_t begin = page.find("```json\n\"attachments\""), end = page.find("```\n", begin + 8);
  ASSERT_NE(begin, std::string::npos);
  const json members = json::parse("{" + page.substr(begin + 8, end - begin - 8) + "}");
  EXPECT_EQ(members, deferred_passes());
}

TEST(PassesReader, RefusesMalformedGraphs) {
  EXPECT_EQ(fault_of({{"attachments", {{"a", kColor}}}}), "/attachments: need passes that write them");
  EXPECT_EQ(fault_of({{"passes", json::array()}}), "/passes: has 0 elements, needs at least 1");
  EXPECT_EQ(fault_with({{"/attachments/lit/format", "rgb9e5"}}),
            "/attachments/lit/format: is \"rgb9e5\", not one of rgba8, rgb10a2, rgba16f, r11g11b10f, rg16f, d16, d24, "
            "d32f");
  EXPECT_EQ(fault_with({}, {"/attachments/lit/format"}), "/attachments/lit: lacks the property 'format'");
  EXPECT_EQ(fault_with({{"/attachments/glow/size", {64, 64}}}), "/attachments/glow: has both a size and a scale");
  EXPECT_THAT(fault_with({{"/attachments/glow/scale", 0}}),
              testing::StartsWith("/attachments/glow/scale: is 0, outside"));
  EXPECT_THAT(fault_with({{"/attachments/glow/samples", 3}}), testing::StartsWith("/attachments/glow/samples: is 3, "));
  EXPECT_EQ(fault_with({{"/attachments/glow/levels", 16}}), "/attachments/glow/levels: is 16, outside [1, 15]");
  EXPECT_EQ(fault_with({{"/attachments/glow/layers", 257}}), "/attachments/glow/layers: is 257, outside [1, 256]");
  EXPECT_EQ(fault_with({{"/attachments/glow/life", "long"}}),
            "/attachments/glow/life: is \"long\", not one of transient, frame, persistent");
  EXPECT_EQ(fault_with({{"/attachments/", kColor}}), "/attachments/: is a name of 0 bytes, allowed are 1 to 64");
  EXPECT_EQ(
      fault_with({{"/passes/1/shader", "blur"}}),
      "/passes/1/shader: is \"blur\", not one of depth, forward, gbuffer, light, reduce, bloom, tonemap, taa, copy");
  EXPECT_EQ(fault_with({}, {"/passes/1/shader"}), "/passes/1: lacks the property 'shader', or 'subpasses'");
  EXPECT_EQ(fault_with({}, {"/passes/0/subpasses/1/shader"}), "/passes/0/subpasses/1: lacks the property 'shader'");
  EXPECT_EQ(fault_with({{"/passes/0/write", {"lit"}}}), "/passes/0/write: belongs to one of the subpasses");
  EXPECT_EQ(fault_with({{"/passes/0/subpasses/0/draw", "nothing"}}),
            "/passes/0/subpasses/0/draw: is \"nothing\", not one of opaque, blended, all");
  EXPECT_EQ(fault_with({{"/passes/0/view", "left"}}), "/passes/0/view: is \"left\", not one of camera, right");
  EXPECT_EQ(fault_with({{"/passes/0/load", {{"lit", "copy"}}}}),
            "/passes/0/load/lit: is \"copy\", not one of clear, load, none");
  EXPECT_EQ(fault_with({{"/passes/0/store", {{"lit", "copy"}}}}),
            "/passes/0/store/lit: is \"copy\", not one of store, resolve, discard");
  const json subpass = {{"shader", "light"}, {"input", {"lit"}}, {"write", {"lit"}}};
  EXPECT_EQ(fault_with({{"/passes/0/subpasses/3", subpass}}), "none");
  EXPECT_EQ(fault_with({{"/passes/0/subpasses/3", subpass}, {"/passes/0/subpasses/4", subpass}}),
            "/passes/0/subpasses: has 5 elements, allowed are 4");
}

TEST(PassesReader, HasLimits) {
  json members = {{"passes", json::array()}};
  for (int pass = 0; pass < 65; ++pass) {
    members["passes"].push_back(kDraw);
    members["passes"].back()["name"] = std::to_string(pass);
    members["attachments"][std::to_string(pass)] = kColor;
  }
  EXPECT_EQ(fault_of(members), "/attachments: are 65, allowed are 64");
  members["attachments"].erase("64");
  EXPECT_EQ(fault_of(members), "/passes: has 65 elements, allowed are 64");
  members["passes"].erase(64);
  EXPECT_EQ(fault_of(members), "none");
}

// ---- Faults -----------------------------------------------------------------------------------------------------

TEST(PassFaults, NamesAreKnownAndTheirOwn) {  // RG1
  EXPECT_EQ(fault_with({{"/passes/1/sample/0", "lighting"}}),
            "/passes/1/sample/0: is 'lighting', which is no attachment");
  EXPECT_EQ(fault_with({{"/passes/0/subpasses/1/input/3", "z"}}),
            "/passes/0/subpasses/1/input/3: is 'z', which is no attachment");
  EXPECT_EQ(fault_with({{"/passes/2/write/0", "a\nb"}}), "/passes/2/write/0: is 'a\\x0Ab', which is no attachment");
  EXPECT_EQ(fault_with({{"/passes/1/name", "main"}}), "/passes/1/name: is 'main', as passes/0 is called");
  EXPECT_EQ(fault_with({{"/attachments/depth", {{"format", "d16"}}}}),
            "/attachments/depth: exists in every graph: choose another name");
  EXPECT_EQ(fault_with({{"/passes/0/load", {{"li/t", "clear"}}}}), "/passes/0/load/li~1t: is no attachment");
  EXPECT_EQ(fault_with({{"/passes/0/store", {{"glow", "store"}}}}),
            "/passes/0/store/glow: is an attachment that the pass does not write");
  EXPECT_EQ(fault_with({{"/passes/0/store", {{"depth", "store"}}}}), "none");
}

TEST(PassFaults, AttachmentsOfAPassHaveOneSize) {  // RG2
  EXPECT_EQ(fault_with({{"/attachments/pbr/scale", 0.5}}),
            "/passes/0/subpasses/0/write/2: has 0.5 times the size of the frame, 'albedo' has the size of the frame: a "
            "pass writes attachments of one shape");
  EXPECT_EQ(fault_with({{"/attachments/pbr/size", {64, 32}}}),
            "/passes/0/subpasses/0/write/2: has 64x32 pixels, 'albedo' has the size of the frame: a pass writes "
            "attachments of one shape");
  EXPECT_EQ(fault_with({{"/attachments/lit/layers", 2}}),
            "/passes/0/subpasses/1/write/0: has 2 layers, 'albedo' has 1: a pass writes attachments of one shape");
  EXPECT_EQ(
      fault_with({{"/passes/0/subpasses/1/input/0", "glow"}}),
      "/passes/0/subpasses/1/input/0: has 0.5 times the size of the frame, 'albedo' has the size of the frame: an "
      "input is read at its own pixel, sample it instead");
  EXPECT_EQ(
      fault_of({{"attachments", {{"small", {{"format", "rgba8"}, {"scale", 0.5}}}}},
                {"passes", {{{"name", "far"}, {"shader", "forward"}, {"draw", "all"}, {"write", {"small"}}}, kDraw}}}),
      "/passes/0/write/0: has 0.5 times the size of the frame, 'depth' has the size of the frame, which a pass "
      "that draws writes: let it write an attachment of a depth format");
  EXPECT_EQ(
      fault_with({{"/attachments/glow/size", {8, 16}}, {"/attachments/glow/levels", 6}}, {"/attachments/glow/scale"}),
      "/attachments/glow/levels: are 6, 8x16 pixels have 5");
}

TEST(PassFaults, AttachmentsOfAPassHaveTheSameSamples) {  // RG2
  EXPECT_EQ(fault_with({{"/attachments/pbr/samples", 4}}),
            "/passes/0/subpasses/0/write/2: has 4 samples, 'albedo' has the samples of the frame: a pass writes "
            "attachments of one shape");
  EXPECT_EQ(fault_with({{"/attachments/glow/samples", 1}}), "none");
}

TEST(PassFaults, APassWritesAtMostEightColorsAndOneDepth) {  // RG2
  json members = {{"passes", {kDraw}}};
  for (int color = 0; color < 9; ++color) {
    const std::string name = "color" + std::to_string(color);
    members["attachments"][name] = kColor;
    members["passes"][0]["write"][static_cast<std::size_t>(color)] = name;
  }
  members["passes"].push_back({{"name", "last"}, {"shader", "copy"}, {"sample", {"color0"}}, {"write", {"frame"}}});
  EXPECT_EQ(fault_of(members), "/passes/0/write/8: is one colour too many, a pass writes 8 at most");
  members["passes"][0]["write"].erase(8);
  EXPECT_EQ(fault_of(members), "none");
  members["attachments"].update({{"near", {{"format", "d16"}}}, {"far", {{"format", "d32f"}}}});
  members["passes"][0]["write"][8] = "near";
  EXPECT_EQ(fault_of(members), "none");
  members["passes"][0]["write"][9] = "far";
  EXPECT_EQ(fault_of(members), "/passes/0/write/9: is a second depth beside 'near', a pass has one");
}

TEST(PassFaults, AnInputIsWrittenByAnEarlierSubpass) {  // RG3
  EXPECT_EQ(fault_with({{"/passes/0/subpasses/1/input/1", "lit"}}),
            "/passes/0/subpasses/1/input/1: is 'lit', which no earlier subpass of 'main' writes");
  EXPECT_EQ(fault_with({{"/passes/0/subpasses/0/input", {"depth"}}}),
            "/passes/0/subpasses/0/input/0: is 'depth', which no earlier subpass of 'main' writes");
  EXPECT_EQ(fault_with({{"/passes/2/input", {"lit"}}}),
            "/passes/2/input/0: is 'lit', which no earlier subpass of 'final' writes");
  EXPECT_EQ(fault_with({{"/passes/0/subpasses/2/input", {"lit"}}}), "none");  // it blends with its own
  // The depth is another attachment where the pass writes one.
  EXPECT_EQ(fault_with({{"/attachments/near", {{"format", "d16"}}}, {"/passes/0/subpasses/0/write/3", "near"}}),
            "/passes/0/subpasses/1/input/3: is 'depth', which no earlier subpass of 'main' writes");
}

TEST(PassFaults, NoPassSamplesItsOutput) {  // RG4
  EXPECT_EQ(fault_with({{"/passes/1/sample/1", "glow"}}), "/passes/1/sample/1: is 'glow', which 'bloom' writes itself");
  EXPECT_EQ(fault_with({{"/passes/0/subpasses/2/sample", {"depth"}}}),
            "/passes/0/subpasses/2/sample/0: is 'depth', which 'main' writes itself");
  EXPECT_EQ(fault_with({{"/passes/0/subpasses/2/sample", {"albedo"}}}),
            "/passes/0/subpasses/2/sample/0: is 'albedo', which 'main' writes itself");
}

TEST(PassFaults, APersistentAttachmentIsSampledAsThePreviousFrameLeftIt) {  // RG4
  json members = copies({{"history", {{"format", "rgba16f"}, {"life", "persistent"}}}, {"now", kColor}},
                        {{"begin", "frame", "now"}, {"mix", "now", "history"}, {"end", "history", "now"}});
  members["passes"].insert(members["passes"].begin(), kDraw);
  members["passes"][2]["shader"] = "taa";
  members["passes"][2]["sample"].push_back("history");
  EXPECT_EQ(fault_of(members), "none");
  members["passes"][1]["write"].push_back("history");
  EXPECT_EQ(fault_of(members), "/passes/2/sample/1: is 'history', which 'mix' writes itself");
}

TEST(PassFaults, ATransientAttachmentStaysInItsPass) {  // RG4
  EXPECT_EQ(fault_with({{"/attachments/albedo/life", "transient"}}), "none");
  EXPECT_EQ(fault_with({{"/attachments/lit/life", "transient"}}),
            "/passes/1/sample/0: is 'lit', which is transient: it exists in tile memory alone");
  EXPECT_EQ(fault_with({{"/attachments/pbr/life", "transient"}, {"/passes/0/load", {{"pbr", "load"}}}}),
            "/passes/0/load/pbr: is transient: there is nothing to load");
  EXPECT_EQ(fault_with({{"/attachments/pbr/life", "transient"}, {"/passes/0/store", {{"pbr", "resolve"}}}}),
            "/passes/0/store/pbr: is transient: it is not stored");
}

TEST(PassFaults, ReadAttachmentsAreWritten) {  // RG5
  EXPECT_EQ(fault_with({{"/attachments/noise", kColor}, {"/passes/2/sample/2", "noise"}}),
            "/passes/2/sample/2: is 'noise', which no pass writes");
  EXPECT_EQ(fault_with({{"/attachments/noise", {{"format", "rgba8"}, {"life", "persistent"}}},
                        {"/passes/2/sample/2", "noise"}}),
            "/passes/2/sample/2: is 'noise', which no pass writes");
  EXPECT_EQ(fault_with({{"/attachments/shown", kColor}, {"/passes/2/write/0", "shown"}}),
            "/passes: none writes 'frame'");
}

TEST(PassFaults, DiscardedAttachmentsAreNotRead) {  // RG5
  EXPECT_EQ(fault_with({{"/passes/0/store", {{"lit", "discard"}}}}),
            "/passes/0/store/lit: is discarded, and 'bloom' samples it");
  EXPECT_EQ(fault_with({{"/passes/2/store", {{"frame", "discard"}}}}),
            "/passes/2/store/frame: is discarded by the last pass that writes it");
  EXPECT_EQ(fault_with({{"/passes/0/store", {{"albedo", "discard"}, {"depth", "discard"}}}}), "none");
}

TEST(PassFaults, PassesDoNotWaitForEachOther) {  // RG6
  json members = copies({{"a", kColor}, {"b", kColor}, {"c", kColor}},
                        {{"one", "c", "a"}, {"two", "a", "b"}, {"three", "b", "c"}, {"show", "c", "frame"}});
  EXPECT_EQ(
      fault_of(members),
      "/passes/0/sample/0: closes a cycle: 'one' waits for 'three', which waits for 'two', which waits for 'one'");
  members["attachments"]["c"]["life"] = "persistent";  // of the previous frame
  EXPECT_EQ(fault_of(members), "none");
}

TEST(PassFaults, AShaderHasItsInputs) {  // RG7
  for (const char* shader : {"depth", "forward", "gbuffer"})
    EXPECT_EQ(fault_with({{"/passes/1/shader", shader}}),
              fmt::format("/passes/1/shader: is {}, which needs the property 'draw'", shader));
  for (const char* shader : {"light", "reduce", "bloom", "tonemap", "taa", "copy"})
    EXPECT_EQ(fault_with({{"/passes/0/subpasses/2/shader", shader}}),
              fmt::format("/passes/0/subpasses/2/draw: does not fit the shader {}, which runs over an image", shader));
  EXPECT_EQ(fault_with({{"/passes/0/subpasses/2/shader", "depth"}}),
            "/passes/0/subpasses/2/shader: is depth, which writes no colours");
  EXPECT_EQ(fault_with({}, {"/passes/0/subpasses/2/write"}),
            "/passes/0/subpasses/2/shader: is forward, which needs a colour to write");
  EXPECT_EQ(fault_with({}, {"/passes/1/write"}), "/passes/1/shader: is bloom, which needs an attachment to write");
  EXPECT_EQ(fault_with({}, {"/passes/1/sample"}), "/passes/1/shader: is bloom, which needs an attachment to sample");
  EXPECT_EQ(fault_with({}, {"/passes/2/sample"}),
            "/passes/2/shader: is tonemap, which needs an input or an attachment to sample");
  EXPECT_EQ(fault_with({}, {"/passes/0/subpasses/1/input"}),
            "/passes/0/subpasses/1/shader: is light, which needs an input or an attachment to sample");
  EXPECT_EQ(fault_with({{"/passes/2/shader", "taa"}}),
            "/passes/2/shader: is taa, which needs a persistent attachment to sample: its history");
  EXPECT_EQ(fault_with({{"/passes/2/view", "right"}}), "/passes/2/view: needs a subpass that draws");
}

// ---- Order and tile memory --------------------------------------------------------------------------------------

TEST(PassOrder, FollowsTheListWhereNothingElseDecides) {  // RG6
  EXPECT_EQ(order_of(deferred_passes()), (std::vector<std::string>{"main", "bloom", "final"}));
}

TEST(PassOrder, APassRunsAfterTheFirstWriterBehindItWhereThereIsNoneBefore) {  // RG6
  json members = deferred_passes();
  std::reverse(members["passes"].begin(), members["passes"].end());
  EXPECT_EQ(order_of(members), (std::vector<std::string>{"main", "bloom", "final"}));
}

TEST(PassOrder, APassReadsTheLastWriterBeforeIt) {  // RG6
  // `again` overwrites the depth that `look` samples.
  json members = {{"attachments", {{"far", kColor}, {"farther", kColor}}}, {"passes", {kDraw, {}, kDraw, {}}}};
  members["passes"][1] = {{"name", "look"}, {"shader", "reduce"}, {"sample", {"depth", "farther"}}, {"write", {"far"}}};
  members["passes"][2]["name"] = "again";
  members["passes"][3] = {{"name", "ahead"}, {"shader", "copy"}, {"sample", {"frame"}}, {"write", {"farther"}}};
  // `look` waits for `ahead`, which waits for `again`, which waits for `look`.
  EXPECT_THAT(fault_of(members), testing::StartsWith("/passes/1/sample/1: closes a cycle"));
  members["passes"][1]["sample"] = {"depth"};
  EXPECT_EQ(order_of(members), (std::vector<std::string>{"draw", "look", "again", "ahead"}));
}

TEST(TileBytes, HoldDepthAndTheLargerOfColorsAndVisibility) {
  // Known answers: 4 + max(16, bits / 8) bytes a sample.
  const auto bytes_of = [](const std::vector<const char*>& formats) {
    json members = {{"passes", {kDraw}}};
    for (std::size_t color = 0; color < formats.size(); ++color) {
      const std::string name = "color" + std::to_string(color);
      members["attachments"][name] = {{"format", formats[color]}};
      members["passes"][0]["write"][color] = name;
    }
    members["passes"].push_back({{"name", "last"}, {"shader", "copy"}, {"sample", {"color0"}}, {"write", {"frame"}}});
    const PassGraph graph = graph_of(members);
    return tile_bytes_per_sample(graph, graph.passes[0]);
  };
  EXPECT_EQ(bytes_of({"rgba8"}), 20);
  EXPECT_EQ(bytes_of({"rgba16f", "rgba16f"}), 20);                        // 128 bits
  EXPECT_EQ(bytes_of({"rgba16f", "rgba16f", "rgba16f", "rgba16f"}), 36);  // 256 bits
  EXPECT_EQ(bytes_of({"rgba16f", "rgba16f", "rgba16f", "rgba16f", "rgba16f", "rgba16f", "rgba16f", "rgba16f"}), 68);
  const PassGraph deferred = graph_of(deferred_passes());
  EXPECT_EQ(tile_bytes_per_sample(deferred, deferred.passes[0]), 24);  // 3 x 32 + 64 bits
  EXPECT_EQ(tile_bytes_per_sample(deferred, deferred.passes[1]), 4);   // an image: its colours alone
  EXPECT_EQ(tile_bytes_per_sample(deferred, deferred.passes[2], 64), 8);
  json depth = {{"passes", {kDraw, {{"name", "depth"}, {"shader", "depth"}, {"draw", "opaque"}}}}};
  const PassGraph prepass = graph_of(depth);
  EXPECT_EQ(tile_bytes_per_sample(prepass, prepass.passes[1]), 4);
}

}  // namespace
}  // namespace tessera::scene::passes_reader_test
