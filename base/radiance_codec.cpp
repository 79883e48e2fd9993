#include "base/radiance_codec.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "base/error.h"
#include "base/exr_file.h"

namespace tessera {
namespace {

using Bytes = std::span<const std::uint8_t>;
using Rgbe = std::array<std::uint8_t, 4>;

bool starts_with(Bytes bytes, std::string_view text) {
  return bytes.size() >= text.size() && std::memcmp(bytes.data(), text.data(), text.size()) == 0;
}

// ---- RGBE -------------------------------------------------------------------------------------------------------

struct HdrHead {
  int width = 0, height = 0;
  bool from_bottom = false;
  std::size_t pixels = 0;  // where they begin
};

// A line without its end, taken off `rest`; false: there is none.
bool take_line(std::string_view& rest, std::string_view& line) {
  const std::size_t end = rest.find('\n');
  if (end == std::string_view::npos) return false;
  line = rest.substr(0, end);
  rest.remove_prefix(end + 1);
  return true;
}

// "-Y 512 +X 1024".
bool read_resolution(std::string_view line, HdrHead& head) {
  const auto number = [&](std::string_view axis, int& value) {
    if (!line.starts_with(axis)) return false;
    line.remove_prefix(axis.size());
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), value);
    line.remove_prefix(static_cast<std::size_t>(end - line.data()));
    return error == std::errc() && value > 0;
  };
  head.from_bottom = line.starts_with("+Y ");
  return number(head.from_bottom ? "+Y " : "-Y ", head.height) && number(" +X ", head.width) && line.empty();
}

bool read_hdr_head(Bytes bytes, HdrHead& head, std::string& fault) {
  // Long enough for the comments of any writer.
  constexpr std::size_t kLongestHead = 1 << 16;
  std::string_view rest(reinterpret_cast<const char*>(bytes.data()), std::min(bytes.size(), kLongestHead)), line;
  const std::size_t size = rest.size();
  while (true) {
    if (!take_line(rest, line)) return fault = "ends inside its header", false;
    if (line.empty()) break;
    if (line.starts_with("FORMAT=") && line != "FORMAT=32-bit_rle_rgbe")
      return fault = "has colours that are not 32-bit_rle_rgbe", false;
  }
  if (!take_line(rest, line)) return fault = "ends inside its header", false;
  if (!read_resolution(line, head)) return fault = "has a resolution other than -Y height +X width", false;
  head.pixels = size - rest.size();
  return true;
}

// Pixels one after the other.
class RgbeReader {
 public:
  explicit RgbeReader(Bytes bytes) : rest_(bytes) {}

  // False: the file ends early, or its rows are of another length than it says.
  bool read_row(std::vector<Rgbe>& row) {
    // The encoding by channels marks each row by its length, which no colour of a flat row may look like.
    const bool by_channels = row.size() >= 8 && row.size() < 1 << 15 && rest_.size() >= 4 && rest_[0] == 2 &&
                             rest_[1] == 2 && rest_[2] < 128;
    return by_channels ? read_channels(row) : read_pixels(row);
  }

 private:
  bool read_channels(std::vector<Rgbe>& row) {
    if (static_cast<std::size_t>(rest_[2] << 8 | rest_[3]) != row.size()) return false;
    rest_ = rest_.subspan(4);
    for (std::size_t channel = 0; channel < 4; ++channel)
      for (std::size_t x = 0; x < row.size();) {
        if (rest_.size() < 2) return false;
        const std::size_t code = rest_[0], count = code > 128 ? code - 128 : code, taken = code > 128 ? 2 : 1 + count;
        if (count == 0 || count > row.size() - x || taken > rest_.size()) return false;
        for (std::size_t k = 0; k < count; ++k) row[x++][channel] = rest_[code > 128 ? 1 : 1 + k];
        rest_ = rest_.subspan(taken);
      }
    return true;
  }

  // Flat, where (1, 1, 1, n) repeats the pixel before, n in digits of base 256 from the lowest one on.
  bool read_pixels(std::vector<Rgbe>& row) {
    int digit = 0;
    for (std::size_t x = 0; x < row.size();) {
      if (rest_.size() < 4) return false;
      const Rgbe pixel = {rest_[0], rest_[1], rest_[2], rest_[3]};
      rest_ = rest_.subspan(4);
      if (pixel[0] != 1 || pixel[1] != 1 || pixel[2] != 1) {
        row[x++] = pixel, digit = 0;
        continue;
      }
      if (x == 0 || digit > 2) return false;
      const std::size_t count = std::size_t{pixel[3]} << (8 * digit++);
      if (count > row.size() - x) return false;
      std::fill_n(row.begin() + static_cast<std::ptrdiff_t>(x), count, Rgbe(row[x - 1]));
      x += count;
    }
    return true;
  }

  Bytes rest_;
};

bool decode_hdr(Bytes bytes, const ImageLimits& limits, Image& image, std::string& fault, const ChargeBytes& charge) {
  HdrHead head;
  if (!read_hdr_head(bytes, head, fault)) return false;
  const std::uint64_t pixels = static_cast<std::uint64_t>(head.width) * static_cast<std::uint64_t>(head.height);
  if (head.width > limits.max_side || head.height > limits.max_side || pixels > limits.max_pixels)
    throw LimitError(fmt::format("{}x{} pixels exceed the limit of {} a side and {} in all", head.width, head.height,
                                 limits.max_side, limits.max_pixels));
  // Four bytes make at most a row.
  if (static_cast<std::uint64_t>(head.height) * 4 > bytes.size() - head.pixels)
    return fault = fmt::format("of {}x{} pixels cannot fit {} bytes", head.width, head.height, bytes.size()), false;
  if (charge) charge(pixels * 3 * sizeof(float) + static_cast<std::uint64_t>(head.width) * sizeof(Rgbe));
  image = Image(head.width, head.height, 3);
  RgbeReader reader(bytes.subspan(head.pixels));
  std::vector<Rgbe> row(static_cast<std::size_t>(head.width));
  for (int y = 0; y < head.height; ++y) {
    if (!reader.read_row(row)) return fault = fmt::format("has a broken row {}, or ends there", y), false;
    float* to = image.at(0, head.from_bottom ? head.height - 1 - y : y).data();
    for (const Rgbe& pixel : row)
      for (std::size_t c = 0; c < 3; ++c)
        *to++ = pixel[3] == 0 ? 0.0f : std::ldexp(static_cast<float>(pixel[c]), pixel[3] - 136);
  }
  return true;
}

}  // namespace

RadianceFormat radiance_format(Bytes bytes) {
  if (starts_with(bytes, "\x76\x2f\x31\x01")) return RadianceFormat::kExr;
  return starts_with(bytes, "#?") ? RadianceFormat::kHdr : RadianceFormat::kUnknown;
}

const char* mime_type(RadianceFormat format) {
  return format == RadianceFormat::kExr ? "image/x-exr" : format == RadianceFormat::kHdr ? "image/vnd.radiance" : "";
}

bool decode_radiance(Bytes bytes, const ImageLimits& limits, Image& image, std::string& fault,
                     const ChargeBytes& charge) {
  switch (radiance_format(bytes)) {
    case RadianceFormat::kExr:
      return decode_exr(bytes, limits, image, fault, charge);
    case RadianceFormat::kHdr:
      return decode_hdr(bytes, limits, image, fault, charge);
    case RadianceFormat::kUnknown:
      break;
  }
  return fault = "is neither OpenEXR nor Radiance HDR", false;
}

}  // namespace tessera
