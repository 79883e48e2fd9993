#include "tests/support/accessibility.h"
#include "tests/support/tests.h"

namespace tessera::test {
namespace {

struct Tool {
  std::filesystem::path script;
  std::string missing;  // why it is
};

const Tool& tool() {
  static const Tool kTool = [] {
    const ProcessResult made =
        run_process({"/usr/bin/env", "bash", TESSERA_SOURCE_DIR "/tests/support/axe.sh", TESSERA_BINARY_DIR "/axe"});
    if (made.status == 77) return Tool{"", made.output};
    if (made.status != 0) throw std::runtime_error("axe.sh: " + made.errors);
    return Tool{made.output, ""};
  }();
  return kTool;
}

// The findings of a script of this folder, in light and dark.
std::vector<std::string> findings_of(const char* script, LivePage& page) {
  const std::string look = read_text(std::string(TESSERA_SOURCE_DIR "/tests/support/") + script);
  std::vector<std::string> findings;
  for (const bool dark : {false, true}) {
    page.prefer_dark(dark);
    for (const std::string finding : page.evaluate(look)) findings.push_back((dark ? "dark: " : "light: ") + finding);
  }
  return findings;
}

}  // namespace

std::string missing_accessibility_tool() { return tool().missing; }

std::vector<std::string> accessibility_findings(LivePage& page) {
  page.evaluate(read_text(tool().script) + "; true");
  return findings_of("accessibility.js", page);
}

std::vector<std::string> layout_findings(LivePage& page) { return findings_of("layout.js", page); }

}  // namespace tessera::test
