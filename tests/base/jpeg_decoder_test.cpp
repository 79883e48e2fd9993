#include <turbojpeg.h>
#include <iostream>

#include "base/error.h"
#include "base/image_codec.h"
#include "base/jpeg_decoder.h"
#include "base/sha256.h"
#include "captures/sources/jpeg_writer.h"
#include "tests/support/heap_meter.h"
#include "tests/support/tests.h"

namespace tessera::jpeg_decoder_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

// ---- Images and their files -----------------------------------------------------------------------------------

// Channels rise linearly along x and y, by less than two steps a pixel: halved chroma planes give such values back
// between their samples.
std::uint8_t ramp(int x, int y, int c) {
  return static_cast<std::uint8_t>(c == 0 ? 20 + x + y : c == 1 ? 230 - 2 * x : c == 2 ? 60 + 2 * y : 255 - x);
}

Image8 ramps(int width, int height, int channels) {
  Image8 image(width, height, channels);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < channels; ++c) image.at(x, y)[c] = ramp(x, y, c);
  return image;
}

// By libjpeg-turbo's own encoder; four channels become YCCK.
Bytes encode(const Image8& image, int subsampling, int quality = 100, int flags = 0) {
  static constexpr int kFormats[] = {0, TJPF_GRAY, 0, TJPF_RGB, TJPF_CMYK};
  const std::unique_ptr<void, int (*)(void*)> encoder(tjInitCompress(), tjDestroy);
  unsigned char* data = nullptr;
  unsigned long size = 0;
  if (tjCompress2(encoder.get(), image.values.data(), image.width, 0, image.height, kFormats[image.channels], &data,
                  &size, subsampling, quality, flags | TJFLAG_ACCURATEDCT) != 0)
    throw SystemError(tjGetErrorStr2(encoder.get()));
  Bytes bytes(data, data + size);
  tjFree(data);
  return bytes;
}

// Where the first segment of a kind begins: at its 0xFF. Segments are walked up to the scan.
std::size_t segment(const Bytes& bytes, std::uint8_t marker) {
  for (std::size_t at = 2; at + 4 <= bytes.size(); at += 2u + (std::size_t{bytes[at + 2]} << 8) + bytes[at + 3])
    if (bytes[at + 1] == marker) return at;
  ADD_FAILURE() << "no segment " << int{marker};
  return 0;
}

std::size_t segment_end(const Bytes& bytes, std::size_t at) {
  return at + 2u + (std::size_t{bytes[at + 2]} << 8) + bytes[at + 3];
}

constexpr std::uint8_t kApp14 = 0xEE, kHuffman = 0xC4, kQuantisation = 0xDB, kFrame = 0xC0, kScan = 0xDA;

void remove_segment(Bytes& bytes, std::size_t at) {
  bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(at),
              bytes.begin() + static_cast<std::ptrdiff_t>(segment_end(bytes, at)));
}

struct Answer {
  bool accepted = false;
  Image8 image;
  std::string fault;
};

// From a block of exactly the file's size, so that the sanitizers see a byte read behind it.
Answer decode(const Bytes& file) {
  const Bytes exact(file.begin(), file.end());
  Answer answer;
  JpegHeader header;
  answer.accepted =
      read_jpeg_header(exact, header, answer.fault) && decode_jpeg(exact, header, answer.image, answer.fault);
  EXPECT_EQ(answer.accepted, answer.fault.empty());
  return answer;
}

int greatest_difference(const Image8& a, const Image8& b) {
  if (a.width != b.width || a.height != b.height || a.channels != b.channels) return 256;
  int most = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i)
    most = std::max(most, std::abs(int{a.values[i]} - int{b.values[i]}));
  return most;
}

// ---- Sound files ------------------------------------------------------------------------------------------------

