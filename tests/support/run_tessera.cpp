#include "tests/support/process.h"

namespace tessera::test {

ProcessResult run_tessera(std::vector<std::string> arguments, const ProcessLimits& limits) {
  arguments.insert(arguments.begin(), TESSERA_PROGRAM);
  return run_process(arguments, limits);
}

}  // namespace tessera::test
