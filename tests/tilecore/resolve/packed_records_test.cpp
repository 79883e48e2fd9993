// The code of blocks' records: nothing is lost, and smooth records are short.
#include "tilecore/resolve/packed_records.h"
#include "tests/support/tests.h"
#include "tilecore/resolve/history.h"

namespace tessera::tilecore::packed_records_test {
namespace {

float in_24_bits(float v) { return std::bit_cast<float>(std::bit_cast<std::uint32_t>(v) & 0xffffff00u); }

BlockRecord plane_of(std::uint32_t surface, float value, float by_x, float by_y) {
  BlockRecord block;
  block.plane = true;
  block.surface[0] = surface;
  block.value = value, block.by_x = in_24_bits(by_x), block.by_y = in_24_bits(by_y);
  return block;
}

// A cell that looks down on a floor, row by row.
std::vector<BlockRecord> floor_of(std::size_t columns, std::size_t rows) {
  std::vector<BlockRecord> blocks;
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t c = 0; c < columns; ++c)
      blocks.push_back(
          plane_of(7, 0.2f + 0.001f * static_cast<float>(c) + 0.002f * static_cast<float>(r), 0.00025f, 0.0005f));
  return blocks;
}

BlockRecord any_block(test::Random& random) {
  const float odd[] = {std::numeric_limits<float>::infinity(),
                       -std::numeric_limits<float>::infinity(),
                       std::numeric_limits<float>::quiet_NaN(),
                       -0.0f,
                       0.0f,
                       1e-40f,
                       -3e38f};
  const auto number = [&] {
    return random.integer(0, 3) == 0 ? odd[random.integer(0, 6)]
                                     : std::bit_cast<float>(static_cast<std::uint32_t>(random.integer(0, 0x7fffffff)));
  };
  if (random.integer(0, 3) == 0) {
    BlockRecord nothing;
    nothing.plane = true;
    return nothing;
  }
  const auto mask = static_cast<BlockMask>(random.integer(0, 2) == 0 ? random.integer(0, 0xffff)
                                                                     : kPairOrder[random.integer(0, 1) ? 1 : 0]);
  if (random.integer(0, 1) == 0) {
    BlockRecord block = plane_of(static_cast<std::uint32_t>(random.integer(1, 3)), number(), number(), number());
    block.reconstructed = random.integer(0, 1) == 0 ? BlockMask{0} : mask;
    return block;
  }
  BlockRecord block;
  block.exists = random.integer(0, 1) == 0 ? kFullBlock : static_cast<BlockMask>(random.integer(1, 0xffff));
  block.reconstructed = mask;
  for (std::size_t p = 0; p < 16; ++p)
    if ((block.exists >> p & 1) != 0)
      block.surface[p] = static_cast<std::uint32_t>(random.integer(0, 2)), block.depth[p] = number();
  return block;
}

void expect_same(const BlockRecord& a, const BlockRecord& b) {
  ASSERT_EQ(a.plane, b.plane);
  ASSERT_EQ(a.nothing(), b.nothing());
  if (a.nothing()) return;
  ASSERT_EQ(a.reconstructed, b.reconstructed);
  ASSERT_EQ(a.surface[0], b.surface[0]);
  if (a.plane) {
    for (const auto& [x, y] : {std::pair{a.value, b.value}, {a.by_x, b.by_x}, {a.by_y, b.by_y}})
      ASSERT_EQ(std::bit_cast<std::uint32_t>(x), std::bit_cast<std::uint32_t>(y));
    return;
  }
  for (std::size_t p = 0; p < 16; ++p) {
    if ((a.exists >> p & 1) == 0) continue;
    ASSERT_EQ(a.surface[p], b.surface[p]);
    ASSERT_EQ(std::bit_cast<std::uint32_t>(a.depth[p]), std::bit_cast<std::uint32_t>(b.depth[p]));
  }
}

TEST(PackedRecords, ComeBackBitForBitAndFitTheirPlace) {  // PR1, PR2
  test::Random random(17);
  std::array<std::uint8_t, kCellBytes> bytes;
  for (int n = 0; n < 3000; ++n) {
    const auto columns = static_cast<std::size_t>(random.integer(1, 4)),
               rows = static_cast<std::size_t>(random.integer(1, 4));
    std::vector<BlockRecord> blocks;
    while (blocks.size() < columns * rows) blocks.push_back(any_block(random));
    const std::size_t size = pack_records(blocks, columns, bytes);
    ASSERT_LE(size, kCellBytes);
    std::vector<BlockRecord> back(blocks.size());
    for (std::size_t b = 0; b < blocks.size(); ++b) back[b].exists = blocks[b].exists;
    unpack_records(std::span(bytes).first(size), columns, back);
    for (std::size_t b = 0; b < blocks.size(); ++b) expect_same(blocks[b], back[b]);
  }
}

// Closed form: 8 bits of size; 2 bits of kind and 2 of mask for each block; 32 bits of surface for the first block,
// and for every plane 16 bits of widths and their numbers.
TEST(PackedRecords, APlaneGoesOnForAlmostNothingAndNothingTakesNothing) {
  std::array<std::uint8_t, kCellBytes> bytes;
  std::vector<BlockRecord> empty(16, plane_of(0, 0, 0, 0));
  EXPECT_EQ(pack_records(empty, 4, bytes), 0u);
  // A plane's numbers are exact for steps of powers of two.
  std::vector<BlockRecord> exact;
  for (int b = 0; b < 16; ++b)
    exact.push_back(plane_of(7, 1.5f + 0.0625f * static_cast<float>(b % 4) + 0.125f * static_cast<float>(b / 4),
                             0.015625f, 0.03125f));
  const std::size_t first = 8 + 4 + 32 + 16 + 32 + 24 + 24, others = 15 * (4 + 16);
  EXPECT_LE(pack_records(exact, 4, bytes), (first + others + 7) / 8);
  const std::size_t smooth = pack_records(floor_of(4, 4), 4, bytes);
  EXPECT_LT(smooth, 16 * History::kPlaneBytes / 2);
  // The failing twin: planes that do not go on.
  std::vector<BlockRecord> apart = floor_of(4, 4);
  for (std::size_t b = 0; b < 16; ++b)
    apart[b].surface[0] = static_cast<std::uint32_t>(b + 1), apart[b].value *= b % 2 == 0 ? 1.0f : 9.0f;
  EXPECT_GT(pack_records(apart, 4, bytes), 2 * smooth);
}

}  // namespace
}  // namespace tessera::tilecore::packed_records_test
