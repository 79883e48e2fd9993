#pragma once

#include <algorithm>
#include <cstdint>
#include <string_view>

namespace tessera {

// How the values of one counter in several frames are combined.
enum class Combine { kSum, kPeak };

// Declaration of one counter: the only place that knows its name, unit and meaning.
template <class S>
struct CounterField {
  std::string_view name;  // "unit.event"
  std::uint64_t S::*member;
  Combine combine;
  std::string_view unit;
  std::string_view meaning;
  std::string_view vendor;  // names of this counter in vendors' profilers; "" when no vendor offers it
};

// Declarations of the counter struct S, in the order of its members. Specialised beside each struct:
//   template <> inline constexpr auto kCounterFields<BinnerCounters> = std::to_array<...>({...});
// followed by TESSERA_COUNTERS_COVER(BinnerCounters).
template <class S>
inline constexpr int kCounterFields = 0;

// Specialised as true for units that only some configurations have: while such a unit has counted nothing it did not
// run, and its counters are absent from statistics instead of zero.
template <class S>
inline constexpr bool kAbsentWhenIdle = false;

template <class S>
bool absent(const S& counters) {
  if constexpr (!kAbsentWhenIdle<S>) return false;
  for (const auto& field : kCounterFields<S>)
    if (counters.*field.member != 0) return false;
  return true;
}

// A struct of raw counts is a value: `merge` joins the counts of two units that worked on one frame.
template <class S>
void merge(S& into, const S& from) {
  for (const auto& field : kCounterFields<S>) into.*field.member += from.*field.member;
}

// Takes away the counts that were there before; peaks stay.
template <class S>
void subtract(S& counters, const S& before) {
  for (const auto& field : kCounterFields<S>)
    if (field.combine == Combine::kSum) counters.*field.member -= before.*field.member;
}

// Joins the counts of a further frame into a total.
template <class S>
void accumulate(S& total, const S& frame) {
  for (const auto& field : kCounterFields<S>) {
    std::uint64_t& value = total.*field.member;
    if (field.combine == Combine::kSum)
      value += frame.*field.member;
    else
      value = std::max(value, frame.*field.member);
  }
}

}  // namespace tessera

// Every member of the struct is declared: no counter can be printed nameless or forgotten.
#define TESSERA_COUNTERS_COVER(S)                                                         \
  static_assert(sizeof(S) == sizeof(std::uint64_t) * ::tessera::kCounterFields<S>.size(), \
                #S ": each counter needs exactly one declaration")
