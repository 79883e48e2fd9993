#include "base/ktx2/etc1s_fit.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>

#include "base/ktx2/etc2_block.h"
#include "base/parallel.h"

namespace tessera::ktx2 {
namespace {

using Colors = std::array<std::array<std::uint8_t, 3>, 4>;

int squared(int v) { return v * v; }

int error_of(const std::array<std::uint8_t, 4>& texel, const std::array<std::uint8_t, 3>& color) {
  return squared(texel[0] - color[0]) + squared(texel[1] - color[1]) + squared(texel[2] - color[2]);
}

// The nearest of the endpoint's colours for each texel, and the sum of squared errors.
int choose_selectors(const TexelBlock& texels, const Etc1sEndpoint& endpoint, Etc1sSelector& selector) {
  const Colors colors = etc1s_colors(endpoint);
  selector = {};
  int sum = 0;
  for (unsigned t = 0; t < 16; ++t) {
    unsigned best = 0;
    int least = std::numeric_limits<int>::max();
    for (unsigned s = 0; s < 4; ++s)
      if (const int error = error_of(texels[t], colors[s]); error < least) least = error, best = s;
    selector.rows[t / 4] = static_cast<std::uint8_t>(selector.rows[t / 4] | best << (2 * (t % 4)));
    sum += least;
  }
  return sum;
}

std::uint8_t narrow(double value) {
  return static_cast<std::uint8_t>(std::clamp(static_cast<int>(value * 31.0 / 255.0 + 0.5), 0, 31));
}

// For every table: the base begins at the mean and goes, twice, to the mean of what the selectors leave of the texels.
Etc1sEndpoint fit_endpoint(const TexelBlock& texels) {
  Etc1sEndpoint best{};
  int least = std::numeric_limits<int>::max();
  for (std::uint8_t table = 0; table < kEtc1Modifiers.size() && least > 0; ++table) {
    const auto [a, b] = kEtc1Modifiers[table];
    const std::array<int, 4> steps = {-b, -a, a, b};
    std::array<int, 16> step{};  // of each texel
    for (int round = 0; round < 3; ++round) {
      std::array<double, 3> mean{};
      for (std::size_t t = 0; t < 16; ++t)
        for (std::size_t c = 0; c < 3; ++c) mean[c] += (texels[t][c] - step[t]) / 16.0;
      const Etc1sEndpoint endpoint{narrow(mean[0]), narrow(mean[1]), narrow(mean[2]), table};
      Etc1sSelector selector;
      const int error = choose_selectors(texels, endpoint, selector);
      if (error < least) least = error, best = endpoint;
      for (unsigned t = 0; t < 16; ++t) step[t] = steps[selector.at(t % 4, t / 4)];
    }
  }
  return best;
}

// Cuts points into at most `most` sets: always the set of the largest spread, at the mean of its widest coordinate.
// `points`: `n` coordinates each, with how often they occur. The set of each point.
class MedianCut {
 public:
  MedianCut(std::span<const std::uint8_t> points, std::span<const std::uint32_t> counts, std::size_t n)
      : points_(points), counts_(counts), n_(n) {}

  std::vector<std::vector<std::size_t>> sets(std::size_t most) {
    std::vector<std::size_t> all(counts_.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    std::vector<Set> heap = {measure(std::move(all))};
    const auto less = [](const Set& a, const Set& b) {
      return a.spread != b.spread ? a.spread < b.spread : a.members.front() > b.members.front();
    };
    while (heap.size() < most && heap.front().spread > 0) {
      std::pop_heap(heap.begin(), heap.end(), less);
      Set whole = std::move(heap.back());
      heap.pop_back();
      const auto middle = std::stable_partition(whole.members.begin(), whole.members.end(), [&](std::size_t p) {
        return static_cast<double>(points_[p * n_ + whole.axis]) < whole.mean;
      });
      for (std::vector<std::size_t> half : {std::vector<std::size_t>(whole.members.begin(), middle),
                                            std::vector<std::size_t>(middle, whole.members.end())}) {
        heap.push_back(measure(std::move(half)));
        std::push_heap(heap.begin(), heap.end(), less);
      }
    }
    std::vector<std::vector<std::size_t>> out;
    for (Set& set : heap) out.push_back(std::move(set.members));
    std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.front() < b.front(); });
    return out;
  }

