#include "tests/support/browser.h"
#include "tests/support/tests.h"

namespace tessera::test {
namespace {

constexpr const char* kChromium = "/usr/bin/chromium";

// --no-sandbox: tests may run as root, where Chromium refuses its sandbox; the pages are ours and fetch nothing.
ProcessResult run_browser(const std::vector<std::string>& what, const std::filesystem::path& file,
                          const std::string& fragment, bool dark) {
  const TemporaryFolder profile;
  std::vector<std::string> arguments = {kChromium,
                                        "--headless",
                                        "--no-sandbox",
                                        "--disable-gpu",
                                        "--disable-dev-shm-usage",
                                        "--hide-scrollbars",
                                        "--user-data-dir=" + profile.path().string(),
                                        "--virtual-time-budget=60000",
                                        "--enable-logging=stderr",
                                        std::string("--blink-settings=preferredColorScheme=") + (dark ? "0" : "1")};
  arguments.insert(arguments.end(), what.begin(), what.end());
  arguments.push_back("file://" + file.string() + (fragment.empty() ? "" : "#" + fragment));
  return run_process(arguments, {.seconds = 120});
}

}  // namespace

bool has_browser() { return std::filesystem::exists(kChromium); }

OpenedPage open_page(const std::filesystem::path& file, const std::string& fragment, bool dark) {
  const ProcessResult r = run_browser({"--dump-dom"}, file, fragment, dark);
  OpenedPage page;
  page.dom = r.output;
  std::istringstream lines(r.errors);
  for (std::string line; std::getline(lines, line);)
    if (line.find("CONSOLE") != std::string::npos) page.console += line + "\n";
  return page;
}

std::string photograph_page(const std::filesystem::path& file, int width, int height, const std::string& fragment,
                            bool dark) {
  const TemporaryFolder folder;
  run_browser({"--window-size=" + std::to_string(width) + "," + std::to_string(height),
               "--screenshot=" + (folder / "page.png").string()},
              file, fragment, dark);
  return read_text(folder / "page.png");
}

std::string body_attribute(const OpenedPage& page, const std::string& name) {
  const std::size_t body = page.dom.find("<body");
  if (body == std::string::npos) return "";
  const std::string tag = page.dom.substr(body, page.dom.find('>', body) - body), key = " " + name + "=\"";
  const std::size_t at = tag.find(key);
  return at == std::string::npos ? "" : tag.substr(at + key.size(), tag.find('"', at + key.size()) - at - key.size());
}

}  // namespace tessera::test
