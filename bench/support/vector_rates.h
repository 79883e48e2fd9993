#pragma once

#include <cstddef>

namespace tessera::bench {

// What a thread reaches at most on the SIMD target in force: seconds of its processor time per vector instruction, of
// independent ones on registers; gathers read 16 KiB, which the first cache holds, at random places.
struct VectorTimes {
  std::size_t lanes = 0;
  double arithmetic = 0;  // the best of multiply-adds alone and sums and products mixed
  double division = 0, root = 0, gather = 0;
};

VectorTimes measure_vector_times();

}  // namespace tessera::bench
