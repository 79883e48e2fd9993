#include "base/image_codec.h"

#include <libdeflate.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/jpeg_decoder.h"
#include "base/stb_bridge.h"
#include "base/webp_codec.h"

namespace tessera {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::uint8_t kPngSignature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};

std::uint32_t big_endian32(Bytes bytes, std::size_t at) {
  return (std::uint32_t{bytes[at]} << 24) | (std::uint32_t{bytes[at + 1]} << 16) | (std::uint32_t{bytes[at + 2]} << 8) |
         std::uint32_t{bytes[at + 3]};
}

// Walks the chunks of a PNG: lengths inside the file, CRCs right, IHDR first, IDAT present, IEND last. `data_chunks`
// gets the contents of the IDAT chunks.
bool check_png(Bytes bytes, std::vector<Bytes>& data_chunks, std::string& fault) {
  std::size_t at = sizeof kPngSignature;
  bool first = true;
  while (true) {
    if (bytes.size() - at < 12) return fault = fmt::format("PNG ends inside a chunk at byte {}", at), false;
    const std::size_t length = big_endian32(bytes, at);
    if (length > bytes.size() - at - 12)
      return fault = fmt::format("PNG chunk at byte {} is longer than the file", at), false;
    const char* type = reinterpret_cast<const char*>(bytes.data() + at + 4);
    const auto crc =
        static_cast<std::uint32_t>(crc32(crc32(0, nullptr, 0), bytes.data() + at + 4, static_cast<uInt>(length + 4)));
    if (crc != big_endian32(bytes, at + 8 + length))
      return fault = fmt::format("PNG chunk at byte {} has a wrong checksum", at), false;
    if (first && std::memcmp(type, "IHDR", 4) != 0) return fault = "PNG does not begin with IHDR", false;
    first = false;
    if (std::memcmp(type, "IDAT", 4) == 0) data_chunks.push_back(bytes.subspan(at + 8, length));
    at += length + 12;
    if (std::memcmp(type, "IEND", 4) == 0) break;
  }
  if (data_chunks.empty()) return fault = "PNG holds no pixels", false;
  return true;
}

// Bytes that the pixels of a checked PNG take before compression: every row with its filter byte, Adam7 passes apart
// when interlaced (PNG specification, sections 7.2 and 8).
std::uint64_t png_raw_bytes(Bytes bytes) {
  constexpr std::uint64_t kPassX[] = {0, 4, 0, 2, 0, 1, 0}, kPassY[] = {0, 0, 4, 0, 2, 0, 1},
                          kStepX[] = {8, 8, 4, 4, 2, 2, 1}, kStepY[] = {8, 8, 8, 4, 4, 2, 2};
  constexpr std::uint64_t kSamples[] = {1, 0, 3, 1, 2, 0, 4};
  const std::uint64_t width = big_endian32(bytes, 16), height = big_endian32(bytes, 20);
  const std::uint64_t bits = bytes[24] * kSamples[std::min<int>(bytes[25], 6)];
  const auto rows = [&](std::uint64_t w, std::uint64_t h) { return w == 0 ? 0 : h * (1 + (w * bits + 7) / 8); };
  if (bytes[28] == 0) return rows(width, height);
  std::uint64_t sum = 0;
  for (std::size_t pass = 0; pass < 7; ++pass)
    sum += rows((width + kStepX[pass] - 1 - std::min(kPassX[pass], width)) / kStepX[pass],
                (height + kStepY[pass] - 1 - std::min(kPassY[pass], height)) / kStepY[pass]);
  return sum;
}

