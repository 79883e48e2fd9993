#pragma once

#include <filesystem>
#include <string>

#include "base/error.h"

namespace tessera::replay {

// Kinds of files and folders that people pass to commands.
enum class FileKind { kUnknown, kFolder, kCapture, kStudy, kRecord, kStatistics, kMachine, kImage, kForeign };

// The kind by the first bytes of a file, for JSON by its members, for foreign formats by the ending of the name as
// well. kUnknown for a missing file or one without such a mark.
FileKind kind_of(const std::filesystem::path& file);

// For commands that have refused a file: if `file` is certainly of another kind than `wanted`, throws InputError that
// names its kind and the command that takes or converts it.
void refuse_other_kind(FileKind wanted, const std::filesystem::path& file);

// Runs `read`, which reads `file`. If it fails and the file is of another kind than `wanted`, the error says so.
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
