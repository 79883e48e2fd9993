#include "base/check.h"

#include <atomic>
#include <cstdio>
#include <cstdlib>

#include <fmt/format.h>

namespace tessera {
namespace {

std::atomic<FailureHook> failure_hook{nullptr};

}  // namespace

WorkPlace& current_work_place() {
  thread_local WorkPlace place;
  return place;
}

void set_failure_hook(FailureHook hook) { failure_hook = hook; }

void check_failed(const char* condition, const char* file, int line, const char* meaning) {
  const WorkPlace& place = current_work_place();
  std::string text = fmt::format("tessera: broken invariant: {} ({}) at {}:{}\n", meaning, condition, file, line);
  text += fmt::format("  frame {}, tile {}, base patch {}", place.frame, place.tile, place.base_patch);
  std::fprintf(stderr, "%s\n", text.c_str());
  if (const FailureHook hook = failure_hook) hook(place);
  std::abort();
}

}  // namespace tessera
