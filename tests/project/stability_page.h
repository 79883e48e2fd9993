#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tessera {

// A case that is hard for the machine, and what is made of it. docs/stability.md is generated from these rows.
struct StabilityCase {
  std::string_view name;
  std::string_view wrong;  // what could go wrong
  std::string_view done;   // what is done
  std::vector<std::string_view>
      tests;  // beginnings of names of ctest: "frontend: Suite.Law", "frontend: HardCase/Suite.Law/Pole"
};

// Cases of one part of the machine, in the order in which a frame meets them.
struct StabilityTopic {
  std::string_view title;
  std::string_view remark;  // one sentence; may be empty
  std::vector<StabilityCase> cases;
};

const std::vector<StabilityTopic>& stability_topics();
// The topics by the source that has them.
std::vector<StabilityTopic> geometry_cases();  // bounds, binning, visibility
std::vector<StabilityTopic> image_cases();     // procedures, resolve
std::vector<StabilityTopic> whole_cases();     // the machine as a whole, input, long runs

// docs/stability.md.
std::string stability_page();

// Names of ctest that a row means and that are not there, each as "CASE: TEST"; cases without a test as "CASE: no
// test".
std::vector<std::string> missing_tests(std::span<const StabilityTopic> topics,
                                       const std::vector<std::string>& ctest_names);

}  // namespace tessera
