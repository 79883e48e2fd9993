#pragma once

#include <cstdint>

namespace tessera::test {

// Measures the program's bytes on the heap, malloc included, in all threads. A program that uses it lists
// heap_meter.cpp among its own sources: that file replaces malloc.
class HeapMeter {
 public:
  HeapMeter();  // starts measuring at zero; one meter at a time

  std::int64_t peak_bytes() const;  // most bytes that were allocated at once
  std::int64_t live_bytes() const;  // allocated since the start and not yet freed
};

}  // namespace tessera::test
