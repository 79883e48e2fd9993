#include "base/sha256.h"
#include "tests/support/tests.h"

namespace tessera::sha256_test {
namespace {

// FIPS 180-4 examples (NIST, "Secure Hash Standard" test vectors).
TEST(Sha256, GivesTheStandardsDigests) {
  EXPECT_EQ(sha256_hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256_hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_hex("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256_hex(std::string(1000000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, DoesNotDependOnHowTheBytesAreCut) {
  std::string text;
  for (int i = 0; i < 300; ++i) text += static_cast<char>(i * 7);
  for (std::size_t step : {1u, 3u, 63u, 64u, 65u, 200u}) {
    Sha256 hash;
    for (std::size_t at = 0; at < text.size(); at += step) hash.add(std::string_view(text).substr(at, step));
    EXPECT_EQ(hash.finish(), sha256_hex(text)) << step;
  }
}

TEST(Sha256, TellsTextsOfEveryLengthApart) {
  std::set<std::string> seen;
  for (std::size_t length = 0; length < 200; ++length)
    EXPECT_TRUE(seen.insert(sha256_hex(std::string(length, '\0'))).second) << length;
}

}  // namespace
}  // namespace tessera::sha256_test
