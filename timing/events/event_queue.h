#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "timing/events/path_time.h"

namespace tessera::timing {

// Events of units. `who` names the core (unused by shared units), `what` the item.
enum class EventKind : std::uint8_t {
  kMemory,          // the memory has read line `what` of the L2's requests
  kBanks,           // the memory's banks may have answers
  kWritten,         // the memory has taken a block of pixels of the core
  kTextureFill,     // request `what` of the core's texture cache is answered
  kTextureFree,     // the core's texture unit has taken its lookups
  kFetch,           // the core's fetch unit may go on
  kListRead,        // its tile's list is there, then its records
  kItemRead,        // records and heights of sub-patch `what` have arrived
  kDomainStart,     // the tessellator gives vertices of sub-patch `what` to the lanes
  kDomainRead,      // heights of domain warp `what` have arrived
  kDomainShaded,    // the lanes have shaded sub-patch `what`
  kAlphaRead,       // texels of alpha tests of sub-patch `what` have arrived
  kAlphaStart,      // its alpha tests may begin
  kTested,          // all sub-patches of the core's tile are tested
  kShadingRead,     // records that shading reads are there
  kWarpReady,       // a warp is packed
  kIssue,           // the core's lanes are free
  kWarpRead,        // texels of warp `what` have arrived
  kShaded,          // the core's tile is shaded
  kStore,           // the resolve unit has finished a block of pixels
  kGeometry,        // the front end or the binner may go on
  kGeometryLine,    // a line of tables of block `what` has arrived
  kGeometryRead,    // the reads of the front end for block `what` have arrived
  kGeometryWritten  // the memory has taken the binner's entries of a block
};

struct SimulationEvent {
  double time = 0;
  std::uint64_t order = 0;  // order of events at the same time: from kOthers on, the order in which they were asked for
  std::uint32_t what = 0, path = 0;
  std::uint32_t who = 0;
  EventKind kind{};

  bool before(const SimulationEvent& other) const {
    return time != other.time ? time < other.time : order < other.order;
  }
};

// Events by time. If paths are recorded, each event has the path that led to it.
class EventQueue {
 public:
  explicit EventQueue(bool record_paths) : recording_(record_paths) {}

  // `spent` splits the time until then.
  void push(double time, const Spent& spent, EventKind kind, std::uint32_t who = 0, std::uint32_t what = 0) {
    add({std::max(time, now_), next_++, what, recording_ ? keep(path_to(time, spent)) : 0, who, kind});
  }
  // `path`: a path to the event that does not lead over the current event; may be nullptr where none are recorded.
  void push(double time, const PathTime* path, EventKind kind, std::uint32_t who = 0, std::uint32_t what = 0) {
    add({std::max(time, now_), next_++, what, recording_ ? keep(*path) : 0, who, kind});
  }
  // Pushes an answer of the memory's banks, which may be known long before its time. At its time it comes before other
  // events, and answers come in the order of their requests. `order` rises from request to request and stays below kOthers.
  void push_answer(double time, std::uint64_t order, const PathTime* path, EventKind kind, std::uint32_t who,
                   std::uint32_t what) {
    ++next_;
    add({std::max(time, now_), order, what, recording_ ? keep(*path) : 0, who, kind});
  }
  bool empty() const { return heap_.empty(); }
  SimulationEvent pop() {
    const SimulationEvent event = heap_.front(), last = heap_.back();
    heap_.pop_back();
    if (!heap_.empty()) sink(last);
    now_ = event.time;
    if (recording_) {
      path_ = paths_[event.path];
      free_paths_.push_back(event.path);
    }
    return event;
  }
  bool recording() const { return recording_; }
  // The path to the current event, and from there to a later time.
  const PathTime& path() const { return path_; }
  PathTime path_to(double time, const Spent& spent) const {
    PathTime path = path_;
    spent.add_to(path, time - now_);
    return path;
  }
  double now() const { return now_; }
  std::uint64_t count() const { return next_ - kOthers; }

 private:
  static constexpr std::size_t kChildren = 4;  // half as many levels as two, and brothers lie in two cache lines

  void add(const SimulationEvent& event) {
    std::size_t at = heap_.size();
    heap_.push_back(event);
    for (; at > 0 && event.before(heap_[(at - 1) / kChildren]); at = (at - 1) / kChildren)
      heap_[at] = heap_[(at - 1) / kChildren];
    heap_[at] = event;
  }
  // Puts an event at the top and restores the heap.
  void sink(const SimulationEvent& event) {
    const std::size_t size = heap_.size();
    std::size_t at = 0;
    for (std::size_t first = 1; first < size; first = at * kChildren + 1) {
      std::size_t least = first;
      for (std::size_t child = first + 1; child < std::min(first + kChildren, size); ++child)
        if (heap_[child].before(heap_[least])) least = child;
      if (!heap_[least].before(event)) break;
      heap_[at] = heap_[least];
      at = least;
    }
    heap_[at] = event;
  }
  std::uint32_t keep(const PathTime& path) {
    if (free_paths_.empty()) {
      paths_.push_back(path);
      return static_cast<std::uint32_t>(paths_.size() - 1);
    }
    const std::uint32_t slot = free_paths_.back();
    free_paths_.pop_back();
    paths_[slot] = path;
    return slot;
  }

  static constexpr std::uint64_t kOthers = std::uint64_t{1} << 63;
  std::vector<SimulationEvent> heap_;
  double now_ = 0;
  std::uint64_t next_ = kOthers;
  bool recording_;
  PathTime path_;
  std::vector<PathTime> paths_;
  std::vector<std::uint32_t> free_paths_;
};

}  // namespace tessera::timing
