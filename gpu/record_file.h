#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/output_file.h"
#include "gpu/configuration.h"
#include "gpu/settings.h"
#include "scene/assembly.h"
#include "timing/work.h"

namespace tessera::gpu {

// `replay --record FILE`: what the units of the machine did in each frame, to be timed again on other machines
// (`tessera time FILE`). What is in the file, all numbers little endian:
//
//   "tessera.record/5\n"
//   u64 bytes, then so many of JSON: what was replayed, the machine and the settings it was replayed with
//   for each frame   "F", u64 number, u64 views; for each view (eye)
//                    u64 bytes of timing::encode(), u64 bytes of its Zstandard frame, and that
//   "E"
//
// Invariants (cited by the tests):
//   RF1  The reader gives back what was written, frame by frame.
//   RF2  A file that was cut off or damaged is refused with its name and the byte; so is one whose frames need more than
//        the reader's limit.
class RecordWriter {
 public:
  // Throws what OutputFile throws.
  RecordWriter(const std::filesystem::path& file, const nlohmann::json& head);

  // The work of each eye.
  void add(int frame, const std::vector<const timing::FrameWork*>& views);
  void commit();

 private:
  void number(std::uint64_t value);

  OutputFile file_;
};

struct RecordedFrame {
  int frame = 0;
  std::vector<timing::FrameWork> views;
};

class RecordReader {
 public:
  // Throws InputError, and LimitError where a frame needs more than max_bytes.
  explicit RecordReader(const std::filesystem::path& file, std::uint64_t max_bytes = std::uint64_t{1} << 30);

  const nlohmann::json& head() const { return head_; }
  // None after the last.
  std::optional<RecordedFrame> next();

 private:
  [[noreturn]] void refuse(const std::string& reason) const;
  std::string bytes(std::uint64_t count);
  std::uint64_t number();
  std::uint64_t size(const char* of);

  std::filesystem::path name_;
  std::ifstream file_;
  std::uint64_t at_ = 0, max_bytes_;
  nlohmann::json head_;
};

// The head of a record. Its "events" are the names of the events that the work is made of (hardware/events.def); a record
// of other events is refused. Its "drawables" name what items belong to: {"first", "stride", "count", "node", "material"};
// without them where there are more than 65536.
nlohmann::json record_head(const std::string& capture, const scene::Assembly& assembly, const GpuConfiguration& gpu,
                           const RunSettings& settings, int width, int height);

// The machine and the settings of a head. Throws InputError naming `file`.
struct RecordedMachine {
  GpuConfiguration gpu;
  RunSettings settings;
};
RecordedMachine recorded_machine(const nlohmann::json& head, const std::string& file);

// What a record depends on: the machine and the settings, but for the keys that only its timing reads (KeyInfo::timing).
// Those that a cost criterion of the splitter reads are among it where that is chosen.
nlohmann::json functional_json(const GpuConfiguration& gpu, const RunSettings& settings);

// Throws UsageError naming the first key by which `gpu` would have made another record than the machine of `head`. With
// machine.timing=events the sizes of texture cache and L2 are none: what is asked of them is in the record.
void check_same_function(const nlohmann::json& head, const GpuConfiguration& gpu, const RunSettings& settings);

}  // namespace tessera::gpu
