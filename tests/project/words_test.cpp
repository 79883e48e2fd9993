// One word per concept, in sources and documents; documents that can be read in an hour.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/captures.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;
using test::read_text;

const fs::path kRoot = TESSERA_SOURCE_DIR;
const std::set<std::string> kGenerated = {"gpu.md",        "counters.md", "settings.md", "procedures.md",
                                          "extensions.md", "formats.md",  "stability.md"};
constexpr std::size_t kMaxWords = 20000;

struct RetiredPhrase {
  std::string begin, replacement;
  std::regex regex;
};

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// The letters that every match of an expression begins with: searching them first saves nine tenths of the time.
std::string letters_at_the_front(const std::string& expression) {
  std::size_t n = 0;
  while (n < expression.size() && (std::isalpha(static_cast<unsigned char>(expression[n])) || expression[n] == ' '))
    ++n;
  if (n < expression.size() && expression[n] == '?' && n > 0) --n;
  return lower(expression.substr(0, n));
}

// tests/project/retired_words.txt: a phrase as a regular expression and, after a tab, what is said instead. Whole words,
// capitals or not.
std::vector<RetiredPhrase> retired_phrases() {
  std::vector<RetiredPhrase> phrases;
  std::istringstream stream(read_text(kRoot / "tests" / "project" / "retired_words.txt"));
  for (std::string line; std::getline(stream, line);) {
    const std::size_t tab = line.find('\t');
    EXPECT_NE(tab, std::string::npos) << line;
    if (tab == std::string::npos) continue;
    const std::string text = line.substr(0, tab);
    phrases.push_back({letters_at_the_front(text), line.substr(tab + 1),
                       std::regex("\\b(?:" + text + ")\\b", std::regex::ECMAScript | std::regex::icase)});
  }
  return phrases;
}

// A line without what is a name and not a word: code marks of documents, quoted tokens of sources (keys of JSON, options,
// files).
std::string prose_of(const std::string& line, bool document) {
  static const std::regex kCode("`[^`]*`"), kToken(R"re((["'])[A-Za-z0-9_.:/%=&?*#+-]*\1)re");
  return std::regex_replace(line, document ? kCode : kToken, " ");
}

// "line number: phrase (say: replacement)" for each line that has a retired phrase.
std::vector<std::string> retired_in(const std::string& text, bool document, const std::vector<RetiredPhrase>& phrases) {
  std::vector<std::string> found;
  std::istringstream stream(text);
  bool fenced = false;
  std::size_t number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    if (document && line.starts_with("```")) fenced = !fenced;
    if (fenced) continue;
    const std::string low = lower(line);
    for (const RetiredPhrase& phrase : phrases) {
      if (low.find(phrase.begin) == std::string::npos) continue;
      const std::string prose = prose_of(line, document);
      if (std::smatch match; std::regex_search(prose, match, phrase.regex))
        found.push_back(std::to_string(number) + ": " + match.str() + " (say: " + phrase.replacement + ")");
    }
  }
  return found;
}

bool is_document(const fs::path& file) { return file.extension() == ".md"; }

bool is_searched(const fs::path& file) {
  static const std::set<std::string> kEndings = {".h", ".cpp", ".inc", ".js", ".py", ".sh", ".cmake", ".md"};
  return kEndings.contains(file.extension().string()) || file.filename() == "CMakeLists.txt";
}

std::vector<fs::path> searched_files() {
  std::vector<fs::path> files;
  for (const auto& top : fs::directory_iterator(kRoot)) {
    const std::string name = top.path().filename().string();
    if (name.starts_with(".") || name == "build" || name == "out") continue;
    if (top.is_regular_file() && is_searched(top.path())) files.push_back(top.path());
    if (!top.is_directory()) continue;
    for (const auto& entry : fs::recursive_directory_iterator(top.path()))
      if (entry.is_regular_file() && is_searched(entry.path())) files.push_back(entry.path());
  }
  return files;
}

TEST(Words, NoRetiredPhraseIsUsed) {
  const std::vector<RetiredPhrase> phrases = retired_phrases();
  ASSERT_GE(phrases.size(), 20u);
  for (const RetiredPhrase& phrase : phrases) EXPECT_GE(phrase.begin.size(), 3u) << phrase.begin;
  for (const fs::path& file : searched_files()) {
    if (file.filename() == "words_test.cpp") continue;
    EXPECT_THAT(retired_in(read_text(file), is_document(file), phrases), testing::IsEmpty())
        << fs::relative(file, kRoot);
  }
}

TEST(Words, ARetiredPhraseIsCaughtAndAStableNameIsNot) {
  const std::vector<RetiredPhrase> phrases = retired_phrases();
  const auto count = [&](const std::string& text, bool document) { return retired_in(text, document, phrases).size(); };
  for (const char* text : {"// The picture, whole.", "two Rivals", "through the middle of the lens", "int most_tiles;",
                           "each stroke", "runs of the pixel shader", "a tile queue"}) {
    EXPECT_EQ(count(text, false), 1u) << text;
    EXPECT_EQ(count(text, true), 1u) << text;
  }
  for (const char* text : {"study[\"pictures\"]", "fuzz(picture=300000)", "stroke-width: 2", "tessera_embree_rival",
                           "binner.tile_queue", "pictured"})
    EXPECT_EQ(count(text, false), 0u) << text;
  EXPECT_EQ(count("member `pictures`\n```json\n\"a picture\"\n```\n", true), 0u);
}

std::size_t words_of(const std::string& text) {
  std::istringstream stream(text);
  std::size_t words = 0;
  for (std::string word; stream >> word;) ++words;
  return words;
}

// README.md, the README.md of each folder, docs/*.md and docs/extensions/*.md, but for generated references.
std::vector<fs::path> written_documents() {
  std::vector<fs::path> files;
  for (const auto& top : fs::directory_iterator(kRoot)) {
    const std::string name = top.path().filename().string();
    if (name == "README.md") files.push_back(top.path());
    if (name.starts_with(".") || name == "build" || name == "out" || !top.is_directory()) continue;
    if (fs::exists(top.path() / "README.md")) files.push_back(top.path() / "README.md");
  }
  for (const fs::path& folder : {kRoot / "docs", kRoot / "docs" / "extensions"})
    for (const auto& entry : fs::directory_iterator(folder))
      if (is_document(entry.path()) && !(folder.filename() == "docs" && kGenerated.contains(entry.path().filename())))
        files.push_back(entry.path());
  return files;
}

TEST(Words, DocumentsHaveAtMostTwentyThousand) {
  std::size_t words = 0;
  const std::vector<fs::path> files = written_documents();
  EXPECT_GE(files.size(), 30u);
  for (const fs::path& file : files) words += words_of(read_text(file));
  EXPECT_LE(words, kMaxWords) << "measurements are CSV files with a plot and two sentences of what they say";
}

TEST(Words, AreCountedWithTheBarsOfTables) { EXPECT_EQ(words_of("| a | b c |\n\n- d\n"), 8u); }

}  // namespace
}  // namespace tessera
