#include "gpu/trace_file.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <vector>

#include <fmt/format.h>

#include "base/output_file.h"

namespace tessera::gpu {
namespace {

class JsonTrace final : public TraceFile {
 public:
  explicit JsonTrace(const std::filesystem::path& file) : file_(file) {
    file_.write("{\"displayTimeUnit\": \"ns\", \"traceEvents\": [");
    event(R"json({"ph": "M", "pid": 1, "name": "process_name", "args": {"name": "GPU (model time)"}})json");
  }
  void track(int number, const std::string& name) override {
    event(fmt::format(R"({{"ph": "M", "pid": 1, "tid": {}, "name": "thread_name", "args": {{"name": "{}"}}}})", number,
                      name));
    event(fmt::format(
        R"({{"ph": "M", "pid": 1, "tid": {0}, "name": "thread_sort_index", "args": {{"sort_index": {0}}}}})", number));
  }
  void slice(int track, std::string_view name, double begin, double end, std::span<const Argument> arguments) override {
    std::string text;
    for (const Argument& argument : arguments) {
      const bool word = std::holds_alternative<std::string>(argument.value);
      const std::string value = std::visit([](const auto& of) { return fmt::format("{}", of); }, argument.value);
      text += fmt::format("{}\"{}\": {}", text.empty() ? "" : ", ", argument.name, word ? '"' + value + '"' : value);
    }
    event(fmt::format(R"({{"ph": "X", "pid": 1, "tid": {}, "name": "{}", "ts": {}, "dur": {}, "args": {{{}}}}})", track,
                      name, begin, end - begin, text));
  }
  void counter(std::string_view name, std::string_view unit, double at, double value) override {
    event(
        fmt::format(R"({{"ph": "C", "pid": 1, "name": "{}", "ts": {}, "args": {{"{}": {}}}}})", name, at, unit, value));
  }
  void commit() override {
    file_.write("\n]}\n");
    file_.commit();
  }

 private:
  void event(const std::string& text) {
    file_.write(first_ ? "\n" : ",\n");
    file_.write(text);
    first_ = false;
  }

  OutputFile file_;
  bool first_ = true;
};

// Protocol buffers' wire format: a field is its number and type, then its value.
class Message {
 public:
  Message& number(std::uint32_t field, std::uint64_t value) {
    varint(field << 3);
    varint(value);
    return *this;
  }
  Message& real(std::uint32_t field, double value) {
    varint(field << 3 | 1);
    const auto bits = std::bit_cast<std::uint64_t>(value);
    for (int k = 0; k < 64; k += 8) bytes_ += static_cast<char>(bits >> k & 0xFF);
    return *this;
  }
  Message& text(std::uint32_t field, std::string_view value) {
    varint(field << 3 | 2);
    varint(value.size());
    bytes_ += value;
    return *this;
  }
  Message& message(std::uint32_t field, const Message& value) { return text(field, value.bytes_); }
  const std::string& bytes() const { return bytes_; }

