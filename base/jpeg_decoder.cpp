#include "base/jpeg_decoder.h"

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

}  // namespace

bool read_jpeg_header(std::span<const std::uint8_t> bytes, JpegHeader& header, std::string& fault) {
  const auto decoder = open_decoder();
  int subsampling = 0, colors = 0;
  if (tjDecompressHeader3(decoder.get(), bytes.data(), static_cast<unsigned long>(bytes.size()), &header.width,
                          &header.height, &subsampling, &colors) != 0)
    return refuse(decoder.get(), fault);
  if (colors == TJCS_CMYK || colors == TJCS_YCCK)
    return fault = "JPEG has four channels (CMYK), of which no texture can be made", false;
  header.channels = colors == TJCS_GRAY ? 1 : 3;
  return true;
}

bool decode_jpeg(std::span<const std::uint8_t> bytes, const JpegHeader& header, Image8& image, std::string& fault) {
  const auto decoder = open_decoder();
  image = Image8(header.width, header.height, header.channels);
  const int flags = TJFLAG_ACCURATEDCT | TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS;
  if (tjDecompress2(decoder.get(), bytes.data(), static_cast<unsigned long>(bytes.size()), image.values.data(),
                    header.width, 0, header.height, header.channels == 1 ? TJPF_GRAY : TJPF_RGB, flags) != 0)
    return refuse(decoder.get(), fault);
  return true;
}

}  // namespace tessera
