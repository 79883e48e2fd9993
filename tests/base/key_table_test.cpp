#include "base/key_table.h"
#include "base/error.h"
#include "tests/support/tests.h"

namespace tessera::key_table_test {
namespace {

enum class Word { kOne, kTwo };

struct Base {
  std::int64_t inherited = 4;
};
struct Part {
  std::uint32_t small = 2;
  float single = 0.02f;
};
struct Thing : Base {
  std::int64_t whole = 3;
  double real = 0.5;
  bool flag = false;
  Word word = Word::kOne;
  std::string text;
  Part part;
};

}  // namespace
}  // namespace tessera::key_table_test

template <>
inline constexpr auto tessera::kEnumWords<tessera::key_table_test::Word> = std::to_array<std::string_view>({"one",
                                                                                                            "two"});

namespace tessera::key_table_test {
namespace {

const KeyTable<Thing>& table() {
  static const KeyTable<Thing> kTable(
      Keys<Thing>{{"a.whole", &Thing::whole, "pixels", 1, 10, "A whole number."},
                  {"a.real", &Thing::real, "", 0, 1, "A real number."},
                  {"a.flag", &Thing::flag, "A flag."},
                  {"a.word", &Thing::word, "A word."},
                  {"a.text", &Thing::text, "A text."}}
          .add(&Thing::part, Keys<Part>{{"part.small", &Part::small, "", 0, 4294967295.0, "A small number."},
                                        {"part.single", &Part::single, "", 0, 1, "A number in single precision."}})
          .add(Keys<Base>{{"base.inherited", &Base::inherited, "", 0, 10, "A number of the base."}}));
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
  EXPECT_TRUE(a.word == Word::kTwo && b.word == Word::kTwo);
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

TEST(KeyTable, ATextIsAnyTextOfAtMost4096Bytes) {
  Thing thing;
  for (const std::string& text : {std::string("a b,=\xc3\xa4"), std::string(), std::string(4096, 'x')}) {
    table().set(thing, *table().find("a.text"), text);
    EXPECT_EQ(thing.text, text);
  }
  EXPECT_THROW(table().set(thing, *table().find("a.text"), std::string(4097, 'x')), UsageError);
  EXPECT_THROW(set(thing, "a.text", 3), UsageError);
  for (const char* bad : {"\n", "\x7f", "\xff"}) EXPECT_THROW(set(thing, "a.text", bad), UsageError);
  const auto row = describe_key(*table().find("a.text"), table().default_value(*table().find("a.text")));
  EXPECT_EQ(row["type"], "text");
  EXPECT_EQ(row["default"], "");
  EXPECT_FALSE(row.contains("choices"));
}

TEST(KeyTable, MessagesNameTheAllowedValues) {
  Thing thing;
  try {
    set(thing, "a.word", "three");
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_STREQ(error.what(), "a.word: 'three' is not one of one, two");
  }
}

TEST(KeyTable, TablesOfPartsAreRowsOfTheWholeInTheOrderInWhichTheyAreAdded) {
  std::vector<std::string_view> names;
  for (const auto& key : table().keys()) names.push_back(key.name);
  EXPECT_EQ(names, (std::vector<std::string_view>{"a.whole", "a.real", "a.flag", "a.word", "a.text", "part.small",
                                                  "part.single", "base.inherited"}));
  Thing thing;
  set(thing, "part.small", "4294967295");
  set(thing, "part.single", 0.25);
  set(thing, "base.inherited", 9);
  EXPECT_EQ(thing.part.small, 4294967295u);
  EXPECT_EQ(thing.part.single, 0.25f);
  EXPECT_EQ(thing.inherited, 9);
  EXPECT_EQ(std::get<std::int64_t>(table().value(thing, *table().find("part.small"))), 4294967295);
  EXPECT_THROW(set(thing, "part.small", -1), UsageError);
  EXPECT_THROW(set(thing, "part.small", "4294967296"), UsageError);
}

TEST(KeyTable, SinglePrecisionIsPrintedAsItWasWritten) {
  EXPECT_EQ(key_value_json(table().default_value(*table().find("part.single"))).dump(), "0.02");
  for (const float value : {0.0f, 0.05f, 1e-30f, 16777216.0f, 0.1f + 0.2f})
    EXPECT_EQ(static_cast<float>(shortest_decimal(value)), value);
}

TEST(EnumWords, AreFoundByTheirValuesAndTheirValuesByThem) {
  EXPECT_EQ(word(Word::kTwo), "two");
  EXPECT_EQ(from_word<Word>("two"), Word::kTwo);
  for (const char* unknown : {"", "three", "One", "one "}) EXPECT_FALSE(from_word<Word>(unknown)) << unknown;
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
  const auto choice = describe_key(*table().find("a.word"), table().default_value(*table().find("a.word")));
  EXPECT_EQ(choice["type"], "choice");
  EXPECT_EQ(choice["default"], "one");
  EXPECT_EQ(choice["choices"], nlohmann::json({"one", "two"}));
}

// Ends lie in the same ratio to any value, within the range; without, half and twice.
TEST(KeyTable, NumbersHaveEndsInTheRatioOfTheDefaultsAndWithinTheRange) {
  KeyInfo key{"a.real", "", "", "[assumed]", 0, 100, {}, false, {}};
  EXPECT_EQ(key_ends(key, 8, 4).low, 4);
  EXPECT_EQ(key_ends(key, 8, 4).high, 16);
  EXPECT_EQ(key_ends(key, 80, 4).high, 100);
  key.ends = PlausibleRange{3, 5};
  EXPECT_DOUBLE_EQ(key_ends(key, 4, 4).low, 3);
  EXPECT_DOUBLE_EQ(key_ends(key, 8, 4).high, 10);
  EXPECT_EQ(describe_key(key, 4.0)["low"], 3);
  EXPECT_EQ(describe_key(key, 4.0)["high"], 5);
  key.ends = {}, key.source = "[spec]";
  EXPECT_FALSE(describe_key(key, 4.0).contains("low"));
}

}  // namespace
}  // namespace tessera::key_table_test
