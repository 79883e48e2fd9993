#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tessera::replay {

// One published figure or identity, computed again by the units of the machine.
struct SelfCheck {
  std::string name;      // what is looked at
  std::string expected;  // with its unit
  std::string got;
  bool passed = false;
  std::string note;  // where the figure is from, or why ours may differ
};

// Figures that need no capture: sizes of frame buffers and queues, tiles per frame, record ratios, memory rates, and on
// a small scene that is made here what must add up (ledger, work, cycles, energy, DRAM trace).
std::vector<SelfCheck> check_identities();

// Traffic of tiling against immediate mode on one capture (published: 1.96 times less, tiles of 32x32 best).
// `strict`: scene::CaptureLimits::strict.
SelfCheck check_tiling(const std::filesystem::path& capture, bool strict = false);

}  // namespace tessera::replay
