#pragma once

#include <filesystem>
#include <string_view>

namespace tessera::bench {

// Laws that a measuring program checks on small input, each printed with whether it holds.
class Laws {
 public:
  void expect(std::string_view law, bool holds);
  bool all_hold() const { return all_hold_; }

 private:
  bool all_hold_ = true;
};

// A program of its own with the command line OUT_FOLDER [ROUNDS] | --check.
struct Program {
  const char* name;
  int rounds;                                                        // where the command line names none
  void (*measure)(const std::filesystem::path& folder, int rounds);  // into a folder that exists
  bool (*check)();                                                   // compares like with like; false: a law is broken
};

// The program's exit status: 0; 1 after a broken law or an exception, whose message is printed; 2 for a wrong command
// line.
int run_program(const Program& program, int argc, char** argv);

}  // namespace tessera::bench
