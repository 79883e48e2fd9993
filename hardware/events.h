#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "base/key_table.h"
#include "hardware/stage.h"

namespace tessera::hardware {

// The events that units do and the machine charges: the rows of hardware/events.def, phase after phase.
enum class Event : std::uint8_t {
#define TESSERA_EVENT(id, ...) id,
#include "hardware/each_event.inc"
};
enum class Silicon : std::uint8_t {
#define TESSERA_SILICON(id, ...) id,
#include "hardware/each_event.inc"
};

inline constexpr std::size_t kEventCount = 0
#define TESSERA_EVENT(...) +1
#include "hardware/each_event.inc"
    ;
inline constexpr std::size_t kSiliconCount = 0
#define TESSERA_SILICON(...) +1
#include "hardware/each_event.inc"
    ;

// A value for each event.
template <class T>
struct EventArray : std::array<T, kEventCount> {
  using std::array<T, kEventCount>::operator[];
  constexpr T& operator[](Event event) { return (*this)[static_cast<std::size_t>(event)]; }
  constexpr const T& operator[](Event event) const { return (*this)[static_cast<std::size_t>(event)]; }
};
template <class T>
struct SiliconArray : std::array<T, kSiliconCount> {
  using std::array<T, kSiliconCount>::operator[];
  constexpr T& operator[](Silicon silicon) { return (*this)[static_cast<std::size_t>(silicon)]; }
  constexpr const T& operator[](Silicon silicon) const { return (*this)[static_cast<std::size_t>(silicon)]; }
};

// Number of each event.
struct EventCounts : EventArray<std::uint64_t> {
  EventCounts() : EventArray<std::uint64_t>{} {}
  EventCounts& operator+=(const EventCounts& more) {
    for (std::size_t e = 0; e < kEventCount; ++e) (*this)[e] += more[e];
    return *this;
  }
  EventCounts operator-(const EventCounts& before) const {
    EventCounts out;
    for (std::size_t e = 0; e < kEventCount; ++e) out[e] = (*this)[e] - before[e];
    return out;
  }
  bool operator==(const EventCounts&) const = default;
};

// The phase that charges an event: the geometry before tiles, then a tile's phases in order.
enum class EventPhase : std::uint8_t { kGeometry, kList, kVisibility, kShading, kStore };

// Parts of a unit that work side by side, as bits.
inline constexpr std::uint8_t kFirstPart = 1, kSecondPart = 2, kThirdPart = 4, kFourthPart = 8, kFifthPart = 16;

// The memory on chip whose capacity an event's energy grows with.
enum class Access : std::uint8_t { kNone, kTileMemory, kTextureCache, kL2 };

// Numbers of the machine with their defaults, as in KeyInfo; an empty key means that there is none.
struct EventRate {
  std::string_view key;
  double per_clk = 0;
  std::string_view unit, meaning, source;
  std::optional<PlausibleRange> ends = std::nullopt;
};
struct EventEnergy {
  std::string_view key;
  double pj = 0;
  std::string_view meaning, source;
  std::optional<PlausibleRange> ends = std::nullopt;
};

struct EventColumns {
  std::optional<Stage> unit = std::nullopt;
  std::uint8_t parts = kFirstPart;
  bool in_each_core = false;  // true for events of the geometry that a unit in every core does
  EventRate rate = {};
  EventEnergy energy = {};
  std::optional<Event> timed_as = std::nullopt, priced_as = std::nullopt;
  Access access = Access::kNone;
  std::optional<Silicon> silicon = std::nullopt;
  double share = 1;
};
struct EventRow : EventColumns {
  std::string_view name;
  EventPhase phase{};
};

enum class Combine : std::uint8_t { kSum, kMax };
struct SiliconRow {
  std::string_view group;
  Combine combine{};
  std::string_view key;
  double mm2 = 0;
  std::string_view meaning, source;
  std::optional<PlausibleRange> ends = std::nullopt;
};

inline constexpr EventArray<EventRow> kEventTable = {{
#define TESSERA_EVENT(id, name, phase, ...) EventRow{EventColumns{__VA_ARGS__}, name, EventPhase::phase},
#include "hardware/each_event.inc"
}};
inline constexpr SiliconArray<SiliconRow> kSiliconTable = {{
#define TESSERA_SILICON(id, group, combine, ...) SiliconRow{group, Combine::combine, __VA_ARGS__},
#include "hardware/each_event.inc"
}};

// All events, to loop over.
constexpr auto all_events() {
  std::array<Event, kEventCount> events{};
  for (std::size_t e = 0; e < kEventCount; ++e) events[e] = static_cast<Event>(e);
  return events;
}
inline constexpr auto kAllEvents = all_events();

constexpr std::string_view name(Event event) { return kEventTable[event].name; }
// Name of the unit whose energy includes the event: a stage, or "l2".
constexpr std::string_view unit_name(Event event) {
  return kEventTable[event].unit ? name(*kEventTable[event].unit) : std::string_view("l2");
}
constexpr bool takes_time(Event event) { return !kEventTable[event].rate.key.empty() || kEventTable[event].timed_as; }

// The range of events that are kept for each sub-patch of a tile: all of EventPhase::kVisibility, consecutively.
constexpr std::size_t first_of(EventPhase phase) {
  std::size_t e = 0;
  while (e < kEventCount && kEventTable[e].phase != phase) ++e;
  return e;
}
inline constexpr std::size_t kFirstItemEvent = first_of(EventPhase::kVisibility),
                             kItemEventCount = first_of(EventPhase::kShading) - kFirstItemEvent;

}  // namespace tessera::hardware
