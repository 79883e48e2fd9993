#include "tests/project/stability_page.h"

#include <algorithm>

#include <fmt/format.h>

namespace tessera {
namespace {

constexpr std::string_view kHead = R"(# Stability: hard cases

Each case breaks renderers of this kind: what fails without care, *what is done instead*, the tests, named after the law that holds. Most laws have a *twin*, a test that breaks the law on purpose and must notice.

Made by `build/release/tests/tessera_stability_page`; a test checks that this page is current and that every test exists.

```sh
./tessera test -R 'HardCase|HardCases|Traps'   # by name
./tessera test --all -L sanitizers             # address and undefined-behaviour sanitizers; without --all what decodes
./tessera test --all -L fuzz                   # every fuzz target for a minute; without --all decoders for seconds
./tessera fuzz draco 3600                      # one target for an hour; without arguments all, a minute each
./tessera fuzz webp 1000000x                   # so many inputs
```

A million inputs each (commit 3b7f46e): exr, history, image, machine, meshopt, option, point, result, study and webp, 374 to 32 258 a second, no fault.
)";

// "Suite.Law" of "folder: Suite.Law"; fuzz targets have no other name than that of ctest.
std::string_view short_name(std::string_view test) {
  const std::size_t colon = test.find(": ");
  return test.starts_with("fuzz: ") || test.starts_with("long fuzz: ") || colon == std::string_view::npos
             ? test
             : test.substr(colon + 2);
}

bool begins(std::string_view name, std::string_view beginning) {
  if (!name.starts_with(beginning)) return false;
  // "Suite.Law" is not meant by "Suite.LawAndMore", but by "Suite.Law/0"; a beginning may also end inside an instance's
  // name.
  return name.size() == beginning.size() || name[beginning.size()] == '/' || beginning.find('/') < beginning.rfind('/');
}

}  // namespace

const std::vector<StabilityTopic>& stability_topics() {
  static const std::vector<StabilityTopic> kTopics = [] {
    std::vector<StabilityTopic> all = geometry_cases();
    for (const auto& part : {image_cases(), whole_cases()}) all.insert(all.end(), part.begin(), part.end());
    return all;
  }();
  return kTopics;
}

std::string stability_page() {
  std::string page(kHead);
  for (const StabilityTopic& topic : stability_topics()) {
    page += fmt::format("\n## {}\n\n", topic.title);
    if (!topic.remark.empty()) page += fmt::format("{}\n\n", topic.remark);
    for (const StabilityCase& row : topic.cases) {
      page += fmt::format("- **{}**: {}; *{}*.", row.name, row.wrong, row.done);
      for (const std::string_view test : row.tests)
        page += fmt::format("{}`{}`", test == row.tests.front() ? " " : ", ", short_name(test));
      page += "\n";
    }
  }
  return page;
}

std::vector<std::string> missing_tests(std::span<const StabilityTopic> topics,
                                       const std::vector<std::string>& ctest_names) {
  std::vector<std::string> missing;
  for (const StabilityTopic& topic : topics)
    for (const StabilityCase& row : topic.cases) {
      if (row.tests.empty()) missing.push_back(fmt::format("{}: no test", row.name));
      for (const std::string_view test : row.tests)
        if (std::none_of(ctest_names.begin(), ctest_names.end(),
                         [&](const std::string& name) { return begins(name, test); }))
          missing.push_back(fmt::format("{}: {}", row.name, test));
    }
  return missing;
}

}  // namespace tessera
