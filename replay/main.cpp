#include "replay/commands.h"

int main(int argc, char** argv) {
  using namespace tessera::replay;
  static constexpr CommandEntry kCommands[] = {
      {"replay", "Render frames of a capture and measure them", make_replay_command},
      {"view", "Change the settings of a frame in a browser and see the result", make_view_command},
      {"time", "Time a recorded replay again on another machine", make_time_command},
      {"inspect", "Describe the contents of a capture", make_inspect_command},
      {"pack", "Compress a glTF asset and attach capture settings", make_pack_command},
      {"compare", "Why one replay is slower than another; differences of images", make_compare_command},
      {"sweep", "Render every point of a design space and measure it", make_sweep_command},
      {"tradeoff", "Measure the cost of accuracy: error, time, cycles, traffic and energy of every setting",
       make_tradeoff_command},
      {"report", "One page about a replay, a sweep or a tradeoff", make_report_command},
      {"dram", "Play a memory trace to a model of external memory", make_dram_command},
      {"describe", "Every counter, setting, machine number, extension and effect", make_describe_command},
      {"selfcheck", "Published figures, measured again at their condition", make_selfcheck_command},
  };
  return run_command_line(argc, argv, kCommands);
}
