#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace tessera::timing {

// What happens to a unit. `who` names the core (or nothing), `what` the item.
enum class EventKind : std::uint8_t {
  kMemory,          // the memory has read line `what` of the L2's requests
  kBanks,           // the memory's banks have something to say
  kWritten,         // the memory has taken a block of pixels of the core
  kTextureFill,     // request `what` of the core's texture cache is answered
  kTextureFree,     // the core's texture unit has taken its lookups
  kFetch,           // the core's fetch unit may go on
  kListRead,        // its tile's list is there, then its records
  kItemRead,        // records and heights of sub-patch `what` are there
  kAlphaRead,       // texels of alpha tests of sub-patch `what` are there
  kAlphaStart,      // its alpha tests may begin
  kTested,          // all sub-patches of the core's tile are tested
  kShadingRead,     // records that shading reads are there
  kWarpReady,       // a warp is packed
  kIssue,           // the core's lanes are free
  kWarpRead,        // texels of warp `what` are there
  kShaded,          // the core's tile is shaded
  kStore,           // the resolve unit has finished a block of pixels
  kGeometry,        // the front end or the binner may go on
  kGeometryRead,    // what the front end reads for block `what` is there
  kGeometryWritten  // the memory has taken what the binner wrote of a block
};

struct Event {
  double time = 0;
  std::uint64_t order = 0;  // of equals the one that was asked for first
  EventKind kind{};
  std::uint32_t who = 0, what = 0;
};

// Events by time.
class EventQueue {
 public:
  void push(double time, EventKind kind, std::uint32_t who = 0, std::uint32_t what = 0) {
    heap_.push_back({std::max(time, now_), next_++, kind, who, what});
    std::push_heap(heap_.begin(), heap_.end(), later);
  }
  bool empty() const { return heap_.empty(); }
  Event pop() {
    std::pop_heap(heap_.begin(), heap_.end(), later);
    const Event event = heap_.back();
    heap_.pop_back();
    now_ = event.time;
    return event;
  }
  double now() const { return now_; }
  std::uint64_t count() const { return next_; }

 private:
  static bool later(const Event& a, const Event& b) { return a.time != b.time ? a.time > b.time : a.order > b.order; }

  std::vector<Event> heap_;
  double now_ = 0;
  std::uint64_t next_ = 0;
};

}  // namespace tessera::timing