 private:
  void varint(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) bytes_ += static_cast<char>(value | 0x80);
    bytes_ += static_cast<char>(value);
  }
  std::string bytes_;
};

// Field numbers of perfetto/trace/*.proto that the file uses.
namespace field {
constexpr std::uint32_t kTracePacket = 1;
constexpr std::uint32_t kTimestamp = 8, kSequence = 10, kTrackEvent = 11, kTrackDescriptor = 60;  // TracePacket
constexpr std::uint32_t kUuid = 1, kName = 2, kProcess = 3, kParent = 5, kCounter = 8, kOrdering = 11,
                        kRank = 12;                                                             // TrackDescriptor
constexpr std::uint32_t kPid = 1, kProcessName = 6;                                             // ProcessDescriptor
constexpr std::uint32_t kUnitName = 6;                                                          // CounterDescriptor
constexpr std::uint32_t kAnnotation = 4, kType = 9, kTrack = 11, kEventName = 23, kValue = 44;  // TrackEvent
constexpr std::uint32_t kUint = 3, kDouble = 5, kString = 6, kAnnotationName = 10;              // DebugAnnotation
}  // namespace field

// Begins and ends are separate events; readers take events of the same nanosecond in the order of the file.
class ProtobufTrace final : public TraceFile {
 public:
  explicit ProtobufTrace(const std::filesystem::path& file) : file_(file) {
    constexpr std::uint64_t kExplicit = 3;
    Message process, descriptor;
    process.number(field::kPid, 1).text(field::kProcessName, "GPU (model time)");
    descriptor.number(field::kUuid, kGpu).text(field::kName, "GPU (model time)").message(field::kProcess, process);
    descriptor.number(field::kOrdering, kExplicit);
    describe(descriptor);
  }
  void track(int number, const std::string& name) override {
    Message descriptor;
    descriptor.number(field::kUuid, uuid(number)).text(field::kName, name).number(field::kParent, kGpu);
    describe(descriptor.number(field::kRank, static_cast<std::uint64_t>(number)));
  }
  void slice(int track, std::string_view name, double begin, double end, std::span<const Argument> arguments) override {
    const std::uint64_t from = nanoseconds(begin), to = nanoseconds(end);
    if (to <= from) return;
    close(track, from);
    Message event = event_of(kBegin, uuid(track));
    event.text(field::kEventName, name);
    for (const Argument& argument : arguments) {
      Message note;
      note.text(field::kAnnotationName, argument.name);
      if (const auto* whole = std::get_if<std::uint64_t>(&argument.value)) note.number(field::kUint, *whole);
      if (const auto* real = std::get_if<double>(&argument.value)) note.real(field::kDouble, *real);
      if (const auto* word = std::get_if<std::string>(&argument.value)) note.text(field::kString, *word);
      event.message(field::kAnnotation, note);
    }
    packet(from, event);
    open_[track].push_back(to);
  }
  void counter(std::string_view name, std::string_view unit, double at, double value) override {
    const auto [found, fresh] = counters_.try_emplace(std::string(name), kFirstCounter + counters_.size());
    if (fresh) {
      Message of, descriptor;
      of.text(field::kUnitName, unit);
      descriptor.number(field::kUuid, found->second).text(field::kName, name).number(field::kParent, kGpu);
      describe(descriptor.message(field::kCounter, of));
    }
    packet(nanoseconds(at), event_of(kCounterType, found->second).real(field::kValue, value));
  }
  void flush() override {
    for (const auto& [track, ends] : open_) close(track, ~std::uint64_t{0});
  }
  void commit() override {
    flush();
    file_.commit();
  }

 private:
  static constexpr std::uint64_t kBegin = 1, kEnd = 2, kCounterType = 4;  // TrackEvent.Type
  static constexpr std::uint64_t kGpu = 1, kFirstTrack = 1000, kFirstCounter = 100;
  static std::uint64_t uuid(int track) { return kFirstTrack + static_cast<std::uint64_t>(track); }
  static std::uint64_t nanoseconds(double microseconds) {
    return static_cast<std::uint64_t>(std::floor(microseconds * 1000));
  }
  static Message event_of(std::uint64_t type, std::uint64_t track) {
    Message event;
    event.number(field::kType, type).number(field::kTrack, track);
    return event;
  }

  // Ends the slices that end by `now`, the innermost first.
  void close(int track, std::uint64_t now) {
    std::vector<std::uint64_t>& ends = open_[track];
    for (; !ends.empty() && ends.back() <= now; ends.pop_back()) packet(ends.back(), event_of(kEnd, uuid(track)));
  }
  void describe(const Message& descriptor) {
    Message packet;
    write(packet.number(field::kSequence, 1).message(field::kTrackDescriptor, descriptor));
  }
  void packet(std::uint64_t at, const Message& event) {
    Message packet;
    packet.number(field::kTimestamp, at).number(field::kSequence, 1).message(field::kTrackEvent, event);
    write(packet);
  }
  void write(const Message& packet) {
    Message trace;
    file_.write(trace.message(field::kTracePacket, packet).bytes());
  }

  OutputFile file_;
  std::map<int, std::vector<std::uint64_t>> open_;  // ends of the open slices, by track
  std::map<std::string, std::uint64_t> counters_;
};

}  // namespace

std::unique_ptr<TraceFile> open_trace_file(const std::filesystem::path& file) {
  const std::string extension = file.extension().string();
  if (extension == ".pftrace" || extension == ".perfetto-trace") return std::make_unique<ProtobufTrace>(file);
  return std::make_unique<JsonTrace>(file);
}

}  // namespace tessera::gpu