// Inflates without keeping anything: the decoder behind would go on as long as data come, whatever the size says.
// Sloppy encoders leave some bytes after the last row; kSlack of them are let through.
bool check_png_data(const std::vector<Bytes>& chunks, std::uint64_t raw_bytes, std::string& fault) {
  constexpr std::uint64_t kSlack = 65536;
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return fault = "cannot be inflated", false;
  const std::unique_ptr<z_stream, decltype(&inflateEnd)> guard(&stream, inflateEnd);
  std::vector<std::uint8_t> out(65536);
  std::uint64_t count = 0;
  int status = Z_OK;
  for (std::size_t k = 0; k < chunks.size() && status == Z_OK; ++k) {
    stream.next_in = const_cast<Bytef*>(chunks[k].data());
    stream.avail_in = static_cast<uInt>(chunks[k].size());
    while (status == Z_OK && (stream.avail_in > 0 || stream.avail_out == 0)) {
      stream.next_out = out.data();
      stream.avail_out = static_cast<uInt>(out.size());
      status = inflate(&stream, Z_NO_FLUSH);
      count += out.size() - stream.avail_out;
      if (count > raw_bytes + kSlack)
        return fault = fmt::format("PNG holds more than the {} bytes of its pixels", raw_bytes), false;
    }
    if (status == Z_BUF_ERROR) status = Z_OK;  // no progress without the next chunk
  }
  if (status != Z_OK && status != Z_STREAM_END) return fault = "PNG pixels cannot be inflated", false;
  if (count < raw_bytes)
    return fault = fmt::format("PNG holds {} of the {} bytes of its pixels", count, raw_bytes), false;
  return true;
}

// Walks the marker segments of a JPEG up to the end marker; entropy-coded data is skipped.
bool check_jpeg(Bytes bytes, std::string& fault) {
  std::size_t at = 2;
  bool scan = false;
  while (true) {
    // A marker: 0xFF, any number of fill bytes 0xFF, then its code.
    if (at + 2 > bytes.size()) return fault = "JPEG ends before its end marker", false;
    if (bytes[at] != 0xFF) return fault = fmt::format("JPEG has no marker at byte {}", at), false;
    while (at + 1 < bytes.size() && bytes[at + 1] == 0xFF) ++at;
    if (at + 2 > bytes.size()) return fault = "JPEG ends before its end marker", false;
    const std::uint8_t marker = bytes[at + 1];
    at += 2;
    if (marker == 0xD9) break;                                           // EOI
    if (marker == 0x01 || (marker >= 0xD0 && marker <= 0xD7)) continue;  // no length
    if (at + 2 > bytes.size()) return fault = "JPEG ends inside a segment", false;
    const std::size_t length = (std::size_t{bytes[at]} << 8) | bytes[at + 1];
    if (length < 2 || length > bytes.size() - at)
      return fault = fmt::format("JPEG segment at byte {} is longer than the file", at), false;
    at += length;
    if (marker != 0xDA) continue;
    scan = true;  // after SOS: data up to a marker that is neither a stuffed zero nor a restart
    while (at + 1 < bytes.size() &&
           (bytes[at] != 0xFF || bytes[at + 1] == 0 || (bytes[at + 1] >= 0xD0 && bytes[at + 1] <= 0xD7)))
      ++at;
  }
  if (!scan) return fault = "JPEG holds no pixels", false;
  return true;
}

// What unpacking takes at its peak. PNG: the joined IDAT chunks in a buffer that doubles, the raw rows, the unfiltered
// rows, their expansion (palette, passes), our copy. JPEG: planes padded to blocks of up to 32 pixels, coefficients of
// two bytes when progressive, the image, our copy.
std::uint64_t decoder_bytes(std::size_t encoded, int width, int height, int channels, bool wide) {
  const auto padded = [](int side) { return (static_cast<std::uint64_t>(side) + 31) / 32 * 32; };
  const std::uint64_t frame_image =
      padded(width) * padded(height) * static_cast<std::uint64_t>(channels) * (wide ? 2 : 1);
  constexpr std::uint64_t kTables = 128 << 10;  // zlib's window, Huffman tables
  return 2 * static_cast<std::uint64_t>(encoded) + 6 * frame_image + kTables;
}

struct FreeStb {
  void operator()(void* memory) const { tessera_stb_free(memory); }
};

template <class T>
ImageOf<T> copy_pixels(const T* pixels, int width, int height, int channels) {
  ImageOf<T> image(width, height, channels);
  std::memcpy(image.values.data(), pixels, image.values.size() * sizeof(T));
  return image;
}

