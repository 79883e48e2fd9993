#include "gpu/record_file.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"
#include "base/text.h"
#include "base/zstd_bytes.h"
#include "timing/work_code.h"

namespace tessera::gpu {
namespace {

using nlohmann::json;

constexpr std::string_view kMagic = "tessera.record/5\n", kMagicOfAll = "tessera.record/";
constexpr std::uint64_t kMaxHeadBytes = 16u << 20;
constexpr std::uint64_t kMaxViews = 2;
// Decoded work takes at most this multiple of its encoded bytes.
constexpr std::uint64_t kExpansion = 16;

// The names of the events of recorded work, in their order.
json event_names() {
  json names = json::array();
  for (const timing::Event event : hardware::kAllEvents) names.push_back(name(event));
  return names;
}

// Whether a key sizes a cache that events simulate in time from its requests.
bool is_of_caches(std::string_view key) {
  constexpr std::array<std::string_view, 3> kKeys = {"texture.cache_bytes", "l2.bytes", "l2.ways"};
  return std::find(kKeys.begin(), kKeys.end(), key) != kKeys.end();
}

// The reason why no machine can have done this work, so that its simulation would take forever; nullptr if one can.
const char* implausible(const timing::FrameWork& work) {
  constexpr std::uint64_t kMaxTilePixels = 256 * 256, kMaxVertices = 1u << 20, kMaxTileBytes = 1u << 30,
                          kMaxBytes = std::uint64_t{1} << 40;
  std::uint64_t bytes = work.other_bytes;
  if (work.other_written_bytes > work.other_bytes) return "more bytes are written than moved";
  for (const timing::WorkRound& round : work.rounds) {
    const timing::GeometryWork& geometry = round.geometry;
    if (geometry.written_bytes > geometry.dram_bytes ||
        geometry.table_bytes > geometry.dram_bytes - geometry.written_bytes)
      return "more bytes are written or read through the L2 than moved";
    bytes = std::max(bytes, round.geometry.dram_bytes);
    for (const timing::TileWork& tile : round.tiles)
      if (tile.events[timing::Event::kPixels] > kMaxTilePixels) return "a tile has more pixels than any machine's";
    for (const timing::TileItems& items : round.items) {
      for (const timing::SubPatchItem& item : items.sub_patches)
        if (item[timing::Event::kVertices] > kMaxVertices) return "a sub-patch has more than 2^20 vertices";
      for (const std::uint64_t moved :
           {items.list_bytes, items.record_bytes, items.load_bytes, items.resolve_bytes, items.written_bytes})
        if (moved > kMaxTileBytes) return "a tile moves more than 1 GiB";
    }
  }
  return bytes > kMaxBytes ? "a frame moves more than 1 TiB" : nullptr;
}

}  // namespace

RecordWriter::RecordWriter(const std::filesystem::path& file, const json& head) : file_(file) {
  file_.write(kMagic);
  const std::string text = json_text(head, 1) + "\n";
  number(text.size());
  file_.write(text);
}

void RecordWriter::number(std::uint64_t value) {
  std::array<char, 8> bytes;
  for (char& byte : bytes) byte = static_cast<char>(value & 0xFF), value >>= 8;
  file_.write({bytes.data(), bytes.size()});
}

void RecordWriter::add(int frame, const std::vector<const timing::FrameWork*>& views) {
  file_.write("F");
  number(static_cast<std::uint64_t>(frame));
  number(views.size());
  for (const timing::FrameWork* work : views) {
    const std::string plain = timing::encode(*work), packed = zstd_compress(plain);
    number(plain.size());
    number(packed.size());
    file_.write(packed);
  }
}

void RecordWriter::commit() {
  file_.write("E");
  file_.commit();
}

RecordReader::RecordReader(const std::filesystem::path& file, std::uint64_t max_bytes)
    : name_(file), file_(file, std::ios::binary), max_bytes_(max_bytes) {
  std::error_code ignored;
  if (!file_ || std::filesystem::is_directory(file, ignored)) throw InputError(name_.string(), "", "cannot be read");
  const std::string magic = bytes(kMagic.size());
  if (magic != kMagic && magic.starts_with(kMagicOfAll))
    refuse("is a record of another version: record it again (replay --record)");
  if (magic != kMagic) refuse("is not a record (replay --record)");
  const std::uint64_t length = number();
  if (length > kMaxHeadBytes) refuse("has a head of more than 16 MiB");
  head_ = parse_unique_json(bytes(length), name_.string());
  if (!head_.is_object()) refuse("has a head that is no JSON object");
  if (head_.value("events", json()) != event_names())
    refuse("is of a machine that charges other events than this one: record it again (replay --record)");
}

void RecordReader::refuse(const std::string& reason) const {
  throw InputError(name_.string(), fmt::format("byte {}", at_), reason);
}

std::string RecordReader::bytes(std::uint64_t count) {
  // The string grows with the bytes that are read, not with a length that may be damaged.
  constexpr std::uint64_t kAtOnce = 1u << 20;
  std::string out;
  while (out.size() < count) {
    const std::size_t before = out.size(), step = static_cast<std::size_t>(std::min(kAtOnce, count - before));
    out.resize(before + step);
    file_.read(out.data() + before, static_cast<std::streamsize>(step));
    if (static_cast<std::size_t>(file_.gcount()) != step)
      refuse("is truncated: the record goes on behind its last byte");
  }
  at_ += count;
  return out;
}

std::uint64_t RecordReader::number() {
  const std::string text = bytes(8);
  std::uint64_t value = 0;
  for (std::size_t k = 8; k-- > 0;) value = value << 8 | static_cast<unsigned char>(text[k]);
  return value;
}

std::uint64_t RecordReader::size(const char* of) {
  const std::uint64_t count = number();
  if (count > max_bytes_ / kExpansion)
    throw LimitError(fmt::format("{}: byte {}: {} of {} bytes; frames of a record may take {} in memory",
                                 escape_control(name_.string()), at_, of, count, max_bytes_));
  return count;
}

std::optional<RecordedFrame> RecordReader::next() {
  const std::string kind = bytes(1);
  if (kind == "E") return std::nullopt;
  if (kind != "F") refuse("neither a frame nor the end");
  RecordedFrame frame;
  const std::uint64_t number_of = number(), views = number();
  if (number_of > std::uint64_t{1} << 30) refuse("a frame number that is too large");
  if (views < 1 || views > kMaxViews) refuse("a frame has one view or two");
  frame.frame = static_cast<int>(number_of);
  for (std::uint64_t view = 0; view < views; ++view) {
    const std::uint64_t plain = size("the work of a frame"), packed = size("the packed work of a frame");
    try {
      frame.views.push_back(timing::decode(zstd_expand(bytes(packed), plain)));
      if (const char* reason = implausible(frame.views.back())) throw timing::BadWork{reason};
    } catch (const BadZstd&) {
      refuse("is damaged: it does not unpack");
    } catch (const timing::BadWork& bad) {
      refuse(fmt::format("is damaged: {}", bad.reason));
    }
  }
  return frame;
}

namespace {

json drawables_json(const scene::Assembly& assembly) {
  constexpr std::size_t kMaxNamed = 65536;
  json rows = json::array();
  if (assembly.drawn.size() > kMaxNamed) return rows;
  const auto named = [](const auto& things, int number) {
    const auto at = static_cast<std::size_t>(number);
    if (number < 0 || at >= things.size()) return std::string();
    return things[at].name.empty() ? fmt::format("#{}", number) : things[at].name;
  };
  for (const scene::DrawnPrimitive& drawn : assembly.drawn) {
    const scene::Drawable& drawable = assembly.drawables[drawn.first_drawable];
    rows.push_back({{"first", drawn.first_drawable},
                    {"stride", drawn.stride},
                    {"count", drawn.count},
                    {"node", named(assembly.capture->nodes, drawable.node)},
                    {"material", named(assembly.capture->materials,
                                       assembly.material_source[static_cast<std::size_t>(drawable.material)])}});
  }
  return rows;
}

}  // namespace

json record_head(const std::string& capture, const scene::Assembly& assembly, const GpuConfiguration& gpu,
                 const RunSettings& settings, int width, int height) {
  return {{"schema", "tessera.record/5"},
          {"capture", capture},
          {"width", width},
          {"height", height},
          {"drawables", drawables_json(assembly)},
          {"events", event_names()},
          {"gpu", gpu_json(gpu)},
          {"settings", settings_json(settings)},
          {"function", functional_json(gpu, settings)}};
}

RecordedMachine recorded_machine(const json& head, const std::string& file) {
  RecordedMachine machine;
  machine.gpu = parse_gpu(json_text(head.value("gpu", json::object())), file);
  const json function = head.value("function", json::object());
  for (const auto& key : settings_keys().keys()) {
    const auto found = function.find(std::string(key.name));
    try {
      if (found != function.end()) settings_keys().set(machine.settings, key, *found);
    } catch (const UsageError& error) {
      throw InputError(file, "/function", error.what());
    }
  }
  return machine;
}

json functional_json(const GpuConfiguration& gpu, const RunSettings& settings) {
  json keys;
  for (const auto& key : gpu_keys().keys())
    if (!key.timing) keys[std::string(key.name)] = key_value_json(gpu_keys().value(gpu, key));
  for (const auto& key : settings_keys().keys())
    keys[std::string(key.name)] = key_value_json(settings_keys().value(settings, key));
  return keys;
}

void check_same_function(const json& head, const GpuConfiguration& gpu, const RunSettings& settings) {
  const json now = functional_json(gpu, settings), then = head.value("function", json::object());
  const bool events = gpu.queues.model == hardware::TimingModel::kEvents;
  for (const auto& [key, value] : now.items())
    if (!(events && is_of_caches(key)) && then.value(key, json()) != value)
      throw UsageError(
          fmt::format("{}: the record was made with {}, not {}; the work of the units depends on it: replay again", key,
                      then.value(key, json()).dump(), value.dump()));
}

}  // namespace tessera::gpu
