#pragma once

#include <filesystem>
#include <string>

#include "base/error.h"

namespace tessera::replay {

// What people hand to a command that takes something else.
enum class FileKind { kUnknown, kFolder, kCapture, kStudy, kRecord, kStatistics, kMachine, kImage, kForeign };

// By the first bytes of a file, of JSON by its members, of foreign formats by the ending of the name too. kUnknown where
// nothing says what it is, or there is no such file.
FileKind kind_of(const std::filesystem::path& file);

// Throws InputError that says what `file` is and what takes it or makes it right, if it is certainly something else than
// `wanted`; for commands that have been refused.
void refuse_other_kind(FileKind wanted, const std::filesystem::path& file);

// Runs `read`, which reads `file`; what it refuses is said better where the file is of another kind.
template <class Read>
auto read_as(FileKind wanted, const std::filesystem::path& file, const Read& read) {
  try {
    return read();
  } catch (const InputError& error) {
    if (error.file() == file.string()) refuse_other_kind(wanted, file);
    throw;
  }
}

}  // namespace tessera::replay
