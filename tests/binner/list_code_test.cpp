// The sub-patch table and the lists: their bytes against binner/README.md, decoding, and the state after a refusal.
#include <rapidcheck/gtest.h>
#include <regex>

#include "binner/list_code.h"
#include "binner/record_cache.h"
#include "gpu/configuration.h"
#include "tests/support/tests.h"

namespace tessera::binner::list_code_test {
namespace {

using Placements = std::vector<ListLevels::Placement>;

// ---- The description ----------------------------------------------------------------------------------------------

// Rows of the table of binner/README.md whose first column has this head.
std::vector<std::vector<std::string>> table_of(const std::string& head) {
  std::istringstream text(test::read_text(std::filesystem::path(TESSERA_SOURCE_DIR) / "binner" / "README.md"));
  std::vector<std::vector<std::string>> rows;
  bool inside = false;
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with("| " + head + " |")) {
      inside = true;
    } else if (!line.starts_with("|")) {
      inside = false;
    } else if (inside && !line.starts_with("|---")) {
      std::vector<std::string> cells;
      std::istringstream row(line.substr(1));
      for (std::string cell; std::getline(row, cell, '|');) {
        const std::size_t first = cell.find_first_not_of(' ');
        cells.push_back(first == std::string::npos ? "" : cell.substr(first, cell.find_last_not_of(' ') + 1 - first));
      }
      rows.push_back(cells);
    }
  }
  return rows;
}

// "4" or "4..7".
std::pair<std::size_t, std::size_t> span_of(const std::string& cell) {
  const std::size_t dots = cell.find("..");
  const std::size_t first = std::stoul(cell);
  return {first, dots == std::string::npos ? first : std::stoul(cell.substr(dots + 2))};
}

// The bytes of a record as the document has them: each row's value, lowest byte first.
std::vector<std::uint8_t> record_by_hand(const std::map<std::string, std::uint64_t>& fields) {
  std::vector<std::uint8_t> bytes;
  for (const auto& row : table_of("bytes")) {
    const auto [first, last] = span_of(row[0]);
    EXPECT_EQ(first, bytes.size()) << row[0];
    for (std::size_t b = first; b <= last; ++b)
      bytes.push_back(static_cast<std::uint8_t>(fields.at(row[1]) >> (8 * (b - first))));
  }
  return bytes;
}

ListEntry any_sub_patch() {
  ListEntry e;
  e.near_depth = static_cast<float>(*rc::gen::inRange(0, 1 << 30)) * 1e-4f;
  e.flags = *rc::gen::inRange<std::uint8_t>(0, 32);
  const auto bits = [](int count) { return *rc::gen::inRange<std::uint8_t>(0, static_cast<std::uint8_t>(1 << count)); };
  e.blocks = {bits(4), bits(4), bits(3), bits(3), false};
  return e;
}

RC_GTEST_PROP(SubPatchTable, ARecordHasTheBytesOfTheDocument, ()) {
  ListEntry e = any_sub_patch();
  e.base_patch = *rc::gen::arbitrary<std::uint32_t>();
  const auto cell = [] { return *rc::gen::inRange<std::uint8_t>(0, 128); };
  e.range = {cell(), cell(), cell(), cell()};
  e.segment = *rc::gen::inRange<std::uint8_t>(0, 17);
  e.blocks.wide = *rc::gen::arbitrary<bool>();
  e.lists = static_cast<std::uint16_t>(*rc::gen::inRange(1, 1 << 12));
  const std::vector<std::uint8_t> expected = record_by_hand(
      {{"base patch", e.base_patch},
       {"range of its grid", e.range.i0 + e.range.j0 * 0x80u + e.range.i1 * 0x4000u + e.range.j1 * 0x200000u +
                                 e.blocks.more_rows * 0x10000000u},
       {"nearest depth", std::bit_cast<std::uint32_t>(e.near_depth)},
       {"flags", e.flags + e.blocks.column * 0x20u + e.blocks.row * 0x200u + e.blocks.more_columns * 0x2000u},
       {"motion segment and lists",
        e.segment + (e.blocks.wide ? 0x20u : 0u) + std::min<unsigned>(e.lists, 1023) * 0x40u}});
  const PackedRecord record = pack_record(e);
  RC_ASSERT(std::vector<std::uint8_t>(record.used().begin(), record.used().end()) == expected);
}

