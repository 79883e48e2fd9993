#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include <nlohmann/json.hpp>

namespace tessera::reference {

// Fall of the error with the number of samples, measured on a smaller image of the same frame by four series of independent seeds.
struct Convergence {
  int width = 0, height = 0;
  std::vector<int> samples;       // numbers of samples per pixel
  std::vector<double> rms_error;  // one for each number
  std::optional<double> slope;    // slope of log(error) over log(samples); empty for a single number
  bool operator==(const Convergence&) const = default;
};

// Data about a reference beside its image.
struct ReferenceInfo {
  int samples = 0, asked_samples = 0;  // per pixel: samples taken, and their limit
  std::optional<double> enough_db;     // PSNR at which sampling stops; empty: all samples are taken
  double edge_pixels = 0;
  std::uint64_t triangles = 0;               // triangles that samples may see
  std::optional<double> rms_error, psnr_db;  // noise of the image, from the difference of its two halves
  Convergence convergence;
  struct Host {
    double wall_seconds = 0, processor_seconds = 0, convergence_processor_seconds = 0;
    bool operator==(const Host&) const = default;
  } host;
  bool operator==(const ReferenceInfo&) const = default;
};

// JSON: {"samples", "asked_samples", "enough_db", "edge_pixels", "triangles", "rms_error", "psnr_db", "convergence": {"size",
// "samples", "rms_error", "slope"}, "host": {"seconds", "processor_seconds", "convergence_processor_seconds"}}
nlohmann::json reference_info_json(const ReferenceInfo& info);

// Reads the file back, exact to the last bit. Throws InputError with the file and the byte or the JSON pointer.
ReferenceInfo read_reference_info(const std::filesystem::path& file);

}  // namespace tessera::reference
