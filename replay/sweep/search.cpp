#include "replay/sweep/search.h"

#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "base/error.h"
#include "replay/progress.h"
#include "replay/sweep/goal.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

class Search {
 public:
  Search(Study& study, const std::string& program, const SweepFolder& folder, const SweepOptions& options,
         CaptureLibrary& library)
      : study_(study),
        maker_(study, program),
        folder_(folder),
        options_(options),
        library_(library),
        evolution_(study.axes.size(), study.goal->population, study.goal->seed) {}

  SearchResult run(const std::function<void(const std::vector<SweepPoint>&)>& shown) {
    std::size_t idle = 0;
    while (study_.chosen.size() < study_.goal->points && idle < kIdleGenerations) {
      const std::size_t before = study_.chosen.size(), first_point = result_.points.size();
      const std::vector<std::optional<std::size_t>> candidates = choose();
      idle = study_.chosen.size() == before ? idle + 1 : 0;
      if (study_.chosen.size() > before) {
        shown(result_.points);
        std::vector<std::size_t> fresh;
        for (std::size_t p = first_point; p < result_.points.size(); ++p) fresh.push_back(p);
        result_.outcome.add(run_sweep(study_, result_.points, fresh, folder_, options_, library_));
        if (result_.outcome.stopped || stop_requested()) break;
        ++result_.generations;
      }
      tell(candidates);
    }
    result_.outcome.stopped = result_.outcome.stopped || stop_requested();
    return std::move(result_);
  }

 private:
  // The candidates of a generation, by their numbers in study_.chosen; nothing for candidates beyond the wanted points.
  std::vector<std::optional<std::size_t>> choose() {
    std::vector<std::optional<std::size_t>> candidates;
    for (const std::vector<double>& at : evolution_.ask()) {
      std::vector<std::uint32_t> steps;
      for (std::size_t a = 0; a < study_.axes.size(); ++a) steps.push_back(study_.axes[a].step_at(at[a]));
      const auto [known, fresh] = number_of_.try_emplace(steps, study_.chosen.size());
      if (fresh && study_.chosen.size() == study_.goal->points) {
        number_of_.erase(known);
        candidates.emplace_back();
        continue;
      }
      candidates.emplace_back(known->second);
      if (!fresh) continue;
      study_.chosen.push_back(steps);
      for (std::size_t c = 0; c < study_.captures.size(); ++c) result_.points.push_back(maker_.make(c, steps));
    }
    return candidates;
  }

  void tell(const std::vector<std::optional<std::size_t>>& candidates) {
    std::vector<Score> scores;
    scores.reserve(candidates.size());
    for (const std::optional<std::size_t>& candidate : candidates)
      scores.push_back(candidate ? score(*candidate) : Score{0, std::numeric_limits<double>::infinity()});
    evolution_.tell(scores);
  }

  const Score& score(std::size_t candidate) {
    for (std::size_t c = scores_.size(); c <= candidate; ++c) {
      std::vector<json> frames;
      bool whole = true;
      for (std::size_t k = 0; k < study_.captures.size(); ++k) {
        const std::string& hash = result_.points[c * study_.captures.size() + k].hash;
        const std::optional<json> result = folder_.read_point(hash);
        if (!result) throw SystemError("the result of a point is gone: " + folder_.point_file(hash).string());
        whole = whole && result->contains("frames");
        if (whole) frames.insert(frames.end(), (*result)["frames"].begin(), (*result)["frames"].end());
      }
      if (!whole) frames.clear();
      scores_.push_back(score_of(*study_.goal, frames));
    }
    return scores_[candidate];
  }

  Study& study_;
  PointMaker maker_;
  const SweepFolder& folder_;
  const SweepOptions& options_;
  CaptureLibrary& library_;
  DifferentialEvolution evolution_;
  SearchResult result_;
  std::map<std::vector<std::uint32_t>, std::size_t> number_of_;  // in study_.chosen
  std::vector<Score> scores_;                                    // by number in study_.chosen
};

}  // namespace

SearchResult run_search(Study& study, const std::string& program, const SweepFolder& folder,
                        const SweepOptions& options, CaptureLibrary& library,
                        const std::function<void(const std::vector<SweepPoint>&)>& shown) {
  SearchResult result = Search(study, program, folder, options, library).run(shown);
  if (!study.records && !result.outcome.stopped) {
    std::error_code ignored;
    for (const SweepPoint& point : result.points) std::filesystem::remove(folder.record_file(point.function), ignored);
    std::filesystem::remove(folder.path() / "records", ignored);
  }
  return result;
}

}  // namespace tessera::replay
