#pragma once

#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "replay/sweep/study.h"
#include "replay/sweep/unit_samples.h"
#include "scene/gltf/place.h"

namespace tessera::replay {

// "sample" and "goal" of a study file:
//   {"method": "latin_hypercube" | "random", "points": N, "seed": S}
//   {"minimise" or "maximise": COLUMN, "subject_to": {COLUMN: {"at_most": X, "at_least": Y}, ...}, "points": N,
//    "population": P, "seed": S}
// Columns are numbers of known_columns(). Both throw InputError.
Sample read_sample(const nlohmann::json& value, const scene::gltf::Place& place);
Goal read_goal(const nlohmann::json& value, const scene::gltf::Place& place);

// Refuses a goal without axes; chooses the population where the goal does not: five for each axis, from 8 to 40.
void check_axes_of_goal(const scene::gltf::Place& place, Study& study);

// The objective's column, then the columns with limits.
std::vector<std::string> goal_columns(const Goal& goal);

// Adds the columns that a goal names to the study's tables.
void add_columns_of_goal(Study& study);

// Scores one candidate from its frames (frame_json()) of all captures. The objective is the mean over the frames. A
// limit holds for each frame, and the worst one sets its violation, as a part of the limit. A frame without the column
// misses every limit; so does a candidate without frames.
Score score_of(const Goal& goal, std::span<const nlohmann::json> frames);

// For people: "energy.total_nj 1.2e+06".
std::string objective_text(const Goal& goal, const Score& score);

// Members of sweep.json.
nlohmann::json sample_json(const Sample& sample);
nlohmann::json goal_json(const Goal& goal);

}  // namespace tessera::replay