struct Kind {
  const char* name;
  int channels, subsampling, flags;
  int tolerance;  // at quality 100: steps of one and the rounding of two colour transformations; the slope of a ramp at
                  // borders of halved chroma
};
constexpr Kind kKinds[] = {{"grey", 1, TJSAMP_GRAY, 0, 2},
                           {"4:4:4", 3, TJSAMP_444, 0, 3},
                           {"4:2:2", 3, TJSAMP_422, 0, 5},
                           {"4:2:0", 3, TJSAMP_420, 0, 5},
                           {"grey, progressive", 1, TJSAMP_GRAY, TJFLAG_PROGRESSIVE, 2},
                           {"4:2:0, progressive", 3, TJSAMP_420, TJFLAG_PROGRESSIVE, 5}};

TEST(JpegDecoder, AnImageComesBackWithinQuantisationWhateverItsChannelsAndSampling) {
  for (const Kind& kind : kKinds)
    for (const auto& [width, height] : {std::pair{1, 1}, {8, 8}, {17, 9}, {64, 33}}) {
      const Image8 image = ramps(width, height, kind.channels);
      const Answer answer = decode(encode(image, kind.subsampling, 100, kind.flags));
      ASSERT_TRUE(answer.accepted) << kind.name << ": " << answer.fault;
      EXPECT_LE(greatest_difference(answer.image, image), kind.tolerance) << kind.name << " " << width << "x" << height;
    }
}

TEST(JpegDecoder, AnotherImageIsNotWithinQuantisation) {  // the twin of the law above
  for (const Kind& kind : kKinds) {
    const Answer answer = decode(encode(ramps(64, 33, kind.channels), kind.subsampling, 100, kind.flags));
    Image8 mirrored = ramps(64, 33, kind.channels), swapped = mirrored;
    for (int y = 0; y < 33; ++y)
      for (int x = 0; x < 64; ++x)
        for (int c = 0; c < kind.channels; ++c)
          mirrored.at(x, y)[c] = ramp(63 - x, y, c), swapped.at(x, y)[c] = ramp(x, y, kind.channels - 1 - c);
    EXPECT_GT(greatest_difference(answer.image, mirrored), kind.tolerance) << kind.name;
    if (kind.channels == 3) {
      EXPECT_GT(greatest_difference(answer.image, swapped), kind.tolerance) << kind.name;
    }
  }
}

TEST(JpegDecoder, ReadsFilesOfAnotherEncoder) {  // stb's
  for (const int channels : {1, 3}) {
    const Image8 image = ramps(40, 24, channels);
    const std::string text = captures::encode_jpeg(image, 100);
    const Answer answer = decode({text.begin(), text.end()});
    ASSERT_TRUE(answer.accepted) << answer.fault;
    // stb writes grey as three channels.
    ASSERT_EQ(answer.image.channels, 3);
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x)
        for (int c = 0; c < 3; ++c)
          ASSERT_NEAR(answer.image.at(x, y)[c], ramp(x, y, channels == 1 ? 0 : c), 4) << x << " " << y << " " << c;
  }
}

TEST(JpegDecoder, TheHeaderIsKnownWithoutThePixels) {
  for (const Kind& kind : kKinds) {
    Bytes bytes = encode(ramps(17, 9, kind.channels), kind.subsampling, 100, kind.flags);
    bytes.resize(segment_end(bytes, segment(bytes, kScan)));
    JpegHeader header;
    std::string fault;
    ASSERT_TRUE(read_jpeg_header(bytes, header, fault)) << kind.name << ": " << fault;
    EXPECT_EQ(header.width, 17);
    EXPECT_EQ(header.height, 9);
    EXPECT_EQ(header.channels, kind.channels) << kind.name;
  }
}

