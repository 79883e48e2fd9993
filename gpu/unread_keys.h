#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "gpu/configuration.h"

namespace tessera::gpu {

// Says why a machine's models do not read a key, and which key to set instead; "" for keys that act.
std::string_view unread_because(const GpuConfiguration& gpu, std::string_view key);

// Notes for people about the machine: keys that were set by a former name, and keys of a file that its models do not read.
std::vector<std::string> configuration_notes(const GpuConfiguration& gpu);

}  // namespace tessera::gpu
