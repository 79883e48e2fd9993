#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "hardware/machine.h"
#include "timing/work.h"

namespace tessera::replay {

// A published figure, measured again at the condition that it was published for, as far as that is known.
struct SelfCheck {
  std::string name;       // what is looked at
  std::string condition;  // at which
  std::string expected;   // with its unit, its source and the tolerance
  std::string got;
  bool passed = false;
  std::string reason;  // of one that does not hold, where that is known and docs/validation.md says so
  std::string note;    // where the figure is from, what of its condition is ours
};

// Of checks that do not hold, those whose reason nobody knows: the others are shown, but are no failures.
std::size_t failures(const std::vector<SelfCheck>& checks);

// Streams of reads through memory.model=banks against the data rates of the JEDEC standards.
std::vector<SelfCheck> check_memory_rates();

// On captures: tiling against drawing immediately, vertices shaded again in each tile against positions that are kept,
// texture blocks that several cores ask for. Nothing for no captures. `strict`: scene::CaptureLimits::strict. `done`, unless
// empty: told what is finished, twice for each capture.
std::vector<SelfCheck> check_captures(const std::vector<std::filesystem::path>& captures, bool strict = false,
                                      const std::function<void(const std::string&)>& done = {});
// What check_captures() checks, in its order.
std::vector<std::string> capture_check_names();

// Lines of textures that a frame's warps ask for, and those of them that more than one core asks for.
struct SharedLines {
  std::uint64_t lines = 0, shared = 0;
  double share() const { return lines > 0 ? static_cast<double>(shared) / static_cast<double>(lines) : 0; }
};

// Who shades a warp: the core that its tile was given to (machine.timing=phases says which), or all cores in turn, as on
// machines that deal the quads of a tile out to their cores.
enum class WarpOwner { kCoreOfTile, kCoresInTurn };

// `work` with its items (RenderRequest::record_items).
SharedLines shared_lines(const hardware::Machine& gpu, const timing::FrameWork& work, WarpOwner owner);

}  // namespace tessera::replay
