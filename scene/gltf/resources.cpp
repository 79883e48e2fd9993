#include "scene/gltf/resources.h"

#include <algorithm>
#include <array>

#include <nlohmann/json.hpp>

#include "base/text.h"
#include "base/whole_file.h"
#include "scene/gltf/json_reader.h"
#include "scene/gltf/meshopt_reader.h"
#include "scene/gltf/read_ahead.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

// Returns nothing where an escape is broken.
std::optional<std::string> percent_decode(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      out += text[i];
      continue;
    }
    const int high = i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
    const int low = i + 2 < text.size() ? hex_digit(text[i + 2]) : -1;
    if (high < 0 || low < 0) return std::nullopt;
    out += static_cast<char>(high * 16 + low);
    i += 2;
  }
  return out;
}
std::string percent_decode(std::string_view text, const Place& place) {
  std::optional<std::string> out = percent_decode(text);
  if (!out) place.refuse("has a broken % escape");
  return std::move(*out);
}

int base64_digit(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  if (c == '+' || c == '-') return 62;
  if (c == '/' || c == '_') return 63;
  return -1;
}

std::vector<std::uint8_t> base64_decode(std::string_view text, const Place& place) {
  const auto is_space = [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; };
  while (!text.empty() && (text.back() == '=' || is_space(text.back()))) text.remove_suffix(1);
  const auto digits = text.size() - static_cast<std::size_t>(std::count_if(text.begin(), text.end(), is_space));
  if (digits % 4 == 1) place.refuse("has a base64 text of impossible length");
  std::vector<std::uint8_t> out;
  out.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (is_space(c)) continue;  // lines of 76 characters, as mail has them
    const int digit = base64_digit(c);
    if (digit < 0) place.refuse("has a character that is not base64");
    bits = (bits << 6) | static_cast<std::uint32_t>(digit);
    count += 6;
    if (count >= 8) {
      count -= 8;
      out.push_back(static_cast<std::uint8_t>(bits >> count));
    }
  }
  return out;
}

bool equal_but_for_case(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](char x, char y) { return lower(x) == lower(y); });
}

// "scheme:" as RFC 3986 defines it.
bool has_scheme(std::string_view uri) {
  const std::size_t colon = uri.find(':');
  if (colon == std::string_view::npos || colon == 0) return false;
  return std::all_of(uri.begin(), uri.begin() + static_cast<std::ptrdiff_t>(colon), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '+' || c == '-' ||
           c == '.';
  });
}

}  // namespace

std::filesystem::path resolve_uri(const std::string& uri, const std::filesystem::path& folder, const Place& place) {
  if (uri.empty()) place.refuse("is an empty URI");
  if (uri.size() > 2 && uri[1] == ':' && (uri[2] == '\\' || uri[2] == '/'))
    place.refuse("is a path of Windows with a drive; only files beside the capture and data: are read");
  if (has_scheme(uri)) place.refuse("is a URI with a scheme; only files beside the capture and data: are read");
  const std::string decoded = percent_decode(uri, place);
  if (decoded.find('\0') != std::string::npos) place.refuse("holds a zero byte");
  const std::filesystem::path relative(decoded);
  if (decoded.find('\\') != std::string::npos) place.refuse("has a backslash in a URI; folders are parted by /");
  if (relative.is_absolute()) place.refuse("is not a relative path");
  const std::filesystem::path normal = relative.lexically_normal();
  if (normal.empty() || *normal.begin() == "..") place.refuse("leaves the capture's folder");
  std::error_code error;
  const std::filesystem::path base = std::filesystem::weakly_canonical(folder, error);
  if (error) place.refuse("cannot be resolved: {}", error.message());
  const std::filesystem::path target = std::filesystem::weakly_canonical(base / normal, error);
  if (error) place.refuse("cannot be resolved: {}", error.message());
  const auto [left, right] = std::mismatch(base.begin(), base.end(), target.begin(), target.end());
  if (left != base.end()) place.refuse("leaves the capture's folder through a link");
  return target;
}

std::optional<std::string> uri_path(std::string_view uri) {
  if (uri.empty() || has_scheme(uri)) return std::nullopt;
  return percent_decode(uri);
}

bool is_data_uri(std::string_view uri) { return equal_but_for_case(uri.substr(0, 5), "data:"); }

std::vector<std::uint8_t> decode_data_uri(const std::string& uri, const Place& place) {
  const std::size_t comma = uri.find(',');
  if (comma == std::string::npos) place.refuse("is a data URI without data");
  const std::string_view head = std::string_view(uri).substr(5, comma - 5);
  const std::string_view data = std::string_view(uri).substr(comma + 1);
  constexpr std::string_view kMarker = ";base64";
  if (head.size() >= kMarker.size() && equal_but_for_case(head.substr(head.size() - kMarker.size()), kMarker))
    return data.find('%') == std::string_view::npos ? base64_decode(data, place)
                                                    : base64_decode(percent_decode(data, place), place);
  const std::string decoded = percent_decode(data, place);
  return {decoded.begin(), decoded.end()};
}

Resources::Resources(const json& document, const std::filesystem::path& file, std::vector<std::uint8_t> binary,
                     bool has_binary, const CaptureLimits& limits, MemoryBudget& budget, Notes& notes)
    : document_(document),
      root_(file.string()),
      folder_(file.has_parent_path() ? file.parent_path() : std::filesystem::path(".")),
      binary_(std::move(binary)),
      has_binary_(has_binary),
      limits_(limits),
      budget_(budget),
      notes_(notes) {
  const std::size_t views = list_of(document, "bufferViews").size();
  budget_.charge(views, sizeof(Bytes), "/bufferViews");
  views_.resize(views);
}

