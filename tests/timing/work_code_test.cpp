// The bytes of a frame's work.
#include <rapidcheck/gtest.h>

#include "tests/support/tests.h"
#include "timing/work_code.h"

namespace tessera::timing::work_code_test {
namespace {

// Numbers of all sizes: TileWork and GeometryWork hold nothing but numbers of 64 bits and a tile's of 32.
TileItems random_items(test::Random& random) {
  const auto number = [&] {
    return static_cast<std::uint32_t>(random.integer(0, 0x7FFFFFFE)) >> random.integer(0, 31);
  };
  TileItems items;
  const auto add_lines = [&](std::vector<std::uint32_t>& lines) {
    const std::size_t before = lines.size();
    for (int k = random.integer(0, 4); k > 0; --k) lines.push_back(number() * 2);
    return static_cast<std::uint32_t>(lines.size() - before);
  };
  for (int k = random.integer(0, 4); k > 0; --k) {
    SubPatchItem& item = items.sub_patches.emplace_back();
    item[Event::kVertices] = number(), item[Event::kBoxLanes] = number(), item[Event::kDepthBlocks] = number();
    item.domain_clocks = number(), item.domain_registers = number(), item.domain_texels = number();
    item.lines = add_lines(items.lines), item.height_lines = item.lines / 2,
    item.texel_lines = add_lines(items.texel_lines);
  }
  for (int k = random.integer(0, 4); k > 0; --k)
    items.warps.push_back({number(), number() & 1, number(), number(), number(), add_lines(items.texel_lines)});
  items.shading_lines = add_lines(items.lines);
  items.list_bytes = number(), items.written_bytes = number();
  return items;
}

FrameWork random_work(test::Random& random) {
  const auto number = [&] {
    const std::uint64_t high = static_cast<std::uint32_t>(random.integer(0, 0x7FFFFFFE)),
                        low = static_cast<std::uint32_t>(random.integer(0, 0x7FFFFFFE));
    return (high << 33 | low << 2 | 3) >> random.integer(0, 63);
  };
  FrameWork work;
  work.passes = {"behind", "", "main"};
  for (int k = random.integer(0, 3); k > 0; --k)
    work.stored_lines.push_back({static_cast<std::uint32_t>(number()), static_cast<std::uint32_t>(number())});
  for (int r = random.integer(0, 3); r > 0; --r) {
    WorkRound& round = work.rounds.emplace_back();
    round.pass = static_cast<std::uint32_t>(random.integer(0, 2));
    if (random.coin()) round.geometry_after = static_cast<std::uint32_t>(random.integer(0, 9));
    if (random.coin()) round.tiles_after = static_cast<std::uint32_t>(random.integer(0, 9));
    for (std::uint64_t& count : round.geometry.events) count = number();
    round.geometry.patches = number(), round.geometry.dram_bytes = number(), round.geometry.table_bytes = number();
    for (int t = random.integer(0, 5); t > 0; --t) {
      TileWork& tile = round.tiles.emplace_back();
      tile.tile = static_cast<std::uint32_t>(number());
      for (std::uint64_t& count : tile.events) count = number();
      for (std::uint64_t& bytes : tile.dram_bytes) bytes = number();
    }
    if (random.coin())
      for (std::size_t t = 0; t < round.tiles.size(); ++t) round.items.push_back(random_items(random));
  }
  work.tile_state_bytes = number();
  work.other_bytes = number();
  return work;
}

RC_GTEST_PROP(WorkCode, IsReadBackAsItWas, (std::uint32_t seed)) {  // WC1
  test::Random random(seed);
  const FrameWork work = random_work(random);
  const std::string bytes = encode(work);
  const FrameWork again = decode(bytes);
  RC_ASSERT(encode(again) == bytes);
  RC_ASSERT(again.rounds.size() == work.rounds.size());
  RC_ASSERT(again.dram_bytes() == work.dram_bytes());
  RC_ASSERT(again.passes == work.passes);
  RC_ASSERT(again.stored_lines == work.stored_lines);
  for (std::size_t r = 0; r < work.rounds.size(); ++r)
    for (std::size_t t = 0; t < work.rounds[r].tiles.size(); ++t) {
      RC_ASSERT(again.rounds[r].tiles[t].tile == work.rounds[r].tiles[t].tile);
      RC_ASSERT(again.rounds[r].tiles[t].events[Event::kResolveOperations] ==
                work.rounds[r].tiles[t].events[Event::kResolveOperations]);
    }
}

// Every number of the declarations is among the bytes: one more anywhere, other bytes.
TEST(WorkCode, HoldsEveryNumber) {
  FrameWork plain;
  plain.rounds.push_back({{}, {TileWork{}}, {TileItems{}}});
  TileItems& items = plain.rounds[0].items[0];
  items.sub_patches.emplace_back();
  items.warps.emplace_back();
  const std::string bytes = encode(plain);
  const auto expect_other = [&](auto& numbers, std::size_t count, const char* of) {
    for (std::size_t k = 0; k < count; ++k) {
      auto* number = reinterpret_cast<std::uint64_t*>(&numbers) + k;
      ++*number;
      EXPECT_NE(encode(plain), bytes) << of << " " << k;
      --*number;
    }
  };
  expect_other(plain.rounds[0].geometry, sizeof(GeometryWork) / 8, "geometry");
  expect_other(plain.rounds[0].tiles[0], sizeof(TileWork) / 8, "tile");
  expect_other(items.list_bytes, 5, "bytes past the L2");
  const auto expect_other_words = [&](auto& numbers, const char* of) {
    for (std::size_t k = 0; k < sizeof(numbers) / 4; ++k) {
      auto* number = reinterpret_cast<std::uint32_t*>(&numbers) + k;
      ++*number;
      EXPECT_NE(encode(plain), bytes) << of << " " << k;
      --*number;
    }
  };
  expect_other_words(items.sub_patches[0], "sub-patch");
  expect_other_words(items.warps[0], "warp");
  expect_other_words(items.shading_lines, "shading lines");
  expect_other_words(plain.rounds[0].pass, "pass");
  expect_other_words(plain.rounds[0].geometry_after, "waits of geometry");
  expect_other_words(plain.rounds[0].tiles_after, "waits of tiles");
  EXPECT_EQ(encode(plain), bytes);
}

TEST(WorkCode, RefusesARoundOfAPassThatThereIsNot) {  // WC2
  FrameWork work;
  work.passes = {"main"};
  work.rounds.emplace_back();
  EXPECT_EQ(decode(encode(work)).passes, work.passes);
  work.rounds[0].pass = 1;
  EXPECT_THROW(decode(encode(work)), BadWork);
}

TEST(WorkCode, RefusesItemsThatAskForOtherLinesThanThereAre) {  // WC2
  FrameWork work;
  work.passes = {"main"};
  work.rounds.push_back({{}, {TileWork{}}, {TileItems{}}});
  work.rounds[0].items[0].shading_lines = 1;
  EXPECT_THROW(decode(encode(work)), BadWork);
  work.rounds[0].items[0].lines.push_back(7);
  EXPECT_EQ(decode(encode(work)).rounds[0].items[0].lines, std::vector<std::uint32_t>{7});
}

RC_GTEST_PROP(WorkCode, RefusesMalformedBytes, (std::uint32_t seed)) {  // WC2
  test::Random random(seed);
  std::string bytes = encode(random_work(random));
  const auto at = static_cast<std::size_t>(random.integer(0, static_cast<int>(bytes.size()) - 1));
  if (random.coin())
    bytes.resize(at);
  else
    bytes[at] = static_cast<char>(random.integer(0, 255));
  try {
    // Work that can be read encodes to exactly these bytes.
    RC_ASSERT(encode(decode(bytes)) == bytes);
  } catch (const BadWork& bad) {
    RC_ASSERT(std::string(bad.reason) != "");
  }
}

TEST(WorkCode, RefusesLongLists) {  // WC2
  const std::string many = "\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01";
  EXPECT_THROW(decode(many), BadWork);
  EXPECT_THROW(decode(many + "x"), BadWork);
  EXPECT_THROW(decode(""), BadWork);
}

}  // namespace
}  // namespace tessera::timing::work_code_test
