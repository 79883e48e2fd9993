#pragma once

#include <cstdint>

namespace tessera {

// What the current thread is working on; printed when a check fails, so that the failure can be repeated.
struct WorkPlace {
  std::int64_t frame = -1;
  std::int64_t tile = -1;
  std::int64_t base_patch = -1;
};

WorkPlace& current_work_place();

// Called on the thread whose check failed, before it aborts, to say on stderr what only the program knows: the command
// that repeats it. The program sets it; null, as it starts: nobody has more to say.
using FailureHook = void (*)(const WorkPlace& place);
void set_failure_hook(FailureHook hook);

[[noreturn]] void check_failed(const char* condition, const char* file, int line, const char* meaning);

}  // namespace tessera

// A broken invariant is an internal error: print what and where, with the command that repeats it, and abort.
#define TESSERA_CHECK(condition, meaning) \
  (static_cast<bool>(condition) ? void(0) : ::tessera::check_failed(#condition, __FILE__, __LINE__, meaning))
