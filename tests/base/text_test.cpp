#include "base/text.h"
#include "tests/support/tests.h"

namespace tessera::text_test {
namespace {

TEST(Text, EscapedTextStaysOneLineOfPrintableCharacters) {
  EXPECT_EQ(escape_control("a\nb\t\x7F"), "a\\x0Ab\\x09\\x7F");
  EXPECT_EQ(escape_control("\xC3\xA9 ok"), "\xC3\xA9 ok");  // valid UTF-8 stays
  EXPECT_EQ(escape_control("\xC3("), "\\xC3(");             // a broken sequence does not
  EXPECT_EQ(escape_control("\xC0\xAF"), "\\xC0\\xAF");      // nor an overlong one
}

TEST(Text, LongTextLosesItsMiddleNotItsEnds) {
  std::string text(500, 'a');
  text += "END";
  const std::string shortened = escape_control(text, 20);
  EXPECT_EQ(shortened.size(), 23u);
  EXPECT_TRUE(shortened.starts_with("aaaaaaaaaa..."));
  EXPECT_TRUE(shortened.ends_with("END"));
}

TEST(Text, EditDistanceCountsInsertionsDeletionsReplacementsAndSwaps) {
  EXPECT_EQ(edit_distance("", "abc"), 3u);
  EXPECT_EQ(edit_distance("tile", "tile"), 0u);
  EXPECT_EQ(edit_distance("tiel", "tile"), 1u);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3u);
}

// The whole table of the dynamic program, as it is written in textbooks.
std::size_t plain_distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> table(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i)
    for (std::size_t j = 0; j <= b.size(); ++j) {
      std::size_t& cell = table[i][j];
      if (i == 0 || j == 0) {
        cell = i + j;
        continue;
      }
      cell = std::min({table[i - 1][j] + 1, table[i][j - 1] + 1, table[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        cell = std::min(cell, table[i - 2][j - 2] + 1);
    }
  return table[a.size()][b.size()];
}

std::string random_text(test::Random& random, int max_letters, int alphabet) {
  std::string text(static_cast<std::size_t>(random.integer(0, max_letters)), ' ');
  for (char& c : text) c = static_cast<char>('a' + random.integer(0, alphabet - 1));
  return text;
}

TEST(Text, EditDistanceUpToABoundIsTheWholeTablesDistanceOrOneMoreThanTheBound) {
  test::Random random(1);
  std::size_t within = 0, beyond = 0;
  for (int n = 0; n < 20000; ++n) {
    const std::string a = random_text(random, 12, 1 + n % 4), b = random_text(random, 12, 1 + n % 4);
    const std::size_t expected = plain_distance(a, b), most = static_cast<std::size_t>(random.integer(0, 13));
    ASSERT_EQ(edit_distance(a, b), expected) << a << " " << b;
    ASSERT_EQ(edit_distance(a, b, most), std::min(expected, most + 1)) << a << " " << b << " " << most;
    ++(expected <= most ? within : beyond);
  }
  EXPECT_GT(within, 1000u);
  EXPECT_GT(beyond, 1000u);
}

TEST(Text, NearestNameEqualsASearchOfAllCandidates) {
  test::Random random(2);
  std::size_t found = 0, none = 0;
  for (int n = 0; n < 3000; ++n) {
    std::vector<std::string> candidates;
    for (int k = 0; k < 10; ++k) candidates.push_back(random_text(random, 10, 2 + n % 6));
    const std::string name = random_text(random, 14, 2 + n % 6);
    std::string expected;
    std::size_t least = name.size() / 2 + 1;
    for (const std::string& candidate : candidates)
      if (const std::size_t distance = plain_distance(name, candidate); distance < least)
        least = distance, expected = candidate;
    ASSERT_EQ(nearest_name(name, candidates), expected) << name;
    ++(expected.empty() ? none : found);
  }
  EXPECT_GT(found, 500u);
  EXPECT_GT(none, 100u);
}

// A table of 64 Mi times 30 cells would take minutes.
TEST(Text, ANameOfAnyLengthIsAnsweredAtOnce) {
  const std::vector<std::string> names(200, "parameter_buffer.full_policy");
  EXPECT_EQ(nearest_name(std::string(64 << 20, 'p'), names), "");
  EXPECT_EQ(edit_distance(std::string(64 << 20, 'p'), names[0], 20), 21u);
}

TEST(Text, NearestNameIsTheClosestWithinHalfTheLength) {
  const std::vector<std::string> names = {"tile.width", "tile.height", "memory.burst_bytes"};
  EXPECT_EQ(nearest_name("tile.widht", names), "tile.width");
  EXPECT_EQ(nearest_name("colour", names), "");
}

TEST(Text, HumanBytesSwitchUnitsAtPowersOf1024) {
  EXPECT_EQ(human_bytes(1023), "1023 B");
  EXPECT_EQ(human_bytes(1024), "1.0 KiB");
  EXPECT_EQ(human_bytes(5ull << 30), "5.0 GiB");
}

}  // namespace
}  // namespace tessera::text_test