RC_GTEST_PROP(SubPatchTable, TheRecordOfAWholePatchHasTheBitsOfTheDocument, ()) {
  ListEntry e = any_sub_patch();
  e.whole = true;
  e.base_patch = *rc::gen::inRange<std::uint32_t>(0, 1u << 24);
  e.lists = *rc::gen::inRange<std::uint8_t>(1, 16);
  const std::map<std::string, std::uint64_t> fields = {
      {"base patch", e.base_patch},
      {"nearest depth", std::bit_cast<std::uint32_t>(e.near_depth) >> 15},
      {"lists", e.lists},
      {"flags", e.flags},
      {"first column", e.blocks.column},
      {"first row", e.blocks.row},
      {"more columns", e.blocks.more_columns},
      {"more rows", e.blocks.more_rows},
      {"whole", 1}};
  std::uint64_t expected = 0;
  std::size_t next = 0;
  for (const auto& row : table_of("bits")) {
    const auto [first, last] = span_of(row[0]);
    RC_ASSERT(first == next && fields.at(row[1]) >> (last - first + 1) == 0);
    expected |= fields.at(row[1]) << first;
    next = last + 1;
  }
  RC_ASSERT(next == 64u);
  const PackedRecord record = pack_record(e);
  RC_ASSERT(record.size == sizeof expected);
  for (std::size_t b = 0; b < record.size; ++b) RC_ASSERT(record.bytes[b] == (expected >> 8 * b & 255));
}

// The bytes of an entry as the document has them: rows "byte", "bits", "holds".
struct EntryFormat {
  std::map<std::string, std::map<std::string, std::pair<std::size_t, std::size_t>>>
      bits;  // by byte and by name of the field
  EntryFormat() {
    for (const auto& row : table_of("byte"))
      if (row[0] == "first" || row[0] == "further") bits[row[0]][row[2]] = span_of(row[1]);
  }
  std::uint8_t put(const char* byte, std::map<std::string, std::uint64_t> values) const {
    std::uint64_t out = 0;
    for (const auto& [what, span] : bits.at(byte)) out |= values.at(what) << span.first;
    EXPECT_LT(out, 256u);
    return static_cast<std::uint8_t>(out);
  }
  std::size_t width(const char* byte) const {
    const auto [first, last] = bits.at(byte).at("distance");
    return last - first + 1;
  }
  std::vector<std::uint8_t> encode(std::uint64_t distance, const TimeInterval& times) const {
    const bool follow = !(times == TimeInterval{0, 255});
    const auto low = [&](std::size_t width) {
      const std::uint64_t bits_of_it = distance % (std::uint64_t{1} << width);
      distance >>= width;
      return bits_of_it;
    };
    const std::uint64_t first = low(width("first"));
    std::vector<std::uint8_t> out = {
        put("first", {{"times follow", follow ? 1 : 0}, {"distance", first}, {"more follows", distance > 0 ? 1 : 0}})};
    while (distance > 0) {
      const std::uint64_t next = low(width("further"));
      out.push_back(put("further", {{"distance", next}, {"more follows", distance > 0 ? 1 : 0}}));
    }
    if (follow) out.insert(out.end(), {static_cast<std::uint8_t>(times.first), static_cast<std::uint8_t>(times.last)});
    return out;
  }
};

TEST(ListCode, AnEntryHasTheBytesOfTheDocumentAndOneByteOrTwoWhereListsAreDense) {
  const EntryFormat format;
  Random random(5);
  for (int trial = 0; trial < 4000; ++trial) {
    const auto before = static_cast<std::uint32_t>(random.integer(0, 1 << 20));
    const auto distance = static_cast<std::uint32_t>(random.integer(1, 1 << random.integer(1, 26)));
    const int first = random.integer(0, 255);
    const TimeInterval times = random.coin() ? TimeInterval{} : TimeInterval{first, random.integer(first, 255)};
    std::vector<std::uint8_t> bytes;
    encode_entry({before + distance - 1, times}, before, bytes);
    ASSERT_EQ(bytes, format.encode(distance, times));
    const std::size_t taken = times == TimeInterval{} ? 0 : 2;
    if (distance < 64) {
      EXPECT_EQ(bytes.size(), 1 + taken);
    } else if (distance < 8192) {
      EXPECT_EQ(bytes.size(), 2 + taken);
    }
  }
}

// ---- Back again ---------------------------------------------------------------------------------------------------

std::vector<CodedEntry> decode(std::span<const std::uint8_t> bytes) {
  std::vector<CodedEntry> out;
  std::uint32_t before = 0;
  for (std::size_t at = 0; at < bytes.size(); before = out.back().record + 1)
    out.push_back(decode_entry(bytes, before, at));
  return out;
}

