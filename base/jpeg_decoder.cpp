#include "base/jpeg_decoder.h"

#include <algorithm>
#include <array>
#include <memory>

#include <fmt/format.h>
#include <turbojpeg.h>

#include "base/error.h"

namespace tessera {
namespace {

struct Close {
  void operator()(void* decoder) const { tjDestroy(decoder); }
};

std::unique_ptr<void, Close> open_decoder() {
  std::unique_ptr<void, Close> decoder(tjInitDecompress());
  if (!decoder) throw SystemError("out of memory while unpacking a JPEG");
  return decoder;
}

bool refuse(void* decoder, std::string& fault) {
  return fault = fmt::format("cannot be decoded ({})", tjGetErrorStr2(decoder)), false;
}

// Whether a segment before the first scan is Adobe's (APP14). Segments that reach past the end end the search.
bool has_adobe_marker(std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 5> kName = {'A', 'd', 'o', 'b', 'e'};
  for (std::size_t at = 2; at + 4 <= bytes.size() && bytes[at] == 0xFF;) {
    const std::uint8_t marker = bytes[at + 1];
    if (marker == 0xFF) {
      ++at;
      continue;
    }
    if (marker == 0xDA) return false;
    const std::size_t length = (std::size_t{bytes[at + 2]} << 8) | bytes[at + 3];
    if (marker == 0xEE && length >= 12 && at + 2 + length <= bytes.size() &&
        std::equal(kName.begin(), kName.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at) + 4))
      return true;
    at += 2 + length;
  }
  return false;
}

Image8 rgb_from_cmyk(const Image8& cmyk, bool inverted) {
  Image8 rgb(cmyk.width, cmyk.height, 3);
  const std::uint8_t flip = inverted ? 0 : 255;
  for (std::size_t pixel = 0; pixel < cmyk.values.size() / 4; ++pixel)
    for (std::size_t c = 0; c < 3; ++c) {
      const int through = (cmyk.values[4 * pixel + c] ^ flip) * (cmyk.values[4 * pixel + 3] ^ flip);
      rgb.values[3 * pixel + c] = static_cast<std::uint8_t>((through + 127) / 255);
    }
  return rgb;
}

}  // namespace

bool read_jpeg_header(std::span<const std::uint8_t> bytes, JpegHeader& header, std::string& fault) {
  const auto decoder = open_decoder();
  int subsampling = 0, colors = 0;
  if (tjDecompressHeader3(decoder.get(), bytes.data(), static_cast<unsigned long>(bytes.size()), &header.width,
                          &header.height, &subsampling, &colors) != 0)
    return refuse(decoder.get(), fault);
  header.channels = colors == TJCS_GRAY ? 1 : 3;
  header.stored_channels = colors == TJCS_CMYK || colors == TJCS_YCCK ? 4 : header.channels;
  header.inverted = header.stored_channels == 4 && has_adobe_marker(bytes);
  return true;
}

bool decode_jpeg(std::span<const std::uint8_t> bytes, const JpegHeader& header, Image8& image, std::string& fault) {
  const auto decoder = open_decoder();
  const int formats[] = {0, TJPF_GRAY, 0, TJPF_RGB, TJPF_CMYK};
  image = Image8(header.width, header.height, header.stored_channels);
  const int flags = TJFLAG_ACCURATEDCT | TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS;
  if (tjDecompress2(decoder.get(), bytes.data(), static_cast<unsigned long>(bytes.size()), image.values.data(),
                    header.width, 0, header.height, formats[header.stored_channels], flags) != 0)
    return refuse(decoder.get(), fault);
  if (header.stored_channels == 4) image = rgb_from_cmyk(image, header.inverted);
  return true;
}

}  // namespace tessera
