#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <unordered_map>
#include <vector>

#include "base/real.h"
#include "base/vector3.h"

// A scalar type for the programmable stages: lanes that compute, and record every operation.
namespace tessera::bench::traced {

enum class Operation : std::uint8_t { kGiven, kArithmetic, kDivision, kRoot, kTexelGather, kOtherGather };

// The operations of one group, each different one once.
class Trace {
 public:
  // `detail` tells operations of one kind apart; missing operands are 0.
  struct Node {
    Operation operation;
    std::uint64_t detail;
    std::array<std::uint32_t, 3> operands;
    bool operator==(const Node&) const = default;
  };

  // Returns the number of an operation, which is the same for the same operation on the same operands.
  std::uint32_t note(const Node& node) {
    const auto [at, is_new] = numbers_.try_emplace(node, static_cast<std::uint32_t>(nodes_.size()));
    if (is_new) nodes_.push_back(node);
    return at->second;
  }
  std::uint32_t note_input() { return note({Operation::kGiven, 1ull << 32 | nodes_.size(), {}}); }
  // Marks a result of the shader, or a value that decides its control flow.
  void need(std::uint32_t node) { needed_.push_back(node); }

  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<std::uint32_t>& needed() const { return needed_; }

  std::vector<const void*> texels;  // arrays that hold texels

