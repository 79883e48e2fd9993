#include "base/parallel.h"

#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace tessera {
namespace {

struct Calls {
  std::vector<int> bodies;          // how often body(i) was called
  std::vector<std::size_t> afters;  // i of after(), as they came
  bool after_before_body = false;
};

Calls call_in_order(std::size_t count, std::size_t batch, std::size_t threads) {
  Calls calls{std::vector<int>(count), {}, false};
  const ThreadLimit limit(threads);
  parallel_in_order(
      count, batch, [&](std::size_t i) { ++calls.bodies[i]; },
      [&](std::size_t i) {
        if (calls.bodies[i] != 1) calls.after_before_body = true;
        calls.afters.push_back(i);
      });
  return calls;
}

TEST(ParallelInOrder, EveryIndexOnceAndAfterItsBodyByRisingIndex) {
  for (const std::size_t count : {0u, 1u, 15u, 16u, 17u, 1000u})
    for (const std::size_t batch : {1u, 16u})
      for (const std::size_t threads : {1u, 2u, 8u}) {
        const Calls calls = call_in_order(count, batch, threads);
        EXPECT_EQ(calls.bodies, std::vector<int>(count, 1)) << count << ' ' << batch << ' ' << threads;
        EXPECT_FALSE(calls.after_before_body);
        ASSERT_EQ(calls.afters.size(), count);
        for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(calls.afters[i], i);
      }
}

TEST(ParallelInOrder, OneThreadIsTheThreadThatCalls) {
  const ThreadLimit limit(1);
  const auto caller = std::this_thread::get_id();
  bool elsewhere = false;
  const auto look = [&](std::size_t) { elsewhere |= std::this_thread::get_id() != caller; };
  with_threads(1, [&] { parallel_in_order(100, 4, look, look); });
  EXPECT_FALSE(elsewhere);
}

TEST(ParallelInOrder, AnExceptionOfEitherComesOutAndNoLaterIndexIsFinished) {
  for (const bool in_body : {true, false}) {
    std::atomic<std::size_t> finished = 0;
    const auto throws_at = [&](bool here, std::size_t i) {
      if (here && i == 40) throw std::runtime_error("at 40");
    };
    EXPECT_THROW(parallel_in_order(
                     1000, 1, [&](std::size_t i) { throws_at(in_body, i); },
                     [&](std::size_t i) {
                       throws_at(!in_body, i);
                       ++finished;
                     }),
                 std::runtime_error);
    EXPECT_LE(finished, 40u);
  }
}

}  // namespace
}  // namespace tessera
