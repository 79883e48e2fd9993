#include "base/zstd_bytes.h"
#include "tests/support/tests.h"

namespace tessera::zstd_bytes_test {
namespace {

TEST(ZstdBytes, ComeBackAsTheyWere) {
  for (const std::size_t size : {0, 1, 1000, 300000}) {
    std::string bytes;
    for (std::size_t k = 0; k < size; ++k) bytes.push_back(static_cast<char>(k * k / 7));
    const std::string packed = zstd_compress(bytes);
    EXPECT_EQ(zstd_expand(packed, size), bytes);
    EXPECT_EQ(zstd_compress(bytes), packed);
  }
}

TEST(ZstdBytes, RefuseAnotherSizeAndDamage) {
  std::string bytes(5000, 'x');
  bytes += "end";
  const std::string packed = zstd_compress(bytes);
  EXPECT_THROW(zstd_expand(packed, 5002), BadZstd);
  EXPECT_THROW(zstd_expand(packed, 5004), BadZstd);
  EXPECT_THROW(zstd_expand(packed.substr(0, packed.size() - 1), 5003), BadZstd);
  EXPECT_THROW(zstd_expand("no frame", 8), BadZstd);
}

}  // namespace
}  // namespace tessera::zstd_bytes_test
