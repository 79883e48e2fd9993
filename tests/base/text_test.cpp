#include "base/text.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

TEST(Text, EscapedTextStaysOneLineOfPrintableCharacters) {
  EXPECT_EQ(escape_control("a\nb\t\x7F"), "a\\x0Ab\\x09\\x7F");
  EXPECT_EQ(escape_control("\xC3\xA9 ok"), "\xC3\xA9 ok");        // valid UTF-8 stays
  EXPECT_EQ(escape_control("\xC3("), "\\xC3(");                   // a broken sequence does not
  EXPECT_EQ(escape_control("\xC0\xAF"), "\\xC0\\xAF");            // nor an overlong one
}

TEST(Text, LongTextLosesItsMiddleNotItsEnds) {
  const std::string shortened = escape_control(std::string(500, 'a') + "END", 20);
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
}  // namespace tessera
