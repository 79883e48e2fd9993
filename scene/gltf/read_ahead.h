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

// Values that were decoded before the builders ask for them, by key.
template <class Key, class Value>
class Shelf {
 public:
  // Takes the value off the shelf and charges it to `budget`, as decoding it now would. Returns nothing if it is not
  // there.
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

// Streams and images of a document, decoded on all threads before the builders ask for them in order.
//
// Invariants (cited by the tests):
//   RA1  For any number of threads, values, charges, notes, refusals and their words equal the results that reading in
//        the file's order gives: a fault met ahead is forgotten, and the builder decodes anew and meets it in turn.
//   RA2  Waiting values are charged to the rest of the budget, and dropped where a charge needs the room.
struct ReadAhead {
  Shelf<std::string, std::vector<std::uint8_t>> uris;
  Shelf<std::size_t, std::vector<std::uint8_t>> views;
  Shelf<const nlohmann::json*, DecodedMesh> draco;  // by primitive
  Shelf<std::pair<std::size_t, shaders::ColorSpace>, ColorImage> colors;
  Shelf<std::size_t, HeightImage> heights;
  Shelf<std::size_t, UnpackedBasis> basis_colors, basis_heights;

  void clear();
};

// Fills document.ahead, where several things can be decoded at once.
void read_ahead(Document& document);

}  // namespace tessera::scene::gltf
