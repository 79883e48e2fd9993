// Decoders of images, and of the history that one frame of a replay leaves to the next.
#include <zlib.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "base/exr_file.h"
#include "base/image_codec.h"
#include "base/image_metrics.h"
#include "base/radiance_codec.h"
#include "base/webp_codec.h"
#include "captures/sources/jpeg_writer.h"
#include "shaders_cpp/tone_map.h"
#include "tests/fuzz/document_mutator.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/support/captures.h"
#include "tests/support/radiance_files.h"
#include "tilecore/resolve/history.h"

namespace tessera::fuzz {
namespace {

// ---- PNG and JPEG -----------------------------------------------------------------------------------------------

constexpr std::uint64_t kMaxPixels = 1 << 20;

void decode(Bytes input) {
  ImageLimits limits;
  limits.max_pixels = kMaxPixels;
  DecodedImage image;
  std::string fault;
  std::uint64_t charged = 0;
  const auto charge = [&](std::uint64_t bytes) {
    charged = bytes;
    if (bytes > kMaxBytes) throw LimitError("too much");
  };
  expect_answer([&] {
    if (!decode_image(input, limits, image, fault, charge)) {
      require(!fault.empty(), "an image is refused without a word");
      return;
    }
    const std::uint64_t values = static_cast<std::uint64_t>(image.width()) *
                                 static_cast<std::uint64_t>(image.height()) *
                                 static_cast<std::uint64_t>(image.channels());
    require(image.width() > 0 && image.height() > 0 && image.channels() >= 1 && image.channels() <= 4,
            "an image without pixels was accepted");
    require(values <= charged, "an image takes more than was charged");
    const float last = image.unorm(image.width() - 1, image.height() - 1, image.channels() - 1);
    require(last >= 0 && last <= 1, "a channel lies outside of [0, 1]");
  });
}

std::vector<std::string> images() {
  std::vector<std::string> all;
  for (int channels = 1; channels <= 4; ++channels) {
    Image8 image(9, 5, channels);
    Image16 wide(5, 4, channels);
    for (std::size_t i = 0; i < image.values.size(); ++i) image.values[i] = static_cast<std::uint8_t>(i * 7);
    for (std::size_t i = 0; i < wide.values.size(); ++i) wide.values[i] = static_cast<std::uint16_t>(i * 1031);
    all.push_back(encode_png(image));
    all.push_back(encode_png(wide));
    if (channels == 1 || channels == 3) all.push_back(captures::encode_jpeg(image, 20 * channels));
  }
  return all;
}

std::uint32_t big_endian(const std::uint8_t* at) {
  return (std::uint32_t{at[0]} << 24) | (std::uint32_t{at[1]} << 16) | (std::uint32_t{at[2]} << 8) | at[3];
}
void put_big_endian(std::uint8_t* at, std::uint32_t value) {
  for (int k = 0; k < 4; ++k) at[k] = static_cast<std::uint8_t>(value >> (24 - 8 * k));
}

// A chunk of a PNG with everything from its type on.
struct Chunk {
  std::vector<std::uint8_t> bytes;  // type and contents
};

std::vector<Chunk> chunks_of(Bytes png) {
  std::vector<Chunk> chunks;
  for (std::size_t at = 8; at + 12 <= png.size();) {
    const std::size_t length = big_endian(png.data() + at);
    if (length > png.size() - at - 12) break;
    chunks.push_back({{png.begin() + static_cast<std::ptrdiff_t>(at + 4),
                       png.begin() + static_cast<std::ptrdiff_t>(at + 8 + length)}});
    at += length + 12;
  }
  return chunks;
}

// Pixel data are changed unpacked, so that the filters and the rows get to see the change.
void mutate_pixels(std::vector<std::uint8_t>& packed) {
  std::vector<std::uint8_t> raw(1 << 14);
  uLongf raw_size = raw.size();
  if (uncompress(raw.data(), &raw_size, packed.data() + 4, packed.size() - 4) != Z_OK) return;
  const std::size_t size = mutate_bytes(raw.data(), raw_size, raw.size());
  std::vector<std::uint8_t> again(compressBound(size));
  uLongf again_size = again.size();
  if (compress(again.data(), &again_size, raw.data(), size) != Z_OK) return;
  packed.resize(4);
  packed.insert(packed.end(), again.begin(), again.begin() + static_cast<std::ptrdiff_t>(again_size));
}

// A PNG with one chunk changed, doubled or taken away, its lengths and checksums right; a JPEG as plain bytes.
std::size_t mutate_image(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random) {
  std::vector<Chunk> chunks = size > 8 && data[0] == 0x89 ? chunks_of({data, size}) : std::vector<Chunk>{};
  if (chunks.empty()) return mutate_bytes(data, size, max_size);
  const std::size_t which = random() % chunks.size();
  std::vector<std::uint8_t>& bytes = chunks[which].bytes;
  switch (random() % 5) {
    case 0:
      chunks.insert(chunks.begin() + static_cast<std::ptrdiff_t>(which), Chunk(chunks[random() % chunks.size()]));
      break;
    case 1:
      chunks.erase(chunks.begin() + static_cast<std::ptrdiff_t>(which));
      break;
    case 2:
      if (bytes.size() > 4 && std::memcmp(bytes.data(), "IDAT", 4) == 0) {
        mutate_pixels(bytes);
        break;
      }
      [[fallthrough]];
    default: {
      const std::size_t first = random() % 8 == 0 ? 0 : std::min<std::size_t>(4, bytes.size()), before = bytes.size();
      bytes.resize(before + 16);
      bytes.resize(first + mutate_bytes(bytes.data() + first, before - first, bytes.size() - first));
      bytes.resize(std::max<std::size_t>(bytes.size(), 4));
    }
  }
  std::vector<std::uint8_t> out(data, data + 8);
  for (const Chunk& chunk : chunks) {
    std::uint8_t word[4];
    put_big_endian(word, static_cast<std::uint32_t>(chunk.bytes.size() - 4));
    out.insert(out.end(), word, word + 4);
    out.insert(out.end(), chunk.bytes.begin(), chunk.bytes.end());
    put_big_endian(word,
                   static_cast<std::uint32_t>(crc32(0, chunk.bytes.data(), static_cast<uInt>(chunk.bytes.size()))));
    out.insert(out.end(), word, word + 4);
  }
  if (out.size() > max_size) return mutate_bytes(data, size, max_size);
  std::memcpy(data, out.data(), out.size());
  return out.size();
}

// ---- WebP -------------------------------------------------------------------------------------------------------

std::vector<std::string> webp_images() {
  std::vector<std::string> all;
  for (const int channels : {3, 4})
    for (const int size : {1, 5, 17, 40})
      for (const int kind : {0, 1, 2}) {
        Image8 image(size, 1 + size / 2, channels);
        for (std::size_t i = 0; i < image.values.size(); ++i)
          image.values[i] = static_cast<std::uint8_t>(kind == 0 ? i * 7 : kind == 1 ? i * i * i % 251 : i % 5 * 60);
        all.push_back(encode_webp(image, 0, true));
        all.push_back(encode_webp(image, 40 * kind, false));
      }
  return all;
}

// The contents of a chunk, or plain bytes; the file's length and the last chunk's are right again most of the time.
std::size_t mutate_webp(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random) {
  if (size < 24 || random() % 8 == 0) return mutate_bytes(data, size, max_size);
  const auto word = [&](std::size_t at) {
    std::uint32_t value;
    std::memcpy(&value, data + at, sizeof value);
    return std::size_t{value};
  };
  const auto put_word = [&](std::size_t at, std::size_t value) {
    const auto narrow = static_cast<std::uint32_t>(value);
    std::memcpy(data + at, &narrow, sizeof narrow);
  };
  std::size_t last = 12;
  while (last + 16 < size && word(last + 4) < size - last - 16) last += 8 + (word(last + 4) + 1) / 2 * 2;
  if (last + 8 > size) return mutate_bytes(data, size, max_size);
  const std::size_t after = mutate_tail(data, random() % 2 == 0 ? last + 8 : std::min(last + 20, size), size, max_size);
  if (after < last + 8) return after;
  put_word(4, after - 8);
  put_word(last + 4, after - last - 8);
  return after;
}

// ---- EXR --------------------------------------------------------------------------------------------------------

void read_exr_bytes(Bytes input) {
  static const std::filesystem::path kFile = scratch_folder() / "picture.exr";
  write_scratch(kFile, input);
  ImageLimits limits;
  limits.max_pixels = kMaxPixels;
  expect_answer([&] {
    const Image image = read_exr(kFile, limits);
    require(image.width > 0 && image.height > 0 && image.values.size() <= 4 * kMaxPixels,
            "an EXR beyond the limits was accepted");
    // `compare` tone-maps the images that it reads.
    if (image.values.size() < 4096) {
      const Image8 shown = shaders::to_display(image, 1.0f);
      require(shown.values.size() == image.values.size() / static_cast<std::size_t>(image.channels) *
                                         static_cast<std::size_t>(shown.channels),
              "tone mapping loses pixels");
    }
  });
}

std::vector<std::string> exr_files() {
  std::vector<std::string> all;
  const std::filesystem::path file = scratch_folder() / "seed.exr";
  for (const auto type : {ExrChannel::Type::kHalf, ExrChannel::Type::kFloat})
    for (const int width : {1, 7, 40}) {
      const int height = 1 + width / 2;
      std::vector<float> values(static_cast<std::size_t>(4 * width * height));
      for (std::size_t i = 0; i < values.size(); ++i) values[i] = std::sin(static_cast<float>(i)) * 4.0f;
      std::vector<ExrChannel> channels;
      for (std::size_t c = 0; c < 4; ++c) channels.push_back({std::string(1, "RGBA"[c]), type, values.data() + c, 4});
      write_exr(file, width, height, channels);
      all.push_back(test::read_text(file));
    }
  return all;
}

// Attributes are found by name: damaged files most often have wrong sizes and counts in the header.
std::size_t mutate_exr(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random) {
  static const char* const kNames[] = {"dataWindow",  "displayWindow", "channels",
                                       "compression", "lineOrder",     "pixelAspectRatio"};
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::string_view name = kNames[random() % std::size(kNames)];
  const std::size_t at = text.find(name);
  if (at == std::string_view::npos || random() % 3 == 0) return mutate_bytes(data, size, max_size);
  const std::size_t value = at + name.size() + 1 + random() % 32;
  if (value + 4 >= size) return mutate_bytes(data, size, max_size);
  static const std::int32_t kWords[] = {0,
                                        1,
                                        -1,
                                        2,
                                        5,
                                        9,
                                        255,
                                        16384,
                                        65535,
                                        1 << 20,
                                        -(1 << 20),
                                        1 << 30,
                                        -(1 << 30),
                                        std::numeric_limits<std::int32_t>::max(),
                                        std::numeric_limits<std::int32_t>::min()};
  const std::int32_t word = kWords[random() % std::size(kWords)];
  std::memcpy(data + value, &word, random() % 2 == 0 ? 4 : 1);
  return size;
}

// ---- Radiance in memory -----------------------------------------------------------------------------------------

void decode_light(Bytes input) {
  ImageLimits limits;
  limits.max_pixels = kMaxPixels;
  Image image;
  std::string fault;
  std::uint64_t charged = 0;
  const auto charge = [&](std::uint64_t bytes) {
    charged = bytes;
    if (bytes > kMaxBytes) throw LimitError("too much");
  };
  expect_answer([&] {
    if (!decode_radiance(input, limits, image, fault, charge)) {
      require(!fault.empty(), "an image is refused without a word");
      return;
    }
    require(image.width > 0 && image.height > 0 && image.channels >= 3, "an image without pixels was accepted");
    require(image.values.size() * sizeof(float) <= charged, "an image takes more than was charged");
  });
}

std::vector<std::string> radiance_files() {
  std::vector<std::string> all = exr_files();
  for (const int width : {1, 8, 40}) {
    Image image(width, 1 + width / 2, 3);
    for (std::size_t i = 0; i < image.values.size(); ++i) image.values[i] = static_cast<float>(i / 7) * 0.3f;
    all.push_back(test::hdr_file(image));
    // Rows that are not flat: a run, and bytes one by one.
    std::string packed = fmt::format("#?RADIANCE\n\n+Y 2 +X {}\n", width);
    for (int y = 0; y < 2 && width >= 8; ++y) {
      packed += {2, 2, 0, static_cast<char>(width)};
      for (int channel = 0; channel < 4; ++channel)
        packed += {static_cast<char>(128 + width - 3), 100, 3, 1, 2, static_cast<char>(channel)};
    }
    all.push_back(packed);
  }
  return all;
}

// The header's words stay most of the time.
std::size_t mutate_radiance(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random) {
  if (size < 2 || data[0] != '#') return mutate_exr(data, size, max_size, random);
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t head = text.find(" +X ");
  const std::size_t first = head + random() % 8;
  if (head == std::string_view::npos || first >= size || random() % 8 == 0) return mutate_bytes(data, size, max_size);
  return mutate_tail(data, first, size, max_size);
}

// ---- Histories --------------------------------------------------------------------------------------------------

void restore(Bytes input) {
  static const std::filesystem::path kFile = scratch_folder() / "history.bin";
  write_scratch(kFile, input);
  expect_answer([&] {
    const tilecore::History history = tilecore::History::restore(kFile, kMaxPixels);
    const auto pixels =
        static_cast<std::size_t>(history.region.width()) * static_cast<std::size_t>(history.region.height());
    require(history.color.size() == pixels && history.depth.size() == pixels && history.surface.size() == pixels,
            "a history without all of its pixels");
    require(history.pixel(history.region.x1 - 1, history.region.y1 - 1) + 1 == pixels,
            "pixels of a history are not where they belong");
    for (int y = history.region.y0; y < history.region.y1; ++y)
      for (int x = history.region.x0; x < history.region.x1; ++x) {
        require(history.block(x, y) < history.memory.size(), "a pixel of a history has no block");
        history.rejected_around(x, y);
      }
  });
}

std::vector<std::string> histories() {
  std::vector<std::string> all;
  const std::filesystem::path file = scratch_folder() / "seed.history";
  for (const IntRect region : {IntRect{0, 0, 1, 1}, IntRect{0, 0, 8, 8}, IntRect{3, 5, 10, 9}, IntRect{4, 0, 5, 13}}) {
    tilecore::History history(region);
    history.frame = region.x0 + 1;
    history.save(file);
    all.push_back(test::read_text(file));
  }
  return all;
}

// The region, and a file as long as its head says.
std::size_t mutate_history(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random) {
  if (size < 32 || random() % 3 == 0) return mutate_bytes(data, size, max_size);
  std::int32_t region[4];
  for (int k = 0; k < 4; ++k) region[k] = static_cast<std::int32_t>(random() % 24) + (k >= 2 ? 1 : 0);
  if (random() % 16 == 0) region[random() % 4] = static_cast<std::int32_t>(random() * 2654435761u);
  std::memcpy(data + 8, region, sizeof region);
  const std::int64_t width = region[2] - std::int64_t{region[0]}, height = region[3] - std::int64_t{region[1]};
  if (width <= 0 || height <= 0 || width * height > 4096) return size;
  const std::int64_t blocks = ((region[2] + 3) / 4 - region[0] / 4) * std::int64_t{(region[3] + 3) / 4 - region[1] / 4};
  const auto wanted = static_cast<std::size_t>(32 + width * height * 24 + blocks * 2);
  if (wanted > max_size) return size;
  if (wanted > size) std::memset(data + size, static_cast<int>(random() % 256), wanted - size);
  return wanted;
}

}  // namespace

const Target kImageTarget{"image", "any bytes as a PNG or JPEG", 8 << 10, decode, images, mutate_image};
const Target kWebpTarget{"webp", "any bytes as a WebP", 4 << 10, decode, webp_images, mutate_webp};
const Target kExrTarget{"exr",     "any bytes as an EXR that `compare` reads", 8 << 10, read_exr_bytes, exr_files,
                        mutate_exr};
const Target kRadianceTarget{"radiance",     "any bytes as an EXR or HDR that lights a capture",
                             8 << 10,        decode_light,
                             radiance_files, mutate_radiance};
const Target kHistoryTarget{"history", "any bytes as a history that `replay --history` goes on from",
                            16 << 10,  restore,
                            histories, mutate_history};

}  // namespace tessera::fuzz
