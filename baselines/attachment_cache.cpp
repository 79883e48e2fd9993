#include "baselines/attachment_cache.h"

#include <algorithm>
#include <iterator>
#include <span>
#include <utility>

#include "base/check.h"

namespace tessera::baselines {

AttachmentCache::AttachmentCache(std::uint64_t cache_bytes, std::uint64_t burst_bytes, std::uint32_t line_count)
    : burst_bytes_(burst_bytes), in_memory_(line_count, false) {
  // More room than the attachment has lines is never used.
  const std::uint64_t lines = std::min<std::uint64_t>(cache_bytes / burst_bytes, line_count + kWays);
  ways_ = static_cast<std::size_t>(std::min(lines, kWays));
  sets_ = ways_ == 0 ? 0 : lines / ways_;
  lines_.resize(sets_ * ways_);
}

void AttachmentCache::write_back(std::uint32_t line) {
  bytes_written_ += burst_bytes_;
  in_memory_[line] = true;
}

void AttachmentCache::use(std::uint32_t line, bool read, bool change) {
  TESSERA_CHECK(line < in_memory_.size(), "a line lies in its attachment");
  const bool in_memory = in_memory_[line];
  if (sets_ == 0) {
    if (read && in_memory) bytes_read_ += burst_bytes_;
    if (change) write_back(line);
    return;
  }
  const std::span<Way> set = std::span(lines_).subspan(line % sets_ * ways_, ways_);
  auto at = std::find_if(set.begin(), set.end(), [&](const Way& way) { return way.line == line; });
  if (at == set.end()) {
    if (read && in_memory) bytes_read_ += burst_bytes_;
    at = std::prev(set.end());
    if (at->changed) write_back(at->line);
    *at = {line, false};
  }
  at->changed = at->changed || change;
  std::rotate(set.begin(), at, std::next(at));
}

void AttachmentCache::finish() {
  for (Way& way : lines_)
    if (std::exchange(way.changed, false)) write_back(way.line);
}

}  // namespace tessera::baselines
