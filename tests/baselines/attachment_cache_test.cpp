// Attachments of immediate-mode machines behind their cache (baselines/attachment_cache.h).
#include "baselines/attachment_cache.h"

#include "tests/support/tests.h"

namespace tessera::baselines::attachment_cache_test {
namespace {

constexpr std::uint64_t kBurst = 64;

// A cache written again by the definition: a list of lines for each set, newest first. `lazy`, the twin's fault, forgets
// to write back the lines that leave.
class Definition {
 public:
  Definition(std::uint64_t sets, std::uint64_t ways, bool lazy = false) : sets_(sets), ways_(ways), lazy_(lazy) {}
  void use(std::uint32_t line, bool read, bool change) {
    std::vector<std::uint32_t>& set = newest_[line % sets_];
    const auto at = std::find(set.begin(), set.end(), line);
    if (at == set.end()) {
      if (read && stored_.contains(line)) bytes_read += kBurst;
      if (set.size() == ways_) {
        if (changed_.erase(set.back()) > 0 && !lazy_) write(set.back());
        set.pop_back();
      }
    } else {
      set.erase(at);
    }
    set.insert(set.begin(), line);
    if (change) changed_.insert(line);
  }
  void finish() {
    for (const std::uint32_t line : changed_) write(line);
    changed_.clear();
  }
  std::uint64_t bytes_read = 0, bytes_written = 0;

 private:
  void write(std::uint32_t line) {
    bytes_written += kBurst;
    stored_.insert(line);
  }
  std::uint64_t sets_, ways_;
  bool lazy_;
  std::map<std::uint64_t, std::vector<std::uint32_t>> newest_;
  std::set<std::uint32_t> stored_, changed_;
};

TEST(AttachmentCache, ReadsAndWritesBackByTheDefinitionOfItsSets) {  // AC1, AC2, AC3
  constexpr std::uint64_t kSets = 4, kWays = AttachmentCache::kWays;
  AttachmentCache cache(kSets * kWays * kBurst, kBurst, 1000);
  Definition definition(kSets, kWays), lazy(kSets, kWays, true);
  test::Random random(7);
  std::uint32_t line = 0;
  for (int k = 0; k < 20000; ++k) {
    line =
        random.uniform(0, 1) < 0.7f ? line + (line < 999 ? 1 : 0) : static_cast<std::uint32_t>(random.uniform(0, 999));
    const bool read = random.uniform(0, 1) < 0.5f, change = !read || random.uniform(0, 1) < 0.5f;
    if (read)
      cache.load(line, change);
    else
      cache.store(line);
    definition.use(line, read, change);
    lazy.use(line, read, change);
  }
  cache.finish(), definition.finish(), lazy.finish();
  EXPECT_EQ(cache.bytes_read(), definition.bytes_read);
  EXPECT_EQ(cache.bytes_written(), definition.bytes_written);
  EXPECT_GT(cache.bytes_read(), 0u);
  // The twin: lines that leave without being written are missed.
  EXPECT_NE(cache.bytes_written(), lazy.bytes_written);
}

TEST(AttachmentCache, WritesAWholeAttachmentOnceWithAnySize) {  // AC2
  for (const std::uint64_t bytes : {0, 63, 64, 1000, 4096, 262144}) {
    AttachmentCache cache(bytes, kBurst, 500);
    for (std::uint32_t line = 0; line < 500; ++line) cache.store(line);
    cache.finish();
    EXPECT_EQ(cache.bytes_written(), 500 * kBurst) << bytes;
    EXPECT_EQ(cache.bytes_read(), 0u) << bytes;
    cache.finish();
    EXPECT_EQ(cache.bytes_written(), 500 * kBurst) << "nothing has changed since";
  }
}

TEST(AttachmentCache, WithoutRoomEveryUseMovesABurst) {  // AC3
  AttachmentCache cache(kBurst - 1, kBurst, 4);
  for (int k = 0; k < 5; ++k) cache.load(2, true);
  cache.finish();
  EXPECT_EQ(cache.bytes_written(), 5 * kBurst);
  EXPECT_EQ(cache.bytes_read(), 4 * kBurst) << "the first finds a clear line";
}

TEST(AttachmentCache, ALineThatLeftIsReadAgain) {  // AC1, AC3
  AttachmentCache cache(AttachmentCache::kWays * kBurst, kBurst, 100);
  for (std::uint32_t line = 0; line < AttachmentCache::kWays; ++line) cache.load(line, true);
  cache.load(0);
  EXPECT_EQ(cache.bytes_read(), 0u);
  cache.load(50);  // takes the place of line 1
  EXPECT_EQ(cache.bytes_written(), kBurst);
  cache.load(0);
  EXPECT_EQ(cache.bytes_read(), 0u);
  cache.load(1);
  EXPECT_EQ(cache.bytes_read(), kBurst);
}

}  // namespace
}  // namespace tessera::baselines::attachment_cache_test
