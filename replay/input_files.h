#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tessera::replay {

// The files that a command reads, so that none of its results replaces one of them. Files are identified by device and
// inode: links, `..` and other spellings of a path lead to the same file.
//
// Invariants (cited by the tests):
//   IN1  No result takes the place of an input, or of a file that an input names; the command is refused before it
//        makes or changes anything.
//   IN2  A result whose place is free, or holds another file, is written.
class InputFiles {
 public:
  // A file that may be missing.
  void add(const std::filesystem::path& file) { files_.push_back({file, false}); }
  // A glTF file and the buffers, images and environments that it names.
  void add_capture(const std::filesystem::path& file) { captures_.push_back(file); }

  // Throws UsageError when `target` is one of the files. Captures are opened only where `target` exists.
  void check(const std::filesystem::path& target) const;
  // The same for the results in a folder; `names` as check_output_folder() takes them (base/output_file.h).
  void check_folder(const std::filesystem::path& folder, const std::vector<std::string>& names) const;

 private:
  struct File {
    std::filesystem::path path;
    bool named;  // an input names this file
  };
  void find_named() const;

  mutable std::vector<File> files_;
  mutable std::vector<std::filesystem::path> captures_;  // captures whose named files are not yet in files_
};

}  // namespace tessera::replay
