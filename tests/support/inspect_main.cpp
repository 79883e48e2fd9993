// `tessera inspect` without the machine: what tests of the reader run where the machine is not built.
#include "replay/command_line.h"

int main(int argc, char** argv) {
  using namespace tessera::replay;
  static constexpr CommandEntry kCommands[] = {{"inspect", "Say what is in a capture", make_inspect_command}};
  return run_command_line(argc, argv, kCommands);
}