void append_bytes(void* context, void* data, int size) {
  static_cast<std::string*>(context)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
}

void append_big_endian32(std::string& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<char>((value >> shift) & 0xFF));
}

void append_png_chunk(std::string& out, const char* type, std::string_view data) {
  append_big_endian32(out, static_cast<std::uint32_t>(data.size()));
  const std::size_t start = out.size();
  out.append(type, 4);
  out.append(data);
  append_big_endian32(
      out, static_cast<std::uint32_t>(crc32(crc32(0, nullptr, 0), reinterpret_cast<const Bytef*>(out.data() + start),
                                            static_cast<uInt>(out.size() - start))));
}

}  // namespace

float DecodedImage::unorm(int x, int y, int channel) const {
  const auto c = static_cast<std::size_t>(channel);
  if (const auto* bytes = std::get_if<Image8>(&pixels)) return static_cast<float>(bytes->at(x, y)[c]) / 255.0f;
  return static_cast<float>(std::get<Image16>(pixels).at(x, y)[c]) / 65535.0f;
}

ImageFormat image_format(Bytes bytes) {
  if (bytes.size() >= sizeof kPngSignature && std::memcmp(bytes.data(), kPngSignature, sizeof kPngSignature) == 0)
    return ImageFormat::kPng;
  if (bytes.size() >= 3 && bytes[0] == 0xFF && bytes[1] == 0xD8 && bytes[2] == 0xFF) return ImageFormat::kJpeg;
  if (bytes.size() >= 12 && std::memcmp(bytes.data(), "RIFF", 4) == 0 && std::memcmp(bytes.data() + 8, "WEBP", 4) == 0)
    return ImageFormat::kWebp;
  return ImageFormat::kUnknown;
}

namespace {

// What a file's head says, whatever the format.
struct ImageHead {
  int width = 0, height = 0, channels = 0;
  JpegHeader jpeg;
  WebpHeader webp;
  std::vector<Bytes> png_data;  // contents of the IDAT chunks
};

bool read_head(Bytes bytes, ImageFormat format, ImageHead& head, std::string& fault) {
  switch (format) {
    case ImageFormat::kPng:
      if (!check_png(bytes, head.png_data, fault)) return false;
      if (!tessera_stb_info(bytes.data(), static_cast<int>(bytes.size()), &head.width, &head.height, &head.channels))
        return fault = fmt::format("cannot be decoded ({})", tessera_stb_failure_reason()), false;
      // Deflate packs at most 1032 to 1.
      if (png_raw_bytes(bytes) / 1032 > bytes.size())
        return fault = fmt::format("PNG of {}x{} pixels cannot fit {} bytes", head.width, head.height, bytes.size()),
               false;
      return true;
    case ImageFormat::kJpeg:
      if (!check_jpeg(bytes, fault) || !read_jpeg_header(bytes, head.jpeg, fault)) return false;
      head.width = head.jpeg.width, head.height = head.jpeg.height, head.channels = head.jpeg.channels;
      return true;
    case ImageFormat::kWebp:
      if (!read_webp_header(bytes, head.webp, fault)) return false;
      head.width = head.webp.width, head.height = head.webp.height, head.channels = head.webp.channels;
      return true;
    case ImageFormat::kUnknown:
      break;
  }
  return fault = "is neither PNG, JPEG nor WebP", false;
}

using FilteredRows = std::array<std::vector<std::uint8_t>, 4>;  // none, sub, up, Paeth: numbers 0, 1, 2, 4

// Bytes of a row and of those that filters predict them by.
struct FilterInput {
  const std::uint8_t *row, *left, *above, *corner;
};

// Sub, up and Paeth of `count` bytes, to the filtered rows from `first` on. Sixteen bits hold all differences: more at
// a time than an int's.
void filter_bytes(const FilterInput& in, std::size_t count, FilteredRows& filtered, std::size_t first) {
  std::uint8_t *__restrict sub = filtered[1].data() + first, *__restrict up = filtered[2].data() + first,
               *__restrict paeth = filtered[3].data() + first;
  const auto size = [](std::int16_t v) {
    const auto negative = static_cast<std::int16_t>(-v);
    return v > negative ? v : negative;
  };
  const std::uint8_t *row = in.row, *left = in.left, *above = in.above, *corner = in.corner;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int16_t a = left[i], b = above[i], c = corner[i], by_a = static_cast<std::int16_t>(b - c),
                       by_b = static_cast<std::int16_t>(a - c);
    const std::int16_t to_a = size(by_a), to_b = size(by_b), to_c = size(static_cast<std::int16_t>(by_a + by_b));
    const std::int16_t b_or_c = to_b <= to_c ? b : c, least = to_b <= to_c ? to_b : to_c;
    const std::int16_t nearest = to_a <= least ? a : b_or_c;
    sub[i] = static_cast<std::uint8_t>(row[i] - a);
    up[i] = static_cast<std::uint8_t>(row[i] - b);
    paeth[i] = static_cast<std::uint8_t>(row[i] - nearest);
  }
}

