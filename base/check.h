#pragma once

#include <cstdint>

namespace tessera {

// Place of the current thread's work; printed when a check fails, so that the failure can be repeated.
struct WorkPlace {
  std::int64_t frame = -1;
  std::int64_t tile = -1;
  std::int64_t base_patch = -1;
};

WorkPlace& current_work_place();

// The program sets this hook. It runs on the thread whose check failed, before that thread aborts, and prints to stderr
// the command that repeats the failure. nullptr, the initial value, prints nothing more.
using FailureHook = void (*)(const WorkPlace& place);
void set_failure_hook(FailureHook hook);

[[noreturn]] void check_failed(const char* condition, const char* file, int line, const char* meaning);

}  // namespace tessera

// A broken invariant is an internal error: print what and where, with the command that repeats it, and abort.
#define TESSERA_CHECK(condition, meaning) \
  (static_cast<bool>(condition) ? void(0) : ::tessera::check_failed(#condition, __FILE__, __LINE__, meaning))
