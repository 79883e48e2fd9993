#pragma once

#include <string>

#include "base/image.h"

namespace tessera::captures {

// JPEG bytes of an 8-bit image with 1 or 3 channels (grey counts as three); quality 1 to 100. It must be stb's
// writer, as another one would make other captures.
std::string encode_jpeg(const Image8& image, int quality);

}  // namespace tessera::captures
