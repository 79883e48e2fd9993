#pragma once

#include <string>
#include <vector>

#include "tests/support/live_page.h"

namespace tessera::test {

// Reason why axe-core, the tool that looks for barriers, is not available here; "" once npm has installed it
// (axe.sh), once for a build. Throws std::runtime_error where installing fails for another reason than a missing
// registry.
std::string missing_accessibility_tool();

// Barriers that keep a page from levels A and AA of WCAG 2.2, in light and dark, a text each: scheme, rule, selector,
// and the reason or the colours. accessibility.js computes contrasts of drawings, which axe-core leaves open.
std::vector<std::string> accessibility_findings(LivePage& page);

// Faults of a page's layout in its window, in light and dark, a text each: scheme, kind of fault, element, text.
// layout.js says which faults there are. It needs no tool besides the browser.
std::vector<std::string> layout_findings(LivePage& page);

}  // namespace tessera::test
