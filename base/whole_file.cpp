#include "base/whole_file.h"

#include <fstream>
#include <system_error>

#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"

namespace tessera {
namespace {

// `Bytes` is a container of single bytes.
template <class Bytes>
Bytes read(const std::filesystem::path& file, std::uint64_t max_bytes, const std::string& display_name,
           const std::function<void(std::uint64_t)>& charge) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status)) throw InputError(display_name, "", "no such file");
  if (std::filesystem::is_directory(status)) throw InputError(display_name, "", "is a folder, not a file");
  if (!std::filesystem::is_regular_file(status)) throw InputError(display_name, "", "is not a regular file");
  const std::uint64_t size = std::filesystem::file_size(file, error);
  if (error) throw InputError(display_name, "", error.message());
  if (size > max_bytes)
    throw LimitError(fmt::format("{}: {} exceeds the limit of {} for one file", escape_control(display_name),
                                 human_bytes(size), human_bytes(max_bytes)));
  if (charge) charge(size);
  std::ifstream stream(file, std::ios::binary);
  Bytes bytes(size, {});
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!stream || static_cast<std::uint64_t>(stream.gcount()) != size)
    throw InputError(display_name, "", "cannot be read");
  return bytes;
}

}  // namespace

std::vector<std::uint8_t> read_whole_file(const std::filesystem::path& file, std::uint64_t max_bytes,
                                          const std::string& display_name,
                                          const std::function<void(std::uint64_t)>& charge) {
  return read<std::vector<std::uint8_t>>(file, max_bytes, display_name, charge);
}

std::string read_whole_text(const std::filesystem::path& file, std::uint64_t max_bytes) {
  return read<std::string>(file, max_bytes, file.string(), {});
}

}  // namespace tessera
