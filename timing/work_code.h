#pragma once

#include <string>
#include <string_view>

#include "timing/work.h"

namespace tessera::timing {

// A frame's work as bytes. Every number is written in 7-bit groups, least significant first, the eighth bit set in
// all but the last. Members follow in the order of work.h and items.h, events in the order of hardware/events.def,
// each list after its length. A number of a line is stored as the signed difference to the line before, with the sign
// in the lowest bit. Equal work has equal bytes.
//
// Invariants (cited by the tests):
//   WC1  decode(encode(work)) has the bytes of `work` again.
//   WC2  For any bytes, decode() returns work or throws BadWork, and makes no list longer than the remaining bytes.
std::string encode(const FrameWork& work);

struct BadWork {
  const char* reason;
};
FrameWork decode(std::string_view bytes);

}  // namespace tessera::timing
