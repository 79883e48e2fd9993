// main() of every test program. Shards print failures only; a test that crashes, or that lacks something on this machine, is named here.
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>

namespace {

// Async-signal-safe but for GoogleTest's lock, which the test that crashed does not hold.
[[maybe_unused]] void name_test(int) {
  const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
  if (test == nullptr) return;
  for (const char* part : {"crashed in ", test->test_suite_name(), ".", test->name(), "\n"})
    if (write(STDERR_FILENO, part, std::strlen(part)) < 0) return;
}

class SkippedTests final : public testing::EmptyTestEventListener {
  void OnTestEnd(const testing::TestInfo& test) override {
    if (test.result()->Skipped()) std::printf("skipped: %s.%s\n", test.test_suite_name(), test.name());
  }
};

}  // namespace

int main(int count, char** arguments) {
  testing::InitGoogleTest(&count, arguments);
  testing::UnitTest::GetInstance()->listeners().Append(new SkippedTests);
#ifndef TESSERA_SANITIZED  // the sanitizers' reports show the stack
  struct sigaction action = {};
  action.sa_handler = name_test;
  action.sa_flags = static_cast<int>(SA_RESETHAND);  // the signal's default action follows
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) sigaction(signal, &action, nullptr);
#endif
  return RUN_ALL_TESTS();
}