// libjpeg-turbo chooses its instructions once in a process: this test runs itself again without them.
TEST(JpegDecoder, TheBitsAreTheSameWithoutSimd) {
  std::string digests;
  for (const Kind& kind : kKinds) {
    const Answer answer = decode(encode(ramps(200, 77, kind.channels), kind.subsampling, 60, kind.flags));
    ASSERT_TRUE(answer.accepted) << answer.fault;
    digests +=
        "<" + sha256_hex({reinterpret_cast<const char*>(answer.image.values.data()), answer.image.values.size()}) + ">";
  }
  if (std::getenv("JSIMD_FORCENONE") != nullptr) return void(std::cout << digests << "\n");
  const std::string self = std::filesystem::read_symlink("/proc/self/exe").string();
  const test::ProcessResult plain = test::run_process(
      {"/usr/bin/env", "JSIMD_FORCENONE=1", self, "--gtest_filter=JpegDecoder.TheBitsAreTheSameWithoutSimd"});
  EXPECT_EQ(plain.status, 0) << plain.output << plain.errors;
  EXPECT_NE(plain.output.find(digests), std::string::npos) << plain.output;
}

// ---- Four channels ----------------------------------------------------------------------------------------------

// RGB of cyan, magenta, yellow and black as stored; `inverted`: 255 is no ink.
Image8 seen(const Image8& inks, bool inverted) {
  Image8 rgb(inks.width, inks.height, 3);
  for (int y = 0; y < inks.height; ++y)
    for (int x = 0; x < inks.width; ++x)
      for (int c = 0; c < 3; ++c) {
        const auto through = [&](int channel) {
          const int stored = inks.at(x, y)[channel];
          return (inverted ? stored : 255 - stored) / 255.0;
        };
        rgb.at(x, y)[c] = static_cast<std::uint8_t>(std::lround(255.0 * through(c) * through(3)));
      }
  return rgb;
}

TEST(JpegDecoder, InksOfAdobesFilesAreInverted) {  // YCCK; 255 is no ink
  const Image8 inks = ramps(40, 24, 4);
  const Answer answer = decode(encode(inks, TJSAMP_444));
  ASSERT_TRUE(answer.accepted) << answer.fault;
  ASSERT_EQ(answer.image.channels, 3);
  EXPECT_LE(greatest_difference(answer.image, seen(inks, true)), 4);
  EXPECT_GT(greatest_difference(answer.image, seen(inks, false)), 100);
}

TEST(JpegDecoder, InksThatAreStoredAsTheyAreAreKnownByTheMarker) {
  // Greys of the three inks are the same in YCCK, but for two channels in the middle: the file says CMYK instead.
  Image8 inks(16, 16, 4);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x)
      for (int c = 0; c < 4; ++c) inks.at(x, y)[c] = static_cast<std::uint8_t>(c == 3 ? 200 : 90);
  Bytes bytes = encode(inks, TJSAMP_444);
  // Adobe's segment says by its last byte how the channels are stored: 2 YCCK, 0 as they are.
  const std::size_t transform = segment_end(bytes, segment(bytes, kApp14)) - 1;
  ASSERT_EQ(bytes[transform], 2);
  bytes[transform] = 0;
  // With this transform the stored YCCK values count as inks: Y is the luminance of the inverted inks, the chroma is
  // 128.
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) inks.at(x, y)[0] = 255 - 90, inks.at(x, y)[1] = inks.at(x, y)[2] = 128;
  const Answer adobe = decode(bytes);
  ASSERT_TRUE(adobe.accepted) << adobe.fault;
  EXPECT_LE(greatest_difference(adobe.image, seen(inks, true)), 3);
  // Without the segment nothing is inverted.
  remove_segment(bytes, segment(bytes, kApp14));
  const Answer plain = decode(bytes);
  ASSERT_TRUE(plain.accepted) << plain.fault;
  EXPECT_LE(greatest_difference(plain.image, seen(inks, false)), 3);
}

TEST(JpegDecoder, MemoryOfFourChannelsIsCharged) {
  DecodedImage image;
  std::string fault;
  std::uint64_t charged = 0;
  const Bytes bytes = encode(ramps(100, 70, 4), TJSAMP_444);
  const test::HeapMeter heap;
  ASSERT_TRUE(decode_image(bytes, {}, image, fault, [&](std::uint64_t count) { charged += count; })) << fault;
  EXPECT_LE(heap.peak_bytes(), charged);
}

