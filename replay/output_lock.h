#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace tessera::replay {

// Held while a command writes into its output folder, so that no other command mixes its results in: a lock on the
// folder itself, which leaves no file there and ends with the process in every case. On file systems without locks it
// does nothing.
//
// Invariants (cited by the tests):
//   OL1  If two commands want a folder alone, the second one is refused before it writes anything.
//   OL2  Folders that the lock made are removed with it if nothing was written to them.
class OutputLock {
 public:
  enum class Share { kAlone, kShared };
  // Makes the folder, and its parents, when they are missing. Throws WriteError when another command works there, or
  // the folder cannot be made.
  explicit OutputLock(const std::filesystem::path& folder, Share share = Share::kAlone);
  ~OutputLock();
  // Removes incomplete files with our names that a killed replay left there. For a command that has the folder alone.
  static void remove_unfinished(const std::filesystem::path& folder);
  OutputLock(const OutputLock&) = delete;
  OutputLock& operator=(const OutputLock&) = delete;

 private:
  void remove_made();

  int descriptor_ = -1;
  std::vector<std::filesystem::path> made_;  // the innermost last
};

// Space on the disk of a folder, reserved for a file that must be written even when the disk is full. It is a file
// without a name that ends with the process. Where the file system cannot reserve space, none is reserved.
class ReservedSpace {
 public:
  explicit ReservedSpace(std::filesystem::path folder) : folder_(std::move(folder)) {}
  ~ReservedSpace() { release(); }
  ReservedSpace(const ReservedSpace&) = delete;
  ReservedSpace& operator=(const ReservedSpace&) = delete;

  // Reserves so many bytes from now on; never fewer than before. Throws WriteError when the disk is too full for them.
  void grow(std::uint64_t bytes);
  // Frees the space.
  void release();

 private:
  std::filesystem::path folder_;
  int descriptor_ = -1;
  std::uint64_t bytes_ = 0;
};

}  // namespace tessera::replay
