#pragma once

#include <filesystem>
#include <string_view>

namespace tessera {

// A file that appears whole or not at all: written under a temporary name beside its target and renamed by
// commit(). Without commit() the temporary file is removed, whatever happened in between.
class AtomicFile {
 public:
  // Creates the folder of `target` when it is missing. Throws SystemError when it cannot.
  explicit AtomicFile(std::filesystem::path target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  // Where to write until commit().
  const std::filesystem::path& temporary() const { return temporary_; }

  // Creates the temporary file with these bytes. Throws SystemError naming the target and the reason.
  void write(std::string_view bytes);

  // Renames to the target. Throws SystemError naming the target and the reason.
  void commit();

 private:
  std::filesystem::path target_, temporary_;
  bool committed_ = false;
};

// Writes `bytes` to `target`, whole or not at all. Throws SystemError.
void write_file_atomically(const std::filesystem::path& target, std::string_view bytes);

}  // namespace tessera
