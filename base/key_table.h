#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "base/enum_words.h"

namespace tessera {

template <class T>
concept KeyNumber = std::floating_point<T> ||(std::integral<T> && !std::same_as<T, bool>);

// A value on its way between a text and a member of a struct. The text stands for a word of an enum or for a member
// that is a string.
using KeyValue = std::variant<std::int64_t, double, bool, std::string>;

// Range in which an unpublished number plausibly lies, given for the default value; for another value its ends scale in
// proportion.
struct PlausibleRange {
  double low = 0, high = 0;
};

// A setting that a user names: one row per key, declared once beside the struct it fills. Parsing, validation, printing
// and the generated documentation all walk the same rows.
struct KeyInfo {
  std::string_view name;     // dotted, "unit.quantity"
  std::string_view unit;     // "pixels", "bytes", "" for pure numbers and choices
  std::string_view meaning;  // one sentence
  std::string_view source;   // "[spec] ...", "[measured] ...", "[assumed] ..."; "" for plain choices of ours
  double min = 0;            // numbers: inclusive range
  double max = 0;
  std::vector<std::string_view> choices;  // texts: the allowed words; none: any text, a name or a file
  bool timing = false;                    // only the timing of recorded work reads it: the record does not depend on it
  std::optional<PlausibleRange> ends;     // numbers: no value means from half to twice the default

  bool assumed() const { return source.find("[assumed]") != std::string_view::npos; }
};
// Returns the plausible range around `value`, clamped to the key's own range: a sensitivity study sets the key to its
// ends.
PlausibleRange key_ends(const KeyInfo& key, double value, double default_value);

// The decimal number with the fewest digits that rounds to this float: 0.02 for 0.02f.
double shortest_decimal(float value);

template <class T>
KeyValue to_key_value(const T& value) {
  if constexpr (std::same_as<T, bool>)
    return value;
  else if constexpr (WordEnum<T>)
    return std::string(word(value));
  else if constexpr (std::same_as<T, std::string>)
    return value;
  else if constexpr (std::same_as<T, float>)
    return shortest_decimal(value);
  else if constexpr (std::floating_point<T>)
    return value;
  else
    return static_cast<std::int64_t>(value);
}
// Converts a value that the row allows.
template <class T>
T from_key_value(const KeyValue& value) {
  if constexpr (std::same_as<T, bool>)
    return std::get<bool>(value);
  else if constexpr (WordEnum<T>)
    return from_word<T>(std::get<std::string>(value)).value();
  else if constexpr (std::same_as<T, std::string>)
    return std::get<std::string>(value);
  else if constexpr (std::floating_point<T>)
    return static_cast<T>(std::get<double>(value));
  else
    return static_cast<T>(std::get<std::int64_t>(value));
}

// A row and the member of S that it fills.
template <class S>
struct Key : KeyInfo {
  std::function<KeyValue(const S&)> get;
  std::function<void(S&, const KeyValue&)> set;  // takes the result of parse_key_value() for this row

  template <KeyNumber T, class Owner>
  requires std::derived_from<S, Owner> Key(std::string_view key, T Owner::*where, std::string_view unit_in,
                                           double least, double most, std::string_view means,
                                           std::string_view from = "",
                                           std::optional<PlausibleRange> between = std::nullopt)
      : Key(KeyInfo{key, unit_in, means, from, least, most, {}, false, between}, where) {}
  Key(std::string_view key, bool S::*where, std::string_view means, std::string_view from = "")
      : Key(KeyInfo{key, "", means, from, 0, 1, {}, false, {}}, where) {}
  template <WordEnum E>
  Key(std::string_view key, E S::*where, std::string_view means, std::string_view from = "")
      : Key(KeyInfo{key, "", means, from, 0, 0, {kEnumWords<E>.begin(), kEnumWords<E>.end()}, false, {}}, where) {}

  Key(std::string_view key, std::string S::*where, std::string_view means, std::string_view from = "")
      : Key(KeyInfo{key, "", means, from, 0, 0, {}, false, {}}, where) {}

