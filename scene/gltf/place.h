#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"

namespace tessera::scene::gltf {

// Name of the root in messages, because its JSON pointer is the empty text.
inline constexpr const char* kWholeDocument = "the document";

// A value's place in a document: the file and the JSON pointer (RFC 6901) that leads to the value. A step costs one
// allocation; the pointer becomes text only on request, which is rare.
class Place {
 public:
  explicit Place(std::string file) : file_(std::make_shared<const std::string>(std::move(file))) {}

  // A place in a file whose JSON is not parsed yet: a byte offset.
  static Place byte(std::string file, std::size_t at) {
    return Place(Place(std::move(file)), "byte " + std::to_string(at), kByte);
  }

  Place at(std::string_view key) const { return Place(*this, std::string(key), kKey); }
  Place at(std::size_t index) const { return Place(*this, {}, index); }

  const std::string& file() const { return *file_; }
  std::string pointer() const {
    std::string text;
    append_to(text, last_.get());
    return text;
  }

  template <class... Args>
  [[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) const {
    throw InputError(*file_, last_ == nullptr ? kWholeDocument : pointer(),
                     fmt::format(format, std::forward<Args>(args)...));
  }

 private:
  static constexpr std::size_t kKey = static_cast<std::size_t>(-1), kByte = kKey - 1;
  struct Step {
    std::shared_ptr<const Step> before;
    std::string key;
    std::size_t index;  // kKey, kByte: `key` is the step
  };

  Place(const Place& outer, std::string key, std::size_t index)
      : file_(outer.file_), last_(std::make_shared<const Step>(Step{outer.last_, std::move(key), index})) {}

  static void append_to(std::string& text, const Step* step) {
    if (step == nullptr) return;
    append_to(text, step->before.get());
    text += step->index == kKey    ? pointer_step(step->key)
            : step->index == kByte ? step->key
                                   : "/" + std::to_string(step->index);
  }

  std::shared_ptr<const std::string> file_;
  std::shared_ptr<const Step> last_;
};

}  // namespace tessera::scene::gltf
