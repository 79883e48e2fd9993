#include "bench/support/program.h"

#include <cstdio>
#include <exception>
#include <string>

#include <fmt/format.h>

namespace tessera::bench {

void Laws::expect(std::string_view law, bool holds) {
  fmt::print("{}: {}\n", law, holds ? "yes" : "NO");
  all_hold_ = all_hold_ && holds;
}

int run_program(const Program& program, int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    fmt::print(stderr, "usage: {} OUT_FOLDER [ROUNDS] | --check\n", program.name);
    return 2;
  }
  try {
    const std::string first = argv[1];
    if (first == "--check") return program.check() ? 0 : 1;
    std::filesystem::create_directories(first);
    program.measure(first, argc > 2 ? std::stoi(argv[2]) : program.rounds);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", program.name, error.what());
    return 1;
  }
}

}  // namespace tessera::bench
