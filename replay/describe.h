#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace tessera::replay {

// Topics of `tessera describe`: counters, settings, gpu, extensions, formats, effects.
const std::vector<std::string>& describe_topics();

// All rows of a topic as JSON. Throws UsageError for a topic that does not exist.
nlohmann::json describe_json(const std::string& topic);

// The same as text for a terminal, and as the Markdown page that docs/ holds.
std::string describe_text(const std::string& topic);
std::string describe_markdown(const std::string& topic);

}  // namespace tessera::replay
