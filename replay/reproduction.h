#pragma once

#include <string>

namespace tessera::replay {

// From now on a failed check also prints the command line that repeats this run: `command`, which goes without
// --frames, and the frame in hand.
void repeat_failures_with(std::string command);

}  // namespace tessera::replay
