#pragma once

#include <string>
#include <string_view>

#include "timing/work.h"

namespace tessera::timing {

// A frame's work as bytes: every number in 7-bit groups, least significant first, the eighth bit set in all but the last,
// in the order of the declarations in work.h and items.h, events in the order of hardware/events.def; lists behind their
// lengths. Numbers of lines are signed
// differences to the line before, the sign in the lowest bit. Equal work has equal bytes.
//
// Invariants (cited by the tests):
//   WC1  decode(encode(work)) has the bytes of `work` again.
//   WC2  Whatever the bytes, decode() returns work or throws BadWork, and makes no list longer than the bytes that are left.
std::string encode(const FrameWork& work);

struct BadWork {
  const char* reason;
};
FrameWork decode(std::string_view bytes);

}  // namespace tessera::timing
