#include "base/key_table.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/error.h"

namespace tessera {
namespace {

struct Thing {
  std::int64_t whole = 3;
  double real = 0.5;
  bool flag = false;
  std::string word = "one";
};

const KeyTable<Thing>& table() {
  static const KeyTable<Thing> kTable({{"a.whole", &Thing::whole, "pixels", 1, 10, "A whole number."},
                                       {"a.real", &Thing::real, "", 0, 1, "A real number."},
                                       {"a.flag", &Thing::flag, "A flag."},
                                       {"a.word", &Thing::word, {"one", "two"}, "A word."}});
  return kTable;
}

void set(Thing& thing, const char* key, const nlohmann::json& value) { table().set(thing, *table().find(key), value); }

TEST(KeyTable, ValuesComeFromTextsAndFromJsonAlike) {
  Thing a, b;
  set(a, "a.whole", "7"), set(b, "a.whole", 7);
  set(a, "a.real", "0.25"), set(b, "a.real", 0.25);
  set(a, "a.flag", "true"), set(b, "a.flag", true);
  set(a, "a.word", "two"), set(b, "a.word", "two");
  EXPECT_EQ(a.whole, 7);
  EXPECT_EQ(b.whole, 7);
  EXPECT_EQ(a.real, b.real);
  EXPECT_TRUE(a.flag && b.flag);
  EXPECT_EQ(a.word, "two");
}

TEST(KeyTable, ValuesOutsideTheDeclaredRangeOrFormAreRefused) {
  Thing thing;
  for (const char* bad : {"0", "11", "x", "", "7.5", "7 ", "99999999999999999999"})
    EXPECT_THROW(set(thing, "a.whole", bad), UsageError) << bad;
  for (const char* bad : {"-0.1", "1.1", "nan", "inf", "1e999", "0.5x"})
    EXPECT_THROW(set(thing, "a.real", bad), UsageError) << bad;
  EXPECT_THROW(set(thing, "a.flag", "maybe"), UsageError);
  EXPECT_THROW(set(thing, "a.word", "three"), UsageError);
  EXPECT_THROW(set(thing, "a.whole", nlohmann::json::array()), UsageError);
  EXPECT_EQ(thing.whole, 3);
}

TEST(KeyTable, MessagesSayWhatIsAllowed) {
  Thing thing;
  try {
    set(thing, "a.word", "three");
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_STREQ(error.what(), "a.word: 'three' is not one of one, two");
  }
}

TEST(KeyTable, UnknownKeysNameTheNearestKnownOne) {
  const std::vector<std::string> known = {"a.whole", "a.real"};
  EXPECT_EQ(unknown_key_message("a.whloe", known), "unknown key 'a.whloe'; did you mean 'a.whole'?");
  EXPECT_EQ(unknown_key_message("zzz", known), "unknown key 'zzz'");
}

TEST(KeyTable, DescriptionsCarryDefaultAndRange) {
  const auto row = describe_key(*table().find("a.whole"), table().default_value(*table().find("a.whole")));
  EXPECT_EQ(row["default"], 3);
  EXPECT_EQ(row["min"], 1);
  EXPECT_EQ(row["unit"], "pixels");
  EXPECT_EQ(row["type"], "integer");
}

}  // namespace
}  // namespace tessera