// ---- Refusals ---------------------------------------------------------------------------------------------------

TEST(JpegDecoder, EveryTruncatedFileIsRefused) {
  for (const Kind& kind : kKinds) {
    const Bytes whole = encode(ramps(17, 9, kind.channels), kind.subsampling, 90, kind.flags);
    for (std::size_t length = 0; length < whole.size(); ++length)
      ASSERT_FALSE(decode({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length)}).accepted)
          << kind.name << ", " << length << " of " << whole.size() << " bytes";
    EXPECT_TRUE(decode(whole).accepted);
  }
}

// libjpeg would warn of these and make up the pixels.
TEST(JpegDecoder, WarningsOfTheLibraryAreRefused) {
  const Bytes sound = encode(ramps(64, 33, 3), TJSAMP_420, 90);
  const auto data = static_cast<std::ptrdiff_t>(segment_end(sound, segment(sound, kScan)));
  ASSERT_TRUE(decode(sound).accepted);

  Bytes extra = sound;  // bytes between two segments
  extra.insert(extra.begin() + static_cast<std::ptrdiff_t>(segment(extra, kHuffman)), {0x12, 0x34, 0x56});
  EXPECT_NE(decode(extra).fault.find("xtraneous"), std::string::npos) << decode(extra).fault;

  Bytes ended = sound;  // the end marker where half of the blocks are still to come
  ended.erase(ended.begin() + (data + static_cast<std::ptrdiff_t>(sound.size())) / 2, ended.end() - 2);
  EXPECT_NE(decode(ended).fault.find("premature end"), std::string::npos) << decode(ended).fault;

  Bytes ones = sound;  // no code is all ones
  for (std::ptrdiff_t k = data; k + 3 < static_cast<std::ptrdiff_t>(ones.size()); k += 2)
    ones[static_cast<std::size_t>(k)] = 0xFF, ones[static_cast<std::size_t>(k) + 1] = 0x00;
  EXPECT_NE(decode(ones).fault.find("Huffman code"), std::string::npos) << decode(ones).fault;
}

// ---- Tables that are missing or do not fit ---------------------------------------------------------------------

struct Mutation {
  const char* name;
  void (*apply)(Bytes& bytes);
};

// A table of codes in place of the first: how many there are of each length, then as many values.
void replace_codes(Bytes& bytes, const std::array<std::uint8_t, 16>& counts) {
  const std::size_t at = segment(bytes, kHuffman);
  const std::uint8_t table = bytes[at + 4];
  remove_segment(bytes, at);
  std::size_t values = 0;
  for (const std::uint8_t count : counts) values += count;
  Bytes made = {0xFF, kHuffman, static_cast<std::uint8_t>((19 + values) >> 8),
                static_cast<std::uint8_t>((19 + values) & 0xFF), table};
  made.insert(made.end(), counts.begin(), counts.end());
  made.resize(made.size() + values, 1);
  bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), made.begin(), made.end());
}