RC_GTEST_PROP(ListCode, LI2EntriesOfAListComeBackAndNoneBeginsWithItsEnd, ()) {
  const auto steps = *rc::gen::container<std::vector<std::uint32_t>>(rc::gen::weightedOneOf<std::uint32_t>(
      {{8, rc::gen::inRange(0u, 70u)}, {2, rc::gen::inRange(0u, 20000u)}, {1, rc::gen::inRange(0u, 20000000u)}}));
  std::vector<CodedEntry> entries;
  std::vector<std::uint8_t> bytes;
  std::uint32_t before = 0;
  for (const std::uint32_t step : steps) {
    const int first = *rc::gen::inRange(0, 256);
    entries.push_back({before + step, *rc::gen::arbitrary<bool>()
                                          ? TimeInterval{}
                                          : TimeInterval{first, *rc::gen::inRange(first, 256)}});
    const std::size_t at = bytes.size();
    encode_entry(entries.back(), before, bytes);
    RC_ASSERT(bytes[at] != 0);
    before = entries.back().record + 1;
  }
  RC_ASSERT(decode(bytes) == entries);
}

TEST(ListCodeTwin, ABitThatIsTurnedChangesTheListAndRecordsThatFallAreBrokenInvariants) {
  std::vector<std::uint8_t> bytes;
  const std::vector<CodedEntry> entries = {{70, {}}, {71, {3, 9}}, {9000, {0, 254}}};
  std::uint32_t before = 0;
  for (const CodedEntry& entry : entries) encode_entry(entry, std::exchange(before, entry.record + 1), bytes);
  ASSERT_EQ(decode(bytes), entries);
  bytes[0] ^= 2;
  EXPECT_NE(decode(bytes), entries);
  EXPECT_DEATH(encode_entry({4, {}}, 5, bytes), "records of a list rise");
}

// ---- Lists in memory ----------------------------------------------------------------------------------------------

// Lists of random bytes over a buffer that has nothing else.
struct Lists {
  memory::Ledger ledger;
  WriteCombiner combiner{8, 32, ledger};
  std::vector<std::uint8_t> memory;
  TileLists lists;
  std::map<QueueIndex, std::vector<std::uint8_t>> expected;

  explicit Lists(const TileLists::Layout& layout) : lists(layout, memory, combiner) {
    memory.resize(layout.end());
    lists.reset();
  }
  void append(QueueIndex list, const std::vector<std::uint8_t>& bytes) {
    const std::uint64_t needed = lists.chunks_needed(list, bytes.size());
    std::uint64_t taken = 0;
    lists.append(
        list, bytes, 7,
        [&] {
          ++taken;
          const std::uint64_t address = memory.size();
          memory.resize(address + lists.layout().chunk_bytes);
          return address;
        },
        [](std::uint64_t, std::uint64_t) {});
    EXPECT_EQ(taken, needed);
    auto& list_bytes = expected[list];
    list_bytes.insert(list_bytes.end(), bytes.begin(), bytes.end());
  }
  // Reads a list from its bytes alone, as the document has them; the first `size` bytes of it, as 0 may be a byte.
  std::vector<std::uint8_t> follow(QueueIndex list, std::size_t size) const {
    const TileLists::Layout& layout = lists.layout();
    std::vector<std::uint8_t> out;
    if ((memory[list / 8] >> list % 8 & 1) == 0) return out;
    std::size_t at =
        round_up((layout.lists + 7) / 8, 32) + round_up(8 * layout.lists, 32) + list * layout.first_chunk_bytes;
    std::size_t link_at = at + layout.first_chunk_bytes - 4;
    for (;; ++at) {
      if (at == link_at) {
        const std::uint32_t link = memory[at] + memory[at + 1] * 256u + memory[at + 2] * 65536u;
        if (link == 0) return out;
        at = link * 16;
        link_at = at + layout.chunk_bytes - 4;
      }
      if (out.size() == size) {
        EXPECT_EQ(memory[at], 0);
        return out;
      }
      out.push_back(memory[at]);
    }
  }
};

