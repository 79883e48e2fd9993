#include "base/zstd_bytes.h"

#include <zstd.h>

#include "base/check.h"

namespace tessera {
namespace {

constexpr int kLevel = 3;

}  // namespace

std::string zstd_compress(std::string_view bytes) {
  std::string out(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kLevel);
  TESSERA_CHECK(!ZSTD_isError(size), "the bound is enough");
  out.resize(size);
  return out;
}

std::string zstd_expand(std::string_view frame, std::uint64_t size) {
  std::string out(size, '\0');
  const std::size_t got = ZSTD_decompress(out.data(), out.size(), frame.data(), frame.size());
  if (ZSTD_isError(got) || got != size) throw BadZstd{};
  return out;
}

}  // namespace tessera
