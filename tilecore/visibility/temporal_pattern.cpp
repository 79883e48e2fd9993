#include "tilecore/visibility/temporal_pattern.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace tessera::tilecore {
namespace {

// Energy that each point spreads over the torus: a Gaussian of 1.5 cells.
class Torus {
 public:
  explicit Torus(int n)
      : n_(n), energy_(static_cast<std::size_t>(n) * static_cast<std::size_t>(n), 0.0), taken_(energy_.size(), false) {}

  void put(std::size_t cell, bool present) {
    taken_[cell] = present;
    const int cx = static_cast<int>(cell) % n_, cy = static_cast<int>(cell) / n_;
    for (int y = 0; y < n_; ++y)
      for (int x = 0; x < n_; ++x) {
        const int dx = std::min((x - cx + n_) % n_, (cx - x + n_) % n_),
                  dy = std::min((y - cy + n_) % n_, (cy - y + n_) % n_);
        energy_[static_cast<std::size_t>(y * n_ + x)] +=
            (present ? 1.0 : -1.0) * std::exp(-(dx * dx + dy * dy) / (2.0 * 1.5 * 1.5));
      }
  }
  // The free cell with the least energy, or the taken one with the most; the first of equals.
  std::size_t largest_void() const {
    return pick(false, [](double a, double b) { return a < b - 1e-9; });
  }
  std::size_t tightest_cluster() const {
    return pick(true, [](double a, double b) { return a > b + 1e-9; });
  }

 private:
  template <class Better>
  std::size_t pick(bool taken, const Better& better) const {
    std::size_t best = energy_.size();
    for (std::size_t c = 0; c < energy_.size(); ++c)
      if (taken_[c] == taken && (best == energy_.size() || better(energy_[c], energy_[best]))) best = c;
    return best;
  }

  int n_;
  std::vector<double> energy_;
  std::vector<bool> taken_;
};

}  // namespace

std::vector<std::uint16_t> void_and_cluster_ranks(int n) {
  const std::size_t cells = static_cast<std::size_t>(n) * static_cast<std::size_t>(n);
  std::vector<std::uint16_t> ranks(cells, 0);
  Torus torus(n);
  // Start from a tenth of the cells, moved from clusters to voids until that changes nothing.
  const std::size_t start = std::max<std::size_t>(1, cells / 10);
  for (std::size_t i = 0; i < start; ++i) torus.put(torus.largest_void(), true);
  for (std::size_t guard = 0; guard < 4 * cells; ++guard) {
    const std::size_t from = torus.tightest_cluster();
    torus.put(from, false);
    const std::size_t to = torus.largest_void();
    torus.put(to, true);
    if (to == from) break;
  }
  // The starting points are ranked by taking them away, clusters first; then all others by filling voids.
  Torus rest = torus;
  for (std::size_t r = start; r-- > 0;) {
    const std::size_t cell = rest.tightest_cluster();
    rest.put(cell, false);
    ranks[cell] = static_cast<std::uint16_t>(r);
  }
  for (std::size_t r = start; r < cells; ++r) {
    const std::size_t cell = torus.largest_void();
    torus.put(cell, true);
    ranks[cell] = static_cast<std::uint16_t>(r);
  }
  return ranks;
}

}  // namespace tessera::tilecore
