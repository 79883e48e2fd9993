#pragma once

#include <string_view>
#include <vector>

namespace tessera::scene {

// A member of one of Tessera's own extensions.
struct ExtensionMember {
  std::string_view name, type, unit, default_value, meaning;
};

// A glTF extension: one of Tessera's own, for which docs/extensions holds a page and a JSON schema, or one of the Khronos
// registry of glTF 2.0, ratified or not.
struct Extension {
  std::string_view name;
  std::string_view extends;  // the glTF object that carries it; empty for what is not read
  std::string_view meaning;
  std::vector<ExtensionMember> members = {};  // empty for registered extensions
  std::string_view status = {};               // in the registry; empty for Tessera's own
  std::string_view treatment = {};            // how much of it is read; else what an image lacks where a file uses it
  std::string_view test = {};                 // suite of the tests that show what is read; empty for what is not

  bool read() const { return status.empty() || !test.empty(); }
};

// All that the reader understands, by name.
const std::vector<Extension>& supported_extensions();

// All that the registry lists, and drafts among its pull requests that exporters write, by status and name. What is not
// read is named in a note where a file uses it, and refuses files that require it.
const std::vector<Extension>& extension_registry();

}  // namespace tessera::scene
