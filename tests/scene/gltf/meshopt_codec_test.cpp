// The codec of compressed buffer views: closed forms from the specification, meshoptimizer as the oracle of the
// parts that it has, a test encoder that makes every choice that version 1 of attribute streams allows, damage
// of every kind.
#include <meshoptimizer.h>

#include "replay/pack/meshopt_encoder.h"
#include "scene/gltf/meshopt_codec.h"
#include "tests/support/tests.h"

namespace tessera::scene::gltf::meshopt_codec_test {
namespace {

using ByteVector = std::vector<std::uint8_t>;

MeshoptLayout attributes(std::uint64_t count, std::uint64_t stride, MeshoptFilter filter = MeshoptFilter::kNone) {
  return {count, stride, MeshoptMode::kAttributes, filter};
}

// Decodes from and into blocks of exactly the right size, so that the address sanitizer sees a step outside.
bool decode(const ByteVector& stream, const MeshoptLayout& layout, ByteVector& out, std::string& fault) {
  const auto exact = std::make_unique<std::uint8_t[]>(stream.size());
  std::copy(stream.begin(), stream.end(), exact.get());
  out.assign(layout.bytes(), 0);
  return decode_meshopt({exact.get(), stream.size()}, layout, out, fault);
}

ByteVector decoded(const ByteVector& stream, const MeshoptLayout& layout) {
  ByteVector out;
  std::string fault;
  EXPECT_TRUE(decode(stream, layout, out, fault)) << fault;
  return out;
}

std::string fault_of(const ByteVector& stream, const MeshoptLayout& layout) {
  ByteVector out;
  std::string fault;
  EXPECT_FALSE(decode(stream, layout, out, fault));
  return fault;
}

template <class T>
ByteVector bytes_of(const std::vector<T>& values) {
  const auto* first = reinterpret_cast<const std::uint8_t*>(values.data());
  return {first, first + values.size() * sizeof(T)};
}

// ---- An encoder that takes all choices at random ----------------------------------------------------------------

template <class T>
T zigzag(T v) {
  return static_cast<T>((v << 1) ^ (v >> (8 * sizeof(T) - 1) != 0 ? ~T{0} : T{0}));
}

void put_group(ByteVector& out, int bits, const std::uint8_t* deltas) {
  if (bits == 0) return;
  if (bits == 8) {
    out.insert(out.end(), deltas, deltas + 16);
    return;
  }
  const int sentinel = (1 << bits) - 1, per_byte = 8 / bits;
  ByteVector packed(static_cast<std::size_t>(2 * bits), 0), after;
  for (int i = 0; i < 16; ++i) {
    const int value = std::min<int>(deltas[i], sentinel), slot = i % per_byte;
    packed[static_cast<std::size_t>(i / per_byte)] |=
        static_cast<std::uint8_t>(value << (bits == 1 ? slot : 8 - bits * (slot + 1)));
    if (value == sentinel) after.push_back(deltas[i]);
  }
  out.insert(out.end(), packed.begin(), packed.end());
  out.insert(out.end(), after.begin(), after.end());
}

void put_groups(ByteVector& out, const std::array<int, 4>& bits, const ByteVector& deltas, Random& random) {
  const std::size_t groups = deltas.size() / 16, header = out.size();
  out.resize(out.size() + (groups + 3) / 4, 0);
  for (std::size_t g = 0; g < groups; ++g) {
    const bool zero = std::all_of(&deltas[16 * g], &deltas[16 * g] + 16, [](int d) { return d == 0; });
    const int choice = random.integer(bits[0] == 0 && !zero ? 1 : 0, 3);
    out[header + g / 4] |= static_cast<std::uint8_t>(choice << (2 * (g % 4)));
    put_group(out, bits[static_cast<std::size_t>(choice)], &deltas[16 * g]);
  }
}

// Deltas of the 4 bytes of a channel from `before` to `now`.
std::array<std::uint8_t, 4> channel_delta(const std::uint8_t* before, const std::uint8_t* now, int mode) {
  std::array<std::uint8_t, 4> out{};
  if (mode == 0) {
    for (std::size_t k = 0; k < 4; ++k) out[k] = zigzag(static_cast<std::uint8_t>(now[k] - before[k]));
  } else if (mode == 1) {
    std::uint16_t a[2], b[2];
    std::memcpy(a, before, 4);
    std::memcpy(b, now, 4);
    for (std::size_t k = 0; k < 2; ++k) b[k] = zigzag(static_cast<std::uint16_t>(b[k] - a[k]));
    std::memcpy(out.data(), b, 4);
  } else {
    std::uint32_t a, b;
    std::memcpy(&a, before, 4);
    std::memcpy(&b, now, 4);
    b = std::rotl(a ^ b, mode >> 4);
    std::memcpy(out.data(), &b, 4);
  }
  return out;
}

// A version 1 stream with random channel modes, control modes and group modes.
ByteVector encode_version_1(const ByteVector& elements, std::size_t stride, Random& random) {
  const std::size_t count = elements.size() / stride, channels = stride / 4;
  ByteVector modes(channels), last(stride, 0), out = {0xA1};
  for (std::uint8_t& mode : modes) {
    mode = static_cast<std::uint8_t>(random.integer(0, 2));
    if (mode == 2) mode = static_cast<std::uint8_t>(mode | (random.integer(0, 15) << 4));
  }
  for (std::uint8_t& byte : last) byte = static_cast<std::uint8_t>(random.integer(0, 255));
  const ByteVector first = last;
  const std::size_t block = std::min<std::size_t>((8192 / stride) & ~std::size_t{15}, 256);
  for (std::size_t begin = 0; begin < count; begin += block) {
    const std::size_t size = std::min(block, count - begin), padded = (size + 15) / 16 * 16;
    std::vector<ByteVector> deltas(stride, ByteVector(padded, 0));
    for (std::size_t e = 0; e < size; ++e)
      for (std::size_t c = 0; c < channels; ++c) {
        const std::uint8_t* now = &elements[(begin + e) * stride + 4 * c];
        const auto delta = channel_delta(&last[4 * c], now, modes[c]);
        for (std::size_t k = 0; k < 4; ++k) deltas[4 * c + k][e] = delta[k];
        std::copy_n(now, 4, &last[4 * c]);
      }
    const std::size_t header = out.size();
    out.resize(out.size() + channels, 0);
    for (std::size_t k = 0; k < stride; ++k) {
      const bool zero = std::all_of(deltas[k].begin(), deltas[k].end(), [](int d) { return d == 0; });
      int control = random.integer(0, 3);
      if (control == 2 && !zero) control = 3;
      out[header + k / 4] |= static_cast<std::uint8_t>(control << (2 * (k % 4)));
      if (control == 0) put_groups(out, {0, 1, 2, 4}, deltas[k], random);
      if (control == 1) put_groups(out, {1, 2, 4, 8}, deltas[k], random);
      if (control == 3) out.insert(out.end(), deltas[k].begin(), deltas[k].begin() + static_cast<std::ptrdiff_t>(size));
    }
  }
  const std::size_t tail = stride + channels;
  if (tail < 24) out.resize(out.size() + 24 - tail, 0);
  out.insert(out.end(), first.begin(), first.end());
  out.insert(out.end(), modes.begin(), modes.end());
  return out;
}

// Elements of several kinds: noise, ramps, smooth floats, constants.
ByteVector elements(std::size_t count, std::size_t stride, int kind, Random& random) {
  ByteVector out(count * stride);
  for (std::size_t e = 0; e < count; ++e)
    for (std::size_t c = 0; c < stride / 4; ++c) {
      std::uint32_t word = 77;
      const auto f = std::sin(0.05f * static_cast<float>(e) + static_cast<float>(c));
      if (kind == 0) word = static_cast<std::uint32_t>(random.integer(0, 0x7FFFFFFE));
      if (kind == 1) word = static_cast<std::uint32_t>(37 * e) | (static_cast<std::uint32_t>(0xFFFF - 3 * e) << 16);
      if (kind == 2) std::memcpy(&word, &f, 4);
      std::memcpy(&out[e * stride + 4 * c], &word, 4);
    }
  return out;
}

// ---- Attributes -------------------------------------------------------------------------------------------------

TEST(MeshoptAttributes, TheDeltasOfTheSpecificationsExampleComeOut) {
  // Appendix A, mode 0: 16 deltas in 4-bit sentinel coding. The other three bytes of the element do not change.
  ByteVector stream = {0xA0, 0x02, 0x17, 0x5F, 0xF0, 0xBC, 0x77, 0xA9, 0x21, 0x00, 0x34, 0xB5, 0, 0, 0};
  stream.resize(stream.size() + 28, 0);
  stream.insert(stream.end(), {100, 5, 6, 7});
  const int deltas[] = {-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0};
  const ByteVector out = decoded(stream, attributes(16, 4));
  int value = 100;
  for (std::size_t e = 0; e < 16; ++e) {
    value += deltas[e];
    EXPECT_EQ(out[4 * e], static_cast<std::uint8_t>(value)) << e;
    for (std::size_t k = 1; k < 4; ++k) EXPECT_EQ(out[4 * e + k], 4 + k);
  }
}

TEST(MeshoptAttributes, StreamsOfMeshoptimizerDecodeToTheByte) {
  Random random(5);
  for (const std::size_t stride : {4, 8, 12, 16, 20, 36, 64, 252, 256})
    for (const std::size_t count : {1, 2, 15, 16, 17, 31, 100, 255, 256, 257, 700})
      for (int kind = 0; kind < 4; ++kind) {
        const ByteVector in = elements(count, stride, kind, random);
        EXPECT_EQ(decoded(replay::encode_elements(in, stride).bytes, attributes(count, stride)), in)
            << stride << " " << count << " " << kind;
      }
}

TEST(MeshoptAttributes, EveryChoiceOfVersion1ComesBackToTheByte) {
  Random random(6);
  for (const std::size_t stride : {4, 8, 12, 20, 64, 256})
    for (const std::size_t count : {1, 15, 16, 17, 100, 256, 257, 500})
      for (int round = 0; round < 8; ++round) {
        const ByteVector in = elements(count, stride, round % 4, random);
        EXPECT_EQ(decoded(encode_version_1(in, stride, random), attributes(count, stride)), in)
            << stride << " " << count << " " << round;
      }
}

// Version 1 streams of meshoptimizer 1.3 (npm package), which Debian's library cannot decode: pairs of bytes, bytes,
// and exclusive or turned by 6 bits.
TEST(MeshoptAttributes, StreamsOfTheNewerLibraryGiveTheValuesThatItWasGiven) {
  const ByteVector shorts = {
      0xa1, 0x77, 0xa9, 0x00, 0x58, 0x58, 0x58, 0x58, 0x58, 0x58, 0x58, 0x58, 0x58, 0x58, 0x58, 0x58, 0x58, 0x58,
      0x58, 0x58, 0x58, 0x58, 0x58, 0x05, 0x2a, 0xaa, 0xaa, 0xaa, 0xaa, 0x00, 0x00, 0x00, 0x00, 0x8b, 0xa3, 0xbb,
      0xd3, 0xeb, 0x03, 0x1b, 0x33, 0x4b, 0x63, 0x7b, 0x93, 0xab, 0xc3, 0xdb, 0xf3, 0x0b, 0x23, 0x3b, 0x02, 0x00,
      0x12, 0x34, 0x67, 0x89, 0xab, 0xcd, 0xef, 0x0f, 0x0f, 0x00, 0x10, 0x12, 0x13, 0x14, 0x06, 0x02, 0x23, 0x22,
      0x32, 0x23, 0x22, 0x32, 0x23, 0xae, 0x00, 0x00, 0x00, 0x03, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
      0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x07, 0x00, 0x01, 0x00};
  std::vector<std::int16_t> wanted;
  for (int e = 0; e < 20; ++e)
    for (const int v : {300 * e, -70 * e * e, e % 3, 7}) wanted.push_back(static_cast<std::int16_t>(v));
  EXPECT_EQ(decoded(shorts, attributes(20, 8)), bytes_of(wanted));

  const ByteVector floats = {0xa1, 0xbf, 0x00, 0x00, 0xa9, 0xaa, 0x65, 0x43, 0x0b, 0x49, 0x8d, 0x28, 0x7e, 0x3e, 0xa3,
                             0x67, 0xc8, 0xee, 0x1d, 0x6f, 0xfa, 0x2e, 0x00, 0x00, 0xaa, 0xaa, 0x66, 0x44, 0xc3, 0x92,
                             0xe3, 0x7d, 0xc3, 0xf8, 0x41, 0x81, 0x7e, 0xee, 0x1e, 0xc5, 0x0b, 0x71, 0x00, 0xff, 0xab,
                             0x53, 0x67, 0x43, 0x2f, 0x23, 0x39, 0x2d, 0x23, 0x1f, 0x19, 0x15, 0x13, 0x0f, 0x1f, 0x19,
                             0x17, 0x15, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                             0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x80, 0x3f, 0x01};
  std::vector<float> reciprocals;
  for (int e = 0; e < 20; ++e) reciprocals.push_back(1.0f / static_cast<float>(e + 1));
  EXPECT_EQ(decoded(floats, attributes(20, 4)), bytes_of(reciprocals));

  const ByteVector cubes = {0xa1, 0x9e, 0x00, 0x01, 0x09, 0x13, 0x5b, 0x3d, 0xa5, 0x8f, 0x57, 0xd9, 0x31,
                            0xdb, 0xf3, 0x55, 0x2d, 0x97, 0x2f, 0x31, 0xf9, 0x03, 0x02, 0x00, 0x00, 0x00,
                            0x01, 0x30, 0x16, 0x3e, 0x27, 0x0f, 0x00, 0x1d, 0x03, 0x05, 0x0c, 0x00, 0x00,
                            0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                            0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x80, 0x3f, 0x62};
  std::vector<std::uint32_t> words;
  for (std::uint32_t e = 0; e < 20; ++e) words.push_back(0x3F800000u + 4 * e * e * e);
  EXPECT_EQ(decoded(cubes, attributes(20, 4)), bytes_of(words));
}

TEST(MeshoptAttributes, ChannelModesThatDoNotExistAreRefused) {
  Random random(7);
  ByteVector stream = encode_version_1(elements(20, 4, 3, random), 4, random);
  for (int mode = 0; mode < 256; ++mode) {
    stream.back() = static_cast<std::uint8_t>(mode);
    ByteVector out;
    std::string fault;
    const bool exists = mode == 0 || mode == 1 || (mode & 15) == 2;
    EXPECT_EQ(decode(stream, attributes(20, 4), out, fault), exists) << mode;
  }
}

// ---- Indices ----------------------------------------------------------------------------------------------------

// Triangles of a grid, every `odd`-th with corners of its own.
std::vector<std::uint32_t> grid_triangles(std::uint32_t side, int odd, Random& random) {
  std::vector<std::uint32_t> out;
  for (std::uint32_t j = 0; j + 1 < side; ++j)
    for (std::uint32_t i = 0; i + 1 < side; ++i)
      for (const std::uint32_t k : {0u, 1u, side, side, 1u, side + 1}) out.push_back(j * side + i + k);
  for (std::size_t t = 0; t < out.size() / 3; ++t)
    if (odd > 0 && t % static_cast<std::size_t>(odd) == 0)
      out[3 * t + t % 3] = static_cast<std::uint32_t>(random.integer(0, static_cast<int>(side * side) - 1));
  return out;
}

template <class T>
ByteVector library_triangles(const ByteVector& stream, std::size_t count) {
  std::vector<T> out(count);
  EXPECT_EQ(meshopt_decodeIndexBuffer(out.data(), count, stream.data(), stream.size()), 0);
  return bytes_of(out);
}

TEST(MeshoptTriangles, ComeBackAsMeshoptimizerDecodesThem) {
  Random random(8);
  for (const std::uint32_t side : {2u, 3u, 5u, 20u, 60u})
    for (const int odd : {0, 1, 2, 7, 31}) {
      std::vector<std::uint32_t> indices = grid_triangles(side, odd, random);
      if (odd != 2) meshopt_optimizeVertexCache(indices.data(), indices.data(), indices.size(), side * side);
      const ByteVector stream = replay::encode_triangles(indices, 2).bytes;
      EXPECT_EQ(decoded(stream, {indices.size(), 4, MeshoptMode::kTriangles}),
                library_triangles<std::uint32_t>(stream, indices.size()));
      EXPECT_EQ(decoded(stream, {indices.size(), 2, MeshoptMode::kTriangles}),
                library_triangles<std::uint16_t>(stream, indices.size()));
    }
}

TEST(MeshoptIndices, ComeBackExactly) {
  Random random(9);
  for (const int count : {1, 2, 3, 100, 1000}) {
    std::vector<std::uint32_t> indices;
    for (int i = 0; i < count; ++i)
      indices.push_back(static_cast<std::uint32_t>(i % 5 == 0 ? random.integer(0, 1 << 29) : i));
    const ByteVector stream = replay::encode_indices(indices, 4).bytes;
    EXPECT_EQ(decoded(stream, {indices.size(), 4, MeshoptMode::kIndices}), bytes_of(indices));
  }
}

TEST(MeshoptTriangles, MO2AVertexThatWasNeverNamedIsOfAllOnes) {
  // One triangle of the code, then the table.
  const auto corners = [](std::uint8_t code, std::uint8_t table_entry, std::uint64_t bytes) {
    ByteVector stream = {0xE1, code};
    stream.resize(18, 0);
    stream[2] = table_entry;
    ByteVector out = decoded(stream, {3, bytes, MeshoptMode::kTriangles});
    std::vector<std::uint32_t> indices(3, 0);
    for (std::size_t k = 0; k < 3; ++k) std::memcpy(&indices[k], &out[k * bytes], bytes);
    return indices;
  };
  using Corners = std::vector<std::uint32_t>;
  for (const std::uint64_t bytes : {2u, 4u}) {
    const std::uint32_t ones = bytes == 2 ? 0xFFFFu : 0xFFFFFFFFu;
    EXPECT_EQ(corners(0xF0, 0, bytes), (Corners{0, 1, 2}));
    EXPECT_EQ(corners(0x00, 0, bytes), (Corners{ones, ones, 0}));
    EXPECT_EQ(corners(0x31, 0, bytes), (Corners{ones, ones, ones}));
    EXPECT_EQ(corners(0xF0, 0x01, bytes), (Corners{0, 1, ones}));
    EXPECT_EQ(corners(0xF0, 0x30, bytes), (Corners{0, ones, 1}));
  }
}

TEST(MeshoptIndices, AnIndexOfMoreThanFiveBytesIsRefused) {
  const MeshoptLayout layout{1, 4, MeshoptMode::kIndices};
  decoded({0xD1, 0x80, 0x80, 0x80, 0x80, 0x04, 0, 0, 0, 0}, layout);
  fault_of({0xD1, 0x80, 0x80, 0x80, 0x80, 0x80, 0x01, 0, 0, 0, 0}, layout);
}

// ---- Filters ----------------------------------------------------------------------------------------------------

// An element through a filter: behind a stream of version 1 that holds it.
template <class T>
std::vector<T> filtered(const std::vector<T>& in, std::size_t stride, MeshoptFilter filter) {
  Random random(10);
  const ByteVector out = decoded(encode_version_1(bytes_of(in), stride, random),
                                 attributes(in.size() * sizeof(T) / stride, stride, filter));
  std::vector<T> values(in.size());
  std::memcpy(values.data(), out.data(), out.size());
  return values;
}

template <class T>
bool refused(const std::vector<T>& in, std::size_t stride, MeshoptFilter filter) {
  Random random(10);
  ByteVector out;
  std::string fault;
  return !decode(encode_version_1(bytes_of(in), stride, random),
                 attributes(in.size() * sizeof(T) / stride, stride, filter), out, fault) &&
         fault.find("scale") != std::string::npos;
}

TEST(MeshoptFilters, OctahedraAreUnitVectorsOfTheFormula) {  // MO4
  using S = std::vector<std::int16_t>;
  EXPECT_EQ(filtered(S{127, 0, 127, -5}, 8, MeshoptFilter::kOctahedral), (S{32767, 0, 0, -5}));
  EXPECT_EQ(filtered(S{0, 0, 7, 9}, 8, MeshoptFilter::kOctahedral), (S{0, 0, 32767, 9}));
  EXPECT_EQ(filtered(S{-511, 511, 511, 0}, 8, MeshoptFilter::kOctahedral), (S{0, 0, -32767, 0}));
  Random random(11);
  for (const std::size_t stride : {4u, 8u})
    for (const int bits : {2, 4, 7, 8, 10, 16}) {
      if (stride == 4 && bits > 8) continue;
      const int one = (1 << (bits - 1)) - 1, max = stride == 4 ? 127 : 32767;
      for (int round = 0; round < 50; ++round) {
        const int a = random.integer(-one, one), b = random.integer(-one, one);
        std::vector<int> out(4);
        if (stride == 4) {
          const auto v = filtered(std::vector<std::int8_t>{static_cast<std::int8_t>(a), static_cast<std::int8_t>(b),
                                                           static_cast<std::int8_t>(one), 1},
                                  4, MeshoptFilter::kOctahedral);
          std::copy(v.begin(), v.end(), out.begin());
        } else {
          const auto v =
              filtered(S{static_cast<std::int16_t>(a), static_cast<std::int16_t>(b), static_cast<std::int16_t>(one), 1},
                       8, MeshoptFilter::kOctahedral);
          std::copy(v.begin(), v.end(), out.begin());
        }
        double x = double(a) / one, y = double(b) / one;
        const double z = 1 - std::abs(x) - std::abs(y), t = std::max(-z, 0.0);
        x += x >= 0 ? -t : t;
        y += y >= 0 ? -t : t;
        const double length = std::sqrt(x * x + y * y + z * z);
        EXPECT_NEAR(out[0], x / length * max, 0.51);
        EXPECT_NEAR(out[1], y / length * max, 0.51);
        EXPECT_NEAR(out[2], z / length * max, 0.51);
      }
    }
}

TEST(MeshoptFilters, QuaternionsAreUnitAndTheLargestComponentIsPutBack) {  // MO4
  using S = std::vector<std::int16_t>;
  Random random(12);
  for (const int bits : {4, 8, 12, 16})
    for (int largest = 0; largest < 4; ++largest)
      for (int round = 0; round < 30; ++round) {
        const int one = (1 << (bits - 1)) - 1;
        S in(4);
        for (std::size_t k = 0; k < 3; ++k) in[k] = static_cast<std::int16_t>(random.integer(-one, one) / 2);
        in[3] = static_cast<std::int16_t>((one & ~3) | largest);
        const S out = filtered(in, 8, MeshoptFilter::kQuaternion);
        double sum = 0;
        for (int k = 0; k < 3; ++k) {
          const double v = in[static_cast<std::size_t>(k)] / static_cast<double>(one) / std::sqrt(2.0);
          EXPECT_NEAR(out[static_cast<std::size_t>((largest + 1 + k) % 4)], v * 32767, 0.51);
          sum += v * v;
        }
        EXPECT_NEAR(out[static_cast<std::size_t>(largest)], std::sqrt(std::max(0.0, 1 - sum)) * 32767, 0.52);
      }
}

TEST(MeshoptFilters, ExponentialIsExactOverItsWholeRange) {  // MO4
  std::vector<std::uint32_t> in;
  std::vector<double> wanted;
  for (const int e : {-100, -24, -1, 0, 1, 50, 100})
    for (const int m : {0, 1, -1, 5, -77, (1 << 23) - 1, -(1 << 23)}) {
      in.push_back((static_cast<std::uint32_t>(e) << 24) | (static_cast<std::uint32_t>(m) & 0xFFFFFFu));
      wanted.push_back(std::ldexp(static_cast<double>(m), e));
    }
  const auto out = filtered(in, 4, MeshoptFilter::kExponential);
  for (std::size_t i = 0; i < in.size(); ++i)
    EXPECT_EQ(static_cast<double>(std::bit_cast<float>(out[i])), wanted[i]) << i;
}

TEST(MeshoptFilters, ColoursOfFullRangeComeBackExactlyAndAlphaLosesOneBit) {  // MO4
  // K = 8: Y = (r + 2 g + b) / 4, Co = (r - b) / 2, Cg = (2 g - r - b) / 4 are whole for these.
  for (const auto& [r, g, b] : {std::array{0, 0, 0}, {255, 255, 255}, {100, 50, 20}, {8, 240, 16}, {252, 0, 4}}) {
    const int y = (r + 2 * g + b) / 4, co = (r - b) / 2, cg = (2 * g - r - b) / 4;
    for (const int alpha : {0, 64, 127}) {
      const std::vector<std::uint8_t> in = {static_cast<std::uint8_t>(y), static_cast<std::uint8_t>(co),
                                            static_cast<std::uint8_t>(cg), static_cast<std::uint8_t>(128 | alpha)};
      const auto out = filtered(in, 4, MeshoptFilter::kColor);
      EXPECT_EQ(out[0], y + co - cg);
      EXPECT_EQ(out[1], y + cg);
      EXPECT_EQ(out[2], y - co - cg);
      EXPECT_EQ(out[3], alpha * 2 + alpha % 2);
    }
  }
  // K = 3 in 16 bits: white, half of alpha's range, and clamped values out of range.
  using U = std::vector<std::uint16_t>;
  EXPECT_EQ(filtered(U{7, 0, 0, 7}, 8, MeshoptFilter::kColor), (U{65535, 65535, 65535, 65535}));
  EXPECT_EQ(filtered(U{7, 1, 0, 4}, 8, MeshoptFilter::kColor), (U{65535, 65535, 56173, 0}));
}

TEST(MeshoptFilters, MO3ElementsWithoutAScaleAreRefused) {
  using B = std::vector<std::int8_t>;
  using S = std::vector<std::int16_t>;
  for (const int one : {0, 2, 5, 126, -1, -128})
    EXPECT_TRUE(refused(B{1, 1, static_cast<std::int8_t>(one), 0}, 4, MeshoptFilter::kOctahedral)) << one;
  for (const int one : {0, 3, 8, 0x7FF3, -4})
    EXPECT_TRUE(refused(S{1, 1, 1, static_cast<std::int16_t>(one)}, 8, MeshoptFilter::kQuaternion)) << one;
  for (const int alpha : {0, 1})
    EXPECT_TRUE(refused(B{1, 1, 1, static_cast<std::int8_t>(alpha)}, 4, MeshoptFilter::kColor)) << alpha;
  EXPECT_FALSE(refused(B{1, 1, 1, 0}, 4, MeshoptFilter::kOctahedral));
  EXPECT_FALSE(refused(S{1, 1, 1, 4}, 8, MeshoptFilter::kQuaternion));
  EXPECT_FALSE(refused(B{1, 1, 1, 2}, 4, MeshoptFilter::kColor));
}

TEST(MeshoptFilters, AgreeWithMeshoptimizerWithinOneUnit) {
  Random random(13);
  constexpr std::size_t kCount = 300;
  std::vector<float> vectors(4 * kCount);
  for (std::size_t i = 0; i < kCount; ++i) {
    const Vec3 n = glm::normalize(random.in_box(1.0f) + Vec3(0.01f));
    const float w = random.uniform(-1, 1), scale = 1.0f / std::sqrt(1 + w * w);
    for (std::size_t k = 0; k < 3; ++k) vectors[4 * i + k] = n[static_cast<int>(k)] * scale;
    vectors[4 * i + 3] = w * scale;
  }
  for (const int bits : {4, 8, 12, 16}) {
    std::vector<std::int16_t> in(4 * kCount), wanted;
    meshopt_encodeFilterOct(in.data(), kCount, 8, bits, vectors.data());
    wanted = in;
    meshopt_decodeFilterOct(wanted.data(), kCount, 8);
    auto out = filtered(in, 8, MeshoptFilter::kOctahedral);
    for (std::size_t i = 0; i < out.size(); ++i) EXPECT_NEAR(out[i], wanted[i], 1) << bits;
    meshopt_encodeFilterQuat(in.data(), kCount, 8, bits, vectors.data());
    wanted = in;
    meshopt_decodeFilterQuat(wanted.data(), kCount, 8);
    out = filtered(in, 8, MeshoptFilter::kQuaternion);
    for (std::size_t i = 0; i < out.size(); ++i) EXPECT_NEAR(out[i], wanted[i], 1) << bits;
  }
}

// ---- Damage -----------------------------------------------------------------------------------------------------

struct Sample {
  ByteVector stream;
  MeshoptLayout layout;
};

std::vector<Sample> samples() {
  Random random(14);
  std::vector<Sample> out;
  for (const std::size_t stride : {4u, 8u, 20u})
    for (int kind = 0; kind < 3; ++kind) {
      const ByteVector in = elements(37, stride, kind, random);
      out.push_back({replay::encode_elements(in, stride).bytes, attributes(37, stride)});
      out.push_back({encode_version_1(in, stride, random), attributes(37, stride)});
    }
  const std::vector<std::uint32_t> triangles = grid_triangles(5, 4, random);
  out.push_back({replay::encode_triangles(triangles, 2).bytes, {triangles.size(), 2, MeshoptMode::kTriangles}});
  out.push_back({replay::encode_indices(triangles, 4).bytes, {triangles.size(), 4, MeshoptMode::kIndices}});
  const std::vector<float> floats(2 * 37, 0.5f);
  out.push_back({replay::encode_attribute({"TEXCOORD_0", 2, 5126, false, floats}, {}).stream.bytes,
                 attributes(37, 8, MeshoptFilter::kExponential)});
  return out;
}

TEST(MeshoptStream, MO1EveryTruncatedOrLongerStreamIsRefused) {
  for (const Sample& sample : samples()) {
    decoded(sample.stream, sample.layout);
    for (std::size_t length = 0; length < sample.stream.size(); ++length) {
      // The tail goes with the end: a stream without its last bytes has other bytes in the tail's place.
      const ByteVector cut(sample.stream.begin(), sample.stream.begin() + static_cast<std::ptrdiff_t>(length));
      fault_of(cut, sample.layout);
    }
    ByteVector longer = sample.stream;
    longer.insert(longer.begin() + static_cast<std::ptrdiff_t>(sample.stream.size() / 2), 0);
    ByteVector out;
    std::string fault;
    const bool sound = decode(longer, sample.layout, out, fault);
    EXPECT_NE(sound, !fault.empty());
    longer = sample.stream;
    longer.push_back(0);
    fault_of(longer, sample.layout);
  }
}

TEST(MeshoptStream, AnyFlippedBitIsDecodedOrRefusedInWords) {
  for (const Sample& sample : samples())
    for (std::size_t bit = 0; bit < 8 * sample.stream.size(); ++bit) {
      ByteVector bad = sample.stream, out;
      bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1 << (bit % 8)));
      std::string fault;
      const bool sound = decode(bad, sample.layout, out, fault);
      EXPECT_NE(sound, !fault.empty()) << bit;
    }
}

