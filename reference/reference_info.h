#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include <nlohmann/json.hpp>

namespace tessera::reference {

// How the error of a smaller image of the same frame falls, from four series of independent seeds.
struct Convergence {
  int width = 0, height = 0;
  std::vector<int> samples;       // per pixel
  std::vector<double> rms_error;  // one for each
  std::optional<double> slope;    // of its logarithm over that of the samples; nothing for a single number of them
  bool operator==(const Convergence&) const = default;
};

// What is said of a reference beside its image.
struct ReferenceInfo {
  int samples = 0, asked_samples = 0;  // per pixel: those taken, and the most that were to be taken
  std::optional<double> enough_db;     // it ends where psnr_db is at least this; nothing: it takes all samples
  double edge_pixels = 0;
  std::uint64_t triangles = 0;               // those that samples may see
  std::optional<double> rms_error, psnr_db;  // what is left of its own noise, from the difference of its two halves
  Convergence convergence;
  struct Host {
    double wall_seconds = 0, processor_seconds = 0, convergence_processor_seconds = 0;
    bool operator==(const Host&) const = default;
  } host;
  bool operator==(const ReferenceInfo&) const = default;
};

// {"samples", "asked_samples", "enough_db", "edge_pixels", "triangles", "rms_error", "psnr_db", "convergence": {"size",
// "samples", "rms_error", "slope"}, "host": {"seconds", "processor_seconds", "convergence_processor_seconds"}}
nlohmann::json reference_info_json(const ReferenceInfo& info);

// Reads it back, to the last bit. Throws InputError with the file and the byte or the JSON pointer.
ReferenceInfo read_reference_info(const std::filesystem::path& file);

}  // namespace tessera::reference
