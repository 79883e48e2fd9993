#include "replay/report/page_parts.h"

#include <libdeflate.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <memory>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
using Numbers = std::vector<std::int64_t>;

void append_varint(std::uint64_t value, std::string& out) {
  for (; value >= 0x80; value >>= 7) out += static_cast<char>(value | 0x80);
  out += static_cast<char>(value);
}
std::uint64_t zigzag(std::int64_t value) {
  return value >= 0 ? static_cast<std::uint64_t>(value) << 1 : (static_cast<std::uint64_t>(-(value + 1)) << 1) + 1;
}

bool is_column(const json& value) {
  return value.is_array() && value.size() >= kLeastColumn &&
         std::all_of(value.begin(), value.end(), [](const json& of) { return of.is_number_integer(); });
}
bool is_lists(const json& value) {
  return value.is_array() && value.size() >= kLeastColumn &&
         std::all_of(value.begin(), value.end(), [](const json& of) {
           return of.is_array() &&
                  std::all_of(of.begin(), of.end(), [](const json& number) { return number.is_number_integer(); });
         });
}

class Packer {
 public:
  // Removes the numbers from a document and returns the rest.
  json add(const json& value, const std::string& path) {
    if (is_column(value)) return column(value.get<Numbers>(), path);
    if (is_lists(value)) {
      Numbers lengths, numbers;
      for (const json& list : value) {
        lengths.push_back(static_cast<std::int64_t>(list.size()));
        for (const json& number : list) numbers.push_back(number.get<std::int64_t>());
      }
      json out = json::object();  // in the order of their keys
      out["lists"] = column(lengths, path + "/lists");
      out["of"] = column(numbers, path + "/of");
      return out;
    }
    if (!value.is_structured()) return value;
    json out = value.is_object() ? json::object() : json::array();
    for (const auto& [key, item] : value.items())
      if (value.is_object())
        out[key] = add(item, path + '/' + key);
      else
        out.push_back(add(item, path + '/' + key));
    return out;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  json column(Numbers numbers, const std::string& path) {
    Numbers& before = before_[path];
    std::string ways[2];
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      append_varint(zigzag(numbers[k] - (k > 0 ? numbers[k - 1] : 0)), ways[0]);
      if (before.size() == numbers.size()) append_varint(zigzag(numbers[k] - before[k]), ways[1]);
    }
    // Zeros pack better than their number says.
    const auto weight = [](const std::string& way) {
      return way.size() * 4 - 3 * static_cast<std::size_t>(std::count(way.begin(), way.end(), '\0'));
    };
    const int way = before.size() == numbers.size() && weight(ways[1]) < weight(ways[0]) ? 1 : 0;
    bytes_ += ways[way];
    json out = {{"column", {numbers.size(), way}}};
    before = std::move(numbers);
    return out;
  }

  std::string bytes_;
  std::map<std::string, Numbers> before_;  // of the document before
};

}  // namespace

std::string base64(std::string_view bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  const auto append = [&](unsigned a, unsigned b, unsigned c, std::size_t digits) {
    const unsigned bits = a << 16 | b << 8 | c;
    const char four[] = {kDigits[bits >> 18], kDigits[bits >> 12 & 63], digits > 2 ? kDigits[bits >> 6 & 63] : '=',
                         digits > 3 ? kDigits[bits & 63] : '='};
    text.append(four, 4);
  };
  const auto byte = [&](std::size_t i) { return unsigned{static_cast<unsigned char>(bytes[i])}; };
  std::size_t i = 0;
  for (; i + 3 <= bytes.size(); i += 3) append(byte(i), byte(i + 1), byte(i + 2), 4);
  if (bytes.size() - i == 1) append(byte(i), 0, 0, 2);
  if (bytes.size() - i == 2) append(byte(i), byte(i + 1), 0, 3);
  return text;
}

std::string gzip_base64(std::string_view text) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(9), libdeflate_free_compressor);
  if (compressor == nullptr) throw SystemError("out of memory while packing a page");
  std::string packed(libdeflate_gzip_compress_bound(compressor.get(), text.size()), '\0');
  packed.resize(libdeflate_gzip_compress(compressor.get(), text.data(), text.size(), packed.data(), packed.size()));
  return base64(packed);
}

std::string markup_text(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '<' ? std::string("&lt;") : c == '&' ? std::string("&amp;") : std::string(1, c);
  return out;
}

void append_script(const std::string& id, std::string_view text, std::string& page) {
  page.append("<script type=\"text/plain\" id=\"").append(id).append("\">").append(text).append("</script>\n");
}

std::string pack_documents(const std::vector<json>& documents) {
  Packer packer;
  json heads = json::array();
  for (const json& document : documents) heads.push_back(packer.add(document, ""));
  const std::string text = json_text(heads);
  std::string out;
  for (std::size_t k = 0; k < 4; ++k) out += static_cast<char>(text.size() >> (8 * k) & 0xFF);
  return out + text + packer.bytes();
}

namespace {

namespace fs = std::filesystem;

// The value of a variable, or the XDG base directory specification's default.
std::string variable(const char* name, const std::string& otherwise) {
  const char* value = std::getenv(name);
  return value != nullptr && *value != '\0' ? value : otherwise;
}

}  // namespace

std::vector<fs::path> vega_folders() {
  if (const char* folder = std::getenv("TESSERA_VEGA"); folder != nullptr) return {folder};
  std::vector<fs::path> folders;
#ifdef TESSERA_VEGA_FOLDER
  folders.emplace_back(TESSERA_VEGA_FOLDER);
#endif
  std::istringstream shares(variable("XDG_DATA_HOME", variable("HOME", "") + "/.local/share") + ":" +
                            variable("XDG_DATA_DIRS", "/usr/local/share:/usr/share"));
  for (std::string share; std::getline(shares, share, ':');)
    for (const char* below :
         {"javascript/vega", "vega", "../lib/node_modules", "../lib/node_modules/vega/node_modules"})
      folders.push_back((fs::path(share) / below).lexically_normal());
  return folders;
}

fs::path find_vega_module(const std::string& name) {
  const std::string file = name + ".min.js";
  std::error_code ignored;
  for (const fs::path& folder : vega_folders())
    for (const fs::path& candidate : {folder / file, folder / name / "build" / file})
      if (fs::is_regular_file(candidate, ignored)) return candidate;
  return {};
}

}  // namespace tessera::replay
