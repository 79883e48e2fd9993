#include "scene/gltf/notes.h"

#include <algorithm>

#include "base/text.h"

namespace tessera::scene::gltf {

void Notes::add(const Place& place, std::string_view answer, const std::string& text) {
  const auto same = std::find_if(lines_.begin(), lines_.end(), [&](const Line& line) { return line.answer == answer; });
  if (same != lines_.end())
    ++same->count;
  else
    lines_.push_back(
        {place.pointer().empty() ? text : escape_control(place.pointer()) + ": " + text, std::string(answer)});
}

std::vector<std::string> Notes::lines() const {
  std::vector<std::string> out;
  for (const Line& line : lines_)
    out.push_back(line.text + (line.answer.empty() ? "" : "; " + line.answer) +
                  (line.count > 1 ? fmt::format(" (and {} more)", line.count - 1) : ""));
  return out;
}

}  // namespace tessera::scene::gltf
