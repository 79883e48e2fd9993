#pragma once

#include <memory>
#include <span>

#include "replay/commands.h"

namespace tessera::replay {

struct CommandEntry {
  const char* name;
  const char* about;
  std::unique_ptr<Command> (*make)(CLI::App& app);
};

// Parses a command line for these commands, runs the one that it names and returns the exit status. Errors become one
// line on the standard error output.
int run_command_line(int argc, char** argv, std::span<const CommandEntry> entries);

}  // namespace tessera::replay
