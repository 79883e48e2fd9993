#pragma once

#include <cstddef>
#include <vector>

namespace tessera {

// Asks the host to back memory with large pages where it has them; what is touched for the first time then costs one
// page fault for each of these, not for each 4 KiB. No effect otherwise, nor on small memory.
void prefer_large_pages(void* begin, std::size_t bytes);

// Room for `count` values in such memory. `values` is empty and stays so.
template <class T>
void reserve_in_large_pages(std::vector<T>& values, std::size_t count) {
  values.reserve(count);
  prefer_large_pages(values.data(), count * sizeof(T));
}

}  // namespace tessera
