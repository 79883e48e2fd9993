#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace tessera {

// A file that appears whole or not at all. It is written under a temporary name beside its target, and commit() renames
// it. Without commit() the destructor removes the temporary file. OutputFile writes files that the user names, which
// may be streams.
//
// Invariants (cited by the tests):
//   A1  Only a regular file is replaced; anything else in its place stays, and is a WriteError.
//   A2  A symlink stays; the file at its end is replaced.
class AtomicFile {
 public:
  // Creates the folder of `target` when it is missing. Throws WriteError when it cannot.
  explicit AtomicFile(std::filesystem::path target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  // Where to write until commit().
  const std::filesystem::path& temporary() const { return temporary_; }

  // Appends to the temporary file, which the first call creates. Throws WriteError naming the target and the reason.
  void write(std::string_view bytes);

  // Renames to the target. Throws WriteError naming the target and the reason.
  void commit();

 private:
  void check_place() const;

  std::filesystem::path target_, place_, temporary_;  // place_: the end of the symlinks at target_
  int descriptor_ = -1;
  bool committed_ = false;
};

// Writes `bytes` to `target`, whole or not at all. Throws WriteError.
void write_file_atomically(const std::filesystem::path& target, std::string_view bytes);

// Makes the folder and its parents when they are missing. Throws WriteError.
void make_folder(const std::filesystem::path& folder);

// Returns the path at the end of the symlinks at `path`; nothing need exist there. Symlinks in the folders above it are
// not resolved.
std::filesystem::path link_end(std::filesystem::path path);

// Says why no regular file can be written at the end of the links: "is a folder", "is a FIFO". Returns "" for a regular
// file or a free place.
std::string irregular_kind(std::filesystem::file_status status);

// Writes all bytes. Returns 0 or the errno of the failed call. A pipe without a reader gives EPIPE and raises no
// signal.
int write_all(int descriptor, std::string_view bytes);

}  // namespace tessera
