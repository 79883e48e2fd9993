#pragma once

#include <cstddef>
#include <vector>

namespace tessera {

// Asks the host to back memory with large pages where it has them: the first touch of a large page then costs one page
// fault in place of one for each 4 KiB. Has no effect on other hosts or on small memory.
void prefer_large_pages(void* begin, std::size_t bytes);

// Room for `count` values in such memory. `values` is empty and stays so.
template <class T>
void reserve_in_large_pages(std::vector<T>& values, std::size_t count) {
  values.reserve(count);
  prefer_large_pages(values.data(), count * sizeof(T));
}

}  // namespace tessera
