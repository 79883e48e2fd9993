#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json_fwd.hpp>

#include "scene/gltf/place.h"
#include "scene/limits.h"

namespace tessera::scene::gltf {

// Notes of the reader about a file that it accepts.
//
// Invariants (cited by the tests):
//   NT1  A violation of the specification is a note, or an InputError at its place when reading strictly.
//   NT2  Violations with the same answer make one note: the first of them, and how many there are.
class Notes {
 public:
  explicit Notes(bool strict = false) : strict_(strict) {}

  // Notes a violation of glTF that has only one meaning. `answer` is the reader's way to handle it.
  template <class... Args>
  void violation(const Place& place, std::string_view answer, fmt::format_string<Args...> fault, Args&&... args) {
    const std::string text = fmt::format(fault, std::forward<Args>(args)...);
    if (strict_) place.refuse("{}", text);
    add(place, answer, text);
  }

  // Notes something allowed that people should know; `answer` as for violations.
  void add(const Place& place, std::string_view answer, const std::string& text);

  bool strict() const { return strict_; }

  // The notes so far, one line each.
  std::vector<std::string> lines() const;

 private:
  struct Line {
    std::string text, answer;
    std::size_t count = 1;
  };
  bool strict_;
  std::vector<Line> lines_;
};

// Names of all extensions that a document uses, in its list or in an object, and that supported_extensions() lacks;
// sorted. Members of extras are the application's own and do not count.
//   EC1  One note of the file names every one of them and the object that carries it.
std::vector<std::string> find_unread_extensions(const nlohmann::json& document, const Place& root, MemoryBudget& budget,
                                                Notes& notes);

}  // namespace tessera::scene::gltf
