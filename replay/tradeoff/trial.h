#pragma once

#include <map>
#include <string>
#include <vector>

#include "gpu/device.h"
#include "replay/tradeoff/packed_captures.h"
#include "replay/tradeoff/results.h"
#include "replay/tradeoff/work_clock.h"

namespace tessera::replay {

// One complete configuration of the machine, and the way to its last frame.
struct Trial {
  gpu::RunSettings settings;
  gpu::GpuConfiguration gpu;
  bool in_double = false;
  Packing packing;
  bool stored = false;     // the compared image has the frame buffer's format
  bool timed = false;      // a record of the frame is timed and nothing is rendered; host times measure the timing
  std::string left_out{};  // effect of the scene that is left out (PackedCaptures::without); "": none
  std::string hash{};      // 32 digits: hash of all inputs of the result; equal configurations are one trial
};

// Inputs that all trials share.
struct TrialPlace {
  int width = 640, height = 360;
  int frame = 0;        // the compared frame
  int first_frame = 0;  // with resolve.desampling=adaptive rendering starts at this frame
  int rounds = 3;
  std::string inputs;     // fingerprints of capture and program
  std::string reference;  // inputs of the reference with which images are compared
};

// Records for timed trials: each frame is rendered once for all machines that time it.
struct FrameRecords {
  struct Record {
    std::vector<timing::FrameWork> views;
    Image color;
    std::map<std::string, Figure> figures;
  };
  std::map<std::string, Record> known;  // by all inputs of a record
};

// Name from all inputs of a timed trial's record: trials with the same name share one.
std::string record_name(const Trial& trial);

// Estimated host time of a trial, in units of one round of the frame with four samples a pixel; a WorkClock measures
// that unit.
struct TrialWork {
  double before = 0;  // frames before the compared one
  double record = 0;  // the frame whose record is timed, for the first of the trials that share it
  double round = 1;
};
WorkKind kind_of(const Trial& trial);  // kind of its rounds
TrialWork expected_work(const Trial& trial, const TrialPlace& place);
double all_work(const Trial& trial,
                const TrialPlace& place);  // all its rounds and the previous frames, without the record

// Fills `hash`.
void name_trial(Trial& trial, const TrialPlace& place);

// SHA-256 of an image's values.
std::string values_sha256(const Image& image);

// Renders the compared frame of a trial once.
gpu::FrameResult render_trial(PackedCaptures& captures, const Trial& trial, const TrialPlace& place);

// Runs all trials round by round, so that disturbances of the host meet all of them alike. Returns the results in
// order. The time of a trial is its compared frame's time alone. Throws UsageError for values that do not fit together.
// Returns nothing when stop_requested() before the last trial ends. `reference_linear` may be null where all trials are
// timed. `clock` receives all finished work.
std::vector<TrialResult> run_trials(PackedCaptures& captures, const std::vector<Trial>& trials, const TrialPlace& place,
                                    const Image* reference_linear, FrameRecords& records, WorkClock& clock);

}  // namespace tessera::replay
