#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/support/running_process.h"
#include "tests/support/temporary_folder.h"

namespace tessera::test {

// A page in a Chromium without a window, in real time, with a user who looks, presses keys and waits. The DevTools
// protocol over a pipe (--remote-debugging-pipe) controls it. has_browser() of browser.h says whether there is a
// Chromium.
class LivePage {
 public:
  // Returns once the page is loaded, in a browser that has `flags` besides its own. Throws std::runtime_error where
  // the browser does not answer.
  explicit LivePage(const std::string& url, int width = 1280, int height = 1600,
                    const std::vector<std::string>& flags = {});

  // Value of an expression; for a promise, its value once it is kept. Throws std::runtime_error with the error of the
  // page.
  nlohmann::json evaluate(const std::string& expression);
  // Waits until an expression is true; returns false after `seconds`.
  bool wait_for(const std::string& expression, double seconds = 60);
  // Presses and releases a key where the focus is: "ArrowRight", "Enter".
  void press(const std::string& key);
  // Clicks on the middle of the first element that a selector finds, which is scrolled into view.
  void click(const std::string& selector);
  // Presses Tab until the element that a selector finds has the focus; false when `most` presses do not lead there.
  bool tab_to(const std::string& selector, int most = 300);
  // The window's size in CSS pixels, which may be smaller than a browser's window can be.
  void resize(int width, int height);
  // Types text where the focus is.
  void type(const std::string& text);
  // Sets the page's preferred color scheme, from then on.
  void prefer_dark(bool dark);
  // An image of the window, as PNG bytes.
  std::string photograph();
  // Errors that scripts and the browser wrote to the console so far.
  const std::vector<std::string>& errors() const { return errors_; }

 private:
  nlohmann::json call(const std::string& method, const nlohmann::json& parameters = nlohmann::json::object());
  void heard(const nlohmann::json& message);

  TemporaryFolder profile_;
  RunningProcess browser_;
  int calls_ = 0;
  std::string session_;
  bool loaded_ = false;
  std::vector<std::string> errors_;
};

}  // namespace tessera::test
