#include <sys/resource.h>
#include <csignal>

#include "base/atomic_file.h"
#include "base/check.h"
#include "base/error.h"
#include "base/json_text.h"
#include "tests/support/tests.h"

namespace tessera::files_and_json_test {
namespace {

std::size_t file_count(const std::filesystem::path& folder) {
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) ++count;
  return count;
}

TEST(AtomicFile, AppearsOnlyWhenCommitted) {
  const test::TemporaryFolder folder;
  {
    AtomicFile file(folder / "a");
    test::write_text(file.temporary(), "half");
    EXPECT_FALSE(std::filesystem::exists(folder / "a"));
  }
  EXPECT_EQ(file_count(folder.path()), 0u);  // an abandoned file leaves nothing
  write_file_atomically(folder / "deep" / "er" / "a", "whole");
  EXPECT_EQ(test::read_text(folder / "deep" / "er" / "a"), "whole");
  EXPECT_EQ(file_count(folder / "deep" / "er"), 1u);
}

TEST(AtomicFile, ReplacesAnOldFileWhole) {
  const test::TemporaryFolder folder;
  write_file_atomically(folder / "a", std::string(100000, 'x'));
  write_file_atomically(folder / "a", "y");
  EXPECT_EQ(test::read_text(folder / "a"), "y");
}

TEST(AtomicFile, ReportsWhereItCannotWrite) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "file", "");
  EXPECT_THROW(write_file_atomically(folder / "file" / "a", "x"), SystemError);
  std::filesystem::create_directory(folder / "taken");
  test::write_text(folder / "taken" / "inside", "");
  EXPECT_THROW(write_file_atomically(folder / "taken", "x"), SystemError);
  EXPECT_EQ(file_count(folder.path()), 2u);
}

TEST(AtomicFile, AWriteThatFailsHalfWayIsReportedAndLeavesNothing) {
  // A limit on the size of files fails writes as a full disk does.
  const test::TemporaryFolder folder;
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(write_file_atomically(folder / "a", std::string(5000, 'x')), SystemError);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(file_count(folder.path()), 0u);
}

TEST(JsonText, NamesTheByteOfASyntaxError) {
  try {
    parse_json("{\"a\": [1, 2,, 3]}", "f.json");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), "f.json");
    EXPECT_EQ(error.place(), "byte 13");
  }
}

TEST(JsonText, RefusesDeepNestingButNotBracketsInTexts) {
  EXPECT_THROW(parse_json(std::string(65, '[') + std::string(65, ']'), "f"), InputError);
  EXPECT_NO_THROW(parse_json(std::string(64, '[') + std::string(64, ']'), "f"));
  EXPECT_NO_THROW(parse_json("\"" + std::string(1000, '[') + "\\\"[[[\"", "f"));
  EXPECT_THROW(parse_json(std::string(1000000, '['), "f"), InputError);
}

TEST(JsonText, AnArrayOfAStreamIsReadElementByElement) {
  const auto read = [](const std::string& text) {
    std::istringstream stream(text);
    return parse_json_array(stream, "f", "rows", [](const nlohmann::json& row) { return row.at("n") != 2; });
  };
  EXPECT_EQ(
      read(R"({"a": {"rows": [{"n": 2}]}, "rows": [{"n": 1, "m": {"n": 2}}, {"n": 2}, {"n": 3}], "z": [{"n": 2}]})"),
      nlohmann::json::parse(
          R"({"a": {"rows": [{"n": 2}]}, "rows": [{"n": 1, "m": {"n": 2}}, {"n": 3}], "z": [{"n": 2}]})"));
  EXPECT_THROW(read(R"({"rows": [{"n": 1})"), InputError);
  EXPECT_THROW(read("{\"rows\": [{\"n\": " + std::string(70, '[') + std::string(70, ']') + "}]}"), InputError);
  EXPECT_NO_THROW(read("{\"rows\": [{\"n\": " + std::string(60, '[') + std::string(60, ']') + "}]}"));
}

TEST(JsonText, RefusesNumbersThatNoDoubleHolds) { EXPECT_THROW(parse_json("[1e999]", "f"), InputError); }

TEST(Check, AFailureNamesThePlaceOfWork) {
  const auto fail = [] {
    current_work_place() = {3, 17, 42};
    TESSERA_CHECK(1 + 1 == 3, "sums are right");
  };
  EXPECT_DEATH(fail(), "sums are right.*\n.*frame 3, tile 17, base patch 42\n");
}

TEST(Check, AFailureTellsTheProgram) {
  const auto fail = [] {
    set_failure_hook([](const WorkPlace& place) { std::fprintf(stderr, "hook %d\n", static_cast<int>(place.tile)); });
    current_work_place() = {3, 17, 42};
    TESSERA_CHECK(1 + 1 == 3, "sums are right");
  };
  EXPECT_DEATH(fail(), "base patch 42\nhook 17");
}

}  // namespace
}  // namespace tessera::files_and_json_test
