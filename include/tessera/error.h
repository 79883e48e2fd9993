#pragma once

#include <stdexcept>
#include <string>

// Marks the public interface of the library; all other symbols are hidden.
#if defined(__GNUC__)
#define TESSERA_API __attribute__((visibility("default")))
#else
#define TESSERA_API
#endif

namespace tessera {

// Base class of all errors: Tessera reports every refusal and every failure by one of the classes below, with a
// message of one line. Besides them only std::bad_alloc is thrown. An internal error prints its circumstances
// and aborts.
class TESSERA_API Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Bad input: names the file, the place in it (JSON pointer, byte offset, attribute) and the fault. Text from the file
// is escaped, so the message stays one line whatever the file holds.
class TESSERA_API InputError : public Error {
 public:
  InputError(std::string file, std::string place, std::string fault);

  const std::string& file() const { return file_; }
  const std::string& place() const { return place_; }
  const std::string& fault() const { return fault_; }

 private:
  std::string file_, place_, fault_;
};

// A stated resource limit would be exceeded. The error is thrown before the resource is allocated.
class TESSERA_API LimitError : public Error {
 public:
  using Error::Error;
};

// Tessera was called wrongly: unknown key, impossible value, missing argument.
class TESSERA_API UsageError : public Error {
 public:
  using Error::Error;
};

// The operating system refused something: disk full, permission denied, file vanished.
class TESSERA_API SystemError : public Error {
 public:
  using Error::Error;
};

// A result could not be written: disk full, quota, permission denied, the reader of a pipe went away.
class TESSERA_API WriteError : public SystemError {
 public:
  using SystemError::SystemError;
};

}  // namespace tessera
