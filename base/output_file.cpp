#include "base/output_file.h"

#include <fcntl.h>
#include <fnmatch.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBufferBytes = 1 << 18;

fs::path absolute_normal(const fs::path& path) {
  std::error_code ignored;
  return fs::absolute(path.empty() ? "." : path, ignored).lexically_normal();
}

// True for `folder` itself and all below it; no symlink is followed.
bool lies_in(const fs::path& path, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

std::string quoted(const fs::path& path) { return escape_control(path.string()); }

[[noreturn]] void refuse(const fs::path& target, const std::string& why) {
  throw UsageError(fmt::format("cannot write {}: {}", quoted(target), why));
}

void check_descriptor(const fs::path& target, int number) {
  const int flags = ::fcntl(number, F_GETFL);
  struct stat there {};
  if (flags < 0 || ::fstat(number, &there) != 0) refuse(target, "no such descriptor is open");
  if ((flags & O_ACCMODE) == O_RDONLY) refuse(target, "the descriptor is open for reading only");
  if (S_ISBLK(there.st_mode)) refuse(target, "is a block device");
}

// A result in the folder `root`, which is canonical.
void check_result(const fs::path& root, const fs::path& result) {
  std::error_code error;
  const fs::file_status there = fs::symlink_status(result, error);
  if (!fs::exists(there)) return;
  if (fs::is_symlink(there)) {
    const fs::path end = fs::weakly_canonical(link_end(result), error);
    if (error || !lies_in(end, root)) refuse(result, fmt::format("is a symlink that leaves {}", quoted(root)));
  }
  if (const std::string kind = irregular_kind(fs::symlink_status(link_end(result), error)); !kind.empty())
    refuse(result, kind);
}

void check_subfolder(const fs::path& root, const fs::path& subfolder) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(subfolder, error))) return;
  const fs::path end = fs::canonical(subfolder, error);
  if (error || !lies_in(end, root)) refuse(subfolder, fmt::format("is a symlink that leaves {}", quoted(root)));
  if (!fs::is_directory(end, error)) refuse(subfolder, "is not a folder");
}

// Results whose last part has wildcards.
void check_results(const fs::path& root, const fs::path& pattern) {
  std::error_code error;
  for (fs::directory_iterator at(pattern.parent_path(), error), none; !error && at != none; at.increment(error)) {
    std::error_code ignored;
    if (!at->is_symlink(ignored) && at->is_regular_file(ignored)) continue;
    if (::fnmatch(pattern.filename().c_str(), at->path().filename().c_str(), 0) == 0) check_result(root, at->path());
  }
}

}  // namespace

OutputFile::OutputFile(const fs::path& target) : target_(target) {
  check_output_file(target);
  if (!is_stream(target)) {
    file_.emplace(target);
    file_->write("");  // a folder where nothing can be made is found now
    return;
  }
  const std::optional<int> number = named_descriptor(target);
  stream_ = number ? ::fcntl(*number, F_DUPFD_CLOEXEC, 0) : ::open(target.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY);
  if (stream_ < 0) fail(errno);
}

OutputFile::~OutputFile() {
  if (stream_ >= 0) ::close(stream_);
}

void OutputFile::write(std::string_view bytes) {
  buffer_ += bytes;
  if (buffer_.size() >= kBufferBytes) flush();
}

void OutputFile::flush() {
  if (file_)
    file_->write(buffer_);
  else if (const int reason = write_all(stream_, buffer_); reason != 0)
    fail(reason);
  buffer_.clear();
}

void OutputFile::commit() {
  flush();
  if (file_)
    file_->commit();
  else if (::close(std::exchange(stream_, -1)) != 0)
    fail(errno);
}

void OutputFile::fail(int reason) const {
  throw WriteError(fmt::format("cannot write {}: {}", quoted(target_), std::strerror(reason)));
}

void check_output_file(const fs::path& target, const fs::path& made) {
  if (const std::optional<int> number = named_descriptor(target)) return check_descriptor(target, *number);
  std::error_code error;
  if (is_stream(target)) return;
  const fs::path end = link_end(target);
  if (const std::string kind = irregular_kind(fs::symlink_status(end, error)); !kind.empty()) refuse(target, kind);
  const fs::path folder = absolute_normal(end).parent_path();
  const fs::file_status parent = fs::status(folder, error);
  if (fs::exists(parent) && !fs::is_directory(parent))
    refuse(target, fmt::format("{} is not a folder", quoted(folder)));
  if (!fs::exists(parent) && (made.empty() || !lies_in(absolute_normal(made), folder)))
    refuse(target, fmt::format("the folder {} is missing", quoted(end.parent_path())));
}

void check_output_folder(const fs::path& folder, const std::vector<std::string>& names) {
  std::error_code error;
  const fs::path place = absolute_normal(folder);
  fs::path there = place;
  while (!fs::exists(fs::symlink_status(there, error)) && there.has_relative_path()) there = there.parent_path();
  if (!fs::is_directory(there, error))
    throw UsageError(fmt::format("cannot write to {}: {} is not a folder", quoted(folder), quoted(there)));
  if (::access(there.c_str(), W_OK | X_OK) != 0)
    throw WriteError(fmt::format("cannot write to {}: {}: {}", quoted(folder), quoted(there), std::strerror(errno)));
  if (there != place) return;
  const fs::path root = fs::canonical(place);
  for (const std::string& name : names) {
    const fs::path result = place / name;
    if (result.parent_path() != place) check_subfolder(root, result.parent_path());
    if (name.find('*') == std::string::npos)
      check_result(root, result);
    else
      check_results(root, result);
  }
}

std::optional<int> named_descriptor(const fs::path& path) {
  const fs::path own = fmt::format("/proc/{}/fd", ::getpid());
  fs::path at = absolute_normal(path);
  for (int links = 0; links < 40; ++links) {
    const fs::path folder = at.parent_path();
    if (folder == "/dev/fd" || folder == "/proc/self/fd" || folder == "/proc/thread-self/fd" || folder == own) {
      const std::string name = at.filename().string();
      int number = -1;
      const auto [end, fault] = std::from_chars(name.data(), name.data() + name.size(), number);
      return fault == std::errc() && *end == '\0' && number >= 0 ? std::optional<int>(number) : std::nullopt;
    }
    std::error_code error;
    if (!fs::is_symlink(fs::symlink_status(at, error))) return std::nullopt;
    at = (folder / fs::read_symlink(at, error)).lexically_normal();
    if (error) return std::nullopt;
  }
  return std::nullopt;
}

bool is_stream(const fs::path& target) {
  std::error_code ignored;
  const fs::file_status there = fs::status(target, ignored);
  return named_descriptor(target) || fs::is_fifo(there) || fs::is_character_file(there);
}

std::FILE* beside_outputs(std::initializer_list<std::string> outputs) {
  const bool taken = std::any_of(outputs.begin(), outputs.end(), [](const std::string& output) {
    return !output.empty() && named_descriptor(output) == STDOUT_FILENO;
  });
  return taken ? stderr : stdout;
}

}  // namespace tessera
