#pragma once

#include <filesystem>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json_fwd.hpp>

#include "scene/gltf/document.h"
#include "scene/gltf/notes.h"
#include "scene/gltf/place.h"

namespace tessera::scene::gltf {

// The audit looks for breaches of glTF on which no image depends: the Khronos glTF validator calls them errors, and the
// reader has no need to look at them. A violation is a note that has the validator's name for it, or a refusal when
// reading strictly.
//
// Invariants (cited by the tests):
//   AU1  Strict reading refuses every error of the validator, unless validator_codes() says that it is not checked.
//   AU2  An audit changes no part of the capture.

// Notes a violation under the validator's name for it.
template <class... Args>
void forbid(Notes& notes, const Place& place, std::string_view code, fmt::format_string<Args...> fault,
            Args&&... args) {
  notes.violation(place, fmt::format("the glTF validator calls it {}", code), "{}",
                  fmt::format(fault, std::forward<Args>(args)...));
}

// Audits the structure: breaches that show in the JSON alone. `document` passed check_schema() and validate_links().
void audit_document(const nlohmann::json& document, const Place& root, Notes& notes);

// Audits the contents: values of accessors that have data, against their bounds and their users; files that the
// document names. Values of Draco streams are not checked.
void audit_contents(Document& document, const std::filesystem::path& file);

// The reader's answer to a code of severity "error" of the validator.
enum class Answer { kRefused, kStrict, kNotChecked };
struct ValidatorCode {
  std::string_view code;
  Answer answer;
};
// All such codes, sorted by name (glTF-Validator 2.0.0-dev.3.10, ISSUES.md).
const std::vector<ValidatorCode>& validator_codes();

}  // namespace tessera::scene::gltf
