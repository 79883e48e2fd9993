#pragma once

#include <filesystem>
#include <string_view>

namespace tessera::bench {

// Laws that a measuring program checks on small input; it prints each law and whether it holds.
class Laws {
 public:
  void expect(std::string_view law, bool holds);
  bool all_hold() const { return all_hold_; }

 private:
  bool all_hold_ = true;
};

// A stand-alone program with the command line OUT_FOLDER [ROUNDS] | --check.
struct Program {
  const char* name;
  int rounds;                                                        // default of ROUNDS
  void (*measure)(const std::filesystem::path& folder, int rounds);  // writes into an existing folder
  bool (*check)();  // checks that comparisons are fair; returns false if a law is broken
};

// Returns the program's exit status: 0; 1 after a broken law or an exception, whose message is printed; 2 for a wrong command line.
int run_program(const Program& program, int argc, char** argv);

}  // namespace tessera::bench
