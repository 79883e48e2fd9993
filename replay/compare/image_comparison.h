#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "replay/compare/comparison.h"

namespace tessera::replay {

// {"ssim", "flip", "max_difference", "psnr_db" (null: identical)} between two images as a display shows them; EXR files
// are tone mapped first. `map_file`, if any, gets FLIP as a heat map. With `mask_file`, if any, only covered pixels
// count. Throws InputError, and UsageError for images of different sizes.
nlohmann::json compare_images(const std::filesystem::path& a, const std::filesystem::path& b,
                              const std::string& map_file, const std::string& mask_file);

// The same for all images of these frames that the folders of both runs have: rows with "frame", and "run", the label
// of the second run. An image that cannot be compared gets an entry in `notes`.
nlohmann::json compare_frames(const std::filesystem::path& a, const std::filesystem::path& b, const std::string& label,
                              const std::vector<int>& frames, std::vector<std::string>& notes);

std::string images_head();
std::string images_line(const std::string& label, const nlohmann::json& row);

// The thresholds that images break.
std::vector<std::string> broken_by_image(const std::string& label, const nlohmann::json& row,
                                         const std::vector<Threshold>& thresholds);

}  // namespace tessera::replay
