#pragma once

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
  OutputLock(const OutputLock&) = delete;
  OutputLock& operator=(const OutputLock&) = delete;

 private:
  void remove_made();

  int descriptor_ = -1;
  std::vector<std::filesystem::path> made_;  // the innermost last
};

}  // namespace tessera::replay