  // Mean of a coordinate over a set, rounded.
  std::uint8_t mean(const std::vector<std::size_t>& set, std::size_t axis) const {
    double sum = 0, weight = 0;
    for (const std::size_t p : set) {
      sum += static_cast<double>(points_[p * n_ + axis]) * counts_[p];
      weight += counts_[p];
    }
    return static_cast<std::uint8_t>(sum / weight + 0.5);
  }

 private:
  struct Set {
    std::vector<std::size_t> members;  // rising
    double spread, mean;               // squared deviations along the widest axis, and the mean there
    std::size_t axis;
  };

  Set measure(std::vector<std::size_t> members) const {
    Set set{std::move(members), -1, 0, 0};
    for (std::size_t axis = 0; axis < n_; ++axis) {
      double sum = 0, squares = 0, weight = 0;
      for (const std::size_t p : set.members) {
        const double v = points_[p * n_ + axis], count = counts_[p];
        sum += v * count, squares += v * v * count, weight += count;
      }
      const auto [low, high] = std::minmax_element(
          set.members.begin(), set.members.end(),
          [&](std::size_t a, std::size_t b) { return points_[a * n_ + axis] < points_[b * n_ + axis]; });
      const bool alike = points_[*low * n_ + axis] == points_[*high * n_ + axis];
      const double spread = alike ? 0 : std::max(squares - sum * sum / weight, 1e-9);
      // Rounding must not put the mean at the end: both halves of a cut hold something.
      if (spread > set.spread)
        set.spread = spread, set.mean = std::max(sum / weight, points_[*low * n_ + axis] + 0.5), set.axis = axis;
    }
    return set;
  }

  std::span<const std::uint8_t> points_;
  std::span<const std::uint32_t> counts_;
  std::size_t n_;
};

// Different values among `values`, in order, with how often they occur and the number of each value.
template <class Value>
struct Distinct {
  std::vector<Value> values;
  std::vector<std::uint32_t> counts;
  std::vector<std::uint32_t> number;  // by original index

  explicit Distinct(const std::vector<Value>& all) {
    std::map<Value, std::uint32_t> known;
    for (const Value& value : all) ++known[value];
    std::map<Value, std::uint32_t> numbers;
    for (const auto& [value, count] : known) {
      numbers[value] = static_cast<std::uint32_t>(values.size());
      values.push_back(value);
      counts.push_back(count);
    }
    for (const Value& value : all) number.push_back(numbers[value]);
  }
};

using EndpointKey = std::array<std::uint8_t, 4>;  // red, green, blue, table
using SelectorKey = std::array<std::uint8_t, 16>;

int lightness(const Etc1sEndpoint& e) { return 2 * e.red + 5 * e.green + e.blue; }

// Endpoints of the codebook, and the one of each block.
std::vector<std::uint16_t> cluster_endpoints(const std::vector<EndpointKey>& of_blocks,
                                             std::vector<Etc1sEndpoint>& book) {
  const Distinct<EndpointKey> distinct(of_blocks);
  std::vector<std::uint8_t> points;
  for (const EndpointKey& key : distinct.values) points.insert(points.end(), key.begin(), key.end());
  MedianCut cut(points, distinct.counts, 4);
  std::vector<std::uint32_t> set_of(distinct.values.size());
  std::vector<Etc1sEndpoint> made;
  for (const std::vector<std::size_t>& set : cut.sets(kMaxEndpoints)) {
    for (const std::size_t p : set) set_of[p] = static_cast<std::uint32_t>(made.size());
    made.push_back({cut.mean(set, 0), cut.mean(set, 1), cut.mean(set, 2), cut.mean(set, 3)});
  }
  // Neighbours in the book are alike, so that steps from one to the next are short.
  std::vector<std::uint32_t> order(made.size()), place(made.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return lightness(made[a]) < lightness(made[b]); });
  book.clear();
  for (const std::uint32_t m : order) {
    place[m] = static_cast<std::uint32_t>(book.size());
    book.push_back(made[m]);
  }
  std::vector<std::uint16_t> out;
  for (const std::uint32_t number : distinct.number) out.push_back(static_cast<std::uint16_t>(place[set_of[number]]));
  return out;
}

