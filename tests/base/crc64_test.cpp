#include "base/crc64.h"
#include "tests/support/tests.h"

namespace tessera::crc64_test {
namespace {

std::uint64_t crc_of(std::string_view text) {
  Crc64 crc;
  crc.add(std::as_bytes(std::span(text)));
  return crc.value();
}

// Published check value of CRC-64/XZ.
TEST(Crc64, EqualsTheCrcOfXz) {
  EXPECT_EQ(crc_of("123456789"), 0x995DC9BBDF1939FAu);
  EXPECT_EQ(crc_of(""), 0u);
}

TEST(Crc64, PartsEqualTheWhole) {
  const std::string_view text = "tiles whose inputs are those of the frame before are not rendered";
  for (std::size_t cut = 0; cut <= text.size(); ++cut) {
    Crc64 crc;
    crc.add(std::as_bytes(std::span(text.substr(0, cut))));
    crc.add(std::as_bytes(std::span(text.substr(cut))));
    EXPECT_EQ(crc.value(), crc_of(text)) << cut;
  }
}

TEST(Crc64, EveryFlippedBitIsAnotherValue) {
  std::vector<std::uint8_t> bytes(37, 0x5a);
  std::set<std::uint64_t> seen;
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    std::vector<std::uint8_t> wrong = bytes;
    wrong[bit / 8] = static_cast<std::uint8_t>(wrong[bit / 8] ^ 1u << bit % 8);
    Crc64 crc;
    crc.add_values(std::span<const std::uint8_t>(wrong));
    EXPECT_TRUE(seen.insert(crc.value()).second) << bit;
  }
}

}  // namespace
}  // namespace tessera::crc64_test
