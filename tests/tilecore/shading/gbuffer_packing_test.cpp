// The packed G-buffer: the distance between written and read values.
#include <cmath>
#include <limits>

#include "tests/support/tests.h"
#include "tilecore/shading/gbuffer_packing.h"

namespace tessera::tilecore::gbuffer_packing_test {
namespace {

using Values = std::array<float, 12>;

Values random_values(Random& random) {
  Values values{};
  for (std::size_t k = 0; k < 6; ++k) values[k] = random.uniform(0, 1);
  const float scale = std::exp2(random.uniform(-10, 10));
  for (std::size_t k = 6; k < 9; ++k) values[k] = scale * random.uniform(0, 1);
  const Vec3 normal = glm::normalize(random.in_box(1.0f) + Vec3(1e-6f));
  for (std::size_t k = 0; k < 3; ++k) values[9 + k] = normal[static_cast<int>(k)];
  return values;
}

// Values of a sample that differ from the packed ones by more than half a step of their code.
std::size_t faults(const Values& in, const Values& out) {
  std::size_t found = 0;
  const float slack = 1e-5f;
  for (std::size_t k = 0; k < 3; ++k) found += std::abs(std::sqrt(in[k]) - std::sqrt(out[k])) > 0.5f / 255 + slack;
  for (const std::size_t k : {3, 4, 5}) found += std::abs(in[k] - out[k]) > 0.5f / 255 + slack;
  const float most = std::max({in[6], in[7], in[8], 0x1p-15f});
  for (std::size_t k = 6; k < 9; ++k) found += std::abs(in[k] - out[k]) > most / 512 * (1 + slack);
  const Vec3 a(in[9], in[10], in[11]), b(out[9], out[10], out[11]);
  found += glm::length(a - b) > 7e-5f;
  found += std::abs(glm::length(b) - 1.0f) > 1e-6f;
  return found;
}

TEST(GbufferPacking, IsWithinHalfAStep) {
  Random random(11);
  for (int trial = 0; trial < 20000; ++trial) {
    const Values in = random_values(random);
    const PackedGbuffer words = pack_gbuffer(in, static_cast<std::uint32_t>(trial % 256));
    EXPECT_EQ(leader_of(words), static_cast<std::uint32_t>(trial % 256));
    ASSERT_EQ(faults(in, unpack_gbuffer(words)), 0u) << "trial " << trial;
  }
}

// The twin: a code whose last bits are wrong is noticed.
TEST(GbufferPacking, AWrongBitIsNoticed) {
  Random random(12);
  std::array<std::size_t, 4> noticed{};
  for (int trial = 0; trial < 2000; ++trial) {
    const Values in = random_values(random);
    constexpr std::array<std::uint32_t, 4> kLast = {0x01010101u, 0x00040004u, 0x00000101u, 0x00040201u};
    for (std::size_t word = 0; word < 4; ++word) {
      PackedGbuffer words = pack_gbuffer(in, 0);
      words[word] ^= kLast[word];
      noticed[word] += faults(in, unpack_gbuffer(words)) > 0;
    }
  }
  for (const std::size_t count : noticed) EXPECT_GT(count, 1000u);
}

TEST(GbufferPacking, KeepsAxesBlackAndWhite) {
  for (int axis = 0; axis < 6; ++axis) {
    Values in{};
    in[9 + static_cast<std::size_t>(axis / 2)] = axis % 2 == 0 ? 1.0f : -1.0f;
    const Values out = unpack_gbuffer(pack_gbuffer(in, 0));
    EXPECT_EQ(in, out) << axis;
    for (std::size_t k = 0; k < 9; ++k) in[k] = 1.0f;
    EXPECT_EQ(in, unpack_gbuffer(pack_gbuffer(in, 0))) << axis;
  }
}

TEST(GbufferPacking, EndsAtItsBounds) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
  Values in;
  in.fill(kNaN);
  for (const float value : unpack_gbuffer(pack_gbuffer(in, 0))) EXPECT_TRUE(std::isfinite(value));
  in.fill(kInfinity);
  in[9] = 1, in[10] = in[11] = 0;
  const Values out = unpack_gbuffer(pack_gbuffer(in, 0));
  for (std::size_t k = 0; k < 6; ++k) EXPECT_EQ(out[k], 1.0f);
  for (std::size_t k = 6; k < 9; ++k) EXPECT_EQ(out[k], 65408.0f);
  in.fill(-1.0f);
  const Values least = unpack_gbuffer(pack_gbuffer(in, 0));
  for (std::size_t k = 0; k < 9; ++k) EXPECT_EQ(least[k], 0.0f);
}

// Rounded values do not change when they are rounded again.
TEST(GbufferPacking, IsIdempotent) {
  Random random(13);
  for (int trial = 0; trial < 20000; ++trial) {
    const PackedGbuffer words = pack_gbuffer(random_values(random), 5);
    const PackedGbuffer again = pack_gbuffer(unpack_gbuffer(words), 5);
    ASSERT_EQ(words[0], again[0]);
    ASSERT_EQ(words[2], again[2]);
    ASSERT_EQ(words[3], again[3]);
  }
}

}  // namespace
}  // namespace tessera::tilecore::gbuffer_packing_test