std::vector<Etc1sSelector> cluster_selectors(const std::vector<SelectorKey>& of_blocks) {
  const Distinct<SelectorKey> distinct(of_blocks);
  std::vector<std::uint8_t> points;
  for (const SelectorKey& key : distinct.values) points.insert(points.end(), key.begin(), key.end());
  MedianCut cut(points, distinct.counts, 16);
  std::vector<Etc1sSelector> book;
  for (const std::vector<std::size_t>& set : cut.sets(kMaxSelectors)) {
    Etc1sSelector selector{};
    for (unsigned t = 0; t < 16; ++t)
      selector.rows[t / 4] = static_cast<std::uint8_t>(selector.rows[t / 4] | cut.mean(set, t) << (2 * (t % 4)));
    book.push_back(selector);
  }
  return book;
}

// The selector of least error for a block with this endpoint.
std::uint16_t nearest_selector(const TexelBlock& texels, const Etc1sEndpoint& endpoint,
                               const std::vector<Etc1sSelector>& book) {
  const Colors colors = etc1s_colors(endpoint);
  // Errors of a row by its byte of selectors.
  std::array<std::array<int, 256>, 4> row_error;
  for (unsigned y = 0; y < 4; ++y) {
    std::array<std::array<int, 4>, 4> error;
    for (unsigned x = 0; x < 4; ++x)
      for (unsigned s = 0; s < 4; ++s) error[x][s] = error_of(texels[4 * y + x], colors[s]);
    for (unsigned row = 0; row < 256; ++row)
      row_error[y][row] = error[0][row & 3] + error[1][row >> 2 & 3] + error[2][row >> 4 & 3] + error[3][row >> 6];
  }
  std::size_t best = 0;
  int least = std::numeric_limits<int>::max();
  for (std::size_t k = 0; k < book.size(); ++k) {
    const std::array<std::uint8_t, 4>& rows = book[k].rows;
    const int error = row_error[0][rows[0]] + row_error[1][rows[1]] + row_error[2][rows[2]] + row_error[3][rows[3]];
    if (error < least) least = error, best = k;
  }
  return static_cast<std::uint16_t>(best);
}

}  // namespace

Etc1sFit fit_etc1s(std::span<const TexelBlock> blocks) {
  Etc1sFit fit;
  std::vector<EndpointKey> endpoints(blocks.size());
  parallel_for(blocks.size(), [&](std::size_t i) {
    const Etc1sEndpoint e = fit_endpoint(blocks[i]);
    endpoints[i] = {e.red, e.green, e.blue, e.table};
  });
  const std::vector<std::uint16_t> endpoint_of = cluster_endpoints(endpoints, fit.endpoints);
  std::vector<SelectorKey> selectors(blocks.size());
  parallel_for(blocks.size(), [&](std::size_t i) {
    Etc1sSelector selector;
    choose_selectors(blocks[i], fit.endpoints[endpoint_of[i]], selector);
    for (unsigned t = 0; t < 16; ++t) selectors[i][t] = static_cast<std::uint8_t>(selector.at(t % 4, t / 4));
  });
  fit.selectors = cluster_selectors(selectors);
  fit.blocks.resize(blocks.size());
  parallel_for(blocks.size(), [&](std::size_t i) {
    fit.blocks[i] = {endpoint_of[i], nearest_selector(blocks[i], fit.endpoints[endpoint_of[i]], fit.selectors)};
  });
  return fit;
}

}  // namespace tessera::ktx2
