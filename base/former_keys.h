#pragma once

#include <span>
#include <string>
#include <string_view>

namespace tessera {

// A former key, or "key=word" for a former word of a key, that users may still have in scripts and machine files.
struct FormerKey {
  std::string_view name;
  std::string_view now;     // the key that replaces this alias; "" for a removed key
  std::string_view reason;  // one sentence: why it was removed, or what replaces it; "" for aliases
};

// All former keys, sorted by name.
std::span<const FormerKey> former_keys();

// Returns nullptr if `name` is a current key or was never one.
const FormerKey* find_former_key(std::string_view name);

// The key that `name` is an alias of, or `name` itself.
std::string current_key(const std::string& name);

// Text for notes: "resolve.k_stat is called resolve.reuse_speed now".
std::string former_key_note(const FormerKey& key);

}  // namespace tessera
