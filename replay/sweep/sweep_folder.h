#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "replay/point_files.h"
#include "replay/sweep/points.h"
#include "replay/sweep/study.h"

namespace tessera::replay {

// The output folder of a sweep:
//   sweep.json          the study with all its points and their hashes; the same from every shard
//   points/HASH.json    the result of one point: {"schema": "tessera.point/1", "frames": [...]} or {..., "fault": TEXT}
//   points/HASH_NNNN.png, HASH_tiles_NNNN.json   with "images"
//   records/FUNCTION.record                      of a render while some of its points are not timed; with "records" kept
//   sweep.csv, report.html                       made from these by join_sweep() and the report
//   split.csv                                    likewise, with "split"
//
// Invariants (cited by the tests):
//   SW1  A file is written whole or not at all; a point's .json is written last, so an existing point is complete.
//   SW2  The contents of the folder after all points are done depend on the study, the captures and the program alone:
//        not on the number of interruptions, shards or threads.
//   SW3  A point with a result is not computed again; a point with a damaged result is.
class SweepFolder {
 public:
  explicit SweepFolder(std::filesystem::path folder) : folder_(std::move(folder)), points_(folder_) {}

  const std::filesystem::path& path() const { return folder_; }
  std::filesystem::path point_file(const std::string& hash) const { return points_.file(hash); }
  std::filesystem::path image_file(const std::string& hash, int frame) const;
  std::filesystem::path tiles_file(const std::string& hash, int frame) const;
  std::filesystem::path record_file(const std::string& function) const;
  bool has_point(const std::string& hash) const { return points_.has(hash); }
  // The result of a point; nothing where it is missing or damaged.
  std::optional<nlohmann::json> read_point(const std::string& hash) const;

  // Writes sweep.json; returns false if it existed with the same content.
  bool write_manifest(const Study& study, const std::vector<SweepPoint>& points) const;

 private:
  std::filesystem::path folder_;
  PointFiles points_;
};

// Held while a sweep works in a folder: several shards may share it, a whole sweep has it alone. A sweep that is alone
// there removes incomplete files of killed runs. On file systems without locks it does nothing.
class SweepLock {
 public:
  // Throws WriteError when another command has the folder, or it cannot be written.
  SweepLock(const SweepFolder& folder, bool shared);
  ~SweepLock();
  SweepLock(const SweepLock&) = delete;
  SweepLock& operator=(const SweepLock&) = delete;

 private:
  int descriptor_ = -1;
};

// One point and frame of a joined sweep; `frame` is null where the point has a fault, `tiles` and `image` where they
// were not kept.
struct SweepRow {
  std::size_t point = 0;
  nlohmann::json frame;
  std::string status;  // "ok", or the fault
};

// The results of a sweep, read back from its folder.
struct JoinedSweep {
  nlohmann::json manifest;     // its "columns" without the ones that are 0 or empty in all rows, except for "kept" ones
  std::vector<SweepRow> rows;  // by point, then by frame
  std::vector<std::size_t> missing;  // points without a result yet, or with a damaged one
};
// Throws InputError when the folder holds no sweep or its sweep.json is damaged.
JoinedSweep join_sweep(const SweepFolder& folder);

// point,hash,capture,AXES...,frame,status,COLUMNS...; a row per point and frame, no host times. Cells of counters whose
// unit did not run are empty.
std::string sweep_csv(const JoinedSweep& sweep);

// point,hash,capture,AXES...,frame,view,split,SPLIT_COLUMNS...: a row for each drawable, material or tile of each view
// (eye) of the frames of all points; cells that a split lacks are empty. "" for a study without a split.
std::string split_csv(const JoinedSweep& sweep);

// A candidate of a study: points with the same values, one for each capture.
struct Candidate {
  std::size_t point = 0;  // the first of its points
  std::string label;      // "tile.width=16 ..."
  Score score;
  std::vector<double> values;  // the mean of each column of the goal (goal_columns())
  bool meets_limits() const { return score.violation == 0; }
};
// Candidates sorted by the manifest's goal, the best first; without a goal by cycles, or by time where clocks vary.
// Candidates without frames are left out.
std::vector<Candidate> rank_candidates(const JoinedSweep& sweep);
// The goal by which candidates are sorted.
Goal goal_of(const nlohmann::json& manifest);

// Writes sweep.csv, and split.csv where the study asks for it.
void write_tables(const SweepFolder& folder, const JoinedSweep& sweep);

}  // namespace tessera::replay
