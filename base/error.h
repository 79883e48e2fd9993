#pragma once

#include <tessera/error.h>

namespace tessera {

// Exit statuses of the program (fixed; scripts rely on them).
enum class ExitStatus : int {
  kDone = 0,
  kInternal = 1,
  kUsage = 2,
  kBadInput = 3,
  kLimit = 4,
  kDifferent = 5,
  kCannotWrite = 6,
  kStopped = 130
};

}  // namespace tessera
