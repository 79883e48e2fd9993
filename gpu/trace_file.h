#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <variant>

namespace tessera::gpu {

// A file of slices on named tracks and of counters over time. Times are microseconds.
class TraceFile {
 public:
  struct Argument {
    std::string_view name;
    std::variant<std::uint64_t, double, std::string> value;
  };

  virtual ~TraceFile() = default;
  // Before its slices. Readers show tracks by their numbers.
  virtual void track(int number, const std::string& name) = 0;
  // Slices of a track are disjoint or one holds the other; one that holds others comes before them.
  virtual void slice(int track, std::string_view name, double begin, double end,
                     std::span<const Argument> arguments = {}) = 0;
  virtual void counter(std::string_view name, std::string_view unit, double at, double value) = 0;
  // Nothing that comes begins before what was there.
  virtual void flush() {}
  // Finishes the file. Throws WriteError, as all others do.
  virtual void commit() = 0;
};

// FILE.pftrace, FILE.perfetto-trace: Perfetto's protobuf (TracePacket with TrackEvent). Another: Chrome's JSON, one event
// a line, which Perfetto reads as well.
std::unique_ptr<TraceFile> open_trace_file(const std::filesystem::path& file);

}  // namespace tessera::gpu
