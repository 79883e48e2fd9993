#include "scene/gltf/named_files.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "scene/gltf/resources.h"

namespace tessera::scene::gltf {
namespace {

// Collects the texts under the member names that documents use for files, in the interface of
// nlohmann::json::sax_parse.
class UriCollector : public nlohmann::json_sax<nlohmann::json> {
 public:
  std::vector<std::string> uris;

  bool key(string_t& name) override {
    named_ = name == "uri" || name == "image" || name == "environment";
    return true;
  }
  bool string(string_t& text) override {
    if (named_ && !is_data_uri(text)) uris.push_back(text);
    return next();
  }
  bool null() override { return next(); }
  bool boolean(bool) override { return next(); }
  bool number_integer(number_integer_t) override { return next(); }
  bool number_unsigned(number_unsigned_t) override { return next(); }
  bool number_float(number_float_t, const string_t&) override { return next(); }
  bool binary(binary_t&) override { return next(); }
  bool start_object(std::size_t) override { return next(); }
  bool end_object() override { return next(); }
  bool start_array(std::size_t) override { return next(); }
  bool end_array() override { return next(); }
  bool parse_error(std::size_t, const std::string&, const nlohmann::json::exception&) override { return false; }

 private:
  bool next() {
    named_ = false;
    return true;
  }
  bool named_ = false;  // the value that comes next
};

// Bytes of the JSON of a container; nothing where the file is JSON alone.
std::optional<std::uint32_t> json_chunk(std::ifstream& stream) {
  std::array<char, 20> head{};
  stream.read(head.data(), head.size());
  if (stream.gcount() != 20 || std::memcmp(head.data(), "glTF", 4) != 0) {
    stream.clear();
    stream.seekg(0);
    return std::nullopt;
  }
  std::uint32_t size = 0;
  for (std::size_t k = 0; k < 4; ++k) size |= std::uint32_t{static_cast<unsigned char>(head[12 + k])} << (8 * k);
  return size;
}

}  // namespace

std::vector<std::filesystem::path> named_files(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return {};
  UriCollector collector;
  if (const std::optional<std::uint32_t> size = json_chunk(stream)) {
    std::error_code unknown;
    const std::uint64_t there = std::filesystem::file_size(file, unknown);
    std::string text(unknown ? 0 : std::min<std::uint64_t>(*size, there), '\0');
    stream.read(text.data(), static_cast<std::streamsize>(text.size()));
    nlohmann::json::sax_parse(text, &collector);
  } else {
    nlohmann::json::sax_parse(stream, &collector);
  }
  std::vector<std::filesystem::path> files;
  for (const std::string& uri : collector.uris)
    if (const std::optional<std::string> path = uri_path(uri)) files.push_back(file.parent_path() / *path);
  return files;
}

}  // namespace tessera::scene::gltf
