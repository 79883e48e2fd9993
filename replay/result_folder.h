#pragma once

#include <filesystem>
#include <vector>

namespace tessera::replay {

// Folders of results (--out), by kind of command.
//
// Invariants (cited by the tests):
//   RFO1  A folder holds the results of one kind of command: a command of another kind is refused before it writes
//         anything.
//   RFO2  After a replay its folder holds frames of that replay alone, and no file of an earlier replay.
enum class ResultKind { kReplay, kSweep, kTradeoff };

// Throws UsageError when `folder` holds results of another kind.
void check_results_of(ResultKind kind, const std::filesystem::path& folder);

// Numbers of the frames whose results a replay left in a folder, by its stats.csv; none without that file.
std::vector<int> frames_left_in(const std::filesystem::path& folder);

// The files that a replay wrote besides the images and tiles of its frames.
struct Written {
  std::vector<int> frames;  // in order
  bool right_eye = false, baselines = false, report = false;
};
// Removes results of these frames that an earlier replay left and this replay has not replaced.
void remove_earlier_results(const std::filesystem::path& folder, const std::vector<int>& earlier,
                            const Written& written);

}  // namespace tessera::replay
