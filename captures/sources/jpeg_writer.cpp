#include "captures/sources/jpeg_writer.h"

#include "base/error.h"

#define STBI_WRITE_NO_STDIO
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb_image_write.h>

namespace tessera::captures {

std::string encode_jpeg(const Image8& image, int quality) {
  std::string out;
  const auto append = [](void* context, void* data, int size) {
    static_cast<std::string*>(context)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
  };
  if (stbi_write_jpg_to_func(append, &out, image.width, image.height, image.channels, image.values.data(), quality) ==
      0)
    throw SystemError("out of memory while packing a JPEG");
  return out;
}

}  // namespace tessera::captures
