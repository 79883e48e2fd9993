#pragma once

#include <string>
#include <vector>

namespace tessera::fuzz {

// Captures of a few kilobytes that load: everything that the reader knows, all sorts of surfaces, and parts of the
// shipped captures.
std::vector<std::string> small_captures();

}  // namespace tessera::fuzz
