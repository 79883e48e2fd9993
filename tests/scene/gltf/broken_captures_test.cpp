#include "tests/scene/gltf/broken_captures.h"
#include "scene/capture_reader.h"
#include "tests/support/meshopt_asset.h"
#include "tests/support/tests.h"

namespace tessera::test::broken_captures_test {

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

void expect_refused(const BrokenCapture& broken) {
  SCOPED_TRACE(broken.name);
  const TemporaryFolder folder;
  const fs::path capture = broken.make(folder.path());
  const std::set<fs::path> before = files_below(folder.path());
  std::vector<std::string> arguments = {"inspect", capture.string()};
  if (broken.strict) arguments.push_back("--strict");
  const ProcessResult result = run_tessera(arguments, kLimits);
  EXPECT_FALSE(result.timed_out);
  EXPECT_EQ(result.status, broken.status) << "signal " << result.signal << ": " << result.errors;
  EXPECT_EQ(result.output, "");
  EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
  EXPECT_TRUE(result.errors.empty() || result.errors.back() == '\n');
  for (const std::string& part :
       {capture.string() + ": " + (broken.place.starts_with("byte 0") ? broken.place : ""), broken.place, broken.fault})
    EXPECT_NE(result.errors.find(part), std::string::npos) << "no '" << part << "' in: " << result.errors;
  EXPECT_EQ(files_below(folder.path()), before);
}

class BrokenCaptures : public testing::TestWithParam<BrokenClass> {};

TEST_P(BrokenCaptures, AreRefusedInOneLineThatNamesFilePlaceAndFault) {  // M6
  for (const BrokenCapture& broken : GetParam().captures) expect_refused(broken);
}

INSTANTIATE_TEST_SUITE_P(EachClass, BrokenCaptures, testing::ValuesIn(broken_captures()),
                         [](const auto& instance) { return instance.param.name; });

// A capture that --strict alone refuses loads without it, with a note that has the text of the refusal.
TEST(BrokenCaptureCorpus, CapturesOfAClearMeaningLoadWithANote) {  // NT1
  std::size_t count = 0;
  for (const BrokenClass& c : broken_captures())
    for (const BrokenCapture& broken : c.captures) {
      if (!broken.strict) continue;
      SCOPED_TRACE(c.name + "/" + broken.name);
      const TemporaryFolder folder;
      const fs::path file = broken.make(folder.path());
      ++count;
      try {
        const scene::Capture capture = scene::read_capture(file);
        EXPECT_THAT(capture.notices, testing::Contains(testing::AllOf(testing::HasSubstr(broken.place),
                                                                      testing::HasSubstr(broken.fault))));
      } catch (const std::exception& error) {
        ADD_FAILURE() << error.what();
      }
    }
  EXPECT_GE(count, 25u);
}

TEST(BrokenCaptureCorpus, HoldsAtLeast130DifferentlyNamedCaptures) {
  std::set<std::string> names;
  std::size_t count = 0;
  for (const BrokenClass& c : broken_captures())
    for (const BrokenCapture& broken : c.captures) {
      EXPECT_TRUE(names.insert(c.name + "/" + broken.name).second) << broken.name;
      ++count;
    }
  EXPECT_GE(count, 130u);
  RecordProperty("captures", static_cast<int>(count));
}

TEST(BrokenCaptureCorpus, StartsFromCapturesThatLoad) {
  const TemporaryFolder folder;
  for (const auto& [name, contents] : {std::pair{"everything.glb", everything_asset().glb()},
                                       {"everything.gltf", everything_asset().gltf()},
                                       {"sequential.glb", draco_asset(true).glb()},
                                       {"edgebreaker.glb", draco_asset(false).glb()},
                                       {"meshopt.glb", meshopt_asset().glb()}}) {
    const ProcessResult result = run_tessera({"inspect", put(folder.path(), name, contents).string()}, kLimits);
    EXPECT_EQ(result.status, 0) << name << ": " << result.errors;
    EXPECT_EQ(result.errors, "");
  }
}

}  // namespace
}  // namespace tessera::test::broken_captures_test
