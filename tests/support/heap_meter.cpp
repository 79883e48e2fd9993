#include "tests/support/heap_meter.h"

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstring>

#ifdef TESSERA_SANITIZED
#include <sanitizer/allocator_interface.h>
#else
#include <malloc.h>
#endif

namespace tessera::test {
namespace {

std::atomic<std::int64_t> live{0}, peak{0}, start{0};

void add(std::size_t bytes) {
  const std::int64_t now =
      live.fetch_add(static_cast<std::int64_t>(bytes), std::memory_order_relaxed) + static_cast<std::int64_t>(bytes);
  std::int64_t highest = peak.load(std::memory_order_relaxed);
  while (now > highest && !peak.compare_exchange_weak(highest, now, std::memory_order_relaxed)) {
  }
}

void remove(std::size_t bytes) { live.fetch_sub(static_cast<std::int64_t>(bytes), std::memory_order_relaxed); }

#ifdef TESSERA_SANITIZED
void on_malloc(const volatile void*, std::size_t bytes) { add(bytes); }
void on_free(const volatile void* block) { remove(__sanitizer_get_allocated_size(const_cast<const void*>(block))); }
#endif

}  // namespace

HeapMeter::HeapMeter() {
#ifdef TESSERA_SANITIZED
  static const int installed = __sanitizer_install_malloc_and_free_hooks(on_malloc, on_free);
  static_cast<void>(installed);
#endif
  start = live.load();
  peak = live.load();
}

std::int64_t HeapMeter::peak_bytes() const { return peak - start; }
std::int64_t HeapMeter::live_bytes() const { return live - start; }

}  // namespace tessera::test

#ifndef TESSERA_SANITIZED
// glibc lets a program bring its own malloc; these count and hand on to glibc's.
extern "C" {

void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

static void* counted(void* block) {
  if (block != nullptr) tessera::test::add(malloc_usable_size(block));
  return block;
}

void* malloc(std::size_t bytes) { return counted(__libc_malloc(bytes)); }
void* calloc(std::size_t count, std::size_t bytes) { return counted(__libc_calloc(count, bytes)); }
void* memalign(std::size_t alignment, std::size_t bytes) { return counted(__libc_memalign(alignment, bytes)); }
void* aligned_alloc(std::size_t alignment, std::size_t bytes) { return counted(__libc_memalign(alignment, bytes)); }
int posix_memalign(void** out, std::size_t alignment, std::size_t bytes) {
  void* const block = counted(__libc_memalign(alignment, bytes));
  if (block == nullptr) return ENOMEM;
  *out = block;
  return 0;
}
void* realloc(void* block, std::size_t bytes) {
  const std::size_t before = block != nullptr ? malloc_usable_size(block) : 0;
  void* const moved = __libc_realloc(block, bytes);
  if (moved == nullptr) {
    if (bytes == 0) tessera::test::remove(before);
    return nullptr;
  }
  // Old and new block exist together while the contents are copied.
  counted(moved);
  tessera::test::remove(before);
  return moved;
}
void free(void* block) {
  if (block != nullptr) tessera::test::remove(malloc_usable_size(block));
  __libc_free(block);
}

}  // extern "C"
#endif
