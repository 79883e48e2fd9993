#include "replay/reproduction.h"

#include <cstdio>
#include <utility>

#include <fmt/format.h>

#include "base/check.h"

namespace tessera::replay {
namespace {

// The program runs one command.
std::string& command_line() {
  static std::string text;
  return text;
}

void print_command(const WorkPlace& place) {
  std::string text = "  repeat with: " + command_line();
  if (place.frame >= 0) text += fmt::format(" --frames {}:{}", place.frame, place.frame + 1);
  std::fprintf(stderr, "%s\n", text.c_str());
}

}  // namespace

void repeat_failures_with(std::string command) {
  command_line() = std::move(command);
  set_failure_hook(print_command);
}

}  // namespace tessera::replay