// Of bytes as differences of either sign.
std::uint64_t sum_of_sizes(const std::vector<std::uint8_t>& bytes) {
  std::uint64_t sum = 0;
  constexpr std::size_t kAtOnce = 256;  // sums that 16 bits hold
  for (std::size_t i = 0; i < bytes.size(); i += kAtOnce) {
    const std::size_t end = std::min(bytes.size(), i + kAtOnce);
    std::uint16_t part = 0;
    for (std::size_t k = i; k < end; ++k) {
      const std::uint8_t v = bytes[k], negative = static_cast<std::uint8_t>(-v);
      part = static_cast<std::uint16_t>(part + (v < negative ? v : negative));
    }
    sum += part;
  }
  return sum;
}

// Rows of bytes as a PNG. Each row takes the filter whose differences are smallest (PNG specification, 12.8).
std::string png_of_rows(int width, int height, int channels, int bit_depth, const std::vector<std::uint8_t>& rows,
                        PngEffort effort) {
  const std::size_t step = static_cast<std::size_t>(channels * bit_depth / 8),
                    row_bytes = step * static_cast<std::size_t>(width);
  std::vector<std::uint8_t> raw;
  const std::vector<std::uint8_t> nothing(row_bytes, 0);
  const std::uint8_t* above = nothing.data();
  raw.reserve((row_bytes + 1) * static_cast<std::size_t>(height));
  FilteredRows filtered;
  for (auto& row : filtered) row.resize(row_bytes);
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
    const std::uint8_t* row = rows.data() + y * row_bytes;
    std::copy_n(row, row_bytes, filtered[0].begin());
    filter_bytes({row, nothing.data(), above, nothing.data()}, step, filtered, 0);
    filter_bytes({row + step, row, above + step, above}, row_bytes - step, filtered, step);
    std::size_t best = 0;
    std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
    for (std::size_t f = 0; f < filtered.size(); ++f)
      if (const std::uint64_t sum = sum_of_sizes(filtered[f]); sum < least) least = sum, best = f;
    raw.push_back(static_cast<std::uint8_t>(best == 3 ? 4 : best));
    raw.insert(raw.end(), filtered[best].begin(), filtered[best].end());
    above = row;
  }
  // 5: as small as zlib's default, in a fifth of its time; 12: the smallest.
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(effort == PngEffort::kFast ? 5 : 12), libdeflate_free_compressor);
  std::string packed(libdeflate_zlib_compress_bound(compressor.get(), raw.size()), '\0');
  const std::size_t size = compressor == nullptr ? 0
                                                 : libdeflate_zlib_compress(compressor.get(), raw.data(), raw.size(),
                                                                            packed.data(), packed.size());
  if (size == 0) throw SystemError("out of memory while packing a PNG");
  packed.resize(size);

  static constexpr char kColorType[] = {0, 0, 4, 2, 6};  // by number of channels
  std::string header;
  append_big_endian32(header, static_cast<std::uint32_t>(width));
  append_big_endian32(header, static_cast<std::uint32_t>(height));
  header += {static_cast<char>(bit_depth), kColorType[channels], 0, 0, 0};
  std::string out(reinterpret_cast<const char*>(kPngSignature), sizeof kPngSignature);
  append_png_chunk(out, "IHDR", header);
  append_png_chunk(out, "IDAT", packed);
  append_png_chunk(out, "IEND", "");
  return out;
}

}  // namespace

