#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"

namespace tessera::fuzz {

using Bytes = std::span<const std::uint8_t>;
using Generator = std::minstd_rand;

// A fuzz target returns for any bytes. A refusal is one of the project's errors and is swallowed by run(); every
// other failure (a broken invariant, a report of the sanitizers, a leak, a hang, a single allocation beyond
// kMaxBytes, or 256 MiB more where Draco takes part, see fuzz_main.cpp) ends the program.
struct Target {
  std::string_view name;
  std::string_view about;
  std::size_t max_bytes;  // of an input
  void (*run)(Bytes input);
  std::vector<std::string> (*seeds)();  // inputs to begin with, made by code
  // Changes an input in place and returns its new size, at most `max_size`; nullptr leaves all mutations to
  // libFuzzer.
  std::size_t (*mutate)(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random);
};

// Targets of the program, from all_targets.cpp or decoder_targets.cpp.
std::span<const Target> targets();

// Memory limit of one input, from the program's own limits (--max-memory, ImageLimits).
inline constexpr std::uint64_t kMaxBytes = 64ull << 20;

// libFuzzer's mutations of plain bytes.
std::size_t mutate_bytes(std::uint8_t* data, std::size_t size, std::size_t max_size);

// Ends the program with a message when something that was accepted is not sound.
void require(bool holds, const char* what);

// Runs work that may refuse its input: UsageError, InputError and LimitError are answers.
template <class Work>
void expect_answer(const Work& work) {
  try {
    work();
  } catch (const UsageError&) {
  } catch (const InputError&) {
  } catch (const LimitError&) {
  }
}

// A folder in memory for this process, removed at its end. Every target writes its input to files there, because the
// decoders' interface is a file.
const std::filesystem::path& scratch_folder();
void write_scratch(const std::filesystem::path& file, Bytes bytes);
void write_scratch(const std::filesystem::path& file, std::string_view text);

// The targets, with the file that defines them.
extern const Target kCaptureTarget, kDracoTarget, kMeshoptTarget, kReplayTarget;               // a file each
extern const Target kStudyTarget, kMachineTarget, kOptionTarget, kResultTarget, kPointTarget;  // text_targets.cpp
extern const Target kImageTarget, kWebpTarget, kExrTarget, kRadianceTarget, kHistoryTarget;    // image_targets.cpp
extern const Target kKtx2Target;                                                               // ktx2_target.cpp
extern const Target kProgramTarget;                                                            // program_target.cpp

}  // namespace tessera::fuzz
