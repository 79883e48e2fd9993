#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "hardware/machine.h"
#include "timing/work.h"

namespace tessera::replay {

// A published figure, measured again under its published condition, as far as that is known.
struct SelfCheck {
  std::string name;       // the measured quantity
  std::string condition;  // the condition of the measurement
  std::string expected;   // with its unit, its source and the tolerance
  std::string got;
  bool passed = false;
  std::string reason;  // of a failed check: the reason, where it is known and docs/validation.md states it
  std::string note;    // source of the figure, and our own part of its condition
};

// Number of failed checks without a known reason. Failed checks with a reason are shown, but are no failures.
std::size_t failures(const std::vector<SelfCheck>& checks);

// Streams of reads through memory.model=banks against the data rates of the JEDEC standards.
std::vector<SelfCheck> check_memory_rates();

// Checks on captures: tiling against drawing immediately, vertices shaded again in each tile against kept positions,
// texture blocks that several cores request. Empty for no captures. `strict`: scene::CaptureLimits::strict. `done`,
// unless empty, receives each finished part, twice for each capture.
std::vector<SelfCheck> check_captures(const std::vector<std::filesystem::path>& captures, bool strict = false,
                                      const std::function<void(const std::string&)>& done = {});
// Names of the checks of check_captures(), in its order.
std::vector<std::string> capture_check_names();

// Lines of textures that a frame's warps request, and the number of them that more than one core requests.
struct SharedLines {
  std::uint64_t lines = 0, shared = 0;
  double share() const { return lines > 0 ? static_cast<double>(shared) / static_cast<double>(lines) : 0; }
};

// The core that shades a warp: the core of its tile (machine.timing=phases knows which), or all cores in turn, as on
// machines that distribute the quads of a tile over their cores.
enum class WarpOwner { kCoreOfTile, kCoresInTurn };

// `work` needs its items (RenderRequest::record_items).
SharedLines shared_lines(const hardware::Machine& gpu, const timing::FrameWork& work, WarpOwner owner);

}  // namespace tessera::replay
