#pragma once

#include <string>
#include <string_view>

#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"

namespace tessera::scene::gltf {

// What messages call the root, whose JSON pointer is the empty text.
inline constexpr const char* kWholeDocument = "the document";

// A value's place in a document: the file and the JSON pointer (RFC 6901) that leads to the value.
class Place {
 public:
  explicit Place(std::string file, std::string pointer = "") : file_(std::move(file)), pointer_(std::move(pointer)) {}

  Place at(std::string_view key) const { return Place(file_, pointer_ + pointer_step(key)); }
  Place at(std::size_t index) const { return Place(file_, pointer_ + "/" + std::to_string(index)); }

  const std::string& file() const { return file_; }
  const std::string& pointer() const { return pointer_; }

  template <class... Args>
  [[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) const {
    throw InputError(file_, pointer_.empty() ? kWholeDocument : pointer_,
                     fmt::format(format, std::forward<Args>(args)...));
  }

 private:
  std::string file_, pointer_;
};

}  // namespace tessera::scene::gltf