std::vector<std::uint8_t> Resources::read_uri(const std::string& uri, MemoryBudget& budget, const Place& place) const {
  if (is_data_uri(uri)) {
    budget.charge(uri.size(), 4, place);  // kept as a key, unescaped text that doubles, bytes
    return decode_data_uri(uri, place);
  }
  const std::filesystem::path target = resolve_uri(uri, folder_, place);
  try {
    return read_whole_file(target, limits_.max_file_bytes, uri,
                           [&](std::uint64_t size) { budget.charge(size, 1, escape_control(uri)); });
  } catch (const InputError& error) {
    place.refuse("{}: {}", escape_control(uri, 120), error.fault());
  }
}

const std::vector<std::uint8_t>& Resources::uri_bytes(const std::string& uri, const Place& place) {
  const auto known = loaded_.find(uri);
  if (known != loaded_.end()) return known->second;
  if (is_data_uri(uri) && !uri.starts_with("data:"))
    notes_.add(place, "schemes are case-insensitive", "has its scheme in capitals");
  std::optional<std::vector<std::uint8_t>> bytes;
  if (ahead_ != nullptr) bytes = ahead_->uris.take(uri, budget_);
  if (!bytes) bytes = read_uri(uri, budget_, place);
  bytes_read_ += bytes->size();
  return loaded_.emplace(uri, std::move(*bytes)).first->second;
}

std::optional<Bytes> Resources::known_range(const json& range) const {
  const auto index = range["buffer"].get<std::size_t>();
  const json& buffer = document_["buffers"][index];
  const std::vector<std::uint8_t>* bytes = nullptr;
  if (!buffer.contains("uri")) {
    if (index == 0 && has_binary_) bytes = &binary_;
  } else {
    const auto& uri = buffer["uri"].get_ref<const std::string&>();
    if (const auto known = loaded_.find(uri); known != loaded_.end()) bytes = &known->second;
    if (bytes == nullptr && ahead_ != nullptr) bytes = ahead_->uris.find(uri);
  }
  const auto size = buffer["byteLength"].get<std::uint64_t>(), offset = range.value("byteOffset", std::uint64_t{0}),
             length = range["byteLength"].get<std::uint64_t>();
  if (bytes == nullptr || bytes->size() < size || offset > size || length > size - offset) return std::nullopt;
  return Bytes(*bytes).subspan(offset, length);
}

std::optional<Bytes> Resources::known_view(std::size_t index) const {
  if (views_[index].data() != nullptr) return views_[index];
  const json& view = document_["bufferViews"][index];
  return find_meshopt(view) == nullptr ? known_range(view) : std::nullopt;
}

std::optional<Bytes> Resources::known_image(std::size_t index) const {
  const json& image = document_["images"][index];
  if (image.contains("bufferView")) return known_view(image["bufferView"].get<std::size_t>());
  if (!image.contains("uri")) return std::nullopt;
  const auto& uri = image["uri"].get_ref<const std::string&>();
  if (const auto known = loaded_.find(uri); known != loaded_.end()) return Bytes(known->second);
  const std::vector<std::uint8_t>* ready = ahead_ != nullptr ? ahead_->uris.find(uri) : nullptr;
  return ready != nullptr ? std::optional<Bytes>(*ready) : std::nullopt;
}

Bytes Resources::buffer(std::size_t index) {
  const json& buffer = document_["buffers"][index];
  const Place place = root_.at("buffers").at(index);
  const auto length = buffer["byteLength"].get<std::uint64_t>();
  const bool chunk = !buffer.contains("uri");
  if (chunk && (index != 0 || !has_binary_)) place.refuse("has no uri and there is no binary chunk for it");
  const std::vector<std::uint8_t>& bytes =
      chunk ? binary_ : uri_bytes(buffer["uri"].get_ref<const std::string&>(), place.at("uri"));
  if (bytes.size() < length) place.refuse("says {} bytes, its data has {}", length, bytes.size());
  return Bytes(bytes).first(length);
}

// The bytes that a buffer view or its compression points at with buffer, byteOffset, byteLength.
Bytes Resources::bytes_of(const json& range, const Place& place) {
  const Bytes bytes = buffer(range["buffer"].get<std::size_t>());
  const auto offset = range.value("byteOffset", std::uint64_t{0}), length = range["byteLength"].get<std::uint64_t>();
  if (offset > bytes.size() || length > bytes.size() - offset)
    place.refuse("bytes {} to {} lie outside its buffer of {} bytes", offset, offset + length, bytes.size());
  return bytes.subspan(offset, length);
}

Bytes Resources::buffer_view(std::size_t index) {
  if (views_[index].data() != nullptr) return views_[index];
  const json& view = document_["bufferViews"][index];
  const Place place = root_.at("bufferViews").at(index);
  const char* name = nullptr;
  const json* meshopt = find_meshopt(view, &name);
  if (meshopt == nullptr) return views_[index] = bytes_of(view, place);
  const Place inner = place.at("extensions").at(name);
  const Bytes compressed = bytes_of(*meshopt, inner);
  std::optional<std::vector<std::uint8_t>> decoded;
  if (ahead_ != nullptr) decoded = ahead_->views.take(index, budget_);
  if (!decoded) decoded = read_meshopt(*meshopt, compressed, budget_, inner);
  return views_[index] = decoded_.emplace(index, std::move(*decoded)).first->second;
}

Bytes Resources::image(std::size_t index) {
  const json& image = document_["images"][index];
  const Place place = root_.at("images").at(index);
  if (image.contains("bufferView")) return buffer_view(image["bufferView"].get<std::size_t>());
  if (!image.contains("uri")) place.refuse("needs either a uri or a bufferView");
  return uri_bytes(image["uri"].get_ref<const std::string&>(), place.at("uri"));
}

}  // namespace tessera::scene::gltf
