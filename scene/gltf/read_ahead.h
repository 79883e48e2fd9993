#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "scene/gltf/document.h"
#include "scene/gltf/image_reader.h"
#include "scene/limits.h"

namespace tessera::scene::gltf {

// What was decoded ahead of the builders that will ask for it, by a key.
template <class Key, class Value>
class Shelf {
 public:
  // The value, taken off, and charged to `budget` as decoding it now would be; nothing where it is not there.
  template <class Asked>
  std::optional<Value> take(const Asked& key, MemoryBudget& budget) {
    const auto found = entries_.find(key);
    if (found == entries_.end()) return std::nullopt;
    Entry entry = std::move(found->second);
    entries_.erase(found);
    budget.stop_waiting(entry.bytes);
    for (const Charge& charge : entry.charges) budget.charge(charge.count, charge.size, charge.what);
    return std::move(entry.value);
  }
  const Value* find(const Key& key) const {
    const auto found = entries_.find(key);
    return found == entries_.end() ? nullptr : &found->second.value;
  }
  // `bytes`: the sum of `charges`.
  void put(Key key, Value value, std::vector<Charge> charges, std::uint64_t bytes) {
    entries_.emplace(std::move(key), Entry{std::move(value), std::move(charges), bytes});
  }
  void clear() { entries_.clear(); }
  std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    Value value;
    std::vector<Charge> charges;
    std::uint64_t bytes;
  };
  std::map<Key, Entry, std::less<>> entries_;
};

// Streams and images of a document, decoded on all threads before the builders ask for them one after the other.
//
// Invariants (cited by the tests):
//   RA1  What is read, charged, noted and refused, and with which words, is what reading in the file's order does, for
//        any number of threads: a fault met ahead is forgotten, and whoever asks decodes anew and meets it in turn.
//   RA2  What waits is charged to what the budget has left, and dropped where a charge needs the room.
struct ReadAhead {
  Shelf<std::string, std::vector<std::uint8_t>> uris;
  Shelf<std::size_t, std::vector<std::uint8_t>> views;
  Shelf<const nlohmann::json*, DecodedMesh> draco;  // by primitive
  Shelf<std::pair<std::size_t, shaders::ColorSpace>, ColorImage> colors;
  Shelf<std::size_t, HeightImage> heights;
  Shelf<std::size_t, UnpackedBasis> basis_colors, basis_heights;

  void clear();
};

// Fills document.ahead, where more than one thing can be decoded at once.
void read_ahead(Document& document);

}  // namespace tessera::scene::gltf
