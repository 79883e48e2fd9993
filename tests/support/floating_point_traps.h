#pragma once

#include <cfenv>

namespace tessera::test {

// While it lives, an invalid operation or a division by zero on this thread ends the program with SIGFPE. For kernels
// whose headers promise to raise neither (glibc; the flags as IEEE 754 defines them, so inexact, underflow and overflow
// pass).
class FloatingPointTraps {
 public:
  FloatingPointTraps() {
    std::feclearexcept(FE_ALL_EXCEPT);
    before_ = feenableexcept(FE_INVALID | FE_DIVBYZERO);
  }
  ~FloatingPointTraps() {
    std::feclearexcept(FE_ALL_EXCEPT);
    fedisableexcept(FE_ALL_EXCEPT);
    feenableexcept(before_);
  }
  FloatingPointTraps(const FloatingPointTraps&) = delete;
  FloatingPointTraps& operator=(const FloatingPointTraps&) = delete;

  // Clang moves floating-point operations in front of the branches that guard them unless an option forbids it; a
  // build by Clang keeps results, not flags.
#ifdef __clang__
  static constexpr bool kTheCompilerKeepsFlags = false;
#else
  static constexpr bool kTheCompilerKeepsFlags = true;
#endif

 private:
  int before_ = 0;
};

}  // namespace tessera::test
