#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace tessera {

// Exit statuses of the program (fixed; scripts rely on them).
enum class ExitStatus : int { kDone = 0, kInternal = 1, kUsage = 2, kBadInput = 3, kLimit = 4, kCannotWrite = 6 };

// Bad input: names the file, the place in it (JSON pointer, byte offset, attribute) and the fault, in one line.
// Text taken from the file is escaped, so the line stays one line whatever the file holds.
class InputError : public std::runtime_error {
 public:
  InputError(std::string file, std::string place, std::string fault);

  const std::string& file() const { return file_; }
  const std::string& place() const { return place_; }
  const std::string& fault() const { return fault_; }

 private:
  std::string file_, place_, fault_;
};

// A stated resource limit would be exceeded. Thrown before the resource is allocated.
class LimitError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The program was called wrongly: unknown key, impossible value, missing argument.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Something outside the program failed: disk full, permission denied, file vanished.
class SystemError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A result could not be written: disk full, quota, permission denied, the reader of a pipe went away.
class WriteError : public SystemError {
 public:
  using SystemError::SystemError;
};

}  // namespace tessera
