#pragma once

#include <cstdint>

namespace tessera::baselines {

// What the list of a tile, or of a bin, makes its core do.
struct ListWork {
  std::uint64_t entries = 0;                   // references read
  std::uint64_t triangles = 0;                 // set up to be tested
  std::uint64_t vertices = 0, transforms = 0;  // shaded again; taken from the cache and put through their motion
  std::uint64_t bytes = 0;                     // of the list and what it leads to, over the external memory interface
  std::uint64_t cache_bytes = 0;               // asked of caches behind that interface, and filled into them
};

}  // namespace tessera::baselines