  Key(KeyInfo info, std::function<KeyValue(const S&)> get_value, std::function<void(S&, const KeyValue&)> set_value)
      : KeyInfo(std::move(info)), get(std::move(get_value)), set(std::move(set_value)) {}
  // The row of a struct that S is derived from.
  template <class Base>
  requires(std::derived_from<S, Base> && !std::same_as<S, Base>) explicit Key(const Key<Base>& key)
      : KeyInfo(key), get(key.get), set(key.set) {}
  // The row of a struct that is itself a member.
  template <class Unit>
  Key(Unit S::*part, const Key<Unit>& key)
      : KeyInfo(key),
        get([part, key](const S& object) { return key.get(object.*part); }),
        set([part, key](S& object, const KeyValue& value) { key.set(object.*part, value); }) {}

 private:
  template <class T, class Owner>
  Key(KeyInfo info, T Owner::*where)
      : KeyInfo(std::move(info)),
        get([where](const S& object) { return to_key_value(object.*where); }),
        set([where](S& object, const KeyValue& value) { object.*where = from_key_value<T>(value); }) {}
};

// Rows of a struct, rows of its members included, in the order in which they are added.
template <class S>
class Keys {
 public:
  Keys() = default;
  Keys(std::initializer_list<Key<S>> rows) : rows_(rows) {}

  Keys& add(const Keys& more) {
    rows_.insert(rows_.end(), more.begin(), more.end());
    return *this;
  }
  template <class Base>
  requires(std::derived_from<S, Base> && !std::same_as<S, Base>) Keys& add(const Keys<Base>& more) {
    for (const Key<Base>& key : more) rows_.emplace_back(key);
    return *this;
  }
  template <class Unit>
  Keys& add(Unit S::*part, const Keys<Unit>& more) {
    for (const Key<Unit>& key : more) rows_.emplace_back(part, key);
    return *this;
  }

  // Marks all rows so far as KeyInfo::timing, except for the named ones.
  Keys& mark_timing_but(std::initializer_list<std::string_view> functional) {
    for (Key<S>& row : rows_)
      row.timing = std::find(functional.begin(), functional.end(), row.name) == functional.end();
    return *this;
  }

  auto begin() const { return rows_.begin(); }
  auto end() const { return rows_.end(); }
  std::size_t size() const { return rows_.size(); }
  const Key<S>& operator[](std::size_t k) const { return rows_[k]; }

 private:
  std::vector<Key<S>> rows_;
};

// Checks `value` (a JSON scalar, or a text as given on the command line) against the row and converts it to the type of
// `like`. Throws UsageError that names the value found and the allowed ones.
KeyValue parse_key_value(const KeyInfo& key, const KeyValue& like, const nlohmann::json& value);

// A row for people and programs: {"key", "type", "unit", "default", "min", "max", "choices", "meaning", "source"}; for
// assumed numbers also "low" and "high".
nlohmann::json describe_key(const KeyInfo& key, const KeyValue& default_value);
nlohmann::json key_value_json(const KeyValue& value);

// "unknown key 'x'; did you mean 'y'?"; for a removed key, the reason (base/former_keys.h).
std::string unknown_key_message(std::string_view key, std::span<const std::string> known);

// Key table of one struct, with the struct's own default values as defaults.
template <class S>
class KeyTable {
 public:
  explicit KeyTable(Keys<S> keys) : keys_(std::move(keys)) {}

  const Keys<S>& keys() const { return keys_; }
  const Key<S>* find(std::string_view name) const {
    for (const Key<S>& key : keys_)
      if (key.name == name) return &key;
    return nullptr;
  }
  KeyValue value(const S& object, const Key<S>& key) const { return key.get(object); }
  KeyValue default_value(const Key<S>& key) const { return value(S{}, key); }

  void set(S& object, const Key<S>& key, const nlohmann::json& text_or_scalar) const {
    key.set(object, parse_key_value(key, value(object, key), text_or_scalar));
  }

 private:
  Keys<S> keys_;
};

}  // namespace tessera
