#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace tessera::replay {

// Held while a command writes into its output folder, so that no other one mixes its results with these: a lock on the
// folder itself, which leaves nothing there and goes with the process, however that ends. On file systems without locks
// it does nothing.
//
// Invariants (cited by the tests):
//   OL1  Of two commands that want a folder alone, the second one is refused before it writes anything.
//   OL2  Folders that the lock made are gone with it if nothing was written to them.
class OutputLock {
 public:
  enum class Share { kAlone, kShared };
  // Makes the folder, and its parents, when they are missing. Throws WriteError when another command is at work there,
  // or nothing can be made.
  explicit OutputLock(const std::filesystem::path& folder, Share share = Share::kAlone);
  ~OutputLock();
  // Removes what a killed replay left half written there: of our names alone. For who has the folder alone.
  static void remove_unfinished(const std::filesystem::path& folder);
  OutputLock(const OutputLock&) = delete;
  OutputLock& operator=(const OutputLock&) = delete;

 private:
  void remove_made();

  int descriptor_ = -1;
  std::vector<std::filesystem::path> made_;  // the innermost last
};

// Room on the disk of a folder that nothing else may take: what is kept for a file that must be written even when the
// disk is full. It is a file without a name, gone with the process. Where the file system cannot reserve, nothing is.
class ReservedSpace {
 public:
  explicit ReservedSpace(std::filesystem::path folder) : folder_(std::move(folder)) {}
  ~ReservedSpace() { release(); }
  ReservedSpace(const ReservedSpace&) = delete;
  ReservedSpace& operator=(const ReservedSpace&) = delete;

  // From now on so many bytes are kept; never fewer than before. Throws WriteError when the disk is too full for them.
  void grow(std::uint64_t bytes);
  // Gives them back.
  void release();

 private:
  std::filesystem::path folder_;
  int descriptor_ = -1;
  std::uint64_t bytes_ = 0;
};

}  // namespace tessera::replay
