#pragma once

#include <cstddef>

namespace tessera::bench {

// Peak rates of a thread on the SIMD target in force: seconds of processor time per vector instruction, of
// independent ones on registers. Gathers read random places in 16 KiB, which the first-level cache holds.
struct VectorTimes {
  std::size_t lanes = 0;
  double arithmetic = 0;  // the better of multiply-adds alone, and of mixed sums and products
  double division = 0, root = 0, gather = 0;
};

VectorTimes measure_vector_times();

}  // namespace tessera::bench
