#pragma once

#include <cstdint>
#include <string>

namespace tessera {

// What the current thread is working on; printed when a check fails, so that the failure can be repeated.
struct WorkPlace {
  std::int64_t frame = -1;
  std::int64_t tile = -1;
  std::int64_t base_patch = -1;
};

WorkPlace& current_work_place();

// The command line that repeats this run, without --frames and --region; set once by the program.
void set_reproduction_command(std::string command);

[[noreturn]] void check_failed(const char* condition, const char* file, int line, const char* meaning);

}  // namespace tessera

// A broken invariant is an internal error: print what and where, with the command that repeats it, and abort.
#define TESSERA_CHECK(condition, meaning) \
  (static_cast<bool>(condition) ? void(0) : ::tessera::check_failed(#condition, __FILE__, __LINE__, meaning))