constexpr Mutation kMutations[] = {
    {"the scan names code tables that the file has not", [](Bytes& bytes) { bytes[segment(bytes, kScan) + 8] = 0x13; }},
    {"the scan names code tables that no file has", [](Bytes& bytes) { bytes[segment(bytes, kScan) + 8] = 0x7F; }},
    {"a quantisation table less", [](Bytes& bytes) { remove_segment(bytes, segment(bytes, kQuantisation)); }},
    {"more codes than a table has room for",
     [](Bytes& bytes) {
       replace_codes(bytes, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255});
     }},
    {"more codes of a length than there are",
     [](Bytes& bytes) {
       replace_codes(bytes, {3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
     }},
    {"a code table of a number that there is not", [](Bytes& bytes) { bytes[segment(bytes, kHuffman) + 4] = 0x07; }},
    {"the frame names a quantisation table that the file has not",
     [](Bytes& bytes) { bytes[segment(bytes, kFrame) + 12] = 3; }},
    {"a quantisation table of a number that there is not",
     [](Bytes& bytes) { bytes[segment(bytes, kQuantisation) + 4] = 0x07; }},
    {"a channel sampled zero times", [](Bytes& bytes) { bytes[segment(bytes, kFrame) + 11] = 0x01; }},
    {"a channel sampled more often than it may be", [](Bytes& bytes) { bytes[segment(bytes, kFrame) + 11] = 0xF1; }},
    {"no pixels", [](Bytes& bytes) { bytes[segment(bytes, kFrame) + 7] = bytes[segment(bytes, kFrame) + 8] = 0; }},
};

TEST(JpegDecoder, TablesThatAreMissingOrDoNotFitAreRefused) {
  const Bytes sound = encode(ramps(40, 24, 3), TJSAMP_444, 90);
  ASSERT_TRUE(decode(sound).accepted);
  for (const Mutation& mutation : kMutations) {
    Bytes broken = sound;
    mutation.apply(broken);
    EXPECT_FALSE(decode(broken).accepted) << mutation.name;
  }
}

TEST(JpegDecoder, MissingCodeTablesAreTheStandards) {  // as in Motion JPEG; the encoder writes just these
  const Bytes sound = encode(ramps(40, 24, 3), TJSAMP_444, 90);
  Bytes bare = sound;
  for (int table = 0; table < 4; ++table) remove_segment(bare, segment(bare, kHuffman));
  const Answer answer = decode(bare);
  ASSERT_TRUE(answer.accepted) << answer.fault;
  EXPECT_EQ(answer.image.values, decode(sound).image.values);
}

// ---- Limits -----------------------------------------------------------------------------------------------------

Bytes claiming(int width, int height) {
  Bytes bytes = encode(ramps(16, 16, 3), TJSAMP_444);
  const std::size_t frame = segment(bytes, kFrame);
  for (const auto& [at, side] : {std::pair{frame + 5, height}, {frame + 7, width}})
    bytes[at] = static_cast<std::uint8_t>(side >> 8), bytes[at + 1] = static_cast<std::uint8_t>(side & 0xFF);
  return bytes;
}

TEST(JpegDecoder, AnImageBeyondTheLimitsIsRefusedBeforeAnythingIsAllocated) {
  const ImageLimits limits{.max_side = 4096, .max_pixels = 1 << 20};
  for (const auto& [width, height] : {std::pair{4097, 1}, {1, 4097}, {1025, 1024}, {65000, 65000}}) {
    const Bytes bytes = claiming(width, height);
    DecodedImage image;
    std::string fault;
    bool charged = false;
    const test::HeapMeter heap;
    EXPECT_THROW(decode_image(bytes, limits, image, fault, [&](std::uint64_t) { charged = true; }), LimitError)
        << width << "x" << height;
    EXPECT_FALSE(charged);
    EXPECT_LT(heap.peak_bytes(), 1 << 18);
  }
}

TEST(JpegDecoder, UnpackingIsChargedBeforeItAllocates) {
  for (const Kind& kind : kKinds) {
    const Bytes bytes = encode(ramps(100, 70, kind.channels), kind.subsampling, 90, kind.flags);
    DecodedImage image;
    std::string fault;
    std::uint64_t charged = 0;
    {
      const test::HeapMeter heap;
      EXPECT_THROW(decode_image(bytes, {}, image, fault, [](std::uint64_t) { throw LimitError("no"); }), LimitError);
      EXPECT_LT(heap.peak_bytes(), 1 << 16);
    }
    const test::HeapMeter heap;
    ASSERT_TRUE(decode_image(bytes, {}, image, fault, [&](std::uint64_t amount) { charged = amount; })) << fault;
    EXPECT_LE(static_cast<std::uint64_t>(heap.peak_bytes()), charged) << kind.name;
  }
}

}  // namespace
}  // namespace tessera::jpeg_decoder_test
