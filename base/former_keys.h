#pragma once

#include <span>
#include <string>
#include <string_view>

namespace tessera {

// A key, or "key=word" for one word of a key, that users may still have in scripts and machine files.
struct FormerKey {
  std::string_view name;
  std::string_view now;     // the key that it is an alias of; "": it was removed
  std::string_view reason;  // one sentence: why it was removed, or what replaces it; "" for aliases
};

// All of them, in the order of their names.
std::span<const FormerKey> former_keys();

// nullptr: `name` was never a key, or is one.
const FormerKey* find_former_key(std::string_view name);

// The key that `name` is an alias of, or `name` itself.
std::string current_key(const std::string& name);

// "resolve.k_stat is called resolve.reuse_speed now", for notes.
std::string former_key_note(const FormerKey& key);

}  // namespace tessera
