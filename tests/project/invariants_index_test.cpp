// Invariants have numbers that are unique in the project, and each is cited by a test that shows it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/captures.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = TESSERA_SOURCE_DIR;

// Numbers that a text declares: "//   PB1  what holds" in a header, "| M1 | what holds |" in docs/architecture.md.
std::vector<std::string> declared_in(const std::string& text) {
  static const std::regex kHeader("^ *//   ([A-Z]+[0-9]+)  [^ ].*$"), kRow("^\\| (M[0-9]+) \\| .*$");
  std::vector<std::string> numbers;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    std::smatch match;
    if (std::regex_match(line, match, kHeader) || std::regex_match(line, match, kRow)) numbers.push_back(match[1]);
  }
  return numbers;
}

// Everything in a text that may be a number: capitals and digits, not inside a word; a test's name may begin with it.
std::set<std::string> cited_in(const std::string& text) {
  static const std::regex kCitation("(^|[^A-Za-z0-9_])((And)?[A-Z]+[0-9]+(And)?)+"), kNumber("[A-Z]+[0-9]+");
  std::set<std::string> numbers;
  for (auto at = std::sregex_iterator(text.begin(), text.end(), kCitation); at != std::sregex_iterator(); ++at) {
    const std::string run = at->str();
    for (auto one = std::sregex_iterator(run.begin(), run.end(), kNumber); one != std::sregex_iterator(); ++one)
      numbers.insert(one->str());
  }
  return numbers;
}

// Files of the project's folders with this ending, by path.
std::vector<fs::path> files_with(const std::string& extension) {
  std::vector<fs::path> files;
  for (const auto& top : fs::directory_iterator(kRoot)) {
    const std::string name = top.path().filename().string();
    if (!top.is_directory() || name.starts_with(".") || name == "build" || name == "out") continue;
    for (const auto& entry : fs::recursive_directory_iterator(top.path()))
      if (entry.is_regular_file() && entry.path().extension() == extension) files.push_back(entry.path());
  }
  return files;
}

// Where each number is declared.
std::map<std::string, std::vector<fs::path>> declarations() {
  std::map<std::string, std::vector<fs::path>> all;
  std::vector<fs::path> files = files_with(".h");
  files.push_back(kRoot / "docs" / "architecture.md");
  for (const fs::path& file : files)
    for (const std::string& number : declared_in(test::read_text(file))) all[number].push_back(file);
  return all;
}

TEST(Invariants, HaveNumbersThatAreUniqueInTheProject) {
  const auto all = declarations();
  EXPECT_GE(all.size(), 100u);
  for (const char* number : {"M1", "M6", "PB1", "LRU1"}) EXPECT_TRUE(all.contains(number)) << number;
  std::map<std::string, fs::path> unit_of;
  for (const auto& [number, files] : all) {
    EXPECT_EQ(files.size(), 1u) << number << " is declared by " << files.front() << " and " << files.back();
    const std::string prefix = number.substr(0, number.find_first_of("0123456789"));
    const auto [found, added] = unit_of.emplace(prefix, files.front());
    EXPECT_EQ(found->second, files.front()) << "the prefix " << prefix << " names two units";
  }
}

TEST(Invariants, AreEachCitedByATest) {
  std::set<std::string> cited;
  for (const fs::path& file : files_with(".cpp"))
    if (fs::relative(file, kRoot).begin()->string() == "tests" && file.filename() != "invariants_index_test.cpp")
      cited.merge(cited_in(test::read_text(file)));
  for (const auto& [number, files] : declarations())
    EXPECT_TRUE(cited.contains(number)) << number << " of " << files.front() << " is cited by no test";
}

TEST(Invariants, ADeclarationOrACitationThatIsMissingIsCaught) {
  EXPECT_THAT(
      declared_in("// Invariants:\n//   PB1  One.\n//        PB2  Indented text, no declaration.\n| M3 | x |\n"),
      testing::ElementsAre("PB1", "M3"));
  EXPECT_THAT(cited_in("TEST(A, PB1PB2Full) {  // LC1, LC2\nTEST(B, SE1AndSE2Hold)"),
              testing::IsSupersetOf({"PB1", "PB2", "LC1", "LC2", "SE1", "SE2"}));
  EXPECT_THAT(cited_in("a_PB1 VPB2 PB33"), testing::Not(testing::Contains(testing::AnyOf("PB1", "PB2", "PB3"))));
}

}  // namespace
}  // namespace tessera
