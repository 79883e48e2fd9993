#pragma once

#include <string>
#include <vector>

namespace tessera {

// Name of the instruction set that dispatched kernels use now: "AVX3" (AVX-512), "AVX2", "EMU128" or "SCALAR".
std::string simd_target_name();

// Every instruction set that this binary holds kernels for and this machine can run, best first.
std::vector<std::string> simd_target_names();

// Makes all kernels use the named instruction set; "" gives back the best. For tests and benchmarks.
// Throws UsageError for a name that simd_target_names() does not list.
void force_simd_target(const std::string& name);

}  // namespace tessera
