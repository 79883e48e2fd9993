#pragma once

#include <cstdio>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/atomic_file.h"

namespace tessera {

// One result in the place that the user named for it.
//
//   existing target                            effect
//   nothing, a regular file                    written whole: a temporary beside it, renamed by commit()
//   a symlink to one of these                  the same at its end; the link stays
//   FIFO, character device                     written through as bytes come
//   /dev/fd/N, /dev/stdout, /proc/self/fd/N    the same through a duplicate of the descriptor, at its offset
//   folder, block device, socket               refused
//   the parent folder is missing               refused
//
// Invariants (cited by the tests):
//   O1  A refusal comes before anything is opened or made.
//   O2  A stream is never replaced, and nothing is made beside it. A write that fails half way has left its first half
//       there.
//   O3  Without commit() a regular file keeps its contents.
class OutputFile {
 public:
  // Throws the errors of check_output_file(), and WriteError when the stream cannot be opened. A FIFO blocks until a
  // reader opens it.
  explicit OutputFile(const std::filesystem::path& target);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  // Throws WriteError naming the target and the reason; so does commit(). Buffered.
  void write(std::string_view bytes);
  void commit();

 private:
  void flush();
  [[noreturn]] void fail(int reason) const;

  std::filesystem::path target_;
  std::optional<AtomicFile> file_;
  int stream_ = -1;
  std::string buffer_;
};

// Throws UsageError when OutputFile refuses `target`. Changes nothing; commands call it before any work. `made`: the
// folder that the command itself makes, in which `target` may lie.
void check_output_file(const std::filesystem::path& target, const std::filesystem::path& made = {});

// The same for the folder of --out, which may be missing with its parents, and for the results in it: `names` may have
// wildcards in their last part ("points/*.json"). Throws UsageError when `folder` is not a folder, or when something of
// such a name is anything but a regular file or lies, through symlinks, outside of it; WriteError when nothing can be
// made there.
void check_output_folder(const std::filesystem::path& folder, const std::vector<std::string>& names);

// N of /dev/fd/N, 1 for /dev/stdout: the descriptor of this process that a path names.
std::optional<int> named_descriptor(const std::filesystem::path& path);

// Whether OutputFile writes through the target instead of replacing it.
bool is_stream(const std::filesystem::path& target);

// Returns the stream for texts to people: standard error when one of `outputs` is standard output itself.
std::FILE* beside_outputs(std::initializer_list<std::string> outputs);

}  // namespace tessera
