#pragma once

#include <filesystem>
#include <string>
#include <utility>

namespace tessera::replay {

// Results of an output folder that are named by a hash of their inputs: FOLDER/points/HASH.json. A file is written last
// and whole, so an existing file is complete and is not computed again.
class PointFiles {
 public:
  explicit PointFiles(const std::filesystem::path& folder) : folder_(folder / "points") {}

  const std::filesystem::path& folder() const { return folder_; }
  std::filesystem::path file(const std::string& hash) const { return folder_ / (hash + ".json"); }
  bool has(const std::string& hash) const {
    std::error_code ignored;
    return std::filesystem::is_regular_file(file(hash), ignored);
  }

 private:
  std::filesystem::path folder_;
};

}  // namespace tessera::replay
