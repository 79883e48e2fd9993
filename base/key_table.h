#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace tessera {

// What a user may set by name: one row per key, declared once beside the struct it fills. Parsing, validation,
// printing and the generated documentation all walk the same rows.
struct KeyInfo {
  std::string_view name;     // dotted, "unit.quantity"
  std::string_view unit;     // "pixels", "bytes", "" for pure numbers and choices
  std::string_view meaning;  // one sentence
  std::string_view source;   // "[spec] ...", "[measured] ...", "[assumed] ..."; "" for plain choices of ours
  double min = 0;            // numbers: inclusive range
  double max = 0;
  std::vector<std::string_view> choices;  // texts: the allowed words
};

template <class S>
struct Key : KeyInfo {
  using Member = std::variant<std::int64_t S::*, double S::*, bool S::*, std::string S::*>;
  Member member;

  Key(std::string_view key, Member where, std::string_view unit_in, double low, double high, std::string_view means,
      std::string_view from = "")
      : KeyInfo{key, unit_in, means, from, low, high, {}}, member(where) {}
  Key(std::string_view key, bool S::*where, std::string_view means, std::string_view from = "")
      : KeyInfo{key, "", means, from, 0, 1, {}}, member(where) {}
  Key(std::string_view key, std::string S::*where, std::vector<std::string_view> words, std::string_view means,
      std::string_view from = "")
      : KeyInfo{key, "", means, from, 0, 0, std::move(words)}, member(where) {}
};

using KeyValue = std::variant<std::int64_t, double, bool, std::string>;

// Checks `value` (a JSON scalar, or a text as given on the command line) against the row and converts it to the
// type of `like`. Throws UsageError saying what was found and what is allowed.
KeyValue parse_key_value(const KeyInfo& key, const KeyValue& like, const nlohmann::json& value);

// A row for people and programs: {"key", "type", "unit", "default", "min", "max", "choices", "meaning", "source"}.
nlohmann::json describe_key(const KeyInfo& key, const KeyValue& default_value);
nlohmann::json key_value_json(const KeyValue& value);

// "unknown key 'x'; did you mean 'y'?"
std::string unknown_key_message(std::string_view key, std::span<const std::string> known);

// Key table of one struct, with the struct's own default values as defaults.
template <class S>
class KeyTable {
 public:
  explicit KeyTable(std::vector<Key<S>> keys) : keys_(std::move(keys)) {}

  const std::vector<Key<S>>& keys() const { return keys_; }
  const Key<S>* find(std::string_view name) const {
    for (const Key<S>& key : keys_)
      if (key.name == name) return &key;
    return nullptr;
  }
  KeyValue value(const S& object, const Key<S>& key) const {
    return std::visit([&](auto member) -> KeyValue { return object.*member; }, key.member);
  }
  KeyValue default_value(const Key<S>& key) const { return value(S{}, key); }

  void set(S& object, const Key<S>& key, const nlohmann::json& text_or_scalar) const {
    const KeyValue parsed = parse_key_value(key, value(object, key), text_or_scalar);
    std::visit([&](auto member) { object.*member = std::get<std::decay_t<decltype(object.*member)>>(parsed); },
               key.member);
  }

 private:
  std::vector<Key<S>> keys_;
};

}  // namespace tessera
