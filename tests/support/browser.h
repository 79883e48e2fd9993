#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tessera::test {

// A page as Chromium without a window shows it.
struct OpenedPage {
  std::string dom;      // the document once its scripts are done, as markup
  std::string console;  // lines of the page's or the browser's console: errors of scripts, failed requests
};

// Whether there is a Chromium that can open pages; tests skip without it.
bool has_browser();

// Opens a file. `fragment` follows the "#"; `dark` sets the page's preferred color scheme.
OpenedPage open_page(const std::filesystem::path& file, const std::string& fragment = "", bool dark = false);

// An image of the page's upper left, as PNG bytes.
std::string photograph_page(const std::filesystem::path& file, int width, int height, const std::string& fragment = "",
                            bool dark = false);

// Text of attribute `name` of the body, or "".
std::string body_attribute(const OpenedPage& page, const std::string& name);

}  // namespace tessera::test
