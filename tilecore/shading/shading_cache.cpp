#include "tilecore/shading/shading_cache.h"

#include <algorithm>
#include <utility>

#include "base/check.h"

namespace tessera::tilecore {
namespace {

constexpr std::size_t kFirstBuckets = 1024;  // a power of two

}  // namespace

void ShadingCache::empty(std::size_t capacity) {
  TESSERA_CHECK(capacity > 0, "a shading cache holds at least one cell");
  capacity_ = capacity;
  entries_.clear();
  buckets_.assign(std::max(buckets_.size(), kFirstBuckets), kNone);
  newest_ = oldest_ = kNone;
}

std::uint32_t& ShadingCache::bucket(const ShadingCell& cell) {
  std::uint64_t h = (std::uint64_t{cell.patch} << 32 | cell.part) * 0x9E3779B97F4A7C15u;
  h = (h ^ (h >> 29) ^ (std::uint64_t{cell.j} << 16 | cell.i)) * 0xBF58476D1CE4E5B9u;
  return buckets_[(h >> 32) & (buckets_.size() - 1)];
}

void ShadingCache::grow() {
  buckets_.assign(buckets_.size() * 2, kNone);
  for (std::uint32_t e = 0; e < entries_.size(); ++e)
    entries_[e].next_in_bucket = std::exchange(bucket(entries_[e].cell), e);
}

void ShadingCache::unlink(std::uint32_t e) {
  const Entry& entry = entries_[e];
  (entry.newer == kNone ? newest_ : entries_[entry.newer].older) = entry.older;
  (entry.older == kNone ? oldest_ : entries_[entry.older].newer) = entry.newer;
}

void ShadingCache::make_newest(std::uint32_t e) {
  entries_[e].newer = kNone;
  entries_[e].older = newest_;
  (newest_ == kNone ? oldest_ : entries_[newest_].newer) = e;
  newest_ = e;
}

std::uint32_t ShadingCache::find(const ShadingCell& cell) {
  for (std::uint32_t e = bucket(cell); e != kNone; e = entries_[e].next_in_bucket) {
    if (!(entries_[e].cell == cell)) continue;
    if (e != newest_) {
      unlink(e);
      make_newest(e);
    }
    return entries_[e].number;
  }
  return kNone;
}

void ShadingCache::insert(const ShadingCell& cell, std::uint32_t number) {
  auto e = static_cast<std::uint32_t>(entries_.size());
  if (entries_.size() < capacity_) {
    if (entries_.size() >= buckets_.size()) grow();
    entries_.emplace_back();
  } else {
    e = oldest_;
    unlink(e);
    std::uint32_t* link = &bucket(entries_[e].cell);
    while (*link != e) link = &entries_[*link].next_in_bucket;
    *link = entries_[e].next_in_bucket;
  }
  std::uint32_t& first = bucket(cell);
  entries_[e].cell = cell;
  entries_[e].number = number;
  entries_[e].next_in_bucket = first;
  first = e;
  make_newest(e);
}

}  // namespace tessera::tilecore
