#pragma once

#include <string>
#include <utility>
#include <vector>

namespace CLI {
class App;
}

namespace tessera::replay {

// What the program's commands and options say of themselves, as scripts and pages. All are made from the same tables that
// parse the command line. `program`: the App that has the commands.

// Exit statuses and what they mean, in order.
const std::vector<std::pair<int, const char*>>& exit_statuses();

// Scripts that complete command lines: commands, options, words that an option takes, presets, keys of --set with their
// words, files.
std::string bash_completion(const CLI::App& program);
std::string zsh_completion(const CLI::App& program);

// tessera(1), in the man macros of roff.
std::string manual_page(const CLI::App& program);

}  // namespace tessera::replay
