// Perfetto's protobuf, read by a reader of its own and held against the JSON of the same frames.
#include "tests/support/tests.h"

namespace tessera::replay::perfetto_trace_test {
namespace {

// A message as the wire has it (protobuf.dev, "Encoding"): fields by number, in their order.
struct Field {
  std::uint64_t number = 0;  // of varints and of fixed numbers
  std::string_view bytes;    // of strings and messages
};
using Fields = std::multimap<std::uint32_t, Field>;

class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}
  bool done() const { return rest_.empty(); }
  // False where the bytes are no message.
  bool next(std::uint32_t& number, Field& field) {
    std::uint64_t tag = 0, length = 0;
    if (!varint(tag)) return false;
    number = static_cast<std::uint32_t>(tag >> 3);
    switch (tag & 7) {
      case 0:
        return varint(field.number);
      case 1:
        if (rest_.size() < 8) return false;
        field.number = 0;
        for (std::size_t k = 8; k-- > 0;) field.number = field.number << 8 | static_cast<unsigned char>(rest_[k]);
        rest_.remove_prefix(8);
        return true;
      case 2:
        if (!varint(length) || length > rest_.size()) return false;
        field.bytes = rest_.substr(0, length);
        rest_.remove_prefix(length);
        return true;
      default:
        return false;
    }
  }

 private:
  bool varint(std::uint64_t& value) {
    value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      if (rest_.empty()) return false;
      const auto byte = static_cast<unsigned char>(rest_.front());
      rest_.remove_prefix(1);
      value |= std::uint64_t{byte & 0x7Fu} << shift;
      if (byte < 0x80) return true;
    }
    return false;
  }
  std::string_view rest_;
};

std::optional<Fields> read(std::string_view bytes) {
  Fields fields;
  for (Reader reader(bytes); !reader.done();) {
    std::uint32_t number = 0;
    Field field;
    if (!reader.next(number, field)) return std::nullopt;
    fields.emplace(number, field);
  }
  return fields;
}
std::uint64_t number(const Fields& fields, std::uint32_t at) {
  const auto found = fields.find(at);
  return found == fields.end() ? 0 : found->second.number;
}
std::string text(const Fields& fields, std::uint32_t at) {
  const auto found = fields.find(at);
  return found == fields.end() ? "" : std::string(found->second.bytes);
}

using Slice = std::tuple<std::string, std::uint64_t, std::uint64_t, std::string>;  // track, begin, end, name
using Step = std::tuple<std::string, std::uint64_t, double>;                       // counter, time, value

struct Trace {
  std::multiset<Slice> slices;
  std::multiset<Step> steps;
  std::set<std::string> arguments;  // of tiles
  int wrong = 0;                    // packets without a message or track, and ends without a begin
};

// trace.proto, trace_packet.proto, track_descriptor.proto, track_event.proto, debug_annotation.proto.
Trace read_protobuf(const std::string& bytes) {
  Trace trace;
  std::map<std::uint64_t, std::string> tracks;
  struct Open {
    std::uint64_t begin;
    std::string name;
  };
  std::map<std::uint64_t, std::vector<Open>> open;
  std::map<std::uint64_t, std::uint64_t> last;
  const auto event = [&](const Fields& of, std::uint64_t at) {
    const std::uint64_t track = number(of, 11), type = number(of, 9);
    if (!tracks.contains(track)) return void(++trace.wrong);
    if (type == 4) return void(trace.steps.emplace(tracks[track], at, std::bit_cast<double>(number(of, 44))));
    if (at < last[track]) ++trace.wrong;  // events of a track in time
    last[track] = at;
    if (type == 1) {
      open[track].push_back({at, text(of, 23)});
      for (auto [note, end] = of.equal_range(4); note != end; ++note)
        if (const auto fields = read(note->second.bytes)) trace.arguments.insert(text(*fields, 10));
    } else if (type == 2 && !open[track].empty()) {
      trace.slices.emplace(tracks[track], open[track].back().begin, at, open[track].back().name);
      open[track].pop_back();
    } else {
      ++trace.wrong;
    }
  };
  const auto all = read(bytes);
  if (!all) return {{}, {}, {}, 1};
  for (const auto& [field, value] : *all) {
    const auto packet = field == 1 ? read(value.bytes) : std::nullopt;
    if (!packet) {
      ++trace.wrong;
      continue;
    }
    if (const auto at = packet->find(60); at != packet->end()) {
      const auto descriptor = read(at->second.bytes);
      if (descriptor) tracks[number(*descriptor, 1)] = text(*descriptor, 2);
    }
    if (const auto at = packet->find(11); at != packet->end())
      if (const auto of = read(at->second.bytes)) event(*of, number(*packet, 8));
  }
  for (const auto& [track, slices] : open) trace.wrong += static_cast<int>(slices.size());
  return trace;
}

