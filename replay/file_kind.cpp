#include "replay/file_kind.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <set>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "base/text.h"
#include "base/whole_file.h"

namespace tessera::replay {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string ending(const fs::path& file) {
  std::string text = file.extension().string();
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string first_bytes(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string bytes(64, '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  return bytes;
}

// A format of other programs: beginning (or "") and endings of its files, its name, and the way to convert it to glTF.
struct Foreign {
  std::string_view begin;
  std::vector<std::string_view> endings;
  const char *name, *remedy;
};
constexpr const char* kByBlender = "open it in Blender and export glTF 2.0";
const std::vector<Foreign>& foreign_formats() {
  static const std::vector<Foreign> kFormats = {
      {"BLENDER", {".blend"}, "a Blender file", kByBlender},
      {"Kaydara FBX Binary",
       {".fbx"},
       "an FBX file",
       "convert it with FBX2glTF, or import it in Blender and export glTF 2.0"},
      {"; FBX", {}, "an FBX file", "convert it with FBX2glTF, or import it in Blender and export glTF 2.0"},
      {"", {".obj"}, "a Wavefront OBJ file", "convert it with obj2gltf, or import it in Blender and export glTF 2.0"},
      {"#usda", {".usd", ".usda", ".usdc", ".usdz"}, "a USD file", "import it in Blender and export glTF 2.0"},
      {"PXR-USDC", {}, "a USD file", "import it in Blender and export glTF 2.0"},
      {"ply\n", {".ply"}, "a PLY file", "import it in Blender and export glTF 2.0"},
      {"",
       {".dae", ".stl", ".3ds", ".abc", ".x3d", ".max", ".ma", ".mb", ".c4d"},
       "no glTF file",
       "import it in Blender and export glTF 2.0"},
      {"PK\x03\x04", {".zip"}, "a ZIP archive", "unpack it and give the .gltf or .glb file in it"},
      {"\x1f\x8b", {".gz", ".tgz"}, "compressed", "unpack it first"},
      {"\x28\xb5\x2f\xfd", {".zst"}, "compressed", "unpack it first"},
      {"\xfd"
       "7zXZ",
       {".xz"},
       "compressed",
       "unpack it first"},
  };
  return kFormats;
}

const Foreign* foreign_format(const fs::path& file) {
  const std::string bytes = first_bytes(file), end = ending(file);
  for (const Foreign& format : foreign_formats())
    if (!format.begin.empty() && bytes.starts_with(format.begin)) return &format;
  for (const Foreign& format : foreign_formats())
    if (std::find(format.endings.begin(), format.endings.end(), end) != format.endings.end()) return &format;
  return nullptr;
}

const char* image_name(const std::string& bytes) {
  using namespace std::string_view_literals;
  constexpr std::array<std::pair<std::string_view, const char*>, 7> kBegins = {{{"\x89PNG"sv, "PNG"},
                                                                                {"\xff\xd8\xff"sv, "JPEG"},
                                                                                {"\x76\x2f\x31\x01"sv, "OpenEXR"},
                                                                                {"\xabKTX"sv, "KTX2"},
                                                                                {"#?RADIANCE"sv, "Radiance HDR"},
                                                                                {"GIF8"sv, "GIF"},
                                                                                {"BM"sv, "BMP"}}};
  for (const auto& [begin, name] : kBegins)
    if (bytes.starts_with(begin)) return name;
  return bytes.starts_with("RIFF") && bytes.size() >= 12 && bytes.substr(8, 4) == "WEBP" ? "WebP" : nullptr;
}

FileKind json_kind(const fs::path& file) {
  constexpr std::uint64_t kMaxBytes = 16u << 20;
  try {
    const json root = parse_json(read_whole_text(file, kMaxBytes), file.string());
    if (!root.is_object()) return FileKind::kUnknown;
    if (root.contains("asset")) return FileKind::kCapture;
    const json schema = root.value("schema", json());
    if (schema == "tessera.stats/1" || schema == "tessera.time/1") return FileKind::kStatistics;
    if (root.contains("captures") && !root.contains("schema")) return FileKind::kStudy;
    static const std::set<std::string> kMachine = {"preset", "base", "tile", "shader", "clock", "memory", "binner"};
    for (const auto& [name, value] : root.items())
      if (kMachine.contains(name)) return FileKind::kMachine;
  } catch (const Error&) {
    // Nothing in the file tells its kind.
  }
  return FileKind::kUnknown;
}

// Captures of a folder, for people.
std::string captures_in(const fs::path& folder) {
  constexpr std::size_t kShown = 3;
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    if (const std::string kind = ending(at->path()); kind == ".gltf" || kind == ".glb")
      names.push_back(escape_control((folder / at->path().filename()).string(), 120));
  std::sort(names.begin(), names.end());
  const bool more = names.size() > kShown;
  if (more) names.resize(kShown);
  return names.empty() ? "" : fmt::format("; in it {}{}", fmt::join(names, ", "), more ? ", ..." : "");
}

// The capture nearest in name to a missing file, among its folder's captures.
std::string near_capture(const fs::path& file) {
  std::vector<std::string> names;
  const fs::path folder = file.has_parent_path() ? file.parent_path() : ".";
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    if (const std::string kind = ending(at->path()); kind == ".gltf" || kind == ".glb")
      names.push_back(at->path().filename().string());
  std::sort(names.begin(), names.end());
  const std::string nearest = nearest_name(file.filename().string(), names);
  return nearest.empty() ? "" : (file.parent_path() / nearest).string();
}

std::string about_folder(FileKind wanted, const fs::path& folder) {
  std::error_code ignored;
  if (fs::exists(folder / "stats.json", ignored))
    return "is the folder of a replay: `tessera report` and `tessera compare` take it";
  if (fs::exists(folder / "sweep.json", ignored) || fs::exists(folder / "tradeoff.json", ignored))
    return "is a folder of results: `tessera report` takes it";
  if (wanted == FileKind::kCapture) return fmt::format("is a folder: give a .gltf or .glb file{}", captures_in(folder));
  return wanted == FileKind::kMachine ? "is a folder: give a preset or a JSON file" : "is a folder: give a file";
}

// A file's kind, and the command that takes it.
std::string about(FileKind kind, FileKind wanted, const fs::path& file) {
  const std::string name = escape_control(file.string(), 120);
  switch (kind) {
    case FileKind::kFolder:
      return about_folder(wanted, file);
    case FileKind::kCapture:
      if (wanted == FileKind::kMachine) return "is a capture: give a preset or a JSON file that describes a machine";
      return fmt::format(
          "is a capture: `tessera replay {}` renders it{}", name,
          wanted == FileKind::kRecord ? fmt::format(", and with --record FILE writes a record for this command") : "");
    case FileKind::kStudy:
      return fmt::format("is a study: `tessera sweep {} --out DIR` renders it", name);
    case FileKind::kRecord:
      return fmt::format("is a record of a replay: `tessera time {}` times it", name);
    case FileKind::kStatistics:
      return "holds the figures of a replay: `tessera compare` takes it";
    case FileKind::kMachine:
      return fmt::format("describes a machine: give it to --gpu {}", name);
    case FileKind::kImage:
      return fmt::format("is an image ({}): `tessera compare` takes images{}", image_name(first_bytes(file)),
                         wanted == FileKind::kCapture ? ", a capture is a .gltf or .glb file" : "");
    case FileKind::kForeign: {
      const Foreign* format = foreign_format(file);
      return fmt::format("is {}: {}", format->name, format->remedy);
    }
    case FileKind::kUnknown:
      break;
  }
  return "";
}

}  // namespace

FileKind kind_of(const fs::path& file) {
  std::error_code error;
  if (fs::is_directory(file, error)) return FileKind::kFolder;
  if (!fs::is_regular_file(file, error)) return FileKind::kUnknown;
  const std::string bytes = first_bytes(file);
  if (bytes.starts_with("glTF")) return FileKind::kCapture;
  if (bytes.starts_with("tessera.record/")) return FileKind::kRecord;
  if (image_name(bytes) != nullptr) return FileKind::kImage;
  const std::size_t text = bytes.find_first_not_of(" \t\r\n");
  if (text != std::string::npos && bytes[text] == '{') return json_kind(file);
  return foreign_format(file) != nullptr ? FileKind::kForeign : FileKind::kUnknown;
}

void refuse_other_kind(FileKind wanted, const fs::path& file) {
  std::error_code ignored;
  if (wanted == FileKind::kCapture && !fs::exists(file, ignored))
    if (const std::string nearest = near_capture(file); !nearest.empty())
      throw InputError(file.string(), "", fmt::format("no such file; did you mean '{}'?", nearest));
  const FileKind kind = kind_of(file);
  if (kind == FileKind::kUnknown || kind == wanted) return;
  throw InputError(file.string(), "", about(kind, wanted, file));
}

}  // namespace tessera::replay
