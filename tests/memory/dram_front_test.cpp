// Memory that is advanced on demand, against the same memory advanced in every clock.
#include <deque>
#include <random>

#include "memory/dram_banks.h"
#include "memory/dram_front.h"
#include "tests/support/tests.h"

namespace tessera::memory::dram_front_test {
namespace {

struct Asked {
  DramClock clock;
  std::uint64_t address;
  bool write;
};
struct Outcome {
  std::vector<DramClock> done;  // by request
  DramCounters counters;

  bool operator==(const Outcome&) const = default;
};

// `burst`: requests that come in one clock; `span`: bytes that addresses lie in, so that small ones meet waiting writes.
struct AskedStream {
  std::uint32_t seed;
  double writes, locality;
  std::uint64_t span;
  double rate;
  std::uint32_t burst;
};
constexpr AskedStream kAskedStreams[] = {{1, 0, 0.5, 1u << 30, 0.5, 1},    {2, 1, 0.5, 1u << 30, 0.5, 64},
                                         {3, 0.5, 0, 1u << 12, 0.3, 16},   {4, 0.3, 0.95, 1u << 26, 2, 256},
                                         {5, 0.5, 0.5, 1u << 14, 4, 4},    {6, 0.1, 0.9, 1u << 26, 0.02, 32},
                                         {7, 0.7, 0.97, 1u << 28, 8, 500}, {8, 0.4, 0.2, 1u << 10, 2, 8}};

std::vector<Asked> asked_of(const AskedStream& stream, std::size_t count) {
  std::mt19937_64 random(stream.seed);
  std::uniform_real_distribution<double> unit;
  std::vector<Asked> requests;
  std::uint64_t address = 0;
  double clock = 0;
  while (requests.size() < count) {
    clock += -std::log(1 - unit(random)) / stream.rate * stream.burst;
    for (std::uint32_t k = 0; k < stream.burst && requests.size() < count; ++k) {
      address = unit(random) < stream.locality ? address + 64 : random() % stream.span;
      requests.push_back({static_cast<DramClock>(clock), address, unit(random) < stream.writes});
    }
  }
  return requests;
}

std::vector<DramSpec> asked_specs() {
  std::vector<DramSpec> all;
  for (const std::string_view type : dram_types()) all.push_back(dram_spec(type));
  DramSpec ranks = dram_spec("lpddr5-6400");
  ranks.ranks = 2, ranks.channels = 1, ranks.mapping = "RoBaCoRaBgCh";
  all.push_back(ranks);
  return all;
}

constexpr DramClock kLastClock = 200000;

// The judge: time goes by clock for clock; in each clock, requests that wait in front of a channel enter before new
// ones.
Outcome ticked(const DramSpec& spec, const std::vector<Asked>& requests) {
  DramBanks dram(spec);
  std::vector<std::deque<std::size_t>> waiting(spec.channels);
  std::vector<DramCompletion> completions;
  std::size_t next = 0;
  for (DramClock clock = 0; clock <= kLastClock; ++clock) {
    dram.advance(clock, completions);
    const auto enter = [&](std::size_t i) { return dram.submit(i, requests[i].address, requests[i].write); };
    for (std::deque<std::size_t>& queue : waiting)
      while (!queue.empty() && enter(queue.front())) queue.pop_front();
    for (; next < requests.size() && requests[next].clock <= clock; ++next) {
      std::deque<std::size_t>& queue = waiting[dram.channel(requests[next].address)];
      if (!queue.empty() || !enter(next)) queue.push_back(next);
    }
  }
  Outcome out{std::vector<DramClock>(requests.size()), dram.counters()};
  for (const DramCompletion& completion : completions) out.done[completion.id] = completion.clock;
  return out;
}

// As an event simulation asks; `max_step`: looks at least so often.
Outcome looked_at(const DramSpec& spec, const std::vector<Asked>& requests, DramClock max_step = kNoDramClock) {
  DramFront front(spec);
  std::vector<DramAnswer> answers;
  Outcome out{std::vector<DramClock>(requests.size()), {}};
  DramClock clock = 0;
  std::uint64_t late = 0, twice = 0;
  const auto take = [&] {
    for (const DramAnswer& answer : answers) {
      EXPECT_EQ(answer.id, answer.order);
      twice += out.done[answer.id] != 0 ? 1u : 0u;
      late += answer.clock < clock ? 1u : 0u;
      out.done[answer.id] = answer.clock;
    }
    answers.clear();
  };
  for (std::size_t i = 0; clock < kLastClock;) {
    DramClock next = std::min(front.next_look(), kLastClock);
    if (max_step != kNoDramClock) next = std::min(next, clock + max_step);
    if (i < requests.size() && requests[i].clock <= next) {
      clock = std::max(clock, requests[i].clock);
      front.ask(i, i, requests[i].address, requests[i].write, clock, answers);
      ++i;
    } else {
      EXPECT_GE(next, clock);
      clock = next;
      front.look(clock, answers);
    }
    take();
  }
  EXPECT_EQ(late, 0u) << "DF2";
  EXPECT_EQ(twice, 0u) << "DF2";
  out.counters = front.counters();
  return out;
}

// DF1, DF2
TEST(DramFront, AnswersAsTheMemoryThatIsLookedAtInEveryClock) {
  std::uint64_t touched = 0;
  for (const DramSpec& spec : asked_specs())
    for (const AskedStream& stream : kAskedStreams) {
      const std::vector<Asked> requests = asked_of(stream, 2000);
      const Outcome truth = ticked(spec, requests), out = looked_at(spec, requests);
      EXPECT_EQ(std::count(truth.done.begin(), truth.done.end(), 0), 0) << "long enough";
      EXPECT_EQ(out.done, truth.done) << spec.type << ' ' << stream.seed;
      EXPECT_EQ(out.counters, truth.counters) << spec.type << ' ' << stream.seed;
      touched += truth.counters.forwarded_reads + truth.counters.merged_writes;
    }
  EXPECT_GT(touched, 1000u) << "reads and writes of transactions for which a write waits";
}

// DF3
TEST(DramFront, HowOftenItIsLookedAtDoesNotMatter) {
  for (const DramSpec& spec : asked_specs())
    for (const AskedStream& stream : kAskedStreams) {
      const std::vector<Asked> requests = asked_of(stream, 2000);
      const Outcome seldom = looked_at(spec, requests);
      EXPECT_EQ(looked_at(spec, requests, 1), seldom) << spec.type << ' ' << stream.seed;
      EXPECT_EQ(looked_at(spec, requests, 7), seldom) << spec.type << ' ' << stream.seed;
    }
}

TEST(DramFront, IsNotLookedAtWhileItIsIdle) {
  DramFront front(dram_spec("lpddr5-6400"));
  std::vector<DramAnswer> answers;
  EXPECT_EQ(front.next_look(), kNoDramClock);
  front.ask(7, 0, 0, false, 100, answers);
  EXPECT_TRUE(answers.empty());
  // The activate goes at once; no data come within a column command's time of it.
  EXPECT_EQ(front.next_look(), 100u + 17 + 2);
  while (front.next_look() != kNoDramClock) front.look(front.next_look(), answers);
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(answers[0].id, 7u);
  EXPECT_EQ(answers[0].clock, 100 + front.spec().idle_latency_clocks());
}

}  // namespace
}  // namespace tessera::memory::dram_front_test
