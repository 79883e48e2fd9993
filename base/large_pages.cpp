#include "base/large_pages.h"

#ifdef __linux__
#include <sys/mman.h>

#include <cstdint>
#endif

namespace tessera {

void prefer_large_pages([[maybe_unused]] void* begin, [[maybe_unused]] std::size_t bytes) {
#ifdef __linux__
  constexpr std::uintptr_t kPage = 4096, kLargePage = 2u << 20;
  if (bytes < kLargePage) return;
  // Whole pages within.
  const auto first = reinterpret_cast<std::uintptr_t>(begin), low = (first + kPage - 1) & ~(kPage - 1),
             high = (first + bytes) & ~(kPage - 1);
  if (low < high) madvise(reinterpret_cast<void*>(low), high - low, MADV_HUGEPAGE);  // advice: may be refused
#endif
}

}  // namespace tessera
