#include "base/simd_targets.h"

#include <hwy/targets.h>

#include <fmt/format.h>

#include "base/error.h"

// The targets that kernel sources are built for (see the compile definitions): the same list that HWY_EXPORT dispatches
// over.
#include <hwy/highway.h>

namespace tessera {
namespace {

std::vector<std::int64_t> available_targets() {
  hwy::SetSupportedTargetsForTest(0);
  const std::int64_t supported = hwy::SupportedTargets() & HWY_TARGETS;
  std::vector<std::int64_t> targets;
  // Highway gives better targets lower bits.
  for (int bit = 0; bit < 63; ++bit)
    if (supported & (std::int64_t{1} << bit)) targets.push_back(std::int64_t{1} << bit);
  return targets;
}

std::int64_t& forced_target() {
  static std::int64_t target = 0;
  return target;
}

}  // namespace

std::string simd_target_name() {
  return forced_target() != 0 ? hwy::TargetName(forced_target()) : simd_target_names().front();
}

std::vector<std::string> simd_target_names() {
  std::vector<std::string> names;
  for (const std::int64_t target : available_targets()) names.emplace_back(hwy::TargetName(target));
  hwy::SetSupportedTargetsForTest(forced_target());
  return names;
}

void force_simd_target(const std::string& name) {
  forced_target() = 0;
  for (const std::int64_t target : available_targets())
    if (name == hwy::TargetName(target)) forced_target() = target;
  if (!name.empty() && forced_target() == 0) throw UsageError(fmt::format("no kernels for the SIMD target {}", name));
  hwy::SetSupportedTargetsForTest(forced_target());
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace tessera
