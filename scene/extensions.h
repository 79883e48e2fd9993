#pragma once

#include <string_view>
#include <vector>

namespace tessera::scene {

// A member of one of Tessera's own extensions.
struct ExtensionMember {
  std::string_view name, type, unit, default_value, meaning;
};

// A glTF extension that the reader understands. For Tessera's own the members are listed here, and docs/extensions
// holds a page and a JSON schema.
struct Extension {
  std::string_view name;
  std::string_view extends;  // the glTF object that carries it
  std::string_view meaning;
  std::vector<ExtensionMember> members;  // empty for Khronos extensions
};

const std::vector<Extension>& supported_extensions();

}  // namespace tessera::scene
