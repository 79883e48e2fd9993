#pragma once

#include <string_view>
#include <vector>

namespace tessera::scene {

// An extension of the Khronos registry of glTF 2.0, ratified or not.
struct RegisteredExtension {
  std::string_view name;
  std::string_view status;   // in the registry
  std::string_view meaning;  // read: what of it; else what an image lacks where a file uses it
  std::string_view test;     // suite of the tests that show what is read; empty for what is not
  bool read() const { return !test.empty(); }
};

// Those that it lists, and drafts among its pull requests that exporters write, by status and name. What is not read is named in a note where a file uses it, and refuses files that
// require it.
const std::vector<RegisteredExtension>& extension_registry();

}  // namespace tessera::scene
