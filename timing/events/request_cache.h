#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tessera::timing {

// A set-associative LRU cache whose lines may still be in flight: memory::LineCache with the number of the request
// that fetches each line. A cache of 0 bytes never hits. A line in flight is found until another line takes its place.
class RequestCache {
 public:
  static constexpr std::uint32_t kThere = 0xFFFFFFFFu;  // no request: the line has arrived

  RequestCache(std::int64_t bytes, std::int64_t ways, std::int64_t line_bytes)
      : ways_(static_cast<std::size_t>(ways)),
        sets_(static_cast<std::size_t>(bytes / (ways * line_bytes))),
        entries_(ways_ * sets_) {}

  // Uses a line. Returns nullptr when it is missing; take() gives it a place.
  const std::uint32_t* use(std::uint32_t line) {
    if (sets_ == 0) return nullptr;
    Entry* set = set_of(line);
    if (set[0].line == line) return &set[0].request;
    for (std::size_t way = 1; way < ways_; ++way) {
      if (set[way].line != line) continue;
      const Entry found = set[way];
      for (; way > 0; --way) set[way] = set[way - 1];
      set[0] = found;
      return &set[0].request;
    }
    return nullptr;
  }
  // Adds a missing line, which `request` fetches, in place of the least recently used line of its set.
  void take(std::uint32_t line, std::uint32_t request) {
    if (sets_ == 0) return;
    Entry* set = set_of(line);
    for (std::size_t way = ways_ - 1; way > 0; --way) set[way] = set[way - 1];
    set[0] = {line, request};
  }
  // Drops the lines [first, end); none of them may be in flight.
  void drop(std::uint32_t first, std::uint32_t end) {
    for (std::size_t set = 0; set < entries_.size(); set += ways_) {
      std::size_t kept = 0;
      for (std::size_t way = 0; way < ways_; ++way)
        if (const Entry& entry = entries_[set + way]; entry.line < first || entry.line >= end)
          entries_[set + kept++] = entry;
      for (; kept < ways_; ++kept) entries_[set + kept] = {};
    }
  }
  // Marks the line as arrived when its request is answered.
  void fill(std::uint32_t line, std::uint32_t request) {
    if (sets_ == 0) return;
    Entry* set = set_of(line);
    for (std::size_t way = 0; way < ways_; ++way)
      if (set[way].line == line && set[way].request == request) set[way].request = kThere;
  }

 private:
  struct Entry {
    std::uint32_t line = 0xFFFFFFFFu, request = kThere;
  };
  Entry* set_of(std::uint32_t line) { return &entries_[(line & (sets_ - 1)) * ways_]; }

  std::size_t ways_, sets_;
  std::vector<Entry> entries_;
};

}  // namespace tessera::timing
