#include "tests/support/live_page.h"
#include "tests/support/tests.h"

namespace tessera::test {
namespace {

// The flags of browser.cpp, and the pipe.
std::vector<std::string> browser_arguments(const std::string& profile, int width, int height,
                                           const std::vector<std::string>& flags) {
  std::vector<std::string> arguments = {"/usr/bin/chromium",
                                        "--headless",
                                        "--no-sandbox",
                                        "--disable-gpu",
                                        "--disable-dev-shm-usage",
                                        "--hide-scrollbars",
                                        "--no-first-run",
                                        "--user-data-dir=" + profile,
                                        "--window-size=" + std::to_string(width) + "," + std::to_string(height),
                                        "--remote-debugging-pipe"};
  arguments.insert(arguments.end(), flags.begin(), flags.end());
  arguments.push_back("about:blank");
  return arguments;
}

std::string from_base64(const std::string& text) {
  static const std::string kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0, count = 0;
  for (const char c : text) {
    const std::size_t digit = kDigits.find(c);
    if (digit == std::string::npos) break;
    bits = (bits << 6 | static_cast<unsigned>(digit)) & 0xffffff;
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 0xff);
  }
  return bytes;
}

}  // namespace

LivePage::LivePage(const std::string& url, int width, int height, const std::vector<std::string>& flags)
    : browser_(browser_arguments(profile_.path().string(), width, height, flags), true) {
  const json target = call("Target.createTarget", {{"url", "about:blank"}});
  session_ = call("Target.attachToTarget", {{"targetId", target.at("targetId")}, {"flatten", true}}).at("sessionId");
  for (const char* domain : {"Page.enable", "Runtime.enable", "Log.enable"}) call(domain);
  loaded_ = false;
  call("Page.navigate", {{"url", url}});
  for (int k = 0; k < 600 && !loaded_; ++k) {
    call("Runtime.evaluate", {{"expression", "1"}});  // events come along with answers
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  if (!loaded_) throw std::runtime_error(url + " is not loaded");
}

json LivePage::call(const std::string& method, const json& parameters) {
  json message = {{"id", ++calls_}, {"method", method}, {"params", parameters}};
  if (!session_.empty()) message["sessionId"] = session_;
  browser_.write_channel(message.dump() + '\0');
  for (;;) {
    const std::string text = browser_.read_channel('\0');
    if (text.empty()) throw std::runtime_error("the browser does not answer " + method);
    json answer = json::parse(text);
    if (!answer.contains("id")) {
      heard(answer);
      continue;
    }
    if (answer["id"] != calls_) continue;
    if (answer.contains("error")) throw std::runtime_error(method + ": " + answer["error"].dump());
    return answer["result"];
  }
}

void LivePage::heard(const json& message) {
  const std::string method = message.value("method", "");
  if (method == "Page.loadEventFired") loaded_ = true;
  if (method == "Runtime.exceptionThrown") errors_.push_back(message["params"]["exceptionDetails"].dump());
  if (method == "Log.entryAdded" && message["params"]["entry"]["level"] == "error")
    errors_.push_back(message["params"]["entry"].dump());
  if (method == "Runtime.consoleAPICalled" && message["params"]["type"] == "error")
    errors_.push_back(message["params"].dump());
}

json LivePage::evaluate(const std::string& expression) {
  const json answer =
      call("Runtime.evaluate", {{"expression", expression}, {"awaitPromise", true}, {"returnByValue", true}});
  if (answer.contains("exceptionDetails")) throw std::runtime_error(answer["exceptionDetails"].dump());
  return answer["result"].value("value", json());
}

bool LivePage::wait_for(const std::string& expression, double seconds) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  while (std::chrono::duration<double>(Clock::now() - start).count() < seconds) {
    if (evaluate("Boolean(" + expression + ")") == true) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

void LivePage::press(const std::string& key) {
  static const std::map<std::string, int> kCodes = {
      {"Enter", 13}, {"Escape", 27}, {"ArrowLeft", 37}, {"ArrowUp", 38}, {"ArrowRight", 39}, {"ArrowDown", 40},
      {"Tab", 9},    {" ", 32},      {"Delete", 46},    {"Home", 36},    {"End", 35}};
  for (const char* type : {"rawKeyDown", "char", "keyUp"}) {
    json event = {{"type", type}, {"key", key}, {"code", key}, {"windowsVirtualKeyCode", kCodes.at(key)}};
    if (type == std::string("char")) {
      if (key != "Enter" && key != " ") continue;
      event["text"] = key == " " ? " " : "\r";
    }
    call("Input.dispatchKeyEvent", event);
  }
}

void LivePage::type(const std::string& text) { call("Input.insertText", {{"text", text}}); }

void LivePage::click(const std::string& selector) {
  const json at = evaluate("(() => { const element = document.querySelector(" + json(selector).dump() + R"();
    element.scrollIntoView({ block: 'center', inline: 'center' });
    const box = element.getBoundingClientRect();
    return [box.left + box.width / 2, box.top + box.height / 2];
  })())");
  for (const char* type : {"mouseMoved", "mousePressed", "mouseReleased"})
    call("Input.dispatchMouseEvent",
         {{"type", type}, {"x", at.at(0)}, {"y", at.at(1)}, {"button", "left"}, {"clickCount", 1}});
}

bool LivePage::tab_to(const std::string& selector, int most) {
  const std::string there = "document.activeElement.matches(" + json(selector).dump() + ")";
  for (int k = 0; k < most; ++k) {
    if (evaluate(there) == true) return true;
    press("Tab");
  }
  return false;
}

void LivePage::resize(int width, int height) {
  call("Emulation.setDeviceMetricsOverride",
       {{"width", width}, {"height", height}, {"deviceScaleFactor", 1}, {"mobile", width < 600}});
}

void LivePage::prefer_dark(bool dark) {
  call("Emulation.setEmulatedMedia",
       {{"features", {{{"name", "prefers-color-scheme"}, {"value", dark ? "dark" : "light"}}}}});
}

std::string LivePage::photograph() {
  return from_base64(call("Page.captureScreenshot", {{"format", "png"}}).at("data").get<std::string>());
}

}  // namespace tessera::test
