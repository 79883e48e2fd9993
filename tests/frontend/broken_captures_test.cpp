#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>

#include "tests/frontend/broken_captures.h"
#include "tests/support/captures.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace tessera::test {

namespace fs = std::filesystem;
using nlohmann::json;

fs::path put(const fs::path& folder, const std::string& name, const std::string& contents) {
  write_text(folder / name, contents);
  return folder / name;
}

BrokenCapture damaged(std::string name, std::function<void(GltfAsset&)> damage, std::string place, std::string fault) {
  return {std::move(name),
          [damage = std::move(damage)](const fs::path& folder) {
            GltfAsset asset = everything_asset();
            damage(asset);
            return put(folder, "capture.glb", asset.glb());
          },
          std::move(place), std::move(fault)};
}

BrokenCapture edited(std::string name, const char* pointer, json value, std::string place, std::string fault) {
  const std::string at = pointer;
  return damaged(std::move(name), [=](GltfAsset& a) { a.document[json::json_pointer(at)] = value; }, place.empty() ? at : std::move(place), std::move(fault));
}

BrokenCapture without(std::string name, const char* pointer, std::string place, std::string fault) {
  const json::json_pointer at(pointer);
  return damaged(std::move(name), [=](GltfAsset& a) { a.document[at.parent_pointer()].erase(at.back()); }, std::move(place), std::move(fault));
}

BrokenCapture file_of(std::string name, std::string contents, std::string place, std::string fault) {
  return {name, [=](const fs::path& folder) { return put(folder, name, contents); }, std::move(place), std::move(fault)};
}

namespace {

// Each capture gets a process of its own, with a limit on its memory that no refusal needs and a limit on its time.
// Builds with the address sanitizer map terabytes of address space and go without the former.
#ifdef TESSERA_SANITIZED
const ProcessLimits kLimits{.seconds = 60};
#else
const ProcessLimits kLimits{.memory_bytes = 1ull << 30, .seconds = 20};
#endif

std::set<fs::path> files_below(const fs::path& folder) {
  std::set<fs::path> out;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) out.insert(entry.path());
  return out;
}

std::vector<BrokenClass> corpus() {
  std::vector<BrokenClass> out = broken_containers();
  for (const auto& part : {broken_documents(), broken_contents()}) out.insert(out.end(), part.begin(), part.end());
  return out;
}

void expect_refused(const BrokenCapture& broken) {
  SCOPED_TRACE(broken.name);
  const TemporaryFolder folder;
  const fs::path capture = broken.make(folder.path());
  const std::set<fs::path> before = files_below(folder.path());
  const ProcessResult result = run_tessera({"inspect", capture.string()}, kLimits);
  EXPECT_FALSE(result.timed_out);
  EXPECT_EQ(result.status, broken.status) << "signal " << result.signal << ": " << result.errors;
  EXPECT_EQ(result.output, "");
  EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
  EXPECT_TRUE(result.errors.empty() || result.errors.back() == '\n');
  for (const std::string& part : {capture.string() + ": " + (broken.place.starts_with("byte 0") ? broken.place : ""), broken.place, broken.fault})
    EXPECT_NE(result.errors.find(part), std::string::npos) << "no '" << part << "' in: " << result.errors;
  EXPECT_EQ(files_below(folder.path()), before);
}

class BrokenCaptures : public testing::TestWithParam<BrokenClass> {};

TEST_P(BrokenCaptures, AreRefusedInOneLineThatNamesFilePlaceAndFault) {
  for (const BrokenCapture& broken : GetParam().captures) expect_refused(broken);
}

INSTANTIATE_TEST_SUITE_P(EachClass, BrokenCaptures, testing::ValuesIn(corpus()), [](const auto& instance) { return instance.param.name; });

TEST(BrokenCaptureCorpus, HoldsAtLeast130DifferentlyNamedCaptures) {
  std::set<std::string> names;
  std::size_t count = 0;
  for (const BrokenClass& c : corpus())
    for (const BrokenCapture& broken : c.captures) {
      EXPECT_TRUE(names.insert(c.name + "/" + broken.name).second) << broken.name;
      ++count;
    }
  EXPECT_GE(count, 130u);
  RecordProperty("captures", static_cast<int>(count));
}

TEST(BrokenCaptureCorpus, StartsFromCapturesThatLoad) {
  const TemporaryFolder folder;
  for (const auto& [name, contents] : {std::pair{"everything.glb", everything_asset().glb()}, {"everything.gltf", everything_asset().gltf()},
                                       {"sequential.glb", draco_asset(true).glb()}, {"edgebreaker.glb", draco_asset(false).glb()}}) {
    const ProcessResult result = run_tessera({"inspect", put(folder.path(), name, contents).string()}, kLimits);
    EXPECT_EQ(result.status, 0) << name << ": " << result.errors;
    EXPECT_EQ(result.errors, "");
  }
}

}  // namespace
}  // namespace tessera::test
