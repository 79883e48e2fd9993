#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

#include "replay/tradeoff/results.h"

namespace tessera::replay {

// A trial's result as points/HASH.json keeps it:
//   {"schema": "tessera.trial/1",
//    "error": {"psnr_db": null for an equal image, "ssim", "flip", "max_error"},   against the reference, as shown;
//              null of a trial that only times a frame
//    "picture": SHA-256 of its linear values,
//    "values": every counter, cycle and energy of the compared frame that is not 0, by its name ({} in double),
//    "host": {"seconds": [one per round], "processor_seconds": [...]}}
//
// Invariants (cited by the tests):
//   TF1  read_trial() returns exactly the result that write_trial() wrote, to the last bit.
//   TF2  A file that is cut short, lacks a member, or has one of another type or beyond its range is refused:
//        InputError with the file and the byte or the JSON pointer. Every accepted trial is valid input for judge().

// Null without an error.
nlohmann::json error_json(const std::optional<ImageError>& error);

// Writes the file whole or not at all. Throws WriteError.
void write_trial(const std::filesystem::path& file, const TrialResult& trial);

// `timed`: Trial::timed, which decides whether there is an error.
TrialResult read_trial(const std::filesystem::path& file, bool timed);

}  // namespace tessera::replay
