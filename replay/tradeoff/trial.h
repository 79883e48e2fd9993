#pragma once

#include <map>
#include <string>
#include <vector>

#include "gpu/device.h"
#include "replay/tradeoff/packed_captures.h"
#include "replay/tradeoff/results.h"
#include "replay/tradeoff/work_clock.h"

namespace tessera::replay {

// One complete configuration of the machine, and of how its last frame is come to.
struct Trial {
  gpu::RunSettings settings;
  gpu::GpuConfiguration gpu;
  bool in_double = false;
  Packing packing;
  bool stored = false;     // the image is what the frame buffer holds
  bool timed = false;      // a record of the frame is timed and nothing is rendered; host times measure the timing
  std::string left_out{};  // an effect of the scene that it is drawn without (PackedCaptures::without); "": none
  std::string hash{};      // 32 digits: of everything that the result follows from; equal configurations are one trial
};

// What trials have in common.
struct TrialPlace {
  int width = 640, height = 360;
  int frame = 0;        // the one that is compared
  int first_frame = 0;  // with resolve.desampling=adaptive the frames from here on come first
  int rounds = 3;
  std::string inputs;     // fingerprints of capture and program
  std::string reference;  // what the reference that images are compared with is made with
};

// What timed trials time: each frame is rendered once, whatever machines time it.
struct FrameRecords {
  struct Record {
    std::vector<timing::FrameWork> views;
    Image color;
    std::map<std::string, Figure> figures;
  };
  std::map<std::string, Record> known;  // by all that a record depends on
};

// All that a timed trial's record depends on: trials with the same name share one.
std::string record_name(const Trial& trial);

// Host time of a trial in rounds of the frame with four samples a pixel, roughly: a WorkClock measures how long that is.
struct TrialWork {
  double before = 0;  // frames before the compared one
  double record = 0;  // the frame whose record is timed, for the first trial of those that share it
  double round = 1;
};
WorkKind kind_of(const Trial& trial);  // of its rounds
TrialWork expected_work(const Trial& trial, const TrialPlace& place);
double all_work(const Trial& trial,
                const TrialPlace& place);  // all of its rounds, and the frames before, without the record

// Fills `hash`.
void name_trial(Trial& trial, const TrialPlace& place);

// SHA-256 of an image's values.
std::string values_sha256(const Image& image);

// Renders the compared frame of a trial once.
gpu::FrameResult render_trial(PackedCaptures& captures, const Trial& trial, const TrialPlace& place);

// Runs all of them, round by round, so that whatever else the host does meets all of them alike. The results, in order.
// The time of a trial is that of its compared frame alone. Throws UsageError for values that do not fit each other.
// Empty when stop_requested() before the last of them. `reference_linear` may be null where all are timed. `clock` is told
// of everything that is finished.
std::vector<TrialResult> run_trials(PackedCaptures& captures, const std::vector<Trial>& trials, const TrialPlace& place,
                                    const Image* reference_linear, FrameRecords& records, WorkClock& clock);

}  // namespace tessera::replay
