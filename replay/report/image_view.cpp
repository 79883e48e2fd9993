#include "base/json_text.h"
#include "base/whole_file.h"
#include "replay/report/report.h"

namespace tessera::replay {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

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

std::uint32_t big_endian32(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
  return value;
}

}  // namespace

json image_view(const std::string& label, const fs::path& image, const fs::path& tiles, int region_x, int region_y) {
  std::error_code ignored;
  if (!fs::is_regular_file(image, ignored)) return nullptr;
  const std::string bytes = read_whole_text(image);
  if (bytes.size() < 24) return nullptr;
  json view = {{"label", label},
               {"image", "data:image/png;base64," + base64(bytes)},
               {"size", {big_endian32(bytes, 16), big_endian32(bytes, 20)}},
               {"region", {region_x, region_y}}};
  if (fs::is_regular_file(tiles, ignored)) view["tiles"] = parse_json(read_whole_text(tiles), tiles.string());
  return view;
}

std::size_t image_stride(std::size_t count) { return count == 0 ? 1 : (count + kMaxImages - 1) / kMaxImages; }

}  // namespace tessera::replay