Trace read_chrome(const json& events) {
  Trace trace;
  std::map<int, std::string> tracks;
  const auto nanoseconds = [](double us) { return static_cast<std::uint64_t>(std::floor(us * 1000)); };
  for (const json& e : events["traceEvents"]) {
    if (e["ph"] == "M" && e["name"] == "thread_name") tracks[e["tid"]] = e["args"]["name"];
    if (e["ph"] == "C") trace.steps.emplace(e["name"], nanoseconds(e["ts"]), e["args"].begin().value().get<double>());
    if (e["ph"] != "X") continue;
    const std::uint64_t begin = nanoseconds(e["ts"]), end = nanoseconds(e["ts"].get<double>() + e["dur"].get<double>());
    if (end > begin) trace.slices.emplace(tracks[e["tid"]], begin, end, e["name"]);
    for (const auto& [name, value] : e["args"].items()) trace.arguments.insert(name);
  }
  return trace;
}

std::string capture(const char* name) { return test::shipped_capture(name).string(); }

std::string traced(const test::TemporaryFolder& out, const char* file) {
  const test::ProcessResult r = run_tessera({"replay", capture("serpent"), "--size", "320x180", "--frames", "0:2",
                                             "--set", "tilecore.memory_bytes=1048576", "--quiet", "--no-report",
                                             "--out", out.path().string(), "--trace", (out / file).string()});
  EXPECT_EQ(r.status, 0) << r.errors;
  return test::read_text(out / file);
}

// TL2: both forms hold the same.
TEST(PerfettoTrace, HoldsTheSlicesAndCountersOfTheJson) {
  const test::TemporaryFolder out;
  const Trace expected = read_chrome(json::parse(traced(out, "t.json")));
  for (const char* file : {"t.pftrace", "t.perfetto-trace"}) {
    const Trace trace = read_protobuf(traced(out, file));
    EXPECT_EQ(trace.wrong, 0) << file;
    EXPECT_EQ(trace.slices.size(), expected.slices.size()) << file;
    EXPECT_TRUE(trace.slices == expected.slices) << file;
    EXPECT_TRUE(trace.steps == expected.steps) << file;
    EXPECT_EQ(trace.arguments, expected.arguments);
  }
  for (const char* name :
       {"x", "y", "cycles_waiting_for_unit", "cycles_waiting_for_first_data", "cycles_waiting_for_bandwidth"})
    EXPECT_TRUE(expected.arguments.contains(name)) << name;
}

// The reader itself: a file that is cut short, or in which a slice ends twice, is not taken.
TEST(PerfettoTrace, ADamagedFileIsNoticed) {
  const test::TemporaryFolder out;
  const std::string whole = traced(out, "t.pftrace");
  ASSERT_EQ(read_protobuf(whole).wrong, 0);
  EXPECT_GT(read_protobuf(whole.substr(0, whole.size() - 3)).wrong, 0);
  // The last packet again.
  std::size_t last = 0;
  for (std::size_t at = 0; at < whole.size();) {
    last = at;
    ASSERT_EQ(whole[at], 0x0a);
    std::size_t length = 0;
    int shift = 0;
    for (++at; (whole[at] & 0x80) != 0; ++at, shift += 7) length |= std::size_t{whole[at] & 0x7Fu} << shift;
    length |= std::size_t{static_cast<unsigned char>(whole[at])} << shift;
    at += 1 + length;
  }
  EXPECT_EQ(read_protobuf(whole + whole.substr(last)).wrong, 1);
}

}  // namespace
}  // namespace tessera::replay::perfetto_trace_test
