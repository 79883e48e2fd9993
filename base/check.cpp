#include "base/check.h"

#include <cstdio>
#include <cstdlib>
#include <utility>

#include <fmt/format.h>

namespace tessera {
namespace {

std::string& reproduction_command() {
  static std::string command = "tessera replay CAPTURE";
  return command;
}

}  // namespace

WorkPlace& current_work_place() {
  thread_local WorkPlace place;
  return place;
}

void set_reproduction_command(std::string command) { reproduction_command() = std::move(command); }

void check_failed(const char* condition, const char* file, int line, const char* meaning) {
  const WorkPlace& place = current_work_place();
  std::string text = fmt::format("tessera: broken invariant: {} ({}) at {}:{}\n", meaning, condition, file, line);
  text += fmt::format("  frame {}, tile {}, base patch {}\n", place.frame, place.tile, place.base_patch);
  text += fmt::format("  repeat with: {}", reproduction_command());
  if (place.frame >= 0) text += fmt::format(" --frames {}:{}", place.frame, place.frame + 1);
  std::fprintf(stderr, "%s\n", text.c_str());
  std::abort();
}

}  // namespace tessera
