#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "replay/compare/comparison.h"

namespace tessera::replay {

// {"ssim", "flip", "max_difference", "psnr_db" (null: identical)} of what a display shows of two images; EXR files are
// tone mapped first. `map_file`, if any: FLIP as a heat map. `mask_file`, if any: only pixels that it covers count.
// Throws InputError, and UsageError for images of different sizes.
nlohmann::json compare_images(const std::filesystem::path& a, const std::filesystem::path& b,
                              const std::string& map_file, const std::string& mask_file);

// The same of all images that the folders of two runs have of these frames: rows with "frame", and "run", the label of
// the second. What cannot be compared is one of `notes`.
nlohmann::json compare_frames(const std::filesystem::path& a, const std::filesystem::path& b, const std::string& label,
                              const std::vector<int>& frames, std::vector<std::string>& notes);

std::string images_head();
std::string images_line(const std::string& label, const nlohmann::json& row);

// What breaks the thresholds of images.
std::vector<std::string> broken_by_image(const std::string& label, const nlohmann::json& row,
                                         const std::vector<Threshold>& thresholds);

}  // namespace tessera::replay
