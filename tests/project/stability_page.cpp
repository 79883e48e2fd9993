#include "tests/project/stability_page.h"

#include <algorithm>

#include <fmt/format.h>

namespace tessera {
namespace {

constexpr std::string_view kHead = R"(# Stability: hard cases and what is done about them

Every case below is known to break renderers of this kind, and has a test that is named after the law that holds all the same. Tests run in float against
double precision or exact arithmetic where there is a number to compare; most laws have a *twin*, a test in which the law is broken on purpose and must be
found broken.

Made by `build/release/tests/tessera_stability_page`; a test checks that this page is current and that every test named here exists.

```sh
./tessera test -R 'HardCase|HardCases|Traps'   # by name
./tessera test -L sanitizers                   # address and undefined-behaviour sanitizers: base, frontend, binner, tilecore
./tessera test -L fuzz                         # every fuzz target for ten seconds
./tessera fuzz                                 # every fuzz target for a minute; `./tessera fuzz draco 3600`: one for an hour
```

A test is `folder: Suite.Law`; it stands in `tests/` in the folder of that name. Names with `/` in front have one instance per capture, case or method.
)";

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
    for (const auto& part : {picture_cases(), whole_cases()}) all.insert(all.end(), part.begin(), part.end());
    return all;
  }();
  return kTopics;
}

std::string stability_page() {
  std::string page(kHead);
  for (const StabilityTopic& topic : stability_topics()) {
    page += fmt::format("\n## {}\n\n", topic.title);
    if (!topic.remark.empty()) page += fmt::format("{}\n\n", topic.remark);
    page += "| case | what could go wrong | what is done | test |\n|---|---|---|---|\n";
    for (const StabilityCase& row : topic.cases) {
      std::string tests;
      for (const std::string_view test : row.tests) tests += fmt::format("{}`{}`", tests.empty() ? "" : "<br>", test);
      page += fmt::format("| {} | {} | {} | {} |\n", row.name, row.wrong, row.done, tests);
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
