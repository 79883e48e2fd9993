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

// `replay --record FILE`: the work of the machine's units in each frame, to be timed again on other machines (`tessera
// time FILE`). Content of the file, all numbers little endian:
//
//   "tessera.record/5\n"
//   u64 bytes, then that many bytes of JSON: the capture, the machine and the settings of the replay
//   for each frame   "F", u64 number, u64 views; for each view (eye)
//                    u64 bytes of timing::encode(), u64 bytes of its Zstandard frame, and that
//   "E"
//
// Invariants (cited by the tests):
//   RF1  The reader returns the written work, frame by frame.
//   RF2  The reader refuses a truncated or damaged file with its name and the byte, and a file whose frames need more than
//        the reader's limit.
class RecordWriter {
 public:
  // Throws the errors of OutputFile.
  RecordWriter(const std::filesystem::path& file, const nlohmann::json& head);

  // Writes the work of each eye.
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
  // Throws InputError, and LimitError if a frame needs more than max_bytes.
  explicit RecordReader(const std::filesystem::path& file, std::uint64_t max_bytes = std::uint64_t{1} << 30);

  const nlohmann::json& head() const { return head_; }
  // Returns the next frame; nullopt after the last.
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

// The head of a record. Its "events" are the names of the events that the work counts (hardware/events.def); a reader
// refuses a record of other events. Its "drawables" give the drawables of items: {"first", "stride", "count", "node",
// "material"}; the head omits them if there are more than 65536.
nlohmann::json record_head(const std::string& capture, const scene::Assembly& assembly, const GpuConfiguration& gpu,
                           const RunSettings& settings, int width, int height);

// The machine and the settings of a head. Throws InputError naming `file`.
struct RecordedMachine {
  GpuConfiguration gpu;
  RunSettings settings;
};
RecordedMachine recorded_machine(const nlohmann::json& head, const std::string& file);

// The keys that a record depends on: the machine and the settings, without the keys that only its timing reads
// (KeyInfo::timing). If a cost criterion of the splitter is chosen, the keys that it reads are included.
nlohmann::json functional_json(const GpuConfiguration& gpu, const RunSettings& settings);

// Throws UsageError naming the first key whose value in `gpu` would have led to another record than the machine of
// `head`. With machine.timing=events the sizes of texture cache and L2 are exempt: the record holds the requests to
// them.
void check_same_function(const nlohmann::json& head, const GpuConfiguration& gpu, const RunSettings& settings);

}  // namespace tessera::gpu
