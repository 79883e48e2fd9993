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
  std::string_view extends;  // the glTF object that carries it; empty for unread extensions
  std::string_view meaning;
  std::vector<ExtensionMember> members = {};  // empty for registered extensions
  std::string_view status = {};               // in the registry; empty for Tessera's own
  std::string_view treatment = {};  // how much of it is read; for unread extensions, the parts that an image lacks
  std::string_view test = {};       // suite of the tests that show it; empty for unread extensions

  bool read() const { return status.empty() || !test.empty(); }
};

// All extensions that the reader understands, by name.
const std::vector<Extension>& supported_extensions();

// All extensions in the registry, and drafts among its pull requests that exporters write, by status and name. Where a
// file uses an unread extension, a note names it; a file that requires one is refused.
const std::vector<Extension>& extension_registry();

}  // namespace tessera::scene