TEST(MeshoptStream, NoneIsShorterThanTheLengthBelowWhichItIsRefusedUnread) {
  Random random(15);
  for (const Sample& sample : samples()) EXPECT_LE(min_meshopt_bytes(sample.layout), sample.stream.size());
  for (const std::size_t stride : {4u, 12u, 64u, 256u})
    for (const std::size_t count : {1u, 16u, 100u, 1000u}) {
      const ByteVector constant = elements(count, stride, 3, random);
      EXPECT_LE(min_meshopt_bytes(attributes(count, stride)), replay::encode_elements(constant, stride).bytes.size());
      // Version 1 with nothing but zero deltas is exactly as long.
      const std::size_t block = std::min<std::size_t>((8192 / stride) & ~std::size_t{15}, 256);
      ByteVector shortest = {0xA1};
      shortest.resize(1 + (count + block - 1) / block * (stride / 4), 0xAA);
      shortest.resize(shortest.size() + std::max<std::size_t>(24, stride + stride / 4), 0);
      EXPECT_EQ(min_meshopt_bytes(attributes(count, stride)), shortest.size());
      EXPECT_EQ(decoded(shortest, attributes(count, stride)), ByteVector(count * stride, 0));
    }
}

}  // namespace
}  // namespace tessera::scene::gltf::meshopt_codec_test
