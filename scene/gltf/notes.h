#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "scene/gltf/place.h"

namespace tessera::scene::gltf {

// What the reader tells people about a file that it reads all the same.
//
// Invariants (cited by the tests):
//   NT1  A violation of the specification is a note, or an InputError at its place when reading strictly.
//   NT2  Violations that are answered alike make one note: the first of them, and how many there are.
class Notes {
 public:
  explicit Notes(bool strict = false) : strict_(strict) {}

  // What glTF forbids although it has one meaning. `answer`: what the reader does about it.
  template <class... Args>
  void violation(const Place& place, std::string_view answer, fmt::format_string<Args...> fault, Args&&... args) {
    const std::string text = fmt::format(fault, std::forward<Args>(args)...);
    if (strict_) place.refuse("{}", text);
    add(place, answer, text);
  }

  // What is allowed, and yet people should know; `answer` as for violations.
  void add(const Place& place, std::string_view answer, const std::string& text);

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

}  // namespace tessera::scene::gltf