 private:
  struct Hash {
    std::size_t operator()(const Node& n) const {
      std::uint64_t h = n.detail * 8 + static_cast<std::uint64_t>(n.operation);
      for (const std::uint32_t operand : n.operands) h = (h ^ operand) * 0x9E3779B97F4A7C15ull;
      return static_cast<std::size_t>(h ^ h >> 29);
    }
  };
  std::unordered_map<Node, std::uint32_t, Hash> numbers_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> needed_;
};
inline thread_local Trace* current = nullptr;

// Unused lanes hold the values of the last used one.
inline constexpr std::size_t kLanes = 16;

template <class T>
struct Lanes {
  std::array<T, kLanes> value;
  std::uint32_t node;
  Lanes() : Lanes(T()) {}
  Lanes(T v) {  // NOLINT: constants widen silently
    value.fill(v);
    std::uint64_t bits = 0;
    std::memcpy(&bits, &v, sizeof v);
    node = current->note({Operation::kGiven, bits, {}});
  }
  Lanes(const std::array<T, kLanes>& v, std::uint32_t n) : value(v), node(n) {}
  static Lanes load(const T* values) {
    Lanes out;
    std::copy_n(values, kLanes, out.value.begin());
    out.node = current->note_input();
    return out;
  }
};
using Real = Lanes<float>;
using Int = Lanes<std::int32_t>;
using Mask = Lanes<bool>;

// `name`: a number that is different for different operations.
template <class Result, class Function, class... Operands>
Lanes<Result> noted(Operation operation, std::uint64_t name, Function function, const Operands&... operands) {
  std::array<Result, kLanes> value;
  for (std::size_t k = 0; k < kLanes; ++k) value[k] = function(operands.value[k]...);
  return {value, current->note({operation, name, {operands.node...}})};
}
template <class Result, class Function, class... Operands>
Lanes<Result> arithmetic(std::uint64_t name, Function function, const Operands&... operands) {
  return noted<Result>(Operation::kArithmetic, name, function, operands...);
}

inline Real operator+(const Real& a, const Real& b) {
  return arithmetic<float>(
      1, [](float x, float y) { return x + y; }, a, b);
}
inline Real operator-(const Real& a, const Real& b) {
  return arithmetic<float>(
      2, [](float x, float y) { return x - y; }, a, b);
}
inline Real operator*(const Real& a, const Real& b) {
  return arithmetic<float>(
      3, [](float x, float y) { return x * y; }, a, b);
}
inline Real operator/(const Real& a, const Real& b) {
  return noted<float>(
      Operation::kDivision, 0, [](float x, float y) { return x / y; }, a, b);
}
inline Real real_sqrt(const Real& a) {
  return noted<float>(
      Operation::kRoot, 0, [](float x) { return tessera::real_sqrt(x); }, a);
}
inline Real real_abs(const Real& a) {
  return arithmetic<float>(
      4, [](float x) { return tessera::real_abs(x); }, a);
}
inline Real real_floor(const Real& a) {
  return arithmetic<float>(
      5, [](float x) { return tessera::real_floor(x); }, a);
}
inline Real real_min(const Real& a, const Real& b) {
  return arithmetic<float>(
      6, [](float x, float y) { return tessera::real_min(x, y); }, a, b);
}
inline Real real_max(const Real& a, const Real& b) {
  return arithmetic<float>(
      7, [](float x, float y) { return tessera::real_max(x, y); }, a, b);
}
inline Mask operator<(const Real& a, const Real& b) {
  return arithmetic<bool>(
      8, [](float x, float y) { return x < y; }, a, b);
}
inline Mask operator>(const Real& a, const Real& b) { return b < a; }
inline Mask operator<=(const Real& a, const Real& b) {
  return arithmetic<bool>(
      9, [](float x, float y) { return x <= y; }, a, b);
}
inline Mask operator>=(const Real& a, const Real& b) { return b <= a; }
inline Mask operator==(const Real& a, const Real& b) {
  return arithmetic<bool>(
      10, [](float x, float y) { return x == y; }, a, b);
}
inline Mask both(const Mask& a, const Mask& b) {
  return arithmetic<bool>(
      11, [](bool x, bool y) { return x && y; }, a, b);
}
template <class T>
Lanes<T> select(const Mask& mask, const Lanes<T>& a, const Lanes<T>& b) {
  return arithmetic<T>(
      12, [](bool m, T x, T y) { return m ? x : y; }, mask, a, b);
}
inline Mask is_finite(const Real& a) { return real_abs(a) <= Real(std::numeric_limits<float>::max()); }
inline bool any(const Mask& a) {
  current->need(a.node);
  return std::find(a.value.begin(), a.value.end(), true) != a.value.end();
}
inline bool all(const Mask& a) {
  current->need(a.node);
  return std::find(a.value.begin(), a.value.end(), false) == a.value.end();
}

inline Int operator+(const Int& a, const Int& b) {
  return arithmetic<std::int32_t>(
      13, [](std::int32_t x, std::int32_t y) { return x + y; }, a, b);
}
inline Int operator-(const Int& a, const Int& b) {
  return arithmetic<std::int32_t>(
      14, [](std::int32_t x, std::int32_t y) { return x - y; }, a, b);
}
inline Int operator*(const Int& a, const Int& b) {
  return arithmetic<std::int32_t>(
      15, [](std::int32_t x, std::int32_t y) { return x * y; }, a, b);
}
inline Mask operator<(const Int& a, const Int& b) {
  return arithmetic<bool>(
      16, [](std::int32_t x, std::int32_t y) { return x < y; }, a, b);
}
inline Mask operator>=(const Int& a, const Int& b) {
  return arithmetic<bool>(
      17, [](std::int32_t x, std::int32_t y) { return x >= y; }, a, b);
}
inline Mask operator==(const Int& a, const Int& b) {
  return arithmetic<bool>(
      18, [](std::int32_t x, std::int32_t y) { return x == y; }, a, b);
}
inline Int bit_and(const Int& a, const Int& b) {
  return arithmetic<std::int32_t>(
      19, [](std::int32_t x, std::int32_t y) { return x & y; }, a, b);
}
inline Int shift_right(const Int& a, int by) {
  return arithmetic<std::int32_t>(
      100 + static_cast<std::uint64_t>(by), [by](std::int32_t x) { return tessera::shift_right(x, by); }, a);
}
inline Int to_int(const Real& a) {
  return arithmetic<std::int32_t>(
      20, [](float x) { return tessera::to_int(x); }, a);
}
inline Real to_float(const Int& a) {
  return arithmetic<float>(
      21, [](std::int32_t x) { return tessera::to_float(x); }, a);
}
inline std::int32_t first_lane(const Int& a) {
  current->need(a.node);
  return a.value[0];
}
template <class T>
void store_lanes(const Lanes<T>& a, T*) {
  current->need(a.node);
}

template <class T>
Lanes<T> gather(const T* values, const Int& at) {
  bool texels = false;
  for (const void* array : current->texels) texels |= array == values;
  return noted<T>(
      texels ? Operation::kTexelGather : Operation::kOtherGather, reinterpret_cast<std::uintptr_t>(values),
      [values](std::int32_t i) { return values[i]; }, at);
}

// A function that compiles to `length` dependent instructions.
template <class Function>
Real chain(std::uint64_t name, int length, Function function, const Real& a) {
  Real out = arithmetic<float>(name, function, a);
  for (int k = 1; k < length; ++k) out.node = current->note({Operation::kArithmetic, name, {out.node}});
  return out;
}
// A conversion, a sum, a shift.
inline Real power_of_two(const Real& n) {
  return chain(
      22, 3, [](float x) { return tessera::power_of_two(x); }, n);
}
// A difference, a shift and a conversion; a shift and a difference.
inline void split_exponent(const Real& a, Real& mantissa, Real& exponent) {
  const auto part = [](float x, bool wants_mantissa) {
    float m = 0, e = 0;
    tessera::split_exponent(x, m, e);
    return wants_mantissa ? m : e;
  };
  const Real given = a;  // one of the results may alias it
  exponent = chain(
      23, 3, [&](float x) { return part(x, false); }, given);
  mantissa = chain(
      24, 2, [&](float x) { return part(x, true); }, given);
}
inline Real round_to_half(const Real&) { throw std::runtime_error("attributes in half floats are not traced"); }

}  // namespace tessera::bench::traced
