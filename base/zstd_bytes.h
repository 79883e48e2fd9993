#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace tessera {

// One Zstandard frame of bytes, the same on every host.
std::string zstd_compress(std::string_view bytes);

// Decompresses a frame. `size` is the size of the result in bytes, which the caller has bounded. Throws BadZstd where
// `frame` is not a frame of exactly so many bytes.
struct BadZstd {};
std::string zstd_expand(std::string_view frame, std::uint64_t size);

}  // namespace tessera