TEST(TileLists, LI1BytesComeBackThroughTheLinksHoweverTheyWereDivided) {
  Random random(3);
  for (const auto& [first, chunk] : {std::pair<std::uint64_t, std::uint64_t>{16, 32}, {32, 64}, {64, 32}, {128, 256}}) {
    Lists test({21, first, chunk, 32});
    for (int n = 0; n < 700; ++n) {
      std::vector<std::uint8_t> bytes(static_cast<std::size_t>(random.integer(1, random.coin() ? 4 : 90)));
      for (auto& b : bytes) b = static_cast<std::uint8_t>(random.integer(0, 255));
      test.append(static_cast<QueueIndex>(random.integer(0, 19)), bytes);
    }
    for (QueueIndex list = 0; list < 21; ++list) {
      const auto read = test.lists.read(list, [](std::uint64_t, std::uint64_t) {});
      EXPECT_EQ(read, test.expected[list]);
      EXPECT_EQ(test.follow(list, read.size()), read);
      EXPECT_EQ(test.lists.note(list), list < 20 ? 7u : 0u);
    }
  }
}

TEST(TileListsTwin, ALinkThatLeadsElsewhereIsCaught) {
  Lists test({2, 16, 32, 32});
  test.append(0, std::vector<std::uint8_t>(50, 1));
  test.append(1, std::vector<std::uint8_t>(50, 2));
  ASSERT_EQ(test.follow(0, 50), test.expected[0]);
  const std::size_t link = 64 + 12;  // of the first chunk of list 0
  ASSERT_NE(test.memory[link], 0);
  std::swap(test.memory[link], test.memory[link + 16]);
  EXPECT_NE(test.follow(0, 50), test.expected[0]);
}

TEST(TileLists, AListThatEndsWithItsChunkNeedsNoOther) {
  Lists test({1, 32, 64, 32});
  test.append(0, std::vector<std::uint8_t>(28, 5));
  EXPECT_EQ(test.memory.size(), test.lists.layout().end());
  EXPECT_EQ(test.lists.content_bytes(), 1u + 8 + 28 + 4) << "the link 0 is the end";
  EXPECT_EQ(test.follow(0, 28), test.expected[0]);
  test.append(0, {6});
  EXPECT_EQ(test.lists.content_bytes(), 1u + 8 + 28 + 4 + 1 + 1);
  EXPECT_EQ(test.follow(0, 29), test.expected[0]);
}

// ---- Table and lists ----------------------------------------------------------------------------------------------

// Everything that a buffer holds.
std::vector<std::uint8_t> contents(const ParameterBuffer& buffer) {
  std::vector<std::uint8_t> out(buffer.lists_memory().begin(), buffer.lists_memory().end());
  out.insert(out.end(), buffer.table().begin(), buffer.table().end());
  return out;
}

gpu::GpuConfiguration tight(FullPolicy policy) {
  gpu::GpuConfiguration gpu;
  gpu.parameter_buffer.bytes = 64 + 64 + 256 + 320;  // 8 lists
  gpu.parameter_buffer.full_policy = policy;
  return gpu;
}

std::uint16_t lists_of(const ParameterBuffer& buffer, std::uint32_t record) {
  return unpack_record(buffer.table().subspan(record * kSlotBytes)).lists;
}

// Lists that hold each record.
std::map<std::uint32_t, int> uses(const ParameterBuffer& buffer, QueueIndex lists) {
  std::map<std::uint32_t, int> out;
  for (QueueIndex list = 0; list < lists; ++list) {
    std::vector<ListEntry> entries;
    memory::Ledger ledger;
    std::uint64_t ignored = 0;
    buffer.read_queue(list, entries, ledger, ignored);
    for (const ListEntry& entry : entries) ++out[entry.record];
  }
  return out;
}

