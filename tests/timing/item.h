#pragma once

#include <initializer_list>
#include <utility>

#include "timing/items.h"

namespace tessera::timing {

// `rest` with these events and their counts.
inline SubPatchItem item(std::initializer_list<std::pair<Event, std::uint32_t>> events, SubPatchItem rest = {}) {
  for (const auto& [event, count] : events) rest[event] = count;
  return rest;
}

}  // namespace tessera::timing