const char* mime_type(ImageFormat format) {
  switch (format) {
    case ImageFormat::kPng:
      return "image/png";
    case ImageFormat::kJpeg:
      return "image/jpeg";
    case ImageFormat::kWebp:
      return "image/webp";
    case ImageFormat::kUnknown:
      break;
  }
  return "";
}

bool decode_image(Bytes bytes, const ImageLimits& limits, DecodedImage& image, std::string& fault,
                  const ChargeBytes& charge) {
  const ImageFormat format = image_format(bytes);
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    return fault = "is larger than 2 GiB", false;
  ImageHead head;
  if (!read_head(bytes, format, head, fault)) return false;
  int width = head.width, height = head.height, channels = head.channels;
  if (width > limits.max_side || height > limits.max_side ||
      static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) > limits.max_pixels)
    throw LimitError(fmt::format("{} of {}x{} pixels exceeds the limit of {} a side and {} in all for images",
                                 format == ImageFormat::kPng    ? "PNG"
                                 : format == ImageFormat::kJpeg ? "JPEG"
                                                                : "WebP",
                                 width, height, limits.max_side, limits.max_pixels));
  const int size = static_cast<int>(bytes.size());
  const bool wide = format == ImageFormat::kPng && tessera_stb_is_16_bit(bytes.data(), size);
  if (charge)
    charge(format == ImageFormat::kWebp
               ? webp_decoder_bytes(head.webp, bytes.size())
               : decoder_bytes(bytes.size(), width, height, std::max(channels, head.jpeg.stored_channels), wide));
  if (format == ImageFormat::kPng && !check_png_data(head.png_data, png_raw_bytes(bytes), fault)) return false;

  if (format != ImageFormat::kPng) {
    Image8 frame_image;
    if (!(format == ImageFormat::kJpeg ? decode_jpeg(bytes, head.jpeg, frame_image, fault)
                                       : decode_webp(bytes, head.webp, frame_image, fault)))
      return false;
    image.pixels = std::move(frame_image);
  } else if (wide) {
    const std::unique_ptr<unsigned short, FreeStb> pixels(
        tessera_stb_load_16(bytes.data(), size, &width, &height, &channels));
    if (!pixels) return fault = fmt::format("cannot be decoded ({})", tessera_stb_failure_reason()), false;
    image.pixels = copy_pixels<std::uint16_t>(pixels.get(), width, height, channels);
  } else {
    const std::unique_ptr<unsigned char, FreeStb> pixels(
        tessera_stb_load(bytes.data(), size, &width, &height, &channels));
    if (!pixels) return fault = fmt::format("cannot be decoded ({})", tessera_stb_failure_reason()), false;
    image.pixels = copy_pixels<std::uint8_t>(pixels.get(), width, height, channels);
  }
  return true;
}

std::string encode_png(const Image8& image, PngEffort effort) {
  return png_of_rows(image.width, image.height, image.channels, 8, image.values, effort);
}

std::string encode_png(const Image16& image, PngEffort effort) {
  std::vector<std::uint8_t> rows;
  rows.reserve(2 * image.values.size());
  for (const std::uint16_t value : image.values) {
    rows.push_back(static_cast<std::uint8_t>(value >> 8));
    rows.push_back(static_cast<std::uint8_t>(value & 0xFF));
  }
  return png_of_rows(image.width, image.height, image.channels, 16, rows, effort);
}

std::string encode_jpeg(const Image8& image, int quality) {
  std::string out;
  if (!tessera_stb_write_jpeg(append_bytes, &out, image.width, image.height, image.channels, image.values.data(),
                              quality))
    throw SystemError("out of memory while packing a JPEG");
  return out;
}

void write_png(const std::filesystem::path& target, const Image8& image) {
  write_file_atomically(target, encode_png(image, PngEffort::kFast));
}

}  // namespace tessera
