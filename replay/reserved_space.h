#pragma once

#include <cstdint>
#include <filesystem>

namespace tessera::replay {

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
