#include "tilecore/resolve/touched_bursts.h"

#include <algorithm>

namespace tessera::tilecore {

void TouchedBursts::touch(const Array& array, IntRect rect) {
  if (rect.empty()) return;
  for (int y = rect.y0; y < rect.y1; ++y)
    touch(array.at(rect.x0, y), static_cast<std::uint64_t>(rect.width()) * array.bytes);
}

std::span<const TouchedBursts::Run> TouchedBursts::runs() {
  if (spans_.size() < 2) return spans_;
  std::sort(spans_.begin(), spans_.end(), [](const Run& a, const Run& b) { return a.first < b.first; });
  std::size_t last = 0;
  for (std::size_t i = 1; i < spans_.size(); ++i) {
    if (spans_[i].first <= spans_[last].end)
      spans_[last].end = std::max(spans_[last].end, spans_[i].end);
    else
      spans_[++last] = spans_[i];
  }
  spans_.resize(last + 1);
  return spans_;
}

void TouchedBursts::write(memory::Ledger& ledger, memory::Unit unit, memory::Purpose purpose) {
  for (const Run& run : runs())
    ledger.write_at(unit, purpose, run.first * burst_bytes_, (run.end - run.first) * burst_bytes_, burst_bytes_);
}

}  // namespace tessera::tilecore
