#pragma once

#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace CLI {
class App;
}

namespace tessera::replay {

// Topics of `tessera describe`: counters, settings, gpu, extensions, formats, effects.
const std::vector<std::string>& describe_topics();

// All rows of a topic as JSON. Throws UsageError for a topic that does not exist.
nlohmann::json describe_json(const std::string& topic);

// The same as text for a terminal, and as a Markdown page of docs/.
std::string describe_text(const std::string& topic);
std::string describe_markdown(const std::string& topic);

// Scripts and pages about the program's commands and options, made from the same tables that parse the command line.
// `program` is the App that has the commands.

// Exit statuses and their meanings, in order.
const std::vector<std::pair<int, const char*>>& exit_statuses();

// Scripts that complete command lines: commands, options, words that an option takes, presets, keys of --set with their
// words, files.
std::string bash_completion(const CLI::App& program);
std::string zsh_completion(const CLI::App& program);

// tessera(1), in the man macros of roff.
std::string manual_page(const CLI::App& program);

}  // namespace tessera::replay
