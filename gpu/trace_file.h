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
  // Declares a track before its slices. Readers order tracks by their numbers.
  virtual void track(int number, const std::string& name) = 0;
  // Slices of a track are disjoint or nested; an outer slice comes before its inner ones.
  virtual void slice(int track, std::string_view name, double begin, double end,
                     std::span<const Argument> arguments = {}) = 0;
  virtual void counter(std::string_view name, std::string_view unit, double at, double value) = 0;
  // Promises that no later slice begins before the present ones.
  virtual void flush() {}
  // Finishes the file. Throws WriteError, as all others do.
  virtual void commit() = 0;
};

// FILE.pftrace and FILE.perfetto-trace are Perfetto's protobuf (TracePacket with TrackEvent). Any other name gives
// Chrome's JSON, one event a line, which Perfetto reads as well.
std::unique_ptr<TraceFile> open_trace_file(const std::filesystem::path& file);

}  // namespace tessera::gpu