TEST(ParameterBuffer, PB4ARefusalLeavesNoByteAndPB5RecordsCountTheirLists) {
  Random random(9);
  int refused = 0, begun = 0, tables_of_a_length = 0;
  for (int trial = 0; trial < 60; ++trial) {
    ParameterBuffer buffer(tight(FullPolicy::kPartialRender).binner_spec(), 8);
    for (bool full = false; !full;) {
      Placements placements;
      for (QueueIndex list = 0; list < 8; ++list)
        if (random.coin()) placements.push_back({list, {random.integer(0, 3), 255}});
      const std::uint64_t in_use = buffer.bytes_in_use(), entries = buffer.counters().entries,
                          content = buffer.counters().queue_bytes_written;
      const std::vector<std::uint8_t> before = contents(buffer);
      ListEntry sub_patch;
      sub_patch.base_patch = static_cast<std::uint32_t>(entries);
      sub_patch.whole = trial % 3 == 0 || (trial % 3 == 1 && random.coin());
      std::uint32_t next = 0;
      full = !buffer.append(sub_patch, placements, next);
      EXPECT_EQ(buffer.counters().entries, entries + next);
      if (!full) continue;
      ++refused;
      begun += next > 0 ? 1 : 0;
      const std::vector<std::uint8_t> after = contents(buffer);
      const std::uint64_t content_after = buffer.counters().queue_bytes_written;
      if (next == 0) {
        EXPECT_EQ(after, before);
        EXPECT_EQ(content_after, content);
        EXPECT_EQ(buffer.bytes_in_use(), in_use);
      }
      // Once more: now it is certain that none takes it.
      std::uint32_t again = next;
      EXPECT_FALSE(buffer.append(sub_patch, placements, again));
      EXPECT_EQ(again, next);
      EXPECT_EQ(contents(buffer), after);
      EXPECT_EQ(buffer.counters().queue_bytes_written, content_after);
    }
    for (const auto& [record, count] : uses(buffer, 8)) EXPECT_EQ(lists_of(buffer, record), count) << record;
    EXPECT_EQ(buffer.counters().table_records, uses(buffer, 8).size());
    // A whole patch's record has bit 63 set. Nothing is between records of a length; a long one may leave out 8 bytes.
    std::uint64_t records = 0;
    for (const auto& [record, count] : uses(buffer, 8)) records += (buffer.table()[record * 8 + 7] & 128) != 0 ? 8 : 16;
    const std::uint64_t written = buffer.table_bytes_written(), taken = 8 * buffer.end_of_records();
    EXPECT_EQ(written, records);
    EXPECT_LE(written, taken);
    if (trial % 3 != 1) {
      EXPECT_EQ(written, taken) << "of one length";
    }
    tables_of_a_length += written == taken ? 1 : 0;
  }
  EXPECT_EQ(refused, 60);
  EXPECT_GT(begun, 5) << "some are refused in the middle of a sub-patch";
  EXPECT_LT(begun, 60);
  EXPECT_GE(tables_of_a_length, 20);
  EXPECT_LT(tables_of_a_length, 60);
}

TEST(ParameterBufferTwin, PB5ARecordThatCountsTheListsItDidNotGetIsCaught) {
  ParameterBuffer buffer(tight(FullPolicy::kSpill).binner_spec(), 8);
  std::uint32_t next = 0;
  ASSERT_TRUE(buffer.append({}, Placements{{0, {}}, {3, {}}}, next));
  EXPECT_EQ(lists_of(buffer, 0), 2);
  std::uint32_t behind = 1;  // as if the first list had taken it in an earlier round
  ASSERT_TRUE(buffer.append({}, Placements{{0, {}}, {3, {}}}, behind));
  EXPECT_EQ(lists_of(buffer, 2), 1);
  EXPECT_EQ(uses(buffer, 8), (std::map<std::uint32_t, int>{{0, 2}, {2, 1}}));
}

TEST(ParameterBuffer, PB5AnyNumberOfListsBeyond1023IsThat) {
  gpu::GpuConfiguration gpu;
  gpu.parameter_buffer.bytes = 64 << 20;
  ParameterBuffer buffer(gpu.binner_spec(), 70000);
  Placements all;
  for (QueueIndex list = 0; list < 70000; ++list) all.push_back({list, {}});
  std::uint32_t next = 0;
  ASSERT_TRUE(buffer.append({}, all, next));
  EXPECT_EQ(lists_of(buffer, 0), 1023);
  EXPECT_EQ(buffer.counters().entries, 70000u);
}

// ---- The cache of records -----------------------------------------------------------------------------------------

TEST(RecordCache, FetchesABurstOnceAndAgainWhenItHadToLeave) {
  gpu::GpuConfiguration gpu;  // bursts of 64 bytes: 8 numbers
  RecordCache cache(gpu.binner_spec(), 128);
  std::uint64_t bytes = 0;
  for (const std::uint32_t record : {0u, 7u, 8u, 1u, 15u}) bytes += cache.read(record, nullptr);
  EXPECT_EQ(bytes, 2 * 64u);
  bytes += cache.read(16, nullptr);  // 0 to 7 leave
  EXPECT_EQ(bytes, 3 * 64u);
  EXPECT_EQ(cache.read(2, nullptr), 64u);
  EXPECT_EQ(cache.ledger().traffic(memory::Unit::kTilecore, memory::Purpose::kTileQueue).read_bytes, 4 * 64u);
  RecordCache none(gpu.binner_spec(), 0);
  EXPECT_EQ(none.read(5, nullptr) + none.read(5, nullptr), 2 * 64u);
}

}  // namespace
}  // namespace tessera::binner::list_code_test
