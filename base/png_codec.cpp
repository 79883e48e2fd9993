#include "base/png_codec.h"

#include <libdeflate.h>
#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <csetjmp>
#include <cstring>
#include <limits>
#include <memory>

#include <fmt/format.h>

#include "base/check.h"
#include "base/error.h"

namespace tessera {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::uint8_t kPngSignature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};

std::uint32_t big_endian32(Bytes bytes, std::size_t at) {
  return (std::uint32_t{bytes[at]} << 24) | (std::uint32_t{bytes[at + 1]} << 16) | (std::uint32_t{bytes[at + 2]} << 8) |
         std::uint32_t{bytes[at + 3]};
}

// ---- Reading ----------------------------------------------------------------------------------------------------

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

// libpng's reader for a checked file; its refusals become faults in words. Chunks other than IHDR, PLTE, tRNS, IDAT and
// IEND are ignored (gAMA, iCCP and sBIT among them), since glTF defines the meaning of a texture's values.
class PngReader {
 public:
  explicit PngReader(Bytes bytes) : rest_(bytes) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, refuse, warn);
    info_ = png_ == nullptr ? nullptr : png_create_info_struct(png_);
    if (info_ == nullptr) {
      png_destroy_read_struct(&png_, nullptr, nullptr);
      throw SystemError("out of memory while unpacking a PNG");
    }
    png_set_read_fn(png_, this, read);
    png_set_user_limits(png_, kMaxSide, kMaxSide);
    png_set_crc_action(png_, PNG_CRC_QUIET_USE, PNG_CRC_QUIET_USE);  // check_png() has looked at them
    png_set_keep_unknown_chunks(png_, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
  }
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  // Reads up to the pixels.
  bool read_head(PngHeader& header, std::string& fault) {
    if (!attempt([this] { png_read_info(png_, info_); }, fault)) return false;
    header.width = static_cast<int>(png_get_image_width(png_, info_));
    header.height = static_cast<int>(png_get_image_height(png_, info_));
    const std::uint64_t bits = std::uint64_t{png_get_bit_depth(png_, info_)} * png_get_channels(png_, info_);
    const auto rows = [&](std::uint64_t w, std::uint64_t h) { return w == 0 ? 0 : h * (1 + (w * bits + 7) / 8); };
    const auto w = static_cast<unsigned>(header.width), h = static_cast<unsigned>(header.height);
    header.raw_bytes = 0;
    if (png_get_interlace_type(png_, info_) == PNG_INTERLACE_NONE)
      header.raw_bytes = rows(w, h);
    else
      for (unsigned pass = 0; pass < PNG_INTERLACE_ADAM7_PASSES; ++pass)
        header.raw_bytes += rows(PNG_PASS_COLS(w, pass), PNG_PASS_ROWS(h, pass));
    // Whole bytes a channel; palettes and the transparent colour become channels.
    const auto expand = [this] {
      png_set_expand(png_);
      if constexpr (std::endian::native == std::endian::little) png_set_swap(png_);
      png_set_interlace_handling(png_);
      png_read_update_info(png_, info_);
    };
    if (!attempt(expand, fault)) return false;
    header.channels = png_get_channels(png_, info_);
    header.wide = png_get_bit_depth(png_, info_) == 16;
    return true;
  }

  template <class T>
  bool read_pixels(ImageOf<T>& image, std::string& fault) {
    const std::size_t row = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.channels);
    TESSERA_CHECK(png_get_rowbytes(png_, info_) == row * sizeof(T), "rows are as long as the head says");
    std::vector<png_bytep> rows(static_cast<std::size_t>(image.height));
    for (std::size_t y = 0; y < rows.size(); ++y) rows[y] = reinterpret_cast<png_bytep>(image.values.data() + y * row);
    const auto read_all = [&] {
      png_read_image(png_, rows.data());
      png_read_end(png_, info_);
    };
    return attempt(read_all, fault);
  }

 private:
  static constexpr png_uint_32 kMaxSide = 65536;

  // Runs calls of libpng, which jumps here where it refuses: `calls` may own nothing.
  template <class Calls>
  bool attempt(const Calls& calls, std::string& fault) {
    if (setjmp(png_jmpbuf(png_)) != 0) return fault = fmt::format("cannot be decoded ({})", message_.data()), false;
    calls();
    return true;
  }
  [[noreturn]] static void refuse(png_structp png, png_const_charp message) {
    auto& text = static_cast<PngReader*>(png_get_error_ptr(png))->message_;
    std::strncpy(text.data(), message, text.size() - 1);
    png_longjmp(png, 1);
  }
  // A transparent colour in the wrong place or of the wrong length is a fault, too.
  static void warn(png_structp png, png_const_charp message) {
    if (std::string_view(message).starts_with("tRNS:")) refuse(png, message);
  }
  static void read(png_structp png, png_bytep to, std::size_t size) {
    Bytes& rest = static_cast<PngReader*>(png_get_io_ptr(png))->rest_;
    if (size > rest.size()) png_error(png, "ends early");
    std::copy_n(rest.begin(), size, to);
    rest = rest.subspan(size);
  }

  Bytes rest_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::array<char, 200> message_{};
};

// Inflates without keeping the result, to check that the data is complete and has no more than the rows. Sloppy
// encoders leave some bytes after the last row; up to kSlack of them are accepted.
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

// ---- Writing ----------------------------------------------------------------------------------------------------

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

using FilteredRows = std::array<std::vector<std::uint8_t>, 4>;  // none, sub, up, Paeth: numbers 0, 1, 2, 4

// Bytes of a row, and the bytes that filters predict them from.
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

// Sum of the magnitudes of bytes that stand for signed differences.
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

bool is_png(Bytes bytes) {
  return bytes.size() >= sizeof kPngSignature && std::memcmp(bytes.data(), kPngSignature, sizeof kPngSignature) == 0;
}

bool read_png_header(Bytes bytes, PngHeader& header, std::string& fault) {
  if (!check_png(bytes, header.data, fault) || !PngReader(bytes).read_head(header, fault)) return false;
  // Deflate packs at most 1032 to 1.
  if (header.raw_bytes / 1032 > bytes.size())
    return fault = fmt::format("PNG of {}x{} pixels cannot fit {} bytes", header.width, header.height, bytes.size()),
           false;
  return true;
}

std::uint64_t png_decoder_bytes(const PngHeader& header) {
  // The image, libpng's rows of up to 8 bytes a pixel, pointers to rows, zlib's window and Huffman tables.
  const auto width = static_cast<std::uint64_t>(header.width), height = static_cast<std::uint64_t>(header.height);
  const std::uint64_t pixel = static_cast<std::uint64_t>(header.channels) * (header.wide ? 2 : 1);
  return width * height * pixel + 32 * width + sizeof(void*) * height + (128 << 10);
}

bool decode_png(Bytes bytes, const PngHeader& header, std::variant<Image8, Image16>& pixels, std::string& fault) {
  if (!check_png_data(header.data, header.raw_bytes, fault)) return false;
  PngReader reader(bytes);
  PngHeader again;
  if (!reader.read_head(again, fault)) return false;
  const auto read = [&](auto image) {
    const bool sound = reader.read_pixels(image, fault);
    pixels = std::move(image);
    return sound;
  };
  return header.wide ? read(Image16(header.width, header.height, header.channels))
                     : read(Image8(header.width, header.height, header.channels));
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

}  // namespace tessera
